"""A `Log`: the canonical channels of one file, in SI units and NED/FRD axes, each on its own time stamps."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .canonical import Channel
from .channels.channel_map import Entry, read_channel_map
from .channels.mapping import map_channels
from .channels.namespaces import check_namespace, is_under
from .channels.recognition import is_vertical_acceleration, recognise
from .formats.base import Name, Request
from .formats.registry import read_recording
from .log_options import AS_GUESSED, Reading

__all__ = ["Channel", "Log", "read_log"]


@dataclass(frozen=True, slots=True, eq=False)
class Log:
    """One log file, read.

    Attributes
    ----------
    path : the file, or the folder of a bag
    channels : canonical channels by name
    notes : every guess, conversion and dropped row, as sentences
    unused : the streams of the file that became no channel, `topic:field` or column
    entries : the channel map in use, guesses included; see `channel_map.map_text`
    start_ns : the stamp of the file at time zero of the channels [ns]: where a file counts from 1970, the channels
        count from its first stamp; 0 where they have the file's own time
    out_of_step : by how much its channels may be out of step with each other, as far as its reader can tell [s]
    """

    path: Path
    channels: dict[str, Channel]
    notes: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    entries: dict[str, Entry] = field(default_factory=dict)
    start_ns: int = 0
    out_of_step: float = 0.0

    @property
    def name(self) -> str:
        """File name without its folder."""
        return self.path.name


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
    mend : for inspection: put up with time that runs backwards, see `cleaning.Cleaner`

    Raises
    ------
    LogError
        for a missing, empty or unreadable file, time that runs backwards, a channel without a number, a PWM outside
        800 to 2200 us, a file in which no channel is recognised, a log of several vehicles of which none is chosen,
        or a channel map that does not fit.
    """
    path, namespace = Path(path), reading.namespace
    entries = read_channel_map(Path(reading.channel_map)) if reading.channel_map is not None else {}
    request = Request(_chooser(entries, namespace))
    if progress is not None:
        request = Request(request.choose, progress)
    recording = read_recording(path, request)
    names = [*(stream.label for stream in recording.streams), *recording.unread]
    told = check_namespace(names, namespace, str(path))
    mapped = map_channels(recording.streams, reading.frame, entries, str(path), recording.unread, namespace, mend)
    notes = (*recording.notes, *told, *mapped.notes)
    told_of = (recording.start_ns, recording.out_of_step)
    return Log(path, mapped.channels, notes, mapped.unused, mapped.entries, *told_of)


def _chooser(entries: Mapping[str, Entry | None], namespace: str | None) -> Callable[[Sequence[Name]], frozenset[Name]]:
    """Choose what the channel map names, and in the namespace what may be guessed to be a channel."""
    named = {entry.source for entry in entries.values() if entry is not None}
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
        return recognise(name) is not None or is_vertical_acceleration(name)

    return lambda names: frozenset(name for name in names if wanted(name))
