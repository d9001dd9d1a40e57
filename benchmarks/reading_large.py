"""Measure `inspect` of large logs as autopilots and BlueOS write them: wall time and peak memory.

python benchmarks/reading_large.py [--flash 200] [--mcap 1000] [--folder DIR] [--table]

A DataFlash log of so many MB has two IMUs at 400 Hz beside an EKF at 10 Hz. A recording of BlueOS of so many MB is
written twice: with a camera's video, which most of its bytes are, its telemetry packed; and of telemetry alone, not
packed. Each is inspected in a process of its own, imports included. With --table, docs/performance.md gets the figures.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
from blueos_files import BOOT, START, Message, messages_of
from dataflash_files import CODES, MESSAGES, SCALES, SERVOS, Writer
from marked_section import write_section
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from reading import INSPECT

from undertow.physics.motion import body_to_earth
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import SimulatedLog, simulate_world

PAGE = Path(__file__).resolve().parents[1] / "docs" / "performance.md"
_HEAD = "## Large logs\n`inspect` is made to take less than 60 s and 600 MB for 200 MB of DataFlash and 1 GB of MCAP."
_EKF, _IMU = 10, 400
"""Rates [Hz] of the state of an EKF and of an IMU in a DataFlash log."""
_FRAME, _PER_SECOND = 20_000, 30
"""Bytes of a frame of video, and frames a second: some 5 Mbit/s, as a ROV's camera sends."""


def world() -> SimulatedLog:
    """Ten minutes of a boat with pulses as commands."""
    return simulate_world(load_vehicle("blueboat_paper"), {}, programme="rich", duration=600.0, noise="field", seed=0)


def packed(name: str, **columns: np.ndarray) -> np.ndarray:
    """Messages of a type as bytes (n, length); columns that are not given are 0."""
    number, characters, names, _ = MESSAGES[name]
    fields = names.split(",")
    codes = [f"S{CODES[c][:-1]}" if c in "nNZ" else f"<{CODES[c]}" for c in characters]
    kinds = list(zip(fields, codes, strict=True))
    body = np.zeros(columns["TimeUS"].size, [("mark", "<u2"), ("type", "u1"), *kinds])
    body["mark"], body["type"] = 0x95A3, number
    for field, values in columns.items():
        scale = SCALES.get(characters[fields.index(field)], 1)
        body[field] = np.rint(scale * values) if scale != 1 else values
    return body.view(np.uint8).reshape(body.size, -1)


def write_flash(path: Path, megabytes: float, log: SimulatedLog) -> Path:
    """Write the world again and again, a second at a time, until the file is large enough."""
    writer = Writer()
    writer.parameters(SERVOS)
    seconds = int(log.odometry_time[-1])
    names = [log.truth.thrusters.index(name) for name in ("port", "stbd")]
    with path.open("wb") as file:
        file.write(writer.content)
        second = 0
        while file.tell() < 1e6 * megabytes:
            at = second % seconds + np.arange(_EKF) / _EKF
            x, y, psi, u, v, _ = (np.interp(at, log.odometry_time, column) for column in log.odometry.T)
            to_north, to_east = body_to_earth(psi, u, v)
            stamp = 10_000_000 + 1_000_000 * second + (1_000_000 * np.arange(_EKF)) // _EKF
            state = {"Yaw": np.degrees(psi) % 359.99, "VN": to_north, "VE": to_east, "PN": x, "PE": y}
            row = np.clip(np.searchsorted(log.command_time, at, "right") - 1, 0, None)
            port, stbd = (log.commands[row, k] for k in names)
            for core in (0, 1):
                file.write(packed("XKF1", TimeUS=stamp, C=np.full(_EKF, core), **state).tobytes())
            file.write(packed("XKF4", TimeUS=stamp).tobytes())
            file.write(packed("RCOU", TimeUS=stamp, C1=stbd, C3=port).tobytes())
            fast = second % seconds + np.arange(_IMU) / _IMU
            rate = np.interp(fast, log.odometry_time, log.odometry[:, 5])
            moments = 10_000_000 + 1_000_000 * second + (1_000_000 * np.arange(_IMU)) // _IMU
            for number in (0, 1):
                which = np.full(_IMU, number)
                file.write(packed("IMU", TimeUS=moments, I=which, GyrZ=rate, AccZ=np.full(_IMU, -9.8)).tobytes())
            second += 1
    return path


def for_ever(log: SimulatedLog) -> Iterator[Message]:
    """What the boat of a world sends, the world again and again."""
    messages = list(messages_of(log))
    span, clock = messages[-1][0] - messages[0][0] + 50_000_000, 0
    while True:
        for received, name, fields in messages:
            later = {
                key: fields[key] + clock // (1_000_000 if key == "time_boot_ms" else 1_000)
                for key in ("time_boot_ms", "time_usec")
                if key in fields
            }
            yield received + clock, name, {**fields, **later}
        clock += span // 1_000_000 * 1_000_000


def write_recording(path: Path, megabytes: float, log: SimulatedLog, video: bool) -> Path:
    """Write a recording of BlueOS, with a camera's frames or without, until it is large enough."""
    how = CompressionType.ZSTD if video else CompressionType.NONE
    rng = np.random.default_rng(0)  # frames of video hardly pack
    with path.open("wb") as stream:
        writer, channels = McapWriter(stream, compression=how, chunk_size=1 << 20), {}
        writer.start()
        camera = writer.register_schema("foxglove.CompressedVideo", "ros2msg", b"uint8[] data\n")
        camera = writer.register_channel("video/1/stream", "cdr", camera)
        shown = BOOT + START * 1_000_000
        for count, (received, name, fields) in enumerate(for_ever(log)):
            if stream.tell() > 1e6 * megabytes:
                break
            while video and shown < received:
                writer.add_message(camera, shown, b"\0\1\0\0" + _FRAME.to_bytes(4, "little") + rng.bytes(_FRAME), shown)
                shown += 1_000_000_000 // _PER_SECOND
            of = {"system_id": 1, "component_id": 1, "sequence": count % 256}
            raw = json.dumps({"header": of, "message": {"type": name, **fields}}).encode()
            for topic in ("mavlink/out", f"mavlink/1/1/{name}"):
                if topic not in channels:
                    schema = writer.register_schema(topic.replace("/", "."), "jsonschema", b'{"type": "object"}')
                    channels[topic] = writer.register_channel(topic, "json", schema)
                writer.add_message(channels[topic], received, raw, received)
        writer.finish()
    return path


def main() -> None:
    """Print a row for every log."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flash", type=float, default=200.0, metavar="MB", help="0 for none")
    parser.add_argument("--mcap", type=float, default=1000.0, metavar="MB")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--table", action="store_true")
    chosen = parser.parse_args()
    log = world()
    rows = [
        "| log | MB | inspect: wall time [s] | processor time [s] | peak memory [MB] |",
        "| --- | --- | --- | --- | --- |",
    ]
    print("\n".join(rows))
    with tempfile.TemporaryDirectory(dir=chosen.folder) as name:
        folder = Path(name)
        for kind, write in (
            ("DataFlash", lambda: write_flash(folder / "log.bin", chosen.flash, log)),
            ("BlueOS with video", lambda: write_recording(folder / "recorder_v.mcap", chosen.mcap, log, True)),
            ("BlueOS, telemetry alone", lambda: write_recording(folder / "recorder.mcap", chosen.mcap, log, False)),
        ):
            if not (chosen.flash if kind == "DataFlash" else chosen.mcap):
                continue
            path = write()
            begun = time.perf_counter()
            done = subprocess.run(
                [sys.executable, "-c", INSPECT, str(path)], capture_output=True, text=True, check=False, env=os.environ
            )
            wall = time.perf_counter() - begun
            told = done.stdout.strip() or f"failed: {done.stderr.strip()[-300:]} |"
            rows.append(f"| {kind} | {path.stat().st_size / 1e6:.0f} | {wall:.1f} | {told} |")
            print(rows[-1], flush=True)
            path.unlink()
    if chosen.table:
        text = "\n".join([_HEAD, "", *rows, "", "Written by `python benchmarks/reading_large.py --table`."])
        write_section(PAGE, "readers, large logs", text)


if __name__ == "__main__":
    main()
