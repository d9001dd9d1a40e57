"""The evidence for and against each candidate: what it is worth, how sure that is, and what looks just like it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...measurements.statistics.blocks import block_weights, largest_mean_square, share_of_draws
from ...measurements.statistics.processors import parallel_map
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..balance.shooting import rollout_squares
from ..balance.starts import WHOLE_HORIZON, ShootingSettings, limit_horizon
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Candidate, Kind, at_limit, beyond_any_hull
from ..candidates.linearisation import Linearisation, Option
from ..effect_findings import Reason
from ..identifiability.rehearsal import Identifiability
from ..search.floating import Search, State
from ..search.gram import Fit, GramScores
from ..search.rival_explanations import is_equivalent
from ..search.scoring import SLIGHT, TELL_APART, apply_fit, reset
from ..search.surrogates import Chance, SurrogateTest

SURE = 0.9
"""Share of draws of a log's blocks from which a name stands in the corrected model."""
CERTAINLY = float(np.log(40 / 0.001))
"""Log-likelihood that tells two effects apart where white noise lets every instant count: what is wrong beats the truth
by so much in at most one log in exp(10.6), and one of some forty that are wrong does in one in a thousand."""
_NEAR = 4.0
"""Times of that up to which rivals are tried in full that are not foretold to do as well: they may do better."""
PERHAPS = 0.5
"""Confidence from which an effect is possible: more resamples are for it than against it."""
_SCALES = ("thrust_scale", "thruster_asymmetry")
_PAIRED = 12
"""Rivals of one effect, the best as columns foretell, that are tried two at a time in its place."""
_BEYOND = 200.0
"""Log-likelihood from which it does not matter any more by how much a rival is worse."""
_DRAWS = 2000
"""Resamples: a share near 0.9 is then known to 0.7 %."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence of the log on one candidate.

    Attributes
    ----------
    key, kind : the candidate
    selected : True when the search kept it
    log_likelihood_gain : log-likelihood that it earns, its price paid; for one not selected, that it would earn
    share : (3,) force that only it explains, as a share of each axis' force scale
    error_drop : held-out force error that it removes, as a share of the nominal model's, on its best axis, 0..1
    confidence : share of block resamples in which it earns its price and is material
    identity : log-likelihood by which it beats the best rival in its place, another effect or a pair of them
    rival : that rival; empty where there is none
    worth : share of the nominal model's squared error that it removes beside the others, on the axis where that is most
    rollout_worth : the same of the squared errors of rollouts
    remains : share of the squared error of rollouts without it that stays with it, on that axis; of force, where there
        are no rollouts
    residual_ratio : force that the model leaves beyond sensor noise on the axes of the effect, as a multiple of its
        own; 0 where rollouts judge, of which the weather leaves much that follows no effect
    unexplained : the same as a share of what the nominal model leaves there
    indistinguishable_from : candidates that explain the log as well in its place; for one not selected, the selected
        ones in whose place it does, and those that explain what moves a quiet axis as well
    at_limit : True when a physical limit holds one of its parameters: the log asks for more than physics allows
    dormant : True when it was not selected, and a plausible amount of it would leave no material trace in this log
    unjudged : True when rollouts judge, which do not tell it from the rest or from what the compass lacks
    absorbed : True when it was not selected, and calibration takes up what a plausible amount of it would do
    noise_limited : True when it was not selected, and its column is hardly more than sensor noise
    chance : of nothing looking as good, for one that was selected
    faint : the quiet axis on which it would explain what moves there, too faint for the search; else empty
    """

    key: str
    kind: Kind
    selected: bool
    log_likelihood_gain: float
    share: Array
    error_drop: float
    confidence: float
    indistinguishable_from: tuple[str, ...]
    at_limit: bool = False
    dormant: bool = False
    unjudged: bool = False
    absorbed: bool = False
    noise_limited: bool = False
    faint: str = ""
    chance: Chance | None = None
    identity: float = 0.0
    rival: str = ""
    worth: float = 0.0
    rollout_worth: float | None = None
    remains: float = 0.0
    residual_ratio: float = 0.0
    unexplained: float = 0.0

    @property
    def sure(self) -> bool:
        """True when it stands, and nothing does as well in its place."""
        return self.stands and not self.indistinguishable_from

    @property
    def stands(self) -> bool:
        """True when the search kept it, nine of ten resamples agree, and it is a number that a hull can have.

        Such a name stands in the corrected model, however sure it is.
        """
        return self.selected and self.confidence >= SURE and not self.at_limit

    @property
    def reason(self) -> Reason:
        """The first reason that holds why it is not called missing; None where it is."""
        held = {
            Reason.FAINT: bool(self.faint),
            Reason.LOOK_ALIKES: bool(self.indistinguishable_from),
            Reason.AT_LIMIT: self.at_limit,
            Reason.NOT_EXCITED: self.dormant,
            Reason.UNJUDGED: self.unjudged,
            Reason.ABSORBED: self.absorbed,
            Reason.NOISE: self.noise_limited,
            Reason.WEAK: self.selected or self.confidence >= PERHAPS,
        }
        return next((reason for reason in Reason if held.get(reason)), Reason.NOT_FOUND)


def assess_candidates(search: Search, state: State, seed: int, known: Identifiability | None = None) -> list[Evidence]:
    """Evidence for every candidate of a search about its final model, best first.

    Parameters
    ----------
    seed : of the block resamples
    known : what the log can show and tell apart about the final model; without it nothing counts as dormant
    """
    linear, scores, now = search.about(state)
    general = _general_instead(search, state)
    rehearsals = SurrogateTest(search, linear, scores, now, seed)
    horizon = _horizon(search, state)
    nominal = _squares(search, search.nominal, horizon)
    absent = [o for c in search.pool if c.key not in now for o in linear.options[c.key] if o.present]
    beside = dict(zip(absent, _gains(search, scores, now, [(option,) for option in absent]), strict=True))
    model = _Model(search, state, linear, scores, now, seed, rehearsals, general, nominal, horizon, beside)
    whole, squares = search.fit(scores, list(now.values())), _squares(search, state.vehicle, horizon)

    known = known or Identifiability()

    def of(candidate: Candidate) -> Evidence:
        return _selected(model, candidate, squares, known.alike(candidate.key))

    pool = [candidate for candidate in search.pool if not candidate.nuisance]
    selected = [candidate for candidate in pool if candidate.key in now]
    weighed = {e.key: e for e in parallel_map(of, selected)}
    found = [weighed.get(candidate.key) or _not_selected(model, candidate, whole) for candidate in pool]
    found.sort(key=lambda e: (not e.selected, -e.log_likelihood_gain))
    return [e if e.selected else _not_shown(e, found, known) for e in found]


def _not_shown(e: Evidence, found: list[Evidence], known: Identifiability) -> Evidence:
    """A candidate that was not selected, with the reasons why the log may not show it."""
    return replace(
        e,
        indistinguishable_from=tuple(s.key for s in found if e.key in s.indistinguishable_from),
        dormant=e.key in known.dormant,
        absorbed=e.key in known.absorbed,
        noise_limited=e.key in known.noise_limited,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """The final model of a search, with the columns and scores about it and the option in which each effect stands."""

    search: Search
    state: State
    linear: Linearisation
    scores: GramScores
    now: dict[str, Option]
    seed: int
    rehearsals: SurrogateTest
    general: Mapping[str, State]
    squares: Array
    """(starts, 3) squared rollout errors of the nominal vehicle."""
    horizon: float
    """Length of those rollouts on a force balance [s]."""
    beside: Mapping[Option, float]
    """What the model would gain by each option that is not in it, as columns foretell."""


def _general_instead(search: Search, state: State) -> dict[str, State]:
    """The model with each general effect that it does not have in place of its special cases, where it has some.

    Only those that explain more than the model by what tells two apart, whatever their many numbers cost: the price
    says what is believed at first sight, and a simple law that the log refutes is no name for all that.
    """
    result: dict[str, State] = {}
    for general in (c for c in search.pool if c.effect.general and c.key not in state.active):
        rest = [key for key in search.named(state.active) if key not in general.effect.includes]
        if len(rest) < len(search.named(state.active)):
            there = search.evaluate(search.restrict(state, rest).vehicle, (*rest, general.key))
            if _explained(search, there) > _explained(search, state) + _clear(search):
                result[general.key] = there
    return result


def _clear(search: Search) -> float:
    """The log-likelihood by which one explanation beats another: rollouts count what is independent by whole ones."""
    return CERTAINLY if search.balance.forces else TELL_APART


def _explained(search: Search, state: State) -> float:
    """The held-out log-likelihood of a model, nothing paid."""
    return float(-0.5 * search.independent * np.log(state.fit.held_out + search.floor).sum())


def _selected(model: _Model, candidate: Candidate, squares: Array, alike: Sequence[str]) -> Evidence:
    search, state, linear, scores, now = model.search, model.state, model.linear, model.scores, model.now
    without = search.without(state, candidate.key)
    price = search.price(search.fit(scores, [now[candidate.key]]), [now[candidate.key]])
    gain = without.score - state.score
    rivals = []
    rest = {key: option for key, option in now.items() if key != candidate.key}
    gone = {candidate.key: linear.options[candidate.key][1]}
    # A name is rivalled by names only: an unnamed term that does as well is no reason to withhold it.
    others = [
        other.key
        for other in search.pool
        if not (other.key in now or (other.kind is Kind.TERM and candidate.kind is not Kind.TERM))
        and not is_equivalent(search.nominal, state.active, candidate.key, other.key)
    ]
    shapes = [option for key in others for option in linear.options[key] if option.present]
    enough = _clear(search)
    near = state.score + _NEAR * enough
    quick = search.score_all_linearised(scores, [{**rest, **gone, option.key: option} for option in shapes])
    best: dict[str, float] = {}
    for option, instead in zip(shapes, quick, strict=True):
        best[option.key] = min(best.get(option.key, np.inf), instead + model.beside[option])
    close = [option for option in shapes if best[option.key] < near or option.key in alike]
    beyond = _only_beyond_limits(model, candidate, {**rest, **gone}, close)
    others = [key for key in others if key not in beyond]
    ranked = {score: option for score, option in zip(quick, shapes, strict=True) if option.key not in beyond}
    worse = {key: best[key] - state.score for key in others}
    for key in sorted(others, key=lambda key: best[key]):
        # Beside one rival nothing is certain: of the others it is enough that they are foretold to do as well.
        if rivals and best[key] < state.score + enough:
            rivals.append(key)
        elif key in alike or best[key] < near:
            start = search.replace(state, candidate.key, key, linear, scores)
            own = _with_both(model, key)
            worse[key] = start.score - own.score
            if start.score < own.score + enough or not _in_every_part(search, start, own, model.seed):
                rivals.append(key)
    rivals.sort(key=others.index)
    worse |= _pairs(model, {**rest, **gone}, ranked, candidate)
    for key, there in model.general.items():
        special = any(candidate.effect.name in c.effect.includes for c in search.pool if c.key == key)
        if special and _explained(search, there) - _explained(search, state) < SLIGHT * gain:
            continue  # what the simple law lacks is a trifle beside what it explains
        if special or _explained(search, search.without(there, candidate.key)) > _explained(search, state) + enough:
            rivals.append(key)
            worse[key] = _explained(search, state) - _explained(search, there)
    # A scale of thrust beside a free curve of it is another curve.
    rivals += [c.key for c in search.pool if c.key in now and candidate.effect.name in c.effect.includes]
    if candidate.effect.family in ("coupling", "mass") and search.of_kind(tuple(now), Kind.TERM):
        # Beside terms without a name, the model is nobody's physics: what moves alike may share a cause.
        rivals += [key for key in alike if key in now]
    rivals = list(dict.fromkeys(rivals))
    confidence = share_of_resamples(
        search, without.fit, state.fit, price, model.seed, search.is_material(without, state)
    )
    rival = min(worse, key=lambda key: worse[key], default="")
    before = _squares(search, without.vehicle, model.horizon)
    share = search.unique_share(without, state)
    removed, remains = _removed(before, squares, model.squares)
    drops = (without.fit.held_out - state.fit.held_out) / np.maximum(search.nominal_error, 1e-300)
    axis = int(drops.argmax())
    left, unexplained = _unexplained_ratio(search, state, candidate, share)
    return Evidence(
        candidate.key,
        candidate.kind,
        True,
        gain,
        share,
        held_out_drop(without.fit, state.fit, search),
        confidence,
        tuple(rivals),
        at_limit(candidate, search.nominal, state.vehicle),
        chance=model.rehearsals.chance(candidate.key),
        identity=min(worse.get(rival, _BEYOND), _BEYOND),
        rival=rival,
        worth=float(drops[axis]),
        rollout_worth=removed,
        remains=float(np.clip(state.fit.held_out[axis] / max(without.fit.held_out[axis], 1e-300), 0.0, 1.0))
        if remains is None
        else remains,
        residual_ratio=left if search.balance.forces else 0.0,
        unexplained=unexplained,
    )


def _only_beyond_limits(
    model: _Model, candidate: Candidate, without: Mapping[str, Option], shapes: Sequence[Option]
) -> set[str]:
    """Keys of the rivals of a candidate that explain as much only as no hull is, foretold so and refined.

    Parameters
    ----------
    without : the options of the model without the candidate
    shapes : of the rivals
    """
    search, state, known = model.search, model.state, {one.key: one for one in model.search.pool}
    stands: dict[str, bool] = {}
    for option in shapes:
        chosen = {**without, option.key: option}
        fit = search.fit(model.scores, list(chosen.values()))
        there = apply_fit(reset(state.vehicle, search.nominal, model.now, chosen), list(chosen.values()), fit)
        within = not beyond_any_hull(known[option.key], search.nominal, there)
        stands[option.key] = stands.get(option.key, False) or within
    foretold = [key for key, within in stands.items() if not within]
    refined = {key: search.replace(state, candidate.key, key, model.linear, model.scores).vehicle for key in foretold}
    return {key for key, there in refined.items() if beyond_any_hull(known[key], search.nominal, there)}


def _gains(
    search: Search, scores: GramScores, now: Mapping[str, Option], added: Sequence[tuple[Option, ...]]
) -> list[float]:
    """What a model would gain by each of some additions, as columns foretell; nothing where it would lose."""
    found = search.score_all_linearised(
        scores, [dict(now), *({**now} | {o.key: o for o in options} for options in added)]
    )
    return [max(found[0] - score, 0.0) for score in found[1:]]


def _with_both(model: _Model, key: str) -> State:
    """A model, or the same with a rival beside what it has, whichever is better.

    A name and its rival are told apart by the best model with the name and the best one without it: what only acts on
    other forces would be missing beside it as well, and is no reason to doubt it.
    """
    state, now = model.state, model.now
    option = max((o for o in model.linear.options[key] if o.present), key=lambda option: model.beside[option])
    if model.beside[option] <= 0.0:
        return state
    both = model.search.apply(state, now, {**now, key: option}, model.scores)
    return min(state, both, key=lambda s: s.score)


def _pairs(
    model: _Model, without: Mapping[str, Option], ranked: Mapping[float, Option], candidate: Candidate
) -> dict[str, float]:
    """How much worse the best pair of others is in the place of an effect, by both names, as columns foretell.

    Two scales of thrust are any third one: such a pair holds the name, and is no rival of it.
    """
    search, scores, gain = model.search, model.scores, model.beside
    best = [ranked[score] for score in sorted(ranked)[:_PAIRED]]
    scales = {c.key for c in search.pool if c.effect.name in _SCALES}
    own = scales if candidate.key in scales else set()
    pairs = [
        (one, other) for one, other in combinations(best, 2) if one.key != other.key and not {one.key, other.key} <= own
    ]
    if not pairs:
        return {}
    found = search.score_all_linearised(scores, [{**without, one.key: one, other.key: other} for one, other in pairs])
    beside = _gains(search, scores, model.now, pairs)
    most = [
        score + max(both, gain[one], gain[other])
        for score, both, (one, other) in zip(found, beside, pairs, strict=True)
    ]
    score, (one, other) = min(zip(most, pairs, strict=True), key=lambda pair: pair[0])
    return {f"{one.key} and {other.key}": score - model.state.score}


def _horizon(search: Search, state: State) -> float:
    """Length of the rollouts by which effects are weighed [s]: 10 s, or less where errors of their starts grow."""
    whole = ShootingSettings(horizon=WHOLE_HORIZON)
    return limit_horizon(whole, search.balance.motions, search.nominal, state.vehicle).horizon


def _squares(search: Search, vehicle: Vehicle, horizon: float) -> Array:
    """Squared velocity errors of rollouts, (starts, 3): from measured starts on a force balance, or those that judge.

    None of what a model claims: the motion is not its own.
    """
    if not isinstance(search.balance, WeakForm) or search.balance.claimed:
        return search.balance.squares(vehicle)
    return rollout_squares(search.balance.motions, vehicle, horizon)


def _removed(before: Array, after: Array, nominal: Array) -> tuple[float | None, float | None]:
    """Share of the nominal model's squared rollout error that an effect removes, on the axis where that is most.

    And what stays of that without the effect there, as a share of it; None where there are no rollouts.
    """
    if not len(nominal):
        return None, None
    whole = np.maximum(nominal.mean(axis=0), 1e-12)
    without, left = np.minimum(before.mean(axis=0), whole), after.mean(axis=0)
    removed = np.nan_to_num((without - left) / whole)
    axis = int(removed.argmax())
    return float(np.clip(removed[axis], -1.0, 1.0)), float(np.clip(left[axis] / max(without[axis], 1e-12), 0.0, 1.0))


def _unexplained_ratio(search: Search, state: State, candidate: Candidate, share: Array) -> tuple[float, float]:
    """Force that a model surely leaves beyond noise on the axes of an effect: as a multiple of its own, of the nominal.

    The mean square of as many independent tests of noise alone is below `most` times the noise in 97.5 % of logs.
    """
    axes = [p.axis for p in candidate.parameters if p.axis is not None] or [int(np.argmax(share))]
    most = largest_mean_square(search.balance.independent)
    noise, unit = most * search.noise_error**2, search.share_scale**2
    left, before = (
        float((np.maximum(error - noise, 0.0) / unit)[axes].sum())
        for error in (state.fit.held_out, search.nominal_error)
    )
    own = float((share[axes] ** 2).sum())
    return float(np.sqrt(left / max(own, 1e-12))), float(np.sqrt(left / max(before, left, 1e-12)))


def _in_every_part(search: Search, rival: State, state: State, seed: int) -> bool:
    """Whether a model beats a rival in nine of ten draws of a log's blocks, lest one decide; of rollouts not asked."""
    if not search.balance.forces:
        return True
    own, others = (model.score + _explained(search, model) for model in (state, rival))
    return share_of_resamples(search, rival.fit, state.fit, own - others, seed, matters=True) >= SURE


def _not_selected(model: _Model, candidate: Candidate, whole: Fit) -> Evidence:
    search, linear, scores, now = model.search, model.linear, model.scores, model.now
    present = [option for option in linear.options[candidate.key] if option.present]
    base = search.score(whole, list(now.values()))
    fits = search.fits(scores, [[*now.values(), option] for option in present])
    ranked = zip(fits, present, strict=True)
    fit, option = min(ranked, key=lambda pair: search.score(pair[0], [*now.values(), pair[1]]))
    gain = base - search.score(fit, [*now.values(), option])
    share = np.sqrt(np.maximum(whole.held_out - fit.held_out, 0.0)) / search.share_scale
    price = search.price(search.fit(scores, [option]), [option])
    return Evidence(
        candidate.key,
        candidate.kind,
        False,
        gain,
        share,
        held_out_drop(whole, fit, search),
        share_of_resamples(search, whole, fit, price, model.seed, bool((share >= search.settings.materiality).any())),
        (),
    )


def held_out_drop(without: Fit, within: Fit, search: Search) -> float:
    """Held-out force error that an effect removes beside the others, as a share of the nominal model's error, 0..1.

    On the axis where that share is largest.

    Parameters
    ----------
    without, within : fits of the model without the effect and with it
    search : whose nominal error is the unit
    """
    nominal = np.sqrt(np.maximum(search.nominal_error, 1e-300))
    drop = (np.sqrt(without.held_out) - np.sqrt(within.held_out)) / nominal
    return float(np.clip(drop.max(), 0.0, 1.0))


def share_of_resamples(
    search: Search, without: Fit, within: Fit, price: float, seed: int, matters: bool, axis: int | None = None
) -> float:
    """Share of block resamples in which an effect earns its price (on one axis, if given); none if it matters not.

    Parameters
    ----------
    search : whose balance, floor and number of independent tests count
    without, within : fits of the model without the effect and with it
    price : log-likelihood that the effect must gain
    seed : of the draws of blocks
    matters : whether the effect is material at all
    axis : 0 to 2; None for all together
    """
    blocks = without.held_out_blocks.shape[0]
    weights = block_weights(blocks, _DRAWS, seed) / search.balance.time.size
    before, after = (np.maximum(weights @ fit.held_out_blocks, 0.0) for fit in (without, within))
    gain = 0.5 * search.balance.independent * (np.log(before + search.floor) - np.log(after + search.floor))
    gain = gain.sum(axis=1) if axis is None else gain[:, axis]
    return share_of_draws((gain > price) & matters)


def in_place_of(e: Evidence, rivals: tuple[str, ...]) -> Evidence:
    """The evidence on an effect that was only found where rivals were left out that explain the log as well."""
    return replace(
        e, indistinguishable_from=(*e.indistinguishable_from, *rivals), rival=rivals[0], identity=min(e.identity, 0.0)
    )


def limit_confidence(evidence: Sequence[Evidence], form: Balance) -> list[Evidence]:
    """The evidence with no more confidence than a sign test's, 1 - 2^(1 - blocks): few may all agree by chance."""
    most = 1.0 - 0.5 ** (form.blocks - 1)
    return [replace(e, confidence=min(e.confidence, most)) for e in evidence]
