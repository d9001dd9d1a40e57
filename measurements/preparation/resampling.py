"""Resampling to an even time base: gaps, jumps of the position, stretches, stamps; smoothed velocities, accelerations.

Also the inputs of networks, standardised by mean and scale of the training part, which a small JSON file keeps. A
position jumps where a receiver changes its solution, or a filter sets its origin anew.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...physics.errors import RequestError
from ...physics.files import write_text
from ...physics.motion import Array, Motion
from ...physics.presentation import listing
from ..canonical import Channel
from ..statistics import signals as zero_phase

Span = tuple[float, float]

_LEAST_GAP = 0.5
"""Step that is always bridged [s]: in half a second a boat changes its speed little."""
_GAP_PERIODS = 5.0
"""Periods of a slow channel that are bridged: four rows may be lost."""
_SLOWEST = 1.1
"""Longest step of a rate [s]: of 1 Hz, with jitter."""


def gap_limit(channel: Channel, max_gap: float | None) -> float:
    """Return the longest bridged step of a channel [s]: `max_gap`, or the larger of 0.5 s and five sample periods."""
    return max_gap if max_gap is not None else max(_LEAST_GAP, _GAP_PERIODS * channel.period)


def is_logged_on_change(channel: Channel) -> bool:
    """True when a command was logged only when it changed, so that silence means "as before" and not a gap.

    Such a stream never repeats a value and has no beat: less than half of its steps are near the median step.
    """
    if channel.time.size < 3:
        return True
    steps = np.diff(channel.time)
    beat = np.mean(np.abs(steps / np.median(steps) - 1.0) < 0.5)
    repeats = np.mean(np.diff(channel.value) == 0.0)
    return bool(repeats < 0.01 and beat < 0.5)


def command_step(channels: Iterable[Channel]) -> float:
    """The longest time from one record to the next among commands that were logged at a rate [s]; else 0.

    Steps of more than a second are no rate but manoeuvres, of which only the changes were logged.
    """
    return max((c.period for c in channels if c.period <= _SLOWEST and not is_logged_on_change(c)), default=0.0)


def gaps(channel: Channel, limit: float) -> list[Span]:
    """Find the steps of a channel longer than `limit` [s], as (start, end)."""
    found = np.flatnonzero(np.diff(channel.time) > limit * (1.0 + 1e-9))
    return [(float(channel.time[i]), float(channel.time[i + 1])) for i in found]


def segments(start: float, end: float, holes: Sequence[Span]) -> list[Span]:
    """List the stretches of `start` to `end` [s] that no hole touches, in order.

    >>> segments(0.0, 10.0, [(4.0, 6.0), (5.0, 7.0)])
    [(0.0, 4.0), (7.0, 10.0)]
    """
    result = []
    for low, high in [*sorted(holes), (end, end)]:
        if start < min(low, end):
            result.append((start, min(low, end)))
        start = max(start, high)
    return result


def even_grid(anchors: Array, span: Span, step: float) -> Array:
    """Lay even stamps of `step` [s] within `span`, from the first of the stamps `anchors` that lies in it.

    Parameters
    ----------
    anchors : stamps [s]
    span : begin and end [s]
    step : [s]
    """
    start, end = span
    first = np.searchsorted(anchors, start - 1e-9)
    origin = float(anchors[first]) if first < anchors.size and anchors[first] <= end else start
    count = max(0, int(np.floor((end - origin) / step + 1e-6)) + 1)
    return origin + step * np.arange(count, dtype=np.float64)


def samples(channel: Channel, span: Span) -> tuple[Array, Array]:
    """Return the samples of a channel from the last before `span` to the first after it."""
    start, end = span
    first = max(0, int(np.searchsorted(channel.time, start, "right")) - 1)
    last = min(channel.time.size, int(np.searchsorted(channel.time, end, "left")) + 1)
    return channel.time[first:last], channel.value[first:last]


def derivative(time: Array, value: Array) -> Array:
    """Central differences at uneven stamps; (n,) per second."""
    if time.size < 2:
        return np.zeros(time.size)
    return np.gradient(value, time)


def smooth(motion: Motion, cutoff: float, order: int = 4) -> Motion:
    """Low-pass the velocities of a motion by a zero-phase Butterworth filter (forward and backward).

    Position, heading and commands stay as they are. A model's force that is compared with these velocities has to
    go through the same filter.

    Parameters
    ----------
    motion : the motion
    cutoff : -3 dB frequency of one pass [Hz]
    order : of one pass

    Raises
    ------
    RequestError
        when the cutoff is not below half the motion's rate.
    """
    velocity = low_pass(motion.velocity, motion.time_step, cutoff, order)
    return replace(motion, velocity=velocity)


def low_pass(values: Array, step: float, cutoff: float, order: int = 4) -> Array:
    """Zero-phase Butterworth low-pass along the first axis of `values` (n, ...) sampled every `step` [s].

    Parameters
    ----------
    values : (n, ...)
    step : [s]
    cutoff : [Hz]
    order : of the filter, one way

    Raises
    ------
    RequestError
        when the cutoff [Hz] is not below half the rate.
    """
    rate = 1.0 / step
    if not 0.0 < cutoff < rate / 2:
        raise RequestError(
            f"a low-pass at {cutoff:g} Hz needs a rate above {2 * cutoff:g} Hz, got {rate:g} Hz; lower the cutoff."
        )
    # Three periods of the cutoff let the filter settle before the first row.
    padding = min(values.shape[0] - 1, int(np.ceil(3.0 * rate / cutoff)))
    return zero_phase.low_pass(values, step, cutoff, order, padding)


def accelerations(motion: Motion) -> Array:
    """Rates of change of u, v [m/s^2] and r [rad/s^2], (n, 3): central differences, one-sided at both ends."""
    edge = 2 if motion.time.size > 2 else 1
    return np.gradient(motion.velocity, motion.time_step, axis=0, edge_order=edge)


def feature_names(motion: Motion) -> tuple[str, ...]:
    """Name the columns of `features`."""
    return ("u", "v", "r", "cos_psi", "sin_psi", *(f"command_{name}" for name in motion.thrusters))


def features(motion: Motion) -> Array:
    """Inputs of a network, (n, 5 + thrusters): u, v [m/s], r [rad/s], cos psi, sin psi, commands [their unit]."""
    heading = motion.heading
    return np.column_stack((motion.velocity, np.cos(heading), np.sin(heading), motion.commands))


_LEAST = 50
"""Fixes from which the usual step can be told."""
_NOISE = 10.0
"""Times the median change from step to step that a jump has: white noise reaches four of it."""
_FIXES, _SECONDS = 3.0, 1.0
"""A jump is farther than the boat goes at its top speed in three fixes, and in a second: noise and a late fix move it
by one fix, and what it goes in a second is the way over which speeds are told."""
_NEAR = 10
"""Steps before and after one that tell how fast the boat goes."""
_BACK = 60.0
"""Longest time after which a jump back ends an excursion [s]; later, both stand for themselves."""
_HALF = 0.5
"""Share of a jump within which another one takes it back."""
_TOLD = 3
"""Jumps that a sentence lists."""


@dataclass(frozen=True, slots=True)
class Jump:
    """A jump of the position.

    Attributes
    ----------
    before, after : stamps of the last fix before it and of the first one on the old track again, or on the new one [s]
    north, east : by how much [m]
    step : time from the fix before to the one after the jump [s]
    returns : whether the position comes back at `after`
    """

    before: float
    after: float
    north: float
    east: float
    step: float
    returns: bool = False

    @property
    def size(self) -> float:
        """How far [m]."""
        return float(np.hypot(self.north, self.east))

    @property
    def sentence(self) -> str:
        """What happened, for a list.

        >>> Jump(9.95, 10.0, 60.0, 0.0, 0.05).sentence
        '60 m at t = 9.95 s, in 0.05 s (1200 m/s)'
        """
        text = f"{self.size:.3g} m at t = {self.before:.2f} s, in {self.step:.2g} s ({self.size / self.step:.4g} m/s)"
        return f"{text}, and back after {self.after - self.before:.3g} s" if self.returns else text


def new_positions(channels: Mapping[str, Channel]) -> tuple[NDArray[np.int64], Array, Array] | None:
    """Rows at which a new position appears (k,), their stamps [s], and the positions (k, 2) [m].

    None without positions, or where x and y do not come together.
    """
    if not {"x", "y"} <= set(channels):
        return None
    x, y = channels["x"], channels["y"]
    if not x.time.size or not np.array_equal(x.time, y.time):
        return None
    row = np.flatnonzero(np.append(True, (np.diff(x.value) != 0.0) | (np.diff(y.value) != 0.0)))
    return row, x.time[row], np.column_stack([x.value[row], y.value[row]])


def jumps_of(channels: Mapping[str, Channel]) -> tuple[Jump, ...]:
    """Find the jumps in the positions of a log, in their order; none without positions that come together.

    Steps over a gap are none: the log is cut there anyway.
    """
    found = new_positions(channels)
    if found is None or found[0].size < _LEAST:
        return ()
    _, time, place = found
    steps, taken = np.diff(place, axis=0), np.diff(time)
    size = np.hypot(*steps.T)
    noise = float(np.median(np.hypot(*np.diff(steps, axis=0).T)))
    top = _top_speed(time, place)
    far = size > np.maximum(_NOISE * noise, top * np.maximum(_SECONDS, _FIXES * taken))
    far &= taken <= gap_limit(channels["x"], None)
    at = [row for row in np.flatnonzero(far).tolist() if _alone(size / taken, row)]
    return tuple(_sentence(at, steps, time))


def _alone(speed: Array, row: int) -> bool:
    """True when a step is far quicker than those beside it: a boat that mostly drifts may go as fast for a while."""
    near = np.concatenate([speed[max(row - _NEAR, 0) : row], speed[row + 1 : row + 1 + _NEAR]])
    return bool(speed[row] > _FIXES * np.median(near))


def _top_speed(time: Array, place: Array) -> float:
    """Speed that is exceeded in a tenth of the windows of a second [m/s]: a boat that spins goes nowhere in more."""
    later = np.searchsorted(time, time + _SECONDS)
    known = later < time.size
    if not known.any():
        return float(np.hypot(*(place[-1] - place[0])) / max(time[-1] - time[0], 1e-9))
    rows, ends = np.flatnonzero(known), later[known]
    return float(np.quantile(np.hypot(*(place[ends] - place[rows]).T) / (time[ends] - time[rows]), 0.9))


def _sentence(at: Sequence[int], steps: Array, time: Array) -> list[Jump]:
    result: list[Jump] = []
    open_row: int | None = None
    for row in at:
        north, east = steps[row]
        one = Jump(float(time[row]), float(time[row + 1]), float(north), float(east), float(time[row + 1] - time[row]))
        soon = open_row is not None and time[row] - time[open_row] <= _BACK
        if open_row is not None and soon and np.hypot(*(steps[row] + steps[open_row])) < _HALF * result[-1].size:
            last = result.pop()
            if row != open_row + 1:  # else a single value: no jump, but a spike
                result.append(replace(last, after=one.after, returns=True))
            open_row = None
        else:
            result.append(one)
            open_row = row
    return result


def jumps_in_words(jumps: Sequence[Jump]) -> str:
    """Say what positions do, as a sentence without an end."""
    told = listing([jump.sentence for jump in jumps[:_TOLD]])
    more = f", and {len(jumps) - _TOLD} times more" if len(jumps) > _TOLD else ""
    return f"the positions jump: {told}{more}"


def without_jumps(channels: Mapping[str, Channel], jumps: Sequence[Jump]) -> dict[str, Channel]:
    """The channels without the positions of excursions, and with a gap at each jump, at which every reader cuts."""
    x = channels["x"]
    half = 0.55 * gap_limit(x, None)
    keep = np.ones(x.time.size, dtype=bool)
    for jump in jumps:
        middle = 0.5 * (jump.before + jump.after)
        reach = max(half, middle - jump.before)
        keep &= np.abs(x.time - middle) >= reach
        keep &= ~((x.time > jump.before) & (x.time < jump.after))
    return {**channels, "x": x.rows(keep), "y": channels["y"].rows(keep)}


SCHEMA = "undertow.standardisation/1"


@dataclass(frozen=True, slots=True, eq=False)
class Standardisation:
    """Shift and scale of each feature.

    Attributes
    ----------
    names : of the features
    mean, scale : (features,) in the units of the features; a constant feature has the scale 1
    """

    names: tuple[str, ...]
    mean: Array
    scale: Array

    @classmethod
    def fit(cls, training: Sequence[Motion]) -> "Standardisation":
        """Mean and standard deviation of the features of the training motions, and of nothing else.

        Raises
        ------
        RequestError
            when there is no motion, or the motions differ in their thrusters.
        """
        if not training:
            raise RequestError("standardisation: expected at least one training motion, got none.")
        names = {feature_names(motion) for motion in training}
        if len(names) > 1:
            raise RequestError(f"standardisation: the motions differ in their features: {sorted(names)}.")
        return cls.of(names.pop(), np.concatenate([features(motion) for motion in training]))

    @classmethod
    def of(cls, names: Sequence[str], values: Array) -> "Standardisation":
        """Mean and standard deviation of the columns of `values` (n, features), which are called `names`.

        Raises
        ------
        RequestError
            when there is no row, a name too few or too many, or a value that is not finite.
        """
        values = np.asarray(values, dtype=float)
        if values.ndim != 2 or values.shape[1] != len(names) or not values.shape[0]:
            raise RequestError(f"standardisation: expected rows of {len(names)} features, got shape {values.shape}.")
        if not np.isfinite(values).all():
            broken = [name for name, column in zip(names, values.T, strict=True) if not np.isfinite(column).all()]
            raise RequestError(f"standardisation: expected finite numbers, got others in {', '.join(broken)}.")
        spread = values.std(axis=0)
        constant = spread <= 1e-12 * np.maximum(1.0, np.abs(values).max(axis=0))
        return cls(tuple(names), values.mean(axis=0), np.where(constant, 1.0, spread))

    def apply(self, values: Array) -> Array:
        """Features (n, f) to zero mean and unit scale."""
        return (values - self.mean) / self.scale

    def undo(self, values: Array) -> Array:
        """Standardised features (n, f) back to their units."""
        return values * self.scale + self.mean

    def write(self, path: Path | str) -> None:
        """Write strict JSON to a temporary name beside `path`, then rename it."""
        rows = zip(self.names, self.mean.tolist(), self.scale.tolist(), strict=True)
        features = [{"name": name, "mean": mean, "scale": scale} for name, mean, scale in rows]
        write_text(path, json.dumps({"schema": SCHEMA, "features": features}, indent=1, allow_nan=False) + "\n")
