"""The interface of a balance, measured minus modelled motion along a log; and what both kinds of it are made of.

A search asks a `Balance` for its value at one model and for its derivatives near that model (`Neighbourhood`). Force
balance (`weak_form.py`) and rollouts (`shooting.py`) answer alike. Both keep arrays (`Remembered`), and know the thrust
along a log (`LateForces`): delays of the commands interpolate between forces shifted by whole rows, since all that is
linear in a force interpolates with it.
"""

from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, Generic, TypeVar, final

import numpy as np
from numpy.typing import NDArray

from ...measurements.preparation.split import Fold
from ...physics.forces import commands_known, remaining_thrust
from ...physics.motion import Array, Motion
from ...physics.sampled_series import Switches, first_order_lag, switches
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle

_MOST = 30_000_000
"""Bytes of arrays that are kept, however long the log is."""

T = TypeVar("T", Array, tuple[Array, ...])


class Remembered(Generic[T]):
    """Arrays, or tuples of them, that are computed once and kept until younger ones need their place.

    Parameters
    ----------
    most : bytes that are kept; the latest is kept, however large
    """

    def __init__(self, most: int) -> None:
        self._most, self._bytes = most, 0
        self._kept: OrderedDict[Hashable, T] = OrderedDict()

    def of(self, key: Hashable, compute: Callable[[], T]) -> T:
        """What is kept under a key, computed where nothing is."""
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        value = self._kept[key] = compute()
        self._bytes += _size(value)
        while self._bytes > self._most and len(self._kept) > 1:
            self._bytes -= _size(self._kept.popitem(last=False)[1])
        return value

    def clear(self) -> None:
        """Keep nothing."""
        self._kept.clear()
        self._bytes = 0


def cache_limit(many: int, shape: tuple[int, ...]) -> int:
    """Bytes of many arrays of a shape; of a long log, fewer are kept."""
    return min(_MOST, many * 8 * int(np.prod(shape)))


def _size(value: Array | tuple[Array, ...]) -> int:
    return sum(part.nbytes for part in value) if isinstance(value, tuple) else value.nbytes


LEAST_NOISE = np.array([1e-4, 1e-4, 1e-4])
"""Noise [m/s, m/s, rad/s] below which a log counts as noise-free, as simulators write it."""


MANY = 120
"""Columns that are kept: those of a few models, between which a search goes to and fro."""


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhood:
    """The balance of models near one model, from which columns are taken.

    Attributes
    ----------
    balances : the balance of a model and of noisier copies of the log, (1 + copies, tests, 3)
    difference : the balances of one model less those of another
    memo : columns that callers keep with the data they belong to
    unit : what a unit of a parameter takes off the balance about a model, of one in which it is linear, by its symbol
        and the values that multiply it; None where columns of damping, mass and thrust depend on the model
    step_share : share of a parameter's step by which its column is taken
    """

    balances: Callable[[Vehicle], Array]
    difference: Callable[[Vehicle, Vehicle], Array]
    memo: Remembered[Array]
    unit: Callable[[Vehicle, str, tuple[object, ...]], Array] | None = None
    step_share: float = 1.0

    @property
    def linear(self) -> bool:
        """True when columns of damping, mass and thrust do not depend on the model."""
        return self.unit is not None


@dataclass(frozen=True, slots=True)
class WeakSettings:
    """Test functions of the weak form, and the blocks and noisy copies of a log.

    Attributes
    ----------
    half_width : half the support of a test function, T [s]
    stride : distance between test functions [s]
    power : p of the test function
    blocks : most contiguous blocks for held-out scores and block bootstrap; a short log has fewer. One for a motion of
        which nothing is held out, however short
    copies : copies of the log with more noise, from which the effect of sensor noise on scores is known
    """

    half_width: float = 0.8
    stride: float = 0.2
    power: int = 3
    blocks: int = 16
    copies: int = 2


class Balance(ABC):
    """Measured minus modelled motion of gap-free stretches, as tests that are zero for a perfect model and log.

    Attributes
    ----------
    unit : of the balance on each axis
    forces : the balance is one of forces, so that a lighter hull needs less of it, and no rollout is fitted to it
    motions : the gap-free stretches; no test reaches across two of them
    time : (tests,) time of each test [s]
    block : (tests,) index of the contiguous block that each test belongs to
    independent : effective number of independent tests
    noise : (3,) white sensor noise on u, v [m/s] and r [rad/s]
    tests : test functions for other motions than these
    bins : number of successive tests at one place of the log; places are evenly spaced in time
    overlap : number of rollouts of `squares` that run at any time
    sources : source of each row of `squares`; none where they are not kept apart
    """

    unit: ClassVar[tuple[str, str, str]]
    forces: ClassVar[bool]

    motions: tuple[Motion, ...]
    time: Array
    block: np.ndarray
    independent: float
    noise: Array
    tests: WeakSettings
    bins: int
    overlap: int
    sources: list[str]

    @abstractmethod
    def residual(self, vehicle: Vehicle) -> Array:
        """Measured minus modelled, (tests, 3)."""

    @abstractmethod
    def noisy_residuals(self, vehicle: Vehicle) -> Array:
        """The balance, and that of copies of the log with the sensor noise added once more, (1 + copies, tests, 3)."""

    @abstractmethod
    def propagated_noise(self, vehicle: Vehicle, copies: int, seed: int) -> NDArray[np.float32] | None:
        """Draws of the sensor noise, passed through the balance, (3, copies, tests) [`unit`].

        None where there is no such noise, or where what is left of a balance tells nothing of it.

        Parameters
        ----------
        vehicle : the model about which the noise is propagated
        copies : how many draws of the noise of all sensors
        seed : of the draws; equal seeds give equal copies
        """

    @abstractmethod
    def of_switches(self, vehicle: Vehicle) -> Array | None:
        """Part of the balance that sums over rows make of thrust that jumps, (tests, 3) [`unit`]; None without sums."""

    @abstractmethod
    def recorded(self, motions: Sequence[Motion], vehicle: Vehicle) -> Array:
        """The balance (tests, 3) of the same motions, had other commands or velocities been recorded of them."""

    @abstractmethod
    def about(self, vehicle: Vehicle) -> Neighbourhood:
        """The balance of models near a vehicle."""

    @abstractmethod
    def nearer(self, vehicle: Vehicle, moved: Vehicle) -> Vehicle:
        """The model that a Gauss-Newton step from one vehicle to another may reach."""

    @abstractmethod
    def refreshed(self, about: Vehicle) -> "Balance":
        """The same balance with its weights about another model."""

    @abstractmethod
    def squares(self, vehicle: Vehicle) -> Array:
        """Mean square velocity errors of open-loop rollouts, (starts, 3), for the second judge."""

    @abstractmethod
    def largest_contribution(self, vehicle: Vehicle) -> Array:
        """Modulus of the largest single contribution to the balance at each test, (tests, 3)."""

    def force_scale(self, vehicle: Vehicle) -> Array:
        """Size of what is at work on each axis (3,): the root mean square of `largest_contribution`."""
        return np.sqrt((self.largest_contribution(vehicle) ** 2).mean(axis=0))

    @property
    @abstractmethod
    def speeds(self) -> Array:
        """Mean measured velocity over ground at each test, (tests, 3) [m/s, m/s, rad/s]."""

    @property
    @abstractmethod
    def reach(self) -> tuple[np.ndarray, Array, Array]:
        """Motion, first and last time [s] of each test, (tests,) each."""

    def outside(self, fold: Fold) -> np.ndarray:
        """Mask (tests,) of the tests that are made of nothing in a fold."""
        number, begin, end = self.reach
        inside = np.zeros(number.size, bool)
        for k, motion in enumerate(self.motions):
            own = number == k
            inside[own] = fold.touched(motion.source, begin[own], end[own])
        return ~inside

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1


_KEPT_FORCES = 16_000_000
"""Bytes of forces, and as many of commands, that are kept: on 25 min of log at 20 Hz, of 16 shapes of two thrusters."""


_WHOLE = 1e-9
"""Share of a row that is rounding of a delay of whole rows."""


@final
class LateForces:
    """Forces and losses of thrusters along some motions, of a gain and a loss of one.

    Parameters
    ----------
    motions : gap-free stretches with their commands
    """

    def __init__(self, motions: Sequence[Motion]) -> None:
        self._motions = tuple(motions)
        self._steps = [motion.time_step for motion in self._motions]
        known = [commands_known(motion, 0) for motion in self._motions]
        self._edges = np.cumsum([0, *(series.size for series, _ in known)])
        self._rows = [np.arange(b - m.time.size, b) for m, b in zip(self._motions, self._edges[1:], strict=True)]
        self._lagged: Remembered[tuple[Array, ...]] = Remembered(_KEPT_FORCES)
        self._prompt: Remembered[Array] = Remembered(_KEPT_FORCES)

    def forget(self) -> None:
        """Keep no forces."""
        self._lagged.clear()
        self._prompt.clear()

    def late(self, unit: Thruster) -> tuple[tuple[int, ...], Array]:
        """Whole rows by which forces are late in each motion, and the share of a row beyond."""
        rows = np.array([unit.late / step for step in self._steps])
        whole = np.floor(rows + _WHOLE)
        share = rows - whole
        return tuple(whole.astype(int).tolist()), np.where(share > _WHOLE, share, 0.0)

    def shifted(self, index: int, unit: Thruster, rows: Sequence[int]) -> Array:
        """Force [N] and load [N s/m] of a thruster along all motions, (2, n), by whole rows late; the ends hold.

        Parameters
        ----------
        index : number of the thruster in the vehicle
        unit : the thruster, with its curve, dead zone and wear
        rows : by how many whole rows each motion is late; negative, early
        """
        series = self._prompt.of((index, unit.prompt_shape), lambda: self._at_once(index, unit))
        ends = zip(self._rows, rows, pairwise(self._edges), strict=True)
        places = [np.clip(own - by, first, last - 1) for own, by, (first, last) in ends]
        result = series.take(np.concatenate(places), axis=1)
        if unit.thrust_rate:
            result *= np.concatenate([remaining_thrust(unit, motion.minutes) for motion in self._motions])
        return result

    def between(self, unit: Thruster, at: Callable[[tuple[int, ...]], Array], times: Sequence[int]) -> Array:
        """Interpolate what is linear in a force between whole rows.

        Parameters
        ----------
        at : whole rows late in each motion -> (..., m), of all motions in turn
        times : how many of the m belong to each motion
        """
        whole, share = self.late(unit)
        result = at(whole)
        if not share.any():
            return result
        # So that of a force that stays, which is the same a row later, nothing changes to the bit.
        return result + np.repeat(share, times) * (at(tuple(k + 1 for k in whole)) - result)

    def _at_once(self, index: int, unit: Thruster) -> Array:
        """Force and load along the commands of all motions and their history, (2, rows)."""
        lagged, rows, share = self._lagged.of((index, unit.lag), lambda: self._commanded(index, unit.lag))
        return unit.prompt(lagged, Switches(rows, share))

    def _commanded(self, index: int, lag: float) -> tuple[Array, ...]:
        """A command with a lag along all motions and their history, and where it switches."""
        known = zip(self._motions, self._steps, strict=True)
        lagged = [first_order_lag(commands_known(m, index)[0], lag, step) for m, step in known]
        found = [switches(series) for series in lagged]
        rows = [first + one.rows for first, one in zip(self._edges, found, strict=False)]
        return np.concatenate(lagged), np.concatenate(rows), np.concatenate([one.share for one in found])
