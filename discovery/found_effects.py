"""What is found of one effect: its verdict and why, its numbers with their intervals, and what would do as well."""

from typing import Literal, get_args

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from ..physics.effects import BY_NAME
from ..physics.file_records import Flag, Number, Record, absent
from .reason import Reason
from .search.bootstrap import Interval
from .search.chance import Chance

Verdict = Literal["missing", "possible", "no evidence"]


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
    def in_model(self) -> bool:
        """Whether it stands in the corrected model, sure or not; a file of an earlier version tells it of sure ones."""
        return self.verdict == "missing" or any(term.in_model is not None for term in self.terms)

    @property
    def rank(self) -> int:
        """Place of its verdict among all, the best first."""
        return get_args(Verdict).index(self.verdict)

    @property
    def cannot_tell(self) -> bool:
        """Whether the log holds nothing that could show it, so that no number about it means anything."""
        return self.reason is not None and self.reason.cannot_tell
