"""What becomes of the user's files, and of the command line, when things go wrong: kills, full disks, hostile inputs.

Every row of the table is an attack on `python -m undertow`. A try is bad when a file of the user's is lost or half-written,
when a traceback is seen, when a process hangs (60 s), holds more than 1.5 GB, says more than 4,000 characters in one
message, or ends otherwise than it should: then the exit code is 1.

    python benchmarks/robustness.py [--part NAME]... [--kills 200] [--seed 0] [--table docs/robustness.md]

Kills need strace (without it, Python's own audit hooks take its place, and calls through ctypes are not seen); small and
read-only disks need root.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path

from attacks import kills
from attacks.killing import STRACE
from attacks.trial import Attack, Ground, Row, ground

WORKERS = 2
"""Tries at a time; more of them only wait for one another on a small machine."""
PARTS = ("kills",)


def planned(ground: Ground, scratch: Path, chosen: argparse.Namespace) -> Iterator[Attack]:
    """The attacks of the chosen parts, made when their turn comes."""
    if "kills" in chosen.part:
        killing = kills.Killing(ground, scratch, WORKERS)
        yield from kills.attacks(killing, scratch, chosen.kills, chosen.seed)
        killing.close()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", action="append", choices=PARTS)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--ground", type=Path, help="folder that keeps the sound files for the next time")
    parser.add_argument("--table", type=Path)
    chosen = parser.parse_args()
    chosen.part = chosen.part or PARTS
    if not STRACE:
        print("strace is missing: kills are made by Python's audit hooks, which do not see ctypes", file=sys.stderr)
    begun, rows = time.perf_counter(), []
    with tempfile.TemporaryDirectory(prefix="undertow-robustness-") as folder, ThreadPoolExecutor(WORKERS) as pool:
        scratch = Path(folder)
        base = chosen.ground or scratch / "ground"
        base.mkdir(exist_ok=True)
        made, numbers = ground(base.absolute()), count()
        for attack in planned(made, scratch, chosen):
            row = Row(attack)
            places = [scratch / f"try{next(numbers)}" for _ in attack.jobs]
            for place in places:
                place.mkdir()
            row.trials.extend(pool.map(lambda job, place: job(place), attack.jobs, places))
            rows.append(row)
            print(row, flush=True)
            for trial in row.bad:
                print(f"    {trial.what}: {'; '.join(trial.faults)}", file=sys.stderr, flush=True)
    bad = sum(len(row.bad) for row in rows)
    print(f"{bad} of {sum(len(row.trials) for row in rows)} tries failed; {time.perf_counter() - begun:.0f} s")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
