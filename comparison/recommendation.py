"""Recommendation of a model: the simplest that keeps the laws and that no other beats by more than chance.

Rollouts decide where there are enough of them, else accelerations.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..measurements.statistics.blocks import Difference, paired_ratio
from ..physics.motion import Array
from ..physics.presentation import listing, percent
from ..residuals.models.base import Model
from ..residuals.models.foreign import FunctionModel
from ..residuals.scores import Errors
from .audit import Audit
from .facts import Best, rolled, rows_of, squares

_AXES = 3
"""Of the columns of rollout errors, the speeds; the position follows from them."""
_HORIZONS, _BLOCKS = ("10", "2"), 3
"""Rollouts that may decide [s], and how many of them the judged rows must hold one after the other."""
_NOISE_KNOWN = 0.1
"""Share of a squared error that stays where all of it may be noise of the sensors, whose size is known to a tenth or
so: an error is then told as smaller by no more than two thirds of what the noise makes."""


class Decides(NamedTuple):
    """Quantity that is compared.

    Attributes
    ----------
    what : in words; empty where the rows are too few for anything
    shortest : rows of a block
    squares : squared errors (n, 3) of each model, those of speeds less the noise of the sensors, which is no model's
    horizon : of the predictions [s]; empty for accelerations
    """

    what: str
    shortest: int
    squares: list[Array]
    horizon: str = ""


def what_decides(every: Sequence[Errors]) -> Decides:
    """Choose what decides between models: speeds over 10 s, over 2 s where these are too few, else acceleration."""
    for horizon in _HORIZONS:
        if horizon in every[0].rollouts:
            found = _over(horizon, every)
            if found.squares[0].shape[0] >= _BLOCKS * found.shortest and _can_tell(found.squares, found.shortest):
                longer = f" (the rows are too few for {_HORIZONS[0]} s)" if horizon != _HORIZONS[0] else ""
                return found._replace(what=f"{found.what}{longer}")
    table = [squares(errors) for errors in every]
    return Decides("acceleration" if _can_tell(table, 1) else "", 1, table)


def _over(horizon: str, every: Sequence[Errors]) -> Decides:
    """The speeds of rollouts over a horizon, however few these are."""
    table = [_less_noise(rolled(errors, horizon)[:, :_AXES], errors.noise) for errors in every]
    return Decides(f"the speeds predicted over {horizon} s", rows_of(every[0], horizon), table, horizon)


def _less_noise(squares: Array, noise: Array) -> Array:
    """Squared errors (n, 3) without what the noise of the sensors adds to their mean."""
    return squares - np.minimum(noise, (1.0 - _NOISE_KNOWN) * squares.mean(axis=0))


def _can_tell(table: list[Array], shortest: int) -> bool:
    """True when the rows are enough for an interval, without which nothing beats anything."""
    return any(paired_ratio(other, table[0], shortest).ci95 is not None for other in table[1:] or table)


def share_of_error(errors: Errors, nominal: Errors, motion: Array) -> float:
    """Squared error of a model on rows as a share of the nominal model's, each speed in units of how much it varies.

    Of predictions over 10 s, of 2 s or of the acceleration where the rows hold no longer ones. No end of it where the
    model runs away within that time and the nominal one does not.

    Parameters
    ----------
    motion : (3,) mean square of each measured speed [m^2/s^2, m^2/s^2, rad^2/s^2]
    """
    horizon = next((horizon for horizon in _HORIZONS if horizon in errors.rollouts), None)
    if horizon in _diverged(errors) - _diverged(nominal):
        return float(np.inf)
    own, before = (
        np.mean(squares(e) if horizon is None else rolled(e, horizon)[:, :_AXES], axis=0) for e in (errors, nominal)
    )
    unit = np.maximum(motion, np.finfo(float).tiny)
    return float((own / unit).sum() / max(float((before / unit).sum()), np.finfo(float).tiny))


def _diverged(errors: Errors) -> set[str]:
    """Horizons over which a rollout runs away."""
    return {horizon for horizon, found in errors.rollouts.items() if found.score.diverged}


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
    texts = [
        f"{c.name} errs {percent(-c.against(chosen).relative)} less but breaks {c.broken}"
        for c in doubtful
        if c.beats(chosen)
    ]
    # One with the very same errors is the same model, such as a corrected one to which nothing was added.
    level = [c for c in others if not chosen.beats(c) and not c.beats(chosen)]
    level = [c for c in level if not np.array_equal(c.squares, chosen.squares)]
    equals = [c.name for c in level if c not in doubtful]
    texts += [f"these rows cannot tell {listing(equals)} from {chosen.name}"] * bool(equals)
    texts += [f"{c.name} breaks {c.broken} and is no better by more than chance" for c in level if c in doubtful]
    text = "; ".join(texts)
    return f"{text.replace('these', 'These', 1) if text.startswith('these') else text}." if texts else ""
