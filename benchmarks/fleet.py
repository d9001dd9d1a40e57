"""A fleet as one data set: one worker and two, many short logs, a killed worker, rows that stream, growth, intervals.

    python benchmarks/fleet.py [--logs 64] [--minutes 60] [--short 500] [--rows 1000000 10000000] [--worlds 40]
        [--grown 50 100 200 400] [--boats 5 10 20 40] [--share 1] [--keep FOLDER] [--table docs/performance.md]

Logs are simulated under field noise first, which no figure counts. Rows are those of one long log at 20 Hz that is
never whole in memory: pieces of 25 minutes, each with noise of its own; their time is that of the processor, and each
number of rows has a process of its own, whose largest memory is told. `--share` is that of a data set of the size of
the public FMU-KF set (see `public_size.py`), which is run whole by default and goes on where it was with `--keep`; what
a smaller share leaves is computed. 0 in the place of any number leaves that part out, and the table then keeps what it
had of it.
"""

import argparse
import gzip
import json
import os
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from growth_of_fleets import by_boats, by_logs, in_a_child, largest_memory, of_boats, of_logs
from measured import Figures, measure_parts
from public_size import of_a_cluster, streamed

import undertow
from undertow.fleet.build_fleet import FleetBuilt, build_fleet
from undertow.fleet.fleet_folder import read_index
from undertow.fleet.hull_factors import hull_factors
from undertow.fleet.parameter_estimates import estimated, read_fleet
from undertow.fleet.workers import Engine
from undertow.physics.motion import Motion
from undertow.physics.worlds.hidden_effects import random_hull
from undertow.physics.worlds.world import NOISE, World, simulate_world

HULL = undertow.load_vehicle("blueboat")
PIECE = 1500.0
LEVEL = np.array([0.015, 0.015, 0.006])
"""Noise of u, v [m/s] and r [rad/s] in each piece: that of the field."""


def simulated(folder: Path, count: int, seconds: float) -> Path:
    """Logs of ten boats, one a day: a world a boat, whose days have other bytes by the stamp of their gzip files."""
    for boat in range(10):
        path = folder / f"boat_{boat}"
        path.mkdir(parents=True)
        simulate_world(HULL, {}, duration=seconds, seed=boat).write(folder / "world.csv")
        text = (folder / "world.csv").read_bytes()
        for day in range(len(range(boat, count, 10))):
            name = f"{np.datetime64('2026-01-01') + day}.csv.gz"
            (path / name).write_bytes(gzip.compress(text, compresslevel=1, mtime=day))
    (folder / "world.csv").unlink()
    return folder


def timed(logs: Path, out: Path, workers: int | None) -> tuple[float, FleetBuilt]:
    begun = time.perf_counter()
    built = build_fleet(logs, HULL, out, engine=Engine(workers), progress=None)
    return time.perf_counter() - begun, built


def by_turns(logs: Path, place: Path) -> tuple[float, float]:
    """Times with one worker and with two, each the better of two: the speed of a machine changes as minutes go."""
    times: dict[str, list[float]] = {"one": [], "two": []}
    for turn in ("first", "second"):
        for workers, name in enumerate(times, start=1):
            shutil.rmtree(place / name, ignore_errors=True)
            times[name].append(timed(logs, place / name, workers)[0])
            print(f"  {turn} time, {name}: {times[name][-1]:.2f} s", flush=True)
    return min(times["one"]), min(times["two"])


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def killed(logs: Path, out: Path) -> int:
    """Make a fleet with two workers, and kill one as soon as a log is done; how many were killed."""
    found = []

    def kill() -> None:
        while not list((out / "factors").glob("*.npz")):
            time.sleep(0.01)
        children = [int(c) for t in Path("/proc/self/task").iterdir() for c in (t / "children").read_text().split()]
        for child in children:
            words = Path(f"/proc/{child}/cmdline").read_bytes()
            if b"loky" in words and b"tracker" not in words and not found:
                os.kill(child, signal.SIGKILL)
                found.append(child)

    watch = threading.Thread(target=kill)
    watch.start()
    build_fleet(logs, HULL, out, engine=Engine(2), progress=None)
    watch.join()
    return len(found)


def with_workers(figures: Figures, count: int, minutes: float) -> None:
    """One worker and two, a killed one, and a broken log."""
    with TemporaryDirectory() as folder:
        place = Path(folder)
        logs = simulated(place / "logs", count, 60.0 * minutes)
        name = f"{count} logs of {minutes:g} minutes"
        one, two = by_turns(logs, place)
        figures.tell(f"{name}, one worker, the better of two runs", one, None, "s")
        figures.tell(f"{name}, two workers, likewise", two, None, "s")
        figures.tell("time of one over that of two", one / two, 1.7, "", least=True)
        same = content(place / "one") == content(place / "two")
        figures.tell("bytes that differ between them", float(not same), 1.0, "")
        again, built = timed(logs, place / "two", 2)
        figures.tell("the same call again", again, None, "s")
        figures.tell("logs that it reads", built.read, 1.0, "")
        died = killed(logs, place / "killed")
        figures.tell("workers killed", died, 1.0, "", least=True)
        same = content(place / "one") == content(place / "killed")
        figures.tell("files that differ after that", float(not same), 1.0, "")
        (logs / "boat_0" / "2026-12-31.csv").write_text("time,topic,field,value\n0.0,odometry,u,much\n")
        begun = time.perf_counter()
        _, built = timed(logs, place / "one", 1)
        figures.tell("a broken log more", time.perf_counter() - begun, None, "s")
        figures.tell("logs that are named for it", len(built.skipped), 1.0, "", least=True)
        same = read_index(place / "one").logs == read_index(place / "two").logs
        figures.tell("others that change", float(not same), 1.0, "")


def many_short(figures: Figures, count: int) -> None:
    """Many logs of one minute, and what they say."""
    with TemporaryDirectory() as folder:
        logs = simulated(Path(folder, "logs"), count, 60.0)
        seconds, _ = timed(logs, Path(folder, "fleet"), 2)
        figures.tell(f"{count} logs of a minute, two workers", seconds, 300.0 if count >= 500 else None, "s")
        begun = time.perf_counter()
        fleet = read_fleet(Path(folder, "fleet"))
        figures.tell(f"{len(fleet.estimates)} estimates of them", time.perf_counter() - begun, None, "s")
        size = sum(len(data) for data in content(Path(folder, "fleet")).values())
        figures.tell("the folder, a log", size / count / 1000.0, None, "kB")


def pieces_of(world: Motion, rows: int) -> Iterator[list[Motion]]:
    """Pieces of a log, each driven alike, with noise of its own."""
    step = world.time.size
    for n in range(max(1, round(rows / step))):
        noise = LEVEL * np.random.default_rng([n, 9]).standard_normal(world.velocity.shape)
        time_, minutes = world.time + n * (PIECE + 1.0), world.minutes + n * (PIECE + 1.0) / 60.0
        yield [replace(world, time=time_, minutes=minutes, velocity=world.velocity + noise)]


def of_rows(rows: int) -> dict[str, float]:
    """Time and memory of one long log, in this process."""
    world = World(HULL, "rich", PIECE, 1).run(NOISE["clean"]).motion()
    begun = time.process_time()
    factors = hull_factors(pieces_of(world, rows), HULL)
    seconds = time.process_time() - begun
    off = estimated(factors).values / factors.nominal - 1.0
    return {"seconds": seconds, "memory": largest_memory(), "off": float(np.abs(off).max())}


def long_logs(figures: Figures, sizes: list[int]) -> None:
    """Time and memory as rows become more."""
    found = []
    for rows in sizes:
        told = in_a_child(__file__, "--child-rows", str(rows))
        found.append(told["seconds"])
        figures.tell(f"{rows:,} rows streamed", told["seconds"], None, "s")
        figures.tell("largest memory of the process", told["memory"], 1500.0, "MB")
        figures.tell("largest error of a parameter", 100.0 * told["off"], None, "%")
    if len(sizes) > 1:
        slope = float(np.polyfit(np.log(sizes), np.log(found), 1)[0])
        figures.tell("time grows with rows to the power", slope, 1.1, "")


def coverage(figures: Figures, worlds: int) -> None:
    """How often intervals of 95 % hold the truth, of hulls that differ from the vehicle in every parameter."""
    for seconds, programme in ((60.0, "rich"), (60.0, "gentle"), (180.0, "rich"), (300.0, "rich"), (1200.0, "gentle")):
        held = []
        for seed in range(worlds):
            rng = np.random.default_rng([seed, 5])
            hull = random_hull(undertow.load_vehicle(("blueboat", "otter")[seed % 2]), rng)
            true = hull.with_values({s: hull.value(s) * rng.uniform(0.85, 1.15) for s in ("X_u", "Y_v", "N_r", "mass")})
            true = true.with_values({f"{t.name}_scale": rng.uniform(0.8, 1.1) for t in true.thrusters})
            factors = hull_factors([[World(true, programme, seconds, seed).run(NOISE["field"]).motion()]], hull)
            found = estimated(factors)
            off = found.values - np.array([true.value(c.name) for c in factors.parameters])
            held += [abs(o) <= 1.96 * s for o, s in zip(off, np.sqrt(np.diag(found.covariance)), strict=True) if s == s]
        name = f"intervals that hold the truth, {worlds} logs of {seconds / 60:g} minutes, {programme}"
        figures.tell(name, 100.0 * float(np.mean(held)), 92.0, "%", least=True)


def grown(figures: Figures, sizes: list[int], boats: list[int]) -> None:
    """Growth by logs and by boats."""
    if sizes[0]:
        with TemporaryDirectory() as folder:
            by_logs(figures, __file__, {n: simulated(Path(folder, str(n)), n, 60.0) for n in sizes})
    if boats[0]:
        by_boats(figures, __file__, boats)


def public(figures: Figures, share: float, kept: Path | None) -> None:
    """A set of public size, and a cluster's part of it."""
    streamed(figures, share, kept)
    of_a_cluster(figures)


def children(words: list[str]) -> dict[str, float] | None:
    """What a process of its own is to measure; None for this script's first process."""
    known = {"--child-rows": lambda n: of_rows(int(n)), "--child-boats": lambda n: of_boats(int(n)),
             "--child-logs": of_logs}  # fmt: skip
    return known[words[0]](words[1]) if words and words[0] in known else None


def main() -> int:
    """Measure, print, write the table, and say by the exit code whether the limits hold."""
    if (told := children(sys.argv[1:])) is not None:
        print(json.dumps(told))
        return 0
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=int, default=64)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--short", type=int, default=500)
    parser.add_argument("--rows", type=int, nargs="+", default=[1_000_000, 10_000_000, 100_000_000])
    parser.add_argument("--worlds", type=int, default=40)
    parser.add_argument("--grown", type=int, nargs="+", default=[50, 100, 200, 400])
    parser.add_argument("--boats", type=int, nargs="+", default=[5, 10, 20, 40])
    parser.add_argument("--share", type=float, default=1.0)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--table", type=Path)
    chosen = parser.parse_args()
    parts: dict[str, tuple[bool, Callable[[Figures], None]]] = {
        "intervals of short logs": (chosen.worlds > 0, lambda f: coverage(f, chosen.worlds)),
        "rows of one log": (chosen.rows[0] > 0, lambda f: long_logs(f, chosen.rows)),
        "many short logs": (chosen.short > 0, lambda f: many_short(f, chosen.short)),
        "growth": (chosen.grown[0] + chosen.boats[0] > 0, lambda f: grown(f, chosen.grown, chosen.boats)),
        "a data set of public size": (chosen.share > 0.0, lambda f: public(f, chosen.share, chosen.keep)),
        "workers": (chosen.logs > 0, lambda f: with_workers(f, chosen.logs, chosen.minutes)),
    }
    asked = {name: measure for name, (wanted, measure) in parts.items() if wanted}
    return int(measure_parts(asked, chosen.table, "Fleets", "benchmarks/fleet.py"))


if __name__ == "__main__":
    sys.exit(main())
