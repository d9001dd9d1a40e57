"""Facts of a comparison as its files have them, and the differences between models that are more than chance."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import ConfigDict, Field

from ..discovery.findings import FailingPlace, Rise
from ..measurements.statistics.blocks import Difference, paired_difference
from ..physics.file_records import DescribedEnum, Flag, Number, Record, Whole, absent
from ..physics.motion import AXES, Array
from ..physics.presentation import NARROW, Card, each, from_above, listing, percent
from ..residuals.models.band_record import PredictionBand
from ..residuals.models.base import Model
from ..residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, AccelerationRecord, ByAxis, Errors, Rollouts
from ..residuals.series import HeldPredictions
from .failing.failures import Structure

if TYPE_CHECKING:
    from ..reports.page.figures.record_plots import ComparisonPlots


NOMINAL, CALIBRATED, CORRECTED = "nominal", "calibrated", "corrected"
"""Names of the models of a run: the one that was given, with its own numbers fitted, and with what was missing."""
BASELINE = "baseline"
"""Kind of a model that knows nothing of the boat."""


class PairedRecord(Record):
    """Difference of one error between two models on the same rows, as `comparison.json` has it.

    Attributes
    ----------
    model, against : the two
    quantity : "acceleration" or "rollout"
    horizon : of the rollout [s]; None for the acceleration
    axis : of the error
    difference, relative, ci95 : model minus reference [`unit`], the same over the reference's error, and its 95 %
        interval; None where the rows are too few
    verdict : "better", "worse", "no difference" or "too short to tell"
    blocks : how many stretches the interval rests on
    """

    model: str
    against: str
    quantity: str
    horizon: str | None = None
    axis: str
    difference: Number | None = None
    relative: Number | None = None
    ci95: tuple[Number, Number] | None = None
    unit: str = ""
    verdict: str = ""
    blocks: Whole | None = None

    @property
    def in_words(self) -> str:
        """The error and the share by which it changed, as a part of a sentence."""
        what = "acceleration" if self.horizon is None else f"of {self.horizon} s predictions"
        return f"{self.axis} {what} by {percent(abs(self.relative or 0.0))}"


ROLLED = (*AXES, "position")
"""What the columns of the squared errors of rollouts are."""


def differences(models: Sequence[tuple[Model, Errors]], references: Sequence[str]) -> list[PairedRecord]:
    """Every model against each reference that stands before it, baselines against the first model only.

    Entries are as `comparison.json` has them.
    """
    result = []
    for k, (model, errors) in enumerate(models):
        for other, base in models[: 1 if model.kind == BASELINE else k]:
            if k > 0 and other.name in references:
                result += _against(model.name, errors, other.name, base)
    return result


def rises(errors: Errors, before: Errors) -> tuple[Rise, ...]:
    """Errors that are larger than those before on the same rows, by more than chance."""
    found = []
    for told in _against("", errors, "", before):
        if told.verdict == "worse":
            ends = [_error_of(one, told.horizon).of(told.axis) for one in (before, errors)]
            found.append(Rise(horizon=told.horizon, axis=told.axis, before=ends[0], after=ends[1], unit=told.unit))
    return tuple(found)


def _error_of(errors: Errors, horizon: str | None) -> ByAxis:
    """Root mean square errors of the predictions over a horizon; of the acceleration without one."""
    return errors.acceleration_score.record.rmse if horizon is None else errors.rollout_scores[horizon].record


def _against(name: str, errors: Errors, other: str, base: Errors) -> list[PairedRecord]:
    told = []

    def tell(done: Difference, **which: str) -> None:
        found = {key: getattr(done, key) for key in ("difference", "relative", "ci95", "verdict", "blocks")}
        told.append(PairedRecord(model=name, against=other, **which, **found))

    for axis, ours, theirs in zip(AXES, squares(errors).T, squares(base).T, strict=True):
        tell(paired_difference(ours, theirs), quantity="acceleration", axis=axis, unit=ACCELERATION_UNITS[axis])
    for horizon in errors.rollouts:
        shortest = rows_of(errors, horizon)
        for axis, ours, theirs in zip(ROLLED, rolled(errors, horizon).T, rolled(base, horizon).T, strict=True):
            done = paired_difference(ours, theirs, shortest)
            tell(done, quantity="rollout", horizon=horizon, axis=axis, unit=ROLLOUT_UNITS[axis])
    return told


def squares(errors: Errors) -> Array:
    """Squared errors of the acceleration on all rows (n, 3)."""
    return np.square(np.concatenate(errors.acceleration))


def rolled(errors: Errors, horizon: str) -> Array:
    """Mean squared errors of all rollouts over a horizon (starts, 4)."""
    return np.concatenate(errors.rollouts[horizon].squares)


def rows_of(errors: Errors, horizon: str) -> int:
    """Number of starts within one horizon: rollouts from them share rows."""
    return max(1, round(float(horizon) / min(errors.rollouts[horizon].spacing)))


class Amount(Record):
    """A number with its unit."""

    value: Number | None = None
    unit: str = ""


class WorstCase(Amount):
    """The value nearest to breaking a law, or beyond, and the state in which it was found."""

    at: Mapping[str, Number] = {}


class RulingRecord(Record):
    """Ruling of one law on a model, as `physics.laws.audit` has it; whatever else it says is kept."""

    model_config = ConfigDict(extra="allow")

    law: str
    verdict: str
    counts: Flag = True
    violating_share: Number | None = None
    proof: str | None = None
    worst: WorstCase | None = None
    margin: Amount | None = None
    sentence: str = ""

    @property
    def outcome(self) -> str:
        """The verdict in one word; a broken law that does not count is noted."""
        return "noted" if self.verdict == "fail" and not self.counts else self.verdict


class AuditRecord(Record):
    """Rulings of all laws on a model, the envelope [m/s, m/s, rad/s] in which they were asked, and its origin."""

    SCHEMA: ClassVar[str] = "undertow.audit/1"

    model: str = ""
    verdict: str = ""
    envelope: Mapping[str, tuple[Number, Number]] = {}
    envelope_from: str = "the envelope"
    units: Mapping[str, str] = {}
    laws: tuple[RulingRecord, ...]
    notes: tuple[str, ...] = ()


class LogDigest(Record):
    """A log and its SHA-256; None for one that was not there any more."""

    path: str
    sha256: str | None = None


class MadeFrom(Record):
    """Provenance of a run: the command that makes it again, seed, versions of packages, and logs.

    `refit` says that the model's own numbers were fitted beside the effects.
    """

    SCHEMA: ClassVar[str] = "undertow.run/1"

    command: str = ""
    seed: Whole | None = None
    refit: Flag = False
    versions: Mapping[str, str] = {}
    log_sha256: tuple[LogDigest, ...] = ()


class Grounds(DescribedEnum):
    """Why a model is trusted, or none is."""

    BETTER = "better", "it errs less than the nominal model, by more than chance"
    NONE_BETTER = "none better", "no model that keeps the laws errs less by more than chance"
    LAWFUL = "lawful", "a model that errs less breaks a law"
    CHANCE = "chance", "another model errs less, which may be chance"
    GUESS = "guess", "a guess that knows nothing of the boat errs less than every model that keeps the laws"
    TOO_FEW = "too few", "the judged rows are too few to tell models apart"


class Margin(Record):
    """How the error of a model differs from that of another in what decides, all speeds together.

    Sensor noise is no model's error and is left out.

    Attributes
    ----------
    model, against : the two
    relative : error of the model over that of the other, less one: negative where it errs less
    ci95 : 95 % interval of it; None where the rows are too few
    verdict : see `PairedRecord`
    """

    model: str
    against: str
    relative: Number
    ci95: tuple[Number, Number] | None = None
    verdict: str = ""

    @property
    def size(self) -> str:
        """By how much the model errs less or more."""
        return _less_or_more(self.relative)

    @property
    def doubt(self) -> str:
        """The interval, with its sides named where they differ; empty where there is none."""
        if self.ci95 is None:
            return ""
        low, high = self.ci95
        if low * high <= 0.0 or low * self.relative <= 0.0:
            return f"{_less_or_more(low)} to {_less_or_more(high)}"
        near, far = sorted((abs(low), abs(high)))
        return f"{percent(near).removesuffix(f'{NARROW}%')} to {percent(far)}"

    @property
    def in_words(self) -> str:
        """By how much the model errs less or more than the other, and the interval."""
        return f"{self.size} than {self.against}{f' ({self.doubt})' if self.doubt else ''}"


def _less_or_more(share: float) -> str:
    return f"{percent(abs(share))} {'less' if share < 0.0 else 'more'}"


class Best(Record):
    """The model to trust, and why.

    Attributes
    ----------
    model : the one to trust; empty where none is
    grounds : why; None in files of earlier versions
    sentence : both in words
    margins : each model against the nominal one
    guess : the model to trust, or the best where none is, against the best guess that knows nothing of the boat
    horizon : of the predictions that decide [s]; empty where these are too few
    """

    model: str = ""
    grounds: Grounds | None = None
    sentence: str = ""
    margins: tuple[Margin, ...] = ()
    guess: Margin | None = None
    horizon: str = ""

    @property
    def saved(self) -> float | None:
        """Share of the nominal model's error that the model to trust saves; None where none is, or the nominal one."""
        return next((-margin.relative for margin in self.margins if margin.model == self.model), None)


class Side(Record):
    """One-step error on some of the judged rows, and how many these are."""

    rows: Whole = 0
    rmse: ByAxis | None = None


class Domain(Record):
    """The error on the rows with speeds and thrusts that the training part spans, and on the others."""

    inside: Side = Side()
    outside: Side = Side()


class Held(Record):
    """On some of the judged rows, the share that an interval holds on each axis, and half its mean width."""

    rows: Whole = 0
    share: ByAxis | None = None
    margin: ByAxis | None = None


class IntervalRecord(Record):
    """Coverage of the judged rows by the interval of a model's acceleration, within and beyond what it has seen.

    `level` is the share that it is to hold.
    """

    level: Number
    inside: Held = Held()
    outside: Held = Held()


class ComparedModel(Record):
    """A model on the judged rows.

    Attributes
    ----------
    name, kind : as the model has them
    acceleration : one-step errors
    rollout : errors of open-loop predictions, by horizon [s]
    domain : the error by what the training part spans; None where that was not asked
    interval : what its interval of the acceleration holds; None of a model that tells none
    audit, laws : what the laws say, in a word and one by one; none for a baseline
    parameters : how many numbers were fitted
    seconds_to_fit, seconds_to_evaluate : wall times [s]; None where nobody took them
    fitted_here : it was fitted to rows that are judged, so that its errors are too small
    band : 95 % band of its predictions; of the model that is drawn alone
    held : the predictions here that lie in the band of its run or its own file; None where neither has one
    """

    name: str
    kind: str = ""
    acceleration: AccelerationRecord = AccelerationRecord()
    rollout: Rollouts = Field(default_factory=dict)
    units: Mapping[str, Mapping[str, str]] = {}
    domain: Domain | None = None
    interval: IntervalRecord | None = None
    audit: str = "not run"
    laws: tuple[RulingRecord, ...] = ()
    parameters: Whole | None = None
    seconds_to_fit: Number | None = None
    seconds_to_evaluate: Number | None = None
    fitted_here: Flag = False
    band: PredictionBand | None = absent()
    held: HeldPredictions | None = absent()


class Comparison(Card, Record):
    """All models on the same rows.

    Attributes
    ----------
    split : the part that judges, or "all"
    logs : their paths
    warnings : what is wrong with the logs
    best : the model to trust
    models : the nominal one first
    differences : which differences are more than chance
    failures, structure : where and how the first and the last model fail
    notes : what a reader must know of the comparison
    noise : sensor noise on the judged speeds, root mean square: it is in every model's errors, and not in the verdict
    """

    SCHEMA: ClassVar[str] = "undertow.comparison/1"
    DRAWN_BY: ClassVar[str] = "reports.page.figures.record_plots:ComparisonPlots"

    split: str = "held-out"
    logs: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    best: Best = Best()
    models: tuple[ComparedModel, ...]
    differences: tuple[PairedRecord, ...] = ()
    failures: tuple[FailingPlace, ...] = ()
    structure: tuple[Structure, ...] = ()
    notes: tuple[str, ...] = ()
    noise: ByAxis | None = None

    @property
    def worsened(self) -> tuple[PairedRecord, ...]:
        """Errors that are larger with the corrected model of a run than with the nominal one, by more than chance."""
        ends = (CORRECTED, NOMINAL)
        return tuple(d for d in self.differences if (d.model, d.against) == ends and d.verdict == "worse")

    @property
    def plot(self) -> "ComparisonPlots":
        """Plots of it, as matplotlib axes."""
        return from_above(self.DRAWN_BY)(self)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        return [
            *each("warnings", self.warnings),
            ("judged on", self.split),
            ("gets worse", listing([one.in_words for one in self.worsened])),
            ("trust", self.best.sentence.removeprefix("Trust ")),
            ("models", ", ".join(model.name for model in self.models)),
        ]
