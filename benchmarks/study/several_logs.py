"""Several logs of one boat at once, as a day on the water leaves them: other programmes, other noise, other currents.

The noise of a receiver that filters lasts, so that mostly rollouts judge. Of some boats the force has no name.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from undertow.physics.vehicle import Vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import SimulatedLog, World

from .foreign_logs import CAUSES, nameless
from .hidden_worlds import FRESH_SEED, LASTING, coloured, logged
from .verb import Drive, Logged, Write
from .worlds import ALL, NOISES, Case, Part, draw

FIRST = {"tuning": (830_000, 60), "reporting": (880_000, 60)}
"""First seed, and logs of a kind."""
HIDDEN = {"one effect": 1, "three effects": 3, "nothing": 0, "a guessed file": 6}
NAMELESS = "no name"
KINDS = ("one effect", "three effects", "nothing", NAMELESS, "a guessed file")
LOGS, SECONDS = (3, 6), 90.0
"""Logs of a boat, and how long each lasts [s]."""
_CURRENT = 0.1
"""Largest current of a day along each axis [m/s], of every other boat."""
_STANDS_FOR_A_CURRENT = frozenset({"steady_current", "turning_current", "mean_wind"})


def keys(purpose: str) -> list[tuple[str, int]]:
    """Kinds and seeds, in turn."""
    first, boats = FIRST[purpose]
    return [(kind, first + 1000 * k + n) for n in range(boats) for k, kind in enumerate(KINDS)]


def several(kind: str, seed: int) -> Logged:
    """Logs of a boat of a kind, in a folder."""
    rng, number = np.random.default_rng([seed, 18]), seed % 1000
    days = int(rng.integers(LOGS[0], LOGS[1] + 1))
    if kind == NAMELESS:
        own = nameless(CAUSES[number % len(CAUSES)], seed)
        assert own.fresh is not None, "a force without a name is driven again"
        write = _in_a_folder([own.write, *(_on(own.fresh, day) for day in range(2, days + 1))])
        return replace(own, study="several", kind=kind, note=f"{own.kind}, {own.note}, {days} logs", write=write)
    case = draw(Part("", HIDDEN[kind], 0, ALL, ("field", "rough", "low")), 7 * number, seed)
    other_days = bool(rng.integers(2))
    write = _in_a_folder([_of_day(case, seed + 10_000_000 * day, other_days) for day in range(days)])
    own = logged("several", kind, seed, case)
    stands = _STANDS_FOR_A_CURRENT if other_days else frozenset[str]()
    return replace(own, note=f"{own.note}, {days} logs", write=write, part=stands - own.true)


def _on(drive: Drive, day: int) -> Write:
    """Writes the log of a day."""
    return lambda path: drive(path, day)


def _of_day(case: Case, seed: int, current: bool) -> Write:
    """Writes a log of one day: the boat drives something else, and its receiver's noise lasts."""
    rng = np.random.default_rng([seed, 19])
    boat = _in_current(case.log.vehicle, rng) if current else case.log.vehicle
    sensors = NOISES[case.setting["noise"]]
    log = World(boat, str(rng.choice(ALL)), SECONDS, seed + FRESH_SEED).run(sensors)
    return _with_lasting_noise(log, rng).write


def _in_current(boat: Vehicle, rng: np.random.Generator) -> Vehicle:
    """The boat in a current of its own, beside one that is hidden."""
    north, east = rng.uniform(-_CURRENT, _CURRENT, 2).tolist()
    return apply_effects(boat, {"current_north": north, "current_east": east})


def _with_lasting_noise(log: SimulatedLog, rng: np.random.Generator) -> SimulatedLog:
    """The log with noise that lasts, of a size of its own."""
    share = float(rng.uniform(0.4, 1.2))
    lasting = np.stack([coloured(log.odometry_time, share * size, time, rng) for size, time in LASTING], axis=1)
    return replace(log, odometry=log.odometry + lasting)


def _in_a_folder(days: list[Write]) -> Write:
    """Writes logs into a folder of the name of the log, and gives that."""

    def write(path: Path) -> Path:
        folder = path.with_suffix("")
        folder.mkdir()
        for day, one in enumerate(days):
            one(folder / f"day_{day}.csv")
        return folder

    return write
