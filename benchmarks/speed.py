"""How long the main job takes and how much memory it needs, from the command line, imports included.

Prints one line for each figure with its limit, and exits 1 when one is broken:
`undertow discover` on a 5 minute, 20 Hz log under 8 s and 1 GB; `undertow compare` of seven models, an LSTM and a TCN
among them, on a 4 minute log under 15 s; `undertow --help` under 0.5 s.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

UNDERTOW = [sys.executable, "-m", "undertow"]
HIDDEN = {"surge_quadratic_damping": -6.0, "thruster_asymmetry": 0.8, "steady_current": (0.2, -0.1), "sway_lift": 8.0}


def timed(arguments: list[str], folder: Path) -> float:
    """Wall time [s] of one run of the command line."""
    begun = time.perf_counter()
    subprocess.run([*UNDERTOW, *arguments], cwd=folder, check=True, capture_output=True)
    return time.perf_counter() - begun


def compared(hull: Vehicle, folder: Path) -> float:
    """Wall time [s] of a comparison with a corrected model and two networks; how well they are trained is no matter."""
    log = str(simulate_world(hull, HIDDEN, duration=240.0, noise="field", seed=2).write(folder / "compared.csv"))
    timed(["discover", log, "--vehicle", "blueboat", "--out", "corrected", "--no-report"], folder)
    words = ["compare", log, "--vehicle", "blueboat", "--model", "corrected"]
    for name in ("lstm", "tcn"):
        timed(["train", log, "--vehicle", "blueboat", "--residual", name, "--epochs", "2", "--out", name], folder)
        words += ["--model", name]
    return min(timed(words, folder) for _ in range(2))


def main() -> int:
    """Run, print, and say by the exit code whether the limits hold."""
    figures: list[tuple[str, float, float, str]] = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        hull = load_vehicle("blueboat")
        cases = {"nothing hidden": {}, "four effects hidden": HIDDEN}
        for name, hidden in cases.items():
            log = simulate_world(hull, hidden, duration=300.0, noise="field", seed=1).write(
                folder / f"{len(hidden)}.csv"
            )
            arguments = ["discover", str(log), "--vehicle", "blueboat", "--out", str(folder / f"run{len(hidden)}")]
            seconds = min(timed(arguments, folder) for _ in range(2))
            figures.append((f"discover, 5 min at 20 Hz, {name}, with report", seconds, 8.0, "s"))
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
        figures.append(("discover, peak memory", peak, 1024.0, "MB"))
        figures.append(("compare, 4 min, corrected, LSTM, TCN and the references", compared(hull, folder), 15.0, "s"))
        figures.append(("undertow --help", min(timed(["--help"], folder) for _ in range(3)), 0.5, "s"))
    print(f"{os.cpu_count()} cores")
    for name, value, limit, unit in figures:
        print(f"{name:58s} {value:8.2f} {unit:2s}  (limit {limit:g} {unit}) {'ok' if value < limit else 'BROKEN'}")
    return int(any(value >= limit for _, value, limit, _ in figures))


if __name__ == "__main__":
    sys.exit(main())
