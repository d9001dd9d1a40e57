"""A `Log`: the canonical channels of one file or of a data frame, each on its own time stamps."""

import hashlib
import os
import re
import warnings
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..physics.errors import LogError
from ..physics.motion import Array
from ..physics.presentation import Card, each
from .canonical import Channel
from .channels.channel_map import TIME, Entry, entries_of, entry_of, map_dict, read_channel_map, time_of
from .channels.mapping import auxiliary_channels, auxiliary_of, map_channels
from .channels.recognition import check_namespace, is_under, is_vertical_acceleration, lacks, recognise
from .formats.base import CraftEvidence, Name, Request, Stream, TimeColumn, find_time, some
from .formats.registry import read_recording
from .log_options import AS_GUESSED, Reading

if TYPE_CHECKING:
    import pandas as pd


_VALUES = ("value", "_value", "val")
"""Columns of a long table that hold its numbers, in lower letters."""
_NAMES = ("field", "_field", "name", "channel", "signal", "variable", "metric", "key", "tag")
"""Columns that say of which channel a number is; the first that is there."""
_TOPICS = ("topic", "_measurement", "measurement")
"""Columns that may stand beside these, and name the message or the sensor."""


def streams_of(table: Any, time: str | None, where: str) -> list[Stream]:
    """The streams of a data frame; see `Log.from_dataframe`.

    A table with a column of names and one of values is long, as telemetry is exported: every name is a stream with its
    own stamps. Every other table has a row for each stamp, and a column for each stream.

    Parameters
    ----------
    table : a data frame of any library
    time : name of the column of stamps; guessed for None
    where : the table, for messages

    Raises
    ------
    LogError
        for what is no data frame, has no time, or has names and nothing that is called their value.
    """
    import pandas as pd

    if not isinstance(table, pd.DataFrame):
        table = _as_pandas(table, where)
    clock = find_time([str(column) for column in table.columns]) if time is None else None
    found = time or next((column for column in table.columns if clock is not None and str(column) == clock.name), None)
    if found is not None and found not in table.columns:
        raise LogError(f"{where}: no column {found!r}; expected one of {', '.join(map(str, table.columns))}")
    if found is None and isinstance(table.index, pd.RangeIndex):
        raise LogError(f"{where}: no column holds the time; say time='...', or make the time the index")
    stamps = _seconds(table.index.to_series() if found is None else table[found], str(found))
    rows = np.arange(1, stamps.size + 1, dtype=np.int64)
    name, value = (_one_of(table, known, words) for known, words in ((_NAMES, True), (_VALUES, False)))
    if name is None:
        kept = {str(column): _numbers(table[column]) for column in table.columns if column != found}
        return [Stream("", key, stamps, column, rows) for key, column in kept.items()]
    if value is None:
        raise LogError(
            f"{where}: the column {name!r} holds names, so this is a long table, but no column is called 'value'; "
            f"rename the column of the numbers, or pivot: table.pivot_table(index={found!r}, columns={name!r}, "
            "values=...)"
        )
    topic = _one_of(table, _TOPICS, True)
    labels = [name] if topic is None else [topic, name]
    numbers, streams = _numbers(table[value]), []
    for label, places in table.groupby(labels, sort=True, observed=True).indices.items():
        *before, field = label if isinstance(label, tuple) else (label,)
        order = places[np.argsort(stamps[places], kind="stable")]
        streams.append(Stream("".join(map(str, before)), str(field), stamps[order], numbers[order], rows[order]))
    return streams


def _one_of(table: "pd.DataFrame", known: Sequence[str], words: bool) -> str | None:
    """The first of some columns that a table has and that holds words, or numbers."""
    from pandas.api.types import is_numeric_dtype

    by_name = {str(column).lower(): column for column in table.columns}
    found = [by_name[name] for name in known if name in by_name]
    return next((c for c in found if is_numeric_dtype(table[c]) is not words), None)


def _seconds(stamps: "pd.Series", name: str) -> Array:
    import pandas as pd

    if not pd.api.types.is_numeric_dtype(stamps) and pd.api.types.is_string_dtype(stamps):
        numbers = pd.to_numeric(stamps, errors="coerce")
        stamps = numbers if numbers.notna().any() else pd.to_datetime(stamps, errors="coerce", utc=True)
    if pd.api.types.is_datetime64_any_dtype(stamps):
        seconds = (stamps - stamps.min()).dt.total_seconds()
    elif pd.api.types.is_timedelta64_dtype(stamps):
        seconds = stamps.dt.total_seconds()
    else:
        numbers = pd.to_numeric(stamps, errors="coerce")
        seconds = numbers / (find_time((name,)) or TimeColumn(name)).ticks(float(numbers.min()))
    return seconds.to_numpy(dtype=float)


def _numbers(column: "pd.Series") -> Array:
    import pandas as pd

    return np.asarray(pd.to_numeric(column, errors="coerce"), dtype=float)


def _as_pandas(table: Any, where: str) -> Any:
    """A data frame of another library as one of pandas: by its own conversion, by protocol, or by columns."""
    import pandas as pd

    if hasattr(table, "to_pandas"):
        try:
            return table.to_pandas()
        except ImportError:  # polars asks for pyarrow, and offers the protocol up to its version 1
            if not hasattr(table, "__dataframe__"):
                return pd.DataFrame({name: list(table[name]) for name in table.columns})
    if not hasattr(table, "__dataframe__"):
        raise LogError(f"{where}: expected a data frame, got {type(table).__name__}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # pandas prefers Arrow's protocol, which needs pyarrow
        return pd.api.interchange.from_dataframe(table)


ChannelMap = Mapping[str, Entry | str | Mapping[str, Any] | None] | str | os.PathLike[str]
"""A channel map: its file, or by channel its entries or what the file says of them."""
REPAIRED = "repaired by undertow from"
"""How the first remark above a repaired log begins, and the first note of such a log."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Log(Card):
    """One log file, read.

    Attributes
    ----------
    path : the file, or the folder of a bag
    channels : canonical channels by name
    notes : every guess, conversion and dropped row, as sentences
    unused : the streams of the file that became no channel, `topic:field` or column
    entries : the channel map in use, guesses included, None for what it leaves out; see `channel_map.map_text`
    start_ns : the stamp of the file at time zero of the channels [ns]: where a file counts from 1970, the channels
        count from its first stamp; 0 where they have the file's own time
    out_of_step : by how much its channels may be out of step with each other, as far as its reader can tell [s]
    idle : what the channel map leaves out, though nothing in the log would have become it
    craft : what kind of vehicle it is of, as its autopilot says; None where it does not
    clock : of a table, the column that holds its time
    auxiliary : what the log has beside, by name: steering outputs, battery, motors, mode; see `channels.mapping`
    lacks : of a log in memory, what a search needs and is not there, with the columns that look like it
    """

    path: Path
    channels: dict[str, Channel]
    notes: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    entries: dict[str, Entry | None] = field(default_factory=dict)
    start_ns: int = 0
    out_of_step: float = 0.0
    idle: tuple[str, ...] = ()
    lacks: tuple[str, ...] = ()
    craft: CraftEvidence | None = None
    clock: str = ""
    auxiliary: dict[str, Channel] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """File name without its folder."""
        return self.path.name

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        ends = [(float(c.time[0]), float(c.time[-1])) for c in self.channels.values() if c.time.size]
        span = f"{min(a for a, _ in ends):.1f} to {max(b for _, b in ends):.1f} s" if ends else ""
        rates = {name: 1.0 / c.period if c.period else 0.0 for name, c in self.channels.items()}
        return [
            ("file", str(self.path)),
            ("time", span),
            ("channels", ", ".join(f"{name} ({rate:.3g} Hz)" for name, rate in rates.items())),
            ("beside", ", ".join(self.auxiliary)),
            ("not used", some(self.unused, 6) if self.unused else ""),
            *each("to add", self.lacks),
            ("notes", f"{len(self.notes)}, see .notes" if self.notes else ""),
        ]

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike,
        channels: Mapping[str, ArrayLike],
        *,
        units: Mapping[str, str] | None = None,
        frame: str | None = None,
        channel_map: ChannelMap | None = None,
        name: str = "arrays",
    ) -> "Log":
        """Make a log of arrays, named and read as the columns of a wide table would be; see `read_log`.

        Parameters
        ----------
        time : (n,) stamps [s]
        channels : name -> (n,) values; canonical names such as `psi`, `u`, `pwm_port`, or ones that are guessed
        units : name -> unit, where it is not that of the channel (deg, deg/s, knots, percent ..., as in channel maps)
        frame : "enu" where the axes are ENU/FLU; see `Reading`
        channel_map : which channel is made of which name, turned and scaled: a file, what would stand in it
            (`{"pwm_port": "left", "psi": {"from": "heading", "unit": "deg"}}`), or the `entries` that `init` found
        name : in notes and messages

        Raises
        ------
        LogError
            as `read_log`, and for arrays of other lengths or units that cannot be.
        """
        stamps = _log_numbers(name, "time", time)
        rows = np.arange(1, stamps.size + 1, dtype=np.int64)
        streams = []
        for key, given in channels.items():
            values = _log_numbers(name, key, given)
            if values.size != stamps.size:
                raise LogError(f"{name}: {key} has {values.size} values, time has {stamps.size}; expected one a stamp")
            streams.append(Stream("", str(key), stamps, values, rows))
        return cls._of(streams, units, frame, channel_map, name)

    @classmethod
    def from_dataframe(
        cls,
        table: Any,
        *,
        time: str | None = None,
        units: Mapping[str, str] | None = None,
        frame: str | None = None,
        channel_map: ChannelMap | None = None,
        name: str = "dataframe",
    ) -> "Log":
        """Make a log of a data frame with a row for each time stamp, or of a long one with a row for each value.

        A long one has a column of names (`name`, `field`, `channel`, `signal`, `variable` ...), perhaps a `topic`
        beside it, and one that is called `value`, as telemetry is exported; every name has its own stamps.

        Parameters
        ----------
        table : of pandas, or of anything that has `to_pandas` or the interchange protocol (polars, pyarrow ...)
        time : the column of the stamps, in seconds or as dates; default: `t`, `time` and their like, else the index
        units, frame, channel_map, name : see `from_arrays`

        Raises
        ------
        LogError
            as `from_arrays`, where no column holds the time, and for a long table without a column `value`.
        """
        return cls._of(streams_of(table, time, name), units, frame, channel_map, name)

    @classmethod
    def _of(
        cls,
        streams: Sequence[Stream],
        units: Mapping[str, str] | None,
        frame: str | None,
        channel_map: ChannelMap | None,
        name: str,
    ) -> "Log":
        """The log of streams in memory."""
        where, known = Path(name), {stream.name for stream in streams}
        missing = [key for key in units or {} if key not in known]
        if missing:
            raise LogError(f"{name}: units are given for {', '.join(missing)}, which is not among the channels")
        Reading(frame)  # which refuses what is no frame
        given: dict[str, Entry | None] = {}
        if channel_map is not None:
            is_file = not isinstance(channel_map, Mapping)
            given = read_channel_map(Path(channel_map)) if is_file else entries_of(where, channel_map)
            given.pop(TIME, None)  # the stamps are given beside it
        mapped = map_channels(streams, frame, given, name)
        told: dict[str, Entry | None] = {
            channel: entry_of(where, channel, {**map_dict({channel: entry})[channel], "unit": units[entry.source]})
            for channel, entry in mapped.entries.items()
            if units and entry is not None and entry.source in units
            # A map that was made of the same table, with its units, has them in it.
            if entry.scale == 1.0
            or entry.scale != entry_of(where, channel, {"from": entry.source, "unit": units[entry.source]}).scale
        }
        if told:
            mapped = map_channels(streams, frame, {**given, **told}, name)
        spare = [stream for stream in streams if stream.name in mapped.unused]
        needed = tuple(lacks(mapped.channels, spare))
        notes = (*needed, *mapped.notes)
        made = cls(where, mapped.channels, notes, mapped.unused, mapped.entries, idle=mapped.idle, lacks=needed)
        return replace(made, auxiliary=auxiliary_channels(spare))


def _log_numbers(where: str, name: str, given: ArrayLike) -> Array:
    try:
        values = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise LogError(f"{where}: {name}: expected numbers, got {type(given).__name__}") from None
    if values.ndim != 1:
        raise LogError(f"{where}: {name}: expected one number a stamp, got an array of shape {values.shape}")
    return values


def read_log(
    path: Path | str,
    reading: Reading = AS_GUESSED,
    *,
    progress: Callable[[int, int], None] | None = None,
    mend: bool = False,
) -> Log:
    """Read a log of any known format into canonical channels.

    A field or column that bears a canonical name (`x y psi u v r ax ay qx qy qz qw`, `pwm_port`, `newton_stbd`, ...)
    is that channel, whatever its topic. Messages of ROS are known by their types, ROS-style fields of a flattened bag
    (`pose.position.x`, `twist.angular.z`, ...) by their names; both are taken as ENU/FLU (REP-103) and converted.
    Thruster commands are guessed from topic and field names. Every guess and conversion is in the notes. Of a bag,
    only what becomes a channel is unpacked.

    Parameters
    ----------
    path : a file or folder of one of `formats.registry.FORMATS`
    reading : axes, channel map and namespace
    progress : told bytes done and bytes in all, while a large file is read
    mend : for inspection: put up with time that runs backwards, see `conversion.Cleaner`

    Raises
    ------
    LogError
        for a missing, empty or unreadable file, time that runs backwards, a channel without a number, a PWM outside
        800 to 2200 us, a file in which no channel is recognised, a log of several vehicles of which none is chosen,
        or a channel map that does not fit.
    """
    path, namespace = Path(path), reading.namespace
    given = read_channel_map(Path(reading.channel_map)) if reading.channel_map is not None else {}
    entries = {name: entry for name, entry in given.items() if name != TIME}
    request = Request(_chooser(entries, namespace), time=time_of(given))
    if progress is not None:
        request = replace(request, progress=progress)
    recording = read_recording(path, request)
    names = [*(stream.label for stream in recording.streams), *recording.unread]
    told = check_namespace(names, namespace, str(path))
    if any(note.startswith(REPAIRED) for note in recording.notes):
        _check_map_of_repaired(path, entries, {name for one in recording.streams for name in (one.name, one.field)})
    mapped = map_channels(recording.streams, reading.frame, entries, str(path), recording.unread, namespace, mend)
    ours = [one for one in recording.streams if namespace is None or is_under(one.topic, namespace)]
    auxiliary = auxiliary_channels([one for one in ours if one.name in mapped.unused])
    notes = (*recording.notes, *told, *mapped.notes, *_kept(auxiliary))
    told_of = (recording.start_ns, recording.out_of_step)
    in_use = {**{name: entry for name, entry in given.items() if name == TIME}, **mapped.entries}
    own = [told for prefix, told in recording.crafts.items() if namespace is None or is_under(prefix, namespace)]
    made = Log(path, mapped.channels, notes, mapped.unused, in_use, *told_of, mapped.idle)
    return replace(made, clock=recording.clock, auxiliary=auxiliary, craft=own[0] if own else None)


def _chooser(entries: Mapping[str, Entry | None], namespace: str | None) -> Callable[[Sequence[Name]], frozenset[Name]]:
    """Choose what the channel map names, and in the namespace what may be guessed to be a channel."""
    named = {source for entry in entries.values() if entry is not None for source in entry.sources}
    topics = {source.rpartition(":")[0] for source in named if ":" in source}
    # An element of a sequence, `channels[2]` or `port_joint.velocity`, is offered as `channels[]` or `velocity[]`.
    fields = (
        named | {re.sub(r"\[\d+\]", "[]", source) for source in named} | {f"{s.rpartition('.')[2]}[]" for s in named}
    )

    def wanted(name: Name) -> bool:
        if name.name in named or name.field in fields or (name.topic and name.topic in topics):
            return True
        if namespace is not None and not is_under(name.topic, namespace):
            return False
        return recognise(name) is not None or is_vertical_acceleration(name) or auxiliary_of(name) is not None

    return lambda names: frozenset(name for name in names if wanted(name))


def _kept(channels: Mapping[str, Channel]) -> tuple[str, ...]:
    """A note on the auxiliary channels."""
    text = ", ".join(f"{name} ({channel.origin})" for name, channel in channels.items())
    return (f"kept beside motion and commands: {text}",) if channels else ()


def _check_map_of_repaired(path: Path, entries: Mapping[str, Entry | None], names: Container[str]) -> None:
    """Refuse the channel map of the log that was repaired: what it would do is done."""
    sources = [source for entry in entries.values() if entry for source in entry.sources]
    wanted = next((source for source in sources if source not in names), None)
    if wanted is not None:
        raise LogError(
            f"{path}: the channel map takes '{wanted}', which is not in this log: 'undertow inspect --fix' wrote it, "
            "and its channels have their own names, units and axes already. Leave --map out; the map is for the log "
            "that was repaired"
        )


def channels_digest(log: Log) -> str:
    """SHA-256 of the channels of a log in memory: their names, stamps and values."""
    digest = hashlib.sha256()
    for name, channel in sorted(log.channels.items()):
        digest.update(f"{name}\0{channel.time.size}\0".encode())
        digest.update(channel.time.tobytes())
        digest.update(channel.value.tobytes())
    return digest.hexdigest()
