"""Quick motion, in which a boat answers its thrusters, and the neutral of a command: its value while the boat rests."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...physics.forces import modelled_acceleration
from ...physics.momentum_balance import mass_matrix, push_of
from ...physics.motion import Array, Motion
from ...physics.thrusters import command_of
from ...physics.vehicle import Vehicle
from ..statistics.signals import band_passed, integrated, noise_level
from .record import AT_REST, RATE, STEP, Record, Stretch, command_names, computed_once, values_called

_SLOW_FLOOR = (0.1, 0.03)
"""Speed [m/s] and yaw rate [rad/s] below which any boat lies at rest, however slow its top."""
_SETTLED = 2.0
"""A command that is neutral stays for this long [s]."""
_LEAST = 3.0
"""Rest from which a neutral can be told [s]."""
_SAME = 2.0 / 3.0
"""Share of the rest during which the command must be the same: twice as long as at all other values together, at which
a boat may hardly move for a while. Of 2,833 sound logs 0.6 accused two, and this none (`benchmarks/sound_logs.py`)."""
_DIGITS = 1e-6
"""Share of the largest command by which its means over steps may differ from each other by rounding, as in
`quick_motion`."""


def neutral_of(records: Sequence[Record], name: str) -> float | None:
    """The value at which a command stays while the boat lies at rest, in its unit; None where that is not seen."""
    return computed_once(records, ("neutral", name), lambda: _neutral(records, name)) if records else None


def _neutral(records: Sequence[Record], name: str) -> float | None:
    values = np.concatenate([_resting(record, name) for record in records])
    if not values.size:
        return None
    _, which, counts = np.unique(np.rint(values / _rounding(records, name)), return_inverse=True, return_counts=True)
    best = int(np.argmax(counts))
    return float(np.median(values[which == best])) if counts[best] >= max(RATE * _LEAST, _SAME * values.size) else None


def centre_of(records: Sequence[Record], name: str) -> float:
    """The neutral of a command, or its median where no rest shows it, in its unit."""
    neutral = neutral_of(records, name)
    if neutral is not None:
        return neutral
    return float(np.median(values_called(records, name)))


def stands_still(records: Sequence[Record], name: str) -> bool:
    """True when a command has one value in all rows of all logs."""
    return bool(np.ptp(values_called(records, name)) <= _rounding(records, name))


def _rounding(records: Sequence[Record], name: str) -> float:
    """Difference between values of a command that is none, in its unit."""
    return _DIGITS * float(np.abs(values_called(records, name)).max()) or 1.0


def _resting(record: Record, name: str) -> Array:
    """Values of a command (m,) where the boat lies at rest and the command has been steady for a while."""
    if name not in record.commands or not record.stretches:
        return np.zeros(0)
    column = record.commands.index(name)
    speeds = [np.abs(s.motion.velocity) for s in record.stretches]
    top = np.quantile(np.concatenate(speeds), 0.99, axis=0)
    found, rounding = [], _rounding([record], name)
    for stretch, speed in zip(record.stretches, speeds, strict=True):
        command = stretch.commands[:, column]
        window = max(1, round(_SETTLED / stretch.motion.time_step))
        same = np.concatenate(([0], np.cumsum(~(np.abs(np.diff(command)) <= rounding))))
        steady = np.zeros(command.size, dtype=bool)
        steady[window:] = same[window:] == same[:-window]
        still = np.hypot(speed[:, 0], speed[:, 1]) < max(AT_REST * np.hypot(*top[:2]), _SLOW_FLOOR[0])
        still &= speed[:, 2] < max(AT_REST * top[2], _SLOW_FLOOR[1])
        found.append(command[steady & still & np.isfinite(command)])
    return np.concatenate(found)


QUICK = (0.15, 2.0)
"""The band in which a boat answers its thrusters and hull forces change little [Hz]."""
_EDGE = 1.0
"""Time around each change of a command that is left out [s]: thrusters answer late."""
LEAST = 15.0
"""Time that a command must stand still for its record to be judged [s]."""
_LONG = 10.0
"""Time from which a command stands still for longer than a manoeuvre's step takes [s]."""


@dataclass(frozen=True, slots=True)
class Part:
    """One stretch, band-passed.

    Attributes
    ----------
    speeds : (n, 2) of surge [m/s] and yaw [rad/s], not band-passed
    rates : (n, 2) accelerations of surge [m/s^2] and yaw [rad/s^2]
    left : (n, 2) the same less what the vehicle, or in its absence nothing, says
    states : (n, 5) what hull forces are made of, for each axis
    commands : (n, c) deviations from neutral, as shares of the largest
    noise : (2,) what the sensors' noise makes of the accelerations
    modelled : the vehicle says what its thrusters make of these commands
    cut : whether the log goes on after it, in what is not looked at
    stands, long : (n, c) whether each command stands still, away from its changes, at all and for 10 s or more
    pushes : (n, c, 2) accelerations of surge and yaw that the vehicle's thruster of each command makes; 0 without one
    """

    speeds: Array
    rates: Array
    residual: Array
    states: tuple[Array, Array]
    commands: Array
    noise: Array
    modelled: bool
    cut: bool
    stands: NDArray[np.bool_]
    long: NDArray[np.bool_]
    pushes: Array


def parts_of(
    records: Sequence[Record], band: tuple[float, float] = QUICK
) -> tuple[list[Record], list[str], list[Part]]:
    """The records that have all commands and no rudder, those commands, and the stretches that are long enough."""
    names = command_names(records)
    # What a rudder does, thrusters that stand still do not explain.
    having = [record for record in records if set(names) <= set(record.commands) and not record.steered]
    names = _judged(having, names)
    pairs = [(record, stretch) for record in having for stretch in record.stretches] if names else []
    made = [part for pair in pairs if (part := _part(*pair, names, band)) is not None]
    # One size for all stretches: a gentle one is no full command.
    size = np.max([np.abs(part.commands).max(axis=0) for part in made], axis=0) if made else np.ones(len(names))
    size = np.where(size > 0.0, size, 1.0)
    return having, names, [replace(part, commands=part.commands / size) for part in made]


def _judged(records: Sequence[Record], names: list[str]) -> list[str]:
    """Commands of the vehicle's own thrusters, or all where there is none."""
    wanted = {t.channel for record in records if record.vehicle for t in record.vehicle.thrusters}
    return [name for name in names if name in wanted] if wanted & set(names) else names


def _part(record: Record, stretch: Stretch, names: list[str], band: tuple[float, float]) -> Part | None:
    motion = stretch.motion
    columns = stretch.commands[:, [record.commands.index(name) for name in names]]
    if motion.time.size < round(LEAST * RATE) or not np.isfinite(columns).all():
        return None
    commands = columns - np.array([centre_of([record], name) for name in names])
    surge, sway, rate = motion.velocity.T
    driven = record.driven(stretch)
    modelled = np.zeros((motion.time.size, 2))
    pushes = np.zeros((motion.time.size, len(names), 2))
    if driven is not None and record.vehicle is not None:
        modelled = modelled_acceleration(record.vehicle, driven)[:, [0, 2]]
        pushes = pushes_of(record.vehicle, driven, names)[1]
    hull = (
        np.column_stack([surge, surge * np.abs(surge), sway * rate, rate * rate]),
        np.column_stack([rate, rate * np.abs(rate), np.abs(surge) * rate, surge * sway, surge * rate]),
    )
    passed = band_passed(np.column_stack([*hull, pushes.reshape(motion.time.size, -1)]), STEP, band)
    return Part(
        motion.velocity[:, [0, 2]],
        rates_in_band(motion.velocity[:, [0, 2]], np.zeros_like(modelled), band),
        rates_in_band(motion.velocity[:, [0, 2]], modelled, band),
        (passed[:, :4], passed[:, 4:9]),
        commands,
        _white(record, motion, band),
        driven is not None,
        stretch.portion.cut,
        *_stands(columns),
        passed[:, 9:].reshape(pushes.shape),
    )


def rates_in_band(velocity: Array, modelled: Array, band: tuple[float, float]) -> Array:
    """Rates of velocities (n, k) less modelled ones (n, k), in a band [Hz].

    Velocities are filtered, and rates taken after that: a filter goes on beyond the ends of a log from its last row,
    and the noise of the last rate, far above that of the last velocity, would ring on in it for 1 / band[0].

    Parameters
    ----------
    velocity : measured (n, k)
    modelled : rates (n, k)
    band : its ends [Hz]
    """
    return np.gradient(band_passed(velocity - integrated(modelled, STEP), STEP, band), STEP, axis=0)


def pushes_of(vehicle: Vehicle, motion: Motion, names: Sequence[str]) -> tuple[Array, Array]:
    """Accelerations of surge and yaw along a motion, by the vehicle: without thrust (n, 2), and by each thruster.

    Parameters
    ----------
    names : of the commands, the second axis of the accelerations (n, c, 2) that the thrusters make
    """
    scales = {thruster.channel: f"{thruster.name}_scale" for thruster in vehicle.thrusters}
    without = vehicle.with_values(dict.fromkeys(scales.values(), 0.0))
    rest, result = modelled_acceleration(without, motion)[:, [0, 2]], np.zeros((motion.time.size, len(names), 2))
    for place, name in enumerate(names):
        if name in scales:
            alone = without.with_values({scales[name]: vehicle.value(scales[name])})
            result[:, place] = modelled_acceleration(alone, motion)[:, [0, 2]] - rest
    return rest, result


def push_range(records: Sequence[Record], name: str) -> tuple[float, Array]:
    """How far the push of a command's thruster may stray from its mean [N], and accelerations that a newton makes (2,).

    No series that stays between two ends strays by more than half of what is between them (Popoviciu).
    """
    vehicle = next(r.vehicle for r in records if r.vehicle and name in {t.channel for t in r.vehicle.thrusters})
    thruster = next(one for one in vehicle.thrusters if one.channel == name)
    ends = thruster.scale * thruster.curve.thrust(command_of(thruster, np.array([-1.0, 1.0])), thruster.command)
    made = np.linalg.solve(mass_matrix(vehicle), np.array(push_of(thruster)))
    return 0.5 * abs(float(np.diff(ends)[0])), np.array([float(made[0]), float(made[2])])


def _white(record: Record, motion: Motion, band: tuple[float, float]) -> Array:
    """Root mean square of what white noise on the speeds makes of accelerations of surge and yaw in the band, (2,).

    It is white at the rate at which it was recorded: a record of 10 Hz on the time base of 20 Hz bends at every second
    row only, and its differences there show a fifth of it.
    """
    found = []
    for column, name in ((0, "u"), (2, "r")):
        noise = [_of_rates(noise_level(motion.velocity[:, column]) or 0.0, RATE, band)]
        channel = record.log.channels.get(name)
        if channel is not None and channel.period > 0.0:
            noise.append(_of_rates(noise_level(channel.value) or 0.0, 1.0 / channel.period, band))
        if channel is None and name == "u":
            places = [record.log.channels[place] for place in ("x", "y") if place in record.log.channels]
            noise += [_of_rates(_of_places(one.value), 1.0 / one.period, band, 2) for one in places if one.period > 0.0]
        found.append(max(noise))
    return np.array(found)


def _of_places(values: Array) -> float:
    """White noise of positions (n,) [m], at least that of their last digit, which is evenly spread over it."""
    steps = np.abs(np.diff(values))
    digit = float(np.min(steps[steps > 0.0], initial=np.inf))
    return max(noise_level(values) or 0.0, digit / np.sqrt(12.0) if np.isfinite(digit) else 0.0)


def _of_rates(level: float, rate: float, band: tuple[float, float], times: int = 1) -> float:
    """Root mean square in a band of white noise that was recorded `rate` times a second, differentiated some times."""
    low, high = band[0], min(band[1], 0.5 * rate)
    # White noise of one sample's variance is spread evenly up to half the rate; each derivative is 2 pi f as large.
    power = 2 * times + 1
    return level * (2.0 * np.pi) ** times * float(np.sqrt(max(high**power - low**power, 0.0) / power / (0.5 * rate)))


def _stands(commands: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether each command is the same for a second before and after each row, and for 10 s around it, (n, c) each."""
    size = np.abs(commands).max(axis=0)
    moves = np.abs(np.diff(commands, axis=0, prepend=commands[:1])) > 1e-6 * np.where(size > 0.0, size, 1.0)
    reach, rows = round(_EDGE * RATE), commands.shape[0]
    stands, long = np.zeros(commands.shape, dtype=bool), np.zeros(commands.shape, dtype=bool)
    for k in range(commands.shape[1]):
        ends = np.concatenate(([0], np.flatnonzero(moves[:, k]), [rows]))
        for first, last in pairwise(ends.tolist()):
            # At the ends of the log no change is known, and none is left out.
            inner = slice(first + reach if first else 0, max(last - reach if last < rows else rows, 0))
            stands[inner, k] = True
            long[inner, k] = last - first >= _LONG * RATE
    return stands, long


def unexplained(parts: Sequence[Part], rows: Sequence[NDArray[np.bool_]]) -> Array:
    """What hull forces, fitted there, do not explain of `left` in some rows, (m, 2)."""
    found = []
    for axis in range(2):
        table, target = (
            np.concatenate([one[use] for one, use in zip(every, rows, strict=True)])
            for every in ([part.states[axis] for part in parts], [part.residual[:, axis] for part in parts])
        )
        found.append(target - table @ np.linalg.lstsq(table, target, rcond=1e-6)[0])
    return np.column_stack(found)
