"""What a distillation says: shares of a model's correction by axis, effects, terms, and what remains."""

from typing import Annotated, ClassVar, Literal

from pydantic import PlainSerializer, SerializerFunctionWrapHandler, model_serializer

from ...physics.file_records import Number, Record
from ...physics.in_words import words
from ..found_effects import FoundTerm
from .memory import Past

_MOSTLY, _CLEARLY = 0.5, 0.25
"""Share of a remainder that must be predicted for its cause to be told, and the share from which it is memory."""


Told = Annotated[
    FoundTerm, PlainSerializer(lambda term: term.model_dump(mode="json", exclude={"in_model", "inclusion"}))
]
"""A number of a correction: no corrected model holds it, and no ensemble was asked for it."""


class AxisShare(Record):
    """The correction on one axis, and what explains it.

    Attributes
    ----------
    axis, unit : its name, and the unit of its force
    correction : root mean square of the correction's force
    at_work : root mean square of the largest force at work on the axis
    named : share of the correction's mean square that effects explain that are sure; None, as all that follows, where
        the correction is too small to matter. All axes are fitted at once, so that it may be negative here for more on
        another axis, and fall as effects are added
    possible : the same with effects that are not sure
    explained : the same with terms that nobody has named
    remainder : root mean square of what is left after all of these
    past : what predicts the remainder; None where it is too small to matter
    """

    axis: str
    unit: str
    correction: Number
    at_work: Number
    named: Number | None = None
    possible: Number | None = None
    explained: Number | None = None
    remainder: Number | None = None
    past: Past | None = None

    @property
    def matters(self) -> bool:
        """Whether the correction is large enough to ask what it is."""
        return self.named is not None

    @property
    def traded(self) -> bool:
        """Whether more effects explain less of this axis, or they make it worse: they were fitted for another one."""
        if self.named is None or self.possible is None or self.explained is None:
            return False
        return self.named < -0.01 or self.possible < self.named - 0.01 or self.explained < self.possible - 0.01

    @property
    def sentence(self) -> str:
        """The axis in words."""
        size = f"{self.correction:.2g} {self.unit}, {_percent(self.correction / self.at_work)} of the force at work"
        if self.named is None or self.possible is None or self.explained is None:
            return f"{self.axis}: the correction ({size}) is too small to matter."
        told = f"{self.axis}: of the correction ({size}), named effects explain {_share(self.named)}"
        if abs(self.possible - self.named) > 0.01:
            told += f", with effects that are not sure {_share(self.possible)}"
        if abs(self.explained - self.possible) > 0.01:
            told += f", with terms that nobody has named {_share(self.explained)}"
        if self.traded:
            told += " (all axes are fitted at once, and some effects explain less here for more on another axis)"
        if self.past is None:
            return f"{told}; what remains is too small to matter."
        return f"{told}. Of what remains ({self.remainder:.2g} {self.unit}), {_cause(self.past)}."

    @model_serializer(mode="wrap")
    def _with_shares_together(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        content: dict[str, object] = handler(self)
        told = {name: content[name] for name in ("axis", "unit", "correction", "at_work")}
        share = {"named": self.named, "with_possible": self.possible, "with_unnamed": self.explained}
        rest = {"remainder": content["remainder"], "share_of_remainder": content["past"]}
        return {**told, "matters": self.matters, "share": share, **rest}


class NamedPart(Record):
    """An effect of the catalogue in a correction.

    Attributes
    ----------
    effect, meaning : its name, and what it is
    verdict : "named" when it is sure, else "possible"
    confidence : share of block resamples in which it earns its price and matters, divided by its look-alikes
    share : share of the correction's mean square that only it explains, by axis on which the correction matters
    indistinguishable_from : effects that explain the correction as well in its place
    terms : its numbers
    """

    effect: str
    meaning: str
    verdict: Literal["named", "possible"]
    confidence: Number
    share: dict[str, Number]
    indistinguishable_from: tuple[str, ...]
    terms: tuple[Told, ...]


class Distilled(Record):
    """What of a model's correction is a named effect, and what is not.

    Attributes
    ----------
    model, nominal : names of the model, and of the vehicle that it corrects
    axes : surge, sway and yaw
    effects : of the catalogue, the sure and the largest first
    unnamed : terms that no effect stands for
    seconds : of motion along which the correction was looked at [s]
    """

    model: str
    nominal: str
    axes: tuple[AxisShare, ...]
    effects: tuple[NamedPart, ...]
    unnamed: tuple[Told, ...]
    seconds: Number

    SCHEMA: ClassVar[str] = "undertow.distillation/1"

    @property
    def headline(self) -> str:
        """The answer in a sentence."""
        if not any(axis.matters for axis in self.axes):
            return f"Nothing to distil: what {self.model} adds to {self.nominal} is too small to matter on every axis."
        names = [words(part.effect) for part in self.effects if part.verdict == "named"]
        if not names:
            return f"No named effect is found for sure in what {self.model} adds to {self.nominal}."
        listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
        return f"Along this motion, what {self.model} adds to {self.nominal} holds {listed}."

    @property
    def sentences(self) -> list[str]:
        """The answer, and each axis, in words."""
        return [self.headline, *(axis.sentence for axis in self.axes)]

    @model_serializer(mode="wrap")
    def _with_sentences(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        content: dict[str, object] = handler(self)
        names = {"model": content.pop("model"), "nominal": content.pop("nominal")}
        data = {"seconds": content.pop("seconds")}
        return {**names, "headline": self.headline, "sentences": self.sentences, **content, "data": data}


def _cause(past: Past) -> str:
    memory, present = _percent(past.memory), _percent(past.present)
    if past.memory >= _CLEARLY:
        return (
            f"{memory} is memory: it follows from the motion before, beyond what the present state predicts ({present})"
        )
    if past.memory + past.present < _MOSTLY:
        return (
            f"the present state predicts {present} and the motion before {memory} more: most of it is neither a law of "
            "the state nor a memory of the last seconds"
        )
    return f"the present state predicts {present}, in no form that has a name, and the motion before {memory} more"


def _share(share: float) -> str:
    """A share of the correction, in words where it has no meaning: what is left may be larger than all of it."""
    return _percent(share) if share > -0.01 else "nothing"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if abs(share) >= 0.01 else "less than 1 %"
