"""Rival explanations of one model: errors of the record within the search, and scales of thrusters that say the same.

A record of few command levels leaves up to half a step open at each level. A boat steered by few levels carries few
constant errors then, which look like a thruster's curve or like drag. So an effect must earn its price beside an error
of each level. All thrusters' common scale and a scale of each describe the same forces; the description with fewest
faults is told.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Array, Motion
from ...physics.presentation import listing, number
from ...physics.sources import assumed, how_sure
from ...physics.vehicle import Vehicle
from ..candidates.linearisation import Option
from .floating import Search, State
from .gram import RIDGE, TOGETHER, shares_taken

_REFITS = 4
"""Fits after which the weights of the axes stay as they are."""
_CHANGES = 8
"""Changes of a model that are tried one after the other: an effect or two stands in for the errors of a record, not a
dozen."""
_TRIALS = 4
"""Changes tried in full: columns about one model foretell another's worth, but for the shapes of lags and delays."""


def search_with_record_errors(
    search: Search, errors: Array, final: State, noise: Array | None = None
) -> "RecordErrorFit":
    """The model to which a found one leads when effects go, come and change places beside errors of the record.

    Parameters
    ----------
    errors, noise : columns of the errors about the found model, see `RecordErrorFit`
    """
    here = RecordErrorFit(search, errors, final, noise)
    for _ in range(_CHANGES):
        trials = (RecordErrorFit(search, errors, state, noise) for state in here.neighbours())
        better = next((there for there in trials if there.worth() < here.worth() - search.settings.margin), None)
        if better is None:
            break
        here = better
    return here


class RecordErrorFit:
    """Least squares of a search's columns about a model beside errors of the record.

    Parameters
    ----------
    errors : columns of them (tests, 3, errors), each for as much of an error as is usual
    state : the model
    noise : (copies, tests, 3, errors) what sensor noise adds to them; None for nothing
    """

    def __init__(self, search: Search, errors: Array, state: State, noise: Array | None = None) -> None:
        self.state, self._search = state, search
        self._half = 0.5 * search.balance.independent
        self._linear, self._scores, self._now = search.about(state)
        self._errors = errors.shape[2]
        self._prices: dict[int, float] = {}
        across = np.concatenate([errors, self._linear.columns], axis=2).transpose(1, 2, 0)
        self._gram = across @ across.swapaxes(1, 2) / across.shape[2]
        self._blur = np.zeros_like(self._gram)  # what noise of sensors adds to it: inertia would take it for motion
        for place, copy in enumerate(self._linear.noise):
            added = np.zeros_like(errors) if noise is None else noise[place]
            laid = np.concatenate([added, copy], axis=2).transpose(1, 2, 0)
            self._blur += laid @ laid.swapaxes(1, 2) / laid.shape[2]
        self._blur /= max(len(self._linear.noise), 1)

    def neighbours(self) -> Iterator[State]:
        """Models with an effect or two less, another in the place of one, or one more, that promise most."""
        search, options, now = self._search, self._linear.options, self._now
        gone = {key: options[key][1] for key in search.named(self.state.active)}
        fewer = [{**now, key: none} for key, none in gone.items()]
        two = [{**now, one: gone[one], other: gone[other]} for one, other in combinations(gone, 2)]
        others = [o for c in search.pool if c.key not in now for o in options[c.key] if o.present]
        tried = [*fewer, *two, *({**model, other.key: other} for model in (now, *fewer) for other in others)]
        worths = self._worths([list(model.values()) for model in tried])
        for n in np.argsort(worths, kind="stable")[:_TRIALS].tolist():
            if worths[n] < self.worth() - search.settings.margin:
                yield search.apply(self.state, now, tried[n], self._scores)

    @property
    def error(self) -> Array:
        """Mean square that the model leaves, (3,) in the square of the balance's unit."""
        return self._fits([list(self._now.values())])[0][0]

    @property
    def errors(self) -> Array:
        """The errors of the record, in units of what is usual."""
        return self._fits([list(self._now.values())])[0][1]

    @property
    def earned(self) -> float:
        """Log-likelihood that errors of the record earn beside the model itself."""
        return float(self._worths([list(self._now.values())], alone=True)[0] - self.worth())

    def worth(self) -> float:
        """Half the independent tests times the log error, summed over axes, and the price of all parameters.

        An error of the usual size costs half.
        """
        return float(self._worths([list(self._now.values())])[0])

    def _worths(self, models: Sequence[Sequence[Option]], *, alone: bool = False) -> Array:
        """The worth of each of some models (models,); `alone`: of a record without errors."""
        price = {id(option): self._price(option) for chosen in models for option in chosen}
        prices = [sum(price[id(option)] for option in chosen) for chosen in models]
        fits = self._fits(models, alone=alone)
        left = np.array([np.log(error + self._search.floor).sum() for error, _ in fits])
        return self._half * left + [0.5 * record @ record for _, record in fits] + prices

    def _price(self, option: Option) -> float:
        """Of an option alone; thousands of models are made of some dozens."""
        if id(option) not in self._prices:
            present = option.present
            self._prices[id(option)] = self._search.price(self._scores.fit([option]), [option]) if present else 0.0
        return self._prices[id(option)]

    def _fits(self, models: Sequence[Sequence[Option]], *, alone: bool = False) -> list[tuple[Array, Array]]:
        """What each model leaves (3,), and the errors of the record; those of one size together.

        Parameters
        ----------
        alone : of a record without any errors
        """
        record = 0 if alone else self._errors
        targets = np.zeros((len(models), self._gram.shape[1]))
        targets[:, -1] = 1.0
        alike: dict[int, list[tuple[int, list[int]]]] = {}
        for n, chosen in enumerate(models):
            targets[n, [self._errors + option.offset for option in chosen if option.offset >= 0]] -= 1.0
            free = [self._errors + index for option in chosen for index in option.free if index >= 0]
            alike.setdefault(len(free), []).append((n, [*range(record), *free]))
        found: dict[int, tuple[Array, Array]] = {}
        for some in alike.values():
            for k in range(0, len(some), TOGETHER):
                places, columns = zip(*some[k : k + TOGETHER], strict=True)
                left, change = self._fitted(np.array(columns, dtype=int), targets[list(places)], record)
                found |= zip(places, zip(left, change[:, :record], strict=True), strict=True)
        return [found[n] for n in range(len(models))]

    def _fitted(self, columns: np.ndarray, targets: Array, record: int) -> tuple[Array, Array]:
        """What models leave (models, 3), and their coefficients (models, p), of which the first are the record's.

        Parameters
        ----------
        columns : (models, p)
        targets : (models, all columns)
        record : errors of the record, each of which has a prior of one
        """
        left, across = columns[:, :, None], columns[:, None, :]
        prior = np.diag(np.arange(columns.shape[1]) < record).astype(float)
        across_all = targets @ self._gram  # (3, models, all columns)
        total = (across_all * targets).sum(axis=2).T
        share = self._taken(columns, 2.0 * self._half / (total + self._search.floor))[:, None]
        inner = self._gram[:, left, across] - share[..., None] * self._blur[:, left, across]
        rows = np.arange(len(columns))[:, None]
        pull = across_all[:, rows, columns] - share * (targets @ self._blur)[:, rows, columns]
        error, change = total, np.zeros(columns.shape)
        for _ in range(_REFITS):
            weight = 2.0 * self._half / (error + self._search.floor)
            h = np.einsum("na,anpq->npq", weight, inner) + prior
            size = 1.0 / np.sqrt(np.maximum(np.diagonal(h, axis1=1, axis2=2), 1e-300))
            h = h * (size[:, :, None] * size[:, None, :]) + RIDGE * np.eye(columns.shape[1])
            right = size * np.einsum("na,anp->np", weight, pull)
            change = size * np.linalg.solve(h, right[..., None])[..., 0]
            bent = np.einsum("anpq,nq->anp", inner, change)
            error = np.maximum(total + np.einsum("anp,np->na", bent - 2.0 * pull, change), 0.0)
        return error, change

    def _taken(self, columns: np.ndarray, weight: Array) -> Array:
        """The share of what noise adds to the columns (models, p) of each model that is taken off, (models,)."""
        if not self._blur.any():
            return np.ones(len(columns))
        left, across = columns[:, :, None], columns[:, None, :]
        total, blur = (np.einsum("na,anpq->npq", weight, gram[:, left, across]) for gram in (self._gram, self._blur))
        return shares_taken(total, blur)


_COARSE, _MOST = 0.01, 48
"""Share of the largest command from which a step is coarse, and levels at most: finer ones explain no more than noise
does, and each costs time."""
_DESIGNED = 0.1
"""Share of the largest command above which levels were chosen by whoever drove."""
_LEVELS = 5
"""Levels that tell a step, not two numbers that happen to fit."""
_HELD = 20
"""Rows on which a level is held: on others commands are the mean of two."""
_SAME = 1e-5
"""Rounding of levels, as a share of the largest command."""


@dataclass(frozen=True, slots=True, eq=False)
class CoarseRecord:
    """Levels that the record of some commands is made of.

    Attributes
    ----------
    columns : of the commands that have them; a level of two thrusters is one number, rounded once
    levels : (n,) at which commands were held, in their unit
    step : of which all levels are multiples
    """

    columns: tuple[int, ...]
    levels: Array
    step: float


def coarse_records(motions: Sequence[Motion]) -> tuple[CoarseRecord, ...]:
    """The coarse steps in which commands were recorded: one for all thrusters, or those of each; none where fine."""
    every = tuple(range(len(motions[0].thrusters)))
    together = _coarse(motions, every)
    return (together,) if together else tuple(filter(None, (_coarse(motions, (column,)) for column in every)))


def has_residual_structure(search: Search, state: State) -> bool:
    """True when a model leaves force that neither sensor noise nor the resolution of the commands' record explains."""
    if not search.has_residual_structure(state.fit.held_out):
        return False
    records = coarse_records(search.balance.motions)
    if not records:
        return True
    return search.has_residual_structure(RecordErrorFit(search, _errors_of_levels(search, records, state), state).error)


def _errors_of_levels(search: Search, records: Sequence[CoarseRecord], state: State) -> Array:
    """What half a step of each level adds to the balance of a model, (tests, 3, levels)."""
    balance, vehicle = search.balance, state.vehicle
    levels = [(record, at) for record in records for at in range(record.levels.size)]
    moved = ([_displaced(motion, *level) for motion in balance.motions] for level in levels)
    rest = balance.residual(vehicle)
    return np.stack([rest - balance.recorded(motions, vehicle) for motions in moved], axis=2)


def _coarse(motions: Sequence[Motion], columns: tuple[int, ...]) -> CoarseRecord | None:
    every = [motion.commands[:, column] for motion in motions for column in columns]
    largest = float(np.ptp(np.concatenate(every)))
    if largest == 0.0:
        return None
    held = np.concatenate([column[_held(column, _SAME * largest)] for column in every])
    rounded, counts = np.unique(np.round(held / (_SAME * largest)), return_counts=True)
    levels = rounded[counts >= _HELD] * _SAME * largest
    if not _LEVELS <= levels.size <= _MOST:
        return None
    step = 0.0
    for gap in np.diff(levels):
        step = _common(float(gap), step, 4.0 * _SAME * largest)
    return CoarseRecord(columns, levels, step) if _COARSE * largest <= step <= _DESIGNED * largest else None


def _held(commands: Array, same: float) -> NDArray[np.bool_]:
    """Rows on which a command is what it is on the row before and on the row after: no mean of two levels."""
    still = np.abs(np.diff(commands)) <= same
    return np.concatenate([[False], still[:-1] & still[1:], [False]])


def _common(one: float, other: float, least: float) -> float:
    """The greatest common measure of two lengths, to within the least one that counts (Euclid)."""
    while other > least:
        one, other = other, abs(one - other * round(one / other))
    return one


def _displaced(motion: Motion, record: CoarseRecord, at: int) -> Motion:
    """The motion under commands of which one level is displaced by half a step.

    A row on which no level is held has a share of the level before it and of the one after it.
    """
    past = np.empty((0, motion.commands.shape[1])) if motion.run_up is None else motion.run_up
    commands = np.concatenate([past, motion.commands])
    row = np.arange(len(commands))
    for column in (commands[:, k] for k in record.columns):
        rows = np.flatnonzero(_held(column, _SAME * float(np.ptp(record.levels))))
        if not rows.size:
            continue
        before = rows[np.maximum(np.searchsorted(rows, row, side="right") - 1, 0)]
        after = rows[np.minimum(np.searchsorted(rows, row), rows.size - 1)]
        gap = column[after] - column[before]
        share = np.clip((column - column[before]) / np.where(gap == 0.0, 1.0, gap), 0.0, 1.0)
        nearest = np.abs(column[:, None] - record.levels).argmin(axis=1) == at
        column += 0.5 * record.step * ((1.0 - share) * nearest[before] + share * nearest[after])
    run_up = None if motion.run_up is None else commands[: len(past)]
    return replace(motion, commands=commands[len(past) :], run_up=run_up)


_COMMON, ONE = "thrust_scale", "thruster_asymmetry"


def is_equivalent(nominal: Vehicle, active: tuple[str, ...], key: str, other: str) -> bool:
    """True when `other` in place of `key` only says the same again, because a third of the kind is in the model.

    With two thrusters, any two of {common scale, scale of the one, scale of the other} give every pair of scales; with
    more of them they do not.

    Parameters
    ----------
    nominal : whose thrusters they are
    active : keys of the effects in the model
    key, other : keys of the scale in the model and of the one in its place
    """
    kind = [k for k in active if _is_scale(k)]
    return len(nominal.thrusters) == 2 and len(kind) == 2 and key in kind and _is_scale(other)


def as_common_scale(search: Search, state: State) -> State:
    """A model of two thrusters' scales, described as a common scale and the weaker one's fault.

    Three scales of two thrusters are one too many: only their products move a force. Told is what an engineer would
    look for: a battery or a curve that concerns both, and one thruster that is fouled. Where either is no candidate, as
    the common scale beside a calibration, the model stays as it is.
    """
    thrusters = search.nominal.thrusters
    kind = [k for k in state.active if _is_scale(k)]
    if len(thrusters) != 2 or len(kind) < 2:
        return state
    names = [t.name for t in thrusters]
    ratio = np.array([_total(state.vehicle, n) / max(_total(search.nominal, n), 1e-12) for n in names])
    weak, strong = (names[int(k)] for k in np.argsort(ratio))
    plain = {_COMMON, f"{ONE}[{weak}]"}
    if set(kind) == plain or not plain <= {candidate.key for candidate in search.pool}:
        return state
    common = search.nominal.value(_COMMON) * float(ratio.max())
    values = {
        _COMMON: common,
        f"{strong}_scale": search.nominal.value(f"{strong}_scale"),
        f"{weak}_scale": search.nominal.value(f"{weak}_scale") * float(ratio.min() / ratio.max()),
    }
    rest = [k for k in state.active if k not in kind]
    return search.evaluate(state.vehicle.with_values(values), (*rest, _COMMON, f"{ONE}[{weak}]"))


def redundant_scales(nominal: Vehicle, active: Sequence[str]) -> tuple[str, ...]:
    """The common scale and all thrusters' own, where all are in a model: their products alone move a force."""
    kind = tuple(k for k in active if _is_scale(k))
    return kind if len(kind) > max(len(nominal.thrusters), 1) else ()


def _is_scale(key: str) -> bool:
    return key == _COMMON or key.startswith(f"{ONE}[")


def _total(vehicle: Vehicle, thruster: str) -> float:
    return vehicle.value(_COMMON) * vehicle.value(f"{thruster}_scale")


def all_thrusters(nominal: Vehicle, corrected: Vehicle, kept: Sequence[str]) -> str:
    """Sentence that all thrusters push harder, or all weaker, than the file says, and how much of it is a difference.

    Empty where a thruster is as the file has it, or pushes the other way from the file than another.

    Parameters
    ----------
    kept : keys of the effects that stand in the corrected model

    Examples
    --------
    >>> from undertow.physics.vehicle import load_vehicle
    >>> boat = load_vehicle("blueboat")
    >>> keys = ["thruster_asymmetry[port]", "thruster_asymmetry[stbd]"]
    >>> for sentence in all_thrusters(boat, boat.with_values({"port_scale": 1.3, "stbd_scale": 1.6}), keys).split(". "):
    ...     print(sentence)
    Both thrusters push harder than the vehicle file says, port 1.30 times and stbd 1.60 times
    Of that, a factor of 1.23 is the difference between the two; the rest is thrust that the file has too low.
    >>> all_thrusters(boat, boat.with_values({"port_scale": 0.9, "stbd_scale": 1.6}), keys)
    ''
    """
    names = [thruster.name for thruster in nominal.thrusters]
    if len(names) < 2 or not {f"{ONE}[{name}]" for name in names} <= set(kept):
        return ""
    times = {name: corrected.value(f"{name}_scale") / (nominal.value(f"{name}_scale") or 1.0) for name in names}
    weak, strong = min(times.values()), max(times.values())
    if not (weak > 1.0 or 0.0 < strong < 1.0) or weak <= 0.0:
        return ""
    how, wrong = ("harder", "low") if weak > 1.0 else ("weaker", "high")
    guess = assumed(nominal).get("thrust_scale")
    sure = f" ({how_sure(guess)})" if guess and how_sure(guess) else ""
    file = "the vehicle file says" if guess is None else f"the vehicle file assumes{sure}"
    every, between = ("Both", "the two") if len(names) == 2 else ("All", "the weakest and the strongest")
    each = listing([f"{name} {number(value)} times" for name, value in times.items()])
    return (
        f"{every} thrusters push {how} than {file}, {each}. Of that, a factor of {number(strong / weak)} is the "
        f"difference between {between}; the rest is thrust that the file has too {wrong}."
    )
