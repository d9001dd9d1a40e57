"""Defects of real logs, planted in the channels of a sound one: what is written, and what a check should say of it."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from undertow.measurements.canonical import Channel
from undertow.measurements.log import Log, read_log
from undertow.physics.motion import Array, body_to_earth

Channels = dict[str, Channel]
_GRID = 0.1
_BEAT = 0.2


@dataclass(frozen=True, slots=True)
class Defect:
    """A defect.

    Attributes
    ----------
    name : for the table
    check, channel : of the finding that must tell it; any channel when empty
    plant : changes the channels; the size is drawn by the study
    sizes : smallest and largest size drawn
    value : the number that the finding must have, for a size
    tolerance : how far off that number may be, for a size
    """

    name: str
    check: str
    channel: str
    plant: Callable[[Channels, float, np.random.Generator], Channels]
    sizes: tuple[float, float] = (1.0, 1.0)
    value: Callable[[float], float] | None = None
    tolerance: Callable[[float], float] = lambda size: 0.1 * abs(size)


def autopilot_log(log: Log, seed: int) -> Log:
    """A sound log as an autopilot would write it: positions, heading, gyro, PWM about 1500, on one grid of 10 Hz.

    Speeds are left out, so that they must be derived; positions have the noise of a good receiver, 1 cm.
    """
    rng = np.random.default_rng(seed)
    start, end = (f(c.time[k] for c in log.channels.values()) for f, k in ((max, 0), (min, -1)))
    grid = np.arange(np.ceil(start / _GRID), np.floor(end / _GRID)) * _GRID
    fine = np.arange(grid[0], grid[-1] + 0.01, 0.01)
    u, v, psi = (np.interp(fine, *_series(log.channels[name])) for name in ("u", "v", "psi"))
    velocity = np.column_stack(body_to_earth(psi, u, v))
    way = np.concatenate([np.zeros((1, 2)), np.cumsum(0.005 * (velocity[1:] + velocity[:-1]), axis=0)])
    found = {
        name: np.interp(grid, fine, way[:, k]) + 0.01 * rng.standard_normal(grid.size) for k, name in enumerate("xy")
    }
    found |= {name: np.interp(grid, *_series(log.channels[name])) for name in ("psi", "r")}
    for name, channel in log.channels.items():
        if name.startswith(("pwm", "newton")):
            found[name] = channel.value[np.clip(np.searchsorted(channel.time, grid, "right") - 1, 0, None)]
    return replace(log, channels={name: Channel(name, grid, value, name) for name, value in found.items()})


def _series(channel: Channel) -> tuple[Array, Array]:
    return channel.time, np.unwrap(channel.value) if channel.name == "psi" else channel.value


def _changed(channels: Channels, **values: Array) -> Channels:
    return channels | {name: replace(channels[name], value=value) for name, value in values.items()}


def _swapped(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    return _changed(channels, pwm_port=channels["pwm_stbd"].value, pwm_stbd=channels["pwm_port"].value)


def _reversed(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    return _changed(channels, pwm_port=3000.0 - channels["pwm_port"].value)


def _neutral(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    return _changed(channels, **{name: channels[name].value + size for name in ("pwm_port", "pwm_stbd")})


def _scaled(name: str, factor: float) -> Callable[[Channels, float, np.random.Generator], Channels]:
    def plant(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
        names = name.split()
        return _changed(channels, **{one: factor * channels[one].value for one in names})

    return plant


def _late(names: str) -> Callable[[Channels, float, np.random.Generator], Channels]:
    def plant(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
        # The stamps stay on their grid, as in a file; the values are those of earlier instants.
        found = {}
        for name in names.split():
            channel = channels[name]
            if name.startswith("pwm"):
                rows = np.searchsorted(channel.time, channel.time - size, "right") - 1
                found[name] = channel.value[np.clip(rows, 0, None)]
            else:
                found[name] = np.interp(channel.time - size, channel.time, channel.value)
        return _changed(channels, **found)

    return plant


def _held(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    return _fixes(channels, 0.0, rng)


def _late_fixes(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    return _fixes(channels, size, rng)


def _fixes(channels: Channels, share: float, rng: np.random.Generator) -> Channels:
    """Positions at 5 Hz, held over two rows, of which a share comes a row late."""
    time = channels["x"].time
    taken = np.arange(0, time.size, round(_BEAT / _GRID))
    shown = taken + (rng.random(taken.size) < share)
    row = taken[np.clip(np.searchsorted(shown, np.arange(time.size), "right") - 1, 0, None)]
    return _changed(channels, x=channels["x"].value[row], y=channels["y"].value[row])


def _deviating(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    psi = channels["psi"].value
    return _changed(channels, psi=psi - size * np.cos(psi))


def _stuck(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    value = channels["r"].value.copy()
    start = int(rng.integers(200, value.size - 400))
    value[start : start + round(size / _GRID)] = value[start]
    return _changed(channels, r=value)


def _written(channels: Channels, row: NDArray[np.int64]) -> Channels:
    """The rows of a wide table in another order, or some of them twice, written and read again."""
    table = np.column_stack([next(iter(channels.values())).time, *(c.value for c in channels.values())])[row]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        np.savetxt(path, table, "%.6f", ",", header=",".join(["t", *channels]), comments="")
        return read_log(path, mend=True).channels


def _repeated(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    count = next(iter(channels.values())).time.size
    again = rng.choice(count, round(size * count), replace=False)
    return _written(channels, np.sort(np.concatenate([np.arange(count), again])))


def _backward(channels: Channels, size: float, rng: np.random.Generator) -> Channels:
    row = np.arange(next(iter(channels.values())).time.size)
    first = 2 * rng.choice(row.size // 2, round(size * row.size), replace=False)
    row[first], row[first + 1] = first + 1, first
    return _written(channels, row)


def late_share(share: float) -> float:
    """Share of the steps between fixes that are off when each fix is late with probability `share`."""
    return 2.0 * share * (1.0 - share)


# Commands are rounded to the grid twice, when they are sampled and when they are made late: half a step each time.
DEFECTS = (
    Defect("port and starboard swapped", "sides", "", _swapped),
    Defect("port output reversed", "direction", "pwm_port", _reversed),
    Defect("neutral PWM off", "neutral", "", _neutral, (8.0, 30.0), lambda s: 1500.0 + s, lambda s: 0.5),
    Defect("fixes held over two rows", "held fixes", "", _held, (1.0, 1.0), lambda s: 5.0, lambda s: 0.1),
    Defect("fixes a row late", "late fixes", "", _late_fixes, (0.05, 0.35), late_share, lambda s: 0.02 + 0.2 * s),
    Defect("gyro late", "clocks", "r", _late("r"), (0.05, 0.3), lambda s: s, lambda s: 0.03),
    Defect(
        "commands late",
        "clocks",
        "pwm_port",
        _late("pwm_port pwm_stbd"),
        (0.1, 0.3),
        lambda s: -s - _GRID,
        lambda s: 0.06,
    ),
    Defect(
        "compass deviates",
        "compass",
        "psi",
        _deviating,
        (0.07, 0.2),
        lambda s: 0.75 * np.degrees(s),
        lambda s: 0.45 * np.degrees(s),
    ),
    Defect(
        "heading in degrees", "units", "psi", _scaled("psi", 180.0 / np.pi), (1.0, 1.0), lambda s: 57.3, lambda s: 3.0
    ),
    Defect(
        "gyro in degrees", "units", "r", _scaled("r", 180.0 / np.pi), (1.0, 1.0), lambda s: 0.01745, lambda s: 0.001
    ),
    Defect("gyro stuck", "stuck", "r", _stuck, (2.0, 10.0), lambda s: s, lambda s: 0.3),
    Defect("stamps repeated", "stamps", "", _repeated, (0.02, 0.2), lambda s: s / (1.0 + s), lambda s: 0.002),
    Defect("stamps backward", "stamps", "", _backward, (0.002, 0.04), lambda s: s, lambda s: 0.001),
)
"""Defects of a log as an autopilot writes it."""

SPEED_DEFECTS = (
    Defect("speeds in knots", "units", "u", _scaled("u v", 1.94384), (1.0, 1.0), lambda s: 0.5144, lambda s: 0.01),
    Defect("speeds in km/h", "units", "u", _scaled("u v", 3.6), (1.0, 1.0), lambda s: 0.2778, lambda s: 0.01),
    Defect("speeds late", "clocks", "u", _late("u v"), (0.1, 0.3), lambda s: s, lambda s: 0.03),
)
"""Defects of a log with speeds of its own."""
