"""Hold our readers to the programs that own the formats, message by message, over test files.

python benchmarks/conformance.py [FOLDER...]

Three families need no files: MCAP, written by `mcap` with every choice that its writer has, bags, written by `rosbags`,
and telemetry, encoded by `pymavlink`; what comes out of our own walks is compared with what these libraries read, byte
by byte. The packages ship no recorded files, so that for others a FOLDER has a checkout of the sources: `test/*.ulg` of
pyulog, `tests/conformance/data` of mcap (with Git LFS), recorded bags, `.BIN` and `.tlog`. Each family is a row; the
exit code is 1 for a file that is read otherwise, and for fewer than two families.
"""

import argparse
import itertools
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from bags import WRITERS, recorded
from log_samples import small_world
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
from pymavlink import DFReader, mavutil
from rosbags.highlevel import AnyReader
from round_trip import world
from telemetry_files import telemetry_of

from undertow.measurements.formats.autopilots.autopilot import silenced
from undertow.measurements.formats.autopilots.dataflash import DataFlash
from undertow.measurements.formats.autopilots.mavlink import Telemetry, definition_of
from undertow.measurements.formats.base import Request
from undertow.measurements.formats.ros import ros1_bag
from undertow.measurements.formats.ros.mcap import McapWalk
from undertow.measurements.formats.ros.ros2_bag import walk_sqlite
from undertow.measurements.log import read_log
from undertow.physics.errors import LogError

LFS = b"version https://git-lfs"
Read = Counter[tuple[str, int, bytes]]
"""Messages of a file: topic, receipt [ns] and content, and how often."""


class Taken:
    """Takes all messages of a walk as they are."""

    def __init__(self) -> None:
        self.messages: Read = Counter()
        self._topics: dict[int, str] = {}

    def connect(self, number: int, topic: str, kind: str, definition: str, language: str, encoding: str) -> bool:
        """Learn a topic's name."""
        self._topics[number] = topic
        return True

    def unpacked(self, size: int) -> None:
        """Nothing is bounded here."""

    def message(self, number: int, received: int, raw: bytes | memoryview) -> None:
        """Keep a message."""
        self.messages[self._topics[number], received, bytes(raw)] += 1


@dataclass(frozen=True)
class Family:
    """A format: the program that owns it, endings of its files, and how a file is held to it.

    Attributes
    ----------
    agree : what differs in a file, empty where nothing does
    write : files that the program itself writes
    """

    name: str
    endings: tuple[str, ...]
    agree: Callable[[Path], str]
    write: Callable[[Path], Iterator[Path]] = lambda folder: iter(())


def _mcap_ours(path: Path) -> Read:
    taken = Taken()
    with path.open("rb") as file:
        McapWalk(taken).read(file, path.stat().st_size, lambda share: None)  # type: ignore[arg-type]
    return taken.messages


def _mcap(path: Path) -> str:
    with path.open("rb") as file:
        theirs = Counter(
            (c.topic, m.log_time, m.data) for _, c, m in NonSeekingReader(file).iter_messages(log_time_order=False)
        )
    return _difference(_mcap_ours(path), theirs)


def _mcap_files(folder: Path) -> Iterator[Path]:
    """Every choice of the writer."""
    toggles = (
        "repeat_channels",
        "repeat_schemas",
        "use_statistics",
        "use_summary_offsets",
        "enable_crcs",
        "enable_data_crcs",
    )
    ways = [(False, CompressionType.NONE), *((True, how) for how in CompressionType)]
    for number, ((chunks, how), index, off) in enumerate(
        itertools.product(ways, (IndexType.ALL, IndexType.NONE, IndexType.MESSAGE), (None, *toggles))
    ):
        path = folder / f"mcap_{number}.mcap"
        chosen = {toggle: toggle != off for toggle in toggles}
        with path.open("wb") as stream:
            writer = McapWriter(
                stream, use_chunking=chunks, compression=how, index_types=index, chunk_size=300, **chosen
            )
            writer.start()
            schema = writer.register_schema("some", "jsonschema", b"{}")
            channels = [writer.register_channel(f"/topic/{k}", "json", schema) for k in range(3)]
            writer.add_attachment(5, 5, "a name", "text/plain", b"an attachment")
            for k in range(40):
                writer.add_message(channels[k % 3], 1000 - 7 * k, b'{"x": %d}' % k, 1000 - 7 * k, k)
            writer.add_metadata("some", {"a": "b"})
            writer.finish()
        yield path


def _bag(path: Path) -> str:
    taken = Taken()
    target = path.parent if path.suffix == ".db3" else path
    if path.suffix == ".bag":
        with path.open("rb") as file:
            ros1_bag._walk(file, path.stat().st_size, taken, Request())  # type: ignore[arg-type]
    else:
        walk_sqlite(path, taken, False, lambda share: None)  # type: ignore[arg-type]
    with AnyReader([target]) as reader:
        theirs = Counter((c.topic, received, bytes(raw)) for c, received, raw in reader.messages())
    return _difference(taken.messages, theirs)


def _bag_files(folder: Path) -> Iterator[Path]:
    for ending, write in (WRITERS[way] for way in ("ROS 1", "ROS 1 bz2", "ROS 1 lz4", "ROS 2 sqlite3")):
        number = len(list(folder.glob("bag_*")))
        path = write(folder / f"bag_{number}{ending}", recorded(small_world())[:500])
        yield next(path.glob("*.db3")) if path.is_dir() else path


def _ulog(path: Path) -> str:
    """Rows of the topics of motion: what pyulog has of them, less stamps that run back."""
    from pyulog import ULog

    with silenced():
        theirs = {data.name: data.data["timestamp"].size for data in ULog(str(path), ["vehicle_attitude"]).data_list}
    channel = read_log(path).channels.get("psi")
    ours = (
        0 if channel is None else channel.time.size + channel.lost.empty + channel.lost.repeated + channel.lost.astray
    )
    wanted = theirs.get("vehicle_attitude", 0)
    return "" if abs(ours - wanted) <= max(3, wanted // 100) else f"{ours} attitudes of {wanted}"


def _flash(path: Path) -> str:
    with silenced():
        log, theirs = DFReader.DFReader_binary(str(path)), Counter[str]()
        while (message := log.recv_msg()) is not None:
            theirs[message.get_type()] += 1
    found = DataFlash(path, Request())
    ours = {name: len(found.bodies(name)) for name in found.kinds}
    wrong = [f"{name}: {ours.get(name, 0)} of {n}" for name, n in theirs.items() if abs(ours.get(name, 0) - n) > 2]
    return ", ".join(wrong[:5])


def _tlog(path: Path) -> str:
    with silenced():
        log, theirs = mavutil.mavlink_connection(str(path)), Counter[str]()
        while (message := log.recv_msg()) is not None:
            theirs[message.get_type()] += 1
        log.close()
    found = Telemetry(path, Request())
    ours = Counter[str]()
    for key in found.messages():
        ours[definition_of(key[2]).name] += len(found.rows(key)[0])
    wrong = [f"{n}: {ours[n]} of {c}" for n, c in theirs.items() if n in ours and abs(ours[n] - c) > max(2, c // 50)]
    return ", ".join(wrong[:5])


def _tlog_files(folder: Path) -> Iterator[Path]:
    for local in (True, False):
        path = folder / f"local_{local}.tlog"
        path.write_bytes(bytes(telemetry_of(world(20.0), local=local).content))
        yield path


def _difference(ours: Read, theirs: Read) -> str:
    missing, more = (theirs - ours).total(), (ours - theirs).total()
    return f"{missing} of {theirs.total()} messages missing, {more} too many" if missing or more else ""


FAMILIES = (
    Family("mcap", (".mcap",), _mcap, _mcap_files),
    Family("rosbags", (".bag", ".db3"), _bag, _bag_files),
    Family("pyulog", (".ulg",), _ulog),
    Family("pymavlink, DataFlash", (".bin",), _flash),
    Family("pymavlink, telemetry", (".tlog",), _tlog, _tlog_files),
)


def compared(family: Family, path: Path) -> str:
    """What differs in a file; what the program itself cannot read must be refused or read in part by us."""
    with path.open("rb") as file:
        if file.read(len(LFS)) == LFS:
            return "pointer"
    try:
        return family.agree(path)
    except LogError as error:
        return f"refused: {error.typed[:100]}"
    except Exception as error:
        try:
            read_log(path)
        except LogError:
            return ""
        except Exception as ours:
            return f"{type(ours).__name__}: {ours}"
        return f"unread by its program ({type(error).__name__}), read by ours"


def main() -> int:
    """Print a row for every family and for every file that differs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", nargs="*", type=Path)
    chosen = parser.parse_args()
    found, bad = 0, 0
    print("| family | files written by the program | recorded files | read otherwise | pointers |")
    print("| --- | --- | --- | --- | --- |")
    for family in FAMILIES:
        with tempfile.TemporaryDirectory() as name:
            written = [(path, compared(family, path)) for path in family.write(Path(name))]
        paths = [
            p for folder in chosen.folders for p in sorted(folder.rglob("*")) if p.suffix.lower() in family.endings
        ]
        files = [(path, compared(family, path)) for path in paths if path.is_file() and path.stat().st_size]
        pointers = sum(told == "pointer" for _, told in files)
        wrong = [
            (p, told) for p, told in (*written, *files) if told and told != "pointer" and "read by ours" not in told
        ]
        print(f"| {family.name} | {len(written)} | {len(files) - pointers} | {len(wrong)} | {pointers} |", flush=True)
        for path, told in wrong:
            print(f"  {path.name}: {told}")
        found += bool(written or len(files) - pointers)
        bad += len(wrong)
    print(f"\n{found} families found.")
    return 1 if bad or found < 2 else 0


if __name__ == "__main__":
    sys.exit(main())
