"""The force equation of vehicles along many rollouts at once, flattened into a few operations on whole arrays.

A rollout asks for rates four times a step, so the number of calls is what it costs. Products of signals are taken in
two steps, all axes in one matrix product. Thrusters are summed beforehand in the order of the terms, so that what
cancels on paper, as of two thrusters that push alike, cancels to the bit and a straight course stays straight.
"""

import math
from collections.abc import Sequence
from itertools import groupby
from operator import attrgetter

import numpy as np

from .forces import CURRENT, apparent_wind
from .momentum_balance import SHARES, coefficients_by_product, mass_matrix, pair_forces, pressure_width
from .motion import Array
from .vehicle import Vehicle

Outside = tuple[Array, Array | None, Array | None, Array | float]
"""At one time: accelerations (3, batch) by the thrusters at zero advance, what they lose per advance speed, the
velocity of the air (2, batch), and the minutes since the beginning of the log."""

_SIGNALS = (
    *("1", "u", "v", "r", "|u|", "|v|", "|r|", "q_v", "q_r", "cos psi", "sin psi", "u_a", "v_a", "|V_a|", "t"),
    *("F_Y", "F_N"),
)
"""Signals by row; the first is that of constant forces."""
_FACTORS = 4
"""Most factors of a term of the momentum balance: three speeds, and time."""
_NONE = (0.0, 0.0, 0.0)
"""Coefficients by axis of a product that a vehicle lacks."""


class Terms:
    """The force equation of one vehicle, its thrusters apart from the products of signals.

    Attributes
    ----------
    columns : by the factors of a product, its coefficient on each axis [N, N, N m]
    inverse : inverse of the mass matrix, (3, 3)
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        self.columns = coefficients_by_product(vehicle)
        pushes = [self.columns.pop((f"T:{thruster.name}",), _NONE) for thruster in vehicle.thrusters]
        self._thrust = [[(n, push[axis]) for n, push in enumerate(pushes) if push[axis]] for axis in range(3)]
        self.inverse = np.linalg.inv(mass_matrix(vehicle))
        self._beside = vehicle.y_g != 0.0
        if not self._beside:
            self.inverse[0, 1:] = self.inverse[1:, 0] = 0.0  # surge stands alone

    def accelerations(self, forces: Array) -> Array:
        """M^-1 B f of thruster forces or losses (thrusters, steps, batch): (3, steps, batch)."""
        total = np.zeros((3, *forces.shape[1:]))
        for line, sums in zip(self._thrust, total, strict=True):
            for index, share in line:
                sums += share * forces[index]
        i = self.inverse
        if self._beside:
            return np.einsum("ij,jkb->ikb", i, total)
        ahead, across, turning = i[0, 0] * total[0], i[1, 1] * total[1] + i[1, 2] * total[2], total[1:]
        return np.stack([ahead, across, i[2, 1] * turning[0] + i[2, 2] * turning[1]])

    def fastest_decay(self, speeds: Sequence[float]) -> float:
        """Rate at which the hull takes off what decays fastest, at rest or at given speeds [1/s]; 0 where nothing does.

        Parameters
        ----------
        speeds : u, v [m/s] and r [rad/s]
        """
        slopes = [[0.0] * 9, [0.0] * 9]
        for factors, column in self.columns.items():
            if not all(name in _SPEED for name in factors):
                continue
            for slope, at in zip(slopes, (_AT_REST, speeds), strict=True):
                values = [at[_SPEED[name]] if name in "uvr" else abs(at[_SPEED[name]]) for name in factors]
                for n, name in enumerate(factors):
                    k = _SPEED[name]
                    rate = 1.0 if name in "uvr" else math.copysign(float(at[k] != 0.0), at[k])
                    change = math.prod([*values[:n], *values[n + 1 :]], start=rate)
                    for axis in range(3):
                        slope[3 * axis + k] += column[axis] * change
        rates = np.linalg.eigvals(self.inverse @ np.reshape(slopes, (2, 3, 3)))
        return max(0.0, float(-rates.real.min()))


_SPEED = {"u": 0, "v": 1, "r": 2, "|u|": 0, "|v|": 1, "|r|": 2}
"""Place of the speed of each factor of a term."""
_AT_REST = (0.0, 0.0, 0.0)
"""u, v and r of a boat that lies still."""


class Flattened:
    """Rates of change of (8, batch) states: north, east, psi, u, v, r and the wake's filtered sway speed and yaw rate.

    Parameters
    ----------
    crowd : vehicles, and the number of rollouts of each; theirs follow one another in the batch
    placed : north and east are followed; else they stay
    """

    def __init__(self, crowd: Sequence[tuple[Terms, int]], placed: bool = True) -> None:
        self._placed = placed
        crowd = _merged(crowd)
        widths = [width for _, width in crowd]
        ends = np.cumsum([0, *widths])

        def each(symbol: str) -> Array | float:
            """Value of a parameter in every column; one number where all have the same."""
            values = [terms.vehicle.value(symbol) for terms, _ in crowd]
            return values[0] if len(set(values)) == 1 else np.repeat(values, widths)

        self._current = [each(symbol) for symbol in CURRENT]
        self._moving, self._growing = (any(map(np.any, part)) for part in (self._current, self._current[2:]))
        self._memory_time = each("memory_time")
        # Products of most factors come first, so that second and later factors are those of the first rows.
        longest = sorted({row: None for terms, _ in crowd for row in terms.columns}, key=len, reverse=True)
        names = [row or ("1",) for row in longest]
        self._weights = [
            (terms.inverse @ np.array([terms.columns.get(row, _NONE) for row in longest] or np.zeros((0, 3))).T, a, b)
            for (terms, _), a, b in zip(crowd, ends, ends[1:], strict=False)
        ]
        self._places = [
            np.array([_SIGNALS.index(row[k]) for row in names if len(row) > k], dtype=int) for k in range(_FACTORS)
        ]
        used = {name for row in longest for name in row}
        self._wakes = any(name.startswith("q_") for name in used)
        self._steers = bool(used & {"cos psi", "sin psi"})
        self._ages = "t" in used
        self._blows = bool(used & {"u_a", "v_a", "|V_a|"})
        self._crosses = "F_Y" in used
        hulls = [terms.vehicle.hull for terms, _ in crowd]
        length, draught = (
            np.repeat([0.0 if hull is None else size(hull) for hull in hulls], widths)
            for size in (attrgetter("length"), attrgetter("draught"))
        )
        self._strips, self._strip = np.multiply.outer(SHARES, length), pressure_width(length, draught)
        self._signals = np.ones((len(_SIGNALS), ends[-1]))
        self._products = [np.empty((len(names), ends[-1])) for _ in range(2)]
        self._turns = placed or self._moving or self._steers

    def __call__(self, x: Array, outside: Outside) -> Array:
        """Rate of change of states (8, batch)."""
        push, loss, wind, minutes = outside
        signals, (products, factor) = self._signals, self._products
        cosine, sine = (np.cos(x[2]), np.sin(x[2])) if self._turns else (x[2], x[2])
        out = np.empty_like(x)
        out[2] = x[5]
        if self._placed:
            out[0], out[1] = cosine * x[3] - sine * x[4], sine * x[3] + cosine * x[4]
        else:
            out[:2] = 0.0
        signals[1:4] = x[3:6]
        if self._moving:
            north, east, northwards, eastwards = self._current
            if self._growing:
                north, east = north + northwards * minutes, east + eastwards * minutes
            ahead, starboard = cosine * north + sine * east, cosine * east - sine * north
            signals[1] -= ahead
            signals[2] -= starboard
        np.abs(signals[1:4], out=signals[4:7])
        if self._wakes:
            signals[7:9] = x[6:8]
        if self._ages:
            signals[14] = minutes
        if self._crosses:
            both, turned = pair_forces(self._strips, signals[2], signals[3])
            signals[15], signals[16] = self._strip * both.sum(axis=0), self._strip * turned.sum(axis=0)
        if self._steers:
            signals[9], signals[10] = cosine, sine
        if self._blows:
            still = np.zeros_like(x[2])
            air = (still, still) if wind is None else (wind[0], wind[1])
            signals[11], signals[12] = apparent_wind(x[2], (x[3], x[4]), air)
            signals[13] = np.hypot(signals[11], signals[12])
        signals.take(self._places[0], 0, products, "clip")
        for places in self._places[1:]:
            if places.size:
                products[: places.size] *= signals.take(places, 0, factor[: places.size], "clip")
        for weights, begin, end in self._weights:
            np.matmul(weights, products[:, begin:end], out=out[3:6, begin:end])
        out[3:6] += push if loss is None else push - loss * signals[1]
        if self._moving:
            out[3] += starboard * x[5]
            out[4] -= ahead * x[5]
        if self._growing:
            northwards, eastwards = (rate / 60.0 for rate in self._current[2:])
            out[3] += cosine * northwards + sine * eastwards
            out[4] += cosine * eastwards - sine * northwards
        if self._wakes:
            out[6:8] = (signals[2:4] - x[6:8]) / self._memory_time
        else:
            out[6:8] = 0.0
        return out


def _merged(crowd: Sequence[tuple[Terms, int]]) -> list[tuple[Terms, int]]:
    """A crowd with rollouts of one vehicle that follow one another taken as one: each is a product of matrices less."""
    groups = (list(group) for _, group in groupby(crowd, key=lambda one: id(one[0])))
    return [(group[0][0], sum(width for _, width in group)) for group in groups]
