"""Logs of sensors that err: a random hull with nothing or one effect hidden, and one error of a sensor at a time."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from undertow.physics.errors import RequestError
from undertow.physics.motion import body_to_earth, earth_to_body, wrap_angle
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull, typical_effect
from undertow.physics.worlds.world import ODOMETRY_FIELDS, simulate_world

from .verb import Logged
from .worlds import label, with_each

SEEDS = {"tuning": (9_100, 18, 60), "reporting": (9_600, 18, 60)}
"""First seed, how many have every error, and how many more have right sensors; those from 9,222 on were reported once,
and those from 9,300 on asked with right sensors."""
HIDDEN = (None, "surge_quadratic_damping", "sway_lift", "thruster_asymmetry", None, "cg_offset")
RIGHT = (
    *(
        None,
        "surge_quadratic_damping",
        "cg_offset",
        "sway_yaw_coupling",
        "yaw_added_mass",
        "munk_moment",
        "wake_memory",
    ),
    *("steady_current", "sway_lift", "thruster_asymmetry", "yaw_trim", "thrust_curve", "mean_wind", "lateral_cg"),
)
PROGRAMMES, NOISES = ("rich", "zigzag", "gentle"), ("field", "clean", "rough")
SECONDS, RATE = 240.0, 20.0
Spoil = Callable[[pd.DataFrame], None]


def _late(seconds: float, *names: str) -> Spoil:
    def spoil(table: pd.DataFrame) -> None:
        rows = round(seconds * RATE)
        for name in names:
            values = table[name].to_numpy()
            table[name] = np.concatenate([np.repeat(values[:1], rows), values[:-rows]])

    return spoil


def _times(factor: float, *names: str) -> Spoil:
    def spoil(table: pd.DataFrame) -> None:
        for name in names:
            table[name] *= factor

    return spoil


def _bias(table: pd.DataFrame) -> None:
    table["r"] += 0.02


def _compass(constant: float, sine: float) -> Spoil:
    def spoil(table: pd.DataFrame) -> None:
        off = np.radians(constant + sine * np.sin(table["psi"] - 0.7))
        table["u"], table["v"] = earth_to_body(off, table["u"].to_numpy(), table["v"].to_numpy())
        table["psi"] += off

    return spoil


def _arm(ahead: float, aside: float) -> Spoil:
    def spoil(table: pd.DataFrame) -> None:
        table["u"] -= aside * table["r"]
        table["v"] += ahead * table["r"]
        one = np.ones(len(table))
        north, east = body_to_earth(table["psi"].to_numpy(), ahead * one, aside * one)
        table["x"] += north
        table["y"] += east

    return spoil


def _water(table: pd.DataFrame) -> None:
    one = np.ones(len(table))
    ahead, aside = earth_to_body(table["psi"].to_numpy(), 0.2 * one, -0.1 * one)
    table["u"] -= ahead
    table["v"] -= aside


ANY = "right sensors, any effect"
SPOILS: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "right sensors": (lambda table: None, ()),
    "gyro 5 % low": (_times(0.95, "r"), ("gyro_scale",)),
    "gyro off by 0.02 rad/s": (_bias, ("gyro_bias",)),
    "speeds 7 % low": (_times(0.93, "u", "v"), ("velocity_scale",)),
    "speeds 0.2 s late": (_late(0.2, "u", "v"), ("velocity_latency", "position_latency")),
    "places and speeds 0.3 s late": (_late(0.3, "x", "y", "u", "v"), ("velocity_latency",)),
    "speeds through moving water": (_water, ("water_speed",)),
    "compass turned by 6 degrees": (_compass(6.0, 0.0), ("compass_deviation",)),
    "compass off by 8 sin(psi) degrees": (_compass(0.0, 8.0), ("compass_deviation",)),
    "antenna 0.6 m ahead": (_arm(0.6, 0.0), ("antenna_arm",)),
    "antenna 0.5 m to starboard": (_arm(0.0, 0.5), ("antenna_arm",)),
    ANY: (lambda table: None, ()),
}
"""What is done to the table, and the finding that tells of it."""


def keys(purpose: str) -> list[tuple[str, int]]:
    """Errors and seeds."""
    first, spoilt, right = SEEDS[purpose]
    every = [(name, first + n) for n in range(spoilt) for name in SPOILS if name != ANY]
    return every + [(ANY, first + 200 + n) for n in range(right)]


def logged(kind: str, seed: int) -> Logged:
    """A log of a sensor that errs, or of right ones."""
    rng = np.random.default_rng([seed, 21 if kind == ANY else 9])
    hidden = RIGHT[seed % len(RIGHT)] if kind == ANY else HIDDEN[seed % len(HIDDEN)]
    programme, noise = PROGRAMMES[seed // 2 % len(PROGRAMMES)], NOISES[seed // len(HIDDEN) % len(NOISES)]
    for _ in range(50):
        hull = random_hull(load_vehicle("blueboat"), rng)
        try:
            effects = {} if hidden is None else typical_effect(hidden, hull, rng)
            world = simulate_world(hull, effects, programme=programme, duration=SECONDS, noise=noise, seed=seed)
            break
        except RequestError:  # no draw of the effect changes the motion of this hull: another
            continue
    else:
        raise RequestError(f"seed {seed}: no hull on which {hidden} matters in fifty draws")
    name = label(hidden, list(effects)) if hidden else ""
    spoil, told = SPOILS[kind]

    def write(path: Path) -> Path:
        table = pd.DataFrame(world.odometry, columns=list(ODOMETRY_FIELDS))
        table.insert(0, "t", world.odometry_time)
        held = np.searchsorted(world.command_time, world.odometry_time + 1e-9, "right") - 1
        for unit, column in zip(hull.thrusters, world.commands.T, strict=True):
            table[unit.channel] = column[held.clip(0)]
        spoil(table)
        table["psi"] = wrap_angle(table["psi"].to_numpy())
        table.round(9).to_csv(path, index=False)
        return path

    return Logged(
        "sensors",
        kind,
        seed,
        hull,
        write,
        note=f"{hidden or 'nothing hidden'}, {programme}, {noise}",
        true=frozenset([name] if name else []),
        # The water moves: the current is an equivalent of a speed log that tells of it.
        part=frozenset(["steady_current"] if "water_speed" in told else []),
        sensors=frozenset(told),
        known=effects,
        dominant=name if name and with_each(hull, {name: effects}) else "",
    )
