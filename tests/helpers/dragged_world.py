"""A boat with a force that no effect of the catalogue describes."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from undertow.physics.integration import rollout
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle
from undertow.physics.worlds.world import FINE_STEP, World

Drag = Callable[[float, float], float]
"""Force in surge [N] from the time [s] and the surge speed [m/s]."""


Push = Callable[[float, np.ndarray, np.ndarray], np.ndarray]
"""Force (3,) [N, N, N m] from the time [s], the state (north, east, heading, u, v, r) and the commands, full is 1."""


@dataclass(frozen=True)
class Pushed(World):
    """A world with a force of its own."""

    push: Push = lambda t, x, c: np.zeros(3)

    def _driven(self, start: Motion) -> Motion:
        inverse = np.linalg.inv(mass_matrix(self.vehicle))
        pairs = zip(self.vehicle.thrusters, start.commands.T, strict=True)
        share = np.column_stack([unit.curve.normalised(given, unit.command) for unit, given in pairs])

        def added(step: int, state: np.ndarray) -> np.ndarray:
            return (inverse @ self.push(step * FINE_STEP, state[:, 0], share[step]))[:, None]

        found = rollout(self.vehicle, start, np.array([0]), start.time.size - 1, added).states[0]
        return replace(start, position=found[:, :2].copy(), heading=found[:, 2].copy(), velocity=found[:, 3:].copy())


class Dragged(Pushed):
    """A world with a drag of its own."""

    def __init__(self, vehicle: Vehicle, programme: str, duration: float, seed: int, drag: Drag) -> None:
        super().__init__(vehicle, programme, duration, seed, push=lambda t, x, c: np.array([drag(t, x[3]), 0.0, 0.0]))


def beyond(knot: float, size: float) -> Drag:
    """A drag that sets in at a speed [m/s] and grows by `size` N s/m from there."""
    return lambda t, u: -size * float(np.sign(u)) * max(abs(u) - knot, 0.0)
