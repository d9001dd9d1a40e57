"""Findings on one effect, as files hold them: verdict, doubts, numbers with intervals, worth, look-alikes, folds."""

import math
from collections.abc import Mapping, Sequence
from typing import Literal, get_args

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from ..measurements.preparation.split import Fold
from ..physics.effects import BY_NAME
from ..physics.errors import RequestError
from ..physics.file_records import DescribedEnum, Flag, Number, Record, Whole, absent
from ..physics.motion import AXES
from ..physics.presentation import listing, number, unit_text, words
from ..physics.vehicle import Vehicle
from .candidates.candidate import Candidate
from .search.estimation import Interval
from .search.surrogates import Chance

_IN = "Not certain: "
_FORMER = {
    "doubtful_value": "file_value",
    "worse_unseen": "weak",
    "not_in_most_folds": "weak",
    "folds": "weak",
    "elsewhere": "weak",
    "untold": "weak",
    "rollouts_object": "weak",
    "mostly_doubted": "lasting_rest",
    "unjudged_rival": "look_alikes",
    "chance": "weak",
    "crowd": "lasting_rest",
    "uneven": "lasting_rest",
    "other_form": "substitute",
    "record": "sensors",
}
"""Words of earlier versions, and what stands in their place."""


class Reason(DescribedEnum):
    """The largest doubt about an effect; the value is the word that `findings.json` writes.

    Those from `FILE_VALUE` to `WEAK` are tests of a claim: each has a size, relative to the claim, that lowers its
    odds (`judgement`); none of them takes an answer back. The others say why an effect is no claim.
    """

    sentence: str
    """What is told of it: {meaning} is the catalogue's sentence, {lowered} the same with a small letter at its start,
    and {told} what the evidence adds."""
    cannot_tell: bool
    """Whether the log holds nothing that could settle it, so that no number about the effect means anything."""

    def __init__(self, word: str, sentence: str, cannot_tell: bool = False) -> None:
        super().__init__(word, sentence)
        self.cannot_tell = cannot_tell

    @classmethod
    def _missing_(cls, value: object) -> "Reason | None":
        """The member for a word of an earlier version."""
        return cls(_FORMER[value]) if isinstance(value, str) and value in _FORMER else None

    FAINT = ("faint", "{told}, but that is too near the sensor noise to name anything from. ({meaning})")
    FILE_VALUE = ("file_value", f"{_IN}{{told}}. ({{meaning}})")
    LOOK_ALIKES = ("look_alikes", "This log cannot tell it from {told}: {lowered}")
    SUBSTITUTE = ("substitute", "Perhaps only the nearest name for something else: {told}. ({meaning})")
    AT_LIMIT = ("at_limit", "Doubtful: {told}. ({meaning})")
    SENSORS = ("sensors", f"{_IN}{{told}}. ({{meaning}})")
    OUT_OF_STEP = (
        "out_of_step",
        "Doubtful: the log's channels are out of step by about {told} s, or may be, and that alone could look like it. "
        "({meaning})",
    )
    LASTING_REST = ("lasting_rest", f"{_IN}on its axis, {{told}}. ({{meaning}})")
    WEAK = ("weak", "Perhaps: {lowered} The evidence is below what undertow demands.")
    NEEDS_CHANNELS = ("needs_channels", "This log cannot tell: it needs the channels {told}. ({meaning})", True)
    UNFOUND = ("unfound", "In the model because it was asked for, but not certain: {told}. ({meaning})")
    NOT_EXCITED = (
        "not_excited",
        "This log cannot tell: it holds no manoeuvre in which it would show. ({meaning})",
        True,
    )
    UNJUDGED = (
        "unjudged",
        "This log cannot tell: rollouts, which judge a log of such noise or compass, do not show it. ({meaning})",
        True,
    )
    ABSORBED = (
        "absorbed",
        "This log cannot tell: the calibrated parameters take up what it would do. ({meaning})",
        True,
    )
    NOISE = ("noise", "This log cannot tell: what would show it is hardly more than sensor noise. ({meaning})", True)
    NOT_FOUND = ("not_found", "Looked for and not found. ({meaning})")

    def tell(self, meaning: str, told: str = "") -> str:
        """The sentence.

        Parameters
        ----------
        meaning : what the catalogue says of the effect, a sentence
        told : what the evidence adds
        """
        return self.sentence.format(meaning=meaning, lowered=f"{meaning[0].lower()}{meaning[1:]}", told=told)


Verdict = Literal["missing", "likely", "possible", "no evidence"]


def rounded_probability(probability: float) -> float:
    """A probability as it is told in whole percent: never more than it is, since verdicts begin at whole ones.

    Nor is it ever 1: nothing is certain.

    Examples
    --------
    >>> rounded_probability(0.946), rounded_probability(0.95), rounded_probability(0.9999), rounded_probability(0.002)
    (0.94, 0.95, 0.9999, 0.002)
    >>> rounded_probability(1.0) < 1.0
    True
    """
    whole = math.floor(100.0 * probability + 1e-9) / 100.0
    return whole if 0.5 <= probability < 0.99 else min(probability, math.nextafter(1.0, 0.0))


MISSING, LIKELY = 0.95, 0.8
"""Odds from which an effect is called missing, where its interval excludes the file's value, and likely; how often each
word was true is in docs/judgement.md."""


class Worth(Record):
    """Share of the nominal model's error on unseen rows that a name removes from the corrected model, 0..1.

    Attributes
    ----------
    force : of the squared force error, on the axis on which it removes most
    rollout : of the squared error of 10 s rollouts of the fitted rows, or of those that judge; None where there are
        none
    """

    force: Number
    rollout: Number | None = None


class Claim(Record):
    """Facts of a name that stands in a model: the four numbers and the sizes of the tests.

    Attributes
    ----------
    gain : held-out log-likelihood against the best model without it, its price paid
    identity : log odds against the best rival: another effect or a pair, which may stand beside it, too
    rival : that rival; empty where none came near
    worth : share of the unseen error that it removes
    null_excluded : its wide interval excludes the file's own value
    stands : the search and nine of ten resamples need it, and it is a number that a hull can have, so that the fitted
        model holds it
    tests : size of each test of `judgement`, by name, relative to the claim; what a test does not concern is not there
    """

    gain: Number
    identity: Number
    rival: str = ""
    worth: Worth
    null_excluded: Flag
    stands: Flag = True
    tests: Mapping[str, Number] = {}


class FittedTerm(Record):
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
    def in_words(self) -> str:
        """The number with its unit and interval, such as "X_uu = -12.1 N s²/m² (-12.2 to -11.9)"."""
        ends = "" if self.ci95 is None else f"({number(self.ci95.lower)} to {number(self.ci95.upper)})"
        name = self.symbol or f"{self.axis} {self.form}"
        return " ".join(filter(None, (name, "=", number(self.value), unit_text(self.unit), ends)))

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
    """One number of an effect in a part of the log, as in `FittedTerm`, with its 95 % interval."""

    where: str
    symbol: str
    value: Number
    ci95: Interval


class EffectFinding(Record):
    """The findings on one effect of the catalogue.

    Attributes
    ----------
    effect, family, equation : from the catalogue
    sentence : the finding in words, with numbers
    verdict : "missing" (from 95 % on), "likely" (from 80 %), "possible" (it may be there), "no evidence"
    reason : the largest doubt about it; None where there is none
    confidence : calibrated probability that the name is true, in worlds like those of the studies, 0..1
    claim : what is known of it; None for what stands in no model
    error_drop : held-out force error that it removes, as a share of the nominal model's, on its best axis, 0..1
    chance : how often nothing, rehearsed with this log's own noise, looked as good; None where it was not rehearsed
    parts : its numbers in the parts of the log that know them: halves, slow and fast, ahead and astern, turning
    agrees : whether they are one number; None where no part was asked
    changes : share of its force by which it changes beside `unmodelled_forces`; None where there are none
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
    claim: Claim | None = absent()
    chance: Chance | None = absent()
    parts: tuple[Part, ...] = Field(default=(), exclude_if=lambda value: not value)
    agrees: Flag | None = absent()
    changes: Number | None = absent()
    indistinguishable_from: tuple[str, ...] = ()
    terms: tuple[FittedTerm, ...] = ()

    @property
    def thrusters(self) -> tuple[str, ...]:
        """The thrusters that are meant, of an effect that concerns one; else none."""
        effect = BY_NAME.get(self.effect)
        if effect is None or not effect.per_thruster:
            return ()
        ending = effect.symbols[0].replace("{thruster}", "")
        return tuple(term.symbol.removesuffix(ending) for term in self.terms)

    @property
    def key(self) -> str:
        """The effect as `add` takes it, with its thruster."""
        return f"{self.effect}[{self.thrusters[0]}]" if self.thrusters else self.effect

    @property
    def nulls(self) -> tuple[float, ...]:
        """The value of each of its numbers at which the effect is absent: 0 of what is added, 1 of a scale."""
        effect = BY_NAME.get(self.effect)
        own = [] if effect is None or effect.added else [parameter.null for parameter in effect.parameters]
        return tuple([*own, *[0.0] * len(self.terms)][: len(self.terms)])

    @property
    def in_model(self) -> bool:
        """True when it stands in the model that is written; a file of an earlier version tells it of sure ones."""
        old = self.verdict == "missing" and self.claim is None
        return old or any(term.in_model is not None for term in self.terms)

    @property
    def rank(self) -> int:
        """Place of its verdict among all, the best first."""
        return get_args(Verdict).index(self.verdict)

    @property
    def cannot_tell(self) -> bool:
        """True when the log holds nothing that could show it, so that no number about it means anything."""
        return self.reason is not None and self.reason.cannot_tell


class FoldRecord(Record):
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
    models: tuple[FoldRecord, ...] = Field(default=(), exclude_if=lambda value: not value)

    def in_words(self, sure: bool) -> str:
        """The finding as a sentence; empty where nothing was searched for.

        Parameters
        ----------
        sure : anything stands in the corrected model, so that there are names to find again
        """
        if self.same_names is None:
            return ""
        text = f"The search was repeated {self.count} times, each time with a different part of the log left out:"
        if self.same_names == self.count and self.named:
            return f"Repeated {self.count} times without a part of the log, the search found the same names."
        some = [f"{words(key)} {_times(n)}" for key, n in self.named.items() if n]
        if not sure:
            return f"{text} it found {listing(some) or 'no name that stands'}."
        every = [f"{words(key)} {'each time' if n == self.count else _times(n)}" for key, n in self.named.items() if n]
        just = f", and just the names that stand here {_times(self.same_names)}" if self.same_names else ""
        never = [words(key) for key, n in self.named.items() if not n]
        lost = f", but never {listing(never)}" if never and every else ""
        told = listing(every) or "none of these names"
        return f"{text} it found {told}{just}{lost}. A name that hangs on one part of the log is less sure."


def _times(count: int) -> str:
    """How often.

    >>> [_times(count) for count in (0, 1, 2, 3)]
    ['never', 'once', 'twice', '3 times']
    """
    return {0: "never", 1: "once", 2: "twice"}.get(count, f"{count} times")


_AXIS_OF = {"thruster": "thrust", "environment": "all", "mass": "all", "memory": "all"}


def parameter_total(nominal: Vehicle, candidate: Candidate, vehicle: Vehicle, symbol: str) -> float:
    """A parameter's value as the findings report it: the added amount or the absolute one, as the catalogue says.

    Parameters
    ----------
    nominal, vehicle : the model before and with the effect
    candidate : the effect
    symbol : one of its parameters
    """
    return vehicle.value(symbol) - (nominal.value(symbol) if candidate.effect.added else 0.0)


def found_terms(
    candidate: Candidate, nominal: Vehicle, vehicle: Vehicle, intervals: Mapping[str, Interval]
) -> tuple[FittedTerm, ...]:
    """The numbers of an effect in a vehicle: added amounts where the catalogue counts those, else absolute values.

    Parameters
    ----------
    candidate : the effect
    nominal, vehicle : the model before and with the effect
    intervals : 95 % intervals of total values, by symbol
    """
    terms = []
    for parameter in candidate.parameters:
        symbol = parameter.symbol
        interval = intervals.get(symbol)
        shift = nominal.value(symbol) if candidate.effect.added else 0.0
        moved = None if interval is None else Interval(interval.lower - shift, interval.upper - shift)
        value = parameter_total(nominal, candidate, vehicle, symbol)
        axis = _AXIS_OF.get(candidate.effect.family, "all") if parameter.axis is None else AXES[parameter.axis]
        terms.append(
            FittedTerm(symbol=symbol, axis=axis, form=parameter.form, value=value, unit=parameter.unit, ci95=moved)
        )
    return tuple(terms)
