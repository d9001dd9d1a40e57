"""Data of a convex programme: what it is given and what it returns; nothing here loads a solver."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...physics.errors import RequestError
from ...physics.laws.damping_power import Exponents
from ...physics.motion import Array

NO_OPTIMUM = "lawful refit: expected an optimal solution, the solver says {!r}; try fewer effects"


@dataclass(frozen=True, slots=True)
class Shape:
    """Shape of a refit: what its compiled programme depends on.

    Attributes
    ----------
    below, above : for each parameter, True where it has a lower or upper limit
    orthants : number of orthants of the envelope, 0 for no law of dissipation
    degree : of the certificate's matrices in each velocity
    mass : True when the mass matrix depends on a parameter
    """

    below: tuple[bool, ...]
    above: tuple[bool, ...]
    orthants: int = 0
    degree: Exponents = (1, 1, 1)
    mass: bool = False


@dataclass(frozen=True, slots=True)
class LawNumbers:
    """The numbers of the laws, in units of order one.

    Attributes
    ----------
    power : (orthants, m) coefficients of the power with all n parameters at zero
    slope : (orthants, m, n) their change with each parameter
    allowance : (orthants, K, 3, 3) S + allowance must be positive semidefinite at each control point
    mass : (3, 3) mass matrix with all parameters at zero, less its margin
    mass_slope : (n, 3, 3) its change with each parameter
    """

    power: Array
    slope: Array
    allowance: Array
    mass: Array
    mass_slope: Array


@dataclass(frozen=True, slots=True)
class Solution:
    """Result of a convex programme.

    Attributes
    ----------
    values : (n,) parameters
    slack : (orthants, s) exchanges of the certificate
    pull : (orthants, K, 3, 3) multipliers of the matrix inequalities: loss saved for each unit of relief
    """

    values: Array
    slack: Array
    pull: Array


def check_shown(symbols: Sequence[str], power: Array) -> None:
    """Refuse parameters of which the data show nothing.

    Parameters
    ----------
    symbols, power : names, and squared size of the columns (n,) without what sensor noise makes of them

    Raises
    ------
    RequestError
        naming those without any.
    """
    silent = [symbol for symbol, own in zip(symbols, power, strict=True) if not own > 0.0]
    if silent:
        raise RequestError(
            f"lawful refit: beyond sensor noise the log says nothing about {', '.join(silent)}; see with 'undertow "
            "inspect' whether every thruster has its own command and every sensor works, or give a livelier log"
        )
