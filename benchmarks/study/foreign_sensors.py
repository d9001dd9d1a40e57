"""What sensors and loggers do to the truth of a foreign world, and the log file that comes of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .foreign_boats import Current, lagged, wandering

Array = NDArray[np.float64]
Truth = dict[str, Array]
"""Columns t x y psi u v r on the simulation's grid."""
Sense = Callable[[Truth, np.random.Generator], None]
"""Changes what is true into what a sensor says, before noise."""
Spoil = Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]
"""Changes the rows of a log."""
NOISES = {
    "none": (0.0, 0.0, 0.0, 0.0),
    "field": (0.03, 0.004, 0.015, 0.006),
    "rough": (0.15, 0.012, 0.04, 0.015),
}
"""Standard deviations of place [m], heading [rad], speed [m/s] and yaw rate [rad/s]."""
CHANNELS = ("x", "y", "psi", "u", "v", "r")


@dataclass
class Record:
    """How a log is written.

    Attributes
    ----------
    rate : rows in a second
    command_rate : commands in a second
    late : time by which commands are stamped too late [s]
    quantum : step to which commands are rounded, in their unit; 0 for none
    on_change : whether only commands that differ from the last are written
    long : whether the file has a line for each value, with commands at instants of their own
    """

    rate: float = 20.0
    command_rate: float = 10.0
    late: float = 0.0
    quantum: float = 0.0
    on_change: bool = False
    long: bool = False


def rolled_flat(states: Array, time: Array) -> Truth:
    """What a boat in six degrees of freedom logs: speeds over ground turned by the heading, yaw rate of the body."""
    _, phi, theta, psi = states[:, 2:6].T
    u, v, w, _, _, r = states[:, 6:].T
    flat_u = np.cos(theta) * u + np.sin(theta) * (np.sin(phi) * v + np.cos(phi) * w)
    flat_v = np.cos(phi) * v - np.sin(phi) * w
    columns = (time, states[:, 0], states[:, 1], psi, flat_u, flat_v, r)
    return dict(zip(("t", *CHANNELS), columns, strict=True))


def times(factor: float, *names: str) -> Sense:
    def sense(truth: Truth, rng: np.random.Generator) -> None:
        for name in names:
            truth[name] = truth[name] * factor

    return sense


def off(bias: float, name: str) -> Sense:
    def sense(truth: Truth, rng: np.random.Generator) -> None:
        truth[name] = truth[name] + bias

    return sense


def drifting(size: float, memory: float) -> Sense:
    """A gyro's bias that wanders, with this standard deviation [rad/s] and memory [s]."""

    def sense(truth: Truth, rng: np.random.Generator) -> None:
        h = truth["t"][1] - truth["t"][0]
        truth["r"] = truth["r"] + size * wandering(rng, truth["t"].size, memory, h)

    return sense


def slow(lag: float, *names: str) -> Sense:
    def sense(truth: Truth, rng: np.random.Generator) -> None:
        for name in names:
            truth[name] = lagged(truth[name], lag, truth["t"][1] - truth["t"][0])

    return sense


def filtered_fix(lag: float) -> Sense:
    """A satellite receiver that smooths its velocity over ground before the heading turns it into the boat's axes."""

    def sense(truth: Truth, rng: np.random.Generator) -> None:
        co, si, h = np.cos(truth["psi"]), np.sin(truth["psi"]), truth["t"][1] - truth["t"][0]
        north = lagged(co * truth["u"] - si * truth["v"], lag, h)
        east = lagged(si * truth["u"] + co * truth["v"], lag, h)
        truth["u"], truth["v"] = co * north + si * east, co * east - si * north

    return sense


def late(seconds: float, *names: str) -> Sense:
    def sense(truth: Truth, rng: np.random.Generator) -> None:
        for name in names:
            truth[name] = np.interp(truth["t"] - seconds, truth["t"], truth[name])

    return sense


def antenna(ahead: float, aside: float) -> Sense:
    """A receiver that is not at the origin: places and speeds are its own."""

    def sense(truth: Truth, rng: np.random.Generator) -> None:
        co, si = np.cos(truth["psi"]), np.sin(truth["psi"])
        truth["x"] = truth["x"] + co * ahead - si * aside
        truth["y"] = truth["y"] + si * ahead + co * aside
        truth["u"], truth["v"] = truth["u"] - aside * truth["r"], truth["v"] + ahead * truth["r"]

    return sense


def deviation(constant: float, sine: float, cosine: float) -> Sense:
    """A compass that deviates [rad], by which velocity over ground is turned into the boat's axes."""

    def sense(truth: Truth, rng: np.random.Generator) -> None:
        psi = truth["psi"]
        wrong = constant + sine * np.sin(psi) + cosine * np.cos(psi)
        co, si = np.cos(wrong), np.sin(wrong)
        u, v = truth["u"], truth["v"]
        truth["u"], truth["v"], truth["psi"] = co * u + si * v, co * v - si * u, psi + wrong

    return sense


def through_water(current: Current) -> Sense:
    def sense(truth: Truth, rng: np.random.Generator) -> None:
        north, east = np.array([current(t)[:2] for t in truth["t"]]).T
        co, si = np.cos(truth["psi"]), np.sin(truth["psi"])
        truth["u"], truth["v"] = truth["u"] - co * north - si * east, truth["v"] - co * east + si * north

    return sense


def spikes(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """One value in a hundred of each speed and place is an outlier."""
    for name, size in (("u", 1.0), ("v", 1.0), ("r", 1.0), ("x", 5.0), ("y", 5.0)):
        hit = rng.random(len(table)) < 0.01
        table.loc[hit, name] += rng.choice([-1.0, 1.0], hit.sum()) * size * rng.uniform(0.5, 2.0, hit.sum())
    return table


def gaps(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Four stretches of 5 to 15 s are missing."""
    time, kept = table["t"].to_numpy(), np.ones(len(table), dtype=bool)
    for quarter in range(4):
        begin = time[-1] * (quarter + rng.uniform(0.1, 0.8)) / 4.0
        kept &= (time < begin) | (time > begin + rng.uniform(5.0, 15.0))
    return table[kept].reset_index(drop=True)


def sampled(truth: Truth, record: Record, noise: str, rng: np.random.Generator) -> pd.DataFrame:
    """Rows of a log with noise, headings from -pi to pi."""
    place, heading, speed, rate = NOISES[noise]
    count = int(truth["t"][-1] * record.rate + 1e-6) + 1
    time = np.arange(count) / record.rate
    table = pd.DataFrame({"t": time})
    for name, size in zip(CHANNELS, (place, place, heading, speed, speed, rate), strict=True):
        table[name] = np.interp(time, truth["t"], truth[name]) + size * rng.standard_normal(count)
    table["psi"] = (table["psi"] + np.pi) % (2.0 * np.pi) - np.pi
    return table


def recorded(asked: Array, grid: float, record: Record) -> tuple[Array, Array]:
    """Stamps [s] and commands on record, of commands (n, thrusters) that are held on an even grid [s]."""
    count = int((len(asked) - 1) * grid * record.command_rate + 1e-6) + 1
    stamps = np.arange(count) / record.command_rate
    rows = np.clip((stamps / grid + 1e-6).astype(int), 0, len(asked) - 1)
    values = asked[rows]
    if record.quantum:
        values = np.round(values / record.quantum) * record.quantum
    stamps = stamps + record.late
    if record.on_change:
        new = np.r_[True, np.any(np.diff(values, axis=0) != 0.0, axis=1)]
        stamps, values = stamps[new], values[new]
    return stamps, values


def write(
    path: Path, table: pd.DataFrame, channels: tuple[str, ...], stamps: Array, values: Array, *, long: bool
) -> Path:
    """Write a log: a row a time stamp with the command that is known by then, or a line for each value."""
    if not long:
        rows = np.clip(np.searchsorted(stamps, table["t"].to_numpy() + 1e-9, "right") - 1, 0, None)
        wide = pd.concat([table, pd.DataFrame(values[rows], columns=list(channels))], axis=1)
        wide.round(6).to_csv(path, index=False)
        return path
    orders = pd.DataFrame(values, columns=list(channels)).assign(time=stamps, topic="/thrusters")
    motion = table.rename(columns={"t": "time"}).assign(topic="/odometry")
    parts = [part.melt(id_vars=["time", "topic"], var_name="field") for part in (motion, orders)]
    pd.concat(parts).sort_values("time", kind="stable").round(6).to_csv(path, index=False)
    return path
