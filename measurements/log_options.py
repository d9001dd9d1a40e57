"""Options of reading, where logs do not say it themselves: one argument of every verb."""

import os
from dataclasses import dataclass

from ..physics.errors import RequestError


@dataclass(frozen=True, slots=True)
class Reading:
    """How logs are to be read.

    Attributes
    ----------
    frame : axes of the log. None: canonical names are NED/FRD and ROS-style fields ENU/FLU; "enu": canonical names
        are ENU/FLU too (x east, y north, psi counter-clockwise from east, v to port, r to port); "ned": ROS-style
        fields are NED/FRD already
    channel_map : YAML file that overrides what is guessed of the channels, see `channel_map.read_channel_map`
    namespace : start of the topics of the vehicle that is meant, in a log of several
    as_is : take logs whose defects make every finding meaningless as they are (reversed or swapped thrusters, wrong
        units, axes that contradict each other), and warn; without it they are refused
    fix : make the safe repairs of `inspect --fix` in memory, and say which; the files stay as they are

    Raises
    ------
    RequestError
        for a frame that is neither enu nor ned, and a channel map that is no path.
    """

    frame: str | None = None
    channel_map: str | os.PathLike[str] | None = None
    namespace: str | None = None
    as_is: bool = False
    fix: bool = False

    def __post_init__(self) -> None:
        if self.frame not in (None, "enu", "ned"):
            raise RequestError(f"frame {self.frame!r}: expected enu or ned")
        if not isinstance(self.channel_map, str | os.PathLike | None):
            raise RequestError(
                f"Reading: channel_map: expected the path of a YAML file, so that a run can be read again; got "
                f"{type(self.channel_map).__name__}. Write these lines into a file, or read the table with "
                "Log.from_dataframe(table, channel_map={...}), which takes them as they are"
            )


AS_GUESSED = Reading()
"""Everything as the log itself says it."""
