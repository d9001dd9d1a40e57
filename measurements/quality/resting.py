"""What a command is while the boat lies at rest: its neutral, from which every command is counted."""

from collections.abc import Sequence

import numpy as np

from ...physics.motion import Array
from .record import RATE, Record, shared

_SLOW = 0.1
"""Share of its top speed, and of its top yaw rate, below which a boat lies at rest."""
_SLOW_FLOOR = (0.1, 0.03)
"""Speed [m/s] and yaw rate [rad/s] below which any boat lies at rest, however slow its top."""
_SETTLED = 2.0
"""A command that is neutral stays for this long [s]."""
_LEAST = 3.0
"""Rest from which a neutral can be told [s]."""
_SAME = 0.6
"""Share of the rest during which the command must be the same."""
_DIGITS = 1e-6
"""Share of the largest command by which its means over steps may differ from each other by rounding, as in
`quick_motion`."""


def neutral_of(records: Sequence[Record], name: str) -> float | None:
    """The value at which a command stays while the boat lies at rest, in its unit; None where that is not seen."""
    return shared(records, ("neutral", name), lambda: _neutral(records, name)) if records else None


def _neutral(records: Sequence[Record], name: str) -> float | None:
    rest = [one for record in records if (one := _resting(record, name)).size]
    values = np.concatenate(rest) if rest else np.zeros(0)
    if values.size < RATE * _LEAST:
        return None
    _, which, counts = np.unique(np.rint(values / _rounding(records, name)), return_inverse=True, return_counts=True)
    best = int(np.argmax(counts))
    return float(np.median(values[which == best])) if counts[best] >= _SAME * values.size else None


def centre_of(records: Sequence[Record], name: str) -> float:
    """The neutral of a command, or its median where no rest shows it, in its unit."""
    neutral = neutral_of(records, name)
    if neutral is not None:
        return neutral
    values = [record.log.channels[name].value for record in records if name in record.log.channels]
    return float(np.median(np.concatenate(values)))


def stands_still(records: Sequence[Record], name: str) -> bool:
    """Whether a command has one value in all rows of all logs."""
    values = [record.log.channels[name].value for record in records if name in record.log.channels]
    ends = max(float(value.max()) for value in values) - min(float(value.min()) for value in values)
    return ends <= _rounding(records, name)


def _rounding(records: Sequence[Record], name: str) -> float:
    """Difference between values of a command that is none, in its unit."""
    sizes = [np.abs(record.log.channels[name].value).max() for record in records if name in record.log.channels]
    return _DIGITS * float(max(sizes)) or 1.0


def _resting(record: Record, name: str) -> Array:
    """Values of a command (m,) where the boat lies at rest and the command has been steady for a while."""
    if name not in record.commands:
        return np.zeros(0)
    column = record.commands.index(name)
    speeds = [np.abs(s.motion.velocity) for s in record.stretches]
    if not speeds:
        return np.zeros(0)
    top = np.quantile(np.concatenate(speeds), 0.99, axis=0)
    found, rounding = [], _rounding([record], name)
    for stretch, speed in zip(record.stretches, speeds, strict=True):
        command = stretch.commands[:, column]
        window = max(1, round(_SETTLED / stretch.motion.time_step))
        same = np.concatenate(([0], np.cumsum(~(np.abs(np.diff(command)) <= rounding))))
        steady = np.zeros(command.size, dtype=bool)
        steady[window:] = same[window:] == same[:-window]
        still = (np.hypot(speed[:, 0], speed[:, 1]) < max(_SLOW * np.hypot(*top[:2]), _SLOW_FLOOR[0])) & (
            speed[:, 2] < max(_SLOW * top[2], _SLOW_FLOOR[1])
        )
        found.append(command[steady & still & np.isfinite(command)])
    return np.concatenate(found)
