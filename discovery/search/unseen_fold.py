"""A search that does not see one fold of its log: what it names and fits there is judged on rows that it never saw."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...measurements.preparation.split import Fold
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..candidates.linearisation import Linearisation, Option
from .gram import GramScores
from .scoring import Scoring, State, noise_by_block

_ADDITIONS, _SWAPS = 8, 4
"""Additions that are scored in full, of all that the screen ranks; and those in place of each effect of a model."""
_MOVES = 30
"""Changes after which a search ends in any case; the largest models seen have a dozen effects."""

_EARNED = 5.0
"""Log-likelihood that an effect must earn to be called one: as much as tells two effects apart."""

Chosen = dict[str, Option]


def without_fold(balance: Balance, linear: Linearisation, scores: GramScores, fold: Fold) -> GramScores:
    """Scores of a linearisation on all tests but those that a fold reaches into."""
    return scores.seeing(balance.outside(fold), linear.columns, linear.noise, balance.block)


def held_where_silent(scores: GramScores, chosen: Sequence[Option], nominal: Vehicle) -> list[Option]:
    """Options with the nominal value, not to be fitted, for every number of which the seen tests show nothing."""
    columns, normal, _ = scores.block_normal(chosen)
    silent = {int(k) for k, own in zip(columns, np.diag(normal.sum(axis=0)), strict=True) if not own > 0.0}
    found = []
    for option in chosen:
        if silent & set(option.free):
            quiet = [k in silent for k in option.free]
            start = (nominal.value(s) if q else v for s, v, q in zip(option.symbols, option.start, quiet, strict=True))
            free = (-1 if q else k for k, q in zip(option.free, quiet, strict=True))
            option = replace(option, start=tuple(start), free=tuple(free))
        found.append(option)
    return found


class WithoutFold(Scoring):
    """The scores of a search on all tests but those that a fold reaches into.

    Scales and floors stay those of the whole log, of which they are no fit.
    """

    def __init__(self, search: Scoring, fold: Fold) -> None:
        super().__init__(search.balance, search.nominal, search.pool, search.settings)
        self._fold, seen = fold, search.balance.outside(fold)
        self.tests = max(int(seen.sum()), 1)
        self._share = float(seen.mean())
        balances = np.where(seen[:, None], search.balance.balances(search.nominal), 0.0)
        self.noise_blocks = noise_by_block(balances, search.balance.block)

    def seen(self, linear: Linearisation, scores: GramScores) -> GramScores:
        """The scores of a linearisation without the fold."""
        return without_fold(self.balance, linear, scores, self._fold)

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
        options = _Options(self, linear, scores, state.active)
        nothing = {key: o if key in self.nuisances else options.absent[key] for key, o in whole.items()}
        ends = [options.pruned(options.ended(start), self.named(state.active), untold) for start in (nothing, whole)]
        best = min(ends, key=lambda end: self.quick(scores, end))
        agreed = [options.named(end) for end in (ends if self.balance.forces else [best])]
        slight = options.slight(whole)
        return best, [key for key in self.named(state.active) if key in slight or all(key in end for end in agreed)]


class _Options:
    """The choices of options about a model, and how they are scored without a fold."""

    def __init__(self, scoring: Scoring, linear: Linearisation, scores: GramScores, active: Sequence[str]) -> None:
        self._scoring, self._scores, self._all = scoring, scores, linear.options
        self.absent = {key: options[key in active] for key, options in linear.options.items()}

    def named(self, now: Chosen) -> list[str]:
        """The effects of a choice."""
        return [key for key, option in now.items() if option.present and key not in self._scoring.nuisances]

    def ended(self, now: Chosen) -> Chosen:
        """Where a floating search ends, with simpler effects in the place of general ones where these do as well."""
        found = self._climbed(now)
        general = {key for key in self._all if self._scoring.is_general(key)}
        kept = {key: self.absent[key] if key in general else option for key, option in found.items()}
        if not general & set(self.named(found)):
            return found
        simpler = self._climbed(kept, general)
        return min((simpler, found), key=lambda end: self._scoring.quick(self._scores, end))

    def _climbed(self, now: Chosen, barred: Collection[str] = ()) -> Chosen:
        """Where a floating search ends that adds (but nothing barred), drops, reshapes and swaps effects."""
        score, margin = self._scoring.quick(self._scores, now), self._scoring.settings.margin
        for _ in range(_MOVES):
            for moves in (self._nearest, self._swaps):
                trials = list(moves(now, barred))
                scored = self._scoring.quicks(self._scores, trials, score - margin)
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
        gains = self._scores.screen(list(now.values()), new)
        return [new[n] for n in np.argsort(-gains, kind="stable")[:most]]

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
            if gain < (0.0 if key in untold else _EARNED) or share < least:
                found.append((gain, key))
        return [key for _, key in sorted(found)]
