"""Power under thrust: the motion gains no more than the thrusters give."""

from typing import ClassVar, final

import numpy as np

from ..energy import MARGIN, coasting_power
from ..forces import held_thrust
from ..frames import Array
from ..matrices import thruster_matrix
from .base import Law, Ruling, Witness, in_words
from .search import climb

ASKEW = 0.1
"""Side force of a thruster that is counted with even where the file has none [N/N]."""


@final
class PowerUnderThrust(Law):
    """The power nu^T M nu_dot is at most what the thrusters put in, everywhere in the envelope, whatever the command.

    In a model that was learnt each thruster may push half as hard again on every axis as the strongest one does there
    by the vehicle file, and be mounted a little askew. Thrust that brakes need not brake, but nothing is gained.
    """

    name: ClassVar[str] = "power under thrust"

    def judge(self, witness: Witness) -> Ruling:
        """See `Law.judge`."""
        rng = np.random.default_rng([witness.seed, 13])
        drawn = witness.commands[rng.integers(0, witness.commands.shape[0], witness.states.shape[0])]
        states = np.concatenate([witness.states, drawn], axis=1)
        reach = witness.reach

        def keen(x: Array) -> Array:
            return surplus_power(witness, x) / (((x[:, :3] / reach) ** 2).sum(axis=1) + 1e-3)

        found = surplus_power(witness, states)
        limit = witness.tolerance * witness.power_scale
        share = float((found > limit).mean())
        proof = witness.prove(1.0, limit).how if witness.exact and found.max() <= limit else None
        if proof is None:
            more = climb(keen, states, keen(states), witness.box())
            states, found = np.concatenate([states, more]), np.concatenate([found, surplus_power(witness, more)])
        k = int(np.argmax(found))
        worst, at = float(found[k]), witness.place(states[k, :4])
        at |= {t.channel: float(c) for t, c in zip(witness.vehicle.thrusters, states[k, 4:], strict=True)}
        return self.rule(
            value=worst,
            limit=limit,
            unit="W",
            at=at,
            share=share,
            proof=proof or "search",
            kept="Under thrust the motion gains no more power than the thrusters give.",
            broken=f"Under thrust the model gains {worst:.3g} W more than the thrusters give, at {in_words(at)}.",
        )


def surplus_power(witness: Witness, states: Array) -> Array:
    """Power [W] beyond that of the thrusters at states with commands (n, 4 + thrusters); negative for less."""
    nu, commands = states[:, :3], states[:, 4:]
    thrust, load = held_thrust(witness.vehicle, commands)
    thrust = thrust - load * nu[:, 0]
    reach = thruster_matrix(witness.vehicle)
    driven = (nu * (reach @ thrust).T).sum(axis=1)
    if not witness.exact:
        most = np.maximum(np.abs(reach).max(axis=1), (1.0, ASKEW, 0.0))
        driven = driven + (MARGIN - 1.0) * (np.abs(nu) @ most) * np.abs(thrust).sum(axis=0)
    gained = coasting_power(witness.mass, nu, witness.relative(states[:, :4], commands))
    return gained - np.maximum(driven, 0.0)
