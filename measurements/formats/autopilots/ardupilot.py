"""Messages of an ArduPilot DataFlash log, binary or text, as the channels of a boat.

Fields and units are those of ArduPilot's "Onboard Message Log Messages" (Rover) and its `LOG_STRUCTURE` tables:
`XKF1`/`NKF1` Yaw [deg], VN VE [m/s], PN PE [m], GZ gyro bias [deg/s]; `XKF4`/`NKF4` PI primary core; `ATT` Yaw [deg];
`GPS` Lat Lng [deg], Spd [m/s], GCrs [deg], U in use; `IMU` GyrZ [rad/s], AccX AccY [m/s^2] in FRD; `RCOU` C1... [us].
"""

import re
from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....physics.errors import LogError
from ....physics.motion import Array
from ...canonical import local_metres
from ..base import Name, Recording, Request, Stream
from . import autopilot

_BOOKKEEPING = {"FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "FILE", "ISBD", "ISBH"}
"""Messages that hold no measurement."""
_FILTERS = {3: ("XKF1", "XKF4", "EK3_IMU_MASK"), 2: ("NKF1", "NKF4", "EK2_IMU_MASK")}
"""AHRS_EKF_TYPE -> state, health, and the parameter that gives each core its IMU."""
_CLOCKS = ("TimeUS", "TimeMS")
_OUTPUT = re.compile(r"(?:Chan|Ch|C)?(\d+)")
"""Fields of RCOU, by the number of the output."""
_FIX = 3
"""Least GPS status that is a fix in three dimensions."""


@dataclass(frozen=True, slots=True)
class Kind:
    """One type of message: its numeric fields, and the one that tells which sensor or filter a message is of."""

    fields: tuple[str, ...]
    sensor: str | None


class _Core(NamedTuple):
    """A core of the EKF: the type of its state, its number, and that of its IMU."""

    state: str
    number: int
    imu: int


class Messages(ABC):
    """The messages of a DataFlash file, binary or text.

    Attributes
    ----------
    kinds : types of which the log has messages, by name
    notes : what was lost
    """

    kinds: Mapping[str, Kind]
    notes: list[str]

    @abstractmethod
    def columns(self, name: str, fields: Collection[str]) -> Mapping[str, Array]:
        """Some fields of all messages of a type, (n,) each, by name."""

    @abstractmethod
    def texts(self) -> list[str]:
        """Give the messages in words, in the order in which they were logged."""

    @abstractmethod
    def parameters(self) -> list[tuple[str, float]]:
        """Give the parameters in the order in which they were logged."""

    def fields(self, name: str) -> tuple[str, ...]:
        """Numeric fields of a type of message, none when the log has no such message."""
        return self.kinds[name].fields if name in self.kinds else ()

    def sensors(self, name: str) -> tuple[int, ...] | None:
        """Tell the sensors or filters that the messages of a type are of; None for a type that tells none."""
        field = self.kinds[name].sensor if name in self.kinds else None
        if field is None:
            return None
        found = self.columns(name, (field,))[field]
        return tuple(int(number) for number in np.unique(found[np.isfinite(found)]))

    def table(self, name: str, sensor: int | None = None, fields: Sequence[str] = ()) -> autopilot.Table:
        """Give the messages of a type, of one sensor where there are several; of the fields, all when none is named.

        The clock is TimeUS [us], or TimeMS [ms] in logs before 2015. Messages whose stamps are out of order are left
        out where they are few, as bytes that were damaged make them.
        """
        wanted = [field for field in self.fields(name) if not fields or field in fields or field in _CLOCKS]
        of = None if sensor is None else self.kinds[name].sensor
        read = self.columns(name, wanted if of is None else {*wanted, of})
        own = slice(None) if of is None else read[of] == sensor
        columns = {field: read[field][own] for field in wanted}
        clock = columns["TimeUS"] if "TimeUS" in columns else 1e3 * columns["TimeMS"]
        keep = autopilot.in_order(clock)
        keep = slice(None) if keep.all() else keep
        values = {field: value[keep] for field, value in columns.items() if field not in _CLOCKS}
        topic = name if of is None else f"{name}[{sensor}]"
        return autopilot.Table(topic, f"dataflash/{name}", clock[keep] / 1e6, values)


def recording(log: Messages, request: Request, where: str) -> Recording:
    """Turn the messages of a log into channels of the boat, and offer all others by name.

    Raises
    ------
    LogError
        when the log has no message with a time stamp.
    """
    offered = _offered(log)
    if not offered:
        raise LogError(
            f"{where}: no message with a time stamp in this DataFlash log; it breaks off before the boat was logged. "
            "Copy the log again, or take the next one."
        )
    parameters, notes = _parameters(log)
    streams, told, core = _filter(log, parameters)
    if not streams:
        streams, told = _satellite(log)
    inertial, heard = _inertial(log, core)
    commands, driven = _commands(log, parameters)
    notes = [*log.notes, *notes, *told, *heard, *driven]
    derived = [*streams, *inertial, *commands, *_auxiliary(log)]
    chosen = autopilot.Choice(derived, [name for fields in offered.values() for name in fields], request, notes)
    read = []
    for (kind, sensor), names in offered.items():
        fields = [field for name, field in names.items() if name in chosen.wanted]
        if fields:
            read += log.table(kind, sensor, fields).raw(chosen.wanted)
    return chosen.recording(read, autopilot.by_firmware(log.texts(), "MSG"))


def _offered(log: Messages) -> dict[tuple[str, int | None], dict[Name, str]]:
    """Type and sensor of all messages that have a clock -> their fields, by the names under which they are offered."""
    result: dict[tuple[str, int | None], dict[Name, str]] = {}
    for kind in log.kinds:
        fields = [field for field in log.fields(kind) if field not in _CLOCKS]
        if kind in _BOOKKEEPING or len(fields) == len(log.fields(kind)):
            continue
        sensors = log.sensors(kind)
        for sensor in (None,) if sensors is None else sensors:
            topic = kind if sensor is None else f"{kind}[{sensor}]"
            names = autopilot.raw_names(topic, f"dataflash/{kind}", fields)
            result[kind, sensor] = dict(zip(names, fields, strict=True))
    return result


def _parameters(log: Messages) -> tuple[dict[str, float], list[str]]:
    values: dict[str, list[float]] = defaultdict(list)
    for name, value in log.parameters():
        if not values[name] or values[name][-1] != value:
            values[name].append(value)
    notes = [
        f"{name} changes during the log ({', '.join(f'{value:g}' for value in found)}); its last value is taken"
        for name, found in values.items()
        if len(found) > 1 and name.startswith("SERVO")
    ]
    return {name: found[-1] for name, found in values.items() if found}, notes


def _one(log: Messages, name: str, wanted: int | None, *fields: str) -> autopilot.Table | None:
    """Give the messages of a type and of the wanted sensor, else of the first one; None where a field is missing."""
    if not set(fields) <= set(log.fields(name)) or not set(_CLOCKS) & set(log.fields(name)):
        return None
    sensors = log.sensors(name)
    if not sensors:
        return log.table(name, None, fields)
    return log.table(name, wanted if wanted in sensors else sensors[0], fields)


def _filter(log: Messages, parameters: Mapping[str, float]) -> tuple[list[Stream], list[str], _Core | None]:
    """Heading, position and velocity of the primary core of the EKF that steers."""
    preferred = int(parameters.get("AHRS_EKF_TYPE", 3))
    for kind in sorted(_FILTERS, key=lambda kind: kind != preferred):
        state, health, mask = _FILTERS[kind]
        primary, switched = _primary(log, health)
        found = _one(log, state, primary, "Yaw", "VN", "VE", "PN", "PE")
        if found is None or not found.time.size:
            continue
        heading = np.radians(found.columns["Yaw"])
        columns = found.columns
        streams = autopilot.planar(found, (columns["PN"], columns["PE"]), (columns["VN"], columns["VE"]), heading)
        notes = [
            f"psi x y u v: from {found.topic}, the {'primary core' if primary is not None else 'first core'} of the "
            "EKF: Yaw in radians, PN PE from its origin, VN VE turned into body axes by its Yaw"
        ]
        if switched:
            notes.append(f"the autopilot changed its primary EKF core during the log ({switched}); one core is used")
        core = primary or 0
        imu = _imu_of(core, int(parameters.get(mask, 0)))
        return [found.stream("psi", heading), *streams], notes, _Core(state, core, imu)
    return [], [], None


def _primary(log: Messages, health: str) -> tuple[int | None, str]:
    """Core that was primary for most of the log, and the cores in words when there were several."""
    if "PI" not in log.fields(health):
        return None, ""
    found = _one(log, health, None, "PI")
    cores, count = np.unique(found.columns["PI"] if found else np.zeros(0), return_counts=True)
    if not cores.size:
        return None, ""
    return int(cores[np.argmax(count)]), ", ".join(f"{core:g}" for core in cores) if cores.size > 1 else ""


def _satellite(log: Messages) -> tuple[list[Stream], list[str]]:
    """Heading, position and velocity without an EKF: from the compass heading and the GPS receiver in use."""
    attitude = _one(log, "ATT", None, "Yaw")
    streams: list[Stream] = []
    notes = []
    heading = np.radians(attitude.columns["Yaw"]) if attitude is not None else np.zeros(0)
    if attitude is not None:
        streams.append(attitude.stream("psi", heading))
        notes.append(f"psi: from {attitude.topic}, Yaw in radians; the log has no state of an EKF")
    fix = _receiver(log)
    if fix is None:
        return streams, notes
    has = fix.columns["Status"] >= _FIX if "Status" in fix.columns else np.ones(fix.time.size, dtype=bool)
    latitude, longitude = (np.where(has, fix.columns[name], np.nan) for name in ("Lat", "Lng"))
    north, east, origin = local_metres(latitude, longitude)
    course, speed = np.radians(fix.columns["GCrs"]), np.where(has, fix.columns["Spd"], np.nan)
    turned = autopilot.heading_at(fix.time, attitude, heading)
    streams += autopilot.planar(fix, (north, east), (speed * np.cos(course), speed * np.sin(course)), turned)
    notes.append(
        f"x y u v: from {fix.topic}: metres from the first fix at {origin[0]:.7f}, {origin[1]:.7f} deg, and Spd along "
        f"GCrs turned into body axes; {np.count_nonzero(~has)} rows without a fix left out"
    )
    return streams, notes


def _receiver(log: Messages) -> autopilot.Table | None:
    """Find the GPS receiver that the autopilot used most, by U; the first one where the log does not say."""
    sensors = log.sensors("GPS")
    fields = ("Lat", "Lng", "Spd", "GCrs", *(name for name in ("Status", "U") if name in log.fields("GPS")))
    receivers = [found for number in sensors or (None,) if (found := _one(log, "GPS", number, *fields)) is not None]
    return max(receivers, key=lambda found: float(np.sum(found.columns.get("U", np.zeros(1)))), default=None)


def _inertial(log: Messages, core: _Core | None) -> tuple[list[Stream], list[str]]:
    """Yaw rate and accelerations of the IMU that the chosen EKF core looks at, less the gyro bias that it estimates."""
    imu = _one(log, "IMU", core and core.imu, "GyrZ", "AccX", "AccY")
    if imu is None or not imu.time.size:
        return [], []
    rate, notes = imu.columns["GyrZ"], []
    found = core and _one(log, core.state, core.number, "GZ")
    if found is not None and found.columns["GZ"].any():
        bias = np.radians(np.interp(imu.time, found.time, found.columns["GZ"]))
        rate = rate - bias
        low, high = float(bias.min()), float(bias.max())
        notes.append(f"r: less the gyro bias {found.topic}:GZ, {low:.2g} to {high:.2g} rad/s")
    notes.append(f"r ax ay: GyrZ, AccX and AccY of {imu.topic}")
    values = {"r": rate, "ax": imu.columns["AccX"], "ay": imu.columns["AccY"]}
    return [imu.stream(name, value) for name, value in values.items()], notes


def _auxiliary(log: Messages) -> list[Stream]:
    """Battery, motors, mode and waypoint: BAT, ESC, RPM, MODE and CMD of ArduPilot."""
    mode = next((field for field in ("ModeNum", "Mode") if field in log.fields("MODE")), "Mode")
    found = {
        "battery_voltage": (_one(log, "BAT", 0, "Volt"), "Volt", 1.0),
        "battery_current": (_one(log, "BAT", 0, "Curr"), "Curr", 1.0),
        "mode": (_one(log, "MODE", None, mode), mode, 1.0),
        "waypoint": (_one(log, "CMD", None, "CNum"), "CNum", 1.0),
        "rpm_1": (_one(log, "RPM", None, "rpm1"), "rpm1", 1.0),
        "rpm_2": (_one(log, "RPM", None, "rpm2"), "rpm2", 1.0),
    }
    for number in log.sensors("ESC") or ():
        found[f"rpm_esc{number + 1}"] = (_one(log, "ESC", number, "RPM"), "RPM", 1.0)
        found[f"motor_current_esc{number + 1}"] = (_one(log, "ESC", number, "Curr"), "Curr", 1.0)
    return autopilot.auxiliary_of_columns(found)


def _imu_of(core: int, mask: int) -> int:
    """IMU of a core: the cores take the set bits of the mask in turn."""
    bits = [bit for bit in range(8) if mask >> bit & 1]
    return bits[core] if core < len(bits) else core


def _commands(log: Messages, parameters: Mapping[str, float]) -> tuple[list[Stream], list[str]]:
    numbered = ((_OUTPUT.fullmatch(field), field) for field in log.fields("RCOU"))
    outputs = {int(match[1]): field for match, field in numbered if match}
    found = _one(log, "RCOU", None, *outputs.values()) if outputs else None
    if found is None:
        return [], ["the log has no RCOU messages, so no thruster command; set LOG_BITMASK to log RC output"]
    return autopilot.servo_commands(found, outputs, parameters)
