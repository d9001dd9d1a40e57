"""Effects of the catalogue as a foreign world has them: sizes of its own, and their values as findings tell them."""

from collections.abc import Callable

import numpy as np

from .foreign_world import World, delayed, with_lag

Draw = Callable[[World, tuple[float, float, float]], None]
"""Hides an effect in a world, where one row in twenty exceeds these speeds."""


def moved(world: World, effect: str, symbol: str, change: float) -> None:
    """Change a parameter of the hull, which is what an effect is."""
    world.values[symbol] = world.values.get(symbol, 0.0) + change
    world.true.add(effect)
    world.known[symbol] = change


def _sign(world: World) -> float:
    return float(world.rng.choice([-1.0, 1.0]))


def _drag(world: World, axis: int, speed: float) -> float:
    first, second = (("X_u", "X_uu"), ("Y_v", "Y_vv"), ("N_r", "N_rr"))[axis]
    p = world.file.values
    return -(p[first] + p[second] * speed) * speed


def _quadratic(effect: str, axis: int, symbol: str) -> Draw:
    def draw(world: World, typical: tuple[float, float, float]) -> None:
        speed = typical[axis]
        moved(world, effect, symbol, -world.rng.uniform(0.4, 1.0) * _drag(world, axis, speed) / speed**2)

    return draw


def _linear(effect: str, axis: int, symbol: str) -> Draw:
    def draw(world: World, typical: tuple[float, float, float]) -> None:
        speed = typical[axis]
        moved(world, effect, symbol, -world.rng.uniform(0.3, 0.7) * _drag(world, axis, speed) / speed)

    return draw


def _share_of_mass(effect: str, symbol: str, low: float, high: float, *, signed: bool) -> Draw:
    def draw(world: World, typical: tuple[float, float, float]) -> None:
        p = world.file.values
        whole = p["inertia_z"] if symbol == "N_rdot" else p["mass"]
        sign = _sign(world) if signed else -1.0
        moved(world, effect, symbol, sign * world.rng.uniform(low, high) * whole)

    return draw


def thrusts(world: World) -> float:
    """Force of all thrusters at full command ahead [N]."""
    return float(sum(max(getattr(t.curve, "force", (0.0,))) for t in world.file.thrusters))


def moments(world: World) -> float:
    """Moment of all thrusters at full command [N m]."""
    return float(sum(abs(t.y) * max(getattr(t.curve, "force", (0.0,))) for t in world.file.thrusters))


def _cg(world: World, typical: tuple[float, float, float]) -> None:
    length = np.sqrt(world.file.values["inertia_z"] / world.file.values["mass"])
    moved(world, "cg_offset", "x_g", _sign(world) * world.rng.uniform(0.12, 0.3) * length)


def _asymmetry(world: World, typical: tuple[float, float, float]) -> None:
    which, scale = int(world.rng.integers(len(world.file.thrusters))), float(world.rng.uniform(0.6, 0.88))
    factors = np.where(np.arange(len(world.file.thrusters)) == which, scale, 1.0)
    world.pushes.append(lambda force, time, share: force * factors)
    world.true.add("thruster_asymmetry")
    world.known[f"{world.file.thrusters[which].name}_scale"] = scale


def _scale(world: World, typical: tuple[float, float, float]) -> None:
    scale = float(world.rng.choice([world.rng.uniform(0.65, 0.87), world.rng.uniform(1.15, 1.35)]))
    world.pushes.append(lambda force, time, share: force * scale)
    world.true.add("thrust_scale")
    world.known["thrust_scale"] = scale


def _trim(world: World, typical: tuple[float, float, float]) -> None:
    moved(world, "yaw_trim", "yaw_trim", _sign(world) * world.rng.uniform(0.05, 0.15) * moments(world))


def _wind(world: World, typical: tuple[float, float, float]) -> None:
    size, angle = world.rng.uniform(0.08, 0.2) * thrusts(world), world.rng.uniform(-np.pi, np.pi)
    moved(world, "mean_wind", "wind_force_north", size * np.cos(angle))
    moved(world, "mean_wind", "wind_force_east", size * np.sin(angle))


def _current(world: World, typical: tuple[float, float, float]) -> None:
    size, angle = world.rng.uniform(0.15, 0.35), world.rng.uniform(-np.pi, np.pi)
    north, east = float(size * np.cos(angle)), float(size * np.sin(angle))
    world.current = lambda t: (north, east, 0.0, 0.0)
    world.true.add("steady_current")
    world.known |= {"current_north": north, "current_east": east}


def _lag(world: World, typical: tuple[float, float, float]) -> None:
    lag = float(world.rng.uniform(0.25, 0.8))
    world.actuators.append(with_lag(lag, world.step))
    world.true.add("thruster_lag")
    world.known["lag"] = lag


def _delay(world: World, typical: tuple[float, float, float]) -> None:
    delay = round(float(world.rng.uniform(0.2, 0.6)) / world.step) * world.step
    world.actuators.append(delayed(delay, world.step))
    world.true.add("input_delay")
    world.known["delay"] = delay


EFFECTS: dict[str, Draw] = {
    "surge_linear_damping": _linear("surge_linear_damping", 0, "X_u"),
    "surge_quadratic_damping": _quadratic("surge_quadratic_damping", 0, "X_uu"),
    "sway_quadratic_damping": _quadratic("sway_quadratic_damping", 1, "Y_vv"),
    "yaw_linear_damping": _linear("yaw_linear_damping", 2, "N_r"),
    "yaw_quadratic_damping": _quadratic("yaw_quadratic_damping", 2, "N_rr"),
    "munk_moment": _share_of_mass("munk_moment", "N_uv", 0.2, 0.5, signed=True),
    "sway_lift": _share_of_mass("sway_lift", "Y_ur", 0.3, 0.8, signed=True),
    "surge_added_mass": _share_of_mass("surge_added_mass", "X_udot", 0.2, 0.5, signed=False),
    "sway_added_mass": _share_of_mass("sway_added_mass", "Y_vdot", 0.3, 0.8, signed=False),
    "yaw_added_mass": _share_of_mass("yaw_added_mass", "N_rdot", 0.3, 0.7, signed=False),
    "cg_offset": _cg,
    "thruster_asymmetry": _asymmetry,
    "thrust_scale": _scale,
    "yaw_trim": _trim,
    "mean_wind": _wind,
    "steady_current": _current,
    "thruster_lag": _lag,
    "input_delay": _delay,
}
SLOW = tuple(name for name in EFFECTS if name not in ("thruster_lag", "input_delay"))
"""Those that a ship may have: engines of ships take longer than the catalogue knows."""


def hide(world: World, names: tuple[str, ...] = tuple(EFFECTS)) -> None:
    """Hide one effect of the catalogue, or nothing in every second world."""
    if world.rng.random() < 0.5:
        world.note = "nothing hidden"
        return
    name = str(world.rng.choice(names))
    u, v, r = world.typical().tolist()
    EFFECTS[name](world, (u, v, r))
    world.note = name
