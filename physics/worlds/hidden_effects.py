"""Hidden effects: what a simulated world has and the nominal model lacks, asked for by name and put into a vehicle."""

import math
from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from ..effects import BY_NAME, EFFECTS, PARAMETERS, Effect
from ..errors import RequestError, VehicleError
from ..vehicle import Vehicle, lacking

Values = float | Sequence[float]
_ADDED = frozenset(symbol for effect in EFFECTS if effect.added for symbol in effect.symbols)


def parse_effect(text: str) -> tuple[str, tuple[float, ...]]:
    """Read `name=value` or `name=value,value` of the command line; `apply_effects` takes what comes out.

    The name is an effect of the catalogue or one symbol of it; `thruster_asymmetry=port:0.8` chooses a thruster.

    Raises
    ------
    RequestError
        for an unknown effect (naming the nearest), a value that is not a number, or too many values.

    >>> parse_effect("surge_quadratic_damping=-9"), parse_effect("thruster_asymmetry=port:0.8")
    (('surge_quadratic_damping', (-9.0,)), ('port_scale', (0.8,)))
    """
    name, equals, given = (part.strip() for part in text.partition("="))
    if not equals or not name:
        raise RequestError(f"effect {text!r}: expected name=value, for example surge_quadratic_damping=-9")
    if name not in PARAMETERS and not name.endswith("_scale") and ":" not in name and name not in BY_NAME:
        raise RequestError(_unknown(name, (*BY_NAME, *(s for s in PARAMETERS if "{" not in s))))
    if name in BY_NAME and BY_NAME[name].per_thruster and ":" in given:
        thruster, _, given = given.partition(":")
        name = f"{thruster.strip()}_scale"
    values = []
    for part in given.split(","):
        try:
            values.append(float(part))
        except ValueError:
            raise RequestError(f"effect {text!r}: expected a number after {name}=, got {part.strip()!r}") from None
        if not math.isfinite(values[-1]):
            raise RequestError(f"effect {text!r}: expected a finite number, got {part.strip()!r}")
    wanted = len(BY_NAME[name].parameters) if name in BY_NAME else 1
    if len(values) > wanted:
        symbols = ", ".join(BY_NAME[name].symbols) if name in BY_NAME else name
        raise RequestError(f"effect {text!r}: expected at most {wanted} value(s) ({symbols}), got {len(values)}")
    return name, tuple(values)


def parse_effects(texts: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """Read several effects of the command line, see `parse_effect`.

    Raises
    ------
    RequestError
        for an effect that cannot be read, or is given twice.
    """
    result: dict[str, tuple[float, ...]] = {}
    for text in texts:
        name, values = parse_effect(text)
        if name in result:
            raise RequestError(f"--effect {text}: {name} is given twice; give each effect once, with all its values")
        result[name] = values
    return result


def effect_symbols(effect: Effect, vehicle: Vehicle) -> tuple[str, ...]:
    """Symbols of an effect in a vehicle; an effect of one thruster means the last one (starboard, by custom)."""
    return tuple(s.replace("{thruster}", vehicle.thrusters[-1].name) for s in effect.symbols)


def apply_effects(vehicle: Vehicle, effects: Mapping[str, Values]) -> Vehicle:
    """The vehicle with effects put in.

    Parameters
    ----------
    effects : by name of the catalogue, values in the order of the effect's symbols (missing ones are the effect's
        defaults, or the null values), or by symbol (`X_uu`, `stbd_scale`, `yaw:u|r|`), in the parameters' units.
        Where the catalogue counts what is missing (damping, coupling, added mass, x_g, trim) and for extra terms the
        value is added to the vehicle's own; elsewhere it replaces it.

    Raises
    ------
    RequestError
        for an unknown effect or symbol (naming the nearest), too many values, two values for a symbol whose value is
        replaced, a value outside the parameter's limits, an effect for which the vehicle file states too little, or
        when the resulting vehicle is not sound.
    """
    changes: dict[str, float] = {}
    given_by: dict[str, str] = {}
    for name, given in effects.items():
        values = tuple(float(x) for x in given) if isinstance(given, Sequence) else (float(given),)
        if name in BY_NAME:
            symbols, effect = effect_symbols(BY_NAME[name], vehicle), BY_NAME[name]
            fill = effect.default or tuple(0.0 if effect.added else p.null for p in effect.parameters)
            values = (*values, *fill[len(values) :])
        elif name in vehicle.values or ":" in name:
            symbols = (name,)
        else:
            raise RequestError(_unknown(name, (*BY_NAME, *vehicle.values)))
        if len(values) != len(symbols):
            raise RequestError(
                f"effect {name}: expected {len(symbols)} value(s) ({', '.join(symbols)}), got {len(values)}"
            )
        for symbol, value in zip(symbols, values, strict=True):
            if symbol in _ADDED or ":" in symbol:
                changes[symbol] = changes.get(symbol, vehicle.value(symbol)) + value
                continue
            if symbol in changes:
                raise RequestError(
                    f"effects: expected one value for {symbol}, got {changes[symbol]:g} from {given_by[symbol]} and "
                    f"{value:g} from {name}; give it once"
                )
            changes[symbol], given_by[symbol] = value, name
    for effect in EFFECTS:
        if changes.keys() & set(effect.symbols) and (lacks := lacking(vehicle, effect)):
            raise RequestError(f"effect {effect.name} {lacks}")
    try:
        for symbol, value in changes.items():
            _check_limits(vehicle, symbol, value)
        return vehicle.with_values(changes).checked()
    except VehicleError as error:
        raise RequestError(f"effects {', '.join(effects)}: the vehicle would not be sound: {error.typed}") from None


def _check_limits(vehicle: Vehicle, symbol: str, value: float) -> None:
    limits = vehicle.parameter(symbol)
    if limits.lower <= value <= limits.upper:
        return
    unit = "" if limits.unit == "1" else f" {limits.unit}"
    bounds = (("at least", limits.lower), ("at most", limits.upper))
    wanted = " and ".join(f"{word} {bound:g}" for word, bound in bounds if math.isfinite(bound))
    raise RequestError(
        f"{symbol} would be {value:g}{unit} (the vehicle has {vehicle.value(symbol):g}); expected {wanted}{unit}"
    )


def _unknown(name: str, known: Sequence[str]) -> str:
    begins = [k for k in known if k.startswith(name)]
    near = begins or get_close_matches(name, known, n=1, cutoff=0.0)
    return f"unknown effect {name!r}: did you mean {near[0]!r}? The catalogue has: {', '.join(sorted(BY_NAME))}"
