"""Resampling to an even time base (gaps, stretches, stamps); smoothed velocities, accelerations, network inputs."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...physics.errors import RequestError
from ...physics.motion import Array, Motion
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
    for low, high in sorted(holes):
        if high <= start:
            continue
        if low > start:
            result.append((start, min(low, end)))
        start = max(start, high)
        if start >= end:
            break
    if start < end:
        result.append((start, end))
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


def stacked(motions: Sequence[Motion]) -> Array:
    """Stack the features of several motions, one below the other."""
    return np.concatenate([features(motion) for motion in motions])
