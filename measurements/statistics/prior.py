"""A measured size beside what is usual: weighed by how sure each is, or not believed where both cannot be right."""

from math import exp, hypot, log

_APART = 3.0
"""Standard deviations between the two from which the measurement is a poor fit, and not a rare boat: 3 in 1000."""


def weighed(measured: float, error: float, usual: float, spread: float) -> tuple[float, float] | None:
    """The size that both speak for, and the factor within which it is sure (95 %); None for one not to be believed.

    Sizes are compared by their logarithms, for they differ by factors.

    Parameters
    ----------
    measured : a positive size
    error : its standard error as a share of it, what the model of the measurement does wrong included
    usual : what is usual, positive
    spread : standard deviation of the logarithm of what is usual

    Examples
    --------
    >>> size, factor = weighed(40.0, 0.4, 20.0, 0.4)
    >>> round(size, 1), round(factor, 1)
    (28.3, 1.7)
    >>> weighed(4000.0, 0.4, 20.0, 0.4) is None
    True
    """
    apart = log(measured / usual)
    if abs(apart) > _APART * hypot(error, spread):
        return None
    share = spread**2 / (spread**2 + error**2)
    return usual * exp(share * apart), exp(1.96 * error * share**0.5)
