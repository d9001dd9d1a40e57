"""A data set of the size of the public FMU-KF set, simulated in chunks, and what a cluster of 100 machines would take.

The public set has 42,667 h at 1 Hz: 154 million rows. A log at 1 Hz is refused, for a small hull does more between two
rows than they tell; so the rows are those of logs of an hour at 20 Hz. Each is simulated, made factors and kept before
the next begins, so that a run that is interrupted goes on where it was.
"""

import gzip
import hashlib
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from growth_of_fleets import exponent, largest_memory
from measured import Figures

import undertow
from undertow.discovery.balance.base import WeakSettings
from undertow.fleet.fleet_folder import FleetLog, factors_path, has_factors, index_of, iso, write_index
from undertow.fleet.hull_factors import hull_factors, to_bytes
from undertow.fleet.parameter_estimates import read_fleet
from undertow.fleet.workers import Engine, local_cluster, mapped
from undertow.measurements.log_options import AS_GUESSED
from undertow.physics.files import write_bytes
from undertow.physics.motion import Motion
from undertow.physics.worlds.world import NOISE, World, simulate_world
from undertow.workflows.compress import in_pieces
from undertow.workflows.inputs import read_motions

HULL = undertow.load_vehicle("blueboat")
ROWS, HOURS = 153_600_000, 42_667.0
"""Of the public set."""
HOUR = 72_000
"""Rows of an hour at 20 Hz."""
BOATS = 20
LEVEL = np.array([0.015, 0.015, 0.006])
"""Noise of u, v [m/s] and r [rad/s]: that of the field."""
MACHINES, CORES = 100, 8
NETWORK = 125.0
"""Megabytes a second that the scheduler's network takes: a gigabit."""
LINEAR = (0.9, 1.1)
"""Exponents of the time over the rows between which what is left is computed from what was measured."""


def _hour(world: Motion, number: int) -> Iterator[list[Motion]]:
    """An hour in three pieces, with noise of its own."""
    for n in range(3):
        noise = LEVEL * np.random.default_rng([number, n]).standard_normal(world.velocity.shape)
        later = 1201.0 * n
        yield [replace(world, time=world.time + later, minutes=world.minutes + later / 60.0,
                       velocity=world.velocity + noise)]  # fmt: skip


def streamed(figures: Figures, share: float, kept: Path | None) -> None:
    """A share of the set; the rest is computed where time grows as the rows do.

    Parameters
    ----------
    kept : folder of a fleet that is kept and gone on with; None for one that goes
    """
    count = round(ROWS / HOUR)
    wanted = max(8, round(share * count))
    world = World(HULL, "rich", 1200.0, 1).run(NOISE["clean"]).motion()
    with TemporaryDirectory() as scratch:
        folder = kept or Path(scratch)
        (folder / "factors").mkdir(parents=True, exist_ok=True)
        logs: list[FleetLog] = []
        spent: list[float] = []
        for number in range(wanted):
            key = hashlib.sha256(f"hour {number}".encode()).hexdigest()
            begun = time.process_time()
            if not has_factors(folder, key):
                content = to_bytes(hull_factors(_hour(world, number), HULL, digest=key, start=0.0))
                write_bytes(factors_path(folder, key), content)
                spent.append(time.process_time() - begun)
            day, boat = 86400.0 * (20_000 + number // BOATS), number % BOATS
            logs.append(FleetLog(log=f"hour {number}", boat=f"boat-{boat:02d}", time=iso(day + 3600.0 * 12), hours=1.0,
                                 factors=key, sha256=key, vehicle=HULL.digest))  # fmt: skip
        write_index(folder, index_of(logs, ()))
        begun = time.perf_counter()
        read_fleet(folder)
        merged = time.perf_counter() - begun
        size = sum(path.stat().st_size for path in (folder / "factors").iterdir())
    rows = wanted * HOUR
    if len(spent) >= 4:
        sizes = [len(spent) // 4, len(spent) // 2, len(spent)]
        grown = exponent(sizes, [sum(spent[:n]) for n in sizes])
        figures.tell(f"{len(spent) * HOUR:,} rows in hours of 20 Hz, simulated and made factors", sum(spent), None, "s")
        figures.tell("time grows with rows to the power", grown, LINEAR[1], "")
        if LINEAR[0] < grown < LINEAR[1] and wanted < count:
            whole = sum(spent) / len(spent) * count
            figures.tell(f"all {ROWS:,} rows, one core, computed from that", whole / 3600.0, None, "h")
    figures.tell(f"what {wanted} such logs say ({rows / ROWS:.1%} of the set)", merged, None, "s")
    figures.tell("the same for all of the set, computed", merged / wanted * count, None, "s")
    figures.tell("the folder for all of the set, computed", size / wanted * count / 1e6, None, "MB")
    figures.tell("largest memory", largest_memory(), 1500.0, "MB")


def _nothing(number: int) -> bytes:
    """As much as the factors of a log of an hour."""
    return bytes(250_000 + number % 2)


def of_a_cluster(figures: Figures) -> None:
    """What a log of an hour costs, step by step, and what 100 machines would take for the hours of the set."""
    with TemporaryDirectory() as scratch:
        log = Path(scratch, "2026-01-01.csv.gz")
        simulate_world(HULL, {}, duration=3600.0, seed=0).write(Path(scratch, "log.csv"))
        log.write_bytes(gzip.compress(Path(scratch, "log.csv").read_bytes(), compresslevel=1))
        Path(scratch, "factors").mkdir()
        marks = [time.perf_counter()]
        _, motions = read_motions(log, HULL, AS_GUESSED)
        marks.append(time.perf_counter())
        content = to_bytes(hull_factors(in_pieces(motions, WeakSettings()), HULL, digest="0" * 64, start=0.0))
        marks.append(time.perf_counter())
        write_bytes(factors_path(Path(scratch), "0" * 64), content)
        marks.append(time.perf_counter())
        told = FleetLog(log="a", boat="a", time="2026-01-01T00:00:00Z", hours=1.0, factors="0" * 64, sha256="0" * 64,
                        vehicle="v")  # fmt: skip
        write_index(Path(scratch), index_of([told], ()))
        begun = time.perf_counter()
        read_fleet(scratch)
        merge = time.perf_counter() - begun
    read, squeezed, write = (float(d) for d in np.diff(marks))
    with local_cluster(1) as address:
        list(mapped(_nothing, range(8), Engine(scheduler=address)))
        begun = time.perf_counter()
        list(mapped(_nothing, range(200), Engine(scheduler=address)))
        ship = (time.perf_counter() - begun) / 200
    figures.tell("a log of an hour at 20 Hz: to read it", read, None, "s")
    figures.tell("to make its factors", squeezed, None, "s")
    figures.tell("to ship factors through the scheduler", 1000.0 * ship, None, "ms")
    figures.tell("to keep them", 1000.0 * write, None, "ms")
    figures.tell("to say what they say", 1000.0 * merge, None, "ms")
    figures.tell("its factors", len(content) / 1000.0, None, "kB")
    apart = HOURS * (read + squeezed) / (MACHINES * CORES)
    one = HOURS * (max(ship, len(content) / 1e6 / NETWORK) + write)
    name = f"{HOURS:,.0f} h at 20 Hz on {MACHINES} machines of {CORES} cores, computed"
    figures.tell(f"{name}: the machines' part", apart, None, "s")
    figures.tell("the scheduler's part, beside it", one, None, "s")
    figures.tell("what they say, after it, one core", HOURS * merge, None, "s")
    figures.tell("in all", max(apart, one) + HOURS * merge, None, "s")
