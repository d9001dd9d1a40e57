"""The cases of the repeated paper: what is trained on, what is held out, and from which vehicle all models start."""

import runpy
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from undertow.measurements.log_options import Reading
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.vehicle import vehicle_from_dict
from undertow.workflows.inputs import read_inputs


@dataclass(frozen=True, slots=True)
class Case:
    """Data of one training: `train` is split in time; `held` are whole runs that no model was fitted to."""

    train: Inputs
    held: Inputs


@dataclass(frozen=True, slots=True)
class Setting:
    """A named case of the study, in or out of the domain of what was trained on; `make(seed)` reads it."""

    title: str
    domain: str
    make: Callable[[int], Case]


def gazebo(folder: Path, train: str, held: str, seed: int) -> Case:
    """Two runs of the simulator with the same hull; the seed is that of the networks alone."""
    del seed
    nominal = folder / "vehicle_linear.yaml"
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


def cases(folder: Path | None, field: Path | None = None) -> dict[str, Setting]:
    """The cases by name whose folder of logs is given: Gazebo's, and those of a real BlueBoat."""
    found = {}
    if folder is not None:
        pairs = (
            ("A", "A_1", "A_2", "out", "linear drag"),
            ("C", "C_1", "C_2", "out", "quadratic drag and a current of 0.29 m/s"),
            ("D", "D_1", "D_2", "out", "quadratic drag and a weak starboard thruster"),
            ("B", "B_2", "B_4", "in", "quadratic drag; another geometry of the hull"),
        )
        for name, train, held, domain, what in pairs:
            manner = "trained on gentle manoeuvres, judged on mixed ones" if domain == "out" else "both mixed"
            found[f"gazebo {name}"] = Setting(
                f"Gazebo BlueBoat, {what}: {train}, judged on {held} ({manner})",
                domain,
                partial(gazebo, folder, train, held),
            )
    if field is not None:
        title = "Field logs of a real BlueBoat, every third log held out"
        found["blueboat"] = Setting(title, "in", partial(blueboat, field))
    return found
