"""The first rules of order: no row without a number, no time that runs backwards, one value per stamp."""

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from ..physics.errors import LogError
from ..physics.frames import Array
from .channels import Channel, Lost
from .formats.base import Stream

_SHUFFLED = 0.05
"""Share of rows up to which rows that stand after later ones were shuffled; beyond it the clock was set back."""


class Cleaner:
    """Makes channels of the streams of one file and remembers what it dropped.

    Parameters
    ----------
    where : the file, for messages
    mend : put up with time that runs backwards: sort rows that were shuffled, or take the longest piece of a log whose
        clock was set back. Only for looking a log over; whoever computes with it must know.
    """

    def __init__(self, where: str, mend: bool = False) -> None:
        self._where = where
        self._mend = mend
        self._empty: dict[int, list[str]] = defaultdict(list)
        self._repeated: dict[int, list[str]] = defaultdict(list)
        self._mended: dict[str, list[str]] = defaultdict(list)

    def channel(self, name: str, stream: Stream, value: Array) -> Channel:
        """Make the channel `name` of the values `value` (n,) at the stamps of `stream`.

        Raises
        ------
        LogError
            when no value is a number, or when time runs backwards and is not to be mended.
        """
        keep = np.isfinite(value) & np.isfinite(stream.time)
        if not keep.any():
            raise LogError(
                f"{self._where}: {name} ({stream.name}) holds no number in any of its {value.size} rows. Was the "
                f"sensor connected? Remove the column, or leave it out with '{name}: null' in a channel map."
            )
        time, rows = stream.time, stream.row
        if not keep.all():
            time, rows, value = time[keep], rows[keep], value[keep]
        steps = np.diff(time)
        backward = cut = 0
        if steps.size and steps.min() < 0:
            if not self._mend:
                at = int(np.flatnonzero(steps < 0)[0]) + 1
                raise LogError(
                    f"{self._where}: time runs backwards in {name} ({stream.name}) at row {rows[at]}: {time[at]:.6f} s "
                    f"after {time[at - 1]:.6f} s. Sort the log by time, or cut it where the clock was set; "
                    "'undertow inspect LOG --fix OUT.csv' sorts."
                )
            order, backward = _in_order(time)
            cut = time.size - order.size
            time, value = time[order], value[order]
            steps = np.diff(time)
            what = (
                f"{cut} values beyond a clock that was set back left out"
                if cut
                else f"{backward} values sorted by time"
            )
            self._mended[what].append(name)
        last = np.append(steps > 0, True)
        lost = Lost(int(keep.size - keep.sum()), int(last.size - last.sum()), backward, cut)
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
        return (*mended, *empty, *repeated)


def _in_order(time: Array) -> tuple[NDArray[np.intp], int]:
    """Rows (m,) of stamps (n,) in an order in which they never fall, and how many of them stood after later ones."""
    behind = time < np.maximum.accumulate(time)
    if np.mean(behind) <= _SHUFFLED:
        return np.argsort(time, kind="stable"), int(behind.sum())
    pieces = np.split(np.arange(time.size), np.flatnonzero(np.diff(time) < 0) + 1)
    return max(pieces, key=len), 0
