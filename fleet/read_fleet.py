"""A fleet folder as estimates: what each log, or each day of a boat's logs, says of its hull."""

import os
from collections import Counter
from collections.abc import Iterator
from functools import reduce
from operator import add
from pathlib import Path
from typing import Literal

import numpy as np

from ..physics.effects import PARAMETERS
from ..physics.errors import RequestError
from .fleet_folder import FleetLog, read_hull_factors, read_index, seconds_of
from .hull_estimates import Fleet, HullEstimate
from .hull_factors import HullFactors
from .parameter_estimates import Values, estimated

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
    place = Path(folder)
    index = read_index(place)
    if not index.logs:
        raise RequestError(f"{place}: expected a fleet with logs, got none; give 'undertow fleet' some")
    groups: dict[tuple[str, ...], list[FleetLog]] = {}
    for log in index.logs:
        own = log.factors if by == "log" else log.day
        groups.setdefault((log.boat, own, log.vehicle), []).append(log)
    told: list[tuple[list[FleetLog], list[str], Values]] = []
    nominal: dict[str, Counter[float]] = {}
    for logs in groups.values():
        for some, factors in _added(place, logs):
            names = [parameter_name(column.name) for column in factors.parameters]
            told.append((some, names, estimated(factors)))  # factors are a hundred times larger, and go
            for name, value in zip(names, factors.nominal, strict=True):
                nominal.setdefault(name, Counter())[float(value)] += len(some)
    parameters = tuple(nominal)
    estimates = [
        _estimate(logs, [parameters.index(n) for n in names], found, len(parameters)) for logs, names, found in told
    ]
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


def _estimate(logs: list[FleetLog], place: list[int], found: Values, size: int) -> HullEstimate:
    values, covariance = np.full(size, np.nan), np.full((size, size), np.nan)
    values[place] = found.values
    covariance[np.ix_(place, place)] = found.covariance
    hours = np.array([log.hours for log in logs])
    time = float(np.average([seconds_of(log.time) for log in logs], weights=hours))
    names = ", ".join(sorted(log.log for log in logs))
    return HullEstimate(logs[0].boat, time, float(hours.sum()), values, covariance, names)
