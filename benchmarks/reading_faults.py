"""Spoil sound logs as people's logs are, and count what is told, what is read right, and what passes in silence.

python benchmarks/reading_faults.py [--seeds 1] [--kind WORDS] [--file FILE] [--table]

Each kind spoils a log of one world in each of six formats that can have the fault. `inspect` then looks at it for its
vehicle. It is read right where the channels are those of the world and nothing is accused that is not in the unspoilt
log; told where the refusal, a finding or a note names the cause; silent where the channels are wrong and nothing is
said; a false accusation where another cause is told. Answers are kept in a file as they come, and a study that was
stopped goes on. With --table, docs/what_it_reads.md gets the counts. Exit code 1 for silence or a traceback.
"""

import argparse
import json
import re
import sys
import tempfile
import traceback
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import replace
from enum import Enum
from pathlib import Path

import numpy as np
from marked_section import write_section
from study.reading_faults import frames_and_values, tables_and_times
from study.reading_faults.kind import Bullet, Kind, Sound, Spoilt
from study.reading_faults.sound import NotInFormatError, read_right, sounds

from undertow.measurements.inspection import Inspection
from undertow.measurements.log import Log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError, RequestError
from undertow.workflows.inspect_and_init import look_over

KINDS = (*frames_and_values.KINDS, *tables_and_times.KINDS)
PAGE = Path(__file__).resolve().parents[1] / "docs" / "what_it_reads.md"
_COMMAND = "python benchmarks/reading_faults.py --table"
_HEAD = """## What becomes of a spoilt log
A sound log in six formats (wide and long CSV, Parquet, MCAP, DataFlash, ULog) was spoilt as people's logs are, in every
way that its format can have. Told: a refusal, a check or a note names the cause. Silent: misread without a word."""
ACCUSING = ("defect", "warning")


class Answer(Enum):
    """What became of a spoilt log."""

    RIGHT = "read right"
    TOLD = "told"
    OTHER = "another cause told"
    SILENT = "silent"
    ACCUSED = "sound, yet accused"
    TRACEBACK = "traceback"


GOOD = (Answer.RIGHT, Answer.TOLD)


def accusations(found: Inspection) -> set[str]:
    """What accuses a log: checks with a defect or a warning, and what keeps it from being used."""
    return {finding.check for finding in found.quality if finding.verdict in ACCUSING} | {
        "missing" for _ in found.plan.missing
    }


def words(found: Inspection, log: Log) -> str:
    """All that is told of a log."""
    told = [text for f in found.quality if f.verdict != "ok" for text in (f.sentence, f.consequence, f.remedy)]
    return "\n".join([found.verdict, *told, *found.plan.missing, *log.notes])


def judged(kind: Kind, sound: Sound, usual: set[str], spoilt: Spoilt) -> tuple[Answer, str]:
    """What becomes of a spoilt log, and what was told of it."""
    reading = replace(Reading(), channel_map=spoilt.channel_map)
    cause = re.compile(kind.expect, re.IGNORECASE)
    try:
        found, log = look_over([spoilt.log], sound.vehicle, reading, progress=None)
    except (LogError, RequestError) as error:
        return (Answer.TOLD if cause.search(error.typed) else Answer.OTHER), error.typed
    except Exception:
        return Answer.TRACEBACK, traceback.format_exc()[-800:]
    assert isinstance(found, Inspection)
    told, accused = words(found, log), accusations(found) - usual
    right = read_right(log, sound)
    if right and not accused:
        return Answer.RIGHT, ""
    if cause.search(told):
        return Answer.TOLD, told
    if right:
        return Answer.ACCUSED, f"{sorted(accused)}: {told}"
    return (Answer.OTHER if accused else Answer.SILENT), told


def answers(kinds: Iterable[Kind], seeds: int, file: Path) -> list[dict[str, str]]:
    """The answers of all cases, of those that are kept and of the rest."""
    kept = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    done = {(row["kind"], row["format"], row["seed"]) for row in kept}
    wanted = list(kinds)
    for seed in range(seeds):
        for sound in sounds(seed):
            cases = [kind for kind in wanted if (kind.name, sound.name, str(seed)) not in done]
            if not cases:
                continue
            with tempfile.TemporaryDirectory() as name:
                whole = sound.written(Path(name))
                found, log = look_over([whole.log], sound.vehicle, progress=None)
                assert isinstance(found, Inspection)
                usual = accusations(found)
                if not read_right(log, sound):
                    raise SystemExit(f"{sound.name}: the unspoilt log is not read right")
            for k, kind in enumerate(cases):
                row = _case(kind, sound, usual, seed, k)
                kept.append(row)
                with file.open("a") as lines:
                    lines.write(json.dumps(row) + "\n")
                print(f"{sound.name:>10} {row['answer']:<20} {kind.name}", flush=True)
    names = {kind.name for kind in wanted}
    return [row for row in kept if row["kind"] in names and row["answer"] != "not in this format"]


def _case(kind: Kind, sound: Sound, usual: set[str], seed: int, k: int) -> dict[str, str]:
    row = {"kind": kind.name, "format": sound.name, "seed": str(seed)}
    with tempfile.TemporaryDirectory() as name:
        try:
            spoilt = kind.spoil(sound, Path(name), np.random.default_rng([seed, k]))
        except NotInFormatError:
            spoilt = None
        if spoilt is None:
            return {**row, "answer": "not in this format", "told": ""}
        answer, told = judged(kind, sound, usual, spoilt)
        return {**row, "answer": answer.value, "told": told.replace(name, "")[:1500]}


def report(rows: list[dict[str, str]]) -> str:
    """A table of all bullets, and the kinds that are not good in every format."""
    by_kind: dict[str, Counter[str]] = defaultdict(Counter)
    for row in rows:
        by_kind[row["kind"]][row["answer"]] += 1
    good = {answer.value for answer in GOOD}
    lines = [
        "| kinds of faults | kinds | logs | read right | told | another cause | silent | accused | tracebacks |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for bullet in Bullet:
        names = [kind.name for kind in KINDS if kind.bullet is bullet and kind.name in by_kind]
        total = sum((by_kind[name] for name in names), Counter())
        if names:
            counts = [total[answer.value] for answer in Answer if answer is not Answer.OTHER]
            cells = [len(names), total.total(), *counts[:2], total[Answer.OTHER.value], *counts[2:]]
            lines.append(f"| {bullet.value} | {' | '.join(map(str, cells))} |")
    whole = [name for name, found in by_kind.items() if set(found) <= good]
    lines += ["", f"{len(whole)} of {len(by_kind)} kinds are told with the right cause or read right in every format."]
    lines += [
        f"- {name}: {', '.join(f'{count} {answer}' for answer, count in found.items())}"
        for name, found in by_kind.items()
        if not set(found) <= good
    ]
    return "\n".join(lines)


def main() -> int:
    """Print the report."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--kind", default="", help="only kinds whose names hold these words")
    parser.add_argument("--file", type=Path, default=Path("reading_faults.jsonl"))
    parser.add_argument("--table", action="store_true")
    chosen = parser.parse_args()
    rows = answers([kind for kind in KINDS if chosen.kind in kind.name], chosen.seeds, chosen.file)
    text = report(rows)
    print(f"\n{text}")
    if chosen.table:
        write_section(PAGE, "reading faults", f"{_HEAD}\n\n{text}\n\nWritten by `{_COMMAND}`.")
    bad = {Answer.SILENT.value, Answer.TRACEBACK.value}
    return 1 if any(row["answer"] in bad for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
