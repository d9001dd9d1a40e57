"""The paper that this project began with, repeated: preparation, models, metrics, figures, hypotheses, ablations.

It compared Fossen's model alone, a pure network, and a perceptron beside Fossen's model, one step ahead, and announced
networks with memory. The paper itself is not part of the project; what is repeated is what the project's design says
of it, and the page tells where our own choice stands in. Each model is trained on a Gazebo run, or on field logs of a
real BlueBoat, in the order of time (70/15/15 %, 10 Hz, 1.2 Hz), and judged on the end of its own runs, as the paper
judged, and on whole runs that it never saw. Networks are trained by a short recipe, and count whole: what
`train` makes of them is judged by `benchmarks/trust.py` and `benchmarks/rivals.py`.

    python benchmarks/paper.py --gazebo FOLDER [--blueboat FOLDER] [--out paper] [--seeds 5] [--jobs 2] [--case NAME]...
        [--table docs/paper.md]

writes `paper.html` and, for every table, a CSV file into --out, in under half an hour on two processors. Results are
kept one by one in --out; the same command goes on where it was stopped.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed
from study.paper_page import csv_files, document_of, markdown_of
from study.records import fingerprint
from zoo.cases import cases
from zoo.scored import judge

from undertow.physics.files import write_text

PACKAGES = ("physics", "measurements", "residuals", "discovery", "benchmarks/zoo")
"""Source that decides the results."""
CASES = ("gazebo A", "gazebo B", "gazebo C", "gazebo D", "blueboat")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and write its page and tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gazebo", type=Path, help="folder of the Gazebo logs A_1.csv.gz ... and vehicle_linear.yaml")
    parser.add_argument("--blueboat", type=Path, help="folder of field logs log_NNN.csv of a real BlueBoat")
    parser.add_argument("--case", action="append", choices=CASES, help="may be repeated; default: all")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("paper"), help="folder of the page, the tables and results")
    parser.add_argument("--table", type=Path, help="page to write, in Markdown")
    given = parser.parse_args(arguments)
    known = cases(given.gazebo, given.blueboat)
    chosen = {name: known[name] for name in given.case or CASES if name in known}
    if not chosen:
        parser.error("expected logs, got none of --gazebo and --blueboat; give the folder of one")
    made_by, begun = fingerprint(PACKAGES), time.perf_counter()
    todo = [(name, seed) for seed in range(given.seeds) for name in chosen]
    done = Parallel(n_jobs=given.jobs, return_as="generator")(
        delayed(judge)(chosen[name], seed, given.out / "results" / f"{name.replace(' ', '_')}-{seed}.json", made_by)
        for name, seed in todo
    )
    records: dict[str, list[dict[str, Any]]] = {name: [] for name in chosen}
    for k, ((name, seed), found) in enumerate(zip(todo, done, strict=True)):
        records[name] += found or []
        minutes = (time.perf_counter() - begun) / 60.0
        print(f"{k + 1} of {len(todo)} done ({name}, seed {seed}), {minutes:.1f} min", flush=True)
    results = {name: (chosen[name], records[name]) for name in chosen}
    for name, text in csv_files(results).items():
        write_text(given.out / name, text)
    write_text(given.out / "paper.html", document_of(results, given.seeds, (time.perf_counter() - begun) / 60.0))
    if given.table is not None:
        write_text(given.table, markdown_of(results, given.seeds))
    print(f"wrote {given.out / 'paper.html'} and its tables")
    return 0


if __name__ == "__main__":
    sys.exit(main())
