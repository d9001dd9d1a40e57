"""Recommendation of a model: the simplest that keeps the laws and that no other beats by more than chance.

Rollouts decide where there are enough of them, else accelerations.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..measurements.statistics.blocks import MATERIAL, paired_ratio
from ..physics.motion import Array
from ..physics.presentation import listing
from ..residuals.models.base import Model
from ..residuals.models.foreign import FunctionModel
from ..residuals.scores import Errors
from .audit import Audit
from .facts import BASELINE, Best, Grounds, Margin, rolled, rows_of, squares

_AXES, _YAW = 3, 2
"""Of the columns of rollout errors, the speeds; the position follows from them. And which of them is the yaw rate."""
_HORIZONS, _BLOCKS = ("10", "2"), 3
"""Rollouts that may decide [s], and how many of them the judged rows must hold one after the other."""
_NOISE_KNOWN, _STARTS_KNOWN = 0.1, 0.5
"""Shares of what the noise of measured speeds, and that of the starts, make of squared errors below which no model errs
less than another: the size of the one is known to a tenth or so, of the other, which predictions bend, to a half."""


class Decides(NamedTuple):
    """Quantity that is compared.

    Attributes
    ----------
    what : in words; empty where the rows are too few for anything
    shortest : rows of a block
    squares : squared errors (n, 3) of each model, those of speeds less what the noise of the sensors makes of them
    horizon : of the predictions [s]; empty for accelerations
    """

    what: str
    shortest: int
    squares: list[Array]
    horizon: str = ""


def what_decides(every: Sequence[Errors], known: Sequence[Errors] = ()) -> Decides:
    """Choose what decides between models: speeds over 10 s, or 2 s, else acceleration.

    2 s decide where the rows are too few for 10, and where errors grow, see `_grows`.

    Parameters
    ----------
    every : errors of all models, on the same rows
    known : those of them that are no guess; none for all
    """
    grows = _grows(known or every)
    for horizon in _HORIZONS:
        if horizon in every[0].rollouts and not (grows and horizon == _HORIZONS[0]):
            found = _over(horizon, every)
            if found.squares[0].shape[0] >= _BLOCKS * found.shortest and _can_tell(found.squares, found.shortest):
                why = "this boat is directionally unstable: over 10 s small errors of a turn grow" if grows else ""
                why = why or f"the rows are too few for {_HORIZONS[0]} s"
                return found._replace(what=f"{found.what}{f' ({why})' if horizon != _HORIZONS[0] else ''}")
    table = [squares(errors) for errors in every]
    return Decides("acceleration" if _can_tell(table, 1) else "", 1, table)


def _grows(every: Sequence[Errors]) -> bool:
    """True where errors of the model that errs least over 2 s, and noise of its starts, are e-fold over 10 s, in yaw.

    So it is of hulls that turn by themselves. What is small in a model becomes large as well then, and one that damps
    what the boat does not may err less. Sway follows yaw, and on slow ships drifts though nothing is unstable.
    """
    shorter = _HORIZONS[-1]
    if not all(horizon in errors.rollouts for horizon in _HORIZONS for errors in every):
        return False
    first = rolled(every[0], shorter)[:, :_AXES].mean(axis=0)
    unit = np.maximum(first, np.finfo(float).tiny)
    sizes = [float((rolled(errors, shorter)[:, :_AXES].mean(axis=0) / unit).sum()) for errors in every]
    best = every[int(np.argmin(sizes))]
    started = [best.rollouts[horizon].started[_YAW] for horizon in _HORIZONS]
    erred = [rolled(best, horizon)[:, _YAW].mean() for horizon in _HORIZONS]
    return all(bool(later > np.e**2 * sooner) for later, sooner in (started, erred))


def _over(horizon: str, every: Sequence[Errors]) -> Decides:
    """The speeds of rollouts over a horizon, however few, without what the noise of the sensors adds to their means.

    It stands in what was measured, the same for each model, and in the starts, of which a model that damps makes less
    than one that turns by itself: without this the more damped model would seem to be the better one, on a log of the
    other. What is left is no less than the noise is known, for all models alike.
    """
    made = [errors.noise + errors.rollouts[horizon].started[:_AXES] for errors in every]
    known = [_NOISE_KNOWN * errors.noise + _STARTS_KNOWN * errors.rollouts[horizon].started[:_AXES] for errors in every]
    least = np.max(known, axis=0)
    table = [rolled(errors, horizon)[:, :_AXES] for errors in every]
    means = [squares.mean(axis=0) for squares in table]
    left = [
        squares - mean + np.maximum(mean - noise, np.minimum(least, mean))
        for squares, mean, noise in zip(table, means, made, strict=True)
    ]
    return Decides(f"the speeds predicted over {horizon} s", rows_of(every[0], horizon), left, horizon)


def _can_tell(table: list[Array], shortest: int) -> bool:
    """True when the rows are enough for an interval, without which nothing beats anything."""
    return any(paired_ratio(other, table[0], shortest).ci95 is not None for other in table[1:] or table)


def shares_of_error(every: Sequence[Errors], motion: Array) -> list[float]:
    """Squared errors of models as shares of the first one's, each speed in units of how much it varies.

    Of what decides between them. No end of it where a model runs away within that time and the first one does not.

    Parameters
    ----------
    motion : (3,) mean square of each measured speed [m^2/s^2, m^2/s^2, rad^2/s^2]
    """
    unit, decides = np.maximum(motion, np.finfo(float).tiny), what_decides(every)
    sums = [float((np.mean(each, axis=0) / unit).sum()) for each in decides.squares]
    steady = _diverged(every[0])
    longest = {decides.horizon} if decides.horizon else {name for name in _HORIZONS if name in every[0].rollouts}
    lost = [bool((_diverged(errors) - steady) & longest) for errors in every]
    return [np.inf if gone else own / max(sums[0], np.finfo(float).tiny) for own, gone in zip(sums, lost, strict=True)]


def _diverged(errors: Errors) -> set[str]:
    """Horizons over which a rollout runs away."""
    return {horizon for horizon, found in errors.rollouts.items() if found.score.diverged}


_GUESS = "a guess that knows nothing of the boat"


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

    def against(self, other: "_Contender") -> Margin:
        done = paired_ratio(self.squares, other.squares, self.shortest)
        ends = None if done.ci95 is None else (float(np.expm1(done.ci95[0])), float(np.expm1(done.ci95[1])))
        return Margin(model=self.name, against=other.name, relative=done.relative, ci95=ends, verdict=done.verdict)

    def beats(self, other: "_Contender") -> bool:
        return self.against(other).verdict == "better"

    def level(self, other: "_Contender") -> bool:
        """Neither beats the other, and they are not the very same model, such as one to which nothing was added."""
        return not (self.beats(other) or other.beats(self) or np.array_equal(self.squares, other.squares))


def best(models: Sequence[tuple[Model, Errors, Audit | None]], sure: Collection[str] = ()) -> Best:
    """Recommend a model, and say why in at most two sentences.

    What decides are predictions over 10 s, surge, sway and yaw together; over 2 s where the judged rows are too few for
    that, or errors grow, and the acceleration where they are too few for any. Of models that keep the laws and differ
    by chance only the simplest is trusted, or one that adds what is surely missing and errs less than the nominal one;
    and of these one that surely errs less than a guess that knows nothing of the boat before others. None is where the
    guess errs less, be it by chance. A model that errs less than the trusted one, but breaks a law or may do so by
    chance, is told of first.

    Parameters
    ----------
    models : each with its errors and what the laws say of it; the nominal one first
    sure : names of models that add what is surely missing
    """
    decides = what_decides(
        [errors for _, errors, _ in models], [errors for model, errors, _ in models if model.kind != BASELINE]
    )
    broken = ["" if audit is None else listing([r.law for r in audit.violations]) for _, _, audit in models]
    rows = zip(models, decides.squares, broken, strict=True)
    field = [_Contender(model, squares, decides.shortest, laws) for (model, _, _), squares, laws in rows]
    named = [c for c in field if c.model.kind != BASELINE]
    lawful = [c for c in named if not c.broken] or named
    if not decides.what:
        chosen = min(lawful, key=lambda c: c.score)
        doubt = f", though it breaks {chosen.broken}" if chosen.broken else ""
        few = "The judged rows are too few to tell models apart"
        sentence = f"{few}: {chosen.name} has the smallest errors{doubt}, and that may be chance."
        return Best(grounds=Grounds.TOO_FEW, sentence=sentence)
    guess = min((c for c in field if c.model.kind == BASELINE), key=lambda c: c.score, default=None)
    known = [c for c in lawful if c.name in sure and c.score < named[0].score]
    chosen = _simplest(lawful, guess, known)
    verdict = _Verdict(decides.what, named, chosen, guess, *_judge(named, chosen, guess), chosen in known)
    return Best(
        model=chosen.name * (verdict.grounds is not Grounds.GUESS),
        grounds=verdict.grounds,
        sentence=verdict.in_words,
        margins=tuple(c.against(named[0]) for c in named[1:]),
        guess=None if guess is None else chosen.against(guess),
        horizon=decides.horizon,
    )


def _simplest(field: Sequence[_Contender], guess: _Contender | None, known: Collection[_Contender] = ()) -> _Contender:
    """The model with the fewest fitted numbers that no other beats, or one of those that add what is surely missing.

    One that surely errs less than the guess goes before one that may, and this one before others. Of as many numbers
    the smallest error decides, as it does where all are beaten.
    """
    unbeaten = [c for c in field if not any(other.beats(c) for other in field if other is not c)]

    def rank(c: _Contender) -> tuple[bool, bool, bool, bool, int | None, float]:
        sure, perhaps = guess is None or c.beats(guess), guess is None or c.score < guess.score
        # Nobody knows how many numbers somebody else's function has.
        unknown = isinstance(c.model, FunctionModel)
        return not sure, not perhaps, c not in known, unknown, c.model.parameters, c.score

    return min(unbeaten or [min(field, key=lambda c: c.score)], key=rank)


def _judge(
    named: Sequence[_Contender], chosen: _Contender, guess: _Contender | None
) -> tuple[Grounds, _Contender | None]:
    """Why the chosen model is trusted or not, and the model that is told of before it, if one is."""
    gains = chosen is not named[0] and chosen.beats(named[0])
    better = [c for c in named if c.broken and not chosen.broken and c.beats(chosen)]
    ahead = min(better, key=lambda c: c.score, default=None)
    if guess is not None and guess.score < chosen.score:
        return Grounds.GUESS, ahead or (chosen if gains else None)
    if ahead is not None:
        return Grounds.LAWFUL, ahead
    if gains:
        return Grounds.BETTER, None
    level = [c for c in named if not c.broken and c.level(chosen) and c.against(chosen).relative < -MATERIAL]
    return (Grounds.CHANCE, min(level, key=lambda c: c.score)) if level else (Grounds.NONE_BETTER, None)


@dataclass(frozen=True, slots=True)
class _Verdict:
    """Facts of a recommendation, and the words for them.

    Attributes
    ----------
    what : decides
    named : models that are no guess, the nominal one first
    chosen : the one to trust, or the best where none is
    guess : the best of those that know nothing of the boat
    grounds : why the chosen model is trusted or not
    ahead : errs less than the trusted one, or gains on the nominal one where none is trusted, and is told of first
    known : the chosen one adds what is surely missing, and is trusted for that
    """

    what: str
    named: Sequence[_Contender]
    chosen: _Contender
    guess: _Contender | None
    grounds: Grounds
    ahead: _Contender | None
    known: bool = False

    @property
    def in_words(self) -> str:
        """All of it in at most two sentences."""
        tail = "; ".join(self._tail())
        return f"{self._lead()}. {tail}." if tail else f"{self._lead()}."

    def _lead(self) -> str:
        name, first = self.chosen.name, self.named[0]
        gain = self.chosen.against(first)
        if self.grounds is Grounds.GUESS:
            none = "rust none of the models on these rows"
            return f"{self._ahead()}: t{none}" if self.ahead else f"T{none}: {self._of_guess(f' in {self.what}')}"
        if self.grounds is Grounds.LAWFUL:
            also = f" and errs {gain.in_words}" if self.chosen.beats(first) else ""
            return f"{self._ahead()}: trust {name}, which keeps the laws of a hull{also}"
        if self.ahead is not None:
            less = _perhaps(self.ahead, self.chosen, f" in {self.what}")
            surer = self.guess is not None and self.chosen.beats(self.guess) and not self.ahead.beats(self.guess)
            why = "which surely errs less than a guess" if surer else "the simpler one"
            why = "which adds what is surely missing" if self.known else why
            return f"{less}: until more rows tell, trust {name}, {why}"
        laws = "keeps the laws of a hull"
        if self.chosen.broken:
            laws = f"breaks {self.chosen.broken}, and no model here keeps all laws"
        if self.grounds is Grounds.BETTER:
            return f"Trust {name}: in {self.what} it errs {gain.in_words}, and it {laws}"
        if self._gains_by_chance:
            return f"Trust {name}: in {self.what} it errs {gain.in_words}, which may be chance, and it {laws}"
        return f"Trust {name}: it {laws}, and in {self.what} none that does is better by more than chance"

    @property
    def _gains_by_chance(self) -> bool:
        """The trusted model errs less than the nominal one, but not surely."""
        first = self.named[0]
        less = self.chosen is not first and self.chosen.against(first).relative < -MATERIAL
        return self.grounds is Grounds.NONE_BETTER and not first.broken and less

    def _ahead(self) -> str:
        """By how much the model that is told of first errs less, and what speaks against it."""
        ahead = self.ahead
        assert ahead is not None, "a model is told of first"
        reference = self.chosen if ahead is self.named[0] else self.named[0]
        against = f"breaks {ahead.broken}" if ahead is not self.chosen else self._of_guess()
        return f"{ahead.name} errs {ahead.against(reference).in_words} in {self.what}, but {against}"

    def _of_guess(self, where: str = "") -> str:
        """By how much the guess errs less than the best model."""
        assert self.guess is not None, "a guess errs less"
        margin = self.guess.against(self.chosen)
        chance = "" if margin.verdict == "better" else ", which may be chance"
        return f"{self.guess.name}, {_GUESS}, errs {margin.in_words}{where}{chance}"

    def _tail(self) -> list[str]:
        """What a reader would ask next: whether it is better than a guess, and which others are as good."""
        chosen, others = self.chosen, [c for c in self.named if c not in (self.chosen, self.ahead)]
        if self.grounds is Grounds.GUESS:
            lawless = self.ahead is not None and self.ahead is not chosen
            return [f"Of models that keep the laws, {chosen.name} is the best, and {self._of_guess()}"] * lawless
        doubtful = [c for c in others if c.broken and not chosen.broken]
        level = [c for c in others if c.level(chosen) and not (c is self.named[0] and self._gains_by_chance)]
        told = [f"{c.name} errs {c.against(chosen).size} but breaks {c.broken}" for c in doubtful if c.beats(chosen)]
        told += [_perhaps(c, chosen) for c in level if c not in doubtful]
        told += [f"{c.name} breaks {c.broken} and is no better by more than chance" for c in level if c in doubtful]
        if self.guess is not None and not chosen.beats(self.guess):
            told.append(_perhaps(chosen, self.guess, f", {_GUESS}"))
        return told


def _perhaps(one: _Contender, other: _Contender, more: str = "") -> str:
    """By how much a model errs less or more than another, where that may be chance; `more` follows the other's name."""
    margin = one.against(other)
    doubt = f" ({margin.doubt})" if margin.doubt else ""
    return f"{one.name} errs {margin.size} than {other.name}{more}, which may be chance{doubt}"
