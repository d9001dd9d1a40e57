"""What a run folder holds beside the findings: comparison, audit and how it was made, as their files have them."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import ConfigDict, Field

from ..discovery.findings import FailingPlace
from ..physics.file_records import Flag, Number, Record, Whole, absent
from ..physics.presentation import Card, each, from_above, listing
from ..residuals.models.band_record import PredictionBand
from ..residuals.scores import AccelerationRecord, ByAxis, Rollouts
from ..residuals.series import HeldPredictions
from .differences import PairedRecord
from .failing.failures import Structure

if TYPE_CHECKING:
    from ..reports.page.figures.record_plots import ComparisonPlots

NOMINAL, CALIBRATED, CORRECTED = "nominal", "calibrated", "corrected"
"""Names of the models of a run: the one that was given, with its own numbers fitted, and with what was missing."""


class Amount(Record):
    """A number with its unit."""

    value: Number | None = None
    unit: str = ""


class WorstCase(Amount):
    """The value nearest to breaking a law, or beyond, and the state in which it was found."""

    at: Mapping[str, Number] = {}


class RulingRecord(Record):
    """What one law says of a model, as `physics.laws.audit` rules; whatever else it says is kept."""

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
    """What all laws say of a model, the envelope [m/s, m/s, rad/s] in which they were asked, and where it came from."""

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
    """How a run was made: the command that makes it again, seed, versions of packages, and logs.

    `refit` says that the model's own numbers were fitted beside the effects.
    """

    SCHEMA: ClassVar[str] = "undertow.run/1"

    command: str = ""
    seed: Whole | None = None
    refit: Flag = False
    versions: Mapping[str, str] = {}
    log_sha256: tuple[LogDigest, ...] = ()


class Best(Record):
    """The model to trust, and why.

    Attributes
    ----------
    model : the one to trust; empty where none is
    sentence : which, and why
    saved : share of the nominal model's error that it saves in what decides; None where there is no such model
    horizon : of the predictions that decide [s]; empty where these are too few
    """

    model: str = ""
    sentence: str = ""
    saved: Number | None = None
    horizon: str = ""


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
    """What of the judged rows the interval of a model's acceleration holds, within and beyond what it has seen.

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
    held : the predictions here that lie in the band of the run that it comes from; None where it comes from none
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
        drawn: ComparisonPlots = from_above(self.DRAWN_BY)(self)
        return drawn

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        return [
            *each("warnings", self.warnings),
            ("judged on", self.split),
            ("gets worse", listing([one.in_words for one in self.worsened])),
            ("trust", self.best.sentence.removeprefix("Trust ")),
            ("models", ", ".join(model.name for model in self.models)),
        ]
