"""How long the command line takes and how much memory, imports included, against what is asked of it.

    python benchmarks/speed.py [--no-answers] [--growth MINUTES ...] [--rows 1000000] [--networks] [--compression]
        [--rollouts] [--field FOLDER] [--foreign LOGS] [--table docs/performance.md]

Each figure is the best of some runs of the command line (five of an answer and of the demo), each in a process of its
own, and the largest memory of these: the speed of a machine changes as others use it. `--growth` adds `discover` on
logs of that many minutes with the exponent of its time, `--rows` adds `inspect` of a log of that many rows,
`--networks` a comparison of seven models, `--compression` factors against pysindy, LAPACK and BLAS (see
`compression.py`), `--rollouts` a batch of rollouts against other ways (see `losses.py`), `--field` a discovery in the
logs of a real BlueBoat (see `examples/real_blueboat.py`), `--foreign` one in each of that many foreign logs. What is
left out keeps its section of the page. Exit code 1 where a limit is broken.
"""

import argparse
import json
import os
import runpy
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from compression import DRAWS, against_lapack, against_pysindy
from measured import Figures, measure_parts
from rollouts import against_others
from study.studies import STUDIES

from undertow.physics.vehicle import vehicle_from_dict

UNDERTOW = [sys.executable, "-m", "undertow"]
HIDDEN = ("surge_quadratic_damping=-6", "thruster_asymmetry=0.8", "steady_current=0.2,-0.1", "sway_lift=8")
RATE = 20.0
_SLOW = 10.0
"""Time of an answer [s] under which nine of ten foreign logs are to be answered."""
HOW = (
    "Times of the command line are wall times, imports included, the best of five runs of an answer and of the demo "
    "and of two of a comparison, and memory is the largest that a run held."
)


def run(arguments: Sequence[str], folder: Path, ends: Sequence[int] = (0, 1)) -> tuple[float, float]:
    """Wall time [s] and largest memory [MB] of one run of the command line, and with which exit codes it may end."""
    begun = time.perf_counter()
    child = subprocess.Popen([*UNDERTOW, *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    told = child.stderr.read() if child.stderr else b""
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode not in ends:
        raise SystemExit(f"undertow {' '.join(arguments)} failed:\n{told.decode()}")
    return time.perf_counter() - begun, usage.ru_maxrss / (1024.0 if sys.platform != "darwin" else 1024.0**2)


def best(arguments: Sequence[str], folder: Path, times: int = 2) -> tuple[float, float]:
    """The better time and the larger memory of some runs."""
    runs = [run(arguments, folder) for _ in range(times)]
    return min(seconds for seconds, _ in runs), max(memory for _, memory in runs)


def log_of(folder: Path, minutes: float, hidden: bool) -> str:
    """A log at 20 Hz of that many minutes, and its name."""
    name = f"{minutes:g}{'hidden' if hidden else 'none'}.csv"
    words = ["simulate", "-v", "blueboat", "--duration", f"{60.0 * minutes:g}", "--seed", "1", "--out", name]
    run([*words, *(f"--effect={effect}" for effect in (HIDDEN if hidden else ()))], folder)  # its memory is not ours
    return name


def answers(figures: Figures, folder: Path) -> None:
    """`discover` on 5 minutes, with and without the page, `demo`, help and import."""
    for hidden, limit, memory in ((False, 2.0, None), (True, 4.0, 300.0)):
        what = f"discover, 5 min at 20 Hz, {'four effects' if hidden else 'nothing'} hidden"
        words = ["discover", log_of(folder, 5.0, hidden), "-v", "blueboat", "--out", f"run{hidden}", "--force"]
        seconds, peak = best([*words, "--no-report"], folder, 5)
        figures.tell(f"{what}, without page", seconds, limit, "s")
        figures.tell("the same, memory", peak, memory, "MB")
        figures.tell(f"{what}: what the page adds", best(words, folder, 5)[0] - seconds, 3.0, "s")
        if hidden:
            shares(figures, folder, words[1])
    figures.tell("demo", best(["demo", "--force"], folder, 5)[0], 6.0, "s")
    figures.tell("undertow --help", best(["--help"], folder, 3)[0], 0.3, "s")
    begun = [_import(folder) for _ in range(3)]
    figures.tell("import undertow, beside Python itself", min(begun), 0.05, "s")


def shares(figures: Figures, folder: Path, log: str) -> None:
    """Where the time of an answer goes."""
    script = Path(__file__).with_name("shares.py")
    told = subprocess.run([sys.executable, script, log], cwd=folder, check=True, capture_output=True, text=True).stdout
    steps: dict[str, float] = json.loads(told)
    for step, seconds in steps.items():
        figures.tell(f"share of its time: {step}", 100.0 * seconds / sum(steps.values()), None, "%")


def field(figures: Figures, folder: Path, logs: Path) -> None:
    """`discover` in the logs of a real BlueBoat, which rollouts judge."""
    example = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "real_blueboat.py"))
    vehicle_from_dict(example["START"], "the example").save(folder / "linear.yaml")
    (folder / "channels.yaml").write_text(example["CHANNELS"], encoding="utf-8")
    paths = sorted(str(path.resolve()) for path in logs.glob("log_*.csv"))
    words = ["discover", *paths, "-v", "linear.yaml", "--map", "channels.yaml", "--out", "field", "--force"]
    seconds, peak = best([*words, "--no-report"], folder)
    figures.tell(f"discover, {len(paths)} logs of a real BlueBoat, rollouts", seconds, 30.0, "s")
    figures.tell("the same, memory", peak, None, "MB")


def foreign(figures: Figures, folder: Path, count: int) -> None:
    """`discover` with its page in some logs of the foreign worlds that are reported, each once."""
    seconds, peaks = [], []
    for study in ("foreign", "others"):
        for kind, seed in STUDIES[study].keys("reporting")[: (count + 1) // 2]:
            logged = STUDIES[study].logged(kind, seed)
            logged.vehicle.save(folder / "foreign.yaml")
            words = ["discover", str(logged.write(folder / "foreign.csv")), "-v", "foreign.yaml", "--out", "foreign"]
            took, peak = run([*words, "--force"], folder, (0, 1, 2))  # a refusal is an answer, too
            print(f"{study}, {kind} {seed}: {took:.1f} s", flush=True)
            seconds.append(took)
            peaks.append(peak)
    slow = 100.0 * float(np.mean(np.array(seconds) >= _SLOW))
    figures.tell(f"discover, {len(seconds)} foreign logs of 4 min: the median", float(np.median(seconds)), None, "s")
    figures.tell(f"the same: share that takes {_SLOW:g} s and more", slow, 10.0, "%")
    figures.tell("the same, memory", max(peaks), None, "MB")


def _import(folder: Path) -> float:
    code = "import time; t = time.perf_counter(); import undertow; print(time.perf_counter() - t)"
    return float(subprocess.run([sys.executable, "-c", code], cwd=folder, check=True, capture_output=True).stdout)


def growth(figures: Figures, folder: Path, minutes: Sequence[float]) -> None:
    """`discover` on longer and longer logs, and the exponent of its time."""
    seconds = []
    for length in minutes:
        words = ["discover", log_of(folder, length, True), "-v", "blueboat", "--out", "grown", "--force", "--no-report"]
        took, peak = run(words, folder)
        seconds.append(took)
        figures.tell(f"discover, {length:g} min at 20 Hz, four effects hidden", took, None, "s")
        figures.tell("the same, memory", peak, 600.0, "MB")
        if length >= 600.0:
            figures.tell("the same, against 3 min", took, 180.0, "s")
    if len(minutes) > 1:
        exponent = np.polyfit(np.log(minutes), np.log(seconds), 1)[0]
        figures.tell("exponent of the time over the length", float(exponent), 1.1, "")


def inspection(figures: Figures, folder: Path, rows: int) -> None:
    """`inspect` of a log of that many rows."""
    seconds, peak = run(["inspect", log_of(folder, rows / RATE / 60.0, False), "-v", "blueboat"], folder)
    figures.tell(f"inspect, {rows:,} rows", seconds, 20.0, "s")
    figures.tell("the same, memory", peak, 400.0, "MB")


def networks(figures: Figures, folder: Path) -> None:
    """A comparison with a corrected model and two networks; how well they are trained is no matter."""
    log = log_of(folder, 4.0, True)
    run(["discover", log, "-v", "blueboat", "--out", "corrected", "--no-report"], folder)
    words = ["compare", log, "-v", "blueboat", "--model", "corrected"]
    for name in ("lstm", "tcn"):
        run(["train", log, "-v", "blueboat", "--residual", name, "--epochs", "2", "--out", name], folder)
        words += ["--model", name]
    figures.tell("compare, 4 min, corrected, LSTM, TCN and the references", best(words, folder)[0], 15.0, "s")


def main() -> int:
    """Measure, print, and say by the exit code whether the limits hold."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--answers", action=argparse.BooleanOptionalAction, default=True)
    parser.add_argument("--growth", type=float, nargs="+", default=[], metavar="MINUTES")
    parser.add_argument("--rows", type=int, default=0)
    parser.add_argument("--networks", action="store_true")
    parser.add_argument("--compression", action="store_true")
    parser.add_argument("--rollouts", action="store_true")
    parser.add_argument("--field", type=Path, metavar="FOLDER")
    parser.add_argument("--foreign", type=int, default=0, metavar="LOGS")
    parser.add_argument("--table", type=Path)
    chosen = parser.parse_args()

    def compression(figures: Figures) -> None:
        against_lapack(figures)
        against_pysindy(figures, [10_000, 100_000, 1_000_000], DRAWS)

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        parts: dict[str, tuple[bool, Callable[[Figures], None]]] = {
            "an answer": (chosen.answers, lambda f: answers(f, folder)),
            "longer and longer logs": (bool(chosen.growth), lambda f: growth(f, folder, chosen.growth)),
            "a look at a long log": (chosen.rows > 0, lambda f: inspection(f, folder, chosen.rows)),
            "a comparison with networks": (chosen.networks, lambda f: networks(f, folder)),
            "compression": (chosen.compression, compression),
            "rollouts": (chosen.rollouts, against_others),
            "foreign logs": (chosen.foreign > 0, lambda f: foreign(f, folder, chosen.foreign)),
            "field logs": (chosen.field is not None, lambda f: field(f, folder, chosen.field)),
        }
        asked = {name: measure for name, (wanted, measure) in parts.items() if wanted}
        return int(measure_parts(asked, chosen.table, "Speed", "benchmarks/speed.py", HOW))


if __name__ == "__main__":
    sys.exit(main())
