"""Energy balance along the log: no more kinetic energy than thrusters, wind and trim have put in."""

from typing import ClassVar, final

import numpy as np

from ...forces import ForceEquation, memory_states, stated_push, through_water
from ...motion import Array, Motion
from ..energy import MARGIN, TOLERANCE, coasting_power, thrust_power
from .base import EXACT, Law, Ruling, Witness, in_words, let_pass

WINDOW = 5.0
"""Length of the stretches over which energy is counted [s]: noise is averaged out, and a gain is still that of one
manoeuvre."""


@final
class EnergyBalance(Law):
    """Over each 5 s of the log the model gains at most the thrusters' work and that of the stated environment.

    A formula is held to its own thrust; of a network, which may have learnt that the thrust of the vehicle file is too
    small, half as much again is allowed, as in training. Powers are means over a stretch.
    """

    name: ClassVar[str] = "energy balance"
    place: ClassVar[int] = 50

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        motions = [m for m in witness.motions if m.duration >= WINDOW]
        if not motions:
            return self.pass_over("Needs a log: name one after the model.")
        margin = 1.0 if witness.exact else MARGIN
        found, scale = [], []
        for motion in motions:
            gained, given = self._powers(witness, motion, margin)
            rows = max(2, round(WINDOW / motion.time_step))
            starts = np.arange(0, motion.time.size - rows + 1, max(1, rows // 5))
            total = np.concatenate([[0.0], np.cumsum(gained - given)])
            over = (total[starts + rows] - total[starts]) / rows
            found += [(float(x), motion, int(k), rows) for x, k in zip(over, starts, strict=True)]
            scale.append(gained**2)
        tolerance = TOLERANCE if witness.vehicle.memory else witness.tolerance
        limit = tolerance * max(float(np.sqrt(np.concatenate(scale).mean())), 1e-9)
        worst, motion, start, rows = max(found, key=lambda each: each[0])
        most = "it is given" if witness.exact else "thrusters 1.5 times as strong or as weak would give it"
        kept = f"Along the log the model never gains more energy than {most} ({len(found)} stretches of 5 s)."
        if worst > EXACT * limit / tolerance:
            kept = (
                f"In {len(found)} stretches of 5 s the model gains at most {worst:.3g} W more than {most}, within the "
                f"tolerance of {limit:.3g} W, {100.0 * tolerance:g} % of the typical power along the log."
            )
        begin, end = float(motion.time[start]), float(motion.time[start + rows - 1])
        u, v, r = (float(x) for x in motion.velocity[start : start + rows].mean(axis=0))
        at = {"from": begin, "to": end, "u": u, "v": v, "r": r}
        return self.rule(
            value=worst,
            limit=limit,
            at=at,
            share=float(np.mean([x > limit for x, *_ in found])),
            proof="data only",
            kept=kept,
            broken=f"From {begin:.1f} to {end:.1f} s of {motion.source or 'the log'} the model gains {worst:.3g} W "
            f"more than thrusters and stated environment give, at {in_words(at)} on average{let_pass(witness, limit)}.",
        )

    @staticmethod
    def _powers(witness: Witness, motion: Motion, margin: float) -> tuple[Array, Array]:
        """Power that the model gains along a motion, and power that it is given [W], (n,) each."""
        vehicle = witness.vehicle
        nu = np.stack(through_water(vehicle, motion), axis=-1)
        psi, idle = motion.heading, 0.0 * motion.heading
        moving = (tuple(nu.T), tuple(motion.velocity.T))
        turn = np.stack(ForceEquation(vehicle).acceleration((idle, idle, idle), *moving, psi), axis=-1)
        gained = coasting_power(witness.mass, nu, witness.along(motion) - turn)
        air = None if motion.air is None else (motion.air[:, 0], motion.air[:, 1])
        outside = (nu * stated_push(vehicle, motion.heading, tuple(nu.T), air, motion.minutes)).sum(axis=1)
        driven = thrust_power(vehicle, motion)
        given = np.maximum(margin * driven, driven / margin) + outside
        if not vehicle.memory:
            return gained, given
        p = vehicle.values  # a wake stores gain T y^2 / 2 of each filtered velocity y, and gives it back
        sway, yaw = memory_states(vehicle, motion)
        stored = 0.5 * p["memory_time"] * (p["memory_sway"] * sway**2 + p["memory_yaw"] * yaw**2)
        return gained + np.gradient(stored, motion.time_step), given
