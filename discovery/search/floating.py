"""The floating search: add, drop, swap or reshape effects until no change lowers the score of the model."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...measurements.statistics.processors import shared
from ...physics.presentation import words
from ...physics.stage import Say, Stage
from ..candidates.candidate import Candidate
from .neighbours import changes, difference, present, splits
from .scoring import ALIVE, Scoring, SearchSettings, State

__all__ = ["ALIVE", "Search", "SearchSettings", "State", "static_effects"]


_STATIC = ("hull", "coupling", "mass", "thruster")
"""Families of effects that no time and no water moves."""
_FAR_BEHIND = 50.0
"""Log-likelihood by which a model is far worse than another: it would need ten parameters more to make it good."""
_PAIRS = 12
"""Effects in a model up to which two of them are exchanged for one: of more there are too many pairs to try."""


def static_effects(pool: Sequence[Candidate]) -> list[Candidate]:
    """Effects of one shape that no time and no water moves; one thruster is left out, as the measure of the rest."""
    first = next((c.key for c in pool if c.effect.per_thruster), "")
    return [
        c
        for c in pool
        if c.effect.family in _STATIC and not (c.effect.shapes or c.effect.general or c.nuisance) and c.key != first
    ]


class Search(Scoring):
    """A floating search over candidates (Pudil, Novovicova and Kittler 1994, doi:10.1016/0167-8655(94)90127-9)."""

    def run(self, start: State | None = None, progress: Say | None = None) -> State:
        """Search from the nominal model (or from `start`) to one that no change, swap or two-for-one improves."""
        say = progress or _silent
        state = self.evaluate(self.nominal, ()) if start is None else self.evaluate(start.vehicle, start.active)
        state = self._climb(state, say)
        for _ in range(self.settings.rounds):
            split = self._split(state)
            if split is None:
                break
            say(Stage(difference(state.active, split.active)))
            state = self._climb(split, say)
        return self._prune(self._simplest(state, say), say)

    def best_of(self, starts: Sequence[State | None], say: Say) -> State:
        """The best model that searches from some others end at; what all but the first say is told after them."""

        def run(number: int) -> tuple[State, list[str]]:
            lines: list[str] = []
            return self.run(starts[number], lines.append if number else say), lines

        found = shared(run, range(len(starts)))
        for _, lines in found:
            for line in lines:
                say(line)
        return min((state for state, _ in found), key=lambda s: s.score)

    def again(self, best: State, progress: Say | None = None) -> State:
        """Search again without each effect of a crowd in turn, and keep the better model.

        Many effects together may be the stand-ins for one or two that the search passed by, a few for no more than as
        many. A large crowd is met from the other side, too: from every effect of the hull and its thrusters.
        """
        for number in range(self.settings.rounds):
            crowd = self.named(best.active)
            if len(crowd) < self.settings.few:
                break
            others = shared(partial(self._climb_without, best), crowd)
            if len(crowd) < self.settings.crowd:
                others = [other for other in others if len(self.named(other.active)) <= len(crowd)] or [best]
            if number == 0 and len(crowd) >= self.settings.large:
                stripped = self._climb(self._stripped(), _silent)
                others += [stripped] if len(self.named(stripped.active)) <= len(crowd) else []
            other = self._prune(self._simplest(min(others, key=lambda s: s.score), _silent), _silent)
            if other.score >= best.score - self.settings.margin:
                break
            if progress is not None:
                progress(Stage(f"{difference(best.active, other.active)} (searched again)"))
            best = other
        return best

    def _climb_without(self, best: State, key: str) -> State:
        """Where a search ends from the best model less an effect, which is barred, if it reaches that model at all."""
        return self._climb(self.without(best, key), _silent, key, best)

    def _stripped(self) -> State:
        """A model with every static effect, less those that it is better without, the least first."""
        static = [c.key for c in static_effects(self.pool)]
        state = self.evaluate(self.nominal, static)
        linear, scores = self.linearise(state.vehicle, state.active, state.fit.in_sample)
        now = whole = {key: linear.options[key][0] for key in state.active}
        score = state.score
        for _ in static:
            trials = [{**now, key: linear.options[key][1]} for key in static if now[key].present]
            found = self.quicks(scores, trials)
            if not found or min(found) > score:
                break
            score = min(found)
            now = trials[found.index(score)]
        return self.apply(state, whole, now, scores)

    def _climb(self, state: State, say: Say, barred: str | None = None, best: State | None = None) -> State:
        """Change a model, never adding what is barred, until no change improves it or it will not reach the best."""
        refused: set[frozenset[str]] = set()
        pool = [c for c in self.pool if c.key != barred]
        for _ in range(self.settings.rounds):
            improved = None if best and self._behind(state, best) else self._step(state, refused, pool)
            if improved is None:
                break
            say(Stage(difference(state.active, improved.active)))
            state = improved
        return state

    def _behind(self, state: State, best: State) -> bool:
        """Whether a model has more effects than the best one and is far worse all the same: it gathers stand-ins."""
        more = len(self.named(state.active)) > len(self.named(best.active))
        return more and state.score > best.score + _FAR_BEHIND

    def _simplest(self, state: State, say: Say) -> State:
        """Replace general effects by simpler ones, as many as it takes, if that is no worse.

        A general effect (a free thrust curve) is the best single stand-in for several of its special cases at once, and
        no change of one or two effects leads from it to them.
        """
        simple = tuple(c for c in self.pool if not c.effect.general)
        kept = tuple(key for key in state.active if any(c.key == key for c in simple))
        if len(kept) == len(state.active):
            return state
        found = Search(self.balance, self.nominal, simple, self.settings).run(self.restrict(state, kept))
        if found.score > state.score:
            return state
        say(Stage(f"{difference(state.active, found.active)} (simpler)"))
        return found

    def _prune(self, state: State, say: Say) -> State:
        """Drop, one at a time, the effect that matters least, as long as it does not matter."""
        while self.named(state.active):
            for loss in sorted(self.losses(state)):
                trial = self.without(state, loss.key)
                if trial.score <= state.score or not self.matters(trial, state):
                    say(Stage(f"trying without {words(loss.key)}, which is too small to matter"))
                    state = trial
                    break
            else:
                return state
        return state

    def reshape(self, state: State) -> State:
        """Try other shapes of what is active, nothing added or dropped, until none is better."""
        for _ in range(self.settings.rounds):
            linear, scores = self.linearise(state.vehicle, state.active, state.fit.in_sample)
            now = {key: linear.options[key][0] for key in state.active}
            changes = [{**now, key: option} for key in now for option in linear.options[key][2:]]
            trials = sorted((score, n) for n, score in enumerate(self.quicks(scores, changes)))[:3]
            better = [self.apply(state, now, changes[n], scores) for _, n in trials]
            best = min(better, key=lambda s: s.score, default=state)
            if best.score >= state.score - 1e-6:
                return state
            state = best
        return state

    def _worth_a_try(self, before: State, after: State) -> bool:
        """True unless a change only adds effects whose force could never matter."""
        if not set(before.active) < set(after.active):
            return True
        share = self.unique_share(before, after)
        return bool((share >= np.where(self.quiet, self.settings.materiality, self.settings.least)).any())

    def _step(self, state: State, refused: set[frozenset[str]], pool: Sequence[Candidate]) -> State | None:
        linear, scores = self.linearise(state.vehicle, state.active, state.fit.in_sample, pool, roughly=True)
        now = {key: linear.options[key][0] for key in state.active}
        for two_for_one in (False, True) if len(self.named(state.active)) <= _PAIRS else (False,):
            neighbours = list(changes(linear, scores, now, two_for_one, self.nuisances))
            quick = self.quicks(scores, neighbours, state.score - self.settings.margin)
            ranked = sorted((score, n) for n, score in enumerate(quick))
            for score, n in ranked[:6]:
                change = neighbours[n]
                active = present(change)
                if score > state.score - self.settings.margin:
                    break
                if frozenset(active) in refused and set(active) != set(state.active):
                    continue
                trial = self.apply(state, now, change, scores)
                if trial.score < state.score - self.settings.margin and self._worth_a_try(state, trial):
                    return trial
                refused.add(frozenset(active))
        return None

    def _split(self, state: State) -> State | None:
        """A better model with two effects in the place of one; None where there is none."""
        linear, scores = self.linearise(state.vehicle, state.active, state.fit.in_sample)
        now = {key: linear.options[key][0] for key in state.active}
        neighbours = list(splits(linear, scores, now, self.nuisances))
        worth = state.score - self.settings.margin
        ranked = sorted((score, n) for n, score in enumerate(self.quicks(scores, neighbours, worth)) if score < worth)
        for _, n in ranked[:3]:
            trial = self.apply(state, now, neighbours[n], scores)
            if trial.score < worth:
                return trial
        return None


def _silent(text: str) -> None:
    """Say nothing."""
