"""Small telemetry logs through pymavlink's own encoder: what a ground station records of an ArduPilot boat."""

import struct
from collections.abc import Mapping

import numpy as np
from dataflash_files import SERVOS
from pymavlink.dialects.v20 import ardupilotmega

from undertow.physics.motion import body_to_earth, wrap_angle
from undertow.physics.worlds.world import SimulatedLog

BOOT = 1_700_000_000_000_000
"""When the vehicle was switched on [us since 1970]."""
START = 20_000
"""The vehicle's clock [ms] at the world's beginning."""
LATENCY = 40_000
"""Of the radio [us]."""


class Writer:
    """A telemetry log in memory, `content`, of messages from one system."""

    def __init__(self, system: int = 1, content: bytearray | None = None) -> None:
        self._link = ardupilotmega.MAVLink(None, srcSystem=system, srcComponent=1)
        self.content = bytearray() if content is None else content

    def add(self, received: int, message: ardupilotmega.MAVLink_message) -> None:
        """Add a message that came in at `received` [us since 1970]."""
        self.content += struct.pack(">Q", received) + message.pack(self._link)


def telemetry_of(
    log: SimulatedLog, writer: Writer | None = None, servos: Mapping[str, float] = SERVOS, local: bool = True
) -> Writer:
    """Record a simulated world; `local`: with LOCAL_POSITION_NED, else with GLOBAL_POSITION_INT."""
    writer, now = writer or Writer(), BOOT + 1000 * START
    writer.add(now, ardupilotmega.MAVLink_heartbeat_message(11, 3, 0, 0, 4, 3))
    for index, (name, value) in enumerate(servos.items()):
        message = ardupilotmega.MAVLink_param_value_message(name.encode(), float(value), 9, len(servos), index)
        writer.add(now, message)
    port, stbd = (log.commands[:, log.truth.thrusters.index(name)] for name in ("port", "stbd"))
    rows = [(t, 0, row) for row, t in enumerate(log.odometry_time)] + [
        (t, 1, row) for row, t in enumerate(log.command_time)
    ]
    rng = np.random.default_rng(0)
    for time, kind, row in sorted(rows):
        stamp = START + round(1000 * time)
        received = BOOT + 1000 * stamp + LATENCY + int(rng.integers(0, 20_000))
        if kind:
            pulses = [0] * 16
            pulses[0], pulses[2] = (
                round(2 * servos[f"SERVO{k}_TRIM"] - value if servos[f"SERVO{k}_REVERSED"] else value)
                for k, value in ((1, stbd[row]), (3, port[row]))
            )
            message = ardupilotmega.MAVLink_servo_output_raw_message(1000 * stamp % 2**32, 0, *pulses)
            writer.add(received, message)
            continue
        north, east, psi, u, v, r = (float(value) for value in log.odometry[row])
        yaw = float(wrap_angle(np.array(psi)))
        to_north, to_east = (float(value) for value in body_to_earth(np.array(psi), u, v))
        writer.add(received, ardupilotmega.MAVLink_attitude_message(stamp, 0.0, 0.0, yaw, 0.0, 0.0, r))
        if local:
            message = ardupilotmega.MAVLink_local_position_ned_message(stamp, north, east, 0.0, to_north, to_east, 0.0)
        else:
            place = (round(1e7 * (60.0 + north / 111412.24)), round(1e7 * (10.0 + east / 55800.0)))
            speeds = (round(100 * to_north), round(100 * to_east), 0)
            message = ardupilotmega.MAVLink_global_position_int_message(stamp, *place, 0, 0, *speeds, 65535)
        writer.add(received, message)
        raw = ardupilotmega.MAVLink_raw_imu_message(1000 * stamp, 10, -20, -1000, 0, 0, 0, 0, 0, 0, 0, 0)
        writer.add(received, raw)
    return writer
