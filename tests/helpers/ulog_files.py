"""Small PX4 ULog files by the format's definition: header, flags, formats, parameters, subscriptions, data."""

import struct
from collections.abc import Mapping

import numpy as np

from undertow.physics.motion import body_to_earth
from undertow.physics.worlds.world import SimulatedLog

FORMATS = {
    "vehicle_local_position": "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float vx;float vy;"
    "bool xy_valid;bool v_xy_valid;uint8_t[6] _padding0;",
    "vehicle_attitude": "uint64_t timestamp;uint64_t timestamp_sample;float[4] q;",
    "vehicle_angular_velocity": "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;uint8_t[4] _padding0;",
    "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
    "actuator_motors": "uint64_t timestamp;uint64_t timestamp_sample;float[12] control;",
    "actuator_outputs": "uint64_t timestamp;uint32_t noutputs;float[16] output;uint8_t[4] _padding0;",
    "vehicle_local_position_setpoint": "uint64_t timestamp;float x;float y;",
}
BODIES = {
    "vehicle_local_position": "<QQffff??",
    "vehicle_attitude": "<QQ4f",
    "vehicle_angular_velocity": "<QQ3f",
    "sensor_combined": "<Q6f",
    "actuator_motors": "<QQ12f",
    "actuator_outputs": "<QI16f",
    "vehicle_local_position_setpoint": "<Qff",
}
PARAMETERS = {
    "CA_ROTOR_COUNT": 2, "CA_ROTOR0_PY": 0.285, "CA_ROTOR1_PY": -0.285, "CA_R_REV": 3,
    "PWM_MAIN_FUNC1": 101, "PWM_MAIN_FUNC2": 102, "PWM_MAIN_MIN1": 1000, "PWM_MAIN_MAX1": 2000,
    "PWM_MAIN_MIN2": 1000, "PWM_MAIN_MAX2": 2000, "PWM_MAIN_REV": 0,
}  # fmt: skip
"""Motor 1 is to starboard, motor 2 to port; both go astern."""
START = 5_000_000
"""Stamp [us] of the world's beginning."""


class Writer:
    """A ULog in memory, `content`."""

    def __init__(self, parameters: Mapping[str, float] = PARAMETERS, formats: Mapping[str, str] = FORMATS) -> None:
        self.content = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", START))
        self.message("B", bytes(40))
        for name, fields in formats.items():
            self.message("F", f"{name}:{fields}".encode())
        self.message("I", b"\x10char[5] sys_name" + b"PX4  ")
        for name, value in parameters.items():
            key = f"{'int32_t' if isinstance(value, int) else 'float'} {name}".encode()
            self.message("P", bytes([len(key)]) + key + struct.pack("<i" if isinstance(value, int) else "<f", value))
        self._numbers = {name: number for number, name in enumerate(formats)}
        for name, number in self._numbers.items():
            self.message("A", struct.pack("<BH", 0, number) + name.encode())

    def message(self, kind: str, body: bytes) -> None:
        self.content += struct.pack("<HB", len(body), ord(kind)) + body

    def add(self, topic: str, *values: float) -> None:
        """Add data of a topic."""
        self.message("D", struct.pack("<H", self._numbers[topic]) + struct.pack(BODIES[topic], *values))


def ulog_of(log: SimulatedLog, writer: Writer | None = None) -> Writer:
    """Write a simulated world as PX4 would: measured 4 ms before it is published, motors disarmed before the start."""
    writer = writer or Writer()
    port, stbd = (log.commands[:, log.truth.thrusters.index(name)] for name in ("port", "stbd"))
    rows = [(t, 0, row) for row, t in enumerate(log.odometry_time)]
    rows += [(t, 1, row) for row, t in enumerate(log.command_time)]
    for time, kind, row in sorted(rows):
        stamp = START + round(1e6 * time)
        if kind:
            share = [(value - 1500.0) / 500.0 for value in (stbd[row], port[row])]
            writer.add("actuator_motors", stamp, stamp - 4000, *share, *[float("nan")] * 10)
            writer.add("actuator_outputs", stamp, 2, stbd[row], port[row], *[0.0] * 14)
            continue
        north, east, psi, u, v, r = log.odometry[row]
        to_north, to_east = (float(value) for value in body_to_earth(psi, u, v))
        half = 0.5 * psi
        published = stamp + 4000
        writer.add("vehicle_local_position", published, stamp, north, east, to_north, to_east, True, True)
        writer.add("vehicle_attitude", published, stamp, np.cos(half), 0.0, 0.0, np.sin(half))
        writer.add("vehicle_angular_velocity", published, stamp, 0.0, 0.0, r)
        writer.add("sensor_combined", stamp, 0.0, 0.0, r, 0.1, -0.2, -9.8)
        writer.add("vehicle_local_position_setpoint", stamp, 77.0, 78.0)
    return writer
