"""Sources of a vehicle's numbers: measured, identified, assumed, typical of a hull's length, or changed by hand.

Typical numbers are of the right size, not right: formulas through a model ship of 1.26 m (CyberShip II) and a catamaran
of 2 m (Otter), by T. I. Fossen's model of the Otter (MSS, VESSELS/models/otter.m, see `vehicles/otter.yaml`).
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import exp
from types import MappingProxyType

from .effects import PARAMETERS
from .errors import one_line
from .vehicle import Vehicle

ALL = "all"
"""The entry that speaks of every number for which no other entry does."""
EARLIER = "before: "
"""Before what a source said of a number that was identified since."""
WHOLE = "all of "
"""Before the names of logs of which no part was kept aside: a model was fitted to every row of them."""
NO_MARKS: Mapping[str, str] = MappingProxyType({})
"""Where nothing is known of how sure numbers are."""
_NOT_ALL = re.compile(r"Not of what undertow identified \(see (.*?)\): ")


def with_sources(before: Vehicle, after: Vehicle, how: str, marks: Mapping[str, str] = NO_MARKS) -> Vehicle:
    """The vehicle `after`, its `sources` saying of each number that is not that of `before` how it was found.

    An entry under a symbol is that symbol's; one under a section of the file (`damping`, `thrusters`, ...) keeps what
    it said, since that is still the source of the section's other numbers, and of these before.

    Parameters
    ----------
    how : such as "identified by undertow from log.csv"
    marks : how sure some numbers are, by symbol, such as "likely (85 %)"; it stands beside the symbol
    """
    how = one_line(how)  # it names logs, whose names may be no text that a file can hold
    sources = dict(after.sources)
    sections: dict[str, list[str]] = {}
    for symbol in [s for s in {**before.values, **after.values} if before.value(s) != after.value(s)]:
        section = _section(symbol)
        entry = sources.get(section)
        if symbol in sources:
            sources[symbol] = f"{_marked(how, symbol, marks)}; {EARLIER}{sources[symbol]}"
        elif isinstance(entry, dict):
            earlier = f"; {EARLIER}{entry[symbol]}" if symbol in entry else ""
            sources[section] = {**entry, symbol: _marked(how, symbol, marks) + earlier}
        elif section == symbol:
            sources[symbol] = _marked(how, symbol, marks)
        else:
            sections.setdefault(section, []).append(symbol)
    for section, symbols in sections.items():
        earlier = f"; the others, and these before: {sources[section]}" if section in sources else ""
        named = [f"{symbol} {marks[symbol]}" if symbol in marks else symbol for symbol in symbols]
        sources[section] = f"{', '.join(named)}: {how}{earlier}"
    moved = [key for key, entry in sources.items() if entry != after.sources.get(key)]
    if ALL in sources and moved:
        said = str(sources[ALL])
        marked = _NOT_ALL.match(said)
        see = dict.fromkeys([*(marked[1].split(", ") if marked else ()), *moved])
        sources[ALL] = f"Not of what undertow identified (see {', '.join(see)}): {_NOT_ALL.sub('', said, count=1)}"
    return after.model_copy(update={"sources": sources})


def _marked(how: str, symbol: str, marks: Mapping[str, str]) -> str:
    """How a number was found, after how sure it is."""
    return f"{marks[symbol]}: {how}" if symbol in marks else how


def _section(symbol: str) -> str:
    """The part of the vehicle file in which a symbol stands."""
    if ":" in symbol:
        return "terms"
    section = PARAMETERS[symbol].section if symbol in PARAMETERS else "thrusters"
    return symbol if section == "top" else section


_NUMBER = r"\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_SUM = rf"(?<![\w.*/^(+])(?<![*/^(+-] )-?{_NUMBER}(?: *[-+*/] *{_NUMBER})*"
"""A number, or a calculation without brackets, that is no part of another."""
_ALONE = r"(?![\w^/*])(?! (?:m|s|rad|kg|N)\b)"
"""After a unit: no more of it."""
_SAME = 0.006
"""Share by which a number may differ from the one that its source states: sources round to three digits."""


def stale_sources(vehicle: Vehicle) -> list[str]:
    """Say which numbers differ from the one that their source states.

    A source that stands under one symbol is read, and only where one number, or one calculation without brackets, has
    just the symbol's unit in it: several may be steps of a calculation, or other things.

    >>> from undertow.physics.vehicle import load_vehicle
    >>> print(*stale_sources(load_vehicle("otter").with_values({"mass": 100.0})))
    mass is 100 kg, but its source says 55 + 25 kg = 80 kg. Correct the source, or the number.
    """
    result = []
    for symbol, source in _of_one_number(vehicle):
        unit = vehicle.parameter(symbol).unit
        stated = re.findall(rf"({_SUM}) ?{re.escape(unit)}{_ALONE}", source.partition(EARLIER)[0])
        value = vehicle.value(symbol)
        if len(stated) == 1 and not math.isclose(number := _worth(stated[0]), value, rel_tol=_SAME):
            equals = "" if re.fullmatch(rf"-?{_NUMBER}", stated[0]) else f" = {number:g} {unit}"
            result.append(
                f"{symbol} is {value:g} {unit}, but its source says {stated[0]} {unit}{equals}. Correct the source, or "
                "the number."
            )
    return result


def _of_one_number(vehicle: Vehicle) -> Iterator[tuple[str, str]]:
    """The symbols that have a source of their own, and these."""
    within = [entry for entry in vehicle.sources.values() if isinstance(entry, dict)]
    for entries in (vehicle.sources, *within):
        yield from ((key, text) for key, text in entries.items() if key in vehicle.values and isinstance(text, str))


def _worth(calculation: str) -> float:
    """What a calculation without brackets comes to.

    >>> _worth("55 * 0.2 / 80"), _worth("30.5 - 0.5"), _worth("-2 + 1")
    (0.1375, 30.0, -1.0)
    """
    total = 0.0
    for sign, product in re.findall(rf"(^-?|[-+]) *({_NUMBER}(?: *[*/] *{_NUMBER})*)", calculation):
        first, *others = re.findall(rf"([*/]?) *({_NUMBER})", product)
        worth = float(first[1])
        for operator, factor in others:
            worth = worth * float(factor) if operator == "*" else worth / (float(factor) or math.inf)
        total += -worth if sign == "-" else worth
    return total


TO_REPLACE = "to be replaced"
"""In the source of a number that is typical of such a boat, guessed, or another boat's."""
SURE = "sure to a factor of"
"""In the source of a number that is typical in part, before the factor within which it is right in 95 of 100 cases."""
_SURE = re.compile(rf"{SURE} [\d.]*\d")


_OF_THRUSTERS = {"force": "thrust_scale", "y": "arm_scale"}
"""The parts of a thruster's source that are about numbers, and the parameter by which all thrusters have another."""


def assumed(vehicle: Vehicle) -> dict[str, str]:
    """Assumed numbers of a vehicle by symbol, each with what its source says of how sure it is.

    Thrust and places of the thrusters stand under `thrust_scale` and `arm_scale`, numbers without a source of their own
    under `all`. What was identified or given since is not assumed any more.

    >>> from undertow.physics.vehicle import load_vehicle
    >>> port = {"port": "force: full 33 N, typical, sure to a factor of 2.5; x: given"}
    >>> sources = {"mass": "typical, to be replaced: 14 kg", "thrusters": port}
    >>> assumed(load_vehicle("otter").model_copy(update={"sources": sources}))
    {'mass': 'typical, to be replaced: 14 kg', 'thrust_scale': 'full 33 N, typical, sure to a factor of 2.5'}
    """
    return {symbol: text for symbol, text in _sources(vehicle) if TO_REPLACE in text or SURE in text}


def how_sure(source: str) -> str:
    """The factor within which a source says that its number is; empty where it says none."""
    found = _SURE.search(source)
    return found[0] if found else ""


def _sources(vehicle: Vehicle) -> Iterator[tuple[str, str]]:
    """Every source as it is now, by symbol."""
    for key, entry in vehicle.sources.items():
        own = entry if isinstance(entry, dict) else {key: entry}
        for name, text in own.items():
            now = str(text).partition(EARLIER)[0]
            if key != "thrusters":
                yield name, now
                continue
            for part in now.split("; "):
                what, _, told = part.partition(": ")
                symbol = _OF_THRUSTERS.get(what)
                if symbol is not None and symbol not in own:
                    yield symbol, told


LENGTH = 1.2
"""Length that is taken where nobody tells one [m]: that of the small boats that two thrusters drive by hand."""
_DENSITY = 1025.0
"""Of sea water [kg/m^3]."""
_FORCE_PER_MASS = 3.0
"""Full thrust of all thrusters over mass [N/kg]: 2.3 of a BlueBoat in Gazebo, 4.4 of an empty Otter."""
THRUST_SPREAD = 0.46
"""Standard deviation of the logarithm of that: the two lie a factor of 1.9 apart."""
_SURGE_TIME, _SWAY_TIME, _YAW_TIME = 2.0, 1.0, 1.0
"""Times in which drag stops a hull [s]: sway and yaw of otter.m; in surge 1.1 s there, 2.2 s of Gazebo's BlueBoat."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number of a vehicle and where it is from."""

    value: float
    source: str


def typical_mass(length: float) -> Estimate:
    """Mass [kg] of a boat of this length [m]."""
    return _typical(14.0 * length**2, "14 kg/m^2 length^2 (CyberShip II 1.26 m, 23.8 kg; Otter 2.0 m, 55 kg)", length)


def typical_spacing(length: float) -> Estimate:
    """Distance between a port and a starboard thruster [m] of a boat of this length [m]."""
    return _typical(0.44 * length, "0.44 length (Otter 0.79 m of 2.0 m; BlueBoat in Gazebo 0.59 m of 1.2 m)", length)


def typical_thrust(mass: float, thrusters: int) -> Estimate:
    """Full thrust of each of some thrusters [N] on a boat of this mass [kg]."""
    words = (
        f"typical of small boats, {TO_REPLACE}: {_FORCE_PER_MASS:g} N/kg mass / {thrusters} (Otter 4.4 N/kg), {SURE} "
        f"{exp(1.96 * THRUST_SPREAD):.1f}"
    )
    return Estimate(_round(_FORCE_PER_MASS * mass / thrusters), words)


def typical_inertia(mass: float, length: float) -> Estimate:
    """Moment of inertia in yaw [kg m^2] of a boat of this mass [kg] and length [m], about its middle."""
    return _typical(mass * (0.25 * length) ** 2, "mass (0.25 length)^2 (otter.m)", length)


def typical_added_mass(mass: float, inertia: float, length: float) -> dict[str, Estimate]:
    """Added masses of a boat of this mass [kg], moment of inertia [kg m^2] and length [m], by symbol.

    In surge by Soeding (1982), as otter.m has it.

    Parameters
    ----------
    mass, inertia, length : of the boat [kg, kg m^2, m]
    """
    surge = 2.7 * _DENSITY * (mass / _DENSITY) ** (5.0 / 3.0) / length**2
    return {
        "X_udot": _typical(-surge, "-2.7 rho (mass/rho)^(5/3) / length^2, rho 1025 kg/m^3 (Soeding 1982)", length),
        "Y_vdot": _typical(-1.5 * mass, "-1.5 mass (otter.m)", length),
        "N_rdot": _typical(-1.7 * inertia, "-1.7 inertia_z (otter.m)", length),
    }


def typical_damping(inertias: tuple[float, float, float], length: float) -> dict[str, Estimate]:
    """Linear damping of a boat by symbol.

    Parameters
    ----------
    inertias : mass with added mass in surge and sway [kg], moment of inertia with that added in yaw [kg m^2]
    length : [m]
    """
    words = ("(mass - X_udot)", "(mass - Y_vdot)", "(inertia_z - N_rdot)")
    times = (_SURGE_TIME, _SWAY_TIME, _YAW_TIME)
    return {
        symbol: _typical(-inertia / time, f"-{word} / {time:g} s", length)
        for symbol, inertia, word, time in zip(("X_u", "Y_v", "N_r"), inertias, words, times, strict=True)
    }


def _typical(value: float, formula: str, length: float) -> Estimate:
    return Estimate(_round(value), f"typical of a hull of {length:g} m, {TO_REPLACE}: {formula}")


def _round(value: float) -> float:
    """Three digits: what is guessed has no more."""
    return float(f"{value:.3g}")
