"""Whose a message is: the boat's own, or that of a camera, a light, a buoy or a target beside it."""

import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence

from ..canonical import command_kind
from ..formats.base import Stream

_OTHERS = re.compile(
    r"(?<![a-z])(cam(era)?|optical|aruco|april_?tag|tag|marker|fiducial|gimbal|buoy|obstacle|target|goal|waypoint|light"
    r"|lamp|led|other|neighbou?r|beacon|landmark|object|detect(ion|ed|or)?|intruder|ais|zed|realsense|lidar|radar)s?(?![a-z])"
)
"""Words, in topics and frames, of what is on board or beside the boat and moves otherwise than it."""
_BODY = re.compile(r"(base_link|base_footprint|body)(_frd|_flu)?")
"""Frames of the boat itself: a pose in one of them is that of something else."""
_POSES = ("geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")
_COLOURS = frozenset("rgb")


def colours(streams: Iterable[Stream]) -> set[int]:
    """The streams (by `id`) that are colours: an `r` with a `g` and a `b` beside it in one message is no yaw rate."""
    found: dict[str, dict[str, Stream]] = defaultdict(dict)
    for stream in streams:
        parent, _, last = stream.name.lower().replace("/", ".").rpartition(":")[2].rpartition(".")
        if last in _COLOURS:
            found[f"{stream.topic}:{parent}"][last] = stream
    return {id(one) for named in found.values() if named.keys() >= _COLOURS for one in named.values()}


def others(streams: Sequence[Stream]) -> dict[str, str]:
    """The topics that are of something else than the boat -> the word or frame that tells.

    >>> import numpy as np
    >>> def one(topic, frame):
    ...     return Stream(topic, "pose.position.x", np.zeros(1), np.zeros(1), np.ones(1, int), frame=frame)
    >>> others([one("/odom", "odom"), one("/pose", "cam_optical"), one("/buoy/pose", "map")])
    {'/pose': "its frame 'cam_optical'", '/buoy/pose': 'its name'}
    """
    result: dict[str, str] = {}
    for stream in streams:
        frame = stream.frame.lower().strip("/").rpartition("/")[2]
        relative = _BODY.fullmatch(frame) and stream.kind.replace("/msg/", "/") in _POSES
        if stream.topic in result:
            continue
        if _OTHERS.search(stream.topic.lower()):
            result[stream.topic] = "its name"
        elif relative or _OTHERS.search(frame):
            result[stream.topic] = f"its frame '{stream.frame}'"
    return result


_HEADINGS, _PLACES, _SPEEDS = (
    ({"psi"}, {"qw"}),
    ({"x", "y"}, {"lat", "lon"}),
    ({"u", "v"}, {"x_dot", "y_dot"}, {"sog", "cog"}),
)


def unneeded(own: Collection[str], roles: Collection[str]) -> set[str]:
    """Of the roles that another thing's messages have, those that the boat's `own` roles make needless.

    Where the boat's own messages tell a heading, and a place or a speed, nothing of another thing is taken; else only
    what they do not tell in any form.
    """
    known = set(own)
    told = [any(way <= known for way in ways) for ways in (_HEADINGS, _PLACES, _SPEEDS)]
    commanded = any(command_kind(role) for role in known)
    if told[0] and (told[1] or told[2]):
        return {role for role in roles if commanded or command_kind(role) is None}
    forms = [
        set().union(*ways) | ({"qx", "qy", "qz"} if ways is _HEADINGS else set())
        for ways in (_HEADINGS, _PLACES, _SPEEDS)
    ]
    needless = set().union(*(form for form, has in zip(forms, told, strict=True) if has))
    return {role for role in roles if role in needless or (commanded and command_kind(role) is not None)}
