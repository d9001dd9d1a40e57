"""What becomes of the user's files, and of the command line, when things go wrong: kills, full disks, hostile inputs.

Every row of the table is an attack on `python -m undertow`. A try is bad when a file of the user's is lost or
half-written, when a traceback is seen, when a process hangs (60 s), holds more than 1.5 GB, says more than 4,000
characters in one message, or ends otherwise than it should: then the exit code is 1.

    python benchmarks/robustness.py [--part NAME]... [--kills 200] [--seed 0] [--table docs/robustness.md]

With --part, the rows of these parts take the place of those in an earlier table, and the others stay.

Kills need strace (without it Python's own audit hooks take its place, which do not see calls through ctypes); small and
read-only disks need root. Whole, it takes some 20 minutes on two cores.
"""

import argparse
import os
import platform
import re
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from itertools import count
from pathlib import Path

from attacks import bombs, disks, kills, names, pairs, resumes, signals, terminals
from attacks.killing import STRACE
from attacks.trial import Attack, Ground, Job, Row, Trial, ground

WORKERS = 2
"""Tries at a time; more of them only wait for one another on a small machine."""
PARTS = ("kills", "pairs", "resume", "disks", "signals", "terminals", "names", "bombs")
SHARE = {"pairs": 0.05, "resume": 0.1, "signals": 0.02}
"""Tries of a row for each of --kills."""
SHOWN = 10
"""Failed tries of a row that the table tells of."""


def planned(ground: Ground, scratch: Path, chosen: argparse.Namespace) -> Iterator[Attack]:
    """The attacks of the chosen parts, made when their turn comes."""
    wanted, seed = chosen.part, chosen.seed
    tries = {part: max(2, round(share * chosen.kills)) for part, share in SHARE.items()}
    if {"kills", "pairs", "resume"} & set(wanted):
        killing = kills.Killing(ground, scratch, WORKERS)
        if "kills" in wanted:
            yield from kills.attacks(killing, scratch, chosen.kills, seed)
        if "pairs" in wanted:
            yield from pairs.attacks(killing, scratch, tries["pairs"], seed)
        if "resume" in wanted:
            yield from resumes.attacks(killing, scratch, tries["resume"], seed)
        killing.close()
    if "disks" in wanted:
        yield from disks.attacks(ground)
    if "signals" in wanted:
        yield from signals.attacks(ground, tries["signals"], seed)
    if "terminals" in wanted:
        yield from terminals.attacks(ground)
    if "names" in wanted:
        yield from names.attacks(ground)
    if "bombs" in wanted:
        yield from bombs.attacks(ground, scratch)


def tried(job: Job, place: Path) -> Trial:
    """A try in a folder of its own, which goes again."""
    place.mkdir()
    try:
        return job(place)
    finally:
        shutil.rmtree(os.fsencode(place), ignore_errors=True)


def lines_of(table: Path) -> list[str]:
    """The rows of a table that an earlier run wrote."""
    text = table.read_text("utf-8") if table.exists() else ""
    return [line for line in text.splitlines() if line.startswith("| ") and not line.startswith(("| ---", Row.HEAD))]


def cells_of(line: str) -> list[str]:
    """The cells of a row, its name first."""
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def with_earlier(rows: Sequence[Row], earlier: Sequence[str]) -> tuple[list[str], int]:
    """All rows of the table, each new one in the place of the earlier one of its name or at the end; tries that failed.

    Of an earlier row only its faults are known, and the most frequent kind of them counts.
    """
    lines = list(earlier)
    places = list(range(len(lines)))
    for row in map(str, rows):
        same = [k for k in places if cells_of(lines[k])[0] == cells_of(row)[0]]
        if same:
            places.remove(same[0])
            lines[same[0]] = row
        else:
            lines.append(row)
    kept = sum(max(int(cell) for cell in cells_of(lines[k])[2:7]) for k in places if "not tried" not in lines[k])
    return lines, kept + sum(len(row.bad) for row in rows)


def page(rows: Sequence[Row], earlier: Sequence[str], seconds: float, seed: int) -> str:
    """The text of docs/robustness.md."""
    lines, bad = with_earlier(rows, earlier)
    tries = sum(int(cells_of(line)[1]) for line in lines if "not tried" not in line)
    knife = "strace" if STRACE else "Python's audit hooks, for want of strace"
    part = f"; {len(rows)} of its {len(lines)} rows were tried again in" if earlier else ","
    told = [
        "# What becomes of your files when things go wrong",
        "Each row is an attack on the command line, and each try a process of its own on files that it must not lose: "
        f"{tries} tries with seed {seed}{part} {seconds / 60:.0f} minutes on {os.cpu_count()} cores "
        f"(Python {platform.python_version()}, {platform.system()}; killed by {knife}).",
        "A try fails when a file of the user's is lost or half-written, when a traceback is seen, when a process hangs "
        "(60 s), holds more than 1.5 GB, says more than 4,000 characters in one message, or ends with another exit "
        "code or other files than it should (other faults).",
        f"**{bad} of {tries} tries failed.**",
        "\n".join([Row.HEAD, "| --- |" + " --- |" * 8, *lines]),
    ]
    for row in rows:
        if row.bad:
            failed = [f"- `{trial.what[:160]!a}`: {'; '.join(trial.faults)[:300]!a}" for trial in row.bad[:SHOWN]]
            told.append(f"## Failed: {row.attack.name}\n" + "\n".join(failed))
    told.append("Written by `python benchmarks/robustness.py --table docs/robustness.md`; do not edit.")
    return "\n\n".join(told) + "\n"


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
        print("STRACE IS MISSING: Python's audit hooks kill instead, and do not see ctypes", file=sys.stderr)
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # begun in the background: what it starts would ignore Ctrl-C
        signal.signal(signal.SIGINT, signal.default_int_handler)
    begun, rows = time.perf_counter(), []
    print(f"undertow {version('undertow')}\n\n{Row.HEAD}\n| --- |" + " --- |" * 8)
    with tempfile.TemporaryDirectory(prefix="undertow-robustness-") as folder, ThreadPoolExecutor(WORKERS) as pool:
        scratch = Path(folder)
        scratch.chmod(0o755)
        base = chosen.ground or scratch / "ground"
        base.mkdir(exist_ok=True)
        made, numbers = ground(base.absolute()), count()
        for attack in planned(made, scratch, chosen):
            row = Row(attack)
            row.trials.extend(pool.map(lambda job: tried(job, scratch / f"try{next(numbers)}"), attack.jobs))
            rows.append(row)
            print(row, flush=True)
            for trial in row.bad:
                print(f"    {trial.what}: {'; '.join(trial.faults)}", file=sys.stderr, flush=True)
    bad, seconds = sum(len(row.bad) for row in rows), time.perf_counter() - begun
    print(f"\n{bad} of {sum(len(row.trials) for row in rows)} tries failed; {seconds:.0f} s")
    if chosen.table is not None:
        earlier = [] if tuple(chosen.part) == PARTS else lines_of(chosen.table)
        chosen.table.write_text(page(rows, earlier, seconds, chosen.seed), "utf-8")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
