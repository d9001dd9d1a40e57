"""The logs of the study of rivals: one run that everything is fitted to, and a whole run that judges."""

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from unnamed import SECONDS, WAKE, boats

from study.other_simulators.kinds import with_hulls
from study.other_simulators.worlds import world_of
from undertow.measurements.preparation.prepare import PAPER, DataSet
from undertow.measurements.preparation.split import Split, split
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.worlds.world import NOISE
from undertow.workflows.inputs import read_inputs

SHARES = (0.85, 0.15)
"""Of the training run, in the order of time: what is fitted to, and what chooses settings and epochs."""
PAIRS = {
    "A": ("A_1", "A_2", "linear drag; gentle, judged on mixed manoeuvres"),
    "B": ("B_2", "B_4", "quadratic drag; judged on another geometry of the hull"),
    "C": ("C_1", "C_2", "quadratic drag and a current of 0.29 m/s; gentle, judged on mixed manoeuvres"),
    "D": ("D_2", "D_3", "quadratic drag and a weak starboard thruster; mixed, judged on hard manoeuvres"),
}
"""Runs that are trained on, those that judge, and what the nominal vehicle lacks."""
CAUSE = "thrust lost in turns"
"""No effect of the catalogue is it; a wake that remembers is one, and no calibration of the hull can stand for it."""
OTHERS = {"otter": "Otter", "wam-v": "WAM-V"}
"""Boats whose equations are not undertow's, see `other_simulators`."""
_FOREIGN = 300.0
"""Length of their logs [s]."""
_OWN, _OTHER = 1000, 2000
"""Added to a seed, the seed of the log that is fitted to, and of the one that judges."""


@dataclass(frozen=True, slots=True)
class Data:
    """What rivals are fitted to and judged on.

    Attributes
    ----------
    run : the training run as the verbs of undertow take it, with the nominal vehicle
    split : its parts by `SHARES`; what validates also stands as the test part, which nobody asks
    whole : the same run undivided
    held : a whole run that nothing was fitted to
    """

    run: Inputs
    split: Split
    whole: DataSet
    held: DataSet

    @property
    def parts(self) -> tuple[DataSet, DataSet, DataSet]:
        """What a setting is tried on, what chooses it, and what its model is then fitted to."""
        return self.split.train, self.split.validation, self.whole

    @classmethod
    def of(cls, run: Inputs, other: Inputs) -> "Data":
        """From a run that was read for no part in particular, and one that judges as a whole."""
        assert run.undivided is not None, "the training run is read without a part that judges"
        even = run.undivided[1]
        parts = split(even, replace(PAPER, shares=(*SHARES, 0.0)))
        whole = split(even, replace(PAPER, shares=(1.0, 0.0, 0.0))).train
        return cls(run, replace(parts, test=parts.validation), whole, other.parts.judged)


@dataclass(frozen=True, slots=True)
class Case:
    """A case of the study: `make(seed)` reads or simulates it; `moves` says whether a seed changes the data."""

    title: str
    make: Callable[[int], Data]
    moves: bool


def gazebo(folder: Path, own: str, other: str, seed: int) -> Data:
    """Two runs of the simulator; the seed is that of the rivals alone."""
    del seed
    nominal = folder / "vehicle_linear.yaml"
    run = read_inputs(folder / f"{own}.csv.gz", nominal, progress=None)
    return Data.of(run, read_inputs(folder / f"{other}.csv.gz", nominal, judge="all", progress=None))


def simulated(cause: str, seed: int) -> Data:
    """A random hull that lacks a cause: its log with field noise, and another one without noise that judges."""
    hull, world = boats(cause, seed)
    with tempfile.TemporaryDirectory() as scratch:
        own = world("rich", _OWN + seed).run(NOISE["field"]).write(Path(scratch) / "own.csv")
        other = world("rich", _OTHER + seed).run(NOISE["clean"]).write(Path(scratch) / "other.csv")
        run = read_inputs(own, hull, progress=None)
        return Data.of(run, read_inputs(other, hull, judge="all", progress=None))


def foreign(kind: str, seed: int) -> Data:
    """A boat of another simulator, with an effect that its file lacks: a log of 300 s, and another run that judges."""
    world, _ = world_of(kind, with_hulls()[kind], seed)
    world = replace(world, book=replace(world.book, seconds=_FOREIGN))
    with tempfile.TemporaryDirectory() as scratch:
        own, other = (world.written(world.driven(run), Path(scratch) / f"{run}.csv", run) for run in range(2))
        run = read_inputs(own, world.craft.file, progress=None)
        return Data.of(run, read_inputs(other, world.craft.file, judge="all", progress=None))


def cases(folder: Path | None) -> Mapping[str, Case]:
    """All cases by name; those on Gazebo logs only where their folder is given."""
    found = {}
    if folder is not None:
        for name, (own, other, lacks) in PAIRS.items():
            title = f"Gazebo BlueBoat, {own}, judged on {other}: {lacks}"
            found[f"gazebo {name}"] = Case(title, partial(gazebo, folder, own, other), False)
    for name, cause, kind in (("named", WAKE, "an effect of the catalogue"), ("unnamed", CAUSE, "no effect of it")):
        title = f"A simulated hull that lacks {cause}, {kind}: logs of {SECONDS:g} s, judged on one without noise"
        found[name] = Case(title, partial(simulated, cause), True)
    for name, boat in OTHERS.items():
        title = f"{boat} of another simulator, with an effect that its file lacks: 300 s, judged on another run"
        found[name] = Case(title, partial(foreign, f"{boat}: one effect"), True)
    return found
