"""Prepared logs, which every verb works on: read once for a vehicle, repaired, corrected, and the part that judges."""

import gzip
import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..physics.errors import RequestError, one_line
from ..physics.files import on_top, write_bytes
from ..physics.motion import Motion
from ..physics.presentation import Card, each
from ..physics.vehicle import Vehicle
from .inspection import Inspection, examine, inspect_log
from .kinematics import Kinematics, corrected_for
from .log import REPAIRED, Log, read_log
from .log_options import AS_GUESSED, Reading
from .preparation.prepare import PAPER, DataSet, filtered
from .preparation.split import Fold, Split, cut, split

VERB = "inspect --fix"
_PART = 1 << 16
"""Rows that are written together; all at once, the rows of a long log would take gigabytes."""


def repair(
    log: Log, vehicle: Vehicle | None = None, *, progress: Callable[[int, int], None] | None = None
) -> tuple[Log, str]:
    """Make the safe repairs of a log in memory, those that `inspect --fix` writes.

    Parameters
    ----------
    vehicle : whose thrusters the commands must agree with
    progress : see `examine`

    Returns
    -------
    (the repaired log, what was done to it) : Log, str
        Its first note says so, too.
    """
    examination = examine(log, vehicle, progress=progress)
    clean, done = examination.clean, "; ".join(examination.fixes) or "nothing had to be put right"
    return replace(clean, notes=(f"repaired in memory: {done}", *clean.notes)), done


def read_as_wanted(path: str, reading: Reading, vehicle: Vehicle | None = None) -> Log:
    """Read a log, and repair it where the reading says so."""
    log = read_log(path, reading, mend=reading.fix)
    return repair(log, vehicle)[0] if reading.fix else log


def check_target(out: Path, logs: Sequence[Path]) -> None:
    """Refuse a file that is one of the logs read, or that cannot be written.

    Raises
    ------
    RequestError
        for an input, another ending than .csv or .csv.gz, a folder, or a folder that is not there.
    """
    if any(out.exists() and log.exists() and out.samefile(log) for log in logs):
        raise RequestError(f"--fix {out} is the log that is read; give another name, so that the raw log is kept")
    if not out.name.endswith((".csv", ".csv.gz")):
        raise RequestError(f"--fix {out}: expected a name that ends in .csv or .csv.gz")
    if out.is_dir():
        raise RequestError(f"cannot write {out}: it is a folder; give the name of a file")
    if not out.parent.is_dir():
        raise RequestError(f"cannot write {out}: the folder {out.parent} does not exist; create it first")


def write_clean(log: Log, fixes: Sequence[str], left: Sequence[str], out: str | os.PathLike[str]) -> Path:
    """Write a log: a row per stamp where all channels share their stamps, a long table otherwise.

    The first lines are remarks, `# ...`: what was fixed, what was not, and what reading the raw log had to assume.
    `read_log` gives them back as notes. Time is that of the log, in nanoseconds where it counts from 1970. The same log
    gives the same bytes.

    Parameters
    ----------
    log : as repaired
    fixes, left : what was done to it, and what is still wrong with it, as sentences
    out : .csv or .csv.gz

    Raises
    ------
    RequestError
        see `check_target`.
    """
    target = Path(out)
    check_target(target, [log.path])
    done = [f"fixed: {fix}" for fix in fixes] or ["nothing had to be fixed"]
    wrong = [f"not fixed: {sentence}" for sentence in left]
    remarks = [f"{REPAIRED} {log.name}", *done, *wrong, *log.notes]
    head = "".join(f"# {one_line(' '.join(remark.split()))}\n" for remark in remarks)
    data = on_top(VERB, "".join((head, *_table(log)))).encode("utf-8")
    return write_bytes(target, gzip.compress(data, mtime=0) if target.suffix == ".gz" else data)


def _table(log: Log) -> Iterator[str]:
    """Give the table part by part, numbers with as many digits as they need to be read back the same."""
    channels = list(log.channels.values())
    time, start = channels[0].time, log.start_ns
    names = [channel.name for channel in channels]

    def stamp(t: float) -> str:
        return str(start + round(1e9 * t)) if start else repr(round(t, 9))

    if all(np.array_equal(channel.time, time) for channel in channels):
        yield f"{'timestamp_ns' if start else 't'},{','.join(names)}\n"
        for at in range(0, time.size, _PART):
            rows = np.column_stack([channel.value[at : at + _PART] for channel in channels]).tolist()
            stamps = time[at : at + _PART].tolist()
            yield "".join(f"{stamp(t)},{','.join(map(repr, row))}\n" for t, row in zip(stamps, rows, strict=True))
        return
    yield f"{'timestamp_ns' if start else 'time'},topic,field,value\n"
    every, values = (np.concatenate([getattr(c, part) for c in channels]) for part in ("time", "value"))
    which = np.repeat(np.arange(len(channels)), [channel.time.size for channel in channels])
    order = np.argsort(every, kind="stable")
    for at in range(0, order.size, _PART):
        part = order[at : at + _PART]
        rows = zip(every[part].tolist(), which[part].tolist(), values[part].tolist(), strict=True)
        yield "".join(f"{stamp(t)},fixed,{names[k]},{x!r}\n" for t, k, x in rows)


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
        return getattr(self.split, part)

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

    def within(self, part: Callable[[Motion], tuple[Motion, ...]]) -> "Inputs":
        """The same of some rows alone, those pieces of each motion that `part` gives, before a part of them judges."""
        ways = (
            None if both is None else (both[0].within(part), both[1].within(part))
            for both in (self.undivided, self.recorded)
        )
        undivided, recorded = ways
        if undivided is not None:
            weak, even = undivided
            parts = Parts(split(even, PAPER), self.parts.judge)
            return replace(self, weak=split(weak), parts=parts, undivided=undivided, recorded=recorded)
        whole, judged = self.weak.train, self.parts.split.test
        parts = replace(self.parts, split=replace(self.parts.split, test=judged.within(part)))
        return replace(self, weak=replace(self.weak, train=whole.within(part)), parts=parts, recorded=recorded)

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
