"""What vehicles do along the logs, filtered like the measurement, in the order of the series' rows."""

from collections.abc import Callable, Sequence

import numpy as np

from ...measurements.preparation.dataset import DataSet
from ...physics.forces import actuation, modelled_acceleration
from ...physics.matrices import mass_matrix, thruster_matrix
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ...residuals.residual import same_filter
from .rows import Array


class Along:
    """The logs of a comparison, train, validation and test part, in the order in which `series.series` has them."""

    def __init__(self, parts: Sequence[DataSet]) -> None:
        self._parts = tuple(parts)
        motions = [motion for data in parts for motion in data.motions]
        sources: dict[str, int] = {}
        log = np.concatenate([np.full(m.time.size, sources.setdefault(m.source, len(sources))) for m in motions])
        self._order = np.lexsort((np.concatenate([m.time for m in motions]), log))

    def acceleration(self, vehicle: Vehicle) -> Array:
        """Modelled acceleration of a vehicle, (n, 3) [m/s^2, m/s^2, rad/s^2]."""
        return self._each(lambda motion: modelled_acceleration(vehicle, motion))

    def thrust(self, vehicle: Vehicle) -> Array:
        """The part of it that the thrusters give, (n, 3)."""
        push = np.linalg.solve(mass_matrix(vehicle), thruster_matrix(vehicle))
        return self._each(lambda motion: (push @ actuation(vehicle, motion).thrust).T)

    def _each(self, of: Callable[[Motion], Array]) -> Array:
        found = [same_filter(of(motion), motion, data) for data in self._parts for motion in data.motions]
        return np.concatenate(found)[self._order]
