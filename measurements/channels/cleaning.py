"""The first rules of order: no row without a number, no time that runs backwards, one value per stamp."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from ...physics.errors import LogError
from ...physics.motion import Array
from ..canonical import Channel, Lost
from ..clock import APART, Clock
from ..formats.base import Stream


class Cleaner:
    """Makes channels of the streams of one file and remembers what it dropped.

    Parameters
    ----------
    where : the file, for messages
    streams : all that become channels, whose clock is put right together; see `Clock`
    mend : put up with time that runs backwards: sort rows that were shuffled, and join the pieces of a log whose clock
        was set back. Only for looking a log over; whoever computes with it must know.
    """

    def __init__(self, where: str, streams: Sequence[Stream], mend: bool = False) -> None:
        self._where = where
        self._mend = mend
        self._clock = Clock(streams, mend)
        self._empty: dict[int, list[str]] = defaultdict(list)
        self._repeated: dict[int, list[str]] = defaultdict(list)
        self._mended: dict[str, list[str]] = defaultdict(list)

    def channel(self, name: str, stream: Stream, value: Array) -> Channel:
        """Make the channel `name` of the values `value` (n,) at the stamps of `stream`.

        Raises
        ------
        LogError
            when no value is a number, or when time runs backwards and is not, or cannot, be mended.
        """
        time, stamped = self._clock.read(stream)
        known = np.isfinite(value) & np.isfinite(stream.time)
        keep = known & stamped
        if not keep.any():
            raise LogError(
                f"{self._where}: {name} ({stream.name}) holds no number in any of its {value.size} rows. Was the "
                f"sensor connected? Remove the column, or leave it out with '{name}: null' in a channel map."
            )
        rows = stream.row
        empty, astray = int(keep.size - known.sum()), int(known.sum() - keep.sum())
        if astray:
            self._mended[f"{astray} rows whose stamp is far out of order dropped"].append(name)
        if not keep.all():
            time, rows, value = time[keep], rows[keep], value[keep]
        steps = np.diff(time)
        backward = 0
        if steps.size and steps.min() < 0:
            if not self._mend:
                at = int(np.flatnonzero(steps < 0)[0]) + 1
                raise LogError(
                    f"{self._where}: time runs backwards in {name} ({stream.name}) at row {rows[at]}: {time[at]:.6f} s "
                    f"after {time[at - 1]:.6f} s. Sort the log by time, or cut it where the clock was set; "
                    "--fix does so, and 'undertow inspect LOG --fix OUT.csv' writes it."
                )
            backward = int(np.sum(time < np.maximum.accumulate(time)))
            order = np.argsort(time, kind="stable")
            time, value = time[order], value[order]
            steps = np.diff(time)
            self._mended[f"{backward} values sorted by time"].append(name)
        last = np.append(steps > 0, True)
        lost = Lost(empty, int(last.size - last.sum()), backward, astray, self._clock.sets)
        if lost.empty:
            self._empty[lost.empty].append(name)
        if not lost.repeated:
            # Nothing is copied: the channels of a large log share one array of stamps.
            return Channel(name, time, value, stream.name, lost)
        self._repeated[lost.repeated].append(name)
        return Channel(name, time[last], value[last], stream.name, lost)

    def notes(self) -> tuple[str, ...]:
        """Say what was dropped, one sentence for the channels that lost the same number of rows."""
        mended = [f"{' '.join(names)}: {what}" for what, names in self._mended.items()]
        empty = [f"{' '.join(names)}: {count} rows without a number dropped" for count, names in self._empty.items()]
        repeated = [
            f"{' '.join(names)}: {count} repeated time stamps, the last value of each kept"
            for count, names in self._repeated.items()
        ]
        sets = [
            f"the clock was set at t = {at:.3f} s by {by:+.6g} s; what follows is put {APART:g} s after it, as a "
            "stretch of its own"
            for at, by in self._clock.sets
        ]
        return (*sets, *mended, *empty, *repeated)
