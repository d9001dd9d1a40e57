"""Positive mass: kinetic energy is positive whatever the motion."""

from typing import ClassVar, final

import numpy as np

from .base import Law, Ruling
from .witness import Witness


@final
class PositiveMass(Law):
    """The mass matrix is positive definite (Fossen 2021, property 6.1), in units of the rigid body."""

    name: ClassVar[str] = "positive mass"

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        v = witness.vehicle
        size = np.sqrt([v.mass, v.mass, v.inertia_z])
        least = float(np.linalg.eigvalsh(witness.mass / np.outer(size, size)).min())
        if least > 1e-9 and not witness.own_mass:
            return self.pass_over(
                f"The model has no mass of its own; that of vehicle {v.name}, by which its power is counted, is "
                f"positive definite (least {least:.2g} of the rigid body's)."
            )
        return self.rule(
            value=-least,
            limit=-1e-9,
            unit="of the rigid body's",
            at=None,
            share=None,
            proof="eigenvalues",
            kept=f"The mass matrix is positive definite: the least mass is {least:.2g} of the rigid body's.",
            broken=f"The mass matrix is not positive definite (least mass {least:.2g} of the rigid body's): a motion "
            "would have no energy. Added mass carries its sign.",
        )
