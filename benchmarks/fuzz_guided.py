"""Fuzz the readers of logs guided by what code they reach, with atheris (pip install atheris).

python benchmarks/fuzz_guided.py [--seconds 150] [--format NAME]... [--work FOLDER] [--keep]

Each format begins with a sound log of 2 s and with the corpus that earlier runs kept in benchmarks/corpus. What counts
as a crash is any exception but LogError; as a hang, more than 10 s; memory is bounded at 1.5 GB. A file that does
one of these is left in the folder of work, and the exit code is 1. With --keep, the smallest inputs that reached new
code are put into the corpus, at most 12 kB a format.
"""

import argparse
import contextlib
import os
import re
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

CORPUS = Path(__file__).resolve().parent / "corpus"
TIMEOUT, MEMORY = 10, 1500
"""Seconds and megabytes that reading one file may take."""
_KEPT, _MOST = 12 * 1024, 12
"""Bytes and inputs of the corpus of one format, so that all of them together stay small beside the repository."""
_WHOLE = ("whole", "part_8", "part_40")
"""Inputs that the sound log gives."""


def one(name: str, words: list[str]) -> None:
    """Fuzz one format in this process; does not come back."""
    atheris = import_module("atheris")

    with atheris.instrument_imports(include=["undertow.measurements"]):
        from undertow.measurements.log import read_log
        from undertow.physics.errors import LogError
    from log_samples import SAMPLES

    folder = Path(tempfile.mkdtemp())
    sample = SAMPLES[name](folder)
    read_log(sample.log)

    def read(content: bytes) -> None:
        sample.file.write_bytes(content)
        with contextlib.suppress(LogError):
            read_log(sample.log)

    atheris.Setup([sys.argv[0], *words], read)
    atheris.Fuzz()


def seeds(name: str, folder: Path) -> None:
    """Put a short sound log and the kept corpus of a format into a folder."""
    from log_samples import SAMPLES

    with tempfile.TemporaryDirectory() as inner:
        content = SAMPLES[name](Path(inner)).file.read_bytes()
    for name_of, share in zip(_WHOLE, (1, 8, 40), strict=True):
        (folder / name_of).write_bytes(content[: len(content) // share])
    for path in sorted(CORPUS.glob(f"{slug(name)}/*")):
        (folder / path.name).write_bytes(path.read_bytes())


def slug(name: str) -> str:
    """A format's name as that of a folder.

    >>> slug("ROS 2 sqlite3"), slug("long CSV, gzip")
    ('ros_2_sqlite3', 'long_csv_gzip')
    """
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def fuzzed(name: str, seconds: int, work: Path, keep: bool) -> tuple[str, int]:
    """Fuzz one format in a process of its own; a row of the report, and the files that failed."""
    corpus, failed = work / slug(name), work / f"{slug(name)}_failed"
    corpus.mkdir(parents=True, exist_ok=True)
    failed.mkdir(exist_ok=True)
    seeds(name, corpus)
    how = [f"-max_total_time={seconds}", f"-timeout={TIMEOUT}", f"-rss_limit_mb={MEMORY}", "-max_len=400000"]
    how += [f"-artifact_prefix={failed}/", "-print_final_stats=1", str(corpus)]
    command = [sys.executable, __file__, "--one", name, *how]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False, env=os.environ)
    told = {key: re.findall(pattern, done.stderr) for key, pattern in _STATS.items()}
    bad = list(failed.iterdir())
    if done.returncode and not bad:
        print(done.stderr[-2000:], file=sys.stderr)
    cells = [name, *(found[-1] if found else "" for found in told.values()), str(len(bad))]
    if keep:
        _keep(name, corpus)
    return f"| {' | '.join(cells)} |", len(bad) + bool(done.returncode and not bad)


_STATS = {
    "runs": r"number_of_executed_units:\s+(\d+)",
    "reached": r"cov: (\d+)",
    "memory": r"peak_rss_mb:\s+(\d+)",
}


def _keep(name: str, corpus: Path) -> None:
    """Keep the smallest inputs of a corpus, each of which reached new code when it was found."""
    target, size = CORPUS / slug(name), 0
    target.mkdir(parents=True, exist_ok=True)
    for path in target.iterdir():
        path.unlink()
    found = (path for path in corpus.iterdir() if path.name not in _WHOLE)
    for path in sorted(found, key=lambda path: path.stat().st_size)[:_MOST]:
        size += path.stat().st_size
        if size > _KEPT:
            break
        (target / path.name[:12]).write_bytes(path.read_bytes())


def main() -> int:
    """Print a row for every format."""
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2], sys.argv[3:])
        return 0
    from log_samples import SAMPLES

    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=int, default=150)
    parser.add_argument("--format", action="append", choices=list(SAMPLES))
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "fuzz_guided")
    parser.add_argument("--keep", action="store_true")
    chosen = parser.parse_args()
    print("| format | files read | places reached | memory [MB] | failed |\n| --- | --- | --- | --- | --- |")
    bad = 0
    for name in chosen.format or SAMPLES:
        row, failed = fuzzed(name, chosen.seconds, chosen.work, chosen.keep)
        print(row, flush=True)
        bad += failed
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
