"""Results that are kept as they come, so that a study which was stopped goes on where it was."""

import argparse
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from joblib import Parallel, delayed

from .fingerprint import fingerprint

ROOT = Path(__file__).parents[2]
PACKAGES = ("physics", "measurements", "discovery")
"""Packages whose source decides the results."""
_AT_ONCE = 10
"""Records after which the file is written anew."""
Kept = list[dict[str, Any]]


def kept(path: Path, packages: Sequence[str] = PACKAGES) -> Kept:
    """Records of an earlier run, if the same source made them."""
    if not path.is_file():
        return []
    stored = json.loads(path.read_text(encoding="utf-8"))
    return stored["records"] if stored["source"] == fingerprint(packages) else []


def resumed(
    path: Path,
    logs: int,
    jobs: int,
    judge: Callable[..., dict[str, Any]],
    *given: Any,
    packages: Sequence[str] = PACKAGES,
) -> Iterator[Kept]:
    """What is kept of so many logs, each time one more is judged.

    Parameters
    ----------
    path : where results are kept
    judge : called with what is given and the number of the log
    packages : whose source decides the results
    """
    records, made_by = kept(path, packages)[:logs], fingerprint(packages)
    yield records
    todo = (delayed(judge)(*given, n) for n in range(len(records), logs))
    judged = cast("Iterator[dict[str, Any]]", Parallel(n_jobs=jobs, return_as="generator")(todo))
    for record in judged:
        records.append(record)
        if len(records) % _AT_ONCE == 0 or len(records) == logs:
            path.parent.mkdir(parents=True, exist_ok=True)
            draft = path.with_suffix(".part")
            draft.write_text(json.dumps({"source": made_by, "records": records}, allow_nan=False), encoding="utf-8")
            draft.replace(path)
        yield records


class Study(NamedTuple):
    """A study of random logs, one record each.

    Attributes
    ----------
    name : of its script and of the folder where results are kept
    logs : how many, where nobody says it
    first : first seeds, by what they are for
    judge : called with the first seed and the number of a log
    line : says what came of the last record; empty to say nothing
    page : of the records, and of the command that made them
    packages : whose source decides the results
    """

    name: str
    logs: int
    first: Mapping[str, int]
    judge: Callable[..., dict[str, Any]]
    line: Callable[[Kept], str]
    page: Callable[[Kept, str], str]
    packages: tuple[str, ...] = PACKAGES


def carried_out(study: Study, described: str | None, arguments: Sequence[str] | None = None) -> Kept:
    """Run a study as the command line asks, go on where it was stopped, print its page, and give its records."""
    parser = argparse.ArgumentParser(description=described, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=int, default=study.logs)
    parser.add_argument("--seeds", choices=study.first, default="reporting")
    parser.add_argument("--jobs", type=int, default=min(4, os.cpu_count() or 1))
    parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / study.name, help="where results are kept")
    parser.add_argument("--table", type=Path)
    given = parser.parse_args(arguments)
    path, first = given.folder / f"{given.seeds}.json", study.first[given.seeds]
    records = kept(path, study.packages)[: given.logs]
    if not given.tell:
        for records in resumed(path, given.logs, given.jobs, study.judge, first, packages=study.packages):
            line = study.line(records) if records else ""
            if line:
                print(f"{len(records)}/{given.logs}: {line}", flush=True)
    text = study.page(records, f"python benchmarks/{study.name}.py --logs {len(records)} --seeds {given.seeds}")
    if given.table is not None:
        given.table.write_text(text, encoding="utf-8")
    print(text)
    return records


def bound(hits: int, of: int, level: float) -> float:
    """Clopper and Pearson's upper bound of a share, one-sided (doi:10.1093/biomet/26.4.404)."""
    from scipy.stats import beta

    return float(beta.ppf(level, hits + 1, of - hits)) if hits < of else 1.0


def in_a_table(head: Sequence[str], rows: Sequence[Sequence[object]], rest: str = "---:") -> str:
    """A table in Markdown, its first column to the left and the rest to the right, or as `rest` says."""
    lines = [head, ["---", *[rest] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def times_told(records: Sequence[Mapping[str, Any]]) -> str:
    """How long answers took, in words, of records that have `seconds`."""
    seconds = [r["seconds"] for r in records if "seconds" in r] or [0.0]
    median, most = np.percentile(seconds, (50.0, 90.0))
    return (
        f"An answer took {median:.1f} s in the median, nine of ten at most {most:.1f} s, the longest "
        f"{max(seconds):.0f} s."
    )
