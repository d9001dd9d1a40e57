"""The first rules of order: no row without a number, no time that runs backwards, one value per stamp."""

from collections import defaultdict

import numpy as np

from ..physics.errors import LogError
from ..physics.frames import Array
from .channels import Channel
from .formats.base import Stream


class Cleaner:
    """Makes channels of the streams of one file and remembers what it dropped.

    Parameters
    ----------
    where : the file, for messages
    """

    def __init__(self, where: str) -> None:
        self._where = where
        self._empty: dict[int, list[str]] = defaultdict(list)
        self._repeated: dict[int, list[str]] = defaultdict(list)

    def channel(self, name: str, stream: Stream, value: Array) -> Channel:
        """Make the channel `name` of the values `value` (n,) at the stamps of `stream`.

        Raises
        ------
        LogError
            when no value is a number, or when time runs backwards.
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
        if steps.size and steps.min() < 0:
            at = int(np.flatnonzero(steps < 0)[0]) + 1
            raise LogError(
                f"{self._where}: time runs backwards in {name} ({stream.name}) at row {rows[at]}: {time[at]:.6f} s "
                f"after {time[at - 1]:.6f} s. Sort the log by time, or cut it where the clock was set."
            )
        last = np.append(steps > 0, True)
        if not keep.all():
            self._empty[int(keep.size - keep.sum())].append(name)
        if last.all():
            # Nothing is copied: the channels of a large log share one array of stamps.
            return Channel(name, time, value, stream.name)
        self._repeated[int(last.size - last.sum())].append(name)
        return Channel(name, time[last], value[last], stream.name)

    def notes(self) -> tuple[str, ...]:
        """Say what was dropped, one sentence for the channels that lost the same number of rows."""
        empty = [f"{' '.join(names)}: {count} rows without a number dropped" for count, names in self._empty.items()]
        repeated = [
            f"{' '.join(names)}: {count} repeated time stamps, the last value of each kept"
            for count, names in self._repeated.items()
        ]
        return (*empty, *repeated)
