"""A boat that changes while its logs are recorded: from some instant on, one effect has another size.

Where no model of one boat explains a force balance, each effect of the catalogue is tried with a second size from each
of some instants on (a structural change at an unknown date: Andrews 1993, doi:10.2307/2951764; Bai and Perron 1998,
doi:10.2307/2998540). A model of such a change and of effects beside it must be beyond doubt better than what the search
finds without it, and so must the change than any law without a name; one that is there from the same instant on, or
until then, must do no better. No vehicle file holds two boats: effects are then searched for in the rows since then, as
the boat is now, or in those before where these are over twice as many.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, floor, inf

import numpy as np
from numpy.typing import NDArray

from ..measurements.preparation.prepare import LEAST_SEGMENT
from ..measurements.prepared_logs import Inputs
from ..physics.motion import Array, Motion
from ..physics.stage import Say, Stage
from .balance.weak_form import WeakForm
from .basis import Basis
from .candidates.candidate import Candidate, Kind
from .candidates.unnamed_terms import FINE, free_forms
from .effect_findings import FittedTerm
from .evidence.invariance import ERRORS, LEAST_SHARE, fitted_by_blocks
from .evidence.weighing import CERTAINLY
from .findings import BoatChange, Findings
from .search.estimation import Interval
from .search.floating import Search, State
from .search.rival_explanations import RecordErrorFit, has_residual_structure, search_with_record_errors
from .search.scoring import MOST, TELL_APART
from .selection import search_of
from .water_of_logs import find_flows

_LIKELIHOOD_RATIO = 1.92
"""Log-likelihood within which an instant lies in its 95 % interval: half the quantile of chi-squared with one degree of
freedom (Wilks 1938)."""
_OF_TIME = re.compile(r"\b(time|from)\b")
"""A form that sets in, or grows with the time."""
_NONE = 1e-12
"""Square of a column without any: it stands for none."""


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """An effect with a second size: its columns (tests, 3, numbers), and what noise adds to them in each copy."""

    candidate: Candidate
    symbols: tuple[str, ...]
    columns: Array
    noise: Array

    def since(self, first: int, columns: Array | None = None) -> Array:
        """Its columns (or the copies of their noise) from a test on."""
        return (self.columns if columns is None else columns) * (np.arange(len(self.columns)) >= first)[:, None, None]


@dataclass(frozen=True, slots=True, eq=False)
class _Instants:
    """When tests lie, minutes and the numbers of their logs (tests,), of which there are `sources`."""

    minutes: Array
    logs: NDArray[np.int64]
    sources: tuple[str, ...]

    @property
    def begins(self) -> list[int]:
        """The first tests of all logs but the first."""
        return (np.flatnonzero(np.diff(self.logs)) + 1).tolist()

    @property
    def coarse(self) -> list[int]:
        """Tests from which a change is tried: parts of all rows, and where one of several logs begins."""
        tests = self.logs.size
        return sorted({*(tests * part // FINE for part in range(1, FINE) if part in self._inner(FINE)), *self.begins})

    def near(self, first: int) -> range:
        """Tests about one of these, as far as the next ones; that alone where a log begins."""
        reach, inner = max(self.logs.size // FINE, 1), self._inner(self.logs.size)
        if first in self.begins:
            return range(first, first + 1)
        return range(max(first - reach, inner.start), min(first + reach, inner.stop), max(reach // FINE, 1))

    def about(self, first: int) -> range:
        """Every test about one of these, as far as the next; that alone where a log begins."""
        if first in self.begins:
            return range(first, first + 1)
        step, inner = self.near(first).step, self._inner(self.logs.size)
        return range(max(first - step, inner.start), min(first + step + 1, inner.stop))

    @staticmethod
    def _inner(size: int) -> range:
        """Places of so many that leave enough on both sides to know two boats (Andrews 1993, section 3)."""
        return range(ceil(LEAST_SHARE * size), floor((1.0 - LEAST_SHARE) * size) + 1)


@dataclass(frozen=True, slots=True, eq=False)
class _Best:
    """The second size that takes most of what a model leaves, and what others take.

    Attributes
    ----------
    trial, first : the effect, and the test from which it has that size
    gain : what it takes
    profile : the same from other tests on
    others : the most that each other effect takes
    """

    trial: _Trial
    first: int
    gain: float
    profile: dict[int, float]
    others: dict[str, float]

    @property
    def changed(self) -> _Trial:
        """The effect from that test on."""
        trial = self.trial
        return replace(trial, columns=trial.since(self.first), noise=trial.since(self.first, trial.noise))


def find_change(basis: Basis, say: Say) -> BoatChange | None:
    """Find the effect that has another size from some instant on, where no model of one boat explains the logs.

    Parameters
    ----------
    basis : of all logs; None comes where rollouts judge it, whose noise is not white
    say : told a line for each step
    """
    if basis.uses_rollouts or basis.forces.claimed:
        return None
    if any(find_flows(basis)):  # of logs, each in a water or a wind of its own, no boat has changed
        return None
    search, _ = search_of(basis)
    static = search.run(progress=say)
    if not has_residual_structure(search, static):
        return None
    say(Stage("no model of one boat explains the logs: looking for one that changes"))
    empty, when = search.evaluate(search.nominal, ()), _instants(basis.forces)
    effects = list(_effects(search, empty))
    if not effects:
        return None
    begun = [_best(search, state, effects, when) for state in (empty, static)]
    apart = {(best.trial.candidate.key, best.first): best for best in begun}
    fits = [(_search_beside(search, best.changed, empty), best) for best in apart.values()]
    none = effects[0].columns[:, :, :0]
    alone = RecordErrorFit(search, none, static)

    def holds(fit: RecordErrorFit, best: _Best) -> bool:
        """Whether a change earns its sizes and its instant beyond doubt, and explains most of what its model leaves."""
        least = CERTAINLY + search.settings.price * (len(best.trial.symbols) + 1)
        if min(fit.earned, alone.worth() - fit.worth()) < least:
            return False
        left = min(search.unexplained(one.error) for one in (alone, RecordErrorFit(search, none, fit.state)))
        return search.unexplained(fit.error) <= MOST * left

    sure = [fit for fit, best in fits if holds(fit, best)]
    if not sure:
        return None
    fit = min(sure, key=lambda one: one.worth())
    best = _best(search, fit.state, effects, when)
    always, there = _best_forms(search, fit.state, basis.forces, best)
    if always > best.gain - CERTAINLY or there > best.gain + TELL_APART:
        return None  # a law without a name may do it: in one log many things go with the time
    return _told(search, fit.state, best, when)


def searched(change: BoatChange, sources: Sequence[str], motion: Motion) -> tuple[Motion, ...]:
    """The rows of a motion on the side of a change on which effects are searched for; none where it has none there.

    Parameters
    ----------
    sources : of the motions of all logs, in their order
    """
    own = sources.index(motion.source)  # a log that was moved has another name, and its place
    first = int(np.searchsorted(motion.minutes, -inf if change.minute is None else change.minute))
    if own != change.place:
        first = motion.time.size if own < change.place else 0
    start, stop = (first, motion.time.size) if change.since else (0, first)
    return (motion.slice(start, stop),) if (stop - start) * motion.time_step >= LEAST_SEGMENT else ()


def part_searched(inputs: Inputs, change: BoatChange | None) -> Inputs:
    """The part of the logs on which effects are searched for; all of them where no boat changes."""
    return inputs if change is None else inputs.within(partial(searched, change, list(inputs.starts)))


def with_change(findings: Findings, change: BoatChange) -> Findings:
    """Findings of one part of the logs, and what tells it from the other, so that nothing missing is no verdict."""
    told = findings.but(change=change, reasons=(change.in_words, *findings.reasons))
    if findings.verdict != "nothing missing":
        return told
    headline = findings.headline or "Nothing else is missing that this log can show."
    return told.but(verdict="undecided", headline=headline)


def _effects(search: Search, empty: State) -> Iterator[_Trial]:
    """Each effect that is one size of something."""
    linear, _ = search.linearise(search.nominal, empty.active)
    for candidate in search.pool:
        _, *others = linear.options[candidate.key]
        present = [option for option in others if option.present]
        if candidate.kind is not Kind.EFFECT or candidate.effect.general or len(present) != 1:
            continue
        numbers = present[0].numbers
        at = [number.column for number in numbers]
        if at and (linear.columns[:, :, at] ** 2).sum() > _NONE:
            symbols = tuple(number.symbol for number in numbers)
            yield _Trial(candidate, symbols, linear.columns[:, :, at], linear.noise[..., at])


def _instants(weak: WeakForm) -> _Instants:
    sources = tuple(dict.fromkeys(motion.source for motion in weak.motions))
    logs = np.array([sources.index(motion.source) for motion in weak.motions])[weak.reach[0]]
    return _Instants(weak.average([m.minutes[:, None] for m in weak.motions])[:, 0], logs, sources)


class _Rest:
    """What a model leaves, all axes below one another and weighted, and what columns beside its own take of it."""

    def __init__(self, search: Search, state: State) -> None:
        linear, _, now = search.about(state)
        error = RecordErrorFit(search, linear.columns[:, :, :0], state).error
        self._weight = 1.0 / np.sqrt(error + search.floor)
        own = [column for option in now.values() for column in option.free if column >= 0]
        self._basis = np.linalg.qr(self._laid(linear.columns[:, :, own]))[0]
        self._rest = self._beside(linear.columns[:, :, -1:])[:, 0]

    def _laid(self, columns: Array) -> Array:
        weighted = (columns * self._weight[None, :, None]).transpose(1, 0, 2)
        return weighted.reshape(-1, columns.shape[2])

    def _beside(self, columns: Array) -> Array:
        rows = self._laid(columns)
        return rows - self._basis @ (self._basis.T @ rows)

    def without(self, columns: Array) -> None:
        """Take out what more columns take, too."""
        more = self._beside(columns)
        basis = np.linalg.qr(more[:, (more**2).sum(axis=0) > _NONE])[0]
        self._rest = self._rest - basis @ (basis.T @ self._rest)
        self._basis = np.hstack([self._basis, basis])

    def gain(self, columns: Array) -> float:
        """Half the square that columns (tests, 3, n) take together: about the log-likelihood that they earn."""
        rows = self._beside(columns)
        size = np.sqrt((rows**2).sum(axis=0))
        rows = rows[:, size > _NONE] / size[size > _NONE]
        return 0.5 * float(np.linalg.lstsq(rows, self._rest, rcond=1e-9)[0] @ (rows.T @ self._rest))

    def gains(self, columns: Array) -> Array:
        """The same of each column alone, (n,)."""
        rows = self._beside(columns)
        return 0.5 * np.square(rows.T @ self._rest) / np.maximum((rows**2).sum(axis=0), _NONE)


def _best(search: Search, state: State, effects: Sequence[_Trial], when: _Instants) -> _Best:
    """The effect, and the instant, that take most of what a model leaves."""
    rest = _Rest(search, state)

    constant = {trial.candidate.key: rest.gain(trial.columns) for trial in effects}

    def gain(trial: _Trial, first: int) -> float:
        """What an effect takes that begins at a test, or has one size before and one since; little where one does."""
        own = trial.since(first)
        both = rest.gain(np.concatenate([trial.columns, own], axis=2))
        changes = both - constant[trial.candidate.key]
        return max(rest.gain(own), both - search.settings.price) if changes >= CERTAINLY else changes

    gains = {(place, first): gain(trial, first) for place, trial in enumerate(effects) for first in when.coarse}
    place, coarse = max(gains, key=lambda pair: gains[pair])
    trial = effects[place]
    profile = {first: gain(trial, first) for first in when.near(coarse)}
    first = max(profile, key=lambda at: profile[at])
    profile |= {at: gain(trial, at) for at in when.about(first) if at not in profile}
    first = max(profile, key=lambda at: profile[at])
    others = {
        other.candidate.key: max(gains[k, at] for at in when.coarse) + profile[first] - gains[place, coarse]
        for k, other in enumerate(effects)
        if k != place
    }
    return _Best(trial, first, profile[first], profile, others)


def _best_forms(search: Search, state: State, weak: WeakForm, best: _Best) -> tuple[float, float]:
    """The most that a free form on an axis takes, whatever it follows but the time.

    Once beside one size of the effect all the time; once in its place, since the same instant or before it.
    """
    rest, forms = _Rest(search, state), free_forms(weak, search.nominal)
    columns = forms.columns[:, [place for place, name in enumerate(forms.names) if not _OF_TIME.search(name)]]
    alone = rest.gain(best.trial.columns)
    since = (np.arange(len(columns)) >= best.first)[:, None]
    there = max(_most(rest, columns * side) for side in (since, ~since))
    rest.without(best.trial.columns)
    return alone + _most(rest, columns), there


def _most(rest: _Rest, columns: Array) -> float:
    """The most that one of some columns (tests, n) takes on any axis."""
    return max(float(rest.gains(columns[:, None] * np.eye(3)[axis][None, :, None]).max()) for axis in range(3))


def _search_beside(search: Search, trial: _Trial, empty: State) -> RecordErrorFit:
    """The model to which the nominal one leads beside a second size: a usual one makes as much as that model leaves."""
    rest = np.sqrt(search.nominal_error)
    share = np.sqrt((trial.columns**2).mean(axis=0)) / np.maximum(rest, _NONE)[:, None]
    usual = np.maximum(share.max(axis=0), _NONE)
    return search_with_record_errors(search, trial.columns / usual, empty, trial.noise / usual)


def _told(search: Search, state: State, best: _Best, when: _Instants) -> BoatChange:
    """The change beside a model in facts: the instant, the sizes, and which other effects would do as well."""
    first, inside = best.first, best.first not in when.begins
    likely = (at for at, gain in best.profile.items() if gain >= best.gain - _LIKELIHOOD_RATIO)
    within = [at for at in likely if when.logs[at] == when.logs[first]]
    own = np.flatnonzero(when.logs == when.logs[first])
    low, high = np.clip([min(within) - 1, max(within) + 1], own[0], own[-1])  # it lies between two tests
    ends = Interval(float(when.minutes[low]), float(when.minutes[high]))
    return BoatChange(
        effect=best.trial.candidate.key,
        log=when.sources[when.logs[first]],
        place=int(when.logs[first]),
        logs=len(when.sources),
        minute=float(when.minutes[first]) if inside else None,
        minutes95=ends if inside else None,
        terms=_sizes(search, state, best.changed),
        alike=tuple(key for key, gain in best.others.items() if gain > best.gain - TELL_APART),
        since=when.logs.size - first >= MOST * first,
    )


def _sizes(search: Search, state: State, trial: _Trial) -> tuple[FittedTerm, ...]:
    """By how much each number of an effect changes, with its 95 % interval, beside the model fitted anew."""
    linear, scores, now = search.about(state)
    own = [column for option in now.values() for column in option.free if column >= 0]
    weight = np.sqrt(scores.weight)[:, None]
    rows = np.concatenate([trial.columns, linear.columns[:, :, [*own, -1]]], axis=2) * weight
    noise = np.concatenate([trial.noise, linear.noise[..., [*own, -1]]], axis=3) * weight
    laid = rows.transpose(1, 0, 2).reshape(-1, rows.shape[2])
    copies = noise.transpose(0, 2, 1, 3).reshape(noise.shape[0], *laid.shape)
    change, covariance = fitted_by_blocks(laid, list(copies), np.tile(search.balance.block, 3))
    reach = ERRORS * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    units = {p.symbol: p.unit for p in trial.candidate.parameters}
    return tuple(
        FittedTerm(symbol=s, value=float(v), unit=units[s], ci95=Interval(float(v - w), float(v + w)))
        for s, v, w in zip(trial.symbols, change, reach, strict=False)
    )
