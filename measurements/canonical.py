"""The canonical channels of a log: names, units and possible values, and fixes turned into local metres."""

import re
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..physics.errors import LogError
from ..physics.motion import Array

MOTION = ("x", "y", "psi", "u", "v", "r")
QUATERNION = ("qx", "qy", "qz", "qw")
PLACE = ("lat", "lon")
RATES = ("x_dot", "y_dot")
TRACK = ("sog", "cog")

UNITS = {
    **dict.fromkeys(("x", "y"), "m"),
    "psi": "rad",
    **dict.fromkeys(("u", "v"), "m/s"),
    "r": "rad/s",
    **dict.fromkeys(("ax", "ay"), "m/s^2"),
    **dict.fromkeys(("wind_u", "wind_v"), "m/s"),
    **dict.fromkeys(QUATERNION, "1"),
    **dict.fromkeys((*RATES, "sog"), "m/s"),
    "cog": "rad",
    **dict.fromkeys(PLACE, "deg"),
}
"""Canonical channels of motion and their units; earth axes NED, body axes FRD. `wind_u`, `wind_v` are the velocity of
the air relative to the boat, in body axes, as an anemometer on board measures it. When a log is read a quaternion
becomes `psi`, latitude and longitude become `x` and `y`, and the velocity along `x` and `y`, or speed and course over
ground (`sog`, and `cog` clockwise from north), become `u` and `v`."""

COMMAND_UNITS = {"pwm": "us", "normalized": "1", "rad_s": "rad/s", "newton": "N", "tau": "N"}
"""Kinds of thruster command and their units; a command channel is named `<kind>_<thruster>`. Generalised forces are
`tau_surge`, `tau_sway` [N] and `tau_yaw` [N m]."""

LIMITS = {
    **dict.fromkeys(("x", "y"), (-1e8, 1e8)),
    **dict.fromkeys(("u", "v", "x_dot", "y_dot", "sog"), (-100.0, 100.0)),
    "r": (-50.0, 50.0),
    **dict.fromkeys(("ax", "ay"), (-1e4, 1e4)),
    **dict.fromkeys(("wind_u", "wind_v"), (-150.0, 150.0)),
    **dict.fromkeys(("qx", "qy", "qz", "qw"), (-1e6, 1e6)),
    "lat": (-90.0, 90.0),
    "lon": (-180.0, 360.0),
    "pwm": (800.0, 2200.0),
    "normalized": (-1.05, 1.05),
    "rad_s": (-1e5, 1e5),
    "newton": (-1e7, 1e7),
    "tau": (-1e9, 1e9),
}
"""What a channel of motion, or a command of a kind, may be [its unit]; anything else is another unit or kind."""

AUXILIARY_UNITS = {"battery_voltage": "V", "battery_current": "A", "mode": "1", "waypoint": "1"}
"""What a log has beside motion and commands; currents are positive while the battery gives them."""
AUXILIARY_KINDS = {"motor_current": "A", "rpm": "1/min", "steering": "1"}
"""Of one motor or actuator, `<kind>_<which>`; steering is kept as it is recorded, in pulses, shares or radians."""

_PLACED = "|".join(kind for kind in COMMAND_UNITS if kind != "tau")
_COMMAND = re.compile(rf"({_PLACED}|tau(?=_(?:surge|sway|yaw)$))_(\w+)")


@dataclass(frozen=True, slots=True)
class Lost:
    """What a channel lost, or had to be sorted, when it was read.

    Attributes
    ----------
    empty : rows without a number
    repeated : rows whose stamp another row repeats
    backward : rows that stood after a later one, and were sorted
    astray : rows whose stamp is far out of order, alone among others that are not
    sets : (when, by how much) the clock was set while the log was written [s]; what follows was moved
    """

    empty: int = 0
    repeated: int = 0
    backward: int = 0
    astray: int = 0
    sets: tuple[tuple[float, float], ...] = ()

    @property
    def disordered(self) -> bool:
        """True when time runs backwards in the file."""
        return self.backward > 0 or any(by < 0.0 for _, by in self.sets)


@dataclass(frozen=True, slots=True)
class Output:
    """What an autopilot's parameters say of an output that drives a thruster, as its channel has it.

    Attributes
    ----------
    neutral, astern, ahead : where the thruster stands still, and full commands to either side [the channel's unit];
        astern and neutral are the same for one that goes ahead only
    source : the parameters that say so
    expo : share of the square in thrust over command c, which is (1 - expo) c + expo c^2
    asymmetry : full thrust ahead over that astern
    least : share of the command up to which the thruster stands still
    """

    neutral: float
    astern: float
    ahead: float
    source: str
    expo: float = 0.0
    asymmetry: float = 1.0
    least: float = 0.0

    def mapped(self, scale: float, offset: float) -> "Output":
        """The same of a channel that is `scale` times the output plus `offset`."""
        neutral, astern, ahead = (scale * value + offset for value in (self.neutral, self.astern, self.ahead))
        return replace(self, neutral=neutral, astern=astern, ahead=ahead)


@dataclass(frozen=True, eq=False)
class Channel:
    """One canonical channel of a log.

    Attributes
    ----------
    name : canonical name
    time : (n,) [s], strictly increasing
    value : (n,) in the unit of the channel, finite
    origin : where in the file it came from: `topic:field`, or the column
    lost : what it lost when it was read
    output : of a command, what the autopilot's parameters say of it; None where the log does not tell
    """

    name: str
    time: Array
    value: Array
    origin: str
    lost: Lost = Lost()
    output: Output | None = None

    @cached_property
    def period(self) -> float:
        """Usual step of the time stamps [s], gaps and jitter averaged out; zero for a single sample."""
        if self.time.size < 2:
            return 0.0
        steps = np.diff(self.time)
        middle = float(np.median(steps))
        usual = steps[(steps > 0.5 * middle) & (steps < 1.5 * middle)]
        return float(usual.mean()) if usual.size else middle

    @property
    def unwrapped(self) -> Array:
        """The values (n,), a heading without its jumps by a full turn."""
        return np.unwrap(self.value) if self.name == "psi" else self.value

    def rows(self, keep: NDArray[np.bool_]) -> "Channel":
        """The same channel with some of its rows (n,)."""
        return replace(self, time=self.time[keep], value=self.value[keep])

    @property
    def unit(self) -> str:
        """The unit of the values."""
        return unit_of(self.name)


def command_kind(name: str) -> tuple[str, str] | None:
    """Split a name into kind and thruster of a command channel, None for any other name.

    >>> command_kind("rad_s_port")
    ('rad_s', 'port')
    """
    found = _COMMAND.fullmatch(name)
    return (found.group(1), found.group(2)) if found else None


def kind_of(name: str) -> str:
    """The kind of a command channel, empty for any other name.

    >>> kind_of("pwm_port"), kind_of("psi")
    ('pwm', '')
    """
    return (command_kind(name) or ("", name))[0]


def auxiliary_unit(name: str) -> str | None:
    """The unit of an auxiliary channel, None for any other name.

    >>> auxiliary_unit("rpm_port"), auxiliary_unit("r")
    ('1/min', None)
    """
    own = (unit for kind, unit in AUXILIARY_KINDS.items() if name == kind or name.startswith(f"{kind}_"))
    return AUXILIARY_UNITS.get(name) or next(own, None)


def in_vehicle_file(name: str) -> str:
    """The name under which a vehicle file can have a command: a thruster's name there begins with a letter.

    >>> in_vehicle_file("newton_1"), in_vehicle_file("newton_port")
    ('newton_thruster1', 'newton_port')
    """
    kind, thruster = command_kind(name) or ("", name)
    return name if thruster[:1].isalpha() else f"{kind}_thruster{thruster}"


def is_canonical(name: str) -> bool:
    """True when `name` is a canonical channel of motion or a command channel."""
    return name in UNITS or command_kind(name) is not None


def unit_of(name: str) -> str:
    """Return the unit of a canonical or an auxiliary channel.

    >>> unit_of("r"), unit_of("pwm_port")
    ('rad/s', 'us')
    """
    command = command_kind(name)
    if command == ("tau", "yaw"):
        return "N m"
    return COMMAND_UNITS[command[0]] if command else auxiliary_unit(name) or UNITS[name]


def check_limits(channel: Channel, where: str) -> None:
    """Refuse values that cannot be what the channel's name says; a heading may be any angle.

    Raises
    ------
    LogError
        for a value outside the `LIMITS` of its channel, or of its kind of command.
    """
    command = command_kind(channel.name)
    limits = LIMITS.get(command[0] if command else channel.name)
    if limits is None:
        return
    low, high = limits
    outside = np.flatnonzero((channel.value < low) | (channel.value > high))
    if outside.size:
        first = int(outside[0])
        unit = " Is it in degrees per second?" if channel.name == "r" else ""
        largest = float(np.abs(channel.value).max())
        if command and command[0] == "normalized" and largest <= 2.0 * high:
            unit = " Are they throttle and steering, sum and difference of two sides? Then mix them ('mix: skid')."
        elif command and command[0] == "normalized" and largest <= 100.0 * high:
            unit = f" Is it in percent? Map it with '{channel.name}: {{from: {channel.origin}, unit: percent}}'."
        raise LogError(
            f"{where}: {channel.name} ({channel.origin}) must lie within {low:g} to {high:g} [{channel.unit}], got "
            f"{channel.value[first]:g} at t = {channel.time[first]:.3f} s ({outside.size} such values).{unit} Cut "
            f"those rows, correct the unit with scale and offset in a channel map, or leave it out: "
            f"'{channel.name}: null'."
        )


SEMI_MAJOR_AXIS = 6378137.0
"""Of the WGS 84 ellipsoid [m] (NGA.STND.0036, table 3.1)."""
FLATTENING = 1.0 / 298.257223563
"""Of the WGS 84 ellipsoid (NGA.STND.0036, table 3.1)."""


def local_metres(latitude: Array, longitude: Array) -> tuple[Array, Array, tuple[float, float]]:
    """Metres north and east of the first fix, in the tangent plane of the WGS 84 ellipsoid there.

    The fix, at height zero, is taken to earth-centred axes and turned into the north and east of the first one (Fossen
    2021, chapter 2, ECEF and NED axes); nothing is linearised. The plane leaves the surface: the distance to a point
    10 km off comes out 4 mm too short.

    Parameters
    ----------
    latitude, longitude : (n,) [deg]; a fix that is not finite stays without a number

    Returns
    -------
    (north, east, origin) : (n,) [m], (n,) [m], and latitude and longitude of the first finite fix [deg]; the origin is
        not a number when there is no fix.

    Examples
    --------
    One minute of latitude is about a nautical mile:

    >>> north, east, origin = local_metres(np.array([60.0, 60.0 + 1.0 / 60.0]), np.array([10.0, 10.0]))
    >>> float(north[1].round(1)), float(abs(east[1]).round(6)), origin
    (1856.9, 0.0, (60.0, 10.0))
    """
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not known.size:
        return np.full(latitude.shape, np.nan), np.full(latitude.shape, np.nan), (np.nan, np.nan)
    origin = float(latitude[known[0]]), float(longitude[known[0]])
    phi, across = np.radians(latitude), np.radians(longitude - origin[1])
    start = np.radians(origin[0])
    # Earth-centred axes turned by the origin's longitude, so that east is the second axis: no loss by cancellation.
    reach, height = _meridian(phi)
    first_reach, first_height = _meridian(start)
    outward = reach * np.cos(across) - first_reach
    north = np.cos(start) * (height - first_height) - np.sin(start) * outward
    return np.asarray(north, float), np.asarray(reach * np.sin(across), float), origin


def _meridian(phi: Array | np.floating) -> tuple[Array, Array]:
    """Distance from the axis and from the equator's plane [m] of the ellipsoid's surface at latitude `phi` [rad]."""
    squared = FLATTENING * (2.0 - FLATTENING)
    normal = SEMI_MAJOR_AXIS / np.sqrt(1.0 - squared * np.sin(phi) ** 2)
    return normal * np.cos(phi), normal * (1.0 - squared) * np.sin(phi)
