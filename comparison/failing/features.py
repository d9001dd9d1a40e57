"""Regimes of a log, and features of a place in it: quantities of each row, ranges in words, and what the boat did."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...physics.presentation import NARROW, number
from ...residuals.series import SeriesTable
from .rows import IDLE_SHARE, SLOW, Array, Scene, command_columns, scaled_commands

SECTORS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
Words = Callable[[str, str], str]
"""A range in words: its lower and its upper end as text, either empty where the range is open."""
_PARTS = 40
"""A threshold is rounded so that about so many fit between the ends of the quantity."""
_BINS = 6
"""Regimes of a number, about: as many as fit under a drawing."""
_TURNING = 0.1
"""Yaw rate [rad/s] from which the boat is said to turn."""
_STILL = 0.15
"""Speed [m/s] below which it is said to lie still."""


@dataclass(frozen=True, slots=True)
class Split:
    """Rows sorted into the regimes of one quantity; `edges` [`unit`] only where the quantity is a number."""

    by: str
    codes: NDArray[np.intp]
    labels: tuple[str, ...]
    edges: tuple[float, ...] = ()
    unit: str = ""

    def inside(self, first: int, last: int) -> NDArray[np.bool_]:
        """The rows in the regimes `first` to `last`, round the compass where these are headings."""
        return (self.codes - first) % len(self.labels) <= last - first

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
        Split("heading", sector(series["psi"]), SECTORS),
    )


def _numeric(by: str, values: NDArray[np.float64], unit: str) -> Split:
    usable = values[np.isfinite(values)]
    if usable.size == 0:
        return Split(by, np.zeros(len(values), np.intp), (f"{by} unknown",))
    low, high = np.quantile(usable, [0.005, 0.995])
    step = round_number(max((high - low) / _BINS, 1e-3) * (1.0 - 1e-9), (1.0, 2.0, 2.5, 5.0, 10.0))
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


def round_number(least: float, numbers: Sequence[float]) -> float:
    """The least of some round numbers, times a power of ten, that is as large."""
    power = 10.0 ** np.floor(np.log10(least))
    return float(power * next(number for number in numbers if number * power >= least))


def sector(heading: Array) -> NDArray[np.intp]:
    """The number of the nearest of eight directions, from north clockwise, to a heading [rad]."""
    return np.round(np.nan_to_num(heading) / (np.pi / 4.0)).astype(np.intp) % len(SECTORS)


def _commands(series: SeriesTable) -> Split:
    names = command_columns(series)
    if not names:
        return Split("command", np.zeros(len(series), np.intp), ("no command in the log",))
    command = scaled_commands(series)
    common, spread = command.mean(axis=1), 0.5 * (command.max(axis=1) - command.min(axis=1))
    speed = series["u"]
    who = {1: "thruster", 2: "both thrusters"}.get(len(names), "all thrusters")
    idle, ahead, astern = f"thruster{'s' * (len(names) > 1)} idle", f"{who} ahead", f"{who} astern"
    turning, reversal = "thrusters opposed to turn", "thrust against the motion"
    labels = (idle, ahead, astern, turning, reversal)
    first_that_holds = {
        idle: np.abs(command).max(axis=1) < IDLE_SHARE,
        turning: spread > np.abs(common),
        reversal: (common * speed < 0.0) & (np.abs(speed) > SLOW),
        ahead: common >= 0.0,
    }
    order = [labels.index(state) for state in first_that_holds]
    codes = np.select(list(first_that_holds.values()), order, labels.index(astern)).astype(np.intp)
    return Split("command", codes, labels)


@dataclass(frozen=True, slots=True)
class Feature:
    """A quantity of every row.

    Attributes
    ----------
    name : of the quantity
    values : (n,)
    words : a range of it in words
    grain : to which thresholds are rounded; 0 for a state that holds or not
    size_of : name of the signed quantity of which it is the modulus
    """

    name: str
    values: Array
    words: Words
    grain: float
    size_of: str = ""

    def rounded(self, threshold: float) -> float:
        """A threshold that can be said."""
        return round(round(threshold / self.grain) * self.grain, 9) if self.grain else threshold

    def inside(self, low: float, high: float) -> NDArray[np.bool_]:
        """The rows in a range, open below and closed above, as the branches of a tree are."""
        return (self.values > low) & (self.values <= high)

    def phrase(self, low: float, high: float) -> str:
        """The same range in words."""
        return self.words(*(f"{end:g}" if np.isfinite(end) else "" for end in (low, high)))


def features(scene: Scene) -> tuple[Feature, ...]:
    """Speed, sway, turn rate, commands, reversals, heading and time since the last command change of every row."""
    u, v, r = (scene.table[name] for name in ("u", "v", "r"))
    heading = np.degrees(scene.table["psi"])
    found = [
        _of("surge speed", u, _plain("surge speed {} m/s")),
        _of("sway speed", v, _plain("sway speed {} m/s (starboard positive)")),
        _of("drift", np.abs(v), _plain("sway speed {} m/s to either side"), "sway speed"),
        _of("yaw rate", r, _turn),
        _of("turn rate", np.abs(r), _plain("turning at {} rad/s", "faster than", "slower than"), "yaw rate"),
    ]
    if scene.commands.shape[1]:
        mean_command = _percent("mean command {} of the largest (ahead positive)", "thrust ahead", "thrust astern")
        found += [
            _of("mean command", 100.0 * scene.common, mean_command),
            _of("reversal", scene.opposed.astype(float), _opposed),
            _of("time since a change", scene.since, _since),
        ]
    if scene.commands.shape[1] > 1:
        apart = _percent("commands {} of the largest apart", "commands that differ", "")
        found.append(_of("apart", 100.0 * scene.command_spread, apart))
    for zero, ends in ((0.0, ("north", "south")), (90.0, ("east", "west"))):
        away = np.abs((heading - zero + 180.0) % 360.0 - 180.0)
        found.append(Feature(f"heading from {ends[0]}", away, _heading(*ends), 5.0))
    return tuple(found)


def merged(
    ranges: Mapping[str, tuple[float, float]], found: Sequence[Feature]
) -> list[tuple[Feature, tuple[float, float]]]:
    """Ranges of several quantities, a modulus told together with its quantity where that leaves the place as it is."""
    named = {feature.name: feature for feature in found}
    left = dict(ranges)
    for size, (low, high) in ranges.items():
        signed = named[size].size_of
        if signed in ranges:
            below, above = left[signed]
            if below >= -max(low, 0.0):  # the quantity is on one side, or within the gap: its modulus is itself
                left[signed] = (max(below, low), min(above, high))
                del left[size]
            elif above <= max(low, 0.0):
                left[signed] = (max(below, -high), min(above, -low))
                del left[size]
    return [(named[name], ends) for name, ends in left.items()]


def doing(scene: Scene, rows: NDArray[np.bool_]) -> str:
    """The boat's main activity on some rows, in words.

    For example 'turning to port at 1.2 m/s, both thrusters ahead'.
    """
    u, r = (float(np.median(scene.table[name][rows])) for name in ("u", "r"))
    speed = f"at {number(abs(u), 2)} m/s"
    if abs(r) > _TURNING:
        way = f"turning to {'starboard' if r > 0.0 else 'port'}"
        moving = f"{way} {'astern ' if u < 0.0 else ''}{speed}" if abs(u) >= _STILL else f"{way} on the spot"
    elif abs(u) < _STILL:
        moving = "nearly still"
    else:
        moving = f"going {'ahead' if u > 0.0 else 'astern'} {speed}"
    if not scene.commands.shape[1]:
        return moving
    command = splits(scene.table)[2]
    states = np.bincount(command.codes[rows])
    told = command.labels[int(states.argmax())] if states.max() > 0.6 * states.sum() else "thrusters changing"
    return f"{moving}, {told}"


def _of(name: str, values: Array, words: Words, size_of: str = "") -> Feature:
    usable = values[np.isfinite(values)]
    low, high = np.quantile(usable, [0.005, 0.995]) if usable.size else (0.0, 1.0)
    grain = 0.0 if name == "reversal" else round_number(max((high - low) / _PARTS, 1e-6), (1.0, 2.0, 5.0, 10.0))
    return Feature(name, np.nan_to_num(values), words, grain, size_of)


def _between(low: str, high: str, above: str = "above", below: str = "below", unit: str = "") -> str:
    if low and high:
        return f"{low}{unit} to {high}{unit}"
    return f"{above} {low}{unit}" if low else f"{below} {high}{unit}"


def _plain(text: str, above: str = "above", below: str = "below") -> Words:
    def words(low: str, high: str) -> str:
        told = text.format(_between(low, high, above, below))
        return told if low and high else told.replace("turning at ", "turning ")

    return words


def _percent(text: str, above_zero: str, below_zero: str) -> Words:
    """A range of shares, with words of its own above and below zero."""
    signs = {("0", ""): above_zero, ("", "0"): below_zero}
    return lambda low, high: signs.get((low, high)) or text.format(_between(low, high, unit=f"{NARROW}%"))


def _turn(low: str, high: str) -> str:
    if low and float(low) >= 0.0:
        at = f"at {low} to {high}" if high else f"faster than {low}"
        return "turning to starboard" if low == "0" and not high else f"turning {at} rad/s to starboard"
    if high and float(high) <= 0.0:
        ends = [f"{-float(end):g}" for end in (high, low) if end]
        at = f"at {ends[0]} to {ends[1]}" if low else f"faster than {ends[0]}"
        return "turning to port" if high == "0" and not low else f"turning {at} rad/s to port"
    return f"yaw rate {_between(low, high)} rad/s (starboard positive)"


def _opposed(low: str, _: str) -> str:
    return f"thrust {'' if low else 'not '}against the motion"


def _since(low: str, high: str) -> str:
    if low and high:
        return f"{low} to {high} s after a command change"
    if "0" in (low, high):
        return "between command changes" if low else "at a command change"
    return f"more than {low} s after a command change" if low else f"within {high} s of a command change"


def _heading(near: str, far: str) -> Words:
    def words(low: str, high: str) -> str:
        if low and high:
            return f"heading {low} to {high} degrees from {near}"
        reach, middle = (high, near) if high else (f"{180 - float(low):g}", far)
        return f"heading within {reach} degrees of {middle}"

    return words
