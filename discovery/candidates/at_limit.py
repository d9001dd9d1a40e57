"""Whether a physical limit holds a parameter, so that its size is the limit's and not the log's."""

from math import isfinite

from ...physics.effects import Parameter

_NEAR = 1e-3
"""Share of the room between a start and a limit within which an estimate is at the limit."""
_ROUNDING = 1e-5
"""What a solver leaves of a number that lies on a limit, as a share of one and the limit."""


def limit_at(parameter: Parameter, value: float, start: float | None = None) -> float | None:
    """The physical limit at which a value lies, if it does.

    Parameters
    ----------
    value : total, in the parameter's unit
    start : nominal value that the value has left; a limit at which it stood before holds nothing. None for a number
        that a solver under limits gave, which lies on one to rounding
    """
    for limit in (parameter.lower, parameter.upper):
        if not isfinite(limit):
            continue
        away = abs(value - limit)
        if away <= _ROUNDING * (1.0 + abs(limit)) if start is None else away < _NEAR * abs(limit - start):
            return limit
    return None
