"""Caches of a balance: columns, and what thrusters make of the commands, which many models have alike."""

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from typing import final

import numpy as np

from ...physics.forces import thruster_response
from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle

_MOST = 30_000_000
"""Bytes of arrays that are kept, however long the log is."""


@final
class ColumnCache:
    """Arrays that are computed once and kept until younger ones need their place; the latest is kept, however large."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, Array] = OrderedDict()
        self._bytes = 0

    def of(self, key: Hashable, compute: Callable[[], Array]) -> Array:
        """The array of a key, computed where it is not kept."""
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        value = self._kept[key] = compute()
        self._bytes += value.nbytes
        while self._bytes > _MOST and len(self._kept) > 1:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return value

    def clear(self) -> None:
        """Keep nothing."""
        self._kept.clear()
        self._bytes = 0


@final
class ThrusterResponses:
    """Forces and losses of thrusters along some motions, by the shape of each thruster.

    Parameters
    ----------
    motions : gap-free stretches with their commands
    laid : force and loss (2, n) along each motion -> (2, ...) along all of them; one after the other as a rule
    """

    def __init__(self, motions: Sequence[Motion], laid: Callable[[list[Array]], Array] | None = None) -> None:
        self._motions, self._laid, self._kept = tuple(motions), laid or _joined, ColumnCache()

    def of(self, vehicle: Vehicle) -> tuple[Array, Array]:
        """Forces at zero advance [N] and their losses per advance speed [N s/m], (thrusters, ...) each."""
        pairs = []
        for k, thruster in enumerate(vehicle.thrusters):
            force, load = self._kept.of(
                (k, thruster.shape), lambda k=k, thruster=thruster: self._unit(k, thruster.unit)
            )
            pairs.append((thruster.gain * force, thruster.advance_loss * load))
        return np.stack([pair[0] for pair in pairs]), np.stack([pair[1] for pair in pairs])

    def _unit(self, index: int, thruster: Thruster) -> Array:
        return self._laid([np.stack(thruster_response(m, index, thruster.unit)) for m in self._motions])


def _joined(parts: list[Array]) -> Array:
    return np.concatenate(parts, axis=1)
