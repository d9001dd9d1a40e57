"""Small recordings of BlueOS: what its MAVLink server publishes of an ArduPilot boat, as JSON in an MCAP file.

The form is that of bluerobotics/mavlink-server and bluerobotics/blueos-recorder: every message on a topic of its own
and on `mavlink/out`, and its fields that are objects on topics below; `{"type": ...}` for members of enumerations.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from dataflash_files import SERVOS
from mcap.writer import CompressionType, Writer

from undertow.physics.motion import body_to_earth, wrap_angle
from undertow.physics.worlds.world import SimulatedLog

BOOT = 1_780_000_000_000_000_000
"""When the vehicle was switched on [ns since 1970]."""
START = 20_000
"""The vehicle's clock [ms] at the world's beginning."""
Message = tuple[int, str, dict[str, Any]]
"""Receipt [ns], name and fields."""


def messages_of(log: SimulatedLog, servos: Mapping[str, float] = SERVOS, local: bool = True) -> Iterator[Message]:
    """What the boat of a world sends; `local`: with LOCAL_POSITION_NED, else with GLOBAL_POSITION_INT."""
    now = BOOT + START * 1_000_000
    for index, (name, value) in enumerate(servos.items()):
        letters = list(name.ljust(16, "\0"))
        numbers = {"param_value": float(value), "param_count": len(servos), "param_index": index}
        kind = {"param_type": {"type": "MAV_PARAM_TYPE_REAL32"}}
        yield now, "PARAM_VALUE", {"param_id": letters, **numbers, **kind}
    port, stbd = (log.commands[:, log.truth.thrusters.index(name)] for name in ("port", "stbd"))
    rows = [(t, 0, row) for row, t in enumerate(log.odometry_time)]
    rows += [(t, 1, row) for row, t in enumerate(log.command_time)]
    rows += [(t, 2, row) for row, t in enumerate(np.arange(0.0, log.odometry_time[-1], 1.0))]
    rng = np.random.default_rng(0)
    for time, kind, row in sorted(rows):
        stamp = START + round(1000 * time)
        received = BOOT + 1_000_000 * stamp + int(rng.integers(1_000_000, 5_000_000))
        if kind == 2:
            yield received, "HEARTBEAT", heartbeat(0 if row < 10 else 10)
            yield received, "BATTERY_STATUS", battery(16.5 - 0.01 * row, 3.0)
            continue
        if kind == 1:
            pulses = [0] * 16
            pulses[0], pulses[2] = (
                round(2 * servos[f"SERVO{k}_TRIM"] - value if servos.get(f"SERVO{k}_REVERSED") else value)
                for k, value in ((1, stbd[row]), (3, port[row]))
            )
            outputs = {f"servo{k}_raw": pulse for k, pulse in enumerate(pulses, 1)}
            yield received, "SERVO_OUTPUT_RAW", {"time_usec": 1000 * stamp, "port": 0, **outputs}
            continue
        north, east, psi, u, v, r = (float(value) for value in log.odometry[row])
        to_north, to_east = (float(value) for value in body_to_earth(np.array(psi), u, v))
        angles = {"roll": 0.0, "pitch": 0.0, "yaw": float(wrap_angle(np.array(psi)))}
        yield (
            received,
            "ATTITUDE",
            {"time_boot_ms": stamp, **angles, "rollspeed": 0.0, "pitchspeed": 0.0, "yawspeed": r},
        )
        if local:
            place = {"x": north, "y": east, "z": 0.0, "vx": to_north, "vy": to_east, "vz": 0.0}
            yield received, "LOCAL_POSITION_NED", {"time_boot_ms": stamp, **place}
        else:
            place = {"lat": round(1e7 * (60.0 + north / 111412.24)), "lon": round(1e7 * (10.0 + east / 55800.0))}
            speeds = {"vx": round(100 * to_north), "vy": round(100 * to_east), "vz": 0, "hdg": 65535}
            yield (
                received,
                "GLOBAL_POSITION_INT",
                {"time_boot_ms": stamp, **place, "alt": 0, "relative_alt": 0, **speeds},
            )


def heartbeat(mode: int, kind: str = "MAV_TYPE_SURFACE_BOAT") -> dict[str, Any]:
    """The heartbeat of an armed ArduPilot vehicle in a mode."""
    return {
        "custom_mode": mode,
        "mavtype": {"type": kind},
        "autopilot": {"type": "MAV_AUTOPILOT_ARDUPILOTMEGA"},
        "base_mode": {"bits": 193},
        "system_status": {"type": "MAV_STATE_ACTIVE"},
        "mavlink_version": 3,
    }


def battery(voltage: float, current: float) -> dict[str, Any]:
    """The state of a battery [V], [A]."""
    return {
        "id": 0,
        "battery_function": {"type": "MAV_BATTERY_FUNCTION_UNKNOWN"},
        "mavtype": {"type": "MAV_BATTERY_TYPE_UNKNOWN"},
        "temperature": 32767,
        "voltages": [round(1000 * voltage), *[65535] * 9],
        "current_battery": round(100 * current),
        "current_consumed": 0,
        "energy_consumed": -1,
        "battery_remaining": 80,
    }


def write_blueos(path: Path, messages: Iterator[Message], packed: bool = True, system: int = 1) -> Path:
    """Write a recording, with everything once more on `mavlink/out`, and a heartbeat of the ground station."""
    how = CompressionType.ZSTD if packed else CompressionType.NONE
    with path.open("wb") as stream:
        writer, channels, count = Writer(stream, compression=how, chunk_size=1 << 18), {}, 0
        writer.start()

        def add(topic: str, received: int, content: dict[str, Any]) -> None:
            if topic not in channels:
                schema = json.dumps({"type": "object", "properties": {}}).encode()
                number = writer.register_schema(topic.replace("/", "."), "jsonschema", schema)
                channels[topic] = writer.register_channel(topic, "json", number)
            writer.add_message(channels[topic], received, json.dumps(content).encode(), received, count)

        for received, name, fields in messages:
            count += 1
            of = {"system_id": system, "component_id": 1, "sequence": count % 256, "message_id": None}
            content = {"header": of, "message": {"type": name, **fields}}
            add("mavlink/out", received, content)
            add(f"mavlink/{system}/1/{name}", received, content)
            for field, value in fields.items():
                if isinstance(value, dict):
                    add(f"mavlink/{system}/1/{name}/{field}", received, value)
            if name == "HEARTBEAT":
                other = {"system_id": 255, "component_id": 240, "sequence": count % 256}
                told = {"type": name, **heartbeat(0, "MAV_TYPE_GCS")}
                add("mavlink/255/240/HEARTBEAT", received, {"header": other, "message": told})
        writer.finish()
    return path
