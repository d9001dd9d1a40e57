"""Numbers that no hull has (driving drag, negative added mass, a port thruster to starboard), unless a user insists."""

from collections.abc import Mapping, Sequence

import numpy as np

from .effects import PARAMETERS, Form, parse_form
from .motion import AXES
from .thrusters import Thruster, side_named

_WORDS = {
    "damping": "damping {symbol} = {value:+g}{unit} would drive the boat; a hydrodynamic derivative carries its sign, "
    "and that of damping is negative: write {turned:g}",
    "added_mass": "added mass {symbol} = {value:+g}{unit} would make the hull lighter in water; a hydrodynamic "
    "derivative carries its sign (X_udot = -2.6 adds 2.6 kg): write {turned:g}",
}
_BEYOND = "damping {symbol} = {value:g}{unit} is more than any hull has: at most {upper:g} was expected"
_NEGATIVE = "drag coefficient {symbol} = {value:+g} would drive the boat; it is positive: write {turned:g}"
_COEFFICIENTS = tuple(p.symbol for p in PARAMETERS.values() if p.section == "damping" and p.unit == "1")
"""Drag coefficients, which carry no sign."""
_SPEEDS = np.array([0.03, 0.1, 0.3, 1.0, 3.0, 10.0])
"""Speeds at which the drag of an axis is asked whether it drives [m/s, rad/s]: of a model ship up to a fast boat."""
_RADII = 30.0
"""Radii of gyration from the origin within which a thruster is aboard: the ends of a hull are at 2; millimetres that
were meant for metres are at 1000."""


def find_impossible(values: Mapping[str, float], thrusters: Sequence[Thruster]) -> dict[str, str]:
    """Numbers that no hull has, by the key to insist on, as sentences without an end.

    The signs are those of the catalogue's limits, which a fit keeps too. Only what is certain is told: coupling has
    either sign in published models, and so has a term of the third degree beside others that outweigh it.

    Parameters
    ----------
    values : every parameter of a vehicle by symbol
    thrusters : of the vehicle
    """
    return _signs(values) | _terms(values) | _places(values, thrusters)


def insistable(values: Mapping[str, float], thrusters: Sequence[Thruster]) -> set[str]:
    """Every key that a vehicle may insist on."""
    limited = {p.symbol for p in PARAMETERS.values() if p.section in _WORDS and np.isfinite(p.upper)}
    return {*limited, *_COEFFICIENTS, "x_g", "y_g", *(s for s in values if ":" in s), *(t.name for t in thrusters)}


def _signs(values: Mapping[str, float]) -> dict[str, str]:
    result = {}
    for symbol, value in values.items():
        limits = PARAMETERS.get(symbol)
        # A solver's number on a limit has rounding.
        if limits is not None and limits.section in _WORDS and value > limits.upper * (1.0 + 1e-9):
            unit = "" if limits.unit == "1" else f" {limits.unit}"
            words = _BEYOND if limits.upper > 0.0 else _WORDS[limits.section]
            result[symbol] = words.format(symbol=symbol, value=value, unit=unit, turned=-value, upper=limits.upper)
        elif symbol in _COEFFICIENTS and value < 0.0:
            result[symbol] = _NEGATIVE.format(symbol=symbol, value=value, turned=-value)
    return result


def _terms(values: Mapping[str, float]) -> dict[str, str]:
    """Terms of an axis in its own speed alone, where they make all its drag drive at every speed one way or the other.

    A term may drive where the rest of the drag outweighs it.
    """
    result = {}
    drags: dict[int, dict[str, Form]] = {axis: {} for axis in range(3)}
    for symbol in values:
        axis, form = _monomial(symbol)
        if form is not None and {factor.strip("|") for factor in form.factors} == {"uvr"[axis]}:
            drags[axis][symbol] = form
    for symbol in [s for s in values if ":" in s and values[s] != 0.0]:
        own = drags[_monomial(symbol)[0]]
        for way in (1.0, -1.0) if symbol in own else ():
            speeds = way * _SPEEDS
            force = {s: values[s] * form(speeds, speeds, speeds) for s, form in own.items()}
            drag = np.sum(list(force.values()), axis=0)
            if (way * drag > 0.0).all() and (way * force[symbol] > 0.0).all():
                result[symbol] = (
                    f"term {symbol} = {values[symbol]:+g} would drive the boat at every speed: drag opposes "
                    f"the motion; write {-values[symbol]:g}"
                )
    return result


def _monomial(symbol: str) -> tuple[int, Form | None]:
    """Axis and monomial of a symbol; no monomial where it has none."""
    if ":" in symbol:
        axis, form = symbol.split(":", 1)
        return AXES.index(axis), parse_form(form)
    known = PARAMETERS.get(symbol)
    return (0, None) if known is None or known.axis is None or not known.form else (known.axis, parse_form(known.form))


def _places(values: Mapping[str, float], thrusters: Sequence[Thruster]) -> dict[str, str]:
    result = {}
    mass, inertia, ahead, beside = (values[symbol] for symbol in ("mass", "inertia_z", "x_g", "y_g"))
    least = mass * (ahead**2 + beside**2)
    if inertia < least:
        result["x_g" if abs(ahead) >= abs(beside) else "y_g"] = (
            f"x_g = {ahead:g} m, y_g = {beside:g} m: a mass of {mass:g} kg that far from the origin has {least:g} "
            f"kg m^2 of inertia about it at least, and inertia_z, which is about the origin, is {inertia:g}"
        )
    # A regression may stand outside the limits, where a hull has no radius.
    far = _RADII * float(np.sqrt(inertia / mass)) if mass > 0.0 and inertia > 0.0 else np.inf
    for thruster in thrusters:
        side = {"port": -1.0, "starboard": 1.0}.get(side_named(thruster.name), 0.0)
        if side * thruster.y < 0.0:
            result[thruster.name] = (
                f"thruster {thruster.name}: y = {thruster.y:+g} m is on the other side; body axes are FRD, y is "
                f"positive to starboard: write y: {-thruster.y:g}"
            )
        elif np.hypot(thruster.x, thruster.y) > far:
            result[thruster.name] = (
                f"thruster {thruster.name}: at x = {thruster.x:g}, y = {thruster.y:g} it is not aboard: mass and "
                f"inertia_z are those of a hull of some {far / _RADII * 4:.2g} m; expected metres"
            )
    return result
