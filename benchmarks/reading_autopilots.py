"""Measure how fast the logs of autopilots are read, against the bare libraries.

python benchmarks/reading_autopilots.py [--seconds 600]

`read_log` against pymavlink's own readers (`recv_match` over the messages that become channels), pyulog over the same
topics, on a simulated world of so many seconds. Both in processor time, the best of seven runs.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from dataflash_files import dataflash_of
from pymavlink import DFReader, mavutil
from pyulog import ULog
from reading import compared
from round_trip import world
from telemetry_files import telemetry_of
from ulog_files import ulog_of

from undertow.measurements.formats.autopilots.autopilot import silenced
from undertow.measurements.log import read_log

DATAFLASH = ["XKF1", "XKF4", "IMU", "RCOU", "PARM"]
TELEMETRY = ["ATTITUDE", "LOCAL_POSITION_NED", "RAW_IMU", "SERVO_OUTPUT_RAW", "PARAM_VALUE", "HEARTBEAT"]
ULOG = [
    "vehicle_local_position",
    "vehicle_attitude",
    "vehicle_angular_velocity",
    "sensor_combined",
    "actuator_motors",
    "actuator_outputs",
]


def iterated(log: object, kinds: list[str]) -> int:
    """Iterate over messages of some kinds as pymavlink does."""
    count = 0
    while log.recv_match(type=kinds) is not None:  # type: ignore[attr-defined]
        count += 1
    return count


def main() -> None:
    """Print a row for every format."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    log = world(parser.parse_args().seconds)
    print("| format | MB | library | library [s] | undertow [s] | speed against the library |")
    print("| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        flash, radio, ulog = folder / "log.bin", folder / "log.tlog", folder / "log.ulg"
        flash.write_bytes(bytes(dataflash_of(log).content))
        radio.write_bytes(bytes(telemetry_of(log).content))
        ulog.write_bytes(bytes(ulog_of(log).content))
        rows: tuple[tuple[str, Path, str, Callable[[], object]], ...] = (
            ("DataFlash", flash, "pymavlink", lambda: iterated(DFReader.DFReader_binary(str(flash)), DATAFLASH)),
            ("telemetry", radio, "pymavlink", lambda: iterated(mavutil.mavlink_connection(str(radio)), TELEMETRY)),
            ("ULog", ulog, "pyulog", lambda: ULog(str(ulog), ULOG)),
        )
        for kind, path, library, theirs in rows:
            with silenced():
                slow, fast = compared(theirs, lambda path=path: read_log(path))
            cells = [kind, f"{path.stat().st_size / 1e6:.1f}", library, f"{slow:.3f}", f"{fast:.3f}"]
            print(f"| {' | '.join(cells)} | {100 * slow / fast:.0f} % |", flush=True)


if __name__ == "__main__":
    main()
