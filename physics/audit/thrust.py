"""Power under thrust: the motion gains no more than the thrusters give."""

from typing import ClassVar, final

import numpy as np

from ..energy import MARGIN, coasting_power
from ..forces import held_thrust
from ..frames import Array
from ..matrices import thruster_matrix
from .base import Law, Ruling, in_words
from .gain import asked, hunted, joined
from .search import Box
from .witness import EXACT, TOLD, Witness

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

        def gained(x: Array) -> Array:
            return coasting_power(witness.mass, x[:, :3], witness.relative(x[:, :4], x[:, 4:]))

        def allowed(x: Array) -> Array:
            full = witness.full_power(x)
            return np.maximum(driven_power(witness, x), witness.tolerance * full) + EXACT * full

        states = np.concatenate([witness.states, self._drawn(witness)], axis=1)
        alone = states[: states.shape[0] // 4].copy()
        alone[:, :3] *= np.random.default_rng([witness.seed, 15]).random((alone.shape[0], 3)) < 0.5
        known = asked(states, gained, allowed)
        share = float((known.over > 0.0).mean())
        known = joined(known, asked(alone, gained, allowed))
        proof = witness.prove().how if witness.exact and not known.broken else None
        if proof is None:
            box = witness.ascended()
            low, high = witness.commands.min(axis=0), witness.commands.max(axis=0)
            whole = Box(np.append(box.low, low), np.append(box.high, high))
            known = hunted(witness, known, whole, gained, allowed)
        free = np.maximum(driven_power(witness, known.states), 0.0) + TOLD * witness.full_power(known.states)
        k, gains = known.told(witness, free)
        value, limit, state = float(known.gained[k]), float(known.allowed[k]), known.states[k]
        at = witness.place(state[:4])
        pushed = {t.channel: float(c) for t, c in zip(witness.vehicle.thrusters, state[4:], strict=True)}
        told = f"{in_words(at)}, {', '.join(f'{name} {c:.3g}' for name, c in pushed.items())}"
        giver = "the thrusters give" if witness.exact else "thrusters half as strong again would give"
        how = f"proved: {proof}" if proof else f"searched, {known.gained.size} states with commands"
        kept = f"Under thrust the motion gains no more power than {giver} ({how})."
        if gains:
            kept = (
                f"Under thrust the motion gains no more power than {giver}, or 1 % of full thrust ({how}); it gains "
                f"{value:.3g} W at {told}, where {limit:.3g} W is let pass."
            )
        return self.rule(
            value=value,
            limit=limit,
            unit="W",
            at=at | pushed,
            share=share,
            proof=proof or "search",
            kept=kept,
            broken=f"Under thrust the model gains {value:.3g} W at {told}, where the thrusters may give {limit:.3g} W.",
        )

    @staticmethod
    def _drawn(witness: Witness) -> Array:
        """A command for each of the states (samples, thrusters): three in four that it may meet, else corners."""
        rng = np.random.default_rng([witness.seed, 13])
        count, pool = witness.states.shape[0], witness.commands
        drawn = pool[rng.integers(0, pool.shape[0], count)]
        ends = np.stack([pool.min(axis=0), pool.max(axis=0)])
        corners = ends[rng.integers(0, 2, (count // 4, pool.shape[1])), np.arange(pool.shape[1])]
        drawn[rng.choice(count, corners.shape[0], replace=False)] = corners
        return drawn


def driven_power(witness: Witness, states: Array) -> Array:
    """Power [W] that the thrusters may put in at states with commands (n, 4 + thrusters); negative where they brake."""
    nu, commands = states[:, :3], states[:, 4:]
    thrust, load = held_thrust(witness.vehicle, commands)
    thrust = thrust - load * nu[:, 0]
    reach = thruster_matrix(witness.vehicle)
    driven = (nu * (reach @ thrust).T).sum(axis=1)
    if witness.exact:
        return driven
    most = np.maximum(np.abs(reach).max(axis=1), (1.0, ASKEW, 0.0))
    return driven + (MARGIN - 1.0) * (np.abs(nu) @ most) * np.abs(thrust).sum(axis=0)
