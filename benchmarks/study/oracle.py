"""What a judge who knows what is hidden in a log could tell: whether anything else explains its forces as well."""

import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.candidates.candidate import Kind, candidates, measurable
from undertow.discovery.evidence.weighing import CERTAINLY
from undertow.discovery.search.floating import Search, State
from undertow.physics.errors import LogError
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle
from undertow.workflows.inputs import read_inputs

FITTED = 6
"""Rivals of an effect that are fitted, of all that columns rank."""
_REFINEMENTS = 6
"""Times that the columns of a true model are taken anew about it."""
Rival = tuple[str, list[str], float]
"""A true effect, what stands in its place, and the log-likelihood by which that is worse."""


def search_of(motions: Sequence[Motion], nominal: Vehicle) -> Search:
    """A search of the whole catalogue on the force balance of some motions."""
    settings = DiscoverySettings()
    pool = candidates(nominal, measurable(motions))
    return Search(WeakForm(motions, settings.weak), nominal, pool, replace(settings.search, refinements=_REFINEMENTS))


def rivals(search: Search, true: State) -> Iterator[Rival]:
    """What does best in the place of each true effect: nothing, another, or a pair.

    Prices count: a judge who believes that fewer numbers are likelier would not be moved by more of them.

    Parameters
    ----------
    true : the model with the true effects
    """
    linear, scores = search.linearise(true.vehicle, true.active, true.fit.in_sample)
    now = {key: linear.options[key][0] for key in true.active}
    named = search.named(true.active)
    others = [c.key for c in search.pool if c.kind is Kind.EFFECT and c.key not in named]
    shapes = [(option,) for key in others for option in linear.options[key] if option.present]
    pairs = [(*one, *other) for one, other in combinations(shapes, 2) if one[0].key != other[0].key]
    every = [(), *shapes, *pairs]
    for name in named:
        rest = {**now, name: linear.options[name][1]}
        trials = [rest | {option.key: option for option in options} for options in every]
        worth = search.score_all_linearised(scores, trials)
        for _, n in sorted((score, n) for n, score in enumerate(worth))[:FITTED]:
            there = search.apply(true, now, trials[n], scores)
            yield name, [option.key for option in every[n]], there.score - true.score


def in_words(rival: Rival) -> str:
    """A rival in words."""
    of, by, worse = rival
    return f"{' and '.join(by) or 'nothing'} in place of {of}: {worse:+.1f}"


def why_untold(
    write: Callable[[Path], Path], nominal: Vehicle, true: Collection[str], part: Collection[str] = ()
) -> str:
    """Why a judge who knows which effects act could name none of them from a log; empty where one could.

    The judge has the force balance of the log as the verb reads it, with the true names and those of the fair parts
    that earn their price beside them, and no others. A rival that the truth beats by less than 10.6 is right in more
    than one of 1,000 logs like this one, whatever the method.
    """
    with tempfile.TemporaryDirectory() as folder:
        try:
            motions = read_inputs(write(Path(folder) / "log.csv"), nominal).whole().fitting
        except LogError:
            return ""  # what is refused is not what no judge could tell
    search = search_of(motions, nominal)
    keys, fair = ([c.key for c in search.pool if {c.key, c.key.split("[")[0]} & set(some)] for some in (true, part))
    if not keys:
        return f"no candidate is one of {', '.join(sorted(true))}"
    state = _with_parts(search, search.evaluate(nominal, tuple(keys)), fair)
    best: dict[str, Rival] = {}
    for found in rivals(search, state):
        if found[0] in keys:
            best[found[0]] = min(best.get(found[0], found), found, key=lambda one: one[2])
    clearest = max(best.values(), key=lambda one: one[2])
    return in_words(clearest) if clearest[2] < CERTAINLY else ""


def _with_parts(search: Search, state: State, fair: Collection[str]) -> State:
    """The truth with those of its fair parts that earn their price, the best first."""
    while left := [key for key in fair if key not in state.active]:
        more = min((search.evaluate(state.vehicle, (*state.active, key)) for key in left), key=lambda s: s.score)
        if more.score >= state.score:
            break
        state = more
    return state
