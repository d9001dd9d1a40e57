"""A boat with a drag in surge that no effect of the catalogue describes."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from undertow.physics.matrices import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.simulation import rollout
from undertow.physics.worlds.world import FINE_STEP, World

Drag = Callable[[float, float], float]
"""Force in surge [N] from the time [s] and the surge speed [m/s]."""


@dataclass(frozen=True)
class Dragged(World):
    """A world with a drag of its own."""

    drag: Drag = lambda t, u: 0.0

    def _driven(self, start: Motion) -> Motion:
        inverse = np.linalg.inv(mass_matrix(self.vehicle))

        def added(step: int, state: np.ndarray) -> np.ndarray:
            return (inverse @ [self.drag(step * FINE_STEP, float(state[3, 0])), 0.0, 0.0])[:, None]

        found = rollout(self.vehicle, start, np.array([0]), start.time.size - 1, added).states[0]
        return replace(start, position=found[:, :2].copy(), heading=found[:, 2].copy(), velocity=found[:, 3:].copy())


def beyond(knot: float, size: float) -> Drag:
    """A drag that sets in at a speed [m/s] and grows by `size` N s/m from there."""
    return lambda t, u: -size * float(np.sign(u)) * max(abs(u) - knot, 0.0)
