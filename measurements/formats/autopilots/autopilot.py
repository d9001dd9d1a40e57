"""Parts that the readers of autopilots share: messages as columns, thruster outputs, velocities in body axes.

Also which kind of vehicle an autopilot says that it steers: a boat, or something that is none.
"""

import bisect
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from io import StringIO

import numpy as np
from numpy.typing import NDArray

from ....physics.motion import Array, earth_to_body
from ...canonical import LIMITS, Output, auxiliary_unit, is_canonical
from ..base import Craft, CraftEvidence, Name, Recording, Request, Stream

AUTOPILOTS = ("dataflash/", "mavlink/", "ulog/")
"""How the kinds of an autopilot's messages begin."""
_LOST, _FEW = 0.01, 3
"""Share and number of rows whose stamps may be out of order; where there are more, they are left as they are."""
_FUNCTIONS = {70: ("throttle", "Throttle"), 73: ("port", "ThrottleLeft"), 74: ("stbd", "ThrottleRight")} | {
    function: (f"motor{function - 32}", f"Motor{function - 32}") for function in range(33, 41)
}
"""SERVOn_FUNCTION of ArduPilot that drives a thruster: our name of the thruster, and ArduPilot's."""
_STEERING = {26: "steering_ground"}
"""SERVOn_FUNCTION of ArduPilot that steers (GroundSteering): the auxiliary channel."""
_NO_PULSE = (0.0, 65535.0)
"""Outputs that drive nothing: 0, and UINT16_MAX of a channel that is not used (MAVLink, common.xml)."""
_DEFAULTS = {"MIN": 1100.0, "TRIM": 1500.0, "MAX": 1900.0, "REVERSED": 0.0}
"""Of SERVOn_..., where the log does not say (ArduPilot, SRV_Channel.cpp)."""
_SHAPE = {"THST_EXPO": (0.0, -1.0, 1.0), "THST_ASYM": (1.0, 1.0, 10.0), "THR_MIN": (0.0, 0.0, 99.0)}
"""Of MOT_..., where the log does not say, and the least and the most that count (ArduPilot, AP_MotorsUGV.cpp)."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """All messages of one type, and of one sensor where there are several.

    Attributes
    ----------
    topic : what the log calls them, such as `XKF1[0]`
    kind : their type, such as `dataflash/XKF1`
    time : (n,) [s]
    columns : field -> (n,), in the file's own unit
    row : (n,) numbers of the messages, one array for all streams of a long log
    """

    topic: str
    kind: str
    time: Array
    columns: Mapping[str, Array]
    row: NDArray[np.int64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", np.arange(1, self.time.size + 1, dtype=np.int64))

    def names(self) -> tuple[Name, ...]:
        """Names under which the fields are offered."""
        return raw_names(self.topic, self.kind, self.columns)

    def raw(self, wanted: frozenset[Name]) -> list[Stream]:
        """Give the fields that are wanted, as the file holds them."""
        pairs = zip(self.names(), self.columns.values(), strict=True)
        return [self.stream(name.field, value) for name, value in pairs if name in wanted]

    def stream(self, field: str, value: Array) -> Stream:
        """Give values (n,) at the stamps of the messages a name."""
        return Stream(self.topic, field, self.time, np.asarray(value, dtype=float), self.row, self.kind)


def raw_names(topic: str, kind: str, fields: Sequence[str] | Mapping[str, Array]) -> tuple[Name, ...]:
    """Name fields as the file does; one that would pass for a channel, as a setpoint `x`, is `raw.x`."""
    taken = {field for field in fields if is_canonical(field) or auxiliary_unit(field) is not None}
    return tuple(Name(topic, f"raw.{field}" if field in taken else field, kind) for field in fields)


class Choice:
    """What is wanted of the channels that a reader has made, and of the names of everything else, still to be read.

    Parameters
    ----------
    derived : the channels
    raw : the names
    request : asked which are wanted
    notes : on the channels
    """

    def __init__(self, derived: Sequence[Stream], raw: Sequence[Name], request: Request, notes: Sequence[str]) -> None:
        self.raw, self.notes = tuple(raw), tuple(notes)
        self.wanted = request.choose(list(dict.fromkeys([*(stream.label for stream in derived), *raw])))
        self.derived = tuple(stream for stream in derived if stream.label in self.wanted)

    def recording(self, read: Sequence[Stream], craft: CraftEvidence | None = None) -> Recording:
        """Join the channels and the streams that were read for the rest, of that kind of vehicle."""
        unread = tuple(name for name in self.raw if name not in self.wanted)
        return Recording((*self.derived, *read), self.notes, unread, crafts={"": craft} if craft else {})


def numbers(values: NDArray) -> Array:
    """Turn a column (n,) into numbers, however damaged; halves of a damaged message may be no number at all."""
    with np.errstate(invalid="ignore", over="ignore"):
        return values.astype(np.float64)


def in_order(time: Array) -> NDArray[np.bool_]:
    """Mark the rows (n,) to keep so that stamps never fall, where a few damaged ones stand out; else all rows."""
    if time.size < 2 or (np.diff(time) >= 0).all():
        return np.ones(time.size, dtype=bool)
    ends: list[float] = []
    last: list[int] = []
    before = np.full(time.size, -1, dtype=np.int64)
    for row, stamp in enumerate(time.tolist()):
        place = bisect.bisect_right(ends, stamp)
        before[row] = last[place - 1] if place else -1
        if place == len(ends):
            ends.append(stamp)
            last.append(row)
        else:
            ends[place], last[place] = stamp, row
    keep = np.zeros(time.size, dtype=bool)
    row = last[-1]
    while row >= 0:
        keep[row] = True
        row = int(before[row])
    return keep if np.sum(~keep) <= max(_FEW, _LOST * keep.size) else np.ones(time.size, dtype=bool)


def planar(table: Table, where: tuple[Array, Array], speed: tuple[Array, Array], heading: Array | None) -> list[Stream]:
    """Give `x y u v` from earth-fixed quantities at the stamps of a table; `x y` alone without a heading.

    Parameters
    ----------
    table : whose stamps they have
    where : north and east (n,), (n,) [m]
    speed : towards north and east over ground (n,), (n,) [m/s]
    heading : (n,) [rad], clockwise from north; None where the log tells none
    """
    values = {"x": where[0], "y": where[1]}
    if heading is not None:
        with np.errstate(invalid="ignore", over="ignore"):
            values["u"], values["v"] = earth_to_body(heading, *speed)
    return [table.stream(name, value) for name, value in values.items()]


def heading_at(time: Array, table: Table | None, heading: Array) -> Array | None:
    """Heading [rad] of a table at other stamps (n,), the short way round; no number outside its first and last.

    None without a table.
    """
    if table is None:
        return None
    known = np.isfinite(heading)
    if not known.any():
        return np.full(time.size, np.nan)
    turned = np.unwrap(heading[known])
    return np.interp(time, table.time[known], turned, left=np.nan, right=np.nan)


def servo_commands(
    table: Table, outputs: Mapping[int, str], parameters: Mapping[str, float]
) -> tuple[list[Stream], list[str]]:
    """Give the command channel of each thruster that ArduPilot's parameters name, more always being ahead.

    A reversed output is mirrored about its trim: for it ArduPilot changes the sign of the demand before
    PWM = trim + demand (max - trim) ahead and trim + demand (trim - min) astern (`SRV_Channel::pwm_from_angle`). The
    values stay microseconds as sent otherwise; neutral and range are told in the notes, for the vehicle's curve.

    Parameters
    ----------
    table : the outputs [us]
    outputs : number of an output -> its column
    parameters : SERVOn_FUNCTION, _MIN, _TRIM, _MAX, _REVERSED, as the log holds them

    Returns
    -------
    (streams, notes)
    """
    streams: dict[str, Stream] = {}
    notes = []
    for number, column in sorted(outputs.items()):
        function = parameters.get(f"SERVO{number}_FUNCTION")
        number_of = int(function) if function is not None else -1
        thruster, called = _FUNCTIONS.get(number_of, ("", ""))
        if number_of in _STEERING:
            streams.setdefault(_STEERING[number_of], table.stream(_STEERING[number_of], table.columns[column]))
        if not thruster:
            continue
        name = f"pwm_{thruster}"
        if name in streams:
            notes.append(f"{name}: output {number} carries {called} as well; the first one is used")
            continue
        settings = {key: parameters.get(f"SERVO{number}_{key}", null) for key, null in _DEFAULTS.items()}
        value, output, told = _ahead(table.columns[column], number, settings, parameters)
        streams[name] = replace(table.stream(name, value), output=output)
        assumed = [f"SERVO{number}_{key}" for key in _DEFAULTS if f"SERVO{number}_{key}" not in parameters]
        usual = f"; {' '.join(assumed)} not in the log, ArduPilot's defaults taken" if assumed else ""
        notes.append(
            f"{name}: output {number}, {table.topic}:{column} (SERVO{number}_FUNCTION {called}), {told}{usual}"
        )
    if not any(is_canonical(name) for name in streams):
        told = any(re.fullmatch(r"SERVO\d+_FUNCTION", name) for name in parameters)
        moving = {} if told else {f"pwm_{n}": c for n, c in sorted(outputs.items()) if _moves(table.columns[c])}
        streams |= {name: table.stream(name, _pulses(table.columns[column])) for name, column in moving.items()}
        listed = ", ".join(f"{table.topic}:{column}" for _, column in sorted(outputs.items())[:4])
        numbered = f"; those that move have their numbers: {', '.join(moving)}" if moving else ""
        notes.append(
            "no parameter SERVOn_FUNCTION of the log names a thruster, so no output is taken as a command of a side"
            f"{numbered}: map them, for example pwm_port, from {listed}, ..."
        )
    return list(streams.values()), notes


def _moves(pwm: Array) -> bool:
    """True when an output [us] sends pulses, and not always the same."""
    values = pwm[~np.isin(pwm, _NO_PULSE)]
    return bool(
        values.size and np.ptp(values) > 0.0 and values.min() >= LIMITS["pwm"][0] and values.max() <= LIMITS["pwm"][1]
    )


def _pulses(pwm: Array) -> Array:
    """An output [us], NaN where it sends no pulses."""
    return np.where(np.isin(pwm, _NO_PULSE), np.nan, pwm)


def auxiliary_of_columns(tables: Mapping[str, tuple[Table | None, str, float]]) -> list[Stream]:
    """Auxiliary channels by name, each of a column of a table and in its unit; those that are there.

    Parameters
    ----------
    tables : name -> (messages or None, column, scale); NaN and what is not driven stay NaN
    """
    return [
        table.stream(name, scale * table.columns[column])
        for name, (table, column, scale) in tables.items()
        if table is not None and column in table.columns
    ]


def _ahead(
    pwm: Array, number: int, settings: Mapping[str, float], parameters: Mapping[str, float]
) -> tuple[Array, Output, str]:
    """Turn an output [us] so that more is ahead; what the parameters say of it; and how it was turned, in words.

    Thrust over command is what ArduPilot takes it for where it makes commands of demands (`MOT_THST_EXPO`,
    `MOT_THST_ASYM`, `MOT_THR_MIN` in per cent; AR_Motors, AP_MotorsUGV.cpp, get_scaled_throttle and
    output_skid_steering).
    """
    low, trim, high, reversed = (settings[key] for key in ("MIN", "TRIM", "MAX", "REVERSED"))
    silent = np.isin(pwm, _NO_PULSE)
    value = np.where(silent, trim, 2.0 * trim - pwm if reversed else pwm)
    astern, ahead = (2.0 * trim - high, 2.0 * trim - low) if reversed else (low, high)
    source = ", ".join(f"SERVO{number}_{key} {settings[key]:g}" for key in settings)
    shape = {key: parameters[f"MOT_{key}"] for key in _SHAPE if f"MOT_{key}" in parameters}
    source = ", ".join([source, *(f"MOT_{key} {found:g}" for key, found in shape.items())])
    expo, asymmetry, least = (
        found if low <= (found := shape.get(key, null)) <= high else null for key, (null, low, high) in _SHAPE.items()
    )
    output = Output(trim, astern, ahead, source, expo, asymmetry, least / 100.0)
    text = (
        f"neutral {trim:g} us, full astern {astern:g} us, full ahead {ahead:g} us: the thruster's curve must have them"
    )
    if reversed:
        text += f"; the output is reversed (ahead is below neutral), mirrored here as {2.0 * trim:g} us - value"
    if silent.any():
        text += f"; {np.count_nonzero(silent)} rows without pulses (disarmed) taken as neutral"
    return value, output, text


@contextmanager
def silenced() -> Iterator[None]:
    """Keep what a library prints about a damaged file off the terminal; the notes say it."""
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        yield


_FIRMWARE = re.compile(r"\b(?:Ardu|APM:?|AntennaTracker|Blimp)(Boat|Rover|Copter|Plane|Sub)?", re.IGNORECASE)
_CALLED = {
    "boat": Craft.BOAT,
    "rover": Craft.ROVER,
    "copter": Craft.COPTER,
    "plane": Craft.PLANE,
    "sub": Craft.SUBMARINE,
    "antennatracker": Craft.TRACKER,
    "blimp": Craft.AIRSHIP,
}
"""What ArduPilot's firmware calls itself in its first message (`fwver.fw_string`, AP_FWVersion.h)."""
_MAV_TYPES = {
    Craft.PLANE: (1, 16, 19, 20, 21, 22, 23, 24, 25, 28),
    Craft.COPTER: (2, 3, 4, 13, 14, 15, 29, 35),
    Craft.TRACKER: (5,),
    Craft.AIRSHIP: (7, 8),
    Craft.ROVER: (10,),
    Craft.BOAT: (11,),
    Craft.SUBMARINE: (12,),
}
"""MAV_TYPE of vehicles that steer themselves (MAVLink, minimal.xml); others are ground stations and parts."""
_PX4 = {1: Craft.COPTER, 2: Craft.PLANE, 3: Craft.ROVER, 4: Craft.AIRSHIP}
"""`vehicle_status.vehicle_type` of PX4 (VehicleStatus.msg); 0 is unknown."""


def by_firmware(texts: Iterable[str], where: str) -> CraftEvidence | None:
    """The kind that the first text tells in which an ArduPilot firmware names itself; `where` the texts stand.

    >>> by_firmware(["Frame: UNSUPPORTED", "ArduSub V4.1.0 (f2af3c7e)"], "MSG").craft
    <Craft.SUBMARINE: 'a submarine'>
    """
    for text in texts:
        found = _FIRMWARE.match(text.strip())
        craft = _CALLED.get((found[1] or found[0]).lower()) if found else None
        if craft is not None:
            return CraftEvidence(craft, f"{where}: {' '.join(text.split()[:2])}")
    return None


def by_mav_type(number: int, where: str) -> CraftEvidence | None:
    """The kind of a MAV_TYPE; None for one that says nothing, or is no vehicle's.

    >>> by_mav_type(12, "HEARTBEAT").sentence
    'the log is of a submarine, which is no surface vessel (HEARTBEAT: MAV_TYPE 12)'
    """
    craft = next((craft for craft, numbers in _MAV_TYPES.items() if number in numbers), None)
    return craft and CraftEvidence(craft, f"{where}: MAV_TYPE {number}")


def by_px4_status(number: int) -> CraftEvidence | None:
    """The kind of PX4's `vehicle_status.vehicle_type`; None for one that says nothing."""
    return CraftEvidence(_PX4[number], f"vehicle_status: vehicle_type {number}") if number in _PX4 else None
