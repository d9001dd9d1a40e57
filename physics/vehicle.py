"""The vehicle: Fossen's 3-DOF model as a file that a person can read, edit and trust."""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, ValidationError, ValidationInfo, model_validator

from .effects import COMMAND_OFFSET, EFFECTS, PARAMETERS, Effect, Parameter, parse_form
from .errors import VehicleError, shown
from .files import on_top, write_text, yaml_text
from .motion import AXES
from .plausibility import find_impossible, insistable
from .reading import (
    Number,
    Plain,
    Positive,
    complaint,
    complaints,
    parse_yaml,
    positive,
    read_yaml,
    reason,
    unknown_key,
)
from .thrusters import GAINS, Thruster

_LONGEST_NAME = 200
"""Letters of a name: two lines of a page."""
_MOST_THRUSTERS = 64
"""Thrusters of a vehicle: twice the outputs of an autopilot (ArduPilot has 32)."""
_MOST_TERMS = 1000
"""Terms that nobody has named: more than three times all monomials up to degree three, on three axes."""
SECTIONS = ("added_mass", "damping", "coupling", "environment", "memory")
"""Parts of a vehicle file that hold symbols of the catalogue."""
_FAULTS = (
    *("thrust_scale", "arm_scale", "thrust_rate", "reverse_scale", "thrust_exponent", "dead_zone", "lag", "delay"),
    "advance_loss",
)
"""The faults of the catalogue that a thruster may have, but for gains and its own scale."""
_MOST_OF_HULL: dict[str, float] = {
    **dict.fromkeys(("X_udot", "Y_vdot", "N_rdot"), 20.0),
    **dict.fromkeys(("X_u", "Y_v", "N_r"), 100.0),
}
"""Added mass over mass, and linear damping over mass [1/s], that no hull exceeds; of the moment of inertia in yaw."""
SHARED_THRUSTER_KEYS = (*_FAULTS, COMMAND_OFFSET.symbol, *GAINS)
"""Thruster parameters that an effect moves on every thruster at once."""


def _keys(section: str) -> tuple[str, ...]:
    return tuple(p.symbol for p in PARAMETERS.values() if p.section == section)


class Term(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """A force nobody has named: `value` times the monomial `form` (of velocity relative to the water) on one axis."""

    axis: Literal["surge", "sway", "yaw"]
    form: str = Field(max_length=_LONGEST_NAME)
    value: Number

    @model_validator(mode="after")
    def _readable(self) -> "Term":
        parse_form(self.form)
        return self

    @property
    def symbol(self) -> str:
        """Unique name of the term, for example `yaw:u|r|`."""
        return f"{self.axis}:{self.form}"


class Hull(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """The hull in the water: `length` along it, centred on the body origin, and `draught` below it [m]."""

    length: Positive
    draught: Positive


def _to_be_judged(info: ValidationInfo) -> bool:
    """True when a vehicle that cannot be is wanted all the same, see `load_vehicle`."""
    return bool(info.context and info.context.get("judged"))


def _positive(value: float, info: ValidationInfo) -> float:
    return value if _to_be_judged(info) else positive(value)


def _one_or_several(keys: Any) -> Any:
    return (keys,) if isinstance(keys, str) else keys


class Vehicle(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """A surface vehicle in three degrees of freedom: M nu_r_dot + C(nu_r) nu_r + D(nu_r) nu_r = tau + other.

    `about` says in a line what boat it is. Symbols and signs follow SNAME (1950) and Fossen (2021), chapter 6:
    hydrodynamic derivatives carry their sign, so damping and added mass are negative. `mass` [kg], `inertia_z` [kg m^2]
    about the body origin, `x_g` and `y_g` [m] ahead and to starboard of the origin, `hull` what of it is in the water,
    which only some effects ask for. Sections hold the symbols of the effects catalogue; an absent symbol has its null
    value. What no hull has, such as positive damping, is refused unless `insist` names it (see
    `plausibility.find_impossible`).
    """

    name: str = Field(default="vehicle", max_length=_LONGEST_NAME)
    about: str = Field(default="", max_length=_LONGEST_NAME)
    mass: Annotated[Number, AfterValidator(_positive)]
    inertia_z: Annotated[Number, AfterValidator(_positive)]
    x_g: Number = 0.0
    y_g: Number = 0.0
    hull: Hull | None = None
    added_mass: dict[str, Number] = {}
    damping: dict[str, Number] = {}
    coupling: dict[str, Number] = {}
    thrusters: tuple[Thruster, ...] = Field(min_length=1, max_length=_MOST_THRUSTERS)
    environment: dict[str, Number] = {}
    memory: dict[str, Number] = {}
    terms: tuple[Term, ...] = Field(default=(), max_length=_MOST_TERMS)
    insist: Annotated[tuple[str, ...], BeforeValidator(_one_or_several)] = Field(default=(), max_length=_MOST_TERMS)
    sources: Plain = {}

    @model_validator(mode="before")
    @classmethod
    def _one_namespace(cls, data: Any) -> Any:
        """Put a hydrodynamic derivative that stands under `coupling` or `damping` under its own of the two."""
        if not isinstance(data, dict):
            return data
        data = dict(data)
        pair = {s: dict(data[s]) for s in ("damping", "coupling") if isinstance(data.get(s), dict)}
        for here, there in (("damping", "coupling"), ("coupling", "damping")):
            for symbol in [s for s in pair.get(here, {}) if s in _keys(there)]:
                if symbol in pair.setdefault(there, {}):
                    raise ValueError(f"{symbol} stands twice, under damping and under coupling; keep one")
                pair[there][symbol] = pair[here].pop(symbol)
        return {**data, **pair}

    @model_validator(mode="after")
    def _sound(self, info: ValidationInfo) -> "Vehicle":
        for section in SECTIONS:
            for key in getattr(self, section):
                if key not in _keys(section):
                    raise ValueError(unknown_key(key, _keys(section), section))
        asked = next((e for e in EFFECTS if lacking(self, e) and any(self.value(s) for s in e.symbols)), None)
        if asked is not None:
            raise ValueError(f"{asked.symbols[0]} = {self.value(asked.symbols[0]):g} {lacking(self, asked)}")
        names = [t.name for t in self.thrusters]
        if len(set(names)) < len(names):
            raise ValueError(f"thruster names must differ, got {', '.join(names)}")
        symbols = [t.symbol for t in self.terms]
        twice = sorted({s for s in symbols if symbols.count(s) > 1})
        if twice:
            raise ValueError(f"terms: {', '.join(twice)} stands twice; keep one, with the sum of the values")
        m22, m33 = self.mass - self.value("Y_vdot"), self.inertia_z - self.value("N_rdot")
        m23 = self.mass * self.x_g - self.value("Y_rdot")
        m11, m13 = self.mass - self.value("X_udot"), -self.mass * self.y_g
        definite = m11 > 0 and m22 > 0 and m33 > m23**2 / m22 + m13**2 / m11
        if not definite and not _to_be_judged(info):
            raise ValueError(
                "the mass matrix M = M_RB + M_A is not positive definite: "
                f"m11={m11:g}, m22={m22:g}, m33={m33:g}, m23={m23:g}, m13={m13:g}; "
                "added mass carries its sign (X_udot = -2.6 adds 2.6 kg)"
            )
        if self.value("fouling_rate") < 0.0:
            raise ValueError(
                f"fouling_rate must not be negative, got {self.value('fouling_rate'):g} 1/min: damping that falls for "
                "long enough would drive the boat"
            )
        shadowed = [name for name in names if f"{name}_scale" in SHARED_THRUSTER_KEYS]
        if shadowed:
            raise ValueError(
                f"a thruster cannot be named {shadowed[0]!r}: {shadowed[0]}_scale is that of all thrusters"
            )
        if self.value("memory_time") <= 0:
            raise ValueError(f"memory_time must be positive, got {self.value('memory_time'):g} s")
        known = insistable(self.values, self.thrusters)
        for key in self.insist:
            if key not in known:
                raise ValueError(unknown_key(key, known, "insist"))
        refused = {
            key: why for key, why in find_impossible(self.values, self.thrusters).items() if key not in self.insist
        }
        if refused and not _to_be_judged(info):
            whole = ", ".join(dict.fromkeys((*self.insist, *refused)))
            raise ValueError(f"{'; '.join(refused.values())}; or say so in the vehicle file with 'insist: [{whole}]'")
        return self

    @cached_property
    def values(self) -> dict[str, float]:
        """Every parameter by symbol, null values included; shared thruster parameters from the first thruster."""
        flat = {p.symbol: p.null for p in PARAMETERS.values() if "{" not in p.symbol}
        flat |= {"mass": self.mass, "inertia_z": self.inertia_z, "x_g": self.x_g, "y_g": self.y_g}
        for section in SECTIONS:
            flat |= getattr(self, section)
        flat |= {key: getattr(self.thrusters[0], key) for key in SHARED_THRUSTER_KEYS}
        flat |= {f"{t.name}_scale": t.scale for t in self.thrusters}
        flat |= {t.symbol: t.value for t in self.terms}
        return flat

    def value(self, symbol: str) -> float:
        """Value of one parameter; an absent one has its null value.

        Raises
        ------
        VehicleError
            for a symbol that no parameter or term of this vehicle bears.
        """
        if symbol not in self.values:
            if ":" in symbol:
                return 0.0
            raise VehicleError(unknown_key(symbol, self.values, "the vehicle's parameters"))
        return self.values[symbol]

    def with_values(self, changes: Mapping[str, float], name: str | None = None) -> "Vehicle":
        """A vehicle with some parameters set, by symbol; `axis:form` symbols set extra terms.

        Nothing is checked here, so that a regression may step outside the limits; `checked` does that.
        """
        update: dict[str, object] = {} if name is None else {"name": name}
        sections: dict[str, dict[str, float]] = {}
        thrusters = list(self.thrusters)
        terms = {t.symbol: t for t in self.terms}
        by_name = {f"{t.name}_scale": k for k, t in enumerate(thrusters)}
        for symbol, value in changes.items():
            number = float(value)
            if ":" in symbol:
                self.parameter(symbol)
                axis, form = symbol.split(":", 1)
                terms[symbol] = Term(axis=axis, form=form, value=number)  # type: ignore[arg-type]
            elif symbol in by_name:
                k = by_name[symbol]
                thrusters[k] = thrusters[k].model_copy(update={"scale": number})
            elif symbol in SHARED_THRUSTER_KEYS:
                thrusters = [t.model_copy(update={symbol: number}) for t in thrusters]
            elif symbol in ("mass", "inertia_z", "x_g", "y_g"):
                update[symbol] = number
            elif symbol in PARAMETERS:
                section = PARAMETERS[symbol].section
                sections.setdefault(section, dict(getattr(self, section)))[symbol] = number
            else:
                raise VehicleError(unknown_key(symbol, self.values, "the vehicle's parameters"))
        update |= sections | {"thrusters": tuple(thrusters), "terms": tuple(terms.values())}
        copy = self.model_copy(update=update)
        vars(copy).pop("values", None)  # the cache of this vehicle, which the copy brought along
        return copy

    def checked(self) -> "Vehicle":
        """The same vehicle, validated again after `with_values`.

        Raises
        ------
        VehicleError
            when a limit of the file format is broken.
        """
        return vehicle_from_dict(self.model_dump(mode="json") | {"insist": self._insisted}, self.name)

    @property
    def _insisted(self) -> list[str]:
        """What it insists on, and what `with_values` made of it that no hull has: undertow reads what it wrote."""
        return list(dict.fromkeys((*self.insist, *find_impossible(self.values, self.thrusters))))

    def parameter(self, symbol: str) -> Parameter:
        """The catalogue's description of a symbol; a `<thruster>_scale` or an extra term has one of its own.

        Added masses and linear dampings have a limit of this hull, beyond which none is: twenty times its own mass, and
        what stops that mass within a hundredth of a second; or the value in the file, where that is beyond.
        """
        if symbol in PARAMETERS:
            most = _MOST_OF_HULL.get(symbol)
            if most is None:
                return PARAMETERS[symbol]
            own = self.inertia_z if symbol in ("N_rdot", "N_r") else self.mass
            return replace(PARAMETERS[symbol], lower=min(-most * own, self.values[symbol]))
        if symbol == COMMAND_OFFSET.symbol:
            return COMMAND_OFFSET
        if symbol in {f"{t.name}_scale" for t in self.thrusters}:
            return PARAMETERS["{thruster}_scale"]
        if ":" in symbol:
            axis, form = symbol.split(":", 1)
            if axis not in AXES:
                raise VehicleError(f"term {symbol!r}: expected surge, sway or yaw before the colon, got {axis!r}")
            parsed, index = parse_form(form), AXES.index(axis)
            moment = "N m" if index == 2 else "N"
            speeds = sum(f.strip("|") != "r" for f in parsed.factors)
            rates = parsed.degree - speeds
            unit = " ".join(
                [moment, *([f"(s/m)^{speeds}"] if speeds else []), *([f"(s/rad)^{rates}"] if rates else [])]
            )
            return Parameter(symbol, "coupling", unit, axis=index, form=form)
        raise VehicleError(unknown_key(symbol, self.values, "the vehicle's parameters"))

    @property
    def digest(self) -> str:
        """Sixteen hexadecimal digits that tell this vehicle from any other; what it is about is none of it."""
        unsaid = {"about"} if self.hull is not None else {"about", "hull"}
        return hashlib.sha256(self.model_dump_json(exclude=unsaid).encode()).hexdigest()[:16]

    def save(self, path: str | os.PathLike[str], by: str | None = None) -> None:
        """Write the vehicle file (YAML, DESIGN section 4), to a temporary name first, then renamed.

        Parameters
        ----------
        by : verb that made the vehicle, for a mark on top, by which the verb knows its own file (see `files`)
        """
        text = yaml_text(self.to_dict(), width=120)
        write_text(path, text if by is None else on_top(by, text))

    def to_dict(self) -> Plain:
        """The content of the vehicle file, which `vehicle_from_dict` reads; what has its null value is left out."""
        data = self.model_dump(mode="json", exclude_defaults=True)
        if self._insisted:
            data["insist"] = self._insisted
        return {key: data[key] for key in type(self).model_fields if key in data}


_HOW_TO_STATE = {"hull": "hull: {length, draught}, in metres"}
"""What to write into a vehicle file for the keys that only some effects ask for."""


def lacking(vehicle: Vehicle, effect: Effect) -> str:
    """Numbers that a vehicle file lacks before it can have an effect, in words behind its name; empty for none."""
    absent = [key for key in effect.requires if getattr(vehicle, key) is None]
    text = " and ".join(_HOW_TO_STATE[key] for key in absent)
    return text and f"needs the size of the hull: give {text}, in the vehicle file"


def hull_of(vehicle: Vehicle) -> Hull:
    """The size of a vehicle's hull.

    Raises
    ------
    VehicleError
        when the vehicle file does not state it.
    """
    if vehicle.hull is None:
        raise VehicleError(f"{vehicle.name}: expected {_HOW_TO_STATE['hull']}, in the vehicle file, got none")
    return vehicle.hull


def vehicle_from_dict(data: Any, where: str, *, judged: bool = False) -> Vehicle:
    """Build a vehicle from plain data; one that cannot be too, where it is to be `judged`.

    Parameters
    ----------
    data : plain data of a vehicle file
    where : the file, for messages
    judged : refuse a hull that cannot be

    Raises
    ------
    VehicleError
        naming `where`, the key, and the nearest known key when one is unknown.
    """
    if not isinstance(data, dict):
        raise VehicleError(
            f"{where}: expected a mapping of vehicle keys (mass, inertia_z, thrusters ...), got {type(data).__name__}"
        )
    try:
        return Vehicle.model_validate(data, context={"judged": judged})
    except ValidationError as error:
        items = error.errors(include_url=False)
        within = any(item["loc"][:1] == ("thrusters",) and len(item["loc"]) > 1 for item in items)
        # Thrusters that are refused one by one are no longer counted: that there are too few is no news.
        told = [
            item for item in items if not (within and item["loc"] == ("thrusters",) and item["type"] == "too_short")
        ]
        raise VehicleError(f"{where}: {complaints(told, lambda item: _in_words(item, data))}") from None


_MEANT = {
    "mass": "kg",
    "inertia_z": "moment of inertia in yaw about the origin, kg m^2",
    "thrusters": "a list, each with name, x, y, command and curve",
    "name": "a word such as port",
    "length": "metres of hull in the water",
    "draught": "metres of hull below the waterline",
    "x": "metres ahead of the origin",
    "y": "metres to starboard of the origin, negative at port",
    "command": "pwm, normalized, rad_s or newton",
    "curve": "how its command becomes a force in newtons, for example {kind: table, command: [1100, 1500, 1900], "
    "force: [-30, 0, 30]}",
    "kind": "table or propeller",
    "axis": "surge, sway or yaw",
    "form": "such as u|r|",
}
"""What the keys of a vehicle file mean, said where one is missing."""
_PARTS: dict[str, type[BaseModel]] = {"terms": Term, "hull": Hull}
"""Parts of a vehicle file that have keys of their own."""
_POINTS = "a list of numbers, one a point of the curve"


def _in_words(item: Any, data: Any) -> str:
    """One of pydantic's complaints about a vehicle file in the words of a vehicle."""
    path = [str(part) for part in item["loc"] if part not in ("table", "propeller")]
    if item["type"] != "extra_forbidden":
        place, inner = "", path
        if path[:1] == ["thrusters"] and len(path) > 1:
            built = data["thrusters"][int(path[1])]
            name = built.get("name") if isinstance(built, dict) else None
            place = f"thruster {shown(name)}: " if isinstance(name, str) else f"thruster {int(path[1]) + 1}: "
            inner = path[2:]
        meant = (
            _POINTS
            if path[-2:-1] == ["curve"] and path[-1] in ("command", "force")
            else _MEANT.get("".join(path[-1:]), "")
        )
        return place + complaint(item, inner, meant)
    inside = path[:-1]
    model = Thruster if inside[:1] == ["thrusters"] and len(inside) == 2 else _PARTS.get("".join(inside[:1]), Vehicle)
    return unknown_key(path[-1], model.model_fields, ".".join(inside) or "the vehicle file")


def shipped_vehicles() -> tuple[str, ...]:
    """Names of the vehicle files that come with undertow."""
    return tuple(sorted(p.name.removesuffix(".yaml") for p in _shipped().iterdir() if p.name.endswith(".yaml")))


def _shipped() -> Any:
    return resources.files(__package__ or "undertow.physics") / "vehicles"


def load_vehicle(path: str | os.PathLike[str], *, judged: bool = False) -> Vehicle:
    """Read a vehicle file, or one of the shipped ones by its bare name (`blueboat`, `otter`, ...).

    Parameters
    ----------
    path : of the file, or of a run folder, whose corrected vehicle is meant
    judged : take a vehicle that cannot be too (a mass that is not positive, drag that drives): it is about to be
        judged by the laws

    Raises
    ------
    VehicleError
        when the file is missing, is not YAML, or breaks the format.
    """
    text = os.fspath(path)
    source = Path(text)
    if not source.exists() and text in shipped_vehicles():
        return vehicle_from_dict(parse_yaml((_shipped() / f"{text}.yaml").read_text("utf-8")), text)
    if (source / "model.yaml").is_file():
        source = source / "model.yaml"
    if source.is_dir():
        raise VehicleError(
            f"vehicle file {text}: this is a folder without a model.yaml; give a YAML file, or the folder of a run"
        )
    if not source.exists():
        raise VehicleError(
            f"vehicle file {text}: no such file; give a YAML file or one of {', '.join(shipped_vehicles())}"
        )
    try:
        data = read_yaml(source)
    except (OSError, ValueError) as error:
        raise VehicleError(f"vehicle file {text}: not readable as YAML ({reason(error)})") from None
    if isinstance(data, dict) and "schema" in data:
        raise VehicleError(
            f"vehicle file {text}: this is a file of schema {shown(data['schema'])}, not a vehicle; give the vehicle's "
            "file"
        )
    return vehicle_from_dict(data, f"vehicle file {text}", judged=judged)
