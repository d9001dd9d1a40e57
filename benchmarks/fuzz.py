"""Read broken logs of every format, and count what ends in anything but a clear error.

python benchmarks/fuzz.py [--files 2000] [--format NAME]... [--seed 0] [--inspect]

Each file is a sound log of 30 s with bytes flipped, cut, moved, doubled, wiped, or with extreme lengths. It is read
in a process that has 10 s for each file, and 1 GB of memory beyond what the loaded program takes. What counts as a
crash is any exception but LogError, and a LogError that comes of memory that ran out; as a hang, more than 10 s; memory
is the most that the process held at once. With --inspect, what could be read is inspected as well.
"""

import argparse
import multiprocessing
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from log_samples import SAMPLES, broken
from memory import peak_memory

SECONDS = 10
MEMORY = 2**30
"""Bytes that reading may take."""


@dataclass
class Tally:
    """Outcomes of the files of one format, crashes and hangs by their seeds."""

    outcomes: Counter[str] = field(default_factory=Counter)
    worst: list[str] = field(default_factory=list)
    memory: float = 0.0


def _held() -> int:
    """Address space of this process [bytes]."""
    pages = Path("/proc/self/statm").read_text().split()[0]
    return int(pages) * resource.getpagesize()


def ran_out(error: BaseException | None) -> bool:
    """Whether an error comes of memory that ran out, which the readers' door tells as a broken file."""
    while error is not None:
        if (
            isinstance(error, MemoryError)
            or "nable to allocate" in str(error)
            or "cannot allocate" in str(error).lower()
        ):
            return True
        error = error.__cause__ or error.__context__
    return False


def _work(name: str, seeds: range, inspect: bool, channel: Connection) -> None:
    """Read broken files, and tell what became of each."""
    from undertow.measurements.inspection import inspect_log
    from undertow.measurements.log import read_log
    from undertow.physics.errors import LogError

    with tempfile.TemporaryDirectory() as folder:
        sample = SAMPLES[name](Path(folder))
        sound = sample.file.read_bytes()
        read_log(sample.log)
        limit = _held() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        before = peak_memory()
        # The default action ends the process even inside a library: the parent sees that it died of this signal.
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        for seed in seeds:
            sample.file.write_bytes(broken(sound, seed))
            signal.alarm(SECONDS)
            try:
                log = read_log(sample.log)
                if inspect:
                    inspect_log(log)
                outcome = "read"
            except LogError as error:
                outcome = "memory" if ran_out(error) else "clear error"
            except BaseException as error:
                outcome = f"{type(error).__name__}: {str(error)[:100]}"
            signal.alarm(0)
            channel.send((seed, outcome, peak_memory() - before))
    channel.close()


Work = Callable[[str, range, bool, Connection], None]


def fuzz(name: str, seeds: range, inspect: bool = False, work: Work = _work) -> Tally:
    """Read broken files of one format, in as many processes as die of it; `work` sends (seed, outcome, bytes held)."""
    tally = Tally()
    context = multiprocessing.get_context("spawn")
    while seeds:
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(target=work, args=(name, seeds, inspect, theirs))
        process.start()
        theirs.close()
        done = seeds.start - 1
        try:
            while True:
                done, outcome, held = ours.recv()
                tally.memory = max(tally.memory, held / 1e6)
                kind = outcome if outcome in ("read", "clear error") else "crash"
                tally.outcomes[kind] += 1
                if kind == "crash":
                    tally.worst.append(f"seed {done}: {outcome}")
        except EOFError:
            process.join()
        seeds = range(done + 1, seeds.stop)
        if seeds:
            kind = "hang" if process.exitcode == -signal.SIGALRM else "crash"
            tally.outcomes[kind] += 1
            tally.worst.append(f"seed {seeds.start}: {kind}, exit code {process.exitcode}")
            seeds = range(seeds.start + 1, seeds.stop)
    return tally


def main() -> None:
    """Print a row for every format; leave with exit code 1 when a file crashed or hung."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=2000)
    parser.add_argument("--format", action="append", choices=list(SAMPLES))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--inspect", action="store_true")
    chosen = parser.parse_args()
    print("| format | files | read | clear errors | crashes | hangs | memory [MB] | seconds |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    bad = 0
    for name in chosen.format or SAMPLES:
        begun = time.perf_counter()
        tally = fuzz(name, range(chosen.seed, chosen.seed + chosen.files), chosen.inspect)
        counts = [tally.outcomes[kind] for kind in ("read", "clear error", "crash", "hang")]
        bad += counts[2] + counts[3]
        cells = [name, chosen.files, *counts, f"{tally.memory:.0f}", f"{time.perf_counter() - begun:.0f}"]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
        for text in tally.worst[:10]:
            print(f"  {text}", file=sys.stderr)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
