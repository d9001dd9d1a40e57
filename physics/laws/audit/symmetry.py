"""Mirror symmetry: what holds to starboard holds to port."""

from typing import ClassVar, final

import numpy as np

from ...motion import AXES
from ...vehicle import Vehicle
from .base import Law, Ruling, Witness, in_words

SHARE = 0.1
"""Difference between the sides, as a share of full thrust, from which a boat is called lopsided: chosen and not
derived, since the law does not count."""
_SIGNS = np.array([1.0, -1.0, -1.0])
"""Of surge, sway and yaw in a mirror that stands on the centre line."""


@final
class MirrorSymmetry(Law):
    """The force at mirrored velocities and commands is the mirrored force, up to a tenth of full thrust.

    It does not count: a worn propeller, a bent rudder or weed on one side are physics, and a model is right to have
    them. The verdict tells how lopsided the model is.
    """

    name: ClassVar[str] = "mirror symmetry"
    place: ClassVar[int] = 90
    counts: ClassVar[bool] = False

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        states = witness.states
        mirrored = states * np.append(_SIGNS, 1.0)
        pairs = mirror_pairs(witness.vehicle)
        rng = np.random.default_rng([witness.seed, 5])
        driven = None if pairs is None else witness.commands[rng.integers(0, witness.commands.shape[0], len(states))]
        swapped = None if driven is None or pairs is None else driven[:, pairs]
        one, other = (witness.relative(x, c) @ witness.mass.T for x, c in ((states, driven), (mirrored, swapped)))
        values = np.abs(one - other * _SIGNS) / witness.full_force
        if pairs is not None:
            coast = [x @ witness.mass.T for x in (witness.coasting, witness.relative(mirrored))]
            values = np.maximum(values, np.abs(coast[0] - coast[1] * _SIGNS) / witness.full_force)
        worst = values.max(axis=1)
        k = int(np.argmax(worst))
        at, value, axis = witness.place(states[k]), float(worst[k]), AXES[int(np.argmax(values[k]))]
        text = f"{100.0 * value:.2g} % of full thrust, in {axis}"
        return self.rule(
            value=value,
            limit=SHARE,
            unit="share of full thrust",
            at=at,
            share=float((worst > SHARE).mean()),
            kept=(f"Port and starboard differ by at most {text}" if value > 1e-6 else "Port and starboard are alike")
            + (" (hull alone)." if pairs is None else "."),
            broken=f"Port and starboard differ by {text}, at {in_words(at)}. A real boat may; the law does not count.",
        )


def mirror_pairs(vehicle: Vehicle) -> list[int] | None:
    """For each thruster the number of the one at its mirrored place; None where one has no such partner."""
    if any(t.push[0] == 0.0 for t in vehicle.thrusters):
        return None  # a force abeam or a moment alone is mirrored by its sign, not by a place
    result = []
    for t in vehicle.thrusters:
        partner = [
            k
            for k, o in enumerate(vehicle.thrusters)
            if abs(o.x - t.x) + abs(o.y + t.y) + abs(o.angle + t.angle) < 1e-6 and o.command == t.command
        ]
        if len(partner) != 1:
            return None
        result.append(partner[0])
    return result
