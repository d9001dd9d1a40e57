"""A `Log`: the canonical channels of one file, in SI units and NED/FRD axes, each on its own time stamps."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from .channel_map import read_channel_map
from .channels import Channel
from .formats.registry import read_recording
from .mapping import map_channels

__all__ = ["Channel", "Log", "read_log"]


@dataclass(frozen=True, slots=True, eq=False)
class Log:
    """One log file, read.

    Attributes
    ----------
    path : the file
    channels : canonical channels by name
    notes : every guess, conversion and dropped row, as sentences
    unused : the streams of the file that became no channel, `topic:field` or column
    """

    path: Path
    channels: dict[str, Channel]
    notes: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """File name without its folder."""
        return self.path.name


def read_log(
    path: Path | str, *, frame: Literal["ned", "enu"] | None = None, channel_map: Path | str | None = None
) -> Log:
    """Read a log of any known format into canonical channels.

    A field or column that bears a canonical name (`x y psi u v r ax ay qx qy qz qw`, `pwm_port`, `newton_stbd`, ...)
    is that channel, whatever its topic. ROS-style fields (`pose.position.x`, `twist.angular.z`, ...) are taken as
    ENU/FLU (REP-103) and converted; thruster commands are guessed from topic and field names. Every guess and
    conversion is in the notes.

    Parameters
    ----------
    path : CSV (long or wide, plain or gzip) or Parquet
    frame : axes of the log. None: canonical names are NED/FRD and ROS-style fields ENU/FLU; "enu": canonical names
        are ENU/FLU too (x east, y north, psi counter-clockwise from east, v to port, r to port); "ned": ROS-style
        fields are NED/FRD already.
    channel_map : YAML file that overrides the guess, see `channel_map.read_channel_map`

    Raises
    ------
    LogError
        for a missing, empty or unreadable file, time that runs backwards, a channel without a number, a PWM outside
        800 to 2200 us, a file in which no channel is recognised, or a channel map that does not fit.
    """
    path = Path(path)
    recording = read_recording(path)
    entries = read_channel_map(Path(channel_map)) if channel_map is not None else {}
    channels, unused, notes = map_channels(recording.streams, frame, entries, str(path))
    return Log(path, channels, (*recording.notes, *notes), unused)
