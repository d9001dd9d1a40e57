"""What every verb works on: logs read and prepared once for a vehicle, and the part that judges."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .inspection import Inspection, inspect_log
from .kinematic_errors import Kinematics
from .log import read_log
from .log_options import AS_GUESSED, Reading
from .preparation.dataset import DataSet
from .preparation.split import PARTS, Split

PathLike = str | os.PathLike[str]
INPUTS_CURE = "undertow.read_inputs(LOGS, VEHICLE) makes them"


@dataclass(frozen=True, slots=True)
class Parts:
    """The prepared parts of the logs by name, and which one judges."""

    split: Split
    judge: str = "test"

    def data(self, part: str) -> DataSet:
        """A part by name: train, validation or test."""
        found: DataSet = getattr(self.split, part)
        return found

    @property
    def judged(self) -> DataSet:
        """The data on which models are scored: one part, or all of them."""
        if self.judge != "all":
            return self.data(self.judge)
        every = [self.data(part) for part in PARTS]
        return DataSet(
            tuple(m for data in every for m in data.motions),
            every[0].notes,
            every[0].recipe,
            tuple(m for data in every for m in data.raw),
        )


@dataclass(frozen=True, slots=True)
class Inputs:
    """Logs read and prepared once, for everything that follows.

    Their channels are not kept: of a long log they would take as much memory as its motions.

    Attributes
    ----------
    paths : the files that were read
    starts : the stamp of each log at the zero of its motions' time [ns], by their source
    vehicle : the nominal model
    weak : unfiltered parts at the logs' own rate, for the weak form
    parts : the paper's preparation, on which models are judged
    notes : what reading and preparing had to say
    reading : how the logs were read
    warnings : what is wrong with the logs, to be told above every result
    sensors : what the records of each log say of its sensors, by the source of its motions; they are corrected for it
    inspected : the vehicle for which each log was inspected, and what was seen; see `inspections`
    """

    paths: tuple[str, ...]
    starts: Mapping[str, int]
    vehicle: Vehicle
    weak: Split
    parts: Parts
    notes: tuple[str, ...]
    reading: Reading = AS_GUESSED
    warnings: tuple[str, ...] = ()
    sensors: Mapping[str, Kinematics] = field(default_factory=dict)
    inspected: tuple[Vehicle, tuple[Inspection, ...]] | None = None

    def mapped(self, change: Callable[[Motion], Motion]) -> "Inputs":
        """The same with every motion changed, filtered and unfiltered alike."""
        weak, parts = (
            Split(*(data.mapped(change) for data in (split.train, split.validation, split.test)))
            for split in (self.weak, self.parts.split)
        )
        return replace(self, weak=weak, parts=replace(self.parts, split=parts))

    @property
    def inspections(self) -> tuple[Inspection, ...]:
        """Of each log, for this vehicle; where they were made for another, the logs are read again."""
        if self.inspected is not None and self.inspected[0] == self.vehicle:
            return self.inspected[1]
        return tuple(inspect_log(read_log(path, self.reading), self.vehicle) for path in self.paths)

    @property
    def fitting(self) -> tuple[Motion, ...]:
        """Unfiltered motions of the training and validation parts; the test part is never fitted."""
        return (*self.weak.train.motions, *self.weak.validation.motions)

    @property
    def log_names(self) -> str:
        """Names of the logs' files, for a sentence."""
        return ", ".join(Path(path).name for path in self.paths)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the command columns."""
        return tuple(t.channel for t in self.vehicle.thrusters)
