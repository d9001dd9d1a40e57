"""Findings: which effects are missing, how sure that is, and what each is worth, as `findings.json` holds them."""

from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, Literal, get_args

from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    WrapSerializer,
    computed_field,
    model_serializer,
)

from ..measurements.preparation.held_out import Fold
from ..physics.errors import RequestError
from ..physics.file_records import Flag, Number, Record, Whole, absent
from ..physics.frames import AXES
from ..physics.in_words import listing, words
from ..residuals.scores import ByAxis, RolloutRecord, Rollouts
from .identifiability.visible import Identifiability
from .lawful.price_of_law import Passivity
from .reason import Reason
from .search.bootstrap import Interval
from .search.chance import Chance

Verdict = Literal["missing", "possible", "no evidence"]

_EMPTY = (
    BeforeValidator(lambda content: content or None),
    WrapSerializer(lambda value, handler: handler(value) or {}),
)
"""What was not asked is an empty object in the file."""


class FoundTerm(Record):
    """One number of a candidate: its symbol, place in the equation, value [unit] and 95 % interval.

    `value` is what the log asks for, under the limits of this number alone; `in_model` is what the corrected model has,
    which the law of dissipation may hold at another value, and None where the candidate is not added. `inclusion` is
    the share of block ensembles in which sparse selection takes a term that nobody has named; None for named ones.
    """

    symbol: str = ""
    axis: str = ""
    form: str = ""
    value: Number
    unit: str = ""
    ci95: Interval | None = None
    in_model: Number | None = None
    inclusion: Number | None = None

    @property
    def moved(self) -> bool:
        """True when the law moved it by more than a hundredth."""
        return self.in_model is not None and abs(self.in_model - self.value) > 0.01 * abs(self.value)

    @model_serializer(mode="wrap")
    def _named_or_not(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        """A term without a name has its inclusion, any other its value in the model."""
        content: dict[str, object] = handler(self)
        content.pop("inclusion" if self.inclusion is None else "in_model", None)
        return content


class Part(Record):
    """One number of an effect in a part of the log, as in `FoundTerm`, with its 95 % interval."""

    where: str
    symbol: str
    value: Number
    ci95: Interval


class FoundEffect(Record):
    """The findings on one effect of the catalogue.

    Attributes
    ----------
    effect, family, equation : from the catalogue
    sentence : the finding in words, with numbers
    verdict : "missing" (the tool would add it), "possible" (it may be there, this log cannot tell), "no evidence"
    reason : why it is not called missing; None where it is
    confidence : share of block resamples in which it earns its price and is material, divided among it and its
        look-alikes, 0..1
    error_drop : held-out force error that it removes, as a share of the nominal model's, on its best axis, 0..1
    chance : how often nothing, rehearsed with this log's own noise, looked as good; None where it was not rehearsed
    parts : its numbers in the parts of the log that know them: halves, slow and fast, ahead and astern, turning
    agrees : whether they are one number; None where no part was asked
    changes : share of its force by which it changes beside `other_forms`; None where there are none
    indistinguishable_from : effects that would explain this log as well
    terms : its numbers
    """

    effect: str
    sentence: str = ""
    family: str = ""
    equation: str = ""
    verdict: Verdict
    reason: Reason | None = None
    confidence: Number
    error_drop: Number
    chance: Chance | None = absent()
    parts: tuple[Part, ...] = Field(default=(), exclude_if=lambda value: not value)
    agrees: Flag | None = absent()
    changes: Number | None = absent()
    indistinguishable_from: tuple[str, ...] = ()
    terms: tuple[FoundTerm, ...] = ()

    @property
    def rank(self) -> int:
        """Place of its verdict among all, the best first."""
        return get_args(Verdict).index(self.verdict)

    @property
    def cannot_tell(self) -> bool:
        """Whether the log holds nothing that could show it, so that no number about it means anything."""
        return self.reason is not None and self.reason.cannot_tell


class SensorError(Record):
    """What a sensor, or the log's record of one, does wrong: the vehicle stays as it is.

    Attributes
    ----------
    error : "channel_offset" for commands, speeds or positions that are recorded early or late; the others say what
        they are of: a scale, a bias, a compass deviation, a record through the water, an antenna that is elsewhere
    verdict : "present", "possible" or "no evidence"
    sentence : the finding in words
    terms : its numbers
    """

    error: Literal[
        "compass_deviation",
        "gyro_scale",
        "gyro_bias",
        "velocity_scale",
        "velocity_latency",
        "antenna_arm",
        "water_speed",
        "channel_offset",
    ]
    verdict: Literal["present", "possible", "no evidence"]
    sentence: str = ""
    terms: tuple[FoundTerm, ...] = ()


class Calibrated(Record):
    """One parameter before and after.

    Attributes
    ----------
    symbol, unit : name and SI unit
    before, after : values
    wanted : what the log alone asks for; differs from `after` where the law of dissipation holds the parameter
    ci95 : 95 % interval about `wanted`, cut at the physical limits; None for a parameter that moves in steps, or that
        the log alone puts at a limit
    at_limit : True where it does
    """

    symbol: str
    before: Number
    after: Number
    wanted: Number
    unit: str
    ci95: Interval | None = None
    at_limit: Flag = False

    @computed_field
    @property
    def held_by_law(self) -> bool:
        """True when the law holds the parameter outside its interval."""
        return self.ci95 is not None and not self.ci95.lower <= self.after <= self.ci95.upper


class Left(Record):
    """A parameter that was to be calibrated and stays as it was, and why."""

    symbol: str
    why: str


class Advice(Record):
    """A manoeuvre that would tell what a log cannot, and what it would tell."""

    manoeuvre: str
    why: str = ""


class Step(Record):
    """Errors on held-out data after something was added.

    Attributes
    ----------
    added : the effect, or the term; "calibrated" for the calibration; None for the nominal model
    thruster : the one that the effect concerns; None for an effect of all
    acceleration_rmse : root mean square error of the acceleration
    rollout_rmse : of open-loop predictions, by horizon [s]
    """

    added: str | None = None
    thruster: str | None = absent()
    acceleration_rmse: ByAxis
    rollout_rmse: Rollouts
    units: Mapping[str, Mapping[str, str]] = {}

    def rollout(self, horizon: str) -> RolloutRecord:
        """The errors of one horizon; all NaN where there is none."""
        return self.rollout_rmse.get(horizon) or RolloutRecord()


class Removal(Record):
    """An effect that removes the error of a place, and the share of the squared error there that it removes."""

    effect: str
    share_removed: Number
    sentence: str = ""


class FailingPlace(Record):
    """A place in a log where a model's error gathers.

    Attributes
    ----------
    model : whose error
    where : the place in words
    axis : of the error
    share_of_error, share_of_rows : of the squared error on the axis, and of the rows, that lie there
    rmse : root mean square error there [`unit`]
    rows_of : the part of the log that was looked at
    rmse_after : the same of the corrected model, where that was asked
    removed_by : effects that remove the error
    unlinked : why none is named, although it falls
    """

    model: str = "nominal"
    where: str = ""
    axis: str = ""
    share_of_error: Number
    share_of_rows: Number | None = absent()
    rows: Whole | None = absent()
    rmse: Number | None = absent()
    unit: str = ""
    rows_of: str | None = absent()
    rmse_after: Number | None = absent()
    removed_by: tuple[Removal, ...] = ()
    unlinked: str | None = absent()


class Criterion(Record):
    """What an effect had to satisfy, and the force at work on each axis [`unit`], of which shares are taken."""

    materiality: Number | None = None
    certainty: str = ""
    material: str = ""
    rollouts: str = ""
    unit: Mapping[str, str] = {}
    force_scale: Mapping[str, Number] = {}
    search: str = ""


class Unexplained(Record):
    """Force that the corrected model leaves on an axis, beside what sensor noise alone would leave [`unit`]."""

    force: Number
    noise: Number
    unit: str


class LastingRest(Record):
    """Force on an axis that lasts for seconds, is material, and that nothing explains.

    Attributes
    ----------
    axis : its name
    force : root mean square of its means over 5 s [`unit`]
    share : the same as a share of the force at work
    unit : of the force
    """

    axis: str
    force: Number
    share: Number
    unit: str

    @property
    def in_words(self) -> str:
        """The finding, as a part of a sentence."""
        return (
            f"{self.force:.2g} {self.unit} of the {self.axis} force at work, {100.0 * self.share:.0f} % of it, last "
            "for seconds and are explained by nothing that was looked for"
        )


class OtherForm(Record):
    """Force on an axis that follows a signal, and that nothing which was selected explains.

    Attributes
    ----------
    axis : its name
    follows : the signal, as the end of "a force that follows"; nothing for a constant force
    force : root mean square of what it explains beside the model [`unit`]
    share : the same as a share of the force at work
    unit : of the force
    """

    axis: str
    follows: str
    force: Number
    share: Number
    unit: str

    @property
    def in_words(self) -> str:
        """The form, as a part of a sentence."""
        what = f"{'a moment' if self.unit == 'N m' else 'a force'} in {self.axis}"
        return f"{what} that follows {self.follows}" if self.follows else f"{what} that is constant"


class FoldModel(Record):
    """A fold, and the numbers of the corrected model that was selected and fitted without it.

    Attributes
    ----------
    stretches : number of the log, begin and end [s] of each stretch of the fold
    values : what differs from the nominal model, by symbol, in the units of the vehicle file
    """

    stretches: tuple[tuple[Whole, Number, Number], ...]
    values: Mapping[str, Number] = {}

    def fold(self, sources: Sequence[str]) -> Fold:
        """The fold of logs by their sources.

        Raises
        ------
        RequestError
            when there are fewer logs.
        """
        if any(number >= len(sources) for number, _, _ in self.stretches):
            raise RequestError(f"a fold is of a log beyond the {len(sources)} of the run; run 'undertow discover' anew")
        return Fold(tuple((sources[number], begin, end) for number, begin, end in self.stretches))


class Folds(Record):
    """In how many folds, each searched anew without it, the same names came out.

    Attributes
    ----------
    count : how many folds there were
    same_names : in how many the very effects came out that the corrected model has; None where somebody chose them
    named : in how many each effect came out (`thruster_asymmetry[port]` for one of a thruster)
    models : the model without each fold; none where a part of the log was kept aside
    """

    count: Whole
    same_names: Whole | None = absent()
    named: Mapping[str, Whole] = {}
    models: tuple[FoldModel, ...] = Field(default=(), exclude_if=lambda value: not value)

    def doubts(self, kept: Sequence[str]) -> dict[str, str]:
        """Why each effect is not certain that comes out of fewer than half of the folds, by key."""
        return {
            key: f"searched anew without each of {self.count} parts of the log, it comes out of {self.named[key]} only"
            for key in kept
            if 2 * self.named[key] < self.count
        }

    @property
    def in_words(self) -> str:
        """The finding as a sentence; empty where nothing was searched for."""
        if self.same_names is None:
            return ""
        told = f"Searched anew without each of its {self.count} parts, the log gives the same names"
        if self.same_names == self.count:
            return f"{told} every time."
        others = [f"{words(key)} in {n}" for key, n in self.named.items() if n < self.count]
        return f"{told} in {self.same_names} of {self.count}{f' ({listing(others)})' if others else ''}."


class LogFacts(Record):
    """What was looked at: rows, length [s], how it was split, what stays unexplained by axis, and notes."""

    rows: Whole | None = None
    seconds: Number | None = None
    split: str = ""
    unexplained: Mapping[str, Unexplained] = Field(default={}, exclude_if=lambda value: not value)
    notes: tuple[str, ...] = ()


class Findings(Record):
    """What discovery concludes from a log.

    Attributes
    ----------
    verdict : "missing", "nothing missing" or "undecided"
    warnings : what is wrong with the log itself, to be read before the headline
    headline : the verdict in a sentence
    missing : effects that the tool would add, the most valuable first
    candidates : every effect of the catalogue, best first
    unnamed : terms that nobody has named but the log asks for
    sensors : what the sensors and their record do wrong
    rests : force that lasts and that nothing explains, by axis: what acts there is not called missing
    other_forms : what the rest of the model follows, looked for where an effect would be named
    calibrated : parameters of the nominal model that were calibrated while effects were judged (`discover --refit`)
    left : others that were not
    absorbed : effects that cannot be judged beside the calibration, which would do the same
    steps : errors after each addition, on held-out data only
    folds : in how many parts of the log, each searched anew without it, the same names came out
    failures : where the nominal model fails
    advice : manoeuvres that would tell what this log cannot
    identifiability : what the log can show and tell apart; None where that was not asked
    criterion : what an effect had to satisfy
    passivity : whether the corrected model dissipates over the envelope of the log, and what that cost
    data : rows, seconds, split and notes
    """

    SCHEMA: ClassVar[str] = "undertow.findings/1"

    verdict: Literal["missing", "nothing missing", "undecided"]
    warnings: tuple[str, ...] = ()
    headline: str = ""
    missing: tuple[str, ...]
    candidates: tuple[FoundEffect, ...]
    unnamed: tuple[FoundTerm, ...] = ()
    sensors: tuple[SensorError, ...] = ()
    rests: tuple[LastingRest, ...] = ()
    other_forms: tuple[OtherForm, ...] = ()
    calibrated: tuple[Calibrated, ...] = ()
    left: tuple[Left, ...] = ()
    absorbed: tuple[str, ...] = ()
    steps: tuple[Step, ...] = ()
    folds: Folds | None = absent()
    failures: tuple[FailingPlace, ...] = ()
    advice: tuple[Advice, ...] = ()
    identifiability: Annotated[Identifiability | None, *_EMPTY] = None
    criterion: Criterion = Criterion()
    passivity: Annotated[Passivity | None, *_EMPTY] = None
    data: LogFacts = LogFacts()


def axis_name(index: int | None, default: str) -> str:
    """Name of an axis by index; the default where a parameter acts on more than one."""
    return default if index is None else AXES[index]
