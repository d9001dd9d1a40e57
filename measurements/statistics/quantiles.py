"""Quantiles of Student's t and Fisher's F, without the time SciPy takes to load; and a size weighed with its prior."""

from functools import cache
from math import exp, hypot, lgamma, log, log1p, sqrt

_TERMS = 10_000
"""Most terms of the continued fraction: with a million degrees of freedom it takes some thousand."""
_STEPS = 200
"""Most steps to a quantile: Newton's are eight as a rule, and halving alone ends after a hundred."""
_NORMAL = 1e6
"""Degrees of freedom from which Student's t is normal."""
_ROUNDING = 1e-16
"""Share of a number by which a term, or a step, moves it no more."""


@cache
def student(freedom: float, probability: float) -> float:
    """The quantile of Student's t of so many degrees of freedom.

    >>> round(student(10, 0.975), 6)
    2.228139
    """
    if probability < 0.5:
        return -student(freedom, 1.0 - probability)
    return sqrt(fisher(1.0, freedom, 2.0 * probability - 1.0))  # the square of t is an F


def largest_mean_square(tests: float, probability: float = 0.975) -> float:
    """The quantile of the mean square of so many independent normal numbers of variance 1.

    The cube root of a chi-squared number is nearly normal (Wilson and Hilferty 1931, doi:10.1073/pnas.17.12.684).

    >>> round(largest_mean_square(10), 2), round(largest_mean_square(400), 3)
    (2.05, 1.143)
    """
    spread = 2.0 / (9.0 * tests)
    return (1.0 - spread + student(_NORMAL, probability) * sqrt(spread)) ** 3


def beyond_student(freedom: float, value: float) -> float:
    """The chance that Student's t of so many degrees of freedom exceeds a value.

    >>> round(beyond_student(10, 2.228139), 6), beyond_student(10, 0.0)
    (0.025, 0.5)
    """
    tail = 0.5 * incomplete_beta(0.5 * freedom, 0.5, freedom / (freedom + value**2))
    return tail if value >= 0.0 else 1.0 - tail


@cache
def fisher(above: float, below: float, probability: float) -> float:
    """The quantile of Fisher's F of so many degrees of freedom above and below.

    above F / (above F + below) has the incomplete beta function for its distribution (DLMF 8.17).

    Parameters
    ----------
    above, below : degrees of freedom
    probability : 0 < p < 1

    >>> round(fisher(2, 10, 0.95), 6)
    4.102821
    """
    a, b = 0.5 * above, 0.5 * below
    if incomplete_beta(a, b, 0.5) >= probability:
        share = _root(a, b, probability)
        return below * share / (above * (1.0 - share))
    rest = _root(b, a, 1.0 - probability)  # of a share and its rest the smaller one is sought, which has all its digits
    return below * (1.0 - rest) / (above * rest)


def incomplete_beta(a: float, b: float, x: float) -> float:
    """The regularised incomplete beta function I_x(a, b) of 0 <= x <= 1."""
    if x in (0.0, 1.0):
        return x
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - incomplete_beta(b, a, 1.0 - x)
    return _density(a, b, x) * x * (1.0 - x) / a * _fraction(a, b, x)


def _density(a: float, b: float, x: float) -> float:
    return exp(lgamma(a + b) - lgamma(a) - lgamma(b) + (a - 1.0) * log(x) + (b - 1.0) * log1p(-x))


def _fraction(a: float, b: float, x: float) -> float:
    """The continued fraction of DLMF 8.17.22, from its front (Lentz 1976, doi:10.1364/AO.15.000668)."""
    upper, lower = 1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0))
    result = lower
    for m in range(1, _TERMS):
        even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))
        before = result
        for term in (even, odd):
            upper, lower = 1.0 + term / upper, 1.0 / (1.0 + term * lower)
            result *= upper * lower
        if abs(result - before) <= _ROUNDING * abs(result):
            break
    return result


def _root(a: float, b: float, probability: float) -> float:
    """Where I_x(a, b) reaches a probability, at most in the middle: by Newton's steps, halved where they leave."""
    low, high, x = 0.0, 0.5, 0.25
    for _ in range(_STEPS):
        beyond = incomplete_beta(a, b, x) - probability
        low, high = (low, x) if beyond > 0.0 else (x, high)
        slope = _density(a, b, x)
        nearer = x - beyond / slope if slope else low
        last, x = x, nearer if low < nearer < high else 0.5 * (low + high)
        if abs(x - last) <= _ROUNDING * x:
            break
    return x


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
