"""A log that is still being written, as motions that go on where the last one ended; memory of half a minute of it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..physics.errors import LogError
from ..physics.motion import RUN_UP, Array, Motion
from ..physics.vehicle import Vehicle
from .channels.channel_map import TIME, Entry, read_channel_map, time_of
from .channels.mapping import map_channels
from .formats.tables.growing_table import GrowingTable
from .log import Log
from .log_options import Reading
from .preparation.dataset import WEAK
from .preparation.needs import require
from .preparation.prepare import motion_on, native_rate, reference, usable_spans
from .preparation.resampling import even_grid

_MARGIN = 5.0
"""Time that is kept beyond the longest history of commands [s]: of a stretch that is long enough to be one."""
_SILENT = 5.0
"""Time for which a log grows without a motion before this is told [s]."""


class GrowingLog:
    """Motions of a log as it grows, as `prepare` makes them for the weak form, each row once.

    A row is ready when the next one is there: a command that is averaged over the step about a stamp is then known.

    Parameters
    ----------
    where : the file, for messages
    vehicle : whose thrusters name the commands
    reading : axes, channel map and namespace
    least : how much of the log must be new for motions to be made of it [s]: to make them costs the same for all rows

    Attributes
    ----------
    table : its rows
    log : the latest channels, None before there are any
    """

    def __init__(self, where: str, vehicle: Vehicle, reading: Reading, least: float = 0.0) -> None:
        self._where, self._vehicle, self._reading, self._least = where, vehicle, reading, least
        given = {} if reading.channel_map is None else read_channel_map(Path(reading.channel_map))
        self.table = GrowingTable(where, time_of(given))
        self.log: Log | None = None
        self._entries: dict[str, Entry | None] = {name: entry for name, entry in given.items() if name != TIME}
        self._step = self._begin = 0.0
        self._last: float | None = None  # stamp of the last row that was given
        self._silent = False

    @property
    def seconds(self) -> float:
        """How much of the log was written since its first motion was asked for [s]."""
        times = [stream.time[0] for stream in self.table.streams()]
        return float(self.table.newest - min(times)) if times else 0.0

    def begin(self) -> tuple[str, ...]:
        """Decide on channels and rate by what is there; from now on motions can be asked for. Gives the notes.

        Raises
        ------
        LogError
            when the vehicle cannot be followed by these channels.
        """
        streams = self.table.streams()
        if not streams:
            raise LogError(f"{self._where}: a header but no rows, or nothing at all; is the log being written?")
        mapped = map_channels(streams, self._reading.frame, self._entries, self._where, (), self._reading.namespace)
        self._entries = mapped.entries
        self.log = Log(Path(self._where), mapped.channels, mapped.notes, mapped.unused, mapped.entries)
        require(self.log, self._vehicle)
        self._step, self._begin = 1.0 / native_rate(self.log), float(reference(self.log).time[0])
        return mapped.notes

    def motions(self, ended: bool = False) -> list[Motion]:
        """What was written since the last time, in gap-free stretches; the first goes on where the last one ended.

        Parameters
        ----------
        ended : nothing more will be written

        Raises
        ------
        LogError
            when a value cannot be what its channel says.
        """
        if not ended and self._last is not None and self.table.newest < self._last + self._least + self._step:
            return []
        streams = self.table.streams()
        frame, namespace = self._reading.frame, self._reading.namespace
        channels = map_channels(streams, frame, self._entries, self._where, (), namespace).channels
        self.log = log = Log(Path(self._where), channels, entries=self._entries)
        found = []
        for start, end in usable_spans(log, self._vehicle, WEAK)[0]:
            ready = end if ended else end - self._step
            goes_on = self._last is not None and start <= self._last + 0.5 * self._step
            grid: Array = even_grid(reference(log).time, (start, end), self._step)
            if goes_on and self._last is not None:
                count = int(np.floor((ready - self._last) / self._step + 1e-6))
                grid = self._last + self._step * np.arange(1.0, count + 1.0)
            grid = grid[grid <= ready + 1e-6 * self._step]
            if self._last is not None:
                grid = grid[grid > self._last + 1e-6 * self._step]
            if grid.size < 2:
                continue
            motion = motion_on(log, self._vehicle, WEAK, (start, end), grid, self._step)
            found.append(replace(motion, minutes=(grid - self._begin) / 60.0))
            self._last = float(grid[-1])
        self._forget(bool(found))
        return found

    def _forget(self, grown: bool) -> None:
        """Keep what the next rows need; of a channel that is silent, tell once."""
        newest, last = self.table.newest, self._last
        kept = newest if last is None else last
        self.table.cut(min(kept, newest - _MARGIN) - RUN_UP - _MARGIN)
        late = self._begin if last is None else last
        if newest - late > _SILENT and not (grown or self._silent) and self.log is not None:
            late_ones = _late(self.log, newest)
            why = f"{' '.join(late_ones)} said nothing since" if late_ones else "no stretch without gaps is long enough"
            self.table.notes.append(f"t = {newest:.1f} s: nothing to follow since t = {late:.1f} s: {why}")
        self._silent = not grown and (self._silent or newest - late > _SILENT)


def _late(log: Log, newest: float) -> Sequence[str]:
    """Channels that have said nothing lately."""
    return [name for name, channel in log.channels.items() if newest - channel.time[-1] > 0.5 * _SILENT]
