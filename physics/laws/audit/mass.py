"""Positive mass: kinetic energy is positive whatever the motion, so that a push moves a boat the way it pushes."""

from typing import ClassVar, final

import numpy as np

from ...forces import held_thrust
from ...momentum_balance import thruster_matrix
from ..damping_power import mass_margin
from ..energy import TOLERANCE
from .base import Law, Ruling, Witness
from .bounded import possible_commands

_FEW = 512
"""Commands with which a boat at rest is pushed, of those that are possible: nearly all of four thrusters (625)."""
_WEAK = 0.05
"""Pushes weaker than this share of the strongest tell nothing: a network pushes itself by a hundredth (`rest`), which
would decide their sign."""


@final
class PositiveMass(Law):
    """The mass matrix is positive definite (Fossen 2021, property 6.1), in units of the rigid body.

    A model without a mass of its own is asked what can be seen of it: thrusters push it, at rest, and it must not go
    against the push. With a force tau and an acceleration M^-1 tau the product of the two is tau^T M^-1 tau, which is
    positive where M is; it is counted as a share of what the mass of the vehicle file gives.
    """

    name: ClassVar[str] = "positive mass"
    place: ClassVar[int] = 10

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        least = mass_margin(witness.vehicle)
        if least > 1e-9 and not witness.own_mass:
            return self._pushed(witness, least)
        return self.rule(
            value=-least,
            limit=-1e-9,
            unit="of the rigid body's",
            proof="eigenvalues",
            kept=f"The mass matrix is positive definite: the least mass is {least:.2g} of the rigid body's.",
            broken=f"The mass matrix is not positive definite (least mass {least:.2g} of the rigid body's): a motion "
            "would have no energy. Added mass carries its sign.",
        )

    def _pushed(self, witness: Witness, least: float) -> Ruling:
        """The ruling on a model that is pushed by its thrusters."""
        low, high = witness.commands.min(axis=0), witness.commands.max(axis=0)
        commands = np.clip(possible_commands(witness.vehicle, witness.seed)[:_FEW], low, high)
        commands = np.concatenate(
            [np.where(np.eye(len(low)) > 0, end, witness.neutral) for end in (low, high)] + [commands]
        )
        force = held_thrust(witness.vehicle, commands)[0].T @ thruster_matrix(witness.vehicle).T
        expected = (force * (force @ np.linalg.inv(witness.mass))).sum(axis=1)
        told = expected > _WEAK**2 * expected.max()
        if not told.any():
            return self.pass_over("The commands do not push, so nothing tells of the mass.")
        commands, force, expected = commands[told], force[told], expected[told]
        at_rest = np.zeros((len(commands), 4))
        moved = witness.relative(at_rest, commands) - witness.relative(at_rest)
        share = (force * moved).sum(axis=1) / expected
        k = int(np.argmin(share))
        at = {t.channel: float(c) for t, c in zip(witness.vehicle.thrusters, commands[k], strict=True)}
        pushed = ", ".join(f"{name} {c:.3g}" for name, c in at.items())
        return self.rule(
            value=-float(share[k]),
            limit=TOLERANCE,
            unit="times the expected",
            at={"u": 0.0, "v": 0.0, "r": 0.0} | at,
            share=float((share < -TOLERANCE).mean()),
            kept=f"Pushed by its thrusters at rest, the model goes the way it is pushed, at the least {share[k]:.2g} "
            f"times as much as vehicle {witness.vehicle.name}. It has no mass of its own; that of the vehicle, by "
            f"which its power is counted, is positive definite (least {least:.2g} of the rigid body's).",
            broken=f"Pushed by its thrusters at rest ({pushed}), the model goes against the push: {share[k]:.2g} times "
            f"as much as vehicle {witness.vehicle.name}, as with a mass that is not positive.",
        )
