"""What foreign boats are and what they are told to do: vehicle files drawn at random, ships by scale, programmes."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from undertow.physics.thrusters import Thruster, command_of
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import random_hull

Array = NDArray[np.float64]
SLOT = 0.1
"""Time for which an order is held [s], as autopilots at 10 Hz do."""
_PULSES = (1100.0, 1200.0, 1300.0, 1400.0, 1475.0, 1525.0, 1600.0, 1700.0, 1800.0, 1900.0)
_NEWTONS = (-29.0, -22.0, -14.5, -6.5, 0.0, 0.0, 6.5, 16.5, 27.0, 36.0)
"""Pulses [us] and forces [N] in the shape of a small thruster's data sheet: weaker astern, dead about neutral."""
Part = Callable[[np.random.Generator], list[tuple[float, float, float]]]
"""Draws a manoeuvre: how long [s], common and differential order, each from -1 to 1."""


def boat(rng: np.random.Generator, command: str | None = None) -> Vehicle:
    """A vehicle file: a small or larger catamaran, steered by newtons, pulses or shaft speeds, hull drawn at random."""
    command = command or str(rng.choice(("newton", "pwm", "rad_s")))
    if command == "rad_s":
        return random_hull(load_vehicle("otter"), rng)
    hull = random_hull(load_vehicle("blueboat"), rng)
    if command == "newton":
        return hull
    data = hull.to_dict()
    curve = {"kind": "table", "command": list(_PULSES), "force": list(_NEWTONS)}
    units = [
        {**t.model_dump(include={"name", "x", "y", "angle"}), "command": "pwm", "curve": curve} for t in hull.thrusters
    ]
    return vehicle_from_dict({**data, "thrusters": units}, "a boat steered by pulses")


def ship(rng: np.random.Generator) -> Vehicle:
    """A vessel of 10 to 40 m with two screws that turn it: takes 30 to 200 s to gather way.

    Ratios are those of displacement hulls (Fossen 2021, section 6.5; Clarke, Gedling and Hine 1983): length over beam
    4, beam over draught 3, block coefficient 0.6. The moment of drift is a tenth of that in an ideal fluid, as viscous
    lift of the stern takes the rest, and damping in yaw holds the course.
    """
    length = rng.uniform(10.0, 40.0)
    mass = 1025.0 * 0.6 * length**3 / 48.0
    inertia = mass * (0.25 * length) ** 2
    m11, m22, m33 = 1.06 * mass, rng.uniform(1.6, 1.9) * mass, rng.uniform(1.4, 1.7) * inertia
    top, way = 0.25 * np.sqrt(9.81 * length), rng.uniform(30.0, 200.0)
    sway, slow = rng.uniform(0.06, 0.12) * way, rng.uniform(0.05, 0.1) * way
    Y_v, munk = m22 / sway, 0.1 * (m22 - m11)
    N_r = max(m33 / slow, 1.5 * munk * m11 * top**2 / Y_v)
    full = m11 * top / way
    values = {
        "name": "ship",
        "mass": mass,
        "inertia_z": inertia,
        "x_g": rng.uniform(-0.02, 0.02) * length,
        "added_mass": {"X_udot": mass - m11, "Y_vdot": mass - m22, "N_rdot": inertia - m33},
        "damping": {"X_u": -0.4 * m11 / way, "X_uu": -0.6 * m11 / way / top, "Y_v": -Y_v, "N_r": -N_r},
        "coupling": {"N_uv": 0.9 * (m22 - m11)},
        "thrusters": [
            {
                "name": name,
                "x": -0.45 * length,
                "y": side * 0.1 * length,
                "command": "normalized",
                "curve": {"kind": "table", "command": [-1.0, 0.0, 1.0], "force": [-0.7 * full, 0.0, full]},
            }
            for name, side in (("port", -1.0), ("stbd", 1.0))
        ],
    }
    return vehicle_from_dict(values, "a ship")


def way_of(vehicle: Vehicle) -> float:
    """About how long a vessel takes to gather way [s]."""
    p = vehicle.values
    return float((p["mass"] - p["X_udot"]) / max(-p["X_u"] - p["X_uu"], 1e-9))


def _zigzag(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    common, turn, period = rng.uniform(0.4, 0.9), rng.uniform(0.12, 0.4), rng.uniform(2.5, 5.0)
    return [(3.0, common, 0.0), *((period, common, turn * (-1.0) ** k) for k in range(5))]


def _coast(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    return [(rng.uniform(6.0, 10.0), rng.uniform(0.4, 1.0), 0.0), (rng.uniform(5.0, 9.0), 0.0, 0.0)]


def _astern(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    return [(5.0, -rng.uniform(0.3, 1.0), rng.uniform(-0.3, 0.3)), (4.0, -rng.uniform(0.2, 0.6), 0.0)]


def _circles(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    common, turn = rng.uniform(0.3, 0.8), rng.uniform(0.15, 0.35)
    return [(rng.uniform(8.0, 12.0), common, turn), (rng.uniform(8.0, 12.0), common, -turn)]


def _spins(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    turn = rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 0.9)
    return [(5.0, 0.0, turn), (5.0, 0.0, -0.6 * turn), (3.0, 0.0, 0.0)]


def _steps(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    return [(rng.uniform(1.0, 4.0), rng.uniform(-0.5, 1.0), rng.uniform(-0.5, 0.5)) for _ in range(8)]


def _legs(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    return [(rng.uniform(4.0, 8.0), rng.uniform(0.25, 0.6), rng.uniform(-0.12, 0.12)) for _ in range(4)]


def _straight(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    return [(rng.uniform(4.0, 9.0), rng.uniform(-0.8, 1.0), 0.0), (rng.uniform(2.0, 5.0), 0.0, 0.0)]


PROGRAMMES: dict[str, Sequence[Part]] = {
    "rich": (_zigzag, _coast, _astern, _circles, _spins, _steps),
    "zigzag": (_zigzag,),
    "gentle": (_legs,),
    "straight": (_straight,),
}
DRAWN = ("rich", "zigzag", "gentle")


def ordered(name: str, seconds: float, rng: np.random.Generator, stretch: float = 1.0) -> Array:
    """Common and differential orders (m, 2) for slots of 0.1 s; manoeuvres last `stretch` times as long."""
    slots = round(seconds / SLOT) + 1
    rows: list[Array] = [np.zeros((10, 2))]
    parts, length = PROGRAMMES[name], 10
    while length < slots:
        for k in rng.permutation(len(parts)):
            for time, common, turn in parts[k](rng):
                rows.append(np.tile([common, turn], (max(round(time * stretch / SLOT), 1), 1)))
                length += len(rows[-1])
    return np.concatenate(rows)[:slots]


def shares(vehicle: Vehicle, orders: Array) -> Array:
    """Share of full command of each thruster (m, thrusters): port has the sum of orders, starboard the difference."""
    sides = [0.0 if abs(t.y) < 1e-9 else float(np.sign(t.y)) for t in vehicle.thrusters]
    return np.clip(np.column_stack([orders[:, 0] - side * orders[:, 1] for side in sides]), -1.0, 1.0)


def commands(vehicle: Vehicle, share: Array) -> Array:
    """Shares of full command in the unit of each thruster (m, thrusters)."""
    pairs = zip(vehicle.thrusters, share.T, strict=True)
    return np.column_stack([command_of(unit, column) for unit, column in pairs])


def thrust(unit: Thruster, command: Array) -> Array:
    """Force [N] of a thruster whose curve is a table: straight lines between its points."""
    curve = unit.curve
    if curve.kind != "table":
        raise ValueError(f"thruster {unit.name}: expected a table, got {curve.kind}")
    return np.interp(command, curve.command, curve.force)
