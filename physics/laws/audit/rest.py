"""Rest stays at rest: no command, no speed, no current and no wind, hence no acceleration."""

from typing import ClassVar, final

import numpy as np

from ...forces import calm
from ...motion import ACCELERATION_UNITS, AXES
from ..energy import TOLERANCE
from .base import TOLD, Law, Ruling, Witness

_HEADINGS = (72, 2880)
"""Headings that are asked: a network with a memory, and a model that answers fast, whose windows may be narrow."""


@final
class Rest(Law):
    """Without a command a boat at rest in its water stays; a push of a hundredth of full thrust is let pass.

    Current, wind and trim that the vehicle file states are taken out first, and named.
    """

    name: ClassVar[str] = "rest stays at rest"
    place: ClassVar[int] = 60

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        count = _HEADINGS[witness.dense > 0]
        states = np.zeros((count, 4))
        states[:, 3] = np.arange(count) * 2.0 * np.pi / count
        said = witness.relative(states)
        full = witness.full_force / np.diag(witness.mass)
        ratio = np.abs(said) / full
        k, axis = (int(i) for i in np.unravel_index(int(np.argmax(ratio)), ratio.shape))
        unit = ACCELERATION_UNITS[axis]
        value, at = float(abs(said[k, axis])), witness.place(states[k])
        stated = [
            s.replace("_", " ")
            for s in witness.vehicle.environment
            if witness.vehicle.value(s) != calm(witness.vehicle).value(s)
        ]
        beside = f" beside what the vehicle file states ({', '.join(stated)})" if stated else ""
        name, limit = AXES[axis], TOLERANCE * float(full[axis])
        kept = f"A boat at rest without a command stays at rest{beside}."
        if value > TOLD * full[axis]:
            kept = (
                f"At rest and without a command the model pushes itself in {name} with {value:.3g} {unit}{beside}, "
                f"less than {limit:.3g} {unit}, 1 % of full thrust, which is let pass."
            )
        return self.rule(
            value=value,
            limit=limit,
            unit=unit,
            at=at,
            share=float((ratio > TOLERANCE).any(axis=1).mean()),
            proof="by construction" if witness.exact and value == 0.0 else "search",
            kept=kept,
            broken=f"At rest and without a command the model pushes itself in {name} with {value:.3g} {unit}{beside}, "
            f"where {limit:.3g} {unit} is let pass.",
        )
