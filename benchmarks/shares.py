"""Where the time of one answer goes: wall time of each step of `discover`, without the page.

    python benchmarks/shares.py LOG.csv [VEHICLE]

`speed.py` puts the shares of a log with four hidden effects into docs/performance.md. The steps are those that the
command line names while it works; what a second processor does beside them is in the step that waits for it.
"""

import json
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

STEPS = {
    "searching the catalogue of effects": "choosing what judges the log, and what it can show",
    "weighing the evidence": "the search",
    "scoring every step on held-out data": "evidence, chance, other forms, the lawful fit, advice",
    "comparing with the calibrated model and baselines, and judging by the laws of a hull": "scoring every step",
    "writing the run folder": "the audit, and what is left of calibration and baselines beside the search",
}
"""The line that ends each step, and what is told of it."""


def measured(log: str, vehicle: str) -> dict[str, float]:
    """Seconds of each step of one answer, imports first, in a process that has loaded nothing yet."""
    told: dict[str, float] = {}
    last = time.perf_counter()

    def ends(step: str) -> None:
        nonlocal last
        now = time.perf_counter()
        told[step], last = told.get(step, 0.0) + now - last, now

    from undertow.workflows.discover_and_add import discover
    from undertow.workflows.inputs import read_inputs
    from undertow.workflows.run_folder.write import write_run

    ends("loading modules")
    inputs = read_inputs(log, vehicle)
    ends("reading and inspecting the log")

    def line(text: str) -> None:
        if text in STEPS:
            ends(STEPS[text])

    run = discover(inputs, progress=line)
    with TemporaryDirectory() as folder:
        write_run(run, Path(folder) / "run", report=False, progress=line)
        ends("writing the run folder")
    return told


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "blueboat")))
