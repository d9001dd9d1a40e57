"""One small sound log of every format, and ways to break it: for the fuzz benchmark and its fast slice in the tests."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
from bags import WRITERS, recorded
from blueos_files import messages_of, write_blueos
from dataflash_files import dataflash_of
from json_files import texts_of, write_json
from matlab_files import structs_of, write_mat
from round_trip import world
from telemetry_files import telemetry_of
from ulog_files import ulog_of

from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import SimulatedLog, simulate_world


@dataclass(frozen=True)
class Sample:
    """A log as it is read, and the file of it that is broken (the same, but for folders)."""

    log: Path
    file: Path


@cache
def small_world() -> SimulatedLog:
    """Half a minute of a BlueBoat."""
    return simulate_world(load_vehicle("blueboat"), {}, duration=30.0, noise="field", seed=7)


def _table(ending: str) -> Callable[[Path], Sample]:
    def write(folder: Path) -> Sample:
        path = small_world().write(folder / f"log{ending}")
        return Sample(path, path)

    return write


def _wide(folder: Path) -> Sample:
    world, path = small_world(), folder / "wide.csv"
    rows = zip(world.odometry_time.tolist(), world.odometry.tolist(), strict=True)
    path.write_text("t,x,y,psi,u,v,r\n" + "".join(f"{time},{','.join(map(str, row))}\n" for time, row in rows))
    return Sample(path, path)


def _bag(way: str) -> Callable[[Path], Sample]:
    ending, writer = WRITERS[way]

    def write(folder: Path) -> Sample:
        path = writer(folder / f"log{ending}", recorded(small_world()))
        inner = [entry for entry in path.iterdir() if entry.name != "metadata.yaml"] if path.is_dir() else [path]
        return Sample(path, inner[0])

    return write


def _json(folder: Path) -> Sample:
    path = write_json(folder / "log.mcap", texts_of(small_world()), chunks=False)
    return Sample(path, path)


def _blueos(folder: Path) -> Sample:
    path = write_blueos(folder / "recorder.mcap", messages_of(world(30.0)), packed=False)
    return Sample(path, path)


def _numpy(folder: Path) -> Sample:
    path, found = folder / "log.npy", small_world()
    names = ["t", "x", "y", "psi", "u", "v", "r"]
    table = np.empty(found.odometry_time.size, dtype=[(name, float) for name in names])
    for name, column in zip(names, (found.odometry_time, *found.odometry.T), strict=True):
        table[name] = column
    np.save(path, table)
    return Sample(path, path)


def _words(folder: Path) -> Sample:
    """A date and a time of the day, decimal commas, semicolons, quoted names, UTF-16, as an office program writes."""
    path, found = folder / "log.csv", small_world()
    lines = ['"Date";"Time";x;y;psi;u;v;r']
    for time, row in zip(found.odometry_time.tolist(), found.odometry.tolist(), strict=True):
        cells = ";".join(str(value).replace(".", ",") for value in row)
        lines.append(f"01.05.2026;12:00:{time:09.6f};{cells}")
    path.write_bytes("\r\n".join(lines).encode("utf-16"))
    return Sample(path, path)


def _metadata(folder: Path) -> Sample:
    path = WRITERS["ROS 2 MCAP"][1](folder / "log", recorded(small_world())[:100])
    return Sample(path, path / "metadata.yaml")


def _autopilot(ending: str) -> Callable[[Path], Sample]:
    """Logs of autopilots have pulses as commands, which not every vehicle takes."""

    def write(folder: Path) -> Sample:
        path, log = folder / f"log{ending}", world(30.0)
        makers = {".bin": dataflash_of, ".tlog": telemetry_of, ".ulg": ulog_of}
        if ending == ".log":
            path.write_text("\n".join(dataflash_of(log).text) + "\n")
        elif ending == ".mat":
            write_mat(path, structs_of(log))
        else:
            path.write_bytes(bytes(makers[ending](log).content))
        return Sample(path, path)

    return write


SAMPLES: dict[str, Callable[[Path], Sample]] = {
    "long CSV": _table(".csv"),
    "long CSV, gzip": _table(".csv.gz"),
    "wide CSV": _wide,
    "Parquet": _table(".parquet"),
    **{way: _bag(way) for way in WRITERS},
    "MCAP with JSON": _json,
    "BlueOS": _blueos,
    "NumPy": _numpy,
    "wide CSV of an office": _words,
    "ROS 2 metadata.yaml": _metadata,
    "DataFlash": _autopilot(".bin"),
    "DataFlash text": _autopilot(".log"),
    "MAVLink telemetry": _autopilot(".tlog"),
    "PX4 ULog": _autopilot(".ulg"),
    "MATLAB": _autopilot(".mat"),
}
"""Writers of a sound log in an empty folder, by format; a new reader adds its own."""


def broken(content: bytes, seed: int) -> bytes:
    """Break the content of a file: flipped bytes, a cut, a part moved, doubled, wiped or made of ones.

    Equal seeds break equal content alike. A third of all cases touch the first KB only, where the headers are.
    """
    chance = Random(seed)
    data = bytearray(content)
    reach = len(data) if chance.random() < 0.67 else min(len(data), 1024)
    ways = (_flip, _flip, _cut, _move, _double, _wipe, _number)
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        chance.choice(ways)(data, min(reach, len(data)), chance)
    return bytes(data)


def _span(reach: int, chance: Random) -> tuple[int, int]:
    start = chance.randrange(max(reach, 1))
    return start, start + chance.choice((1, 4, 16, 256, 4096))


def _flip(data: bytearray, reach: int, chance: Random) -> None:
    for _ in range(chance.choice((1, 2, 8, 32))):
        if reach:
            data[chance.randrange(reach)] ^= 1 << chance.randrange(8)


def _cut(data: bytearray, reach: int, chance: Random) -> None:
    del data[chance.randrange(reach + 1) :]


def _move(data: bytearray, reach: int, chance: Random) -> None:
    start, end = _span(reach, chance)
    part = data[start:end]
    del data[start:end]
    at = chance.randrange(len(data) + 1)
    data[at:at] = part


def _double(data: bytearray, reach: int, chance: Random) -> None:
    start, end = _span(reach, chance)
    data[start:start] = data[start:end]


def _wipe(data: bytearray, reach: int, chance: Random) -> None:
    start, end = _span(reach, chance)
    end = min(end, len(data))
    data[start:end] = bytes((chance.choice((0, 255)),)) * max(end - start, 0)


def _number(data: bytearray, reach: int, chance: Random) -> None:
    """An extreme number where a length may stand."""
    width = chance.choice((2, 4, 8))
    start = chance.randrange(max(reach - width, 1))
    value = chance.choice((2 ** (8 * width) - 1, 2 ** (8 * width - 1) - 1, 2 ** (8 * width - 4), 0))
    if start + width <= len(data):
        data[start : start + width] = value.to_bytes(width, chance.choice(("little", "big")))
