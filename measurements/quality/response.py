"""How surge and yaw answer each command: the signs tell which way a thruster pushes, and on which side it sits."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...physics.frames import Array
from ..alignment import band_passed
from ..channels import command_kind
from .neutral import centre_of
from .record import RATE, Record
from .regression import Fit, robust_fit

_STEP = 1.0 / RATE
_QUICK, _DERIVED = (0.2, 2.0), (0.1, 1.0)
"""The band in which a boat answers its thrusters and drag has little say [Hz]; a slower one for speeds that are made of
positions, whose noise grows with frequency."""
_LEAST_BLOCKS = 8
_LEAST_ROWS = 200
_TIMES = 5.0
"""Standard errors from which a sign is certain."""
_SHARE = 0.15
"""Share of the record's size that a command must make: below, what else moves the boat may be what is seen. Thrusters
that drive the boat make two to four times as much, a propeller that was switched on once a tenth."""
_ALONE = 0.1
"""Share of a command's changes that no other command makes, from which its own effect can be told."""


@dataclass(frozen=True, slots=True)
class Answer:
    """How the boat answers one command that moves from neutral to its end.

    Attributes
    ----------
    surge, surge_error : [m/s^2] and its standard error
    yaw, yaw_error : [rad/s^2] and its standard error
    """

    surge: float
    surge_error: float
    yaw: float
    yaw_error: float

    @property
    def ahead(self) -> int:
        """1 where more of the command pushes ahead, -1 where it pushes astern, 0 where that is not certain."""
        return _sign(self.surge, self.surge_error)

    @property
    def turns(self) -> bool:
        """Whether the command is certain to turn the boat."""
        return _sign(self.yaw, self.yaw_error) != 0

    @property
    def side(self) -> str:
        """The side on which the thruster sits: pushing ahead, one at port turns the boat to starboard; or empty."""
        turn = _sign(self.yaw, self.yaw_error) * self.ahead
        return {1: "port", -1: "starboard"}.get(turn, "")


def answers(records: Sequence[Record]) -> dict[str, Answer]:
    """Fit the boat's answer to its commands, in the band of 0.2 to 2 Hz (0.1 to 1 Hz for speeds made of positions).

    Commands of one kind are fitted together. One that only ever moves with another is left out, and so is everything
    where there are fewer than eight stretches of the slowest period in the band. The error is infinite where a command
    makes too little of what the boat does.
    """
    found: dict[str, Answer] = {}
    names = sorted({name for record in records for name in record.commands})
    for kind in sorted({(command_kind(name) or ("",))[0] for name in names}):
        found |= _of_kind(records, [name for name in names if (command_kind(name) or ("",))[0] == kind])
    return found


def _of_kind(records: Sequence[Record], names: list[str]) -> dict[str, Answer]:
    centre = {name: centre_of(records, name) for name in names}
    measured = all("u" in record.log.channels for record in records)
    band = _QUICK if measured else _DERIVED
    tables, stretches, begun = [], [], 0
    for record in records:
        if not set(names) <= set(record.commands):
            continue
        columns = [record.commands.index(name) for name in names]
        for one in record.stretches:
            commands = one.commands[:, columns] - np.array([centre[name] for name in names])
            if one.motion.time.size < _LEAST_ROWS or not np.isfinite(commands).all():
                continue
            surge, _, rate = one.motion.velocity.T
            drag = np.column_stack([surge, surge * np.abs(surge), rate, np.abs(surge) * rate, np.abs(rate) * rate])
            changes = np.column_stack([np.gradient(surge, _STEP), np.gradient(rate, _STEP)])
            table = np.column_stack([changes, commands, drag])
            tables.append(band_passed(table, _STEP, band))
            number = ((one.motion.time - one.motion.time[0]) * band[0]).astype(np.int64)
            stretches.append(begun + number)
            begun += int(number[-1]) + 1
    if begun < _LEAST_BLOCKS:
        return {}
    table, stretch = np.concatenate(tables), np.concatenate(stretches)
    commands, drag = table[:, 2 : 2 + len(names)], table[:, 2 + len(names) :]
    told = [k for k in range(len(names)) if _alone(commands, k)]
    if len(told) < len(names) or not told:
        return {}
    surge = robust_fit(np.column_stack([commands, drag[:, :2]]), table[:, 0], stretch)
    yaw = robust_fit(np.column_stack([commands, drag[:, 2:]]), table[:, 1], stretch)
    size = np.sqrt((table**2).mean(axis=0))
    found = {}
    for k, name in enumerate(names):
        values = [record.log.channels[name].value for record in records if name in record.log.channels]
        full = max(float(np.abs(value - centre[name]).max()) for value in values)
        parts = [_coefficient(fit, k, size[2 + k] / size[row]) for row, fit in enumerate((surge, yaw))]
        found[name] = Answer(*(full * number for part in parts for number in part))
    return found


def _coefficient(fit: Fit, place: int, size: float) -> tuple[float, float]:
    """A coefficient and its error, for a command of `size` times the record's."""
    value = float(fit.values[place])
    return value, float(fit.errors[place]) if abs(value) * size >= _SHARE else np.inf


def _alone(commands: Array, place: int) -> bool:
    """Whether a command moves enough on its own for its effect to be told from the others'."""
    own = commands[:, place]
    power = float(own @ own)
    if power <= 0.0:
        return False
    others = np.delete(commands, place, axis=1)
    if others.shape[1]:
        own = own - others @ np.linalg.lstsq(others, own, rcond=None)[0]
    return float(own @ own) >= _ALONE * power


def _sign(value: float, error: float) -> int:
    return int(np.sign(value)) if abs(value) > _TIMES * error else 0
