"""Bounded speed: bounded thrust makes bounded motion, and not a much faster one than was ever seen."""

from typing import ClassVar, final

import numpy as np

from .base import Law, Ruling, Witness, finite
from .trial import trial

MOST = 3.0
"""Multiple of the envelope's speed and yaw rate that no rollout may exceed."""
_SECONDS = 60.0


@final
class BoundedSpeed(Law):
    """Open-loop rollouts of 60 s from rest under held and random commands stay within three times the envelope.

    Speed through the water and yaw rate are judged, not sway alone, which in a log may hardly move.
    """

    name: ClassVar[str] = "bounded speed"

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        step = witness.time_step
        steps = round(_SECONDS / step)
        motion, starts, held = trial(witness.vehicle, witness.commands, step, steps, witness.seed)
        done = witness.rollout(motion, starts, steps)
        p = witness.vehicle.values
        stream = float(np.hypot(p["current_north"], p["current_east"]))
        speed = np.linalg.norm(done.states[..., 3:5], axis=-1).max(axis=1)
        turning = np.abs(done.states[..., 5]).max(axis=1)
        fastest = float(np.hypot(*witness.reach[:2]))
        ratio = np.maximum((speed - stream) / fastest, turning / witness.reach[2])
        ratio = np.where(done.diverged | ~np.isfinite(ratio), np.inf, ratio)
        k = int(np.argmax(ratio))
        worst = finite(float(ratio[k]))
        which = "held commands" if k < held else "random commands"
        last = done.states[k, -1]
        at = {"u": float(last[3]), "v": float(last[4]), "r": float(last[5])}
        seen = f"{starts.size} rollouts of {_SECONDS:g} s"
        diverged = int(np.isinf(ratio).sum())
        much = "speeds grow without bound" if diverged else f"the boat goes {worst:.2g} times as fast as the envelope"
        return self.rule(
            value=worst,
            limit=MOST,
            unit="times the envelope",
            at=at,
            share=float((ratio > MOST).mean()),
            proof="search",
            kept=f"In {seen} under bounded thrust speeds stay within {max(worst, 0.0):.2g} times the envelope.",
            broken=f"Under {which} {much} ({int((ratio > MOST).sum())} of {seen}).",
        )
