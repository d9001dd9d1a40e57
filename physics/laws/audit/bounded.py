"""Bounded speed: bounded thrust makes bounded motion, and not a much faster one than that thrust can give."""

from typing import ClassVar, final

import numpy as np

from ...motion import Array
from ..energy import coasting_power
from .base import EXACT, Law, Ruling, Witness, finite
from .trial import SECONDS, STEPS, rolled, settling, trial_commands, trial_motion

MOST = 3.0
"""Multiple of the speed and yaw rate in question that no rollout may exceed: drag that grows linearly lets a thrust
that is three times too strong reach it, and no thruster is that."""
_FAR = 1e3
"""Multiple of the envelope at which drag must have outgrown thrust: what does not brake there never does."""
_PATIENCE = 4.0
"""Multiple of the time in which the vehicle file settles for which a function is rolled out: what nothing brakes then
goes far beyond what settles."""


@final
class BoundedSpeed(Law):
    """Open-loop rollouts from rest under held and random commands stay within three times what can be expected.

    That is the speed of the envelope or, where faster, the speed at which the vehicle file settles in the same trial:
    a log may be slow. A vehicle whose own speeds do not settle tells nothing, then the envelope alone does; and of a
    formula, which is its vehicle file, just that is asked. Speed through the water and yaw rate are judged, not sway
    alone, which in a log may hardly move. A trial lasts 60 s or, for a slow ship, as long as its speeds need to settle.
    """

    name: ClassVar[str] = "bounded speed"
    place: ClassVar[int] = 70

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        expected = settling(witness.vehicle, witness.commands, witness.seed)
        commands, held = trial_commands(witness.commands, witness.seed)
        fastest, quickest, source = float(np.hypot(*witness.reach[:2])), float(witness.reach[2]), "the envelope"
        if expected.settles and (expected.speed > fastest or expected.turning > quickest):
            fastest, quickest = max(fastest, expected.speed), max(quickest, expected.turning)
            source = "the envelope and the vehicle file under the same commands"
        if witness.exact:
            seconds, velocity = expected.seconds, expected.velocity
            wild = np.full(commands.shape[0], not expected.settles or _unbraked(witness, commands[:held, 0]))
        else:
            seconds = _PATIENCE * expected.seconds if expected.settles else SECONDS
            if witness.rollout is not None:
                seconds = STEPS * witness.time_step
            velocity, wild = _met(witness, commands, held, seconds)
        speed = np.linalg.norm(velocity[..., :2], axis=-1).max(axis=1)
        turning = np.abs(velocity[..., 2]).max(axis=1)
        ratio = np.maximum(speed / fastest, turning / quickest)
        ratio = np.where(wild | ~np.isfinite(ratio), np.inf, ratio)
        k = int(np.argmax(ratio))
        worst = finite(float(ratio[k]))
        which = "held commands" if k < held else "random commands"
        last = velocity[k, -1]
        at = {"u": float(last[0]), "v": float(last[1]), "r": float(last[2])}
        seen = f"{ratio.size} rollouts of {seconds:g} s"
        if seconds > SECONDS and witness.rollout is None:
            seen = f"{held} rollouts of {seconds:g} s and {ratio.size - held} of {SECONDS:g} s"
        much = f"the boat goes {worst:.2g} times as fast as {source}"
        if np.isinf(ratio).any():
            much = "speeds grow without bound"
        most = f"{float(speed.max()):.3g} m/s and {float(turning.max()):.3g} rad/s"
        compared = f"{max(worst, 0.0):.2g} times as fast as {source}, where {MOST:g} times are let pass"
        if witness.exact and expected.settles:
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


def _unbraked(witness: Witness, commands: Array) -> bool:
    """True when motion along some axis, far faster than the envelope, still gains power under a command that lasts.

    A rollout need not tell: rounding lets a hull leave a straight course long before its speed is out of bounds.
    """
    sides = np.concatenate([np.diag(witness.reach), -np.diag(witness.reach)]) * _FAR
    states = np.repeat(np.pad(sides, ((0, 0), (0, 1))), len(commands), axis=0)
    gained = coasting_power(witness.mass, states[:, :3], witness.relative(states, np.tile(commands, (len(sides), 1))))
    return bool((gained > EXACT * witness.full_power(states)).any())


def _met(witness: Witness, commands: Array, held: int, seconds: float) -> tuple[Array, np.ndarray]:
    """Velocities relative to the water (starts, rows, 3) under the commands of a trial, and which starts diverge."""
    if witness.rollout is not None:  # a network knows one rate
        motion, starts = trial_motion(witness.vehicle, commands, witness.time_step)
        done = witness.rollout(motion, starts, commands.shape[1] - 1)
        p = witness.vehicle.values
        drift = float(np.hypot(p["current_north"], p["current_east"]))
        velocity = done.states[..., 3:].copy()
        speed = np.linalg.norm(velocity[..., :2], axis=-1, keepdims=True)
        velocity[..., :2] *= np.maximum(speed - drift, 0.0) / np.maximum(speed, 1e-12)
        return velocity, done.diverged

    def answer(nu: Array, psi: Array, asked: Array) -> Array:
        return witness.relative(np.column_stack([nu, psi]), asked)

    lasting, random = rolled(answer, commands[:held], seconds), rolled(answer, commands[held:], SECONDS)
    velocity = np.concatenate([lasting.states[..., 3:], random.states[..., 3:]])
    return velocity, np.concatenate([lasting.diverged, random.diverged])
