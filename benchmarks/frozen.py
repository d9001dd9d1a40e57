"""Freeze what `discover` answers on a fixed set of logs, and print what a change of the code makes of it.

    python benchmarks/frozen.py FOLDER [--write] [--all] [--case NAME]...

With `--write` the logs and the answers (findings.json, model.yaml, the text of the terminal, seconds) are kept in
FOLDER; without it they are compared with those, numbers to a relative 1e-9. `--all` takes sixty logs in place of a few.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml
from study.field_logs import RUNS
from study.studies import STUDIES

CLOSE = 1e-9
FEW = {
    "plain": ("gentle", "rough", "singles", "zigzag", "nothing", "waves", "pairs", "crowds", "clean"),
    "short": ("45 s",),
    "foreign": ("cross-flow of strips", "compass that deviates", "current that turns", "commands that act late"),
    "nameless": ("drag with a kink",),
    "sensors": ("speeds 0.2 s late", "gyro off by 0.02 rad/s"),
    "others": ("Otter: one effect", "WAM-V: nothing hidden"),
}
MORE = {study: tuple(dict.fromkeys(kind for kind, _ in STUDIES[study].keys("tuning")))[:9] for study in FEW}
FIELD = ("C_1", "E_2", "G_2")
"""Gazebo runs, of which the first is searched with `--refit`, too, and beside the second as one of several logs."""


def cases(every: bool) -> Iterator[tuple[str, list[tuple[str, str, int]], list[str]]]:
    """Name, logs (study, kind, seed), and options of each case."""
    for study, kinds in FEW.items():
        for kind in dict.fromkeys((*kinds, *(MORE[study] if every else ()))):
            seed = next(seed for known, seed in STUDIES[study].keys("tuning") if known == kind)
            yield f"{study}: {kind}", [(study, kind, seed)], []
    lake, *others = (("field", kind, number) for kind, number in STUDIES["field"].keys("reporting"))
    gazebo = [next(log for log in others if log[1] != lake[1] and RUNS[log[2]][0] == run) for run in FIELD]
    yield "lake", [lake], []
    for run, log in zip(FIELD, gazebo, strict=True):
        yield f"gazebo {run}", [log], []
    yield "refit", gazebo[:1], ["--refit"]
    yield "several", gazebo[:2], []


def answered(folder: Path, name: str, logs: Sequence[tuple[str, str, int]], options: Sequence[str]) -> dict[str, Any]:
    """What the verb makes of some logs, which are drawn where they are not kept."""
    here = folder / name
    if not here.is_dir():
        here.mkdir(parents=True)
        drawn = [STUDIES[study].logged(kind, seed) for study, kind, seed in logs]
        drawn[0].vehicle.save(here / "vehicle.yaml")
        for number, logged in enumerate(drawn):
            (here / str(number)).mkdir()
            logged.write(here / str(number) / f"log_{number}.csv")
    paths = [str(path) for path in sorted(here.glob("*/log_*")) or sorted(here.glob("*/*"))]
    with tempfile.TemporaryDirectory() as out:
        asked = ["discover", *paths, "--vehicle", str(here / "vehicle.yaml"), "--out", f"{out}/run", "--no-report"]
        begun = time.perf_counter(), sum(os.times()[2:4])
        run = subprocess.run([sys.executable, "-m", "undertow", *asked, *options], capture_output=True, text=True)
        spent = time.perf_counter() - begun[0], sum(os.times()[2:4]) - begun[1]
        found: dict[str, Any] = {"code": run.returncode, "error": run.stderr[-300:] if run.returncode else ""}
        if run.returncode == 0:
            told = run.stdout.replace(f"{out}/run", "RUN")
            found["text"] = re.sub(r"\d+(\.\d+)? s\b|\s+", " ", told)
            found["findings"] = json.loads((Path(out) / "run" / "findings.json").read_text("utf-8"))
            found["model"] = yaml.safe_load((Path(out) / "run" / "model.yaml").read_text("utf-8"))
    return found | {"seconds": spent}


def differences(one: Any, other: Any, place: str = "") -> Iterator[str]:
    """Where two answers differ, and by how much."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in {**one, **other}:
            yield from differences(one.get(key), other.get(key), f"{place}.{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from differences(a, b, f"{place}[{number}]")
    elif isinstance(one, float | int) and isinstance(other, float | int) and one != other:
        share = abs(one - other) / max(abs(one), abs(other))
        if share > CLOSE:
            yield f"{place}: {one:.9g} is {other:.9g} ({share:.1g})"
    elif one != other:
        pairs = enumerate(zip(str(one), str(other), strict=False))
        at = max(0, next((n for n, (a, b) in pairs if a != b), 0) - 40)
        yield f"{place}: {str(one)[at : at + 120]!r} is {str(other)[at : at + 120]!r}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Keep answers, or compare with those that are kept; exit code 1 where one differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--case", action="append", help="this case alone; may be repeated")
    given = parser.parse_args(arguments)
    differ, before, now = 0, 0.0, 0.0
    for name, logs, options in cases(given.all):
        if given.case and name not in given.case:
            continue
        name = re.sub(r"\W+", "_", name)
        file = given.folder / f"{name}.json"
        if given.write and file.is_file():
            continue
        found = answered(given.folder, name, logs, options)
        wall, cpu = found.pop("seconds")
        if given.write:
            file.write_text(json.dumps(found | {"seconds": (wall, cpu)}), encoding="utf-8")
            print(f"{name}: {wall:.1f} s, {cpu:.1f} s of CPU, exit {found['code']}", flush=True)
            continue
        known = json.loads(file.read_text("utf-8"))
        earlier = known.pop("seconds")[1]
        before, now = before + earlier, now + cpu
        lines = list(differences(known, json.loads(json.dumps(found))))
        differ += bool(lines)
        print(f"{name}: {len(lines)} differences, {cpu:.1f} s ({earlier:.1f})", *lines[:12], sep="\n  ", flush=True)
    if not given.write:
        print(f"{differ} answers differ; {now:.0f} s of CPU, {before:.0f} before")
    return int(differ > 0)


if __name__ == "__main__":
    sys.exit(main())
