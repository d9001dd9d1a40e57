"""Limits of an estimate: a value at its bound, outside its own interval, or of a hull that cannot be."""

from collections.abc import Mapping, Sequence

from ...physics.plausibility import find_impossible
from ...physics.vehicle import Vehicle
from ..candidates.candidate import Candidate, Kind, limit_reached
from ..search.estimation import Interval
from ..search.thruster_scales import redundant_scales

_TOGETHER = (
    "the common scale and every thruster's own are fitted at once, and only their products move a force, so that the "
    "log cannot tell one of them from the others"
)
_SLACK = 0.05
"""Share of an interval's width by which an estimate may lie beyond its end: rounding, and steps of a profile."""
_RIGID_BODY = ("x_g", "y_g", "mass", "inertia_z")
"""What says together whether a hull can be."""
_FAR = 1e4
"""Half-widths from which it does not matter any more how far away a value is."""


def widen_delays(intervals: Mapping[str, Interval], pool: Sequence[Candidate]) -> dict[str, Interval]:
    """Intervals with that of a delay as wide as the log's own stamps leave it: by so much its commands may be off."""
    result = dict(intervals)
    for timing in (c for c in pool if c.kind is Kind.SENSOR):
        (reach,) = (p.upper for p in timing.parameters)
        for other in (c for c in pool if c.key in timing.part_of):
            limits = {p.symbol: (p.lower, p.upper) for p in other.parameters if p.symbol in result}
            for symbol, (low, high) in limits.items():
                lower, upper = result[symbol]
                result[symbol] = Interval(max(lower - reach, low), min(upper + reach, high))
    return result


def at_limits(
    pool: Sequence[Candidate],
    nominal: Vehicle,
    estimate: Vehicle,
    claimed: Sequence[str],
    intervals: Mapping[str, Interval],
) -> dict[str, str]:
    """Effects whose numbers are a limit's and not the log's, by key, and why, as the end of a sentence.

    They stand at a limit, outside their own interval, make a hull that cannot be, or are one freedom too many.

    Parameters
    ----------
    estimate : what the log asks for, under the limits of single parameters
    claimed : keys of the effects in question
    intervals : 95 % intervals of total values by symbol
    """
    together = redundant_scales(nominal, claimed)
    no_hull = why_no_hull(nominal, estimate)
    result = {}
    for candidate in (c for c in pool if c.key in claimed and c.kind is Kind.EFFECT):
        why = "; ".join(
            filter(None, (_of(candidate, symbol, nominal, estimate, intervals) for symbol in candidate.symbols))
        )
        if set(_RIGID_BODY) & set(candidate.symbols):
            why = no_hull or why
        if candidate.key in together:
            why = _TOGETHER
        if why:
            result[candidate.key] = why
    return result


def why_no_hull(nominal: Vehicle, estimate: Vehicle) -> str:
    """Why no hull has the mass, inertia and centre of gravity of an estimate; empty where one can, or the file errs."""
    before, after = (find_impossible(vehicle.values, vehicle.thrusters) for vehicle in (nominal, estimate))
    return "; ".join(after[key] for key in _RIGID_BODY if key in after and key not in before)


def null_distance(candidate: Candidate, nominal: Vehicle, intervals: Mapping[str, Interval]) -> float | None:
    """Distance of the file's value from the middle of an interval, in half-widths; None for an effect without any.

    More than 1 is outside. Of an effect of several numbers the one that is farthest out counts.

    Parameters
    ----------
    candidate : the effect
    nominal : the vehicle with the file's values
    intervals : 95 % intervals of total values, by symbol
    """
    sizes = [p.symbol for p in candidate.parameters if not p.grid] or candidate.symbols
    known = [(intervals[symbol], nominal.value(symbol)) for symbol in sizes if symbol in intervals]
    return max((_halves(interval, value) for interval, value in known), default=None)


def _halves(interval: Interval, value: float) -> float:
    """Distance of a value from the end of an interval on its side, in half-widths, counted from the middle."""
    half = max(0.5 * (interval.upper - interval.lower), 1e-12)
    return min(abs(value - 0.5 * (interval.lower + interval.upper)) / half, _FAR)


def _of(
    candidate: Candidate, symbol: str, nominal: Vehicle, estimate: Vehicle, intervals: Mapping[str, Interval]
) -> str:
    parameter = next(p for p in candidate.parameters if p.symbol == symbol)
    value = estimate.value(symbol)
    limit = limit_reached(parameter, value, nominal.value(symbol))
    if limit is not None:
        return f"{symbol} stands at its physical limit, {limit:g} in all: its size is the limit's, not the log's"
    interval = intervals.get(symbol)
    if interval is not None:
        slack = _SLACK * (interval.upper - interval.lower) + 1e-6 * abs(value)
        if not interval.lower - slack <= value <= interval.upper + slack:
            return (
                f"the estimate of {symbol} lies outside its own interval, so that the blocks of the log disagree on it"
            )
    return ""
