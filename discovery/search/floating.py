"""Floating search over effects, its moves, and the same search without one fold, judged on the rows held out.

Effects are added, dropped, swapped or reshaped until no change lowers the score (Pudil, Novovicova and Kittler 1994).
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...measurements.preparation.split import Fold
from ...measurements.statistics.processors import parallel_map
from ...physics.presentation import listing, words
from ...physics.stage import Say, Stage
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..candidates.candidate import Candidate, beyond_any_hull
from ..candidates.linearisation import Linearisation, Option
from .gram import GramScores
from .scoring import ALIVE, TELL_APART, Scoring, SearchSettings, State, apply_fit, noise_by_block, present_keys

__all__ = ["ALIVE", "Search", "SearchSettings", "State", "static_effects"]


_STATIC = ("hull", "coupling", "mass", "thruster")
"""Families of effects that no time and no water moves."""


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
        return self._prune(self._within_limits(self._simplest(state, say), say), say)

    def best_of(self, starts: Sequence[State | None], say: Say) -> State:
        """The best model that searches from some others end at; what all but the first say is told after them."""

        def run(number: int) -> tuple[State, list[str]]:
            lines: list[str] = []
            return self.run(starts[number], lines.append if number else say), lines

        found = parallel_map(run, range(len(starts)))
        for _, lines in found:
            for line in lines:
                say(line)
        return min((state for state, _ in found), key=lambda s: s.score)

    def _climb(self, state: State, say: Say) -> State:
        """Change a model until no change improves it."""
        refused: set[frozenset[str]] = set()
        for _ in range(self.settings.rounds):
            improved = self._step(state, refused)
            if improved is None:
                break
            say(Stage(difference(state.active, improved.active)))
            state = improved
        return state

    def _simplest(self, state: State, say: Say) -> State:
        """Replace general effects by simpler ones, as many as it takes, if that is no worse.

        A general effect (a free thrust curve) is the best single stand-in for several of its special cases at once, and
        no change of one or two effects leads from it to them.
        """
        simple = tuple(c for c in self.pool if not c.effect.general)
        kept = tuple(key for key in state.active if any(c.key == key for c in simple))
        if len(kept) == len(state.active):
            return state
        result = Search(self.balance, self.nominal, simple, self.settings).run(self.restrict(state, kept))
        if result.score > state.score:
            return state
        say(Stage(f"{difference(state.active, result.active)} (simpler)"))
        return result

    def _within_limits(self, state: State, say: Say) -> State:
        """Replace effects that no hull has, at a physical limit, by others that do as well; see `beyond_any_hull`."""
        beyond = self._beyond(state)
        if not beyond:
            return state
        barred = self.with_general(beyond)
        pool = tuple(c for c in self.pool if c.key not in barred)
        inside = Search(self.balance, self.nominal, pool, self.settings)
        kept = self.restrict(state, tuple(key for key in state.active if key not in barred))
        result = inside._simplest(inside._climb(inside.evaluate(kept.vehicle, kept.active), _silent), _silent)
        if self._beyond(result) or not self.does_as_well((result.fit, result.score), (state.fit, state.score)):
            return state
        say(Stage(f"{difference(state.active, result.active)} (within physical limits)"))
        return result

    def _beyond(self, state: State) -> set[str]:
        """Keys of the effects of a model that no hull has."""
        named = self.named(state.active)
        return {c.key for c in self.pool if c.key in named and beyond_any_hull(c, self.nominal, state.vehicle)}

    def _prune(self, state: State, say: Say) -> State:
        """Drop, one at a time, the effect that matters least, as long as it does not matter."""
        while self.named(state.active):
            for loss in sorted(self.losses(state)):
                trial = self.without(state, loss.key)
                if trial.score <= state.score or not self.is_material(trial, state):
                    say(Stage(f"trying without {words(loss.key)}, which is too small to matter"))
                    state = trial
                    break
            else:
                return state
        return state

    def reshape(self, state: State) -> State:
        """Try other shapes of what is active, nothing added or dropped, until none is better."""
        for _ in range(self.settings.rounds):
            linear, scores, now = self.about(state)
            changes = [{**now, key: option} for key in now for option in linear.options[key][2:]]
            trials = sorted((score, n) for n, score in enumerate(self.score_all_linearised(scores, changes)))[:3]
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

    def _step(self, state: State, refused: set[frozenset[str]]) -> State | None:
        linear, scores, now = self.about(state, roughly=True)
        neighbours = list(changes(linear, scores, now, self.nuisances))
        quick = self.score_all_linearised(scores, neighbours, state.score - self.settings.margin)
        ranked = sorted((score, n) for n, score in enumerate(quick))
        for score, n in ranked[:6]:
            change = neighbours[n]
            active = present_keys(change)
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
        linear, scores, now = self.about(state)
        neighbours = list(split_effects(linear, scores, now, self.nuisances))
        worth = state.score - self.settings.margin
        ranked = sorted(
            (score, n) for n, score in enumerate(self.score_all_linearised(scores, neighbours, worth)) if score < worth
        )
        for _, n in ranked[:3]:
            trial = self.apply(state, now, neighbours[n], scores)
            if trial.score < worth:
                return trial
        return None


def _silent(text: str) -> None:
    """Say nothing."""


_ADDITIONS, _SWAPS = 8, 4
"""Additions that are tried in full, of all that the screen ranks; and those in place of each effect of a model."""
_MOVES = 30
"""Changes after which a search ends in any case, for each costs time; the largest models seen have a dozen effects."""

Chosen = dict[str, Option]


def scores_without_fold(balance: Balance, linear: Linearisation, scores: GramScores, fold: Fold) -> GramScores:
    """Scores of a linearisation on all tests but those that a fold reaches into.

    Parameters
    ----------
    balance : of the log
    linear : the columns of all candidates
    scores : of all tests
    fold : the stretches that are not seen
    """
    return scores.seeing(balance.outside(fold), linear.columns, linear.noise, balance.block)


def hold_unseen(scores: GramScores, chosen: Sequence[Option], nominal: Vehicle) -> list[Option]:
    """Options with the nominal value, not to be fitted, for every number of which the seen tests show nothing.

    Parameters
    ----------
    scores : of the tests that are seen
    chosen : an option for each effect of the model
    nominal : whose values silent parameters keep
    """
    columns, normal, _ = scores.block_normal(chosen)
    silent = {int(k) for k, own in zip(columns, np.diag(normal.sum(axis=0)), strict=True) if not own > 0.0}
    result = []
    for option in chosen:
        if silent & set(option.free):
            quiet = [k in silent for k in option.free]
            start = (nominal.value(s) if q else v for s, v, q in zip(option.symbols, option.start, quiet, strict=True))
            free = (-1 if q else k for k, q in zip(option.free, quiet, strict=True))
            option = replace(option, start=tuple(start), free=tuple(free))
        result.append(option)
    return result


class WithoutFold(Scoring):
    """The scores of a search on all tests but those that a fold reaches into.

    Scales and floors stay those of the whole log, of which they are no fit.
    """

    def __init__(self, search: Scoring, fold: Fold) -> None:
        super().__init__(search.balance, search.nominal, search.pool, search.settings)
        self._fold, seen = fold, search.balance.outside(fold)
        self.tests = max(int(seen.sum()), 1)
        self._share = float(seen.mean())
        balances = np.where(seen[:, None], search.balance.noisy_residuals(search.nominal), 0.0)
        self.noise_blocks = noise_by_block(balances, search.balance.block)

    def seen(self, linear: Linearisation, scores: GramScores) -> GramScores:
        """The scores of a linearisation without the fold."""
        return scores_without_fold(self.balance, linear, scores, self._fold)

    def choose(
        self, linear: Linearisation, scores: GramScores, state: State, untold: Collection[str] = ()
    ) -> tuple[Chosen, list[str]]:
        """Select effects anew, by floating search on the columns about the model that the whole log gave.

        It begins with no effect and with those of the whole log, and the better end is the model. Where lags and other
        shapes stand is thereby the whole log's; which effects there are, and how large, is not.

        Parameters
        ----------
        untold : effects that need only earn something, for they are in the model and not named

        Returns
        -------
        (chosen, found)
            the options of the model, and the effects of the whole log that come out whatever it begins with (on
            rollouts, where no search gets far from nothing, from the better side), or of which the rest of the log
            shows too little for that
        """
        whole = {key: linear.options[key][0] for key in state.active}
        options = _Options(self, linear, scores, state)
        nothing = {key: o if key in self.nuisances else options.absent[key] for key, o in whole.items()}
        ends = [options.pruned(options.ended(start), self.named(state.active), untold) for start in (nothing, whole)]
        best = min(ends, key=lambda end: self.score_linearised(scores, end))
        agreed = [options.named(end) for end in (ends if self.balance.forces else [best])]
        slight = options.slight(whole)
        return best, [key for key in self.named(state.active) if key in slight or all(key in end for end in agreed)]


class _Options:
    """The choices of options about a model, and how they are scored without a fold."""

    def __init__(self, scoring: Scoring, linear: Linearisation, scores: GramScores, state: State) -> None:
        self._scoring, self._scores, self._all, self._vehicle = scoring, scores, linear.options, state.vehicle
        self.absent = {key: options[key in state.active] for key, options in linear.options.items()}

    def named(self, now: Chosen) -> list[str]:
        """The effects of a choice."""
        return [key for key, option in now.items() if option.present and key not in self._scoring.nuisances]

    def ended(self, now: Chosen) -> Chosen:
        """Where a floating search ends, with simpler effects in the place of general ones where these do as well.

        And with what a hull can have in the place of what none has; see `Search`.
        """
        result = self._climbed(now)
        general = {key for key in self._all if self._scoring.is_general(key)}
        if general & set(self.named(result)):
            simpler = self._climbed(self._less(result, general), general)
            result = min((simpler, result), key=lambda end: self._scoring.score_linearised(self._scores, end))
        beyond = self._beyond(result)
        if not beyond:
            return result
        barred = self._scoring.with_general(beyond)
        within = self._climbed(self._less(result, barred), barred)
        return within if not self._beyond(within) and self._does_as_well(within, result) else result

    def _less(self, now: Chosen, gone: Collection[str]) -> Chosen:
        """A choice without some effects."""
        return {key: self.absent[key] if key in gone else option for key, option in now.items()}

    def _beyond(self, now: Chosen) -> set[str]:
        """Keys of the effects of a choice that no hull has."""
        scoring, chosen = self._scoring, list(now.values())
        there = apply_fit(self._vehicle, chosen, scoring.fit(self._scores, chosen))
        named = self.named(now)
        return {c.key for c in scoring.pool if c.key in named and beyond_any_hull(c, scoring.nominal, there)}

    def _does_as_well(self, other: Chosen, best: Chosen) -> bool:
        """Whether a choice cannot be told from a better one, or leaves immaterially more error."""
        fits = [(self._scoring.fit(self._scores, list(end.values())), list(end.values())) for end in (other, best)]
        one, two = ((fit, self._scoring.score(fit, chosen)) for fit, chosen in fits)
        return self._scoring.does_as_well(one, two)

    def _climbed(self, now: Chosen, barred: Collection[str] = ()) -> Chosen:
        """Where a floating search ends that adds (but nothing barred), drops, reshapes and swaps effects."""
        score, margin = self._scoring.score_linearised(self._scores, now), self._scoring.settings.margin
        for _ in range(_MOVES):
            for moves in (self._nearest, self._swaps):
                trials = list(moves(now, barred))
                scored = self._scoring.score_all_linearised(self._scores, trials, score - margin)
                least, n = min(((worth, n) for n, worth in enumerate(scored)), default=(score, 0))
                if least < score - margin:
                    score, now = least, trials[n]
                    break
            else:
                break
        return now

    def _nearest(self, now: Chosen, barred: Collection[str]) -> Iterator[Chosen]:
        """One effect more, or less, or in another shape."""
        for option in self._promising(now, barred, _ADDITIONS):
            yield {**now, option.key: option}
        for key in (key for key in now if key not in self._scoring.nuisances and key not in barred):
            if now[key].present:
                yield {**now, key: self.absent[key]}
            # Beside what takes an effect of the whole log out of the columns, no screen sees that effect right.
            for option in self._all[key]:
                if option.present and option is not now[key] and not self._reshaped(option):
                    yield {**now, key: option}

    def _reshaped(self, option: Option) -> bool:
        """Whether it guesses another shape of an effect with amplitudes that stands: it does not take out what stands.

        A fold takes its columns once, so that it would fit the guess beside what it should replace.
        """
        here = self._all[option.key][0]
        return here.present and option is not here and option.offset < 0

    def _swaps(self, now: Chosen, barred: Collection[str]) -> Iterator[Chosen]:
        """One effect in place of another."""
        for key in self.named(now):
            rest = {**now, key: self.absent[key]}
            for option in self._promising(rest, barred, _SWAPS):
                yield {**rest, option.key: option}

    def _promising(self, now: Chosen, barred: Collection[str], most: int) -> list[Option]:
        """The options of what is not in a model that would lower its in-sample error most."""
        present = {*self.named(now), *self._scoring.nuisances, *barred}
        every = (o for key, options in self._all.items() if key not in present for o in options)
        new = [o for o in every if o.present and not self._reshaped(o)]
        return _promising(self._scores, now, new)[:most]

    def pruned(self, now: Chosen, known: Sequence[str], untold: Collection[str] = ()) -> Chosen:
        """The choice without effects that hardly earn anything or do not matter, the least first.

        Parameters
        ----------
        known : effects of the whole log: with less than a material share they matter where rollouts change without
            them, which the whole log has told
        untold : effects that need only earn something
        """
        while slight := self.slight(now, known, untold):
            now = {**now, slight[0]: self.absent[slight[0]]}
        return now

    def slight(self, now: Chosen, known: Sequence[str] | None = None, untold: Collection[str] = ()) -> list[str]:
        """The effects of a choice that hardly earn anything or do not matter, the least first; see `pruned`."""
        scoring, settings, chosen = self._scoring, self._scoring.settings, list(now.values())
        fit = scoring.fit(self._scores, chosen)
        score = scoring.score(fit, chosen)
        found = []
        for key in self.named(now):
            rest = list({**now, key: self.absent[key]}.values())
            without = scoring.fit(self._scores, rest)
            lost = np.maximum(without.held_out - fit.held_out, 0.0)
            share = float((np.sqrt(lost) / scoring.share_scale).max())
            least = settings.least if known is None or key in known else settings.materiality
            gain = scoring.score(without, rest) - score
            if gain < (0.0 if key in untold else TELL_APART) or share < least:
                found.append((gain, key))
        return [key for _, key in sorted(found)]


_SPLIT = 6
"""Additions that are tried first, and beside each of them second, in the place of one effect."""
_PROMISING = 12
"""Additions that are tried in full for each set of dropped effects."""


def changes(
    linear: Linearisation,
    scores: GramScores,
    now: dict[str, Option],
    kept_always: Sequence[str] = (),
) -> Iterator[dict[str, Option]]:
    """Neighbouring models worth a score: one effect added, dropped, reshaped or swapped.

    For each set of dropped effects, only the most promising additions by in-sample error are given.

    Parameters
    ----------
    kept_always : keys that are never dropped
    """
    new = _additions(linear, now, kept_always)
    for kept in (now, *_fewer(linear, now, kept_always)):
        if kept is not now:
            yield kept
        for option in _promising(scores, kept, new)[:_PROMISING]:
            yield {**kept, option.key: option}
    for key in now:
        for option in linear.options[key][2:]:
            yield {**now, key: option}


def split_effects(
    linear: Linearisation, scores: GramScores, now: dict[str, Option], kept_always: Sequence[str] = ()
) -> Iterator[dict[str, Option]]:
    """Neighbouring models in which two others stand in the place of one effect: it may be the mean of both.

    No addition, drop or swap leads there where neither of the two alone betters the model. See `changes`.

    Parameters
    ----------
    linear : options of all candidates
    scores : of the columns
    now : the option of each effect in the model, by key
    kept_always : keys that stay, nuisances
    """
    new = _additions(linear, now, kept_always)
    for kept in _fewer(linear, now, kept_always):
        for one in _promising(scores, kept, new)[:_SPLIT]:
            for other in _promising(scores, {**kept, one.key: one}, new)[:_SPLIT]:
                if one.key != other.key:
                    yield {**kept, one.key: one, other.key: other}


def _additions(linear: Linearisation, now: Mapping[str, Option], kept_always: Sequence[str]) -> list[Option]:
    """Every option of what is not in a model."""
    others = (key for key in linear.options if key not in now and key not in kept_always)
    return [option for key in others for option in linear.options[key][1:]]


def _fewer(linear: Linearisation, now: Mapping[str, Option], kept_always: Sequence[str]) -> Iterator[dict[str, Option]]:
    """A model without each of its effects, which leaves its offset behind: the columns were taken with it in place."""
    for gone in (key for key in now if key not in kept_always):
        yield {key: option for key, option in now.items() if key != gone} | {gone: linear.options[gone][1]}


def _promising(scores: GramScores, kept: Mapping[str, Option], new: Sequence[Option]) -> list[Option]:
    """Additions to a model, those of the largest gain by in-sample error first."""
    return [new[n] for n in np.argsort(-scores.screen(list(kept.values()), new), kind="stable")]


def difference(before: Sequence[str], after: Sequence[str]) -> str:
    """A change in words for the progress lines: a move of the search, which later moves may take back."""
    gone = [words(key) for key in before if key not in after]
    come = [words(key) for key in after if key not in before]
    moves = [f"with {listing(come)}"] * bool(come) + [f"without {listing(gone)}"] * bool(gone)
    return f"trying {' and '.join(moves) or 'other shapes'}"
