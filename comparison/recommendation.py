"""Which model to trust: the simplest that no other beats by more than chance, among those that keep the laws."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..measurements.statistics.blocks import Difference, paired_ratio
from ..physics.motion import Array
from ..physics.presentation import listing, percent
from ..residuals.models.base import Model
from ..residuals.models.foreign import FunctionModel
from ..residuals.scores import Errors
from .audit import Audit
from .facts import Best
from .what_decides import what_decides

BASELINE = "baseline"


@dataclass(frozen=True, slots=True, eq=False)
class _Contender:
    """A model, its squared errors (n, 3) in what decides, rows of a block, and the laws that it breaks."""

    model: Model
    squares: Array
    shortest: int
    broken: str

    @property
    def name(self) -> str:
        return self.model.name

    @property
    def score(self) -> float:
        """Mean logarithm of the error over the axes."""
        return float(np.log(np.maximum(self.squares.mean(axis=0), 1e-24)).mean())

    def against(self, other: "_Contender") -> Difference:
        return paired_ratio(self.squares, other.squares, self.shortest)

    def beats(self, other: "_Contender") -> bool:
        return self.against(other).verdict == "better"


def best(models: Sequence[tuple[Model, Errors, Audit | None]]) -> Best:
    """The model to trust and why, in at most two sentences.

    What decides are predictions over 10 s, surge, sway and yaw together; over 2 s where the judged rows are too few for
    that, and the acceleration where they are too few for any. Of models that differ by chance only the simplest is
    named, and none that breaks a law where another keeps them all.
    """
    decides = what_decides([errors for _, errors, _ in models])
    what = decides.what
    broken = ["" if audit is None else listing([r.law for r in audit.violations]) for _, _, audit in models]
    field = [
        _Contender(model, decides.squares[k], decides.shortest, broken[k]) for k, (model, _, _) in enumerate(models)
    ]
    named = [c for c in field if c.model.kind != BASELINE]
    lawful = [c for c in named if not c.broken]
    if not what:
        chosen = min(lawful or named, key=lambda c: c.score)
        doubt = f", though it breaks {chosen.broken}" if chosen.broken else ""
        sentence = (
            f"The judged rows are too few to tell models apart: {chosen.name} has the smallest errors{doubt}, and that "
            "may be chance."
        )
        return Best(sentence=sentence)
    chosen = _simplest(lawful or named)
    still = [c for c in field if c.model.kind == BASELINE and not chosen.beats(c)]
    if still:
        base = min(still, key=lambda c: c.score)
        kept = " that keeps the laws" if lawful and len(lawful) < len(named) else ""
        sentence = f"Trust none of the models on these rows: {_beaten(base, chosen, what, kept)}."
        better = [c for c in named if kept and c not in lawful and c.beats(base)]
        told = [f"{c.name} is, but breaks {c.broken}" for c in better]
        if chosen.beats(named[0]):
            told.append(
                f"{chosen.name} errs {percent(-chosen.against(named[0]).relative)} less than {named[0].name} does"
            )
        return Best(sentence=f"{sentence} {'; '.join(told)}." if told else sentence, horizon=decides.horizon)
    others = [c for c in named if c is not chosen]
    told = [_why(chosen, named[0], what), _and_the_others(chosen, others)]
    saved = None if chosen is named[0] else -chosen.against(named[0]).relative
    return Best(model=chosen.name, sentence=" ".join(filter(None, told)), saved=saved, horizon=decides.horizon)


def _beaten(base: _Contender, chosen: _Contender, what: str, kept: str) -> str:
    """That a baseline is better than the best model, or that none is better than it."""
    guess = f"{base.name}, a guess that knows nothing of the boat"
    if base.beats(chosen):
        less = percent(-base.against(chosen).relative)
        return f"{guess}, errs {less} less than {chosen.name}, the best{kept or ' of them'}, in {what}"
    return f"in {what} none{kept} is better by more than chance than {guess}"


def _simplest(field: Sequence[_Contender]) -> _Contender:
    """The model with the fewest fitted numbers that no other beats; the one with the smallest error where all are."""
    unbeaten = [c for c in field if not any(other.beats(c) for other in field if other is not c)]
    # Nobody knows how many numbers somebody else's function has.
    return min(
        unbeaten or [min(field, key=lambda c: c.score)],
        key=lambda c: (isinstance(c.model, FunctionModel), c.model.parameters),
    )


def _why(chosen: _Contender, first: _Contender, what: str) -> str:
    laws = f"breaks {chosen.broken}, and no model here keeps all laws" if chosen.broken else "keeps the laws of a hull"
    if chosen is first:
        return f"Trust {chosen.name}: it {laws}, and in {what} none that does is better by more than chance."
    if chosen.beats(first):
        share = percent(-chosen.against(first).relative)
        return f"Trust {chosen.name}: in {what} it errs {share} less than {first.name} does, and it {laws}."
    if not first.broken:
        return f"Trust {chosen.name}: it {laws}, and in {what} none that does is better by more than chance."
    less = "errs less" if first.beats(chosen) else "is no better by more than chance"
    return f"Trust {chosen.name}: it {laws}, which {first.name} does not, though in {what} that {less}."


def _and_the_others(chosen: _Contender, others: Sequence[_Contender]) -> str:
    """What a reader would ask next: whether a model that breaks a law errs less, or which ones are as good."""
    doubtful = [c for c in others if c.broken and not chosen.broken]
    told = [
        f"{c.name} errs {percent(-c.against(chosen).relative)} less but breaks {c.broken}"
        for c in doubtful
        if c.beats(chosen)
    ]
    # One with the very same errors is the same model, such as a corrected one to which nothing was added.
    level = [c for c in others if not chosen.beats(c) and not c.beats(chosen)]
    level = [c for c in level if not np.array_equal(c.squares, chosen.squares)]
    equals = [c.name for c in level if c not in doubtful]
    told += [f"these rows cannot tell {listing(equals)} from {chosen.name}"] * bool(equals)
    told += [f"{c.name} breaks {c.broken} and is no better by more than chance" for c in level if c in doubtful]
    text = "; ".join(told)
    return f"{text.replace('these', 'These', 1) if text.startswith('these') else text}." if told else ""
