"""Records of studies: kept as they come, so that a study which was stopped goes on where it was.

A file has a line for each record, compressed, and a first line that says which sources made the facts; a record that
others made says so itself, and stays until it is made anew. A judgement of these facts is no fact: it is scored again
(`study/scoring.py`), and no record grows stale when it changes.
"""

import argparse
import ast
import gzip
import hashlib
import json
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from operator import itemgetter
from pathlib import Path
from typing import Any, cast

import numpy as np
from joblib import Parallel, delayed, parallel_config

ROOT = Path(__file__).resolve().parents[2]
FACTS = (
    *("physics", "measurements", "discovery", "comparison", "workflows"),
    *("residuals/models", "residuals/scores.py", "residuals/series.py"),
)
"""Folders and files that make the facts of a log; what trains networks makes none, for no study of names asks one."""
JUDGEMENT = ("discovery/judgement.py", "discovery/odds.", "discovery/verdicts.py")
"""Beginnings of the files that judge them."""
_DIGITS = 5
"""Significant digits of what is kept: more than any figure has, and a third of the bytes."""
_AT_ONCE = 10
"""Records after which the file is written anew."""
Record = dict[str, Any]
Kept = list[Record]


@dataclass(frozen=True, slots=True)
class File:
    """Records on disk.

    Attributes
    ----------
    source : fingerprint of the sources as they are now
    records : what these made
    older : what other sources made, each with their fingerprint as "source"
    """

    path: Path
    source: str
    records: Kept
    older: Kept

    @property
    def stale(self) -> bool:
        """Whether other sources made some of the records."""
        return bool(self.older)

    def save(self, records: Sequence[Record], older: Sequence[Record] = ()) -> None:
        """Write these in the place of what is kept: what the sources as they are now made, and what others did."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        draft = self.path.with_suffix(".part")
        content = ({"source": self.source}, *records, *older)
        lines = (json.dumps(line, allow_nan=False, separators=(",", ":")) for line in content)
        draft.write_bytes(gzip.compress("".join(f"{line}\n" for line in lines).encode(), mtime=0))
        draft.replace(self.path)


def opened(path: Path, packages: Sequence[str] = FACTS) -> File:
    """The records of a file: those that the sources of some folders made as they are now, and others."""
    source = fingerprint(tuple(packages))
    if not path.is_file():
        return File(path, source, [], [])
    head, *records = map(json.loads, gzip.decompress(path.read_bytes()).decode().splitlines())
    made = [head | record for record in records]  # a record's own source comes before that of the file
    by_others = [record for record in made if record["source"] != source]
    return File(path, source, [without_source(one) for one in made if one["source"] == source], by_others)


def without_source(record: Record) -> Record:
    """What a record holds beside who made it."""
    return {name: value for name, value in record.items() if name != "source"}


def resumed(
    file: File, keys: Iterable[Any], judge: Callable[[Any], Record], jobs: int, key: Callable[[Record], Any]
) -> Iterator[Kept]:
    """What is kept of some keys, each time one more is judged, the newest last; of other keys it stays in the file.

    Parameters
    ----------
    judge : makes the record of a key; it is called in other processes
    key : gives the key of a record
    """
    kept = {key(record): record for record in file.records if record.get("verdict") != CRASHED}
    keys = list(keys)
    found = [kept[one] for one in keys if one in kept]
    yield found
    todo = [one for one in keys if one not in kept]
    with parallel_config("loky", n_jobs=jobs, inner_max_num_threads=1):
        judged = cast("Iterator[Record]", Parallel(return_as="generator")(delayed(judge)(one) for one in todo))
        for count, (one, record) in enumerate(zip(todo, judged, strict=True), start=1):
            kept[one] = rounded(record)
            found.append(kept[one])
            if count % _AT_ONCE == 0 or count == len(todo):
                file.save(list(kept.values()), [record for record in file.older if key(record) not in kept])
            yield found


CRASHED = "crashed"
"""The verdict of a log on which the verb fell over: it is asked again when the study goes on."""


def rounded(content: Any) -> Any:
    """Plain data with significant digits enough; numbers that JSON does not know are nothing."""
    if isinstance(content, Mapping):
        return {str(key): rounded(value) for key, value in content.items()}
    if isinstance(content, list | tuple | np.ndarray):
        return [rounded(value) for value in content]
    if isinstance(content, bool | np.bool_):
        return bool(content)
    if isinstance(content, float | np.floating):
        return float(f"{content:.{_DIGITS}g}") if math.isfinite(content) else None
    return content


@cache
def fingerprint(packages: tuple[str, ...] = FACTS) -> str:
    """A hash of the sources that decide the results: modules, effects and vehicle files in folders, and single ones.

    Comments, docstrings and empty lines decide nothing, and what judges the facts makes none of them.
    """
    digest = hashlib.sha256()
    roots = [ROOT / package for package in packages]
    for path in sorted(path for root in roots for path in (root, *root.rglob("*"))):
        judges = path.relative_to(ROOT).as_posix().startswith(JUDGEMENT)
        if not judges and path.suffix in (".py", ".yaml", ".toml") and path.is_file():
            digest.update(bare(path.read_text("utf-8")) if path.suffix == ".py" else path.read_bytes())
    return digest.hexdigest()[:16]


def bare(source: str) -> bytes:
    """A module without comments of their own line, docstrings and empty lines."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        text = node.value if isinstance(node, ast.Expr) else None
        if isinstance(text, ast.Constant) and isinstance(text.value, str):
            lines[text.lineno - 1 : text.end_lineno] = [""] * ((text.end_lineno or text.lineno) - text.lineno + 1)
    return "\n".join(line for line in lines if line.strip() and not line.lstrip().startswith("#")).encode()


def processors() -> int:
    """How many logs are asked about at once, where nobody says it."""
    return min(4, os.cpu_count() or 1)


@dataclass(frozen=True, slots=True)
class Script:
    """A study that is a script of its own, and does not ask the verb: random logs, one record each.

    Attributes
    ----------
    name : of the script and of the folder in `runs` where results are kept
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
    judge: Callable[[int, int], Record]
    line: Callable[[Kept], str]
    page: Callable[[Kept, str], str]
    packages: tuple[str, ...]

    def numbered(self, first: int, number: int) -> Record:
        """The record of a log, with its number."""
        return {**self.judge(first, number), "number": number}

    def carried_out(self, described: str | None, arguments: Sequence[str] | None = None) -> Kept:
        """Run the study as the command line asks, print its page, and give its records."""
        parser = argparse.ArgumentParser(description=described, formatter_class=argparse.RawDescriptionHelpFormatter)
        parser.add_argument("--logs", type=int, default=self.logs)
        parser.add_argument("--seeds", choices=self.first, default="reporting")
        parser.add_argument("--jobs", type=int, default=processors())
        parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
        parser.add_argument("--folder", type=Path, default=ROOT / "runs" / self.name, help="where results are kept")
        parser.add_argument("--table", type=Path, help="page to write")
        given = parser.parse_args(arguments)
        file = opened(given.folder / f"{given.seeds}.jsonl.gz", self.packages)
        records = [record for record in file.records if record["number"] < given.logs]
        if not given.tell:
            judge = partial(self.numbered, self.first[given.seeds])
            for records in resumed(file, range(given.logs), judge, given.jobs, itemgetter("number")):
                line = self.line(records) if records else ""
                if line:
                    print(f"{len(records)}/{given.logs}: {line}", flush=True)
        text = self.page(records, f"python benchmarks/{self.name}.py --logs {len(records)} --seeds {given.seeds}")
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
