"""MAVLink telemetry logs (`.tlog`): what their messages mean, and the channels of each vehicle.

Fields and units are those of MAVLink's common message set: `ATTITUDE` yaw [rad], yawspeed [rad/s];
`LOCAL_POSITION_NED` x y [m], vx vy [m/s]; `GLOBAL_POSITION_INT` lat lon [1e-7 deg], vx vy [cm/s], hdg [0.01 deg];
`SERVO_OUTPUT_RAW` servoN_raw [us]; `SCALED_IMU`, and `RAW_IMU` as ArduPilot fills it, xacc yacc [mG]; `PARAM_VALUE`.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....physics.errors import LogError
from ....physics.motion import GRAVITY, Array
from ...canonical import local_metres
from ..base import CraftEvidence, Format, Head, Name, Recording, Request, Stream
from . import autopilot
from .mavlink import MOTION, Definition, Key, Messages, Telemetry, definition_of, message_at

_CLOCKS = {"time_boot_ms": 1e3, "time_usec": 1e6}
"""Field of the vehicle's own clock -> ticks per second."""
_OUT_OF_STEP = 1.0
"""A message whose clock differs by more than this [s] from the others' has another clock."""
_ARDUPILOT = 3
"""MAV_AUTOPILOT of ArduPilot in HEARTBEAT."""
_UNKNOWN = 65535
"""UINT16_MAX where a number of 16 bits is not known, such as a heading, a speed or a voltage (MAVLink, common.xml)."""
_FIX = 3
"""Least GPS_FIX_TYPE that is a fix in three dimensions."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """One vehicle of a log: its system and its autopilot's component, and how its messages' topics begin."""

    system: int
    component: int
    prefix: str


def recording(log: Messages, request: Request, where: str, others: Recording | None = None) -> Recording:
    """Turn the messages of a log into channels of its vehicles, and offer all others by name.

    Parameters
    ----------
    others : what the file holds beside, by the stamps of its receipt

    Raises
    ------
    LogError
        when no vehicle tells its attitude or position.
    """
    numbers = {definition_of(key[2]).name: key[2] for key in log.messages()}
    vehicles = _vehicles(log.messages(), [numbers[name] for name in MOTION if name in numbers])
    if not vehicles:
        raise LogError(
            f"{where}: expected {', '.join(MOTION)} of a vehicle in this telemetry log, got "
            f"{', '.join(sorted(numbers)[:8]) or 'no message'}. Was the vehicle connected while it was recorded?"
        )
    notes: list[str] = []
    topics: dict[str, tuple[Vehicle, Key]] = {}
    owners = {(vehicle.system, vehicle.component): vehicle for vehicle in vehicles}
    readers = {vehicle: _Reader(log, vehicle, numbers, notes) for vehicle in vehicles}
    derived = [stream for reader in readers.values() for stream in _channels(reader)]
    names: list[Name] = []
    for key in log.messages():
        told = definition_of(key[2])
        owner = owners.get(key[:2])
        topic = f"{owner.prefix if owner else f'sys{key[0]}/comp{key[1]}/'}{told.name}"
        names += autopilot.raw_names(topic, f"mavlink/{told.name}", _values(told))
        topics[topic] = owner or vehicles[0], key
    if len(vehicles) > 1:
        listed = ", ".join(vehicle.prefix.rstrip("/") for vehicle in vehicles)
        notes.append(f"{len(vehicles)} vehicles in the log: {listed}")
    chosen = autopilot.Choice(derived, names, request, notes)
    wanted = {name.topic for name in names if name in chosen.wanted}
    read = []
    for topic, (owner, key) in topics.items():
        table = readers[owner].table(key, topic) if topic in wanted else None
        read += [] if table is None else table.raw(chosen.wanted)
    told = {of.prefix: craft for of in vehicles if (craft := _craft(readers[of])) is not None}
    unread = chosen.recording(()).unread
    if others is not None:
        # The same instant is zero for all: when the first vehicle was switched on.
        later = others.start_ns / 1e9 - next(iter(readers.values())).boot
        read += [replace(stream, time=stream.time + later) for stream in others.streams]
        notes, unread = [*others.notes, *notes], (*unread, *others.unread)
    return Recording((*chosen.derived, *read), (*log.notes, *notes), unread, crafts=told)


def _craft(reader: "_Reader") -> CraftEvidence | None:
    """What kind of vehicle says so in its HEARTBEAT, or where that is generic, in its first words."""
    beats, texts = reader.bodies("HEARTBEAT"), reader.bodies("STATUSTEXT")
    told = autopilot.by_mav_type(int(np.bincount(beats["type"]).argmax()), "HEARTBEAT") if len(beats) else None
    words = [text.decode("latin-1") for text in texts["text"].tolist()] if len(texts) else []
    return told or autopilot.by_firmware(words, "STATUSTEXT")


def _vehicles(keys: Sequence[Key], telling: Sequence[int]) -> tuple[Vehicle, ...]:
    """List the systems that tell a motion; of each, the component that tells most of it, the lowest one at a tie."""
    counts = Counter(key[:2] for key in keys if key[2] in telling)
    leading = dict(sorted(counts, key=lambda of: (of[0], counts[of], -of[1])))  # the last component of a system
    several = len(leading) > 1
    return tuple(Vehicle(*of, f"sys{of[0]}/" if several else "") for of in leading.items())


class _Reader:
    """Unpacks messages of one vehicle on its own clock, and notes where it could not."""

    def __init__(self, log: Messages, vehicle: Vehicle, numbers: Mapping[str, int], notes: list[str]) -> None:
        self._log, self.vehicle, self.notes = log, vehicle, notes
        self._keys = {name: (vehicle.system, vehicle.component, number) for name, number in numbers.items()}
        self._boot: float | None = None
        self._restarts = False

    @property
    def boot(self) -> float:
        """When the vehicle was switched on, as receive times count [s]; 0 where nothing tells it."""
        return self._boot or 0.0

    def set_clock(self) -> None:
        """Learn from the messages of the motion when the vehicle was switched on, as receive times count [s]."""
        for name in MOTION:
            if name not in self._keys:
                continue
            body, received = self._log.rows(self._keys[name])
            clock = _clock(body)
            if clock is None or not clock.size:
                continue
            if not _runs_on(clock):
                self._restarts = True
                whose = self.vehicle.prefix.rstrip("/") or "the vehicle"
                self.notes.append(f"the clock of {whose} starts anew during the log; receive times are used")
            self._boot = float(received[0] if self._restarts else np.median(received - clock))
            return

    def table(self, key: Key, topic: str | None = None) -> autopilot.Table | None:
        """Unpack the messages of a key; None where the log has none whose checksum holds."""
        told = definition_of(key[2])
        body, received = self._log.rows(key)
        if not received.size:
            return None
        time, clock = received - (self._boot or 0.0), _clock(body)
        if clock is not None and not self._restarts and self._boot is not None:
            if abs(float(np.median(received - clock)) - self._boot) < _OUT_OF_STEP and _runs_on(clock):
                time = clock
            else:
                self.notes.append(f"{self.vehicle.prefix}{told.name}: has a clock of its own; receive times are used")
        keep = autopilot.in_order(time)
        columns = {field: autopilot.numbers(body[field][keep]) for field in _values(told)}
        name = topic or f"{self.vehicle.prefix}{told.name}"
        return autopilot.Table(name, f"mavlink/{told.name}", time[keep], columns)

    def named(self, name: str) -> autopilot.Table | None:
        """Unpack the messages of a name; None where the log has none whose checksum holds."""
        return self.table(self._keys[name]) if name in self._keys else None

    def bodies(self, name: str) -> Any:
        """Give the bodies of the messages of a name, none where the log has no such."""
        return self._log.rows(self._keys[name])[0] if name in self._keys else ()


def _values(told: Definition) -> list[str]:
    """Fields of a message that are numbers, but its clock."""
    return [field for field in told.fields if told.body[field].kind != "S" and field not in _CLOCKS]


def _clock(body: Any) -> Array | None:
    """Seconds since the vehicle was switched on, continued where a counter of 32 bits started anew."""
    for field, ticks in _CLOCKS.items():
        if field in (body.dtype.names or ()):
            raw = body[field].astype(float)
            turns = np.cumsum(np.diff(raw, prepend=raw[:1]) < -(2.0**31)) if raw.size else raw
            return (raw + 2.0**32 * turns) / ticks
    return None


def _runs_on(clock: Array) -> bool:
    keep = autopilot.in_order(clock)
    return bool((np.diff(clock[keep]) >= 0).all())


def _channels(reader: _Reader) -> list[Stream]:
    """Heading, position, velocities, accelerations and commands of one vehicle."""
    reader.set_clock()
    notes = reader.notes
    attitude, local, earth = (reader.named(name) for name in MOTION)
    heading = attitude.columns["yaw"] if attitude is not None else np.zeros(0)
    streams = []
    if attitude is not None:
        streams += [attitude.stream("psi", heading), attitude.stream("r", attitude.columns["yawspeed"])]
        notes.append(f"psi r: yaw and yawspeed of {attitude.topic}")
    place, where, speed = None, (np.zeros(0), np.zeros(0)), (np.zeros(0), np.zeros(0))
    receiver = reader.named("GPS_RAW_INT")
    if local is not None:
        place, columns = local, local.columns
        where, speed = (columns["x"], columns["y"]), (columns["vx"], columns["vy"])
        notes.append(f"x y u v: {local.topic}, its vx vy turned into body axes by the heading")
    elif earth is not None:
        place, columns = earth, earth.columns
        # Without a fix the vehicle sends zeros: a place off Africa, and a boat that stands still.
        has = (columns["lat"] != 0.0) | (columns["lon"] != 0.0)
        known = {name: np.where(has, columns[name], np.nan) for name in ("lat", "lon", "vx", "vy")}
        north, east, origin = local_metres(known["lat"] / 1e7, known["lon"] / 1e7)
        where, speed = (north, east), (known["vx"] / 100.0, known["vy"] / 100.0)
        lost = f"; {np.count_nonzero(~has)} rows without a fix (0 degrees both) left out" if not has.all() else ""
        notes.append(
            f"x y u v: {earth.topic}: metres from the first position at {origin[0]:.7f}, {origin[1]:.7f} deg, and vx "
            f"vy turned into body axes by the heading{lost}"
        )
        if attitude is None:
            attitude = earth
            heading = np.radians(np.where(columns["hdg"] == _UNKNOWN, np.nan, columns["hdg"] / 100.0))
            streams.append(earth.stream("psi", heading))
            notes.append(f"psi: hdg of {earth.topic}, in radians")
    elif receiver is not None:
        place, columns = receiver, receiver.columns
        has = columns["fix_type"] >= _FIX
        known = {name: np.where(has, columns[name], np.nan) for name in ("lat", "lon", "vel", "cog")}
        moves = has & (columns["vel"] != _UNKNOWN) & (columns["cog"] != _UNKNOWN)
        north, east, origin = local_metres(known["lat"] / 1e7, known["lon"] / 1e7)
        pace, course = np.where(moves, columns["vel"], np.nan) / 100.0, np.radians(columns["cog"] / 100.0)
        where, speed = (north, east), (pace * np.cos(course), pace * np.sin(course))
        notes.append(
            f"x y u v: {receiver.topic}: metres from the first fix at {origin[0]:.7f}, {origin[1]:.7f} deg, and vel "
            f"along cog turned into body axes by the heading; {np.count_nonzero(~has)} rows without a fix left out"
        )
    if place is not None:
        streams += autopilot.planar(place, where, speed, autopilot.heading_at(place.time, attitude, heading))
    return [*streams, *_accelerations(reader), *_commands(reader), *_auxiliary(reader)]


def _auxiliary(reader: _Reader) -> list[Stream]:
    """Battery, motors, mode and waypoint; what a message says is not known (UINT16_MAX, -1) is no number."""
    names = ("BATTERY_STATUS", "SYS_STATUS", "HEARTBEAT", "MISSION_CURRENT", "RPM", "ESC_TELEMETRY_1_TO_4")
    battery, status, heartbeat, mission, turns, esc = map(reader.named, names)
    found: dict[str, tuple[autopilot.Table | None, str, float]] = {}
    if battery is not None:
        first = battery.columns["id"] == battery.columns["id"].min()
        cells = np.stack([battery.columns[f"voltages[{k}]"] for k in range(10)])
        total = np.where((cells < _UNKNOWN - 1) & first, cells, 0.0).sum(axis=0) / 1e3
        current = battery.columns["current_battery"] / 100.0
        known = {"voltage": (total, first & (total > 0.0)), "current": (current, first & (current >= 0.0))}
        battery = replace(battery, columns={n: np.where(there, v, np.nan) for n, (v, there) in known.items()})
        found = {"battery_voltage": (battery, "voltage", 1.0), "battery_current": (battery, "current", 1.0)}
    elif status is not None:
        columns = {name: status.columns[name] for name in ("voltage_battery", "current_battery")}
        kept = {n: np.where((v >= 0.0) & (v != _UNKNOWN), v, np.nan) for n, v in columns.items()}
        status = replace(status, columns=kept)
        found = {
            "battery_voltage": (status, "voltage_battery", 1e-3),
            "battery_current": (status, "current_battery", 1e-2),
        }
    found |= {"mode": (heartbeat, "custom_mode", 1.0), "waypoint": (mission, "seq", 1.0)}
    found |= {f"rpm_{k}": (turns, f"rpm{k}", 1.0) for k in (1, 2)}
    for k in range(4):
        found[f"rpm_esc{k + 1}"] = (esc, f"rpm[{k}]", 1.0)
        found[f"motor_current_esc{k + 1}"] = (esc, f"current[{k}]", 1e-2)
    return autopilot.auxiliary_of_columns(found)


def _accelerations(reader: _Reader) -> list[Stream]:
    heartbeats = reader.bodies("HEARTBEAT")
    ardupilot = len(heartbeats) and bool((heartbeats["autopilot"] == _ARDUPILOT).any())
    # RAW_IMU is what the sensor gave, unscaled, but for ArduPilot, which fills it like SCALED_IMU.
    for name in (*(("RAW_IMU",) if ardupilot else ()), "SCALED_IMU", "SCALED_IMU2"):
        imu = reader.named(name)
        if imu is not None:
            reader.notes.append(f"ax ay: xacc and yacc of {imu.topic}, from thousandths of gravity")
            values = {"ax": imu.columns["xacc"], "ay": imu.columns["yacc"]}
            return [imu.stream(field, 1e-3 * GRAVITY * value) for field, value in values.items()]
    return []


def _commands(reader: _Reader) -> list[Stream]:
    outputs = reader.named("SERVO_OUTPUT_RAW")
    if outputs is None:
        reader.notes.append(f"{reader.vehicle.prefix}the log has no SERVO_OUTPUT_RAW messages, so no thruster command")
        return []
    main = outputs.columns["port"] == 0
    columns = {name: value[main] for name, value in outputs.columns.items()}
    outputs = autopilot.Table(outputs.topic, outputs.kind, outputs.time[main], columns)
    names = {int(match[1]): name for name in outputs.columns if (match := re.fullmatch(r"servo(\d+)_raw", name))}
    values = {row["param_id"].decode("latin-1"): float(row["param_value"]) for row in reader.bodies("PARAM_VALUE")}
    streams, notes = autopilot.servo_commands(outputs, names, values)
    reader.notes += notes
    return streams


def _matches(head: Head) -> bool:
    """True when messages follow each other from the first byte on: a telemetry log has no mark of its own."""
    at = 0
    for _ in range(3):
        found = None if head.gzipped else message_at(head.start, at)
        if found is None:
            return False
        at += found[0]
        if at == len(head.start):
            break
    return True


def _read(head: Head, request: Request) -> Recording:
    return recording(Telemetry(head.path, request), request, str(head.path))


TELEMETRY = Format("MAVLink telemetry", _matches, _read, (".tlog",), library="pymavlink", marked=False)
