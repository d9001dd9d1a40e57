"""How time and memory of a fleet grow by logs and by boats; each size in a process of its own."""

import json
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from measured import Figures
from study.fleets import simulated as estimates_of

from undertow.fleet.build_fleet import build_fleet
from undertow.fleet.diary import diary_of
from undertow.fleet.parameter_estimates import read_fleet
from undertow.fleet.workers import Engine
from undertow.reports.page.page import diary_page

DAYS = 180
"""Days of the boats of a diary: half a year."""


def largest_memory() -> float:
    """Of this process so far [MB]; on Linux without that of its parent, which getrusage begins with."""
    status = Path("/proc/self/status")
    if status.exists():
        (peak,) = (line.split()[1] for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return float(peak) / 1024.0
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0**2


def in_a_child(script: str, *words: str) -> dict[str, float]:
    """What a run of a script in a process of its own prints, as JSON."""
    run = subprocess.run([sys.executable, script, *words], check=True, capture_output=True, text=True)
    told: dict[str, float] = json.loads(run.stdout)
    return told


def of_logs(folder: str) -> dict[str, float]:
    """Time to make a fleet of a folder of logs with this process alone, and to say what they say."""
    with TemporaryDirectory() as out:
        begun = time.perf_counter()
        build_fleet(folder, "blueboat", Path(out, "fleet"), engine=Engine(1), progress=None)
        built = time.perf_counter()
        read_fleet(Path(out, "fleet"))
        return {"build": built - begun, "read": time.perf_counter() - built, "memory": largest_memory()}


def of_boats(count: int) -> dict[str, float]:
    """Time of the diary of that many boats over half a year, its page included."""
    fleet, *_ = estimates_of(count, DAYS, np.random.default_rng(count))
    begun = time.perf_counter()
    diary_page(diary_of(fleet))
    return {"seconds": time.perf_counter() - begun, "memory": largest_memory()}


def exponent(sizes: list[int], values: list[float]) -> float:
    """Of a value over a size."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def by_logs(figures: Figures, script: str, folders: dict[int, Path]) -> None:
    """Folders of more and more logs of a minute."""
    sizes, rows = list(folders), [in_a_child(script, "--child-logs", str(folder)) for folder in folders.values()]
    for size, row in zip(sizes, rows, strict=True):
        figures.tell(f"{size} logs of a minute, one worker", row["build"], None, "s")
        figures.tell("what they say", row["read"], None, "s")
        figures.tell("largest memory", row["memory"], 1500.0, "MB")
    if len(sizes) > 1:
        for what, key in (("time", "build"), ("time of what they say", "read"), ("memory", "memory")):
            figures.tell(f"{what} grows with logs to the power", exponent(sizes, [r[key] for r in rows]), 1.1, "")


def by_boats(figures: Figures, script: str, counts: list[int]) -> None:
    """Diaries of more and more boats."""
    rows = [in_a_child(script, "--child-boats", str(count)) for count in counts]
    for count, row in zip(counts, rows, strict=True):
        figures.tell(f"diary and page of {count} boats over {DAYS} days", row["seconds"], None, "s")
        figures.tell("largest memory", row["memory"], 1500.0, "MB")
    if len(counts) > 1:
        for what, key in (("time", "seconds"), ("memory", "memory")):
            figures.tell(f"{what} grows with boats to the power", exponent(counts, [r[key] for r in rows]), 1.1, "")
