"""How often `discover` is right: any study, from log files on, as a user runs it.

    python benchmarks/through_the_verb.py STUDY... [--seeds tuning|reporting] [--logs N] [--kind NAME]... [--jobs N]
        [--tell] [--stale] [--odds FILE] [--pages]
    python benchmarks/through_the_verb.py STUDY --one KIND SEED [--into FOLDER]

Studies: plain (effects of the catalogue, or none), nothing (nothing hidden), short (pieces of logs), seas (effects in
waves or beside noise that lasts), worn (a file that is a little off everywhere), turning (hulls that turn by
themselves), several (logs of one boat), foreign (another simulator, other sensors and records), nameless (causes that
the catalogue does not hold), sensors (one that errs), field (real and other people's logs), others (other people's
simulators). Records are kept in `benchmarks/records`, so that a study which was stopped goes on where it was. They hold
the facts of each answer: `--tell` scores them by the judgement as it is now, and runs nothing. Records that other
sources made are carried over where these give a sample of the logs (twenty, or one in twenty) the same facts, and made
anew one by one where not; or told with `--stale`. With `--pages` the pages of `docs` are written on which these studies
are told.
The second form tells of one log alone.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from study.records import ROOT, File, Kept, Record, opened, processors
from study.scoring import ODDS, Odds, false_names, outcome, read_odds
from study.studies import FOLDER, STUDIES, Key, key_of, run, stored, told, with_bounds
from study.tables import PAGES, must_hold, page
from study.verb import answer

PURPOSES = ("tuning", "reporting")


def line(record: Record) -> str:
    """What came of a log."""
    said = {word: record[word] for word in ("missing", "likely", "unnamed", "sensors") if record.get(word)}
    why = record.get("told", "")
    hidden = ", ".join(record["true"]) or record["note"]
    seconds = record.get("seconds", "")
    return f"{record['kind']} {record['seed']} ({hidden}): {outcome(record)} {said or ''} {why} {seconds}"


def summary(records: Kept) -> str:
    """Outcomes of the logs of a study, and its false names."""
    words = [outcome(record) for record in records]
    counts = ", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words))
    false = [f"  {key_of(r)} {r['note']}: {', '.join(false_names(r, 'missing', 'likely'))}" for r in records]
    return "\n".join([f"{len(records)} logs: {counts}", *(text for text in false if not text.endswith(": "))])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run studies, or tell of what is kept; exit code 2 where records were made by other sources."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", nargs="+", choices=STUDIES)
    parser.add_argument("--seeds", choices=PURPOSES, default="tuning")
    parser.add_argument("--logs", type=int, default=100_000, help="at most so many of each study")
    parser.add_argument("--kind", action="append", help="logs of this kind alone; may be repeated")
    parser.add_argument("--jobs", type=int, default=processors())
    parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
    parser.add_argument("--stale", action="store_true", help="tell of what other sources made, too")
    parser.add_argument("--pages", type=Path, nargs="?", const=ROOT / "docs", help="where pages are written (docs)")
    parser.add_argument("--odds", type=Path, default=ODDS, help="the judgement, where it is another")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where records are kept")
    parser.add_argument("--one", nargs=2, metavar=("KIND", "SEED"), help="tell of one log alone")
    parser.add_argument("--into", type=Path, help="where to leave its log and its vehicle file")
    given = parser.parse_args(arguments)
    if given.one:
        return one(given.study[0], (given.one[0], int(given.one[1])), given.into)
    odds, code = read_odds(given.odds), 0
    records: dict[str, Kept] = {}
    for study in given.study:
        keys = [key for key in STUDIES[study].keys(given.seeds) if not given.kind or key[0] in given.kind][: given.logs]
        file = stored(study, given.seeds, given.folder)
        if STUDIES[study].absent():
            print(f"{study}: {STUDIES[study].absent()}", flush=True)
        if not given.tell:
            file = asked(study, file, keys, given.jobs, odds)
        by_others = sum(key_of(record) in keys for record in file.older)
        if by_others:
            print(f"STALE: other sources than these made {by_others} of {file.path}", file=sys.stderr)
        if by_others and not given.stale:
            code = 2
            continue
        records[study] = told(file, keys, odds)
        print(f"{study}, {given.seeds}: {summary(records[study])}", flush=True)
    for name in (name for name, this in PAGES.items() if any(map(records.get, this.studies))):
        print(f"\n{name}\n{must_hold(PAGES[name].rows, records)}")
        if given.pages is not None:
            command = f"python benchmarks/through_the_verb.py {' '.join(records)} --seeds {given.seeds} --pages"
            (given.pages / f"{name}.md").write_text(page(name, records, command), encoding="utf-8")
    return code


def asked(study: str, file: File, keys: Sequence[Key], jobs: int, odds: Odds) -> File:
    """Ask the verb about what is not kept, say what comes of it, and give what is kept then."""
    for some in run(study, file, keys, jobs):
        if some:
            print(f"{study} {len(some)}/{len(keys)}: {line(some[-1])}", flush=True)
    done = opened(file.path)
    with_bounds(study, done, told(done, keys, odds), jobs)
    return opened(file.path)


def one(study: str, key: Key, into: Path | None) -> int:
    """Tell of one log; leave it with its vehicle file in a folder where one is given."""
    logged = STUDIES[study].logged(*key)
    if into is not None:
        into.mkdir(parents=True, exist_ok=True)
        logged.vehicle.save(into / "vehicle.yaml")
        print(f"wrote {logged.write(into / 'log.csv')}")
    record = answer(logged)
    for name, value in record.items():
        print(f"{name}: {value}")
    print(outcome(record))
    return int(bool(false_names(record)))


if __name__ == "__main__":
    sys.exit(main())
