"""A log under examination: its channels as repaired so far, and the motions that they make."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from ...physics.errors import LogError
from ...physics.motion import Array, Motion
from ...physics.sampled_series import area_average
from ...physics.vehicle import Vehicle
from ..canonical import Channel, command_kind
from ..log import Log
from ..preparation.dataset import Recipe
from ..preparation.prepare import motions_within
from ..preparation.resampling import Span, samples
from .portion import Portion, looked_at

_T = TypeVar("_T")

RATE = 20.0
"""Of the even time base on which channels are compared [Hz]; one for all logs, so that they can be pooled."""
_MOST = 0.5
"""Share of a stretch in which a record must have values to be compared at all."""
_EVEN = Recipe(rate=RATE, cutoff=None)


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A motion and all commands on its time base.

    Attributes
    ----------
    motion : without commands
    commands : (n, commands) in the units of their channels, means over each step; NaN outside a channel's stamps
    portion : of a long log that it is
    """

    motion: Motion
    commands: Array
    portion: Portion


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """A log under examination.

    Attributes
    ----------
    log : with the channels as the checks before left them
    stretches : its motions at 20 Hz, of a long log only those that `looked_at` chooses; none where the log
        makes none
    commands : names of the command channels, the columns of `Stretch.commands`
    why_not : why the log makes no motion; empty where it does
    vehicle : the nominal model, which says what the commands should do; None where there is none
    known : what one check computed and others need too, see `shared`
    """

    log: Log
    stretches: tuple[Stretch, ...]
    commands: tuple[str, ...]
    why_not: str = ""
    vehicle: Vehicle | None = None
    known: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, log: Log, vehicle: Vehicle | None = None) -> "Record":
        """Examine a log as it is."""
        names = tuple(name for name in log.channels if command_kind(name))
        portions: list[Portion] = []

        def choose(spans: list[Span]) -> list[Span]:
            portions.extend(looked_at(log, spans))
            return [portion.span for portion in portions]

        try:
            motions = motions_within(log, _EVEN, choose)
        except LogError as error:
            return cls(log, (), names, error.typed.removeprefix(f"{log.path}: "), vehicle)
        channels = [log.channels[name] for name in names]
        last = [float(channel.time[-1]) + 2.0 * channel.period for channel in channels]
        stretches = tuple(
            _stretch(motion, _commands(channels, last, motion), portion.of(motion.duration))
            for motion, portion in zip(motions, portions, strict=True)
        )
        return cls(log, stretches, names, "", vehicle)

    @property
    def steered(self) -> tuple[str, ...]:
        """What steers beside the thrusters, such as a rudder, which no vehicle file has."""
        found = self.log.auxiliary.items()
        return tuple(sorted(channel.origin for name, channel in found if name.startswith("steering")))

    def repaired(self, channels: Mapping[str, Channel]) -> "Record":
        """The same log with other channels."""
        return Record.of(replace(self.log, channels=dict(channels)), self.vehicle)

    def driven(self, stretch: Stretch) -> Motion | None:
        """The motion of a stretch with the commands of the vehicle's thrusters; None where one is not known."""
        if self.vehicle is None or not {t.channel for t in self.vehicle.thrusters} <= set(self.commands):
            return None
        commands = stretch.commands[:, [self.commands.index(t.channel) for t in self.vehicle.thrusters]]
        if not np.isfinite(commands).all():
            return None
        names = tuple(t.name for t in self.vehicle.thrusters)
        return replace(stretch.motion, commands=commands, thrusters=names, run_up=None)

    @property
    def seconds(self) -> float:
        """Usable motion, looked at or not [s]."""
        return sum(stretch.portion.weight * stretch.motion.duration for stretch in self.stretches)


def shared(records: Sequence[Record], name: Hashable, make: Callable[[], _T]) -> _T:
    """Compute something of some records once, whichever check asks for it first.

    Parameters
    ----------
    records : at least one, in the same order whenever they are asked
    name : of what is computed
    make : computes it
    """
    first, *others = records
    key = (name, *others)
    if key not in first.known:
        first.known[key] = make()
    return first.known[key]


def _stretch(motion: Motion, commands: Array, portion: Portion) -> Stretch:
    """A motion and its commands, cut to where these are known if that is most of it."""
    known = np.flatnonzero(np.isfinite(commands).all(axis=1))
    if known.size < _MOST * motion.time.size or known.size < 2:
        return Stretch(motion, commands, portion)
    first, last = int(known[0]), int(known[-1]) + 1
    return Stretch(motion.slice(first, last), commands[first:last], portion)


def _commands(channels: Sequence[Channel], last: Sequence[float], motion: Motion) -> Array:
    """Commands in the rows of a motion; each is known up to its `last` stamp [s]."""
    table, step = np.full((motion.time.size, len(channels)), np.nan), motion.time_step
    for column, (channel, end) in enumerate(zip(channels, last, strict=True)):
        known = (motion.time >= channel.time[0]) & (motion.time <= end)
        if known.any():
            time = motion.time[known]
            near = samples(channel, (float(time[0]) - step, float(time[-1]) + step))
            table[known, column] = area_average(*near, time, step)
    return table
