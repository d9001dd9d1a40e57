"""Regimes of a log: its rows sorted by surge speed, yaw rate, what the thrusters are told, and heading."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...residuals.series_table import SeriesTable

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
