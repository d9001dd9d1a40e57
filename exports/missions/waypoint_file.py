"""A waypoint file (QGC WPL 110): go to the start, come to rest, hand over to the script, come back.

A line has twelve columns apart by tabs: number, current, frame, command, four parameters, latitude, longitude [deg],
altitude [m], autocontinue (https://mavlink.io/en/file_formats/#mission_plain_text_file). The script is called by
MAV_CMD_NAV_SCRIPT_TIME, which ArduPilot Rover has from 4.3 on.
"""

from math import ceil, cos, pi, radians, sin

from ...physics.errors import RequestError
from .base import Mission, MissionFormat

SCRIPT_COMMAND = 71
"""First parameter of NAV_SCRIPT_TIME, by which the script knows that it is meant: any number from 0 to 255."""
_NAV_WAYPOINT, _NAV_SCRIPT_TIME = 16, 42702
_ABSOLUTE, _RELATIVE = 0, 3
"""MAV_FRAME_GLOBAL of the home position, and MAV_FRAME_GLOBAL_RELATIVE_ALT."""
_LEAD_IN = 20.0
"""Metres before the start at which the boat turns onto its heading."""
_STILL = 5
"""Seconds that the boat holds still at the start, before the script's own rest."""
_MOST_TIMEOUT = 255
"""Seconds after which ArduPilot ends a script's step, at most: the parameter has one byte."""
_SPARE = 10
"""Seconds by which that is later than the script's own end."""
_METRES_A_DEGREE = 6378137.0 * pi / 180.0
"""Of latitude, on the sphere of WGS 84's equator: 0.6 % off at the poles, which is 0.1 m here."""


def _waypoints(mission: Mission) -> str:
    place = mission.place
    if place is None:
        raise RequestError("plan: a waypoint file needs a place; give --at LAT,LON")
    angle, start = radians(place.heading), (place.latitude, place.longitude)
    north, east = -_LEAD_IN * cos(angle), -_LEAD_IN * sin(angle)
    before = (
        start[0] + north / _METRES_A_DEGREE,
        start[1] + east / (_METRES_A_DEGREE * cos(radians(start[0]))),
    )
    timeout = min(_MOST_TIMEOUT, ceil(mission.seconds - 1e-9) + _SPARE)
    items = [
        (_ABSOLUTE, _NAV_WAYPOINT, (0, 0), start),
        (_RELATIVE, _NAV_WAYPOINT, (0, 0), before),
        (_RELATIVE, _NAV_WAYPOINT, (_STILL, 0), start),
        (_RELATIVE, _NAV_SCRIPT_TIME, (SCRIPT_COMMAND, timeout), (0.0, 0.0)),
        (_RELATIVE, _NAV_WAYPOINT, (0, 0), start),
    ]
    lines = ["QGC WPL 110"]
    for number, (frame, command, (one, two), (latitude, longitude)) in enumerate(items):
        cells = [number, int(number == 0), frame, command, one, two, 0, 0]
        lines.append("\t".join([*map(str, cells), f"{latitude:.8f}", f"{longitude:.8f}", "0", "1"]))
    return "\n".join(lines) + "\n"


WAYPOINTS = MissionFormat(
    "mission.waypoints", "waypoints for a ground station, with the step that starts mission.lua", _waypoints, True
)
