"""How often discovery names exactly what is missing: a study over random hulls, effects, noise, programmes and waves.

Each log is five minutes of a random sister of a shipped vehicle with random hidden effects of random size. Discovery
sees the first 85 %, as in a report; the rest measures open-loop rollouts. Results are kept part by part in a folder, so
that a study which was stopped goes on where it was; they count only for the source that made them. The full study on
reporting seeds writes its table to `docs/hidden_effects.md`.

    python benchmarks/hidden_effects.py [--seeds tuning|reporting] [--size small|full] [--part NAME]... [--jobs N]
"""

import argparse
import os
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from study.figures import exact, table
from study.judging import judge
from study.resumed import Kept, kept, resumed
from study.worlds import PARTS, SEEDS

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "docs" / "hidden_effects.md"


def run_part(part: str, seeds: str, logs: int, folder: Path, jobs: int) -> Kept:
    """Run what is not yet kept of a part; results are written every few logs."""
    start, block = SEEDS[seeds]
    runs = resumed(folder / f"{part}.json", logs, jobs, judge, part, start + block * list(PARTS).index(part))
    records = next(runs)
    for records in runs:
        record = records[-1]
        said = "exact" if exact(record) else f"named {', '.join(record['missing'] + record['unnamed']) or 'nothing'}"
        hidden = ", ".join(record["hidden"]) or "nothing"
        print(f"{part} {len(records)}/{logs}, seed {record['seed']}: {hidden}: {said}", flush=True)
    return records


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study, print its table, and write the page when it is the full one on reporting seeds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", choices=SEEDS, default="reporting")
    parser.add_argument("--size", choices=("small", "full"), default="full")
    parser.add_argument("--part", choices=PARTS, action="append", help="may be repeated; default: all")
    parser.add_argument("--logs", type=int, default=1_000, help="at most so many logs a part")
    parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
    parser.add_argument("--jobs", type=int, default=min(4, os.cpu_count() or 1))
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / "hidden_effects", help="where results are kept")
    parser.add_argument("--table", type=Path, help=f"page to write (default: {TABLE.name} for the full study)")
    given = parser.parse_args(arguments)
    folder = given.folder / f"{given.seeds}-{given.size}"
    results = {}
    for part in given.part or PARTS:
        logs = min(given.logs, getattr(PARTS[part], given.size))
        stored = kept(folder / f"{part}.json") if given.tell else []
        records = stored if given.tell else run_part(part, given.seeds, logs, folder, given.jobs)
        if records:
            results[part] = records
    page = table(results, given.seeds)
    whole = given.seeds == "reporting" and all(len(results.get(part, ())) >= PARTS[part].full for part in PARTS)
    target = given.table or (TABLE if whole else None)
    if target is not None:
        target.write_text(page, encoding="utf-8")
        print(f"wrote {target}")
    print(page)
    said = Counter(s for records in results.values() for r in records for s in r["standing"].values())
    print("hidden effects were said to be:", ", ".join(f"{word} {count}" for word, count in said.most_common()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
