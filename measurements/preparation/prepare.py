"""Preparation of logs: motions on one even time base, a `DataSet`, by a `Recipe` that says how."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ...physics.errors import LogError, RequestError, expect
from ...physics.motion import RUN_UP, Array, Motion, body_to_earth, earth_to_body
from ...physics.sampled_series import area_average, understated_noise
from ...physics.vehicle import Vehicle
from ..canonical import MOTION, Channel
from ..log import Log, channels_digest
from ..statistics.signals import integrated
from .needs import command_channels, require
from .resampling import (
    Span,
    command_step,
    derivative,
    even_grid,
    gap_limit,
    gaps,
    is_logged_on_change,
    jumps_in_words,
    jumps_of,
    samples,
    segments,
    smooth,
)


@dataclass(frozen=True, slots=True)
class Recipe:
    """How logs become motions.

    Attributes
    ----------
    rate : of the even time base [Hz]; None for the odometry's own rate, at most 20 Hz
    cutoff : of the zero-phase Butterworth low-pass on the velocities [Hz]; None for no filter
    order : of that filter (it acts twice, once in each direction)
    max_gap : longest stretch without a sample that is still bridged [s]; None for the larger of 0.5 s and five
        sample periods of the channel
    commands : "hold" for commands that stay until the next one, "interpolate" for a sampled continuous command
    shares : of train, validation and test, in this order in time
    guard : dropped at each boundary between them [s]

    Raises
    ------
    RequestError
        when a number cannot be used.
    """

    rate: float | None = 10.0
    cutoff: float | None = 1.2
    order: int = 4
    max_gap: float | None = None
    commands: Literal["hold", "interpolate"] = "hold"
    shares: tuple[float, float, float] = (0.70, 0.15, 0.15)
    guard: float = 1.0

    def __post_init__(self) -> None:
        for name in ("rate", "cutoff", "max_gap"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise RequestError(f"recipe: expected a positive {name} or None, got {value}.")
        if self.order < 1:
            raise RequestError(f"recipe: expected a filter order of at least 1, got {self.order}.")
        if self.commands not in ("hold", "interpolate"):
            raise RequestError(f"recipe: expected commands 'hold' or 'interpolate', got {self.commands!r}.")
        if min(self.shares) < 0 or abs(sum(self.shares) - 1.0) > 1e-9:
            raise RequestError(f"recipe: expected three shares that add up to 1, got {self.shares}.")
        if self.guard < 0:
            raise RequestError(f"recipe: expected a guard of at least 0 s, got {self.guard}.")
        if self.rate is not None and self.cutoff is not None and self.cutoff >= self.rate / 2:
            raise RequestError(
                f"recipe: a cutoff of {self.cutoff} Hz needs a rate above {2 * self.cutoff} Hz, got {self.rate} Hz."
            )


PAPER = Recipe()
"""The paper's preparation: 10 Hz, 4th-order Butterworth at 1.2 Hz, zero phase; then central differences."""

WEAK = Recipe(rate=None, cutoff=None)
"""For the weak form, which needs no derivative: the log's own rate and no filter."""


@dataclass(frozen=True, slots=True)
class DataSet:
    """Motions of one or several logs, ready for use.

    Attributes
    ----------
    motions : gap-free stretches, log by log, in the order of time; filtered if the recipe has a cutoff
    notes : every guess, conversion and loss on the way, as sentences
    recipe : how they were made
    unfiltered : the same motions before the filter, from which `split` starts so that the filter never looks across
        a boundary; None when `motions` are not filtered
    """

    motions: tuple[Motion, ...]
    notes: tuple[str, ...]
    recipe: Recipe = field(default=WEAK)
    unfiltered: tuple[Motion, ...] | None = None

    @property
    def rows(self) -> int:
        """Number of time stamps in all motions."""
        return sum(motion.time.size for motion in self.motions)

    @property
    def seconds(self) -> float:
        """Summed duration of all motions [s]."""
        return float(sum(motion.duration for motion in self.motions))

    def mapped(self, change: Callable[[Motion], Motion]) -> "DataSet":
        """The same with every motion changed, filtered and unfiltered alike: it is linear in what is filtered."""
        raw = None if self.unfiltered is None else tuple(map(change, self.unfiltered))
        return replace(self, motions=tuple(map(change, self.motions)), unfiltered=raw)

    def within(self, part: Callable[[Motion], tuple[Motion, ...]]) -> "DataSet":
        """The same of some rows alone: those pieces of each motion that `part` gives."""
        raw = None if self.unfiltered is None else tuple(piece for m in self.unfiltered for piece in part(m))
        return replace(self, motions=tuple(piece for m in self.motions for piece in part(m)), unfiltered=raw)

    @property
    def raw(self) -> tuple[Motion, ...]:
        """The motions without filter."""
        return self.motions if self.unfiltered is None else self.unfiltered


def join_parts(parts: Sequence[DataSet]) -> DataSet:
    """Join parts that were prepared alike to one data set, with the notes of the first."""
    raw = None if parts[0].unfiltered is None else tuple(motion for part in parts for motion in part.raw)
    return replace(parts[0], motions=tuple(motion for part in parts for motion in part.motions), unfiltered=raw)


LEAST_SECONDS = 20.0
"""A log with less than this of usable motion [s] is refused."""
LEAST_SEGMENT = 5.0
"""A stretch between two gaps shorter than this [s] is dropped."""
FASTEST_NATIVE = 20.0
"""Cap of the native rate [Hz]."""
_AT_PACE = 0.2
"""Share by which a record's own step may differ from the grid's, for their differences to have the same noise."""
_BRIDGED = 5.0
"""Gap [s] beyond which nothing is known of the motion before it: in less, a boat hardly turns twice."""
_WIND = ("wind_u", "wind_v")


def prepare(logs: Log | Sequence[Log], vehicle: Vehicle | None, recipe: Recipe = PAPER) -> DataSet:
    """Resample logs to an even time base and, if the recipe says so, filter the velocities.

    Velocity, position and heading are interpolated linearly; commands are averaged over the step centred on each
    stamp. Nothing is interpolated across a gap: the log falls into several motions there. What is missing but
    follows from the rest is derived, with a note: u and v from x, y and psi; r from psi; x and y from u, v and psi.

    Parameters
    ----------
    logs : one log or several
    vehicle : whose thrusters name the command channels, `<command>_<name>`; None for motions without commands
    recipe : rate, filter, gaps

    Returns
    -------
    DataSet
        To divide it into parts for fitting and judging, give it to `split`, which filters each part on its own.

    Raises
    ------
    LogError
        when a log lacks a channel, its commands are of another kind, or it has less than 20 s of usable motion.
    RequestError
        when no log is given, or one is given twice.
    """
    expect("prepare: logs", logs, (Log, Iterable), "undertow.read_log(PATH) reads one")
    logs = (logs,) if isinstance(logs, Log | str) else tuple(logs)
    for log in logs:
        expect("prepare: logs", log, Log, "undertow.read_log(PATH) reads one")
    if vehicle is not None:
        expect("prepare: vehicle", vehicle, Vehicle, "undertow.load_vehicle(PATH) reads one")
    _check_distinct(logs)
    for log in logs:
        require(log, vehicle)
    rates = [native_rate(log) for log in logs]
    rate = recipe.rate or min(rates)
    notes: list[str] = []
    raw: list[Motion] = []
    for log, own in zip(logs, rates, strict=True):
        found = list(log.notes)
        raw += _motions(log, vehicle, recipe, 1.0 / rate, found)
        if own < 0.99 * rate:
            found.append(f"sampled at {own:.3g} Hz, interpolated to {rate:g} Hz")
        notes += [f"{log.name}: {note}" for note in found] if len(logs) > 1 else found
    if recipe.rate is None and max(rates) > 1.01 * rate:
        notes.append(f"the logs differ in rate, all are resampled to the slowest, {rate:.4g} Hz")
    return filtered(tuple(raw), tuple(notes), recipe)


def filtered(motions: tuple[Motion, ...], notes: tuple[str, ...], recipe: Recipe) -> DataSet:
    """Motions with the filter that a recipe asks for, each on its own."""
    if recipe.cutoff is None:
        return DataSet(motions, notes, recipe)
    smoothed = tuple(smooth(motion, recipe.cutoff, recipe.order) for motion in motions)
    return DataSet(smoothed, notes, recipe, motions)


def motions_within(log: Log, recipe: Recipe, choose: Callable[[list[Span]], list[Span]]) -> tuple[Motion, ...]:
    """Make unfiltered motions without commands of chosen stretches of a log; the others cost no time and no memory.

    Parameters
    ----------
    log, recipe : see `prepare`
    choose : told the usable stretches [s], picks those that are made

    Raises
    ------
    LogError
        see `prepare`.
    """
    require(log, None)
    return tuple(_motions(log, None, recipe, 1.0 / (recipe.rate or native_rate(log)), [], choose))


def native_rate(log: Log) -> float:
    """Tell the rate of the log's own odometry [Hz], at most 20 Hz."""
    period = round(reference(log).period, 9)
    rate = min(FASTEST_NATIVE, 1.0 / period) if period > 0 else FASTEST_NATIVE
    # Jitter moves the median step a little; a log of 19.98 Hz was meant to have 20.
    return float(round(rate)) if abs(rate - round(rate)) < 0.005 * rate else rate


def usable_spans(log: Log, vehicle: Vehicle | None, recipe: Recipe) -> tuple[list[Span], list[str]]:
    """The stretches [s] in which every needed channel is there, those under 5 s left out, and notes on the rest.

    Parameters
    ----------
    log : with its channels
    vehicle : whose commands are needed; none for None
    recipe : with the longest gap
    """
    notes = []
    start, end, holes = -np.inf, np.inf, []
    for channel in _needed(log, vehicle):
        command = channel.name in command_channels(vehicle)
        start = max(start, float(channel.time[0]))
        if command and recipe.commands == "hold" and is_logged_on_change(channel):
            notes.append(f"{channel.name}: logged on change ({channel.time.size} samples), held; its gaps do not count")
            continue
        found = gaps(channel, gap_limit(channel, recipe.max_gap))
        if found:
            at, back = max(found, key=lambda hole: hole[1] - hole[0])
            notes.append(f"{channel.name}: {len(found)} gaps, the longest {back - at:.2f} s at t = {at:.2f} s")
        holes += found
        end = min(end, float(channel.time[-1]) + (channel.period if command else 0.0))
    jumps = jumps_of(log.channels)
    if jumps:
        notes.append(f"{jumps_in_words(jumps)}; the log is cut there")
        holes += [(jump.before, jump.after) for jump in jumps]
    spans = segments(start, end, holes) if start < end else []
    kept = [span for span in spans if span[1] - span[0] >= LEAST_SEGMENT]
    if len(kept) < len(spans):
        lost = sum(high - low for low, high in spans if high - low < LEAST_SEGMENT)
        notes.append(f"{len(spans) - len(kept)} stretches under {LEAST_SEGMENT:g} s dropped, {lost:.1f} s in all")
    if len(kept) > 1:
        notes.append(f"gaps cut the log into {len(kept)} stretches; nothing is interpolated across a gap")
    return kept, notes


def shortfall(log: Log, spans: Sequence[Span], notes: Sequence[str]) -> str | None:
    """Say why the stretches `spans` are too little to work with, None when they are enough; `notes` are the reasons."""
    usable = sum(high - low for low, high in spans)
    # One sample of tolerance: 200 rows at 10 Hz last 19.9 s.
    if usable >= LEAST_SECONDS - reference(log).period - 1e-6:
        return None
    detail = "; ".join(notes) or "the needed channels do not overlap for longer"
    return f"expected at least {LEAST_SECONDS:g} s of usable log, got {usable:.1f} s ({detail}). Record longer."


def _check_distinct(logs: tuple[Log, ...]) -> None:
    if not logs:
        raise RequestError("prepare: expected at least one log, got none.")
    seen: dict[object, tuple[int, Log]] = {}
    for place, log in enumerate(logs if len(logs) > 1 else ()):
        for same in (log.path.resolve(), channels_digest(log)):
            first, other = seen.setdefault(same, (place, log))
            if first != place:
                twice = "is given twice" if other.path == log.path else f"holds the same data as {other.path}"
                raise RequestError(f"{log.path} {twice}; held-out rows would also be training rows. Give it once.")


def reference(log: Log) -> Channel:
    """The channel at whose stamps the log was sampled: that of its odometry."""
    return next(log.channels[name] for name in ("u", "x", "psi") if name in log.channels)


def _needed(log: Log, vehicle: Vehicle | None) -> list[Channel]:
    wind = _WIND if set(_WIND) <= set(log.channels) else ()
    motion = [log.channels[name] for name in (*MOTION, *wind) if name in log.channels]
    return motion + [log.channels[name] for name in command_channels(vehicle)]


def _motions(
    log: Log,
    vehicle: Vehicle | None,
    recipe: Recipe,
    step: float,
    notes: list[str],
    choose: Callable[[list[Span]], list[Span]] = list,
) -> list[Motion]:
    spans, found = usable_spans(log, vehicle, recipe)
    notes += found
    short = shortfall(log, spans, found)
    if short:
        raise LogError(f"{log.path}: {short}")
    for name, origin in (("u", "x, y and psi"), ("v", "x, y and psi"), ("r", "psi"), ("x", "u, v and psi")):
        if name not in log.channels or (name == "x" and "y" not in log.channels):
            notes.append(f"{'position' if name == 'x' else name}: not in the log, derived from {origin}")
    if len(set(_WIND) & set(log.channels)) == 1:
        notes.append("wind_u and wind_v: only one of them is in the log, which is not used")
    anchors = reference(log).time
    motions = [motion_on(log, vehicle, recipe, span, even_grid(anchors, span, step), step) for span in choose(spans)]
    return [*motions[:1], *map(_remembering, motions, motions[1:])]


def _remembering(before: Motion, motion: Motion) -> Motion:
    """A motion that knows its past beyond a short gap, on a straight line between the rows at its ends."""
    if not 0.0 < motion.time[0] - before.time[-1] <= _BRIDGED:
        return motion
    times = motion.time[0] - motion.time_step * np.arange(round(RUN_UP / motion.time_step), 0, -1)
    turns = 2.0 * np.pi * np.round((before.heading[-1] - motion.heading[0]) / (2.0 * np.pi))
    ends = np.array([motion.heading[0] + turns, *motion.velocity[0]])
    rows = np.column_stack([before.heading, before.velocity])
    along = np.append(before.time, motion.time[0])
    found = [np.interp(times, along, np.append(column, end)) for column, end in zip(rows.T, ends, strict=True)]
    return replace(motion, past=np.column_stack(found)[times >= before.time[0]])


def motion_on(log: Log, vehicle: Vehicle | None, recipe: Recipe, span: Span, grid: Array, step: float) -> Motion:
    """The motion of a log on even stamps within a usable stretch.

    Parameters
    ----------
    log, vehicle, recipe : see `prepare`
    span : the stretch [s], of which all samples may be used
    grid, step : the stamps (n,) and their distance [s]
    """
    part = {channel.name: samples(channel, span) for channel in _needed(log, None)}
    psi_time, psi = part["psi"][0], np.unwrap(part["psi"][1])
    psi = psi - 2.0 * np.pi * np.round(psi[0] / (2.0 * np.pi))
    heading = np.interp(grid, psi_time, psi)
    rate = np.interp(grid, *part["r"]) if "r" in part else np.interp(grid, psi_time, derivative(psi_time, psi))
    surge, sway = _body_velocity(part, grid, heading)
    if "x" in part and "y" in part:
        position = np.column_stack([np.interp(grid, *part[name]) for name in ("x", "y")])
    else:
        position = integrated(np.column_stack(body_to_earth(heading, surge, sway)), step)
    air = None
    if "wind_u" in part:
        ahead, starboard = (np.interp(grid, *part[name]) for name in _WIND)
        air = np.column_stack(body_to_earth(heading, ahead + surge, starboard + sway))
    channels = [log.channels[name] for name in command_channels(vehicle)]
    earliest = max((float(channel.time[0]) for channel in channels), default=grid[0])
    steps_back = round(min(RUN_UP, max(grid[0] - earliest, 0.0)) / step)
    wide = grid[0] + step * np.arange(-steps_back, grid.size)
    averages = [area_average(c.time, c.value, wide, step, hold=recipe.commands == "hold") for c in channels]
    commands = np.column_stack(averages) if averages else np.zeros((wide.size, 0))
    return Motion(
        time=grid,
        position=position,
        heading=heading,
        velocity=np.column_stack((surge, sway, rate)),
        commands=commands[steps_back:],
        thrusters=tuple(thruster.name for thruster in vehicle.thrusters) if vehicle else (),
        source=str(log.path),
        run_up=commands[:steps_back] if steps_back else None,
        air=air,
        derived=_derived(log, part, step),
        understated=_understated(part, grid),
        command_step=command_step(channels),
        record_step=_record_steps(log),
        out_of_step=log.out_of_step,
        minutes=(grid - reference(log).time[0]) / 60.0,
    )


def _record_steps(log: Log) -> tuple[float, float, float]:
    """Time between two records of each velocity [s], or of what it is the derivative of."""
    pairs = (("u", "x"), ("v", "y"), ("r", "psi"))
    u, v, r = (next((log.channels[name].period for name in pair if name in log.channels), 0.0) for pair in pairs)
    return u, v, r


def _derived(log: Log, part: dict[str, tuple[Array, Array]], step: float) -> tuple[bool, bool, bool]:
    """Which velocities are differences of records at the steps of the grid, or slower; those of faster ones are not."""

    def at_pace(name: str) -> bool:
        return name in log.channels and log.channels[name].period / step - 1.0 >= -_AT_PACE

    place = at_pace("x")
    return "u" not in part and place, "v" not in part and place, "r" not in part and at_pace("psi")


def _understated(part: dict[str, tuple[Array, Array]], grid: Array) -> tuple[float, float, float]:
    """See `Motion.understated`; of velocities that are derivatives nothing is known."""
    u, v, r = (understated_noise(part[name][0], grid) if name in part else 1.0 for name in ("u", "v", "r"))
    return u, v, r


def _body_velocity(part: dict[str, tuple[Array, Array]], grid: Array, heading: Array) -> tuple[Array, Array]:
    if "u" in part and "v" in part:
        return np.interp(grid, *part["u"]), np.interp(grid, *part["v"])
    north, east = (np.interp(grid, part[name][0], derivative(*part[name])) for name in ("x", "y"))
    surge, sway = earth_to_body(heading, north, east)
    surge = np.interp(grid, *part["u"]) if "u" in part else surge
    sway = np.interp(grid, *part["v"]) if "v" in part else sway
    return surge, sway
