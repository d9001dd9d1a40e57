"""What every verb works on: logs read and prepared once for a vehicle, and the part that judges."""

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..physics.cards import Card, each
from ..physics.errors import RequestError
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .clean_log import read_as_wanted
from .inspection import Inspection, inspect_log
from .kinematic_errors import Kinematics, corrected_for
from .log_options import AS_GUESSED, Reading
from .preparation.dataset import PAPER, DataSet
from .preparation.held_out import Fold, cut
from .preparation.split import Split, filtered, split

PathLike = str | os.PathLike[str]
FOLDS = "folds"
"""In the place of a part that judges: all rows, each by a model that was made without the fold that it lies in."""
ALL = "all"
"""In the place of a part that judges: all rows, uncut, by models that were fitted to other logs."""
WHOLE = (FOLDS, ALL)
"""What judges all rows: nothing is kept aside, and the test part holds them."""
INPUTS_CURE = "undertow.read_inputs(LOGS, VEHICLE) makes them"


@dataclass(frozen=True, slots=True)
class Parts:
    """The prepared parts of the logs by name, and which one judges: a part, or one of `WHOLE`.

    Where all rows judge, no part is kept for fitting: they are those of the test part.
    """

    split: Split
    judge: str = "test"

    @property
    def known(self) -> tuple[Motion, ...]:
        """The motions that tell the domain and the size of signals: the training part, or all where all judge."""
        return self.judged.motions if self.judge in WHOLE else self.split.train.motions

    def data(self, part: str) -> DataSet:
        """A part by name: train, validation or test."""
        found: DataSet = getattr(self.split, part)
        return found

    @property
    def judged(self) -> DataSet:
        """The data on which models are scored: one part, or all rows."""
        return self.data("test" if self.judge in WHOLE else self.judge)


@dataclass(frozen=True, slots=True)
class Checks:
    """What the checks say of logs; see the attributes of `Inputs` of these names."""

    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    broken: bool
    inspections: tuple[Inspection, ...]


@dataclass(frozen=True, slots=True, repr=False)
class Inputs(Card):
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
    repairs : what was repaired in memory, a sentence a log, where the reading says `fix`
    digests : SHA-256 of the content of each log, by which it is known again
    warnings : what is wrong with the logs, to be told above every result
    broken : the logs have defects that make every result meaningless, and were taken as they are
    sensors : what the records of each log say of its sensors, by the source of its motions; they are corrected for it
    inspected : the vehicle for which each log was inspected, and what was seen; see `inspections`
    undivided : all motions without a filter, at the logs' own rate and at 10 Hz; None where a part was asked for
    recorded : the same as the sensors recorded them; what needs no correction is not kept twice
    """

    paths: tuple[str, ...]
    starts: Mapping[str, int]
    vehicle: Vehicle
    weak: Split
    parts: Parts
    notes: tuple[str, ...]
    reading: Reading = AS_GUESSED
    repairs: tuple[str, ...] = ()
    digests: tuple[str | None, ...] = ()
    warnings: tuple[str, ...] = ()
    broken: bool = False
    sensors: Mapping[str, Kinematics] = field(default_factory=dict)
    inspected: tuple[Vehicle, tuple[Inspection, ...]] | None = None
    undivided: tuple[DataSet, DataSet] | None = None
    recorded: tuple[DataSet, DataSet] | None = None

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        seconds = sum(motion.duration for motion in self.fitting)
        told = "all rows, each by models made without it" if self.parts.judge == FOLDS else self.parts.judge
        judge = told if self.undivided is None else f"{told}; all rows where models are searched"
        return [
            ("logs", self.log_names),
            ("vehicle", self.vehicle.name),
            ("to fit", f"{seconds:.0f} s in {len(self.fitting)} stretches"),
            ("judged on", judge),
            *each("warnings", self.warnings),
            *each("repaired", self.repairs),
            ("notes", f"{len(self.notes)}, see .notes" if self.notes else ""),
        ]

    def whole(self, judge: str = FOLDS) -> "Inputs":
        """The same for all rows to judge, where nobody asked for a part: nothing is kept aside, and all may be fitted.

        Parameters
        ----------
        judge : `FOLDS`, whose rows are filtered when they are cut, see `in_folds`; or `ALL`
        """
        if self.undivided is None:
            return self
        weak, even = self.undivided
        if judge == ALL:
            judged = filtered(even.raw, even.notes, PAPER)
        else:
            judged = replace(self.parts.split.test, motions=even.raw, unfiltered=even.raw)
        none, empty = replace(weak, motions=()), replace(even, motions=())
        parts = Parts(Split(empty, empty, judged), judge)
        return replace(self, weak=Split(weak, none, none), parts=parts, undivided=None)

    def with_checks(self, checks: Checks) -> "Inputs":
        """The same with what the checks of the logs have to say."""
        return replace(
            self,
            notes=(*self.notes, *checks.notes),
            warnings=checks.warnings,
            broken=checks.broken,
            inspected=(self.vehicle, checks.inspections),
        )

    def in_folds(self, folds: Sequence[Fold]) -> "Inputs":
        """The same with the judged rows cut where folds begin and end, and filtered only then; see `cut`."""
        whole = self.parts.split.test
        judged = cut(whole, folds, self.vehicle)
        parts = replace(self.parts, split=replace(self.parts.split, test=judged))
        return replace(self, parts=parts, notes=(*self.notes, *judged.notes[len(whole.notes) :]))

    def mapped(self, change: Callable[[Motion], Motion]) -> "Inputs":
        """The same with every motion changed, filtered and unfiltered alike."""
        weak, parts = (
            Split(*(data.mapped(change) for data in (split.train, split.validation, split.test)))
            for split in (self.weak, self.parts.split)
        )
        return replace(self, weak=weak, parts=replace(self.parts, split=parts))

    def leaving(self, left: Collection[str]) -> "Inputs":
        """The same with some errors of the sensors left in the motions.

        Parameters
        ----------
        left : names of the corrections that are not made, as `correction_name` has them
        """
        if not left or self.recorded is None:
            return self
        weak, even = corrected(self.recorded, self.sensors, left)
        if self.parts.judge in WHOLE:
            return replace(self, undivided=(weak, even)).whole(self.parts.judge)
        undivided = None if self.undivided is None else (weak, even)
        return replace(self, weak=split(weak), parts=Parts(split(even, PAPER), self.parts.judge), undivided=undivided)

    def parted(self, verb: str, *, fits: bool = True) -> "Inputs":
        """Itself, for a verb that judges one model on a part of the logs.

        Parameters
        ----------
        fits : whether it fits that model to the rest of them, which there must be then

        Raises
        ------
        RequestError
            when folds are to judge, each of which needs a model of its own; when all rows are, and the verb `fits`.
        """
        judge = self.parts.judge
        if judge == FOLDS or (fits and judge == ALL):
            raise RequestError(
                f"{verb}: expected a part of the logs to judge on (test), got {judge}, where all rows judge; leave "
                "judge out in read_inputs"
            )
        return self

    @property
    def inspections(self) -> tuple[Inspection, ...]:
        """Of each log, for this vehicle; where they were made for another, the logs are read again."""
        if self.inspected is not None and self.inspected[0] == self.vehicle:
            return self.inspected[1]
        return tuple(inspect_log(read_as_wanted(p, self.reading, self.vehicle), self.vehicle) for p in self.paths)

    @property
    def fitting(self) -> tuple[Motion, ...]:
        """Unfiltered motions that may be fitted: never those of a test part; all of them where all judge."""
        return (*self.weak.train.motions, *self.weak.validation.motions)

    @property
    def log_names(self) -> str:
        """Names of the logs' files, for a sentence."""
        return ", ".join(Path(path).name for path in self.paths)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the command columns."""
        return tuple(t.channel for t in self.vehicle.thrusters)


def correction_name(error: str, source: str, sources: Collection[str]) -> str:
    """How the correction of an error is called, and which log is meant where there are several.

    Examples
    --------
    >>> correction_name("gyro_scale", "a/one.csv", ["a/one.csv"])
    'gyro_scale'
    >>> correction_name("gyro_scale", "a/one.csv", ["a/one.csv", "a/two.csv"])
    'gyro_scale[one.csv]'
    """
    return error if len(sources) < 2 else f"{error}[{Path(source).name}]"


def corrected(
    recorded: tuple[DataSet, DataSet], sensors: Mapping[str, Kinematics], left: Collection[str] = ()
) -> tuple[DataSet, DataSet]:
    """Motions as right sensors would have measured them, as far as the records of each log tell of their errors.

    Parameters
    ----------
    recorded : as they were measured
    sensors : what the records say, by the source of the motions
    left : names of the corrections that are not made, see `correction_name`
    """
    errors = {
        source: known.errors_but([e for e in known.sentences if correction_name(e, source, sensors) in left])
        for source, known in sensors.items()
    }
    weak, even = (data.mapped(lambda m: corrected_for(m, errors.get(m.source, {}))) for data in recorded)
    return weak, even
