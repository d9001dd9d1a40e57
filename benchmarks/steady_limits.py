"""What the numbers of the checks of single records decide: false alarms and misses with each at half and at twice.

Stuck and spiked values are found by rules on single rows, and a few numbers say what an answer to the commands is. Each
is well placed where half of it and twice as much accuse no more sound logs and miss no more spoilt ones.

    python benchmarks/steady_limits.py [--runs 18] [--seeds 3] [--only NAME]...
"""

import argparse
import sys
from collections.abc import Sequence
from types import ModuleType

import numpy as np
from spoiling import simulated
from study.sound_worlds import drawn, recorded
from study.spoils import SPOILS

from undertow.measurements.log import Log
from undertow.measurements.quality import lags, response
from undertow.measurements.quality.checks import clocks, spikes, stuck
from undertow.measurements.quality.checks.clocks import CLOCKS
from undertow.measurements.quality.checks.sides import SIDES
from undertow.measurements.quality.checks.spikes import SPIKES
from undertow.measurements.quality.checks.stuck import STUCK
from undertow.measurements.quality.record import Check, Record
from undertow.physics.vehicle import Vehicle

FIRST = 260_000
_ANSWERS: tuple[Check, ...] = (SIDES, CLOCKS)
NUMBERS: tuple[tuple[str, tuple[ModuleType, ...], tuple[Check, ...]], ...] = (
    *(
        (n, (stuck,), (STUCK,))
        for n in ("_PLAINLY", "_MEANWHILE", "_SETTLED", "_LEAST", "_BEFORE", "_BEFORE_SECONDS", "_TURNS", "_RUNS")
    ),
    *((n, (spikes,), (SPIKES,)) for n in ("_LEAST_ROWS", "_OUT", "_STEPS", "_WHOLE")),
    *((n, (response,), _ANSWERS) for n in ("_SHARE", "_ALONE", "_LATE")),
    ("_PITCHING", (clocks,), (CLOCKS,)),
    ("FOLLOWS", (lags, response, clocks), (CLOCKS,)),
)
"""Each number, the modules that hold it, and the checks that it decides."""
Known = tuple[Log, Vehicle]


def accused(checks: Sequence[Check], log: Log, vehicle: Vehicle) -> bool:
    """Whether a check calls a defect or a warning in a log."""
    rows = all(check in (STUCK, SPIKES) for check in checks)
    records = [Record(log, (), ()) if rows else Record.of(log, vehicle)]
    return any(f.verdict in ("defect", "warning") for check in checks for f in check.examine(records))


def spoilt(checks: Sequence[Check], seeds: int) -> list[Known]:
    """Logs that the checks must accuse."""
    found: list[Known] = []
    names = {check.name for check in checks} | {"direction" for check in checks if check is SIDES}
    for case in [case for seed in range(seeds) for case in simulated(200 + seed, 180.0)]:
        for spoil in SPOILS:
            if any(name in names for name, _ in spoil.causes):
                table = spoil.plant(case.table, np.random.default_rng(len(spoil.name)))
                channels = {name: table[name].to_numpy(float) for name in table.columns if name != "t"}
                found.append((Log.from_arrays(table["t"].to_numpy(float), channels), case.vehicle))
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit code 1 where a number as it stands accuses a sound log or misses a spoilt one."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--runs", type=int, default=18)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", action="append", default=[], metavar="NAME")
    given = parser.parse_args(arguments)
    runs = [drawn(FIRST, n) for n in range(given.runs)]
    sound = [(log, run.vehicle) for n, run in enumerate(runs) for log in recorded(run.log, n).values()]
    broken = {checks: spoilt(checks, given.seeds) for checks in {checks for _, _, checks in NUMBERS}}
    print("| number | as it is | half | twice |\n| --- | ---: | ---: | ---: |")
    wrong = 0
    for name, modules, checks in NUMBERS:
        if given.only and name not in given.only:
            continue
        cells, value = [], getattr(modules[0], name)
        for factor in (1.0, 0.5, 2.0):
            for module in modules:
                setattr(module, name, type(value)(factor * value))
            false = sum(accused(checks, *known) for known in sound)
            missed = sum(not accused(checks, *known) for known in broken[checks])
            wrong += missed * (factor == 1.0)
            cells.append(f"{false} of {len(sound)} false, {missed} of {len(broken[checks])} missed")
        for module in modules:
            setattr(module, name, value)
        print(f"| {' and '.join(c.name for c in checks)}: {name} = {value:g} | {' | '.join(cells)} |", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
