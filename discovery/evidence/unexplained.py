"""Unexplained force: what no model explains, what lasts, what moves a quiet axis, and how often terms are included.

A balance is white where all effects and terms at once leave no more than white sensor noise. Sensor noise and short
waves have no mean over some seconds; a cause outside the catalogue has. On a quiet axis, whose floor is several times
the noise, structure may be certain although nothing is named: the effects that explain it about equally well are given
as one group. Inclusion is the share of block-bootstrap draws that select a term (Fasel et al. 2022,
doi:10.1098/rspa.2021.0904, with blocks in place of rows).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...measurements.statistics.blocks import block_draws
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import AXES, FORCE_UNITS, Array, body_to_earth
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..balance.starts import HORIZON
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Kind
from ..candidates.linearisation import Linearisation
from ..candidates.unnamed_terms import features_along
from ..effect_findings import LIKELY
from ..findings import PersistentResidual
from ..identifiability.identifiable_effects import LEAST_SIGNAL
from ..identifiability.rehearsal import Identifiability
from ..search.floating import Search, State
from ..search.scoring import ALIVE, MATERIAL, MOST, SLIGHT, TELL_APART
from .unmodelled_forces import MOST_FORMS
from .weighing import SURE, Evidence, share_of_resamples

DIRECTIONS = ("north-south", "east-west")
"""Beside the axes of the hull, what a force may keep to."""
_ONE_SIDED = 1.645
"""Standard errors beyond which chance leads in one of twenty cases."""


def find_persistent_residuals(forces: Search, judge: Balance, found: Vehicle) -> tuple[PersistentResidual, ...]:
    """Persistent residuals: material, lasting, and hardly less with the model found than with the nominal one.

    By axis, and by direction: what water or air push while a boat turns lasts to the north and east, and on no axis.

    Parameters
    ----------
    forces : the search on the force balance, with the nominal vehicle
    judge : the balance that judged, of forces or of rollouts
    found : the model with everything that the search selected, sure or not
    """
    weak = forces.balance
    assert isinstance(weak, WeakForm), "what lasts is looked for on the force balance"
    after, before = (_with_directions(weak, weak.residual(vehicle)) for vehicle in (found, forces.nominal))
    (lasting, sure), (usual, _) = (_lasting(rest, weak.time) for rest in (after, before))
    scale = np.append(forces.force_scale, [forces.force_scale[:2].max()] * 2)
    little = lasting > MOST * usual
    if not judge.forces:
        stays = _size(judge.residual(found)) > MOST * _size(judge.residual(forces.nominal))
        little &= np.append(stays, [stays[:2].any()] * 2)
    seen = np.append(~forces.quiet, [bool((~forces.quiet[:2]).all())] * 2)
    left = seen & little & sure & (lasting > MATERIAL * scale) & (lasting > MOST * _size(after))
    left[3:] &= not left[:2].any()  # a boat that goes one way has one force on an axis and to a side
    names, unit = (*AXES, *DIRECTIONS), (*weak.unit, *weak.unit[:2])
    return tuple(
        PersistentResidual(axis=names[k], force=float(lasting[k]), share=float(lasting[k] / scale[k]), unit=unit[k])
        for k in sorted(np.flatnonzero(left).tolist(), key=lambda k: -lasting[k] / scale[k])
    )


def _with_directions(weak: WeakForm, rest: Array) -> Array:
    """A rest (tests, 3) on the axes, and the same to the north and to the east, (tests, 5) [N, N, N m, N, N]."""
    turned = weak.average([np.column_stack([np.sin(m.heading), np.cos(m.heading)]) for m in weak.motions])
    return np.column_stack([rest, *body_to_earth(np.arctan2(*turned.T), rest[:, 0], rest[:, 1])])


def find_passing_residuals(forces: Search, found: Vehicle) -> dict[str, float]:
    """Shares of the force at work that a model leaves beyond sensor noise, by axis, largest first; material ones alone.

    Parameters
    ----------
    forces, found : as in `find_persistent_residuals`
    """
    beyond = _size(forces.balance.residual(found)) ** 2 - forces.noise_error**2
    share = np.sqrt(np.maximum(beyond, 0.0)) / forces.force_scale
    material = np.flatnonzero(~forces.quiet & (share > MATERIAL)).tolist()
    return {AXES[axis]: float(share[axis]) for axis in sorted(material, key=lambda axis: -share[axis])}


def _lasting(rest: Array, time: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Size (k,) of the force in a rest (tests, k) that lasts for 5 to 10 s, and whether there surely is one.

    The mean force that noise n of a speed feigns by inertia over T goes with (n(t + T) - n(t)) / T: whatever its
    colour, over twice the time it is half, where a force that lasts stays. From both follows the force (Richardson's
    extrapolation), and what such noise feigns by damping.
    """
    means = [_means(rest, _pieces(time, by * HORIZON)) for by in (1.0, 2.0)]
    short, long = (np.square(_size(each)) for each in means)
    chance = _ONE_SIDED * np.sqrt(2.0 / len(means[1]))  # of a mean of squares, relative
    return np.sqrt(np.maximum(4.0 * long - short, 0.0) / 3.0), 4.0 * (1.0 - chance) * long > short


def _pieces(time: Array, seconds: float) -> NDArray[np.int64]:
    """Numbers of the pieces of so many seconds that tests belong to; one ends where the time leaps or begins anew."""
    step = np.diff(time, prepend=time[0])
    leaps = (step < 0.0) | (step > HORIZON)
    begun = time[np.maximum.accumulate(np.where(leaps, np.arange(time.size), 0))]
    within = ((time - begun) / seconds).astype(np.int64)
    return np.cumsum((np.diff(within, prepend=0) != 0) | leaps)


def _means(rest: Array, pieces: NDArray[np.int64]) -> Array:
    """Means of a rest (tests, k) over its pieces, without those that are hardly begun, (pieces, k)."""
    tests = np.bincount(pieces)
    sums = np.column_stack([np.bincount(pieces, column) for column in rest.T])
    return (sums / np.maximum(tests, 1)[:, None])[tests > 0.5 * tests.max()]


def _size(rest: Array) -> Array:
    return np.sqrt((rest**2).mean(axis=0))


@dataclass(frozen=True, slots=True)
class Suspect:
    """An effect that would explain faint structure on an axis.

    Attributes
    ----------
    key : the candidate
    gain : log-likelihood that it earns on all axes, its price paid
    confidence : share of block resamples in which it earns its price on that axis alone
    clear : False when its columns are hardly more than sensor noise, which then decides its gain
    """

    key: str
    gain: float
    confidence: float
    clear: bool


def find_suspects(search: Search, state: State, known: Identifiability, axis: int, seed: int) -> tuple[Suspect, ...]:
    """The effects any of which would explain what moves a quiet axis, best first; none where nothing is certain.

    Each is added to the model and fitted. It must earn its price on that axis alone in nine of ten resamples, and on
    all axes together. Those within `TELL_APART` of the best one explain the log as well. An effect whose columns are
    hardly more than noise is never the best beside others, since noise inflates its gain, but it is not ruled out.

    Parameters
    ----------
    state : the model that the search ended with
    known : what the log can show about it
    axis : index of a quiet axis
    """
    close = Search(search.balance, search.nominal, search.pool, replace(search.settings, loud=1.0))  # the noise itself
    model = close.evaluate(state.vehicle, state.active)
    linear, scores, now = close.about(model)
    found = []
    for candidate in close.pool:
        if candidate.key in now or candidate.kind is not Kind.EFFECT:
            continue
        changes = [{**now, candidate.key: option} for option in linear.options[candidate.key] if option.present]
        best = min(changes, key=lambda change: close.score_linearised(scores, change))
        if close.score_linearised(scores, best) > model.score - close.settings.margin:
            continue
        trial = close.apply(model, now, best, scores)
        option = best[candidate.key]
        price = close.price(close.fit(scores, [option]), [option])
        confidence = share_of_resamples(close, model.fit, trial.fit, price, seed, True, axis)
        if trial.score < model.score - close.settings.margin and confidence >= SURE:
            clear = known.excitation[candidate.key].signal_to_noise >= LEAST_SIGNAL
            found.append(Suspect(candidate.key, model.score - trial.score, confidence, clear))
    enough = max((s.gain for s in found if s.clear), default=max((s.gain for s in found), default=0.0)) - TELL_APART
    return tuple(sorted((s for s in found if s.gain >= enough), key=lambda s: (not s.clear, -s.gain)))


def add_faint_structure(
    search: Search, state: State, known: Identifiability, evidence: Sequence[Evidence], seed: int
) -> list[Evidence]:
    """The evidence, with the effects that would explain what moves a quiet axis told as look-alikes of one another.

    Parameters
    ----------
    search, state : the search and the model that it ended with
    known : which candidates the log excites and tells apart
    evidence : of all candidates, selected ones first
    seed : of the draws of blocks
    """
    told = list(evidence)
    for axis in np.flatnonzero(search.quiet).tolist():
        group = find_suspects(search, state, known, axis, seed)
        members = {e.key: e for e in told}
        joined = [_joined(members[s.key], s, group, AXES[axis]) for s in group if not members[s.key].faint]
        rest = [e for e in told if e.key not in {j.key for j in joined}]
        chosen = sum(e.selected or bool(e.faint) for e in rest)
        told = [*rest[:chosen], *joined, *rest[chosen:]]
    return told


def _joined(e: Evidence, suspect: Suspect, group: Sequence[Suspect], axis: str) -> Evidence:
    """The evidence of a suspect, with its part of what a group may have: together it is no more than possible."""
    others = (s.key for s in group if s.key != e.key)
    alike = tuple(dict.fromkeys((*e.indistinguishable_from, *others)))
    part = LIKELY * suspect.confidence / (1 + len(alike))
    return replace(e, faint=axis, confidence=part, indistinguishable_from=alike)


_TRIED = 4
"""Terms that are tried in full before one is taken: those that lower the in-sample error most."""


def inclusion(search: Search, state: State, seed: int, draws: int = 100) -> dict[str, float]:
    """Share of block draws in which each term of the search's pool is selected beside the named effects, by symbol.

    Terms that are never selected are left out. Columns are those about the final model, without its terms.

    Parameters
    ----------
    seed : of the draws
    """
    linear, scores, now = search.about(state)
    terms = search.of_kind([candidate.key for candidate in search.pool], Kind.TERM)
    base = {key: option for key, option in now.items() if key not in terms}
    base |= {key: linear.options[key][1] for key in state.active if key in terms}
    present = {key: next(option for option in linear.options[key] if option.present) for key in terms}
    chosen = dict.fromkeys(terms, 0)
    for draw in block_draws(scores.blocks, draws, seed):
        drawn, model = scores.drawn(draw), dict(base)
        best = search.score_linearised(drawn, model)
        for _ in range(MOST_FORMS):
            rest = [key for key in terms if key not in model or not model[key].present]
            gains = drawn.screen(list(model.values()), [present[key] for key in rest])
            rest = [rest[n] for n in np.argsort(-gains, kind="stable")[:_TRIED]]
            tried = search.score_all_linearised(drawn, [{**model, key: present[key]} for key in rest])
            found = min(zip(tried, rest, strict=True), default=None)
            if found is None or found[0] >= best - search.settings.margin:
                break
            best, key = found
            model[key] = present[key]
        for key in terms:
            chosen[key] += key in model and model[key].present
    return {key: number / draws for key, number in chosen.items() if number}


_CLEAN = 0.2
"""Share of the force scale that a coloured error of a log without sensor noise, as simulators write it, must reach to
be worth the slower search on rollouts; of another `SLIGHT`."""
_LOUD, _SENSED = 9.0, 1e-3
"""Times what white noise makes from which an error is coloured, however small a share of the force it is, and noise of
sensors from which that is asked [m/s, rad/s]: short field logs leave 9.4 to 130 on some axis, simulated up to 8."""
_ENOUGH, _STRICTER = 200.0, (2.5, 2.0)
"""Independent tests below which structure is left in any log, and how much higher both thresholds then are."""
_TESTS_A_COLUMN = 3.0
"""Independent tests for each free factor at least, which regularises a fit of all: with fewer, factors fit noise and
nothing would look coloured."""
_NEW = 1e-6
"""Share of its square that a column must keep beside others to be a new one: less of it is noise and rounding."""
_RANK = 1e-7
"""Share of the largest singular value below which a direction is rounding: some times the root of double precision."""


@dataclass(frozen=True, slots=True)
class Unexplained:
    """Residual of the balance when every effect and every term up to degree three is fitted at once.

    Attributes
    ----------
    error : (3,) root mean square force [N, N, N m]
    noise : (3,) what white sensor noise makes [N, N, N m]
    share : (3,) error over the force scale
    independent : effective number of independent tests
    sensed : the log has sensor noise, as no simulator's exact state has
    """

    error: Array
    noise: Array
    share: Array
    independent: float
    sensed: bool

    @property
    def sentence(self) -> str:
        """The reason for rollouts, with numbers."""
        texts = [
            f"{axis} {e:.2g} {unit} (white noise {n:.2g})"
            for axis, e, n, unit, far in zip(AXES, self.error, self.noise, FORCE_UNITS, self.coloured, strict=True)
            if far
        ]
        return (
            f"no model of the catalogue explains the force balance of this log to within white sensor noise: "
            f"{', '.join(texts)} stay; effects are judged by open-loop rollouts instead"
        )

    @property
    def coloured(self) -> np.ndarray:
        """(3,) True for an axis whose error is coloured and material."""
        material = SLIGHT if self.noise.any() else _CLEAN
        louder, larger = (1.0, 1.0) if self.independent >= _ENOUGH else _STRICTER
        large = (self.error > louder * ALIVE * self.noise) & (self.share > larger * material)
        return large | ((self.error > _LOUD * self.noise) & self.sensed)


def fit_all_forces(weak: WeakForm, search: Search, more: Array | None = None) -> Unexplained:
    """Fit the measured acceleration by all forces of a search about its nominal model, and see what is left.

    Each axis gets every thruster's force, every shape of every effect, all unnamed terms up to degree three, and terms
    that turn with the heading as a strong current's do, each with a free factor: an upper limit of what any model of
    the catalogue could explain, whatever its mass. The columns are those that the search needs anyway; a short log gets
    their main directions only, three independent tests each.

    Parameters
    ----------
    more : forces beside them (tests, 3, columns)
    """
    linear, features = _forces(weak, search)
    inertia = {i for c in search.pool if c.effect.family == "mass" for o in linear.options[c.key] for i in o.free}
    forces = [i for i in range(linear.columns.shape[2] - 1) if i not in inertia]
    rates = weak.derivative([motion.velocity for motion in weak.motions])
    error = np.zeros(3)
    for axis in range(3):
        other = rates[:, [(2,), (2,), (0, 1)][axis]]  # through m13 and m23, which y_g and x_g make
        beside = [] if more is None else [more[:, axis]]
        columns = _unit_length(np.column_stack([linear.columns[:, axis, forces], features, other, *beside]))
        vectors, values, _ = np.linalg.svd(columns, full_matrices=False)
        rank = min(int((values > _RANK * values[0]).sum()), int(weak.independent / _TESTS_A_COLUMN))
        vectors = vectors[:, :rank]
        left = rates[:, axis] - vectors @ (vectors.T @ rates[:, axis])
        error[axis] = np.sqrt((left**2).mean() * weak.independent / (weak.independent - rank))
    mass = np.diag(mass_matrix(search.nominal))
    share = error * mass / search.share_scale
    return Unexplained(error * mass, search.noise_error, share, weak.independent, has_sensor_noise(weak))


def residual_of_few_forces(weak: WeakForm, search: Search, most: int) -> Array:
    """Residual of the few best forces on each axis, (3,) mean squares: those that explain most of the nominal model's.

    Each has a free factor on each axis, and is the one that takes most beside those before it: orthogonal matching
    pursuit (Pati, Rezaiifar and Krishnaprasad 1993, doi:10.1109/ACSSC.1993.342465). What a search calibrates in every
    model is fitted beside them and does not count.

    Parameters
    ----------
    most : forces on an axis; a log has many more independent tests
    """
    linear, features = _forces(weak, search)
    calibrated = [i for key in search.nuisances for o in linear.options[key] for i in o.free if i >= 0]
    error = np.zeros(3)
    for axis in range(3):
        left, rest = linear.columns[:, axis, -1], np.column_stack([linear.columns[:, axis, :-1], features])
        if calibrated:
            known, _ = np.linalg.qr(_unit_length(linear.columns[:, axis, calibrated]))
            left, rest = left - known @ (known.T @ left), rest - known @ (known.T @ rest)
        rest = _unit_length(rest)
        for _ in range(min(most, rest.shape[1])):
            squares = (rest**2).sum(axis=0)
            gains = np.divide((left @ rest) ** 2, squares, out=np.zeros(squares.size), where=squares > _NEW)
            best = int(gains.argmax())
            unit = rest[:, best] / np.sqrt(max(squares[best], _NEW))
            left, rest = left - unit * (unit @ left), rest - np.outer(unit, unit @ rest)
        error[axis] = (left**2).mean() * weak.independent / (weak.independent - most)
    return error


def _forces(weak: WeakForm, search: Search) -> tuple[Linearisation, Array]:
    """All columns of a search about its nominal model, and all terms up to degree three, of unit mass."""
    linear, _ = search.linearise(search.nominal, ())
    return linear, np.column_stack([features_along(weak, search.nominal, 3)[1], _turned(weak)])


def _unit_length(columns: Array) -> Array:
    """Columns of unit length, without those that are nothing."""
    size = np.sqrt((columns**2).sum(axis=0))
    return np.asarray(columns[:, size > 0] / size[size > 0])


def has_sensor_noise(weak: WeakForm) -> bool:
    """True when sensors made the log: the exact state of a simulator has no noise, white or coloured."""
    return bool(weak.noise.max() >= _SENSED)


def _turned(weak: WeakForm) -> Array:
    """Velocities and their moduli times the cosine and the sine of the heading, tested, (tests, 12)."""
    series = []
    for motion in weak.motions:
        speeds = np.column_stack([motion.velocity, np.abs(motion.velocity)])
        series.append(
            np.column_stack([speeds * np.cos(motion.heading)[:, None], speeds * np.sin(motion.heading)[:, None]])
        )
    return weak.average(series)
