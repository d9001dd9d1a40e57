"""What no model takes: force that lasts for seconds, is material, and is left by everything that was found.

Sensor noise and short waves have no mean over some seconds. What a record of the commands that is cut, a cause outside
the catalogue or anything that changes during a log leaves behind has one.
"""

import numpy as np
from numpy.typing import NDArray

from ...physics.frames import AXES, Array
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..findings import LastingRest
from ..search.floating import Search

_SECONDS = 5.0
"""Time over which noise and the waves of sheltered water vanish in the mean [s]; swell may leave some of itself."""
_MATERIAL = 0.1
"""Share of the force at work from which a rest is material. Waves of 0.2 m/s leave 0.07 or less in surge and yaw
over 5 s where the model is right, commands that are cut at a third 0.15 to 0.5."""
_LASTING = 0.5
"""Share of a rest that its means over 5 s hold, from which it lasts: of white noise it is 0.3, of waves 0.02 to 0.3."""
_LEFT = 0.5
"""Share of what the nominal model leaves, in these means and in rollouts where those judge, from which what was found
explains little: weather leaves less in the field where the effects that are missing take the rest."""
_LEAST = 8
"""Means below which their size is chance."""


def lasting_rests(forces: Search, judge: Balance, found: Vehicle) -> tuple[LastingRest, ...]:
    """What lasts, is material, and is hardly less with the model found than with the nominal one, by axis.

    Parameters
    ----------
    forces : the search on the force balance, with the nominal vehicle
    judge : the balance that judged, of forces or of rollouts; on an axis to which it is blind nothing is told
    found : the model with everything that the search selected, sure or not
    """
    balance = forces.balance
    after, before = (balance.balance(vehicle) for vehicle in (found, forces.nominal))
    pieces = _pieces(balance.time)
    if pieces[-1] + 1 < _LEAST:
        return ()
    lasting, usual = (_size(_means(rest, pieces)) for rest in (after, before))
    share = lasting / forces.force_scale
    little = lasting > _LEFT * usual
    if not judge.forces:
        little &= _size(judge.balance(found)) > _LEFT * _size(judge.balance(forces.nominal))
    seen = ~np.array(judge.blind) & ~forces.quiet
    left = seen & little & (share > _MATERIAL) & (lasting > _LASTING * _size(after))
    return tuple(
        LastingRest(axis=AXES[axis], force=float(lasting[axis]), share=float(share[axis]), unit=balance.unit[axis])
        for axis in sorted(np.flatnonzero(left).tolist(), key=lambda axis: -share[axis])
    )


def _pieces(time: Array) -> NDArray[np.int64]:
    """Numbers of the pieces of 5 s that tests belong to; a piece ends where the time leaps or begins anew."""
    step = np.diff(time, prepend=time[0])
    leaps = (step < 0.0) | (step > _SECONDS)
    begun = time[np.maximum.accumulate(np.where(leaps, np.arange(time.size), 0))]
    within = ((time - begun) / _SECONDS).astype(np.int64)
    return np.cumsum((np.diff(within, prepend=0) != 0) | leaps)


def _means(rest: Array, pieces: NDArray[np.int64]) -> Array:
    """Means of a rest (tests, 3) over its pieces, without those that are hardly begun, (pieces, 3)."""
    tests = np.bincount(pieces)
    sums = np.column_stack([np.bincount(pieces, column) for column in rest.T])
    return (sums / np.maximum(tests, 1)[:, None])[tests > 0.5 * tests.max()]


def _size(rest: Array) -> Array:
    return np.sqrt((rest**2).mean(axis=0))
