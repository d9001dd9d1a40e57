"""Monomials of u, v, r and their moduli: the alphabet in which damping, coupling and unnamed terms are written."""

import re
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement

from .errors import VehicleError, shown
from .motion import Array

_FACTOR = re.compile(r"(\|[uvr]\||[uvr])(?:\^([1-3]))?")
_INDEX = {"u": 0, "v": 1, "r": 2}
"""Places of the velocities in a state."""
_ORDER = ("u", "v", "r", "|u|", "|v|", "|r|")


@dataclass(frozen=True, slots=True)
class Form:
    """A parsed monomial: `text` as written and its factors, each `u`, `v`, `r` or a modulus."""

    text: str
    factors: tuple[str, ...]

    def __call__(self, surge_speed: Array, sway_speed: Array, yaw_rate: Array) -> Array:
        """Value of the monomial; the arrays broadcast [m/s, m/s, rad/s], and may be tensors."""
        state = (surge_speed, sway_speed, yaw_rate)
        value: Array | None = None
        for factor in self.factors:
            x = state[_INDEX[factor.strip("|")]]
            x = abs(x) if factor.startswith("|") else x
            value = x if value is None else value * x
        assert value is not None
        return value

    @property
    def degree(self) -> int:
        """Number of factors."""
        return len(self.factors)

    @property
    def column(self) -> int | None:
        """Velocity that the damping matrix multiplies: the last factor without modulus; None when there is none."""
        signed = [f for f in self.factors if not f.startswith("|")]
        return _INDEX[signed[-1]] if signed else None

    @property
    def odd(self) -> bool:
        """True when the monomial changes sign with every velocity reversed, as a dissipative force must."""
        return sum(not f.startswith("|") for f in self.factors) % 2 == 1


@lru_cache(maxsize=512)
def parse_form(text: str) -> Form:
    """Read a monomial such as `u|u|`, `|v|r`, `u^3` or `u r`.

    Raises
    ------
    VehicleError
        when the text is not a product of one to three of u, v, r, |u|, |v|, |r|.

    >>> parse_form("u^2|r|").factors
    ('u', 'u', '|r|')
    """
    squeezed = text.replace(" ", "").replace("*", "")
    factors: list[str] = []
    position = 0
    while position < len(squeezed):
        match = _FACTOR.match(squeezed, position)
        if match is None:
            break
        factors += [match.group(1)] * int(match.group(2) or 1)
        position = match.end()
    if position < len(squeezed) or not 1 <= len(factors) <= 3:
        raise VehicleError(
            f"term form {shown(text)}: expected a product of one to three of u, v, r, |u|, |v|, |r|, "
            "for example 'u|u|' or '|v|r'"
        )
    return Form(squeezed, tuple(factors))


def canonical(factors: tuple[str, ...]) -> str:
    """The form's one spelling: signed factors before moduli, repeated ones as powers, |u||u| folded into u^2.

    >>> canonical(("|u|", "u")), canonical(("|r|", "|r|")), canonical(("u", "u", "u"))
    ('u|u|', 'r^2', 'u^3')
    """
    counts: dict[str, int] = dict.fromkeys(_ORDER, 0)
    for factor in factors:
        counts[factor] += 1
    for name in "uvr":
        pairs = counts[f"|{name}|"] // 2
        counts[f"|{name}|"] -= 2 * pairs
        counts[name] += 2 * pairs
    return "".join(name + (f"^{k}" if k > 1 else "") for name, k in counts.items() if k)


def monomials(degree: int = 3) -> tuple[Form, ...]:
    """Every distinct monomial of u, v, r and their moduli up to a degree, without duplicates such as |u|^2 = u^2.

    A constant is not among them. Pure moduli of odd count (|u|) are kept: they are what a broken drag law looks like.
    """
    seen: dict[tuple[int, ...], str] = {}
    for size in range(1, degree + 1):
        for factors in combinations_with_replacement(_ORDER, size):
            text = canonical(factors)
            power = tuple(sum(f.strip("|") == name for f in factors) for name in "uvr")
            sign = tuple(sum(f == name for f in factors) % 2 for name in "uvr")
            seen.setdefault(power + sign, text)
    return tuple(parse_form(text) for text in seen.values())
