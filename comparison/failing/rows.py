"""Rows that are judged (stretches without a gap, blocks, commands), and the regimes into which they are sorted."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.signals import running_mean
from ...residuals.series import SeriesTable

COMMAND_KINDS = ("pwm_", "normalized_", "rad_s_", "newton_")
PWM_NEUTRAL = 1500.0
"""Middle of the usual range of 1000 to 2000 us."""
IDLE_SHARE = 0.08
"""Share of the largest command in the log below which a thruster counts as idle: trim, and a stick at neutral."""
SLOW = 0.1
"""Speed [m/s] below which thrust cannot be said to oppose the motion: that of noise and waves."""
SECTORS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
STATES = ("idle", "ahead", "astern", "turning", "reversal")


@dataclass(frozen=True, slots=True)
class Split:
    """Rows sorted into the regimes of one quantity; `edges` [`unit`] only where the quantity is a number."""

    by: str
    codes: NDArray[np.intp]
    labels: tuple[str, ...]
    edges: tuple[float, ...] = ()
    unit: str = ""

    def phrase(self, first: int, last: int) -> str:
        """The regimes `first` to `last` in words, for example 'surge speed 1.4 to 1.9 m/s'."""
        if self.edges:
            low, high = self.edges[first], self.edges[last + 1]
            side = ""
            if self.by == "yaw rate" and low * high >= 0.0:
                side = " (to starboard)" if high > 0.0 else " (to port)"
            return f"{self.by} {low:g} to {high:g} {self.unit}{side}"
        if self.by == "heading":
            ends = (self.labels[first], self.labels[last % len(self.labels)])
            return f"heading near {ends[0]}" if first == last else f"heading from {ends[0]} to {ends[1]}"
        return self.labels[first]


def command_columns(series: SeriesTable) -> list[str]:
    """The command channels of a series, one per thruster, known by their prefix (`newton_port`, `pwm_stbd`, ...)."""
    return [name for name in series.columns if name.startswith(COMMAND_KINDS)]


def splits(series: SeriesTable) -> tuple[Split, ...]:
    """Sort the rows of a series by surge speed, yaw rate, command and heading.

    Parameters
    ----------
    series : SeriesTable
        Rows of `series.csv`: `u` [m/s], `r` [rad/s], `psi` [rad] and one column per command.

    Returns
    -------
    tuple of Split
        One each by surge speed, yaw rate, command and heading; every row is in exactly one regime of each.
    """
    return (
        _numeric("surge speed", series["u"], "m/s"),
        _numeric("yaw rate", series["r"], "rad/s"),
        _commands(series),
        Split("heading", _sector(series["psi"]), SECTORS),
    )


def _numeric(by: str, values: NDArray[np.float64], unit: str, bins: int = 6) -> Split:
    usable = values[np.isfinite(values)]
    if usable.size == 0:
        return Split(by, np.zeros(len(values), np.intp), (f"{by} unknown",))
    low, high = np.quantile(usable, [0.005, 0.995])
    raw = max((high - low) / bins, 1e-3)
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(nice for nice in (1.0, 2.0, 2.5, 5.0, 10.0) if nice * power >= raw * (1.0 - 1e-9))
    first, last = int(np.floor(low / step)), max(int(np.ceil(high / step)), int(np.floor(low / step)) + 1)
    edges = [round(float(index * step), 9) for index in range(first, last + 1)]
    # A nearly empty bin at either end says nothing of its own and joins its neighbour.
    while len(edges) > 3 and np.mean(usable < edges[1]) < 0.01:
        del edges[1]
    while len(edges) > 3 and np.mean(usable >= edges[-2]) < 0.01:
        del edges[-2]
    codes = np.digitize(np.nan_to_num(values), edges[1:-1]).astype(np.intp)
    labels = tuple(f"{start:g} to {stop:g}" for start, stop in pairwise(edges))
    return Split(by, codes, labels, tuple(edges), unit)


def _sector(heading: NDArray[np.float64]) -> NDArray[np.intp]:
    return (np.round(np.nan_to_num(heading) / (np.pi / 4.0)).astype(np.intp)) % len(SECTORS)


def scaled_commands(series: SeriesTable) -> NDArray[np.float64]:
    """The commands from neutral, (rows, thrusters), as shares of the largest one in the rows."""
    names = command_columns(series)
    neutral = np.array([PWM_NEUTRAL if name.startswith("pwm_") else 0.0 for name in names])
    command = np.nan_to_num(series[names] - neutral)
    return command / max(float(np.abs(command).max(initial=0.0)), 1e-12)


def _commands(series: SeriesTable) -> Split:
    names = command_columns(series)
    if not names:
        return Split("command", np.zeros(len(series), np.intp), ("no command in the log",))
    command = scaled_commands(series)
    common, spread = command.mean(axis=1), 0.5 * (command.max(axis=1) - command.min(axis=1))
    speed = series["u"]
    conditions = [
        np.abs(command).max(axis=1) < IDLE_SHARE,
        spread > np.abs(common),
        (common * speed < 0.0) & (np.abs(speed) > SLOW),
        common >= 0.0,
    ]
    order = [STATES.index(state) for state in ("idle", "turning", "reversal", "ahead")]
    codes = np.select(conditions, order, STATES.index("astern")).astype(np.intp)
    who = {1: "thruster", 2: "both thrusters"}.get(len(names), "all thrusters")
    labels = (
        "thrusters idle" if len(names) > 1 else "thruster idle",
        f"{who} ahead",
        f"{who} astern",
        "thrusters opposed to turn",
        "thrust against the motion",
    )
    return Split("command", codes, labels)


Array = NDArray[np.float64]

ACCELERATIONS = ("u_dot", "v_dot", "r_dot")
BLOCK = 5.0
"""Length of the blocks [s] that are drawn, left out and counted as one: the error forgets itself within one."""
STEP = 0.1
"""Time step [s] of rows that bear no time."""
EDGE = 0.8
"""Time [s] at both ends of a stretch of which nothing is said: the filter has no motion to go on there, and errs."""
_SMOOTH = 1.0
"""Length of the means [s] that leave what is slow."""
_CHANGE = 0.05
"""Share of the largest command by which a command changes from row to row when it is said to change."""
_LONG_AGO = 10.0
"""Time since a command change [s] beyond which it does not matter how long ago it was."""


ENOUGH_SECONDS = 60.0
"""Held-out motion [s] below which the regimes are not filled: a dozen blocks of 5 s."""


@dataclass(frozen=True, slots=True)
class Scene:
    """Rows of the series of one model.

    Attributes
    ----------
    table : the rows of `series.csv`
    step : time between them [s]
    measured, error : (n, 3) acceleration, and modelled minus measured [m/s^2, m/s^2, rad/s^2]; NaN where missing, and
        the error within `EDGE` of the ends of a stretch
    stretch : (n,) number of the gap-free stretch
    block : (n,) number of the block of about `BLOCK` seconds, no block in two stretches
    log : (n,) number of the log
    held_out : (n,) whether the row belongs to the test part
    commands : (n, thrusters) from neutral, as shares of the largest
    since : (n,) time since the last command change [s], at most 10
    """

    table: SeriesTable
    step: float
    measured: Array
    error: Array
    stretch: NDArray[np.intp]
    block: NDArray[np.intp]
    log: NDArray[np.intp]
    held_out: NDArray[np.bool_]
    commands: Array
    since: Array

    def column(self, name: str) -> Array:
        """A column of the table."""
        return self.table[name]

    @property
    def spread(self) -> Array:
        """Standard deviation of the measured acceleration by axis, (3,)."""
        return np.sqrt(mean_square(self.measured - _mean(self.measured)))

    def slow(self) -> tuple[Array, Array]:
        """Error (n, 3), and usual size (3,) of the measured acceleration, both as means over a second.

        What a missing force makes is slow and stays; most of the noise of differentiated velocities goes. A mean that
        reaches into the next stretch does no harm to what is told of many seconds.
        """
        rows = max(1, round(_SMOOTH / self.step))
        error = running_mean(np.nan_to_num(self.error), rows)
        measured = running_mean(np.nan_to_num(self.measured - _mean(self.measured)), rows)
        return error, np.sqrt(mean_square(measured))

    @property
    def common(self) -> Array:
        """Mean command, (n,)."""
        return self.commands.mean(axis=1) if self.commands.shape[1] else np.zeros(len(self.table))

    @property
    def command_spread(self) -> Array:
        """Largest less smallest command, (n,)."""
        return np.ptp(self.commands, axis=1) if self.commands.shape[1] else np.zeros(len(self.table))

    @property
    def opposed(self) -> NDArray[np.bool_]:
        """True when the thrust works against the motion, (n,)."""
        speed = self.column("u")
        return (self.common * speed < 0.0) & (np.abs(speed) > SLOW) & (np.abs(self.common) > IDLE_SHARE)


def scene(table: SeriesTable, model: str = "before") -> Scene:
    """Rows of `series.csv` with the error of its first ("before") or last ("after") model."""
    n = len(table)
    time = table["time"] if "time" in table else STEP * np.arange(n)
    step = float(np.median(np.diff(time))) if n > 1 else STEP
    log = table["log"].astype(np.intp, copy=False) if "log" in table else np.zeros(n, np.intp)
    breaks = np.zeros(n, bool)
    breaks[1:] = (np.abs(np.diff(time) - step) > 0.5 * step) | (np.diff(log) != 0)
    stretch = np.cumsum(breaks).astype(np.intp)
    measured = table[ACCELERATIONS]
    error = acceleration_error(table, model)
    error[_ends(stretch, round(EDGE / step))] = np.nan
    commands = scaled_commands(table)
    return Scene(
        table,
        step,
        measured,
        error,
        stretch,
        _blocks(stretch, step),
        log,
        table["part"] == "test" if "part" in table else np.zeros(n, bool),
        commands,
        _since(commands, breaks, step),
    )


def acceleration_error(series: SeriesTable, model: str = "before") -> Array:
    """Modelled minus measured acceleration, shape (rows, 3) [m/s^2, m/s^2, rad/s^2], NaN where either is missing."""
    return np.column_stack([series[f"{name}_{model}"] - series[name] for name in ACCELERATIONS])


def mean_square(values: Array) -> Array:
    """Mean square over the finite rows, by column; zero where there is none."""
    return _mean(np.square(values))


def shorter(values: Any, digits: int = 5) -> list[float]:
    """Numbers for a file, to some significant digits."""
    return [float(f"{value:.{digits}g}") for value in np.asarray(values, dtype=float)]


def _mean(values: Array) -> Array:
    usable = np.isfinite(values)
    return np.where(usable, values, 0.0).sum(0) / np.maximum(usable.sum(0), 1)


def _ends(stretch: NDArray[np.intp], rows: int) -> NDArray[np.bool_]:
    """The first and last rows of every stretch, so many at each end."""
    place = np.arange(stretch.size)
    first = np.searchsorted(stretch, stretch, "left")
    last = np.searchsorted(stretch, stretch, "right")
    return (place - first < rows) | (last - 1 - place < rows)


def _blocks(stretch: NDArray[np.intp], step: float) -> NDArray[np.intp]:
    """Cut every stretch into blocks of equal length, about `BLOCK` seconds each."""
    result, first = np.zeros(stretch.size, np.intp), 0
    for length in np.bincount(stretch) if stretch.size else []:
        pieces = max(1, round(length * step / BLOCK))
        done = int(result[first - 1]) + 1 if first else 0
        result[first : first + length] = done + np.arange(length) * pieces // length
        first += int(length)
    return result


def _since(commands: Array, breaks: NDArray[np.bool_], step: float) -> Array:
    """Time since the last change of a command [s]; long ago at the beginning of a stretch."""
    n = commands.shape[0]
    changed = np.zeros(n, bool)
    if commands.shape[1]:
        changed[1:] = np.abs(np.diff(commands, axis=0)).max(axis=1) > _CHANGE
    row = np.arange(n)
    began = np.maximum.accumulate(np.where(breaks, row, 0))
    last = np.maximum.accumulate(np.where(changed & ~breaks, row, -n - round(_LONG_AGO / step)))
    return np.where(last > began, np.minimum((row - last) * step, _LONG_AGO), _LONG_AGO)
