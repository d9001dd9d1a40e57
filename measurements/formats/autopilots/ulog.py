"""PX4 ULog (`.ulg`), unpacked by pyulog: the channels of a boat, and all other topics by name.

Fields and units are those of PX4's uORB messages: `vehicle_local_position` x y [m], vx vy [m/s] towards north and east;
`vehicle_attitude` q (w, x, y, z), from body axes FRD to earth axes NED; `vehicle_angular_velocity` xyz [rad/s] and
`sensor_combined` gyro_rad, accelerometer_m_s2 [m/s^2] in body axes FRD; `actuator_motors` control [-1, 1];
`actuator_outputs` output [us]. Stamps are microseconds since the autopilot was switched on.
"""

import io
import struct
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ....physics.errors import LogError
from ....physics.motion import Array, heading_from_quaternion
from ...canonical import Output
from ..base import DEEPEST, EVERY, CraftEvidence, Format, Head, Name, Recording, Request, Stream, begins_with, torn
from . import autopilot

_MAGIC = b"ULog\x01\x12\x35"
_START = 16
"""Where the first message begins."""
_HEADER = struct.Struct("<HB")
_FIELDS = 20_000
"""Most fields that all topics may have together; nested arrays of a damaged definition would fill the memory."""
_REREAD = 8
"""Bytes of messages that may be looked at for each byte of the file; a damaged file is searched byte by byte."""
_CLOCKS = ("timestamp", "timestamp_sample")
_MOTION = (
    "vehicle_local_position",
    "vehicle_attitude",
    "vehicle_angular_velocity",
    "sensor_combined",
    "actuator_motors",
    "actuator_outputs",
    "battery_status",
    "esc_status",
    "vehicle_status",
    "mission_result",
    "actuator_servos",
)
"""Topics that are always unpacked."""
_INERTIAL = (
    ("r", "vehicle_angular_velocity", "xyz[2]"),
    ("r", "sensor_combined", "gyro_rad[2]"),
    ("r", "vehicle_attitude", "yawspeed"),
    ("ax", "sensor_combined", "accelerometer_m_s2[0]"),
    ("ay", "sensor_combined", "accelerometer_m_s2[1]"),
)
_FIRST_MOTOR = 101
"""PWM_MAIN_FUNCn of the first motor (PX4, output_functions.yaml)."""
_MOTORS = 12
"""Controls of actuator_motors, and functions of outputs for motors (PX4, ActuatorMotors.msg)."""
_UNSET = 1e-12
"""Squared length up to which a quaternion was never set: no heading."""


class _EndlessError(Exception):
    """pyulog would search for ever; no ValueError, because pyulog takes those for a damaged message and goes on."""


class _File(io.BufferedReader):
    """A file that does not go back from its end.

    pyulog goes back by the length that a damaged message claims, though the end came earlier, and so too far.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(io.FileIO(path))
        self._size = path.stat().st_size

    def seek(self, target: int, whence: int = 0) -> int:
        if whence == 1 and target < 0 and self.tell() == self._size:
            raise struct.error
        return super().seek(target, whence)


class _Log:
    """A ULog as pyulog reads it, kept from endless work on a damaged file.

    Parameters
    ----------
    path : the file
    request : told of the progress
    wanted : names of the topics to unpack
    """

    def __init__(self, path: Path, request: Request, wanted: Sequence[str]) -> None:
        from pyulog import ULog

        self.size = path.stat().st_size
        self.offered: list[Name] = []
        headers: list[Any] = []
        outer, fields = self, 0
        most = _REREAD * self.size + EVERY

        class Bounded(ULog):
            """Counts what it reads."""

            class _MessageHeader(ULog._MessageHeader):
                def __init__(self) -> None:
                    super().__init__()
                    self.bytes, self.next = 0, EVERY
                    headers.append(self)

                def initialize(self, data: bytes) -> None:
                    self.msg_size, self.msg_type = _HEADER.unpack(data)
                    self.bytes += 3 + self.msg_size
                    if self.bytes > self.next:
                        self.next += EVERY
                        request.progress(min(self.bytes, outer.size), outer.size)
                        if self.bytes > most:
                            # In the data, pyulog takes struct.error for the end of the file, and gives what it has.
                            raise _EndlessError("hardly a message is whole") if self is headers[0] else struct.error

            class _MessageAddLogged(ULog._MessageAddLogged):
                def __init__(self, *arguments: Any) -> None:
                    super().__init__(*arguments)
                    names = [field.field_name for field in self.field_data if field.field_name not in _CLOCKS]
                    topic = _topic(self.message_name, self.multi_id)
                    outer.offered += autopilot.raw_names(topic, f"ulog/{self.message_name}", names)

                def _parse_nested_type(self, prefix_str: str, type_name: str, message_formats: Any) -> None:
                    nonlocal fields
                    fields += sum(max(size, 1) for _, size, _ in message_formats[type_name].fields)
                    if fields > _FIELDS or prefix_str.count(".") > DEEPEST:
                        raise ValueError("more fields than any log has")
                    super()._parse_nested_type(prefix_str, type_name, message_formats)

        with _File(path) as file, autopilot.silenced():
            self.content = Bounded(file, list(wanted))
        request.progress(self.size, self.size)
        self.notes = self._damage(headers)

    def tables(self) -> dict[str, autopilot.Table]:
        """Unpacked topics by name."""
        result = {}
        for data in self.content.data_list:
            # A command counts from when it was given; a measurement, from when the sensor was read.
            clock = data.data["timestamp"]
            sampled = data.data.get("timestamp_sample")
            if sampled is not None and sampled.all() and not data.name.startswith("actuator_"):
                clock = sampled
            keep = autopilot.in_order(clock.astype(float))
            columns = {name: autopilot.numbers(value[keep]) for name, value in data.data.items() if name not in _CLOCKS}
            topic = _topic(data.name, data.multi_id)
            result[topic] = autopilot.Table(topic, f"ulog/{data.name}", clock[keep] / 1e6, columns)
        return result

    def parameters(self) -> dict[str, float]:
        """Give the parameters with their last values."""
        changed = {name: value for _, name, value in self.content.changed_parameters}
        values = self.content.initial_parameters | changed
        return {name: float(value) for name, value in values.items() if isinstance(value, int | float)}

    def _damage(self, headers: Sequence[Any]) -> list[str]:
        """What the file lost: at its end, in between, and while it was written."""
        notes = []
        if self.content.file_corruption:
            notes.append("the file is damaged: what is no whole message, or of no topic that it lists, was skipped")
        elif not self.content.has_data_appended and len(headers) == 2:
            first, rest = headers
            # The first message of the data section ends the definitions and is read again.
            twice = 3 + first.msg_size if rest.bytes else 0
            end = _START + first.bytes - twice + rest.bytes
            if end != self.size:
                whole = end - (3 + (rest if rest.bytes else first).msg_size) if end > self.size else end
                notes.append(torn(whole, self.size, "the last message is cut short"))
        dropouts = self.content.dropouts
        if dropouts:
            lost = sum(dropout.duration for dropout in dropouts) / 1e3
            notes.append(f"{len(dropouts)} dropouts of the autopilot's logger, {lost:.1f} s in all, leave gaps")
        return notes


def _topic(name: str, instance: int) -> str:
    return f"{name}[{instance}]" if instance else name


def _read(head: Head, request: Request) -> Recording:
    log = _Log(head.path, request, _MOTION)
    tables = log.tables()
    if not tables and not log.offered:
        raise LogError(
            f"{head.path}: a ULog that tells no topic: it breaks off early, or its definitions are damaged. Copy it "
            "again, or take another."
        )
    streams, notes = _channels(tables, log.parameters())
    craft = _craft(tables, log.parameters())
    chosen = autopilot.Choice(streams, list(dict.fromkeys(log.offered)), request, [*log.notes, *notes])
    wanted = {name.topic.split("[")[0] for name in chosen.raw if name in chosen.wanted}
    if not wanted <= set(_MOTION):
        tables = _Log(head.path, request, sorted(wanted)).tables()
    read = [stream for table in tables.values() for stream in table.raw(chosen.wanted)]
    return chosen.recording(read, craft)


def _craft(tables: Mapping[str, autopilot.Table], parameters: Mapping[str, float]) -> CraftEvidence | None:
    """What kind of vehicle the parameters say, or where these say nothing, the status."""
    told = autopilot.by_mav_type(int(parameters.get("MAV_TYPE", 0)), "parameters")
    status = tables.get("vehicle_status")
    if told is not None or status is None or "vehicle_type" not in status.columns:
        return told
    return autopilot.by_px4_status(int(status.columns["vehicle_type"][-1]))


def _channels(tables: Mapping[str, autopilot.Table], parameters: Mapping[str, float]) -> tuple[list[Stream], list[str]]:
    """Heading, position, velocities, accelerations and commands."""
    streams: list[Stream] = []
    notes: list[str] = []
    place, attitude = tables.get("vehicle_local_position"), tables.get("vehicle_attitude")
    heading = np.zeros(0)
    if attitude is not None and {f"q[{k}]" for k in range(4)} <= set(attitude.columns):
        w, x, y, z = (attitude.columns[f"q[{k}]"] for k in range(4))
        unset = w * w + x * x + y * y + z * z <= _UNSET
        heading = np.where(unset, np.nan, heading_from_quaternion(x, y, z, w))
        lost = f"; {np.count_nonzero(unset)} rows that are all zero left out" if unset.any() else ""
        notes.append(f"psi: heading of the quaternion vehicle_attitude:q{lost}")
    elif place is not None:
        field = next((field for field in ("heading", "yaw") if field in place.columns), None)
        attitude = place if field else None
        heading = place.columns[field] if field else heading
        notes.append(f"psi: vehicle_local_position:{field}" if field else "the log has no heading")
    if attitude is not None:
        streams.append(attitude.stream("psi", heading))
    if place is not None and {"x", "y", "vx", "vy"} <= set(place.columns):
        known = place.columns.get("xy_valid", np.ones(place.time.size)) > 0
        moving = place.columns.get("v_xy_valid", np.ones(place.time.size)) > 0
        north, east = (np.where(known, place.columns[name], np.nan) for name in ("x", "y"))
        to_north, to_east = (np.where(moving, place.columns[name], np.nan) for name in ("vx", "vy"))
        turned = autopilot.heading_at(place.time, attitude, heading)
        streams += autopilot.planar(place, (north, east), (to_north, to_east), turned)
        lost = f"; {np.count_nonzero(~known)} rows that it calls invalid left out" if not known.all() else ""
        notes.append(f"x y u v: vehicle_local_position, its vx vy turned into body axes by the heading{lost}")
    for name, topic, field in _INERTIAL:
        table = tables.get(topic)
        if table is not None and field in table.columns and name not in {stream.field for stream in streams}:
            streams.append(table.stream(name, table.columns[field]))
            notes.append(f"{name}: {topic}:{field}")
    driven, told = _commands(tables, parameters)
    return [*streams, *driven, *_auxiliary(tables)], [*notes, *told]


def _auxiliary(tables: Mapping[str, autopilot.Table]) -> list[Stream]:
    """Battery, motors, mode, waypoint and steering: battery_status, esc_status, vehicle_status and their like."""
    names = ("battery_status", "vehicle_status", "mission_result", "esc_status", "actuator_servos")
    power, status, mission, esc, servos = (tables.get(name) for name in names)
    found: dict[str, tuple[autopilot.Table | None, str, float]] = {
        "battery_voltage": (power, "voltage_v", 1.0),
        "battery_current": (power, "current_a", 1.0),
        "mode": (status, "nav_state", 1.0),
        "waypoint": (mission, "seq_current", 1.0),
    }
    for k in range(8):
        found[f"rpm_esc{k + 1}"] = (esc, f"esc[{k}].esc_rpm", 1.0)
        found[f"motor_current_esc{k + 1}"] = (esc, f"esc[{k}].esc_current", 1.0)
        found[f"steering_servo{k + 1}"] = (servos, f"control[{k}]", 1.0)
    return [stream for stream in autopilot.auxiliary_of_columns(found) if np.isfinite(stream.value).any()]


def _commands(tables: Mapping[str, autopilot.Table], parameters: Mapping[str, float]) -> tuple[list[Stream], list[str]]:
    """Thrust of the motors as a share, and their outputs in microseconds, by what the parameters call them."""
    streams: list[Stream] = []
    notes: list[str] = []
    names, why = _motors(parameters)
    motors, outputs = tables.get("actuator_motors"), tables.get("actuator_outputs")
    for motor in range(_MOTORS):
        column = motors.columns.get(f"control[{motor}]") if motors else None
        if motors is not None and column is not None and np.isfinite(column).any():
            off = int(np.count_nonzero(np.isnan(column)))
            streams.append(motors.stream(f"normalized_{names[motor]}", np.nan_to_num(column)))
            stopped = f"; {off} rows without a number (stopped) taken as 0" if off else ""
            notes.append(f"normalized_{names[motor]}: actuator_motors:control[{motor}]{stopped}")
    for output in range(16) if outputs else ():
        motor = int(parameters.get(f"PWM_MAIN_FUNC{output + 1}", 0)) - _FIRST_MOTOR
        column = outputs.columns.get(f"output[{output}]") if outputs else None
        if outputs is not None and column is not None and 0 <= motor < _MOTORS:
            value, stated, told = _pulses(column, output, motor, parameters)
            streams.append(replace(outputs.stream(f"pwm_{names[motor]}", value), output=stated))
            notes.append(f"pwm_{names[motor]}: actuator_outputs:output[{output}], motor {motor + 1}, {told}")
    if streams:
        return streams, [*notes, why]
    return [], ["no motor in actuator_motors, and no PWM_MAIN_FUNCn that names one: no thruster command. Map them."]


def _motors(parameters: Mapping[str, float]) -> tuple[list[str], str]:
    """Name the motors: by side where the log says where two of them are, else by number."""
    names = [f"motor{motor + 1}" for motor in range(_MOTORS)]
    sides = [parameters.get(f"CA_ROTOR{motor}_PY", 0.0) for motor in range(2)]
    if int(parameters.get("CA_ROTOR_COUNT", 0)) == 2 and sides[0] * sides[1] < 0:
        names[:2] = ["port" if side < 0 else "stbd" for side in sides]
        return names, "motors are named by their sides, CA_ROTOR0_PY and CA_ROTOR1_PY"
    # Which motor of a differential rover is on which side has changed between versions of PX4.
    return names, (
        "the log does not say on which side a motor is (CA_ROTORn_PY), so they have numbers: name the vehicle's "
        "thrusters motor1, motor2, ..., or map them"
    )


def _pulses(column: Array, output: int, motor: int, parameters: Mapping[str, float]) -> tuple[Array, Output, str]:
    """Turn an output [us] so that more is ahead; what the parameters say of it; and how it was turned, in words."""
    low = parameters.get(f"PWM_MAIN_MIN{output + 1}", 1000.0)
    high = parameters.get(f"PWM_MAIN_MAX{output + 1}", 2000.0)
    astern = bool(int(parameters.get("CA_R_REV", 0)) >> motor & 1)
    mirrored = bool(int(parameters.get("PWM_MAIN_REV", 0)) >> output & 1)
    neutral = 0.5 * (low + high) if astern else low
    text = f"neutral {neutral:g} us, range {low:g} to {high:g} us: the thruster's curve must have them"
    value = np.where(column == 0.0, np.nan, column)
    if mirrored:
        value = low + high - value
        text += f"; the output is reversed (PWM_MAIN_REV), mirrored here as {low + high:g} us - value"
    silent = np.isnan(value)
    if silent.any():
        text += f"; {np.count_nonzero(silent)} rows without pulses taken as neutral"
    source = (
        f"PWM_MAIN_MIN{output + 1} {low:g}, PWM_MAIN_MAX{output + 1} {high:g}, CA_R_REV {'yes' if astern else 'no'}"
    )
    return np.where(silent, neutral, value), Output(neutral, low, high, source), text


ULOG = Format("PX4 ULog", begins_with(_MAGIC), _read, (".ulg",), library="pyulog")
