"""Every hybrid of the literature and its rivals beside undertow's models, fitted to one run and judged on another.

Rivals are fitted to a whole Gazebo run, or to the log of a simulated hull that lacks an effect with a name or without
one; settings and epochs are chosen by its last 15 %. All are judged alike, one step ahead and in rollouts of 2 s and
10 s, on another whole run. Results are kept one by one in a folder, so that a study that was stopped goes on where it
was; they count only for the source that made them. A seed of a case takes about four minutes. Seeds from 100 are for
tuning.

    python benchmarks/rivals.py [--gazebo FOLDER] [--case NAME]... [--seeds 5] [--first 0] [--only NAME]...
        [--tell] [--table docs/rivals.md] [--csv rivals.csv]
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from study.rivals.cases import cases
from study.rivals.contenders import CONTENDERS
from study.rivals.judged import Record, judge, kept, wanted
from study.rivals_page import as_csv, page

from undertow.physics.files import write_text

ROOT = Path(__file__).resolve().parents[1]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study, and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gazebo", type=Path, help="folder of the Gazebo logs A_1.csv.gz ... and vehicle_linear.yaml")
    parser.add_argument("--case", action="append", help="may be repeated; default: all that the folder allows")
    parser.add_argument("--only", action="append", choices=CONTENDERS, help="a model; may be repeated; default: all")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0, help="first seed; from 100 on for tuning")
    parser.add_argument("--tell", action="store_true", help="run nothing, only tell what is kept")
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / "rivals", help="where results are kept")
    parser.add_argument("--table", type=Path, help="page to write, in Markdown")
    parser.add_argument("--csv", type=Path, help="file to write: a line for each model, case, seed and error")
    given = parser.parse_args(arguments)
    known = cases(given.gazebo)
    chosen = {name: known[name] for name in given.case or known}
    records: dict[str, list[Record]] = {name: [] for name in chosen}
    for seed in range(given.first, given.first + given.seeds):
        for name, case in chosen.items():
            target = given.folder / f"{name.replace(' ', '_')}-{seed}.json"
            names = [n for n in wanted(case, seed, given.first) if n in (given.only or CONTENDERS)]
            records[name] += list(kept(target).values()) if given.tell else judge(case, seed, target, names)
    text = page({name: (case, records[name]) for name, case in chosen.items() if records[name]})
    if given.table is not None:
        write_text(given.table, text)
    if given.csv is not None:
        write_text(given.csv, as_csv(records))
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
