"""The first rules of order: no row without a number, no time that runs backwards, one value per stamp."""

from collections import defaultdict
from collections.abc import Sequence

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
    mend : put up with time that runs backwards: sort rows that were shuffled, or take the longest piece of a table
        whose clock was set back, see `choose_piece`. Only for looking a log over; whoever computes with it must know.
    """

    def __init__(self, where: str, mend: bool = False) -> None:
        self._where = where
        self._mend = mend
        self._empty: dict[int, list[str]] = defaultdict(list)
        self._repeated: dict[int, list[str]] = defaultdict(list)
        self._mended: dict[str, list[str]] = defaultdict(list)
        self._piece: tuple[int, int] | None = None
        self._set_back = False

    def choose_piece(self, streams: Sequence[Stream]) -> None:
        """Choose the piece of a log whose clock was set back: the same rows for all channels, or two runs would mix.

        Only the rows of a table are counted through all streams; messages are numbered topic by topic, so of a set-back
        clock in them `channel` says that it cannot be mended.

        Parameters
        ----------
        streams : all that become channels
        """
        if not self._mend:
            return
        shared = {id(stream.time): stream for stream in streams}
        falls = [rows for stream in shared.values() if (rows := _set_back(stream)).size]
        self._set_back = bool(falls)
        if not falls or any(stream.kind for stream in streams):
            return
        starts = np.unique(np.concatenate(falls))
        count = np.zeros(starts.size + 1, dtype=np.int64)
        for stream in streams:
            count += np.bincount(np.searchsorted(starts, stream.row, "right"), minlength=count.size)
        piece = int(np.argmax(count))
        bounds = [0, *starts.tolist(), 1 + max(int(stream.row.max()) for stream in streams if stream.row.size)]
        self._piece = bounds[piece], bounds[piece + 1]

    def channel(self, name: str, stream: Stream, value: Array) -> Channel:
        """Make the channel `name` of the values `value` (n,) at the stamps of `stream`.

        Raises
        ------
        LogError
            when no value is a number, or when time runs backwards and is not, or cannot, be mended.
        """
        keep = np.isfinite(value) & np.isfinite(stream.time)
        if not keep.any():
            raise LogError(
                f"{self._where}: {name} ({stream.name}) holds no number in any of its {value.size} rows. Was the "
                f"sensor connected? Remove the column, or leave it out with '{name}: null' in a channel map."
            )
        time, rows = stream.time, stream.row
        empty, cut = int(keep.size - keep.sum()), 0
        if self._piece is not None:
            low, high = self._piece
            inside = keep & (rows >= low) & (rows < high)
            cut = int(keep.sum() - inside.sum())
            if not inside.any():
                raise LogError(
                    f"{self._where}: the clock is set back, and {name} ({stream.name}) has no value in the longest "
                    f"piece, rows {low} to {high - 1}. Cut the log where the clock was set."
                )
            keep = inside
        if cut:
            self._mended[
                f"{cut} values outside rows {low} to {high - 1} left out, because the clock was set back"
            ].append(name)
        if not keep.all():
            time, rows, value = time[keep], rows[keep], value[keep]
        steps = np.diff(time)
        backward = 0
        if steps.size and steps.min() < 0:
            if not self._mend or (self._set_back and self._piece is None):
                at = int(np.flatnonzero(steps < 0)[0]) + 1
                raise LogError(
                    f"{self._where}: time runs backwards in {name} ({stream.name}) at row {rows[at]}: {time[at]:.6f} s "
                    f"after {time[at - 1]:.6f} s. Sort the log by time, or cut it where the clock was set; "
                    "'undertow inspect LOG --fix OUT.csv' sorts."
                )
            backward = int(np.sum(time < np.maximum.accumulate(time)))
            order = np.argsort(time, kind="stable")
            time, value = time[order], value[order]
            steps = np.diff(time)
            self._mended[f"{backward} values sorted by time"].append(name)
        last = np.append(steps > 0, True)
        lost = Lost(empty, int(last.size - last.sum()), backward, cut)
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


def _set_back(stream: Stream) -> NDArray[np.int64]:
    """Rows (k,) of the file at which the clock of a stream was set back; none where its rows were shuffled at most."""
    known = np.isfinite(stream.time)
    time = stream.time[known]
    if not time.size or np.mean(time < np.maximum.accumulate(time)) <= _SHUFFLED:
        return np.zeros(0, dtype=np.int64)
    return stream.row[known][1:][np.diff(time) < 0]
