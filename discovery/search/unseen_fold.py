"""A search that does not see one fold of its log: what it names and fits there is judged on rows that it never saw."""

from collections.abc import Iterator

import numpy as np

from ...measurements.preparation.held_out import Fold
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


class WithoutFold(Scoring):
    """The scores of a search on all tests but those that a fold reaches into.

    Scales and floors stay those of the whole log, of which they are no fit.
    """

    def __init__(self, search: Scoring, fold: Fold) -> None:
        vars(self).update(vars(search))
        self._fold, seen = fold, search.balance.outside(fold)
        self.tests = int(seen.sum())
        self.independent = search.independent * float(seen.mean())
        balances = np.where(seen[:, None], search.balance.balances(search.nominal), 0.0)
        self.noise_blocks = noise_by_block(balances, search.balance.block)

    def seen(self, linear: Linearisation, scores: GramScores) -> GramScores:
        """The scores of a linearisation without the fold."""
        return without_fold(self.balance, linear, scores, self._fold)

    def choose(self, linear: Linearisation, scores: GramScores, state: State) -> Chosen:
        """Select effects anew, by floating search on the columns about the model that the whole log gave.

        It begins with no effect; on rollouts, where no search gets far from there, with those of the whole log as well,
        and the better end counts. Where lags and other shapes stand is thereby the whole log's; which effects there
        are, and how large, is not.
        """
        absent = {key: options[key in state.active] for key, options in linear.options.items()}
        whole = {key: linear.options[key][0] for key in state.active}
        nothing = {key: option if key in self.nuisances else absent[key] for key, option in whole.items()}
        starts = (nothing,) if self.balance.forces else (nothing, whole)
        ends = [self._climbed(linear, scores, start, absent) for start in starts]
        return min(ends, key=lambda end: self.quick(scores, end))

    def _climbed(self, linear: Linearisation, scores: GramScores, now: Chosen, absent: Chosen) -> Chosen:
        """Where a floating search ends, less what hardly earns anything."""
        score = self.quick(scores, now)
        for _ in range(_MOVES):
            for moves in (self._nearest, self._swaps):
                trials = enumerate(moves(linear, scores, now, absent))
                scored = ((self.quick(scores, change), n, change) for n, change in trials)
                least, _, better = min(scored, key=lambda trial: trial[:2], default=(score, 0, now))
                if least < score - self.settings.margin:
                    score, now = least, better
                    break
            else:
                break
        return self._pruned(scores, now, absent)

    def _nearest(self, linear: Linearisation, scores: GramScores, now: Chosen, absent: Chosen) -> Iterator[Chosen]:
        """One effect more, or less, or in another shape."""
        for option in self._promising(linear, scores, now, _ADDITIONS):
            yield {**now, option.key: option}
        for key in self._named_in(now):
            yield {**now, key: absent[key]}
            for option in linear.options[key]:
                if option.present and option is not now[key]:
                    yield {**now, key: option}

    def _swaps(self, linear: Linearisation, scores: GramScores, now: Chosen, absent: Chosen) -> Iterator[Chosen]:
        """One effect in place of another."""
        for key in self._named_in(now):
            rest = {**now, key: absent[key]}
            for option in self._promising(linear, scores, rest, _SWAPS):
                yield {**rest, option.key: option}

    def _promising(self, linear: Linearisation, scores: GramScores, now: Chosen, most: int) -> list[Option]:
        """The options of what is not in a model that would lower its in-sample error most."""
        present = set(self._named_in(now)) | set(self.nuisances)
        new = [o for key, options in linear.options.items() if key not in present for o in options if o.present]
        gains = scores.screen(list(now.values()), new)
        return [new[n] for n in np.argsort(-gains, kind="stable")[:most]]

    def _named_in(self, now: Chosen) -> list[str]:
        return [key for key, option in now.items() if option.present and key not in self.nuisances]

    def _pruned(self, scores: GramScores, now: Chosen, absent: Chosen) -> Chosen:
        """The choice without effects that hardly earn anything, or that explain less than is ever told, least first."""
        while self._named_in(now):
            chosen = list(now.values())
            whole = self.fit(scores, chosen)
            score = self.score(whole, chosen)
            for gain, key in sorted(
                (self.quick(scores, {**now, k: absent[k]}) - score, k) for k in self._named_in(now)
            ):
                lost = self.fit(scores, list({**now, key: absent[key]}.values())).held_out - whole.held_out
                share = float((np.sqrt(np.maximum(lost, 0.0)) / self.share_scale).max())
                if gain < _EARNED or share < self.settings.least:
                    now = {**now, key: absent[key]}
                    break
            else:
                break
        return now
