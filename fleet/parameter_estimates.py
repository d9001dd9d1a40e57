"""Parameter estimates of hulls from factors, a log or a day each: weighted least squares with a sandwich covariance.

Axes are weighted by what the rows leave (feasible generalised least squares), sensor noise is taken off the products,
and moving water is fitted in each log under a prior. The covariance is that of blocks of time (Liang and Zeger 1986,
eq. 8), corrected for few blocks (Bell and McCaffrey 2002), drawn towards the model's own, and so wide that 1.96
deviations are those of Student's t.
"""

import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from operator import add
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from ..measurements.statistics.blocks import sandwich
from ..measurements.statistics.processors import single_threaded
from ..physics.effects import PARAMETERS
from ..physics.errors import RequestError
from ..physics.motion import Array
from .fleet_folder import FleetLog, read_hull_factors, read_index, seconds_of
from .hull_factors import CURRENT, LEAST_FORCE, HullFactors

_MATERIAL = 0.02
"""Force that no model of this kind explains, as a share of the largest at work on an axis; see `AdaptSettings`."""
_ROUNDS = 4
"""Fits and weights in turn; the third moves weights by less than a per cent."""
_ALIKE = 1e-9
"""Share of a normal matrix (columns of length one) below which an eigenvalue is none: some columns are one."""
_NOISE = 0.5
"""Share of a column's square from which it is sensor noise, and the log says nothing of its parameter."""
_LEVEL = 0.25
"""Share of what sensor noise adds to products that is not known: stamps that jitter hide a quarter of it."""
_NOTHING = 10.0
"""Standard error, as multiples of what the vehicle has, beyond which a log says nothing of a parameter."""
_FEW = 5.0
"""Blocks at which a parameter's own variance and that of all of them have equal weight, and blocks for each parameter
at which correlations of the sandwich and of the model have: a round number, whose intervals `benchmarks/fleet.py
--worlds N` counts."""
_TAIL = 0.025
"""Chance beyond either end of an interval of 95 %."""


@dataclass(frozen=True, slots=True, eq=False)
class Values:
    """Values (p,) and their covariance (p, p), NaN for what the logs do not tell."""

    values: Array
    covariance: Array


@single_threaded
def estimated(factors: HullFactors) -> Values:
    """What logs say together, of one boat at one time.

    The rows of a log tell as much as one in every half width of a test function.
    """
    p = len(factors.parameters)
    share = float(factors.settings["stride"]) / float(factors.settings["half_width"])
    rows = factors.tests.sum()
    raw = factors.gram.sum(axis=0)
    own = np.array([np.diagonal(factors.noise[:, a].sum(axis=0)) for a in range(3)])
    square = np.array([np.diagonal(axis) for axis in raw])
    told = (square.sum(axis=0) > 0.0) & (own.sum(axis=0) < _NOISE * square.sum(axis=0))
    at_work = _MATERIAL**2 * (square[:, :p] * factors.nominal**2).max(axis=1)
    normal = _Normal(factors, np.flatnonzero(told[:p]), p + np.flatnonzero(told[p:-1]))
    weight = share * rows / np.maximum(np.maximum(square[:, -1], at_work), LEAST_FORCE**2)
    for _ in range(_ROUNDS):
        normal.solve(weight, share)
        weight = share * rows / np.maximum(np.maximum(normal.left, at_work), LEAST_FORCE**2)
    lost = normal.lost | (np.sqrt(np.diag(normal.covariance)) > _NOTHING * np.abs(factors.nominal[normal.kept]))
    kept = normal.kept[~lost]
    return _among(p, kept, factors.nominal[kept] + normal.change[~lost], normal.covariance[np.ix_(~lost, ~lost)])


def _among(size: int, place: np.ndarray, values: Array, covariance: Array) -> Values:
    """Values of some of so many parameters, in their places among all."""
    every, spread = np.full(size, np.nan), np.full((size, size), np.nan)
    every[place], spread[np.ix_(place, place)] = values, covariance
    return Values(every, spread)


class _Normal:
    """The normal equations of what is shared by logs, what each log has alone eliminated from them.

    Attributes
    ----------
    kept : (m,) which parameters are fitted
    change : (m,) their change from the nominal value
    covariance : (m, m)
    lost : (m,) True for one that columns do not tell apart from others
    left : (3,) squares of what the rows leave unexplained on each axis
    """

    def __init__(self, factors: HullFactors, kept: np.ndarray, beside: np.ndarray) -> None:
        self._factors, self.kept, self._beside = factors, kept, beside
        self._own = [factors.log == n for n in range(len(factors.logs))]
        # What noise adds to a block is in proportion to its rows.
        self._part = factors.tests / np.bincount(factors.log, factors.tests)[factors.log]

    def solve(self, weight: Array, share: float) -> None:
        """Fit with weights (3,) of the axes; rows count in full in the data, in part (`share`) in the information."""
        f, m = self._factors, self.kept.size
        use = np.array([*self.kept, *self._beside, f.gram.shape[-1] - 1])
        raw = f.gram[:, :, use[:, None], use]
        products = np.einsum("a,baij->bij", weight, raw)
        noise = np.einsum("a,laij->lij", weight, f.noise[:, :, use[:, None], use])
        products = products - self._part[:, None, None] * noise[f.log]
        prior = np.eye(self._beside.size) / CURRENT**2
        solved, shared = [], np.zeros((m, m + 1))
        meat = np.zeros((m, m))
        for own in self._own:
            total = products[own].sum(axis=0)
            inner = np.linalg.inv(total[m:-1, m:-1] + prior) @ total[m:-1]
            solved.append(inner)
            shared += total[:m, [*range(m), -1]] - total[:m, m:-1] @ inner[:, [*range(m), -1]]
            meat += inner[:, :m].T @ prior @ inner[:, :m]
        inverse, self.lost = _inverse(shared[:, :m])
        self.change = inverse @ shared[:, -1]
        scores, self.left, doubt = np.zeros((f.tests.size, m)), np.zeros(3), np.zeros(m)
        told = np.zeros((f.tests.size, m, m))
        for own, inner, added in zip(self._own, solved, noise, strict=True):
            full = np.concatenate([self.change, inner[:, -1] - inner[:, :m] @ self.change])
            error = products[own][:, :-1, -1] - products[own][:, :-1, :-1] @ full
            scores[own] = error[:, :m] - error[:, m:] @ inner[:, :m]
            alone = np.concatenate([np.eye(m), -inner[:, :m]])
            told[own] = alone.T @ products[own][:, :-1, :-1] @ alone
            ends = np.append(-full, 1.0)
            spurious = added[:-1] @ ends
            doubt += _LEVEL * (spurious[:m] - spurious[m:] @ inner[:, :m])
            self.left += np.einsum("i,baij,j->a", ends, raw[own], ends)
        moved = inverse @ doubt
        self.covariance = self._errors(inverse, scores, told, meat) + np.outer(moved, moved)

    def _errors(self, inverse: Array, scores: Array, told: Array, prior: Array) -> Array:
        """The covariance by scores (blocks, m) and information (blocks, m, m) of the blocks, and by the prior."""
        blocks, size = scores.shape[0], max(self.kept.size, 1)
        if blocks == 1:  # one block tells nothing of how blocks differ
            return inverse + inverse @ prior @ inverse
        plain, usual = sandwich(inverse, scores, blocks), np.diag(inverse)
        leaves = told.sum(axis=0) - (told @ inverse @ told).sum(axis=0)
        expected = np.maximum(np.diag(inverse @ leaves @ inverse), usual / blocks**2)
        # How much more or less than the model says rows err, of each parameter and of all.
        each = np.diag(plain) / expected
        times = (blocks * each + _FEW * each.mean()) / (blocks + _FEW)
        freedom = (blocks - 1) * (1.0 + _FEW / blocks)
        deviation = np.sqrt(times * usual) * float(student.isf(_TAIL, freedom) / norm.isf(_TAIL))
        alike = blocks / (blocks + _FEW * size) * _correlation(plain)
        alike += (1.0 - blocks / (blocks + _FEW * size)) * _correlation(inverse)
        return alike * deviation[:, None] * deviation + inverse @ prior @ inverse


def _correlation(covariance: Array) -> Array:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return covariance * scale[:, None] * scale


def _inverse(normal: Array) -> tuple[Array, np.ndarray]:
    """The inverse of a normal matrix without the directions in which columns are one, and who has a part in these."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    values, vectors = np.linalg.eigh(normal * scale[:, None] * scale)
    gone = values < _ALIKE
    inner = (vectors[:, ~gone] / values[~gone]) @ vectors[:, ~gone].T
    return inner * scale[:, None] * scale, (vectors[:, gone] ** 2).sum(axis=1) > _ALIKE


@dataclass(frozen=True, slots=True, eq=False)
class HullEstimate:
    """What one log (or one day of logs) of one boat says.

    Attributes
    ----------
    boat : its name
    time : middle of the log [s since 1970, UTC]
    hours : length of what was read, idle time left out [h]
    values : of the parameters followed (p,), in units of the vehicle file; NaN where the log says nothing
    covariance : of values (p, p)
    source : file, or files
    """

    boat: str
    time: float
    hours: float
    values: Array
    covariance: Array
    source: str


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """Estimates of several boats, in order of time.

    Attributes
    ----------
    parameters : names of the parameters ("X_uu", "thrusters.port.scale"...)
    nominal : their nominal values (p,)
    estimates : in order of time
    missing : logs that were given and are not among them
    """

    parameters: tuple[str, ...]
    nominal: Array
    estimates: tuple[HullEstimate, ...]
    missing: tuple[str, ...] = ()


_SCALE = "_scale"


def read_fleet(folder: str | os.PathLike[str], *, by: Literal["day", "log"] = "day") -> Fleet:
    """The estimates of a fleet folder that `build_fleet` made.

    Nominal values are those of the vehicle of most logs. Logs are added in the order of the digests of their bytes, so
    that the numbers do not depend on how the folder came about.

    Parameters
    ----------
    folder : the folder
    by : an estimate for all logs of a boat on one day (UTC), or for each log

    Raises
    ------
    RequestError
        when the folder is no fleet, has no log, or a file of it is gone or broken.
    """
    if by not in ("day", "log"):
        raise RequestError(f"read_fleet: expected by='day' or by='log', got {by!r}")
    index = read_index(Path(folder))
    if not index.logs:
        raise RequestError(f"{Path(folder)}: expected a fleet with logs, got none; give 'undertow fleet' some")
    groups: dict[tuple[str, ...], list[FleetLog]] = {}
    for log in index.logs:
        own = log.factors if by == "log" else log.day
        groups.setdefault((log.boat, own, log.vehicle), []).append(log)
    told: list[tuple[list[FleetLog], list[str], Values]] = []
    nominal: dict[str, Counter[float]] = {}
    for logs in groups.values():
        for some, factors in _added(Path(folder), logs):
            names = [parameter_name(column.name) for column in factors.parameters]
            told.append((some, names, estimated(factors)))  # factors are a hundred times larger, and go
            for name, value in zip(names, factors.nominal, strict=True):
                nominal.setdefault(name, Counter())[float(value)] += len(some)
    parameters = tuple(nominal)
    place = {name: k for k, name in enumerate(parameters)}
    estimates = [_estimate(logs, np.array([place[n] for n in names]), found, len(place)) for logs, names, found in told]
    ordered = sorted(estimates, key=lambda one: (one.time, one.boat, one.source))
    usual = [min(counts, key=lambda value: (-counts[value], value)) for counts in nominal.values()]
    there = {log.log for log in index.logs}
    missing = tuple(sorted({one.log for one in index.skipped} - there))
    return Fleet(parameters, np.array(usual), tuple(ordered), missing)


def parameter_name(symbol: str) -> str:
    """The place of a parameter in the vehicle file, where its symbol does not tell it.

    Examples
    --------
    >>> parameter_name("X_uu"), parameter_name("port_scale")
    ('X_uu', 'thrusters.port.scale')
    """
    if symbol in PARAMETERS or not symbol.endswith(_SCALE):
        return symbol
    return f"thrusters.{symbol.removesuffix(_SCALE)}.scale"


def _added(folder: Path, logs: list[FleetLog]) -> Iterator[tuple[list[FleetLog], HullFactors]]:
    """The factors of logs that add: those that follow the same parameters."""
    alike: dict[tuple[str, ...], list[tuple[FleetLog, HullFactors]]] = {}
    for log in sorted(logs, key=lambda log: log.sha256):
        factors = read_hull_factors(folder, log.factors)
        alike.setdefault(tuple(column.name for column in factors.parameters), []).append((log, factors))
    for pairs in alike.values():
        yield [log for log, _ in pairs], reduce(add, (factors for _, factors in pairs))


def _estimate(logs: list[FleetLog], place: np.ndarray, found: Values, size: int) -> HullEstimate:
    every = _among(size, place, found.values, found.covariance)
    hours = np.array([log.hours for log in logs])
    time = float(np.average([seconds_of(log.time) for log in logs], weights=hours))
    names = ", ".join(sorted(log.log for log in logs))
    return HullEstimate(logs[0].boat, time, float(hours.sum()), every.values, every.covariance, names)
