"""The cases of the neural study: what is trained on, what is held out, and from which vehicle all models start."""

import runpy
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from undertow.measurements.log_options import Reading
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.simulated_log import SimulatedLog
from undertow.physics.worlds.typical_effects import random_hull
from undertow.physics.worlds.world import NOISE, World
from undertow.workflows.inputs import read_inputs

LOGS, SECONDS = 4, 240.0
"""Training logs of a simulated boat, and the length of each [s]."""
BASE = "otter"

Values = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Case:
    """Data of one training: `train` is split in time; `held` are whole runs that no model was fitted to.

    `true` is the vehicle that made the data, where one is known.
    """

    train: Inputs
    held: Inputs
    true: Vehicle | None = None


@dataclass(frozen=True, slots=True)
class Setting:
    """A named case of the study; `make(seed)` reads or simulates it. `moves` says whether a seed changes the data."""

    title: str
    domain: str
    make: Callable[[int], Case]
    moves: bool


def gazebo(folder: Path, vehicle: str, train: str, held: str, seed: int) -> Case:
    """Two runs of the simulator with the same hull; the seed is that of the networks alone."""
    del seed
    nominal = folder / f"{vehicle}.yaml"
    return Case(
        read_inputs(folder / f"{train}.csv.gz", nominal),
        read_inputs(folder / f"{held}.csv.gz", nominal, judge="all"),
    )


def blueboat(folder: Path, seed: int) -> Case:
    """Field logs of a real BlueBoat, every third held out, from the linear start of `examples/real_blueboat.py`."""
    script = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "real_blueboat.py"))
    start = vehicle_from_dict(script["START"], "start")
    logs = sorted(folder.glob("log_*.csv"))
    held = logs[seed % 3 :: 3]
    with tempfile.TemporaryDirectory() as scratch:
        channels = Path(scratch) / "channels.yaml"
        channels.write_text(script["CHANNELS"], encoding="utf-8")
        return Case(
            read_inputs([log for log in logs if log not in held], start, Reading(channel_map=channels)),
            read_inputs(held, start, Reading(channel_map=channels), judge="all"),
        )


def simulated(hidden: Values, train: str, held: str, seed: int) -> Case:
    """Four logs of a random sister hull with hidden effects, and two more that are held out."""
    nominal = random_hull(load_vehicle(BASE), np.random.default_rng([seed, 11]))
    true = apply_effects(nominal, dict(hidden))
    logs = [_log(true, kind, 20 * seed + k) for kind, k in [(train, k) for k in range(LOGS)] + [(held, 10), (held, 11)]]
    with tempfile.TemporaryDirectory() as scratch:
        paths = [log.write(Path(scratch) / f"{k}.csv") for k, log in enumerate(logs)]
        return Case(
            read_inputs(paths[:LOGS], nominal),
            read_inputs(paths[LOGS:], nominal, judge="all"),
            true,
        )


def _log(vehicle: Vehicle, kind: str, seed: int) -> SimulatedLog:
    return World(vehicle, kind, SECONDS, 50_000 + seed).run(replace(NOISE["field"]))


def cases(folder: Path | None, field: Path | None = None) -> dict[str, Setting]:
    """All cases by name; those on recorded logs only where their folder is given: Gazebo's, and a real BlueBoat's."""
    drag = {"X_uu": -30.0, "N_rr": -40.0}
    memory = {"memory_sway": 100.0, "memory_yaw": 60.0, "memory_time": 1.0}
    found = {
        "memory": Setting(
            "A simulated boat whose wake remembers for 1 s", "in", partial(simulated, memory, "rich", "rich"), True
        ),
        "no memory": Setting(
            "A simulated boat without memory: quadratic drag in surge and yaw is missing",
            "in",
            partial(simulated, drag, "rich", "rich"),
            True,
        ),
        "hard": Setting(
            "The same boat, trained on gentle manoeuvres, judged on hard ones",
            "out",
            partial(simulated, drag, "gentle", "rich"),
            True,
        ),
    }
    if folder is not None:
        pairs = (
            ("A", "vehicle_linear", "A_1", "A_2", "out", "linear drag"),
            ("C", "vehicle_linear", "C_1", "C_2", "out", "quadratic drag and a current of 0.29 m/s"),
            ("D", "vehicle_linear", "D_1", "D_2", "out", "quadratic drag and a weak starboard thruster"),
            ("B", "vehicle_linear", "B_2", "B_4", "in", "quadratic drag; another geometry of the hull"),
        )
        for name, vehicle, train, held, domain, what in pairs:
            manner = "trained on gentle manoeuvres, judged on mixed ones" if domain == "out" else "both mixed"
            found[f"gazebo {name}"] = Setting(
                f"Gazebo BlueBoat, {what}: {train}, judged on {held} ({manner})",
                domain,
                partial(gazebo, folder, vehicle, train, held),
                False,
            )
    if field is not None:
        title = "Field logs of a real BlueBoat, every third log held out"
        found["blueboat"] = Setting(title, "in", partial(blueboat, field), True)
    return found
