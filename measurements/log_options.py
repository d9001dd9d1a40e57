"""How logs are to be read, where they do not say it themselves: one argument of every verb."""

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

    Raises
    ------
    RequestError
        for a frame that is neither enu nor ned.
    """

    frame: str | None = None
    channel_map: str | os.PathLike[str] | None = None
    namespace: str | None = None
    as_is: bool = False

    def __post_init__(self) -> None:
        if self.frame not in (None, "enu", "ned"):
            raise RequestError(f"frame {self.frame!r}: expected enu or ned")


AS_GUESSED = Reading()
"""Everything as the log itself says it."""
