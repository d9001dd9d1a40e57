"""Freeze what the verbs answer to 60 logs, and compare with it after a change that must change nothing.

    python benchmarks/digests.py freeze|compare [--file build/digests.jsonl.gz] [--logs N] [--jobs N]

Each log goes through `discover`, `compare` and `check` on the command line, in a folder of its own. Kept are the
numbers and words of the findings, the comparison and the audit, the corrected model, what the terminal showed, and the
text of the page. Numbers are the same where they differ by 1e-9 of themselves, words where they are the same letters.
Logs: the demo, with and without `--refit`; a log in two parts; logs of the studies (own and foreign worlds, other
simulators, causes without a name, wrong sensors, waves), and real ones where they lie beside the repository. `freeze`
begins anew; `compare` ends with exit code 1 where something differs, and says what and where.
"""

import argparse
import gzip
import json
import math
import re
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from html import unescape
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple, cast
from unittest.mock import patch

import yaml
from joblib import Parallel, delayed
from study.records import ROOT, processors
from study.studies import STUDIES
from typer.testing import CliRunner

from undertow.__main__ import app

FILE = ROOT / "build" / "digests.jsonl.gz"
SAME = 1e-9
"""Relative difference up to which two numbers are one."""
TUNING = {"plain": 12, "foreign": 14, "others": 10, "nameless": 6, "sensors": 6, "seas": 2}
"""Logs of each study, in the order of its tuning seeds."""
FIELD = 12
"""Real logs at most."""
CLOCKS = ("time.perf_counter", "undertow.comparison.comparison.perf_counter", "undertow.residuals.scores.perf_counter")
"""Clocks that stand still, for what is told of times."""
SHOWN = 5
"""Differences of a log that are shown."""


class Case(NamedTuple):
    """A log to ask about: its study, kind and seed (the demo has none of the studies), and options of `discover`."""

    study: str
    kind: str
    seed: int = 0
    options: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What a line calls it."""
        return " ".join(map(str, (*self[:3], *self.options)))


def cases() -> list[Case]:
    """All of them."""
    own = [Case("demo", "one log"), Case("demo", "one log", 0, ("--refit",)), Case("demo", "two parts")]
    drawn = [Case(study, *key) for study, most in TUNING.items() for key in STUDIES[study].keys("tuning")[:most]]
    real = [] if STUDIES["field"].absent() else [Case("field", *key) for key in STUDIES["field"].keys("reporting")]
    return own + drawn + real[:: max(1, len(real) // FIELD)][:FIELD]


def inputs_of(case: Case, folder: Path) -> list[Path]:
    """The vehicle file of a case, and its logs, some written to a folder."""
    if case.study != "demo":
        logged = STUDIES[case.study].logged(case.kind, case.seed)
        logged.vehicle.save(folder / "vehicle.yaml")
        return [folder / "vehicle.yaml", logged.write(folder / "log.csv")]
    log = ROOT / "data" / "gazebo_blueboat.csv.gz"
    if case.kind == "one log":
        return [ROOT / "data" / "demo.yaml", log]
    head, *rows = gzip.decompress(log.read_bytes()).decode().splitlines(keepends=True)
    paths = [folder / "first.csv", folder / "second.csv"]
    for path, some in zip(paths, (rows[: len(rows) // 2], rows[len(rows) // 2 :]), strict=True):
        path.write_text(head + "".join(some), encoding="utf-8")
    return [ROOT / "data" / "demo.yaml", *paths]


def answered(case: Case) -> dict[str, Any]:
    """All that the verbs answer to a case, by what it is."""
    folder = FILE.parent / "digests" / re.sub(r"\W+", "-", case.name)  # the same each time: pages tell where they lie
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    with ExitStack() as still:
        for clock in CLOCKS:
            still.enter_context(patch(clock, lambda: 0.0))
        vehicle, *logs = inputs_of(case, folder)
        run, runner = folder / "run", CliRunner()

        def told(*words: str | Path) -> str:
            result = runner.invoke(app, [str(word) for word in words])
            return f"exit code {result.exit_code}\n{result.output}"

        kept: dict[str, Any] = {
            "discover": told("discover", *logs, "-v", vehicle, "--out", run, "--quiet", *case.options)
        }
        if (run / "findings.json").is_file():
            kept["compare"] = told("compare", *logs, "-v", vehicle, "--model", run, "--out", folder / "c.json", "-q")
            kept["check"] = told("check", run, "--out", folder / "a.json", "-q")
            files = {"findings": run / "findings.json", "comparison": folder / "c.json", "audit": folder / "a.json"}
            kept |= {what: json.loads(path.read_text("utf-8")) for what, path in files.items()}
            kept["model"] = yaml.safe_load((run / "model.yaml").read_text("utf-8"))
            kept["page"] = text_of((run / "report.html").read_text("utf-8"))
    placeless = json.dumps(kept).replace(str(ROOT), ".")  # so that another checkout can be compared
    return {"case": case.name, "kept": json.loads(placeless)}


def text_of(page: str) -> str:
    """The words of a page, a line each time an element begins."""
    bare = re.sub(r"<(script|style|svg)\b.*?</\1>", "", page, flags=re.DOTALL)
    lines = (" ".join(unescape(part).split()) for part in re.split(r"<[^>]*>", bare))
    named = re.compile(r"[0-9a-f]{12}").fullmatch  # the digest of a file that holds paths
    return "\n".join(line for line in lines if line and not named(line))


def differences(before: Any, after: Any, place: str = "") -> Iterator[str]:
    """Where two answers differ, and in what."""
    if isinstance(before, Mapping) and isinstance(after, Mapping):
        for key in dict.fromkeys((*before, *after)):
            yield from differences(before.get(key), after.get(key), f"{place}/{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, (one, other) in enumerate(zip(before, after, strict=True)):
            yield from differences(one, other, f"{place}/{number}")
    elif isinstance(before, str) and isinstance(after, str) and "\n" in before and before != after:
        gone, come = before.splitlines(), after.splitlines()
        number, one, other = next((n, a, b) for n, (a, b) in enumerate(zip_longest(gone, come), 1) if a != b)
        yield f"{place}, line {number}: {one!r} -> {other!r}"
    elif isinstance(before, float) and isinstance(after, float):
        same = math.isclose(before, after, rel_tol=SAME) or (math.isnan(before) and math.isnan(after))
        if not same:
            yield f"{place}: {before} -> {after}"
    elif before != after:
        yield f"{place}: {str(before)[:80]!r} -> {str(after)[:80]!r}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Freeze or compare; exit code 1 where something differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("freeze", "compare"))
    parser.add_argument("--file", type=Path, default=FILE)
    parser.add_argument("--logs", type=int, default=1000, help="at most so many")
    parser.add_argument("--jobs", type=int, default=processors())
    given = parser.parse_args(arguments)
    asked = cases()[: given.logs]
    every = Parallel(n_jobs=given.jobs, return_as="generator")(delayed(answered)(case) for case in asked)
    found = cast("Iterator[dict[str, Any]]", every)
    if given.what == "freeze":
        given.file.parent.mkdir(parents=True, exist_ok=True)
        with gzip.open(given.file, "wt", encoding="utf-8") as file:
            for answer in found:
                file.write(json.dumps(answer) + "\n")
        print(f"{len(asked)} logs are frozen in {given.file}")
        return 0
    with gzip.open(given.file, "rt", encoding="utf-8") as file:
        before = {answer["case"]: answer["kept"] for answer in map(json.loads, file)}
    changed = 0
    for answer in found:
        told = list(differences(before.get(answer["case"]), answer["kept"]))
        changed += bool(told)
        more = [f"and {len(told) - SHOWN} more"] * (len(told) > SHOWN)
        for line in (*told[:SHOWN], *more):
            print(f"{answer['case']}: {line}", flush=True)
    print(f"{changed} of {len(asked)} logs are answered otherwise")
    return int(bool(changed))


if __name__ == "__main__":
    sys.exit(main())
