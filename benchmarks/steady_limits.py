"""What the numbers of the checks of single records decide: false alarms and misses with each at half and at twice.

Stuck and spiked values are found by rules on single rows. A number of such a rule is well placed where half of it and
twice as much accuse no more sound logs and miss no more spoilt ones.

    python benchmarks/steady_limits.py [--runs 18] [--seeds 3]
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from spoiling import simulated
from study.sound_worlds import drawn, recorded
from study.spoils import SPOILS

from undertow.measurements.log import Log
from undertow.measurements.quality.checks import spikes, stuck
from undertow.measurements.quality.checks.spikes import Spikes
from undertow.measurements.quality.checks.stuck import Stuck
from undertow.measurements.quality.finding import Check
from undertow.measurements.quality.record import Record

FIRST = 260_000
ROOMS: tuple[tuple[ModuleType, Check], ...] = ((stuck, Stuck()), (spikes, Spikes()))


def numbers(module: ModuleType) -> Iterator[tuple[str, Any]]:
    """The constants of a module that are numbers, each by its name."""
    for name, value in vars(module).items():
        if name.startswith("_") and name.isupper() and isinstance(value, int | float):
            yield name, value


def accused(check: Check, log: Log) -> bool:
    """Whether a check calls a defect or a warning in a log."""
    return any(f.verdict in ("defect", "warning") for f in check.examine([Record(log, (), ())]))


def spoilt(check: Check, seeds: int) -> list[Log]:
    """Logs that a check must accuse."""
    found = []
    for case in [case for seed in range(seeds) for case in simulated(200 + seed, 180.0)]:
        for spoil in SPOILS:
            if any(name == check.name for name, _ in spoil.causes):
                table = spoil.plant(case.table, np.random.default_rng(len(spoil.name)))
                channels = {name: table[name].to_numpy(float) for name in table.columns if name != "t"}
                found.append(Log.from_arrays(table["t"].to_numpy(float), channels))
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit code 1 where a number as it stands accuses a sound log or misses a spoilt one."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--runs", type=int, default=18)
    parser.add_argument("--seeds", type=int, default=3)
    given = parser.parse_args(arguments)
    sound = [log for n in range(given.runs) for log in recorded(drawn(FIRST, n).log, n).values()]
    print("| number | as it is | half | twice |\n| --- | ---: | ---: | ---: |")
    wrong = 0
    for module, check in ROOMS:
        broken = spoilt(check, given.seeds)
        for name, value in numbers(module):
            cells = []
            for factor in (1.0, 0.5, 2.0):
                setattr(module, name, type(value)(factor * value))
                false = sum(accused(check, log) for log in sound)
                missed = sum(not accused(check, log) for log in broken)
                wrong += (false + missed) * (factor == 1.0)
                cells.append(f"{false} of {len(sound)} false, {missed} of {len(broken)} missed")
            setattr(module, name, value)
            print(f"| {check.name}: {name} = {value:g} | {' | '.join(cells)} |", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
