"""Inclusion probabilities: in how many block ensembles a sparse selection takes a term that nobody has named.

The ensemble is drawn from whole blocks, as residuals in time are not independent (Fasel et al. 2022,
doi:10.1098/rspa.2021.0904, with blocks in place of rows); the named effects stay, and terms are added one by one while
they earn their price.
"""

import numpy as np

from ...measurements.statistics.blocks import block_draws
from ..candidates.candidate import Kind
from ..search.floating import Search, State

_MOST = 6
"""Terms in one model at most: more than six that nobody has named are no physics to look for."""

_TRIED = 4
"""Terms that are scored before one is taken: those that lower the in-sample error most."""


def inclusion(search: Search, state: State, seed: int, draws: int = 100) -> dict[str, float]:
    """Share of block draws in which each term of the search's pool is selected beside the named effects, by symbol.

    Terms that are never selected are left out. Columns are those about the final model, without its terms.

    Parameters
    ----------
    seed : of the draws
    """
    linear, scores = search.linearise(state.vehicle, state.active, state.fit.in_sample)
    terms = search.of_kind([candidate.key for candidate in search.pool], Kind.TERM)
    base = {key: linear.options[key][0] for key in state.active if key not in terms}
    base |= {key: linear.options[key][1] for key in state.active if key in terms}
    present = {key: next(option for option in linear.options[key] if option.present) for key in terms}
    chosen = dict.fromkeys(terms, 0)
    for draw in block_draws(scores.blocks, draws, seed):
        drawn, model = scores.drawn(draw), dict(base)
        best = search.quick(drawn, model)
        for _ in range(_MOST):
            rest = [key for key in terms if key not in model or not model[key].present]
            gains = drawn.screen(list(model.values()), [present[key] for key in rest])
            rest = [rest[n] for n in np.argsort(-gains, kind="stable")[:_TRIED]]
            tried = search.quicks(drawn, [{**model, key: present[key]} for key in rest])
            found = min(zip(tried, rest, strict=True), default=None)
            if found is None or found[0] >= best - search.settings.margin:
                break
            best, key = found
            model[key] = present[key]
        for key in terms:
            chosen[key] += key in model and model[key].present
    return {key: number / draws for key, number in chosen.items() if number}
