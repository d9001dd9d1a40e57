"""Neural corrections beside Fossen's model and the symbolic one: every model on the same held-out runs, five seeds.

Networks are trained on 70 % of each training run, in time, and the next 15 % stop the training; the vehicles under
them, and the symbolic one, are fitted to both. All are judged on whole runs that nothing was fitted to. Results are
kept one by one in a folder, so that a study that was stopped goes on where it was; they count only for the source that
made them. The full study takes an hour and writes its tables to `docs/neural_tables.md`.

    python benchmarks/neural.py [--gazebo FOLDER] [--blueboat FOLDER] [--case NAME]... [--seeds 5] [--jobs N]
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed
from study.fingerprint import fingerprint
from zoo.cases import cases
from zoo.contenders import CONTENDERS
from zoo.scored import Study, judge
from zoo.tables import page

from undertow.physics.files import write_text

ROOT = Path(__file__).resolve().parents[1]
TABLES = ROOT / "docs" / "neural_tables.md"
PACKAGES = ("physics", "measurements", "residuals", "discovery", "reports", "benchmarks/zoo")
"""Packages whose source decides the results."""

OPTIONS = ("hybrid LSTM that sees no noise", "hybrid LSTM through rollouts", "hybrid LSTM, varied")
"""Options of the recipe are shown on the first seeds only, so that the study takes an hour and not two."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study, print its tables, and write the page when it is the full one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gazebo", type=Path, help="folder of the Gazebo logs A_1.csv.gz ... and vehicle_linear.yaml")
    parser.add_argument("--blueboat", type=Path, help="folder of field logs log_NNN.csv of a real BlueBoat")
    parser.add_argument("--case", action="append", help="may be repeated; default: all that the folders allow")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=min(4, os.cpu_count() or 1))
    parser.add_argument("--folder", type=Path, default=ROOT / "runs" / "neural", help="where results are kept")
    parser.add_argument("--table", type=Path, help=f"page to write (default: {TABLES.name} for the full study)")
    given = parser.parse_args(arguments)
    known = cases(given.gazebo, given.blueboat)
    chosen = {name: known[name] for name in given.case or known}
    made_by = fingerprint(PACKAGES)
    todo = [
        (name, seed, given.folder / f"{name.replace(' ', '_')}-{seed}.json")
        for seed in range(given.seeds)
        for name in chosen
    ]
    results = Parallel(n_jobs=given.jobs)(
        delayed(judge)(n, chosen[n], seed, target, made_by, Study(CONTENDERS, OPTIONS)) for n, seed, target in todo
    )
    by_case: dict[str, list[dict[str, Any]]] = {name: [] for name in chosen}
    for (name, _, _), records in zip(todo, results, strict=True):
        by_case[name] += records or []
    text = page({name: (chosen[name], records) for name, records in by_case.items()})
    whole = given.gazebo is not None and given.case is None and given.seeds >= 5
    target = given.table or (TABLES if whole else None)
    if target is not None:
        write_text(target, text)
        print(f"wrote {target}")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
