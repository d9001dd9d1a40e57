"""Effects of the catalogue in other people's simulators: how large they are, and their values as findings tell them."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .craft import Craft, Plant
from .pilots import pilot_of

Change = Callable[[Plant], None]


@dataclass(frozen=True, slots=True)
class Hidden:
    """One hidden cause: its key, what it does to a plant, its true values by symbol, and whether it has a name."""

    key: str
    change: Change
    known: dict[str, float] = field(default_factory=dict)
    named: bool = True
    part: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Sizes:
    """What is large for a craft: speeds that one row in ten exceeds [m/s, rad/s], and drag at these [N, N m]."""

    speed: tuple[float, float, float]
    drag: tuple[float, float, float]
    thrust: float
    moment: float


def sizes_of(craft: Craft, seed: int) -> Sizes:
    """Sizes from a rich programme with nothing hidden, 80 s for a small boat."""
    rng = np.random.default_rng([seed, 11])
    seconds = 80.0 * craft.pace
    course = Plant(craft).run(pilot_of("rich", craft, seconds, (0.0,) * 4, rng), seconds, 0.1, 0.0)
    u, v, r = (max(float(x), 1e-4) for x in np.quantile(np.abs(course.planar[:, 3:]), 0.9, axis=0))
    p = craft.file.values
    X, Y, N = (
        -(p[first] + p[second] * speed) * speed
        for first, second, speed in (("X_u", "X_uu", u), ("Y_v", "Y_vv", v), ("N_r", "N_rr", r))
    )
    pairs = list(zip(craft.full, craft.levers, strict=True))
    thrust = sum(full * abs(ahead) for full, (ahead, _, _) in pairs)
    moment = sum(full * abs(turn) for full, (_, _, turn) in pairs)
    return Sizes((u, v, r), (X, Y, N), thrust, moment)


def _either(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def _derived(key: str, **values: float) -> Hidden:
    def change(plant: Plant) -> None:
        for symbol, value in values.items():
            plant.derivatives[symbol] = plant.derivatives.get(symbol, 0.0) + value

    return Hidden(key, change, dict(values))


def _numbered(key: str, symbol: str, value: float) -> Hidden:
    def change(plant: Plant) -> None:
        plant.numbers[symbol] += value
        if symbol == "Y_rdot" and "N_vdot" in plant.numbers:
            plant.numbers["N_vdot"] += value

    return Hidden(key, change, {symbol: value})


def _set(key: str, symbol: str, value: float) -> Hidden:
    """A fault that has its absolute value."""
    return Hidden(key, lambda plant: setattr(plant, symbol, value), {symbol: value})


def _drag(craft: Craft, s: Sizes, rng: np.random.Generator, name: str) -> Hidden:
    """Drag by a share of what the file has at speeds that are large, as far as a hull of this length can have it.

    Bounds: a section of the depth of a barge (0.06 L) with a drag coefficient of 2.4 across and 0.3 along, and forces
    of turning drift that the mass of hull and water can make.
    """
    (u, v, r), (X, Y, N) = s.speed, s.drag
    one, two = float(rng.uniform(0.3, 0.7)), float(rng.uniform(0.4, 1.0))
    side, other = _either(rng, 0.3, 0.6), _either(rng, 0.15, 0.35)
    p, across = craft.file.values, 0.5 * 1025.0 * 2.4 * 0.06 * craft.length**2
    along, about = max(across / 8.0, -p["X_uu"]), max(across * craft.length**3 / 32.0, -p["N_rr"])
    mass = p["mass"] - p["Y_vdot"]

    def bounded(value: float, most: float) -> float:
        return min(max(value, -most), most)

    made = {
        "surge_linear_damping": {"X_u": -one * X / u},
        "surge_quadratic_damping": {"X_uu": -min(two * X / u**2, along)},
        "sway_linear_damping": {"Y_v": -one * Y / v},
        "sway_quadratic_damping": {"Y_vv": -min(two * Y / v**2, max(across, -p["Y_vv"]))},
        "yaw_linear_damping": {"N_r": -one * N / r},
        "yaw_quadratic_damping": {"N_rr": -min(two * N / r**2, about)},
        "yaw_speed_damping": {"N_ur": -two * N / (u * r)},
        "sway_yaw_coupling": {"Y_r": side * Y / r, "N_v": bounded(other * N / v, mass * u)},
        "munk_moment": {"N_uv": bounded(side * N / (u * v), mass)},
        "sway_lift": {"Y_ur": bounded(side * Y / (u * r), mass)},
        "surge_turn_drag": {"X_vr": bounded(side * X / (v * r), mass)},
    }
    return _derived(name, **made[name])


def _mass(craft: Craft, rng: np.random.Generator, name: str) -> Hidden:
    m, inertia = craft.numbers["mass"], craft.numbers["inertia_z"]
    made = {
        "surge_added_mass": ("X_udot", -float(rng.uniform(0.2, 0.5)) * m),
        "sway_added_mass": ("Y_vdot", -float(rng.uniform(0.3, 0.8)) * m),
        "yaw_added_mass": ("N_rdot", -float(rng.uniform(0.3, 0.8)) * inertia),
        "mass_offset": ("mass", _either(rng, 0.15, 0.3) * m),
        "cg_offset": ("x_g", _either(rng, 0.03, 0.08) * min(craft.length, _FARTHEST / 0.08)),
        "lateral_cg": ("y_g", _either(rng, 0.015, 0.04) * craft.length),
    }
    symbol, value = made[name]
    return _numbered(name, symbol, value)


def _weak(craft: Craft, rng: np.random.Generator) -> Hidden:
    k, scale = int(rng.integers(len(craft.laws))), float(rng.uniform(0.6, 0.88))
    unit = craft.file.thrusters[k].name

    def change(plant: Plant) -> None:
        plant.scales[k] *= scale

    return Hidden(f"thruster_asymmetry[{unit}]", change, {f"{unit}_scale": scale})


def _scaled(rng: np.random.Generator) -> Hidden:
    scale = float(rng.choice([rng.uniform(0.65, 0.87), rng.uniform(1.15, 1.35)]))

    def change(plant: Plant) -> None:
        plant.scales = [scale * x for x in plant.scales]

    return Hidden("thrust_scale", change, {"thrust_scale": scale})


def _engine(craft: Craft, s: Sizes, rng: np.random.Generator, name: str) -> Hidden:
    """A fault of all thrusters."""
    if name == "thrust_scale":
        return _scaled(rng)
    slow = min(craft.pace, 3.0)
    loss = float(rng.uniform(0.15, 0.4)) * max(craft.full) / max(s.speed[0], 1e-3)
    made = {
        "thruster_arm": ("arm_scale", 1.0 + _either(rng, 0.1, 0.25)),
        "battery_sag": ("thrust_rate", -float(rng.uniform(0.02, 0.06))),
        "reverse_thrust_loss": ("reverse_scale", float(rng.uniform(0.5, 0.8))),
        "thrust_dead_zone": ("dead_zone", float(rng.uniform(0.08, 0.25))),
        "thruster_lag": ("lag", float(rng.uniform(0.3, 0.9)) * slow),
        "input_delay": ("delay", round(float(rng.uniform(0.2, 0.6)) * slow / craft.step) * craft.step),
        "advance_loss": ("advance_loss", loss),
        "thrust_exponent": ("thrust_exponent", float(rng.choice([rng.uniform(0.6, 0.8), rng.uniform(1.3, 1.7)]))),
    }
    symbol, value = made[name]
    return _set(name, symbol, value)


def _fixed(craft: Craft, s: Sizes, rng: np.random.Generator, name: str) -> Hidden:
    """A load that keeps its direction in the hull or over ground."""
    if name == "mean_wind":
        size, angle = float(rng.uniform(0.08, 0.2)) * s.thrust, float(rng.uniform(-np.pi, np.pi))
        north, east = size * float(np.cos(angle)), size * float(np.sin(angle))
        known = {"wind_force_north": north, "wind_force_east": east}
        return Hidden(name, lambda plant: setattr(plant, "wind", (north, east)), known)
    axis, size = {"surge_trim": (0, s.thrust), "sway_trim": (1, s.thrust), "yaw_trim": (2, s.moment)}[name]
    value = _either(rng, 0.04, 0.12) * size

    def change(plant: Plant) -> None:
        plant.trim[axis] += value

    return Hidden(name, change, {name: value})


def _current(s: Sizes, rng: np.random.Generator) -> Hidden:
    size, angle = float(rng.uniform(0.15, 0.35)) * s.speed[0], float(rng.uniform(-np.pi, np.pi))
    north, east = size * float(np.cos(angle)), size * float(np.sin(angle))
    known = {"current_north": north, "current_east": east}
    return Hidden("steady_current", lambda plant: setattr(plant, "water", lambda t, x, y: (north, east)), known)


_FARTHEST = 1.8
"""Distance of the centre of gravity [m], which vehicle files bound at two metres."""
_MASSES = ("surge_added_mass", "sway_added_mass", "yaw_added_mass", "mass_offset", "cg_offset", "lateral_cg")
_ENGINES = (
    *("thrust_scale", "thruster_arm", "battery_sag", "reverse_thrust_loss", "thrust_dead_zone", "thruster_lag"),
    *("input_delay", "advance_loss", "thrust_exponent"),
)
_CONSTANT = ("mean_wind", "surge_trim", "sway_trim", "yaw_trim")


def effect(name: str, craft: Craft, sizes: Sizes, rng: np.random.Generator) -> Hidden:
    """An effect of the catalogue of a size that is drawn."""
    if name in _MASSES:
        return _mass(craft, rng, name)
    if name in _ENGINES:
        return _engine(craft, sizes, rng, name)
    if name in _CONSTANT:
        return _fixed(craft, sizes, rng, name)
    if name == "thruster_asymmetry":
        return _weak(craft, rng)
    if name == "steady_current":
        return _current(sizes, rng)
    return _drag(craft, sizes, rng, name)


CLASHES = (
    {"thrust_scale", "thruster_asymmetry", "thruster_arm", "thrust_exponent", "battery_sag"},
    {"thruster_lag", "input_delay"},
    {"mass_offset", "surge_added_mass", "sway_added_mass"},
    {"mean_wind", "steady_current"},
)
"""Of these no two are hidden at once: each is a good part of the other, or only their sum acts."""


def effects(
    number: int, craft: Craft, sizes: Sizes, rng: np.random.Generator, first: int | None = None
) -> list[Hidden]:
    """So many effects that the simulator can make, no two of a kind; `first` says which is the first of them."""
    able = sorted(craft.exact)
    names = [str(x) for x in rng.permutation(able)]
    if first is not None:
        names = [able[first % len(able)], *names]
    taken: list[str] = []
    for name in names:
        clash = any(name in group and group & set(taken) for group in CLASHES)
        if name not in taken and not clash:
            taken.append(name)
    return [effect(name, craft, sizes, rng) for name in taken[:number]]
