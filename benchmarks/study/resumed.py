"""Results that are kept as they come, so that a study which was stopped goes on where it was."""

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, cast

from joblib import Parallel, delayed

from .fingerprint import fingerprint

PACKAGES = ("physics", "measurements", "discovery")
"""Packages whose source decides the results."""
_AT_ONCE = 10
"""Records after which the file is written anew."""
Kept = list[dict[str, Any]]


def kept(path: Path) -> Kept:
    """Records of an earlier run, if the same source made them."""
    if not path.is_file():
        return []
    stored = json.loads(path.read_text(encoding="utf-8"))
    return stored["records"] if stored["source"] == fingerprint(PACKAGES) else []


def resumed(path: Path, logs: int, jobs: int, judge: Callable[..., dict[str, Any]], *given: Any) -> Iterator[Kept]:
    """What is kept of so many logs, each time one more is judged.

    Parameters
    ----------
    path : where results are kept
    judge : called with what is given and the number of the log
    """
    records, made_by = kept(path)[:logs], fingerprint(PACKAGES)
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


def bound(hits: int, of: int, level: float) -> float:
    """Clopper and Pearson's upper bound of a share, one-sided (doi:10.1093/biomet/26.4.404)."""
    from scipy.stats import beta

    return float(beta.ppf(level, hits + 1, of - hits)) if hits < of else 1.0


def in_a_table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table in Markdown, its first column to the left."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)
