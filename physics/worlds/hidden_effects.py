"""Hidden effects: what a simulated world has and the nominal model lacks, asked for by name and put into a vehicle.

Hulls and sizes of effects are drawn at random, too, plausible for a vehicle and large enough to matter.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..effects import BY_NAME, EFFECTS, PARAMETERS, Parameter, effect_named, parse_form
from ..errors import RequestError, VehicleError, nearest
from ..integration import rollout, simulate_motion
from ..momentum_balance import coriolis_matrix, damping_matrix, mass_matrix, thruster_matrix
from ..motion import Array, Motion
from ..thrusters import Thruster, command_of
from ..vehicle import Hull, Vehicle, lacking
from .manoeuvres import COMMAND_STEP, programme

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
            effect, last = BY_NAME[name], vehicle.thrusters[-1].name  # starboard, by custom
            symbols = tuple(s.replace("{thruster}", last) for s in effect.symbols)
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
    near = next((k for k in known if k.startswith(name)), None) or nearest(name, known)
    return f"unknown effect {name!r}: did you mean {near!r}? The catalogue has: {', '.join(sorted(BY_NAME))}"


WIND = (-5.0, 3.3)
"""Velocity of the air over ground in which effects are sized, towards north and east [m/s]: 6 m/s, a moderate breeze
(Beaufort 4), aslant to both axes."""
_AREAL_MASS = 14.0
"""Mass over length squared of small boats [kg/m^2], see `sources.typical_mass`."""
_LENGTHS, _DRAUGHTS = (0.85, 1.15), (0.06, 0.12)
"""Length over that which belongs to the mass, and draught over length: the Otter has 0.83 and 0.1."""
_WILDEST = 3.0
"""Share by which an effect changes 10 s rollouts beyond which it makes another boat of the vehicle."""


def random_hull(vehicle: Vehicle, rng: np.random.Generator, spread: float = 1.0 / 3.0) -> Vehicle:
    """A sister of the vehicle: mass, inertia, added masses and damping each varied by up to `spread` of themselves.

    Parameters
    ----------
    vehicle : that is varied
    rng : of the draws
    spread : largest share by which a number changes

    Raises
    ------
    RequestError
        when a hundred draws give no sound vehicle; try a smaller spread.
    """
    symbols = ("mass", "inertia_z", *vehicle.added_mass, *vehicle.damping)
    for _ in range(100):
        factors = 1.0 + rng.uniform(-spread, spread, len(symbols))
        try:
            changes = {s: vehicle.value(s) * float(f) for s, f in zip(symbols, factors, strict=True)}
            return vehicle.with_values(changes).checked()
        except VehicleError:
            continue
    raise RequestError(f"random_hull: no sound vehicle within {spread:.0%} of {vehicle.name}; try a smaller spread")


def with_hull(vehicle: Vehicle, rng: np.random.Generator) -> Vehicle:
    """The vehicle with a hull of a size drawn at random, plausible for its mass, where its file states none."""
    if vehicle.hull is not None:
        return vehicle
    length = rng.uniform(*_LENGTHS) * float(np.sqrt(vehicle.mass / _AREAL_MASS))
    hull = Hull(length=round(length, 3), draught=round(rng.uniform(*_DRAUGHTS) * length, 3))
    return vehicle.model_copy(update={"hull": hull})


class _Scales:
    """What is large for a vehicle: thrust, turning moment, speeds, drags, masses; `motion` is a rich minute and a half.

    `speed` is (top surge speed, 95 % sway speed, 95 % yaw rate); `drag` the modelled damping force at it, per axis.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        ends = [t.curve.thrust(command_of(t, np.array([-1.0, 1.0])), t.command) for t in vehicle.thrusters]
        self.thrusts = np.abs(ends).max(axis=1) * np.array([t.gain for t in vehicle.thrusters])
        effective = np.abs(thruster_matrix(vehicle))
        self.thrust, self.moment = float(effective[0] @ self.thrusts), float(effective[2] @ self.thrusts)
        self.motion = commanded_motion(vehicle, programme(vehicle, "rich", 90.0), COMMAND_STEP)
        speed = np.quantile(np.abs(self.motion.velocity), (1.0, 0.95, 0.95), axis=0).diagonal()
        self.speed = np.maximum(speed, 1e-3)
        self.drag = np.maximum(np.abs(np.diag(damping_matrix(vehicle, self.speed))), 1e-6) * self.speed
        self.mass = np.diag(mass_matrix(vehicle))


def _command_for_share(thruster: Thruster, share: float) -> float:
    """The normalised command ahead that gives a share of full thrust, at most 0.45 (a dead zone ends at 0.5)."""
    fraction = np.linspace(0.0, 0.45, 91)
    force = np.abs(thruster.curve.thrust(command_of(thruster, np.append(fraction, 1.0)), thruster.command))
    return float(np.interp(share * force[-1], np.maximum.accumulate(force[:-1]), fraction))


def commanded_motion(vehicle: Vehicle, commands: Array, time_step: float) -> Motion:
    """Simulate from rest, heading north, under commands (n, thrusters) on an even grid of `time_step` [s].

    A steady wind of 6 m/s blows, for vehicles that feel it.

    Parameters
    ----------
    vehicle : that is driven
    commands : (n, thrusters), each in its unit
    time_step : [s]
    """
    start = Motion.at_rest(time_step, commands, tuple(t.name for t in vehicle.thrusters), vehicle.name)
    return simulate_motion(vehicle, replace(start, air=np.tile(WIND, (commands.shape[0], 1))))


def materiality(nominal: Vehicle, changed: Vehicle, motion: Motion) -> Array:
    """Difference of two vehicles over 10 s: rms of u, v, r over rollouts from common starts, by their rms (3,).

    Twelve starts are spread over `motion`, which must last longer than 10 s.

    Parameters
    ----------
    nominal, changed : the vehicles
    motion : on whose starts and commands both run
    """
    steps = round(10.0 / motion.time_step)
    starts = np.linspace(0, motion.time.size - steps - 1, 12).astype(int)
    a, b = (rollout(v, motion, starts, steps).states[:, :, 3:] for v in (nominal, changed))
    return np.sqrt(((a - b) ** 2).mean(axis=(0, 1)) / np.maximum((a**2).mean(axis=(0, 1)), 1e-12))


def _draws(vehicle: Vehicle, s: _Scales, rng: np.random.Generator) -> dict[str, Callable[[], tuple[float, ...]]]:
    """For each effect with sizes of its own, a draw of its parameters' values as `apply_effects` takes them."""
    u, v, r = s.speed
    uniform = rng.uniform

    def sign() -> float:
        return float(rng.choice([-1.0, 1.0]))

    def drag(axis: int, power: float) -> Callable[[], tuple[float, ...]]:
        return lambda: (-uniform(0.3, 1.0) * s.drag[axis] / power,)

    def either_way(symbol: str, size: float) -> tuple[float, ...]:
        """Less of what the vehicle has, where it has enough of it, or more."""
        less = size < -0.9 * vehicle.value(symbol) and rng.random() < 0.5
        return (size if less else -size,)

    def linear(axis: int, symbol: str) -> Callable[[], tuple[float, ...]]:
        return lambda: either_way(symbol, uniform(0.25, 0.7) * s.drag[axis] / s.speed[axis])

    def added_mass(axis: int, symbol: str) -> Callable[[], tuple[float, ...]]:
        return lambda: either_way(symbol, uniform(0.2, 0.6) * s.mass[axis])

    def factor(weaker: tuple[float, float], stronger: tuple[float, float]) -> Callable[[], tuple[float, ...]]:
        return lambda: (uniform(*weaker) if rng.random() < 0.5 else uniform(*stronger),)

    def turned(low: float, high: float) -> tuple[float, ...]:
        size, angle = uniform(low, high), uniform(-np.pi, np.pi)
        return size * np.cos(angle), size * np.sin(angle)

    def bend() -> tuple[float, ...]:
        """A curve that rises too steeply at first and too flatly at the end of a side, or the other way round."""
        first, last = uniform(0.35, 0.7, (2, 2)) * sign() * np.array([1.0, -1.0])[:, None]
        middle = uniform(-0.2, 0.2, 2)
        return tuple(float(1.0 + x) for x in (last[0], middle[0], first[0], first[1], middle[1], last[1]))

    def sail() -> tuple[float, ...]:
        """A side that catches more wind than the bow, and a centre of pressure ahead of or behind the origin."""
        wind = np.hypot(*WIND) ** 2
        bow = uniform(0.08, 0.2) * s.thrust / wind
        return bow, uniform(1.0, 2.0) * bow, sign() * uniform(0.05, 0.15) * s.moment / wind

    cross = np.sqrt(s.drag[1] / v * s.drag[2] / r)

    def coupling() -> tuple[float, float]:
        """Both couplings, what they have in common held below the geometric mean of the linear dampings.

        The symmetric part of D at rest, which is all there is of it at low speed, then stays definite.
        """
        drawn = [sign() * uniform(0.3, 0.8) * cross for _ in range(2)]
        held = vehicle.value("Y_r") + vehicle.value("N_v")
        most = 1.8 * np.sqrt(max(vehicle.value("Y_v") * vehicle.value("N_r"), 0.0))
        excess = sum(drawn) + held - float(np.clip(sum(drawn) + held, -most, most))
        return drawn[0] - 0.5 * excess, drawn[1] - 0.5 * excess

    munk = max(float(coriolis_matrix(vehicle, np.array([1.0, 1.0, 0.0]))[2, :2].sum()), 0.2 * s.mass[1])
    return {
        "surge_linear_damping": linear(0, "X_u"),
        "surge_quadratic_damping": drag(0, u * u),
        "sway_linear_damping": linear(1, "Y_v"),
        "sway_quadratic_damping": drag(1, v * v),
        "yaw_linear_damping": linear(2, "N_r"),
        "yaw_quadratic_damping": drag(2, r * r),
        "yaw_speed_damping": drag(2, u * r),
        "sway_yaw_coupling": coupling,
        "munk_moment": lambda: (sign() * uniform(0.3, 0.8) * munk,),
        "sway_lift": lambda: (sign() * uniform(0.3, 0.8) * s.mass[0],),
        "surge_turn_drag": lambda: (sign() * uniform(0.4, 1.0) * s.mass[1],),
        "surge_added_mass": added_mass(0, "X_udot"),
        "sway_added_mass": added_mass(1, "Y_vdot"),
        "yaw_added_mass": added_mass(2, "N_rdot"),
        "lateral_cg": lambda: (sign() * uniform(0.03, 0.08),),
        "mass_offset": lambda: (sign() * uniform(0.1, 0.3) * vehicle.mass,),
        "cg_offset": lambda: (sign() * uniform(0.05, 0.15),),
        "thrust_scale": factor((0.6, 0.85), (1.15, 1.4)),
        "thruster_arm": factor((0.6, 0.85), (1.15, 1.4)),
        "battery_sag": lambda: (-uniform(0.04, 0.1),),
        "thruster_asymmetry": lambda: (uniform(0.6, 0.9),),
        "reverse_thrust_loss": lambda: (uniform(0.4, 0.8),),
        "thrust_dead_zone": lambda: (_command_for_share(vehicle.thrusters[0], uniform(0.06, 0.2)),),
        "thruster_lag": lambda: (uniform(0.2, 0.8),),
        "input_delay": lambda: (uniform(0.2, 0.6),),
        "advance_loss": lambda: (uniform(0.1, 0.3) * float(s.thrusts.max()) / u,),
        "thrust_exponent": factor((0.55, 0.8), (1.3, 1.8)),
        "thrust_curve": bend,
        "cross_flow_drag": lambda: (uniform(0.5, 1.2),),
        "steady_current": lambda: turned(0.15, 0.4),
        "turning_current": lambda: turned(0.03, 0.08),
        "hull_fouling": lambda: (uniform(0.06, 0.2),),
        "mean_wind": lambda: turned(0.1 * s.thrust, 0.25 * s.thrust),
        "apparent_wind": sail,
        "wake_memory": lambda: (*(uniform(0.25, 0.45) * s.drag[k] / s.speed[k] for k in (1, 2)), uniform(0.8, 3.0)),
        "yaw_trim": lambda: (sign() * uniform(0.05, 0.15) * s.moment,),
        "surge_trim": lambda: (sign() * uniform(0.05, 0.15) * s.thrust,),
        "sway_trim": lambda: (sign() * uniform(0.05, 0.15) * s.thrust,),
    }


def _default_size(p: Parameter, added: bool, vehicle: Vehicle, s: _Scales, rng: np.random.Generator) -> float:
    """The size of a parameter of which `_draws` knows nothing, from what the catalogue says of it.

    A shape from the middle of its grid, a factor about its null value, or a share of what is large for the unit.
    """
    if p.grid:
        return float(np.quantile(p.grid, rng.uniform(0.25, 0.75)))
    if p.null != 0.0:
        size = rng.uniform(0.15, 0.4) * abs(p.null)
    elif p.axis is not None and p.form:
        size = rng.uniform(0.2, 0.7) * s.drag[p.axis] / float(parse_form(p.form)(*np.abs(s.speed)))
    else:
        size = 10.0 ** rng.uniform(-1.5, -0.6) * _large(p.unit, s)
    start = vehicle.value(p.symbol) if added and "{" not in p.symbol else p.null
    # At least a tenth of what the vehicle has stays: a hull without any drag is no hull.
    signs = [
        sign
        for sign in (-1.0, 1.0)
        if p.lower <= start + sign * size <= p.upper and not (sign * start < 0.0 and size > 0.9 * abs(start))
    ] or [-1.0, 1.0]
    total = float(np.clip(start + rng.choice(signs) * size, p.lower, p.upper))
    return total - start if added else total


def _large(unit: str, s: _Scales) -> float:
    """What is large for a vehicle in an SI unit: thrust, moment, mass, inertia, and the radius and time of turns."""
    leading = {"N m": s.moment, "N": s.thrust, "kg m^2": float(s.mass[2]), "kg": float(s.mass[0])}
    base = {"m": float(s.speed[0] / s.speed[2]), "s": 1.0 / float(s.speed[2])}
    above, _, below = unit.partition("/")
    large = 1.0
    for start, size in leading.items():
        if f"{above} ".startswith(f"{start} "):
            large, above = size, above.removeprefix(start)
            break
    for part, sign in ((above, 1), (below.strip("()"), -1)):
        for factor in part.split():
            name, _, power = factor.partition("^")
            large *= base.get(name, 1.0) ** (sign * int(power or 1))
    return large


def typical_effect(
    effect_name: str, vehicle: Vehicle, rng: np.random.Generator, floor: float = 0.03
) -> dict[str, float]:
    """A material but plausible random size of an effect for a vehicle, by symbol, as `apply_effects` takes it.

    Sizes are shares of what the vehicle itself has: its drag at top speed, its greatest thrust and moment, its masses.
    An effect without a line in `_draws` gets sizes from the units, axes, forms and limits of its parameters.
    A draw that hardly changes the motion (see `materiality`) or overturns it, or that no sound vehicle can bear, is
    drawn again.

    Parameters
    ----------
    floor : least share by which 10 s rollouts must change on some axis

    Raises
    ------
    RequestError
        for an unknown effect, one for which the vehicle file states too little (see `with_hull`), or when none of
        thirty draws changes the motion by a plausible amount.
    """
    effect = effect_named(effect_name)
    if lacks := lacking(vehicle, effect):
        raise RequestError(f"{effect_name} {lacks}")
    scales = _Scales(vehicle)

    def by_default() -> tuple[float, ...]:
        return tuple(_default_size(p, effect.added, vehicle, scales, rng) for p in effect.parameters)

    draw = _draws(vehicle, scales, rng).get(effect_name, by_default)
    least = 0.5 * scales.thrusts.max()
    strong = [t.name for t, force in zip(vehicle.thrusters, scales.thrusts, strict=True) if force >= least]
    largest = 0.0
    for _ in range(30):
        symbols = tuple(s.replace("{thruster}", str(rng.choice(strong))) for s in effect.symbols)
        values = {symbol: float(value) for symbol, value in zip(symbols, draw(), strict=True)}
        try:
            share = materiality(vehicle, apply_effects(vehicle, values), scales.motion)
        except RequestError:
            continue
        if floor <= share.max() <= max(_WILDEST, floor):
            return values
        largest = max(largest, float(share.max())) if share.max() < floor else largest
    raise RequestError(
        f"{effect_name}: no draw changes {vehicle.name}'s motion by {floor:.0%} (most: {largest:.1%}); lower the floor"
    )
