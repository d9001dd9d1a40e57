"""The catalogue: every physical effect undertow knows, as parameters of the one force equation.

An effect is one entry of `effects.toml`. Its parameters name the place in the vehicle file, the unit, the null value
that means "absent" and the physical limits; hydrodynamic ones also name the axis and the monomial of u, v, r and their
moduli that they multiply, which is read here. Force forms follow Fossen, *Handbook of Marine Craft Hydrodynamics and
Motion Control* (2nd ed., 2021), chapters 6, 9 and 10.
"""

import re
import tomllib
from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import combinations_with_replacement
from operator import mul
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from .errors import RequestError, VehicleError, nearest, shown

if TYPE_CHECKING:
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

    def __call__(self, surge_speed: "Array", sway_speed: "Array", yaw_rate: "Array") -> "Array":
        """Value of the monomial; the arrays broadcast [m/s, m/s, rad/s], and may be tensors."""
        speeds = {"u": surge_speed, "v": sway_speed, "r": yaw_rate}
        return reduce(mul, (abs(speeds[f[1]]) if f.startswith("|") else speeds[f] for f in self.factors))

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
    factors = [name for name, power in _FACTOR.findall(squeezed) for _ in range(int(power or 1))]
    if _FACTOR.sub("", squeezed) or not 1 <= len(factors) <= 3:
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


Section = Literal["top", "added_mass", "damping", "coupling", "thrusters", "environment", "memory"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of the vehicle model that an effect moves.

    Attributes
    ----------
    symbol : name in the literature's notation, unique; `{thruster}_scale` stands for one symbol a thruster
    section : where it lives in the vehicle file
    unit : SI unit
    null : value that means the effect is absent
    axis : the one that it acts on; None where it acts on several, or through something else
    form : for hydrodynamic terms, the monomial that the parameter multiplies
    lower, upper : physical limits of the total (nominal plus found) value
    grid : starting values when the parameter shapes the force non-linearly
    step : finite-difference step for its column of the regression [same unit]
    nonlinear : True when the force is not linear in it, so that its column changes with its value
    stepped : True when the force moves in steps with it, so that no derivative leads to the best value
    attainable : True when a value at a physical limit is nothing unusual, as a flat stretch of a thrust curve is
    """

    symbol: str
    section: Section
    unit: str
    null: float = 0.0
    axis: int | None = None
    form: str = ""
    lower: float = -float("inf")
    upper: float = float("inf")
    grid: tuple[float, ...] = ()
    step: float = 1.0
    nonlinear: bool = False
    stepped: bool = False
    attainable: bool = False


@dataclass(frozen=True, slots=True)
class Effect:
    """One entry of the catalogue.

    Attributes
    ----------
    name : stable name used by the command line and the files
    family : hull, coupling, mass, thruster, environment, memory or trim
    parameters : what it moves, in the order in which values are given on the command line
    equation : the added force, in symbols
    meaning : one sentence for the engineer
    added : True when values are reported as the amount missing from the nominal model, False when absolute
    fixed_amplitude : True when the parameters reshape the command and have no free amplitude (lag, delay, dead zone)
    per_thruster : True when the effect concerns one thruster at a time
    default : a value for each parameter used where the user gives fewer values than parameters
    channels : channels of the log, beside those that every log has, without which it cannot be judged
    requires : keys of the vehicle file, beside those that every file has, without which it has no size
    includes : names of simpler effects that are special cases of it; they are preferred by price, not by correlation
    """

    name: str
    family: str
    parameters: tuple[Parameter, ...]
    equation: str
    meaning: str
    added: bool = True
    fixed_amplitude: bool = False
    per_thruster: bool = False
    default: tuple[float, ...] = ()
    channels: tuple[str, ...] = ()
    requires: tuple[str, ...] = ()
    includes: tuple[str, ...] = ()

    @property
    def general(self) -> bool:
        """True when simpler effects are special cases of it."""
        return bool(self.includes)

    @property
    def timed(self) -> bool:
        """True when its force is one of accelerations or of the past, which channels out of step look like most.

        A force of this very instant is nearly orthogonal to what a small shift adds to it, its derivative.
        """
        return self.family == "mass" or any(p.unit == "s" for p in self.parameters)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Symbols of the effect's parameters."""
        return tuple(p.symbol for p in self.parameters)

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """The parameters in which the force is linear (about the current value)."""
        return tuple(p for p in self.parameters if not p.grid)

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """The parameters that bend the force non-linearly and are searched over a grid, then refined."""
        return tuple(p for p in self.parameters if p.grid)


_AXES = {"surge": 0, "sway": 1, "yaw": 2}
"""Numbers of the axes, which the file names."""


def _frozen(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _parameter(symbol: str, axis: str | None = None, **said: Any) -> Parameter:
    number = None if axis is None else _AXES[axis]
    return Parameter(symbol, axis=number, **{key: _frozen(value) for key, value in said.items()})


def _effect(name: str, parameters: Any, **said: Any) -> Effect:
    moved = tuple(_parameter(symbol, **entry) for symbol, entry in parameters.items())
    return Effect(name, parameters=moved, **{key: _frozen(value) for key, value in said.items()})


_CATALOGUE = Path(__file__).with_name("effects.toml").read_text("utf-8")
EFFECTS: tuple[Effect, ...] = tuple(_effect(name, **entry) for name, entry in tomllib.loads(_CATALOGUE).items())
"""Every effect of the catalogue."""

BY_NAME: dict[str, Effect] = {effect.name: effect for effect in EFFECTS}

COMMAND_OFFSET = Parameter("command_offset", "thrusters", "s", lower=-2.0, upper=2.0, step=0.01, nonlinear=True)
"""How much earlier than it acted a command was recorded; later where it is negative. An error of a log: no vehicle has
it."""

EXTRA_PARAMETERS: tuple[Parameter, ...] = (
    Parameter("Y_rdot", "added_mass", "kg m"),
    Parameter("inertia_z", "top", "kg m^2"),
)
"""Numbers of the vehicle that no effect moves."""

PARAMETERS: dict[str, Parameter] = {
    p.symbol: p for p in (*(p for effect in EFFECTS for p in effect.parameters), *EXTRA_PARAMETERS)
}


def effect_named(name: str) -> Effect:
    """Look an effect up by name.

    Raises
    ------
    RequestError
        when there is no such effect; the text names the nearest one.
    """
    if name in BY_NAME:
        return BY_NAME[name]
    near = next(iter(_owners(name)), None) or nearest(name, BY_NAME)
    raise RequestError(
        f"unknown effect {name!r}: did you mean {near!r}? The catalogue has: {', '.join(sorted(BY_NAME))}"
    )


def _owners(symbol: str) -> list[str]:
    """Effects of which something is a symbol, that of every thruster last.

    Examples
    --------
    >>> _owners("X_uu"), _owners("port_scale"), _owners("drag")
    (['surge_quadratic_damping'], ['thruster_asymmetry'], [])
    """
    exact = [effect.name for effect in EFFECTS if symbol in effect.symbols]
    ends = [(effect.name, one.removeprefix("{thruster}")) for effect in EFFECTS for one in effect.symbols]
    return exact or [name for name, end in ends if end.startswith("_") and symbol.endswith(end)]
