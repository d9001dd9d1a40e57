"""Power under thrust: the motion gains no more than the thrusters give."""

from dataclasses import replace
from itertools import product
from typing import ClassVar, final

import numpy as np

from ...forces import held_thrust
from ...momentum_balance import thruster_matrix
from ...motion import Array
from ..energy import coasting_power, most_driven
from .base import EXACT, TOLD, Law, Ruling, Witness, in_words
from .dissipation import evaluate_gains, join_gains, search_gains
from .search import Box

_SLOW = 0.02
"""Speed at which a push at rest is tried, as a share of the envelope: fast enough for a power, and drag is still
nothing."""
_KEEN = 256
"""Number of pushes at rest that are tried."""


@final
class PowerUnderThrust(Law):
    """The power nu^T M nu_dot is at most what the thrusters put in, everywhere in the envelope, whatever the command.

    In a model that was learnt each thruster may push half as hard again on every axis as the strongest one does there
    by the vehicle file, and be mounted a little askew. Thrust that brakes need not brake, but nothing is gained.
    """

    name: ClassVar[str] = "power under thrust"
    place: ClassVar[int] = 40

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
        known = evaluate_gains(states, gained, allowed)
        share = float((known.over > 0.0).mean())
        known = join_gains(known, evaluate_gains(alone, gained, allowed))
        proof = witness.prove().how if witness.exact and not known.broken else None
        if proof is None:
            box = witness.ascended()
            ends = Box(witness.commands.min(axis=0), witness.commands.max(axis=0))
            known = join_gains(known, evaluate_gains(witness.densely(1.0, ends), gained, allowed))
            known = join_gains(known, evaluate_gains(pushed_off(witness, ends), gained, allowed))
            whole = Box(np.append(box.low, ends.low), np.append(box.high, ends.high))
            known = search_gains(witness, known, whole, gained, allowed)
        free = np.maximum(driven_power(witness, known.states), 0.0) + TOLD * witness.full_power(known.states)
        k, gains = known.worst(witness, free)
        value, limit, state = float(known.gained[k]), float(known.allowed[k]), known.states[k]
        at = witness.place(state[:4])
        pushed = {t.channel: float(c) for t, c in zip(witness.vehicle.thrusters, state[4:], strict=True)}
        text = f"{in_words(at)}, {', '.join(f'{name} {c:.3g}' for name, c in pushed.items())}"
        giver = "the thrusters give" if witness.exact else "thrusters half as strong again would give"
        how = f"proved: {proof}" if proof else f"searched, {known.gained.size} states with commands"
        kept = f"Under thrust the motion gains no more power than {giver} ({how})."
        if gains:
            kept = (
                f"Under thrust the motion gains no more power than {giver}, or 1 % of full thrust ({how}); it gains "
                f"{value:.3g} W at {text}, where {limit:.3g} W is let pass."
            )
        ruling = self.rule(
            value=value,
            limit=limit,
            at=at | pushed,
            share=share,
            proof=proof or "search",
            kept=kept,
            broken=f"Under thrust the model gains {value:.3g} W at {text}, where the thrusters may give {limit:.3g} W.",
        )
        return replace(ruling, against=known.against)

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


def pushed_off(witness: Witness, ends: Box) -> Array:
    """Slow states (n, 4 + thrusters) with the commands at which the push at rest is most out of all proportion.

    Near rest the power gained is linear in the velocity, so one answer at rest tells of all directions: each of 26 is
    tried for what it gains beyond what is allowed. A window in the commands alone is met so in its own share of them.
    """
    at_rest = witness.densely(1.0, ends)
    if not at_rest.size:
        return at_rest
    at_rest[:, :3] = 0.0
    force = witness.relative(at_rest[:, :4], at_rest[:, 4:]) @ witness.mass.T
    ways = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)]) * _SLOW * witness.reach
    best, way = np.full(len(at_rest), -np.inf), np.zeros(len(at_rest), dtype=int)
    for k, nu in enumerate(ways):
        moved = at_rest.copy()
        moved[:, :3] = nu
        full = witness.full_power(moved)
        over = (force @ nu - np.maximum(driven_power(witness, moved), witness.tolerance * full)) / full
        way = np.where(over > best, k, way)
        best = np.maximum(best, over)
    keen = np.argsort(-best, kind="stable")[:_KEEN]
    result = at_rest[keen]
    result[:, :3] = ways[way[keen]]
    return result


def driven_power(witness: Witness, states: Array) -> Array:
    """Power [W] that the thrusters may put in at states with commands (n, 4 + thrusters); negative where they brake."""
    nu, commands = states[:, :3], states[:, 4:]
    thrust, load = held_thrust(witness.vehicle, commands)
    thrust = thrust - load * nu[:, 0]
    return most_driven(thruster_matrix(witness.vehicle), nu, thrust.T, **({"margin": 1.0} if witness.exact else {}))
