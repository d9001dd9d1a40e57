"""Bounded speed: bounded thrust makes bounded motion, and not a much faster one than that thrust can give."""

from typing import ClassVar, final

import numpy as np

from .base import Law, Ruling, finite
from .trial import settling_speeds, trial
from .witness import Witness

MOST = 3.0
"""Multiple of the speed and yaw rate in question that no rollout may exceed."""
_SECONDS = 60.0


@final
class BoundedSpeed(Law):
    """Open-loop rollouts of 60 s from rest under held and random commands stay within three times what can be expected.

    That is the speed of the envelope or, where faster, the speed at which the vehicle file settles in the same trial:
    a log may be slow. A vehicle whose own speeds do not settle tells nothing, then the envelope alone does. Speed
    through the water and yaw rate are judged, not sway alone, which in a log may hardly move.
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
        quickest, source = float(witness.reach[2]), "the envelope"
        settled = settling_speeds(witness.vehicle, witness.commands, witness.seed)
        if settled is not None and (settled[0] > fastest or settled[1] > quickest):
            fastest, quickest = max(fastest, settled[0]), max(quickest, settled[1])
            source = "the envelope and the vehicle file under the same commands"
        ratio = np.maximum((speed - stream) / fastest, turning / quickest)
        ratio = np.where(done.diverged | ~np.isfinite(ratio), np.inf, ratio)
        k = int(np.argmax(ratio))
        worst = finite(float(ratio[k]))
        which = "held commands" if k < held else "random commands"
        last = done.states[k, -1]
        at = {"u": float(last[3]), "v": float(last[4]), "r": float(last[5])}
        seen = f"{starts.size} rollouts of {_SECONDS:g} s"
        diverged = int(np.isinf(ratio).sum())
        much = "speeds grow without bound" if diverged else f"the boat goes {worst:.2g} times as fast as {source}"
        most = f"{float((speed - stream).max()):.3g} m/s and {float(turning.max()):.3g} rad/s"
        compared = f"{max(worst, 0.0):.2g} times as fast as {source}, where {MOST:g} times are let pass"
        if witness.exact and settled is not None:
            compared = "and its speeds settle under commands that are held"
        return self.rule(
            value=worst,
            limit=MOST,
            unit="times the expected",
            at=at,
            share=float((ratio > MOST).mean()),
            proof="search",
            kept=f"In {seen} under bounded thrust the boat reaches {most}, {compared}.",
            broken=f"Under {which} {much} ({int((ratio > MOST).sum())} of {seen}; {MOST:g} times are let pass).",
        )
