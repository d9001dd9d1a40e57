"""Residuals and scores by axis: measured minus modelled force, one-step acceleration errors and rollout errors."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import Annotated

import numpy as np
from pydantic import BeforeValidator

from ..measurements.preparation.prepare import DataSet
from ..measurements.preparation.resampling import accelerations, low_pass
from ..measurements.statistics.signals import filtered_noise, sensor_noise
from ..physics.file_records import Number, Record, Whole
from ..physics.forces import modelled_acceleration
from ..physics.integration import SPEED_LIMIT, Legs
from ..physics.momentum_balance import mass_matrix
from ..physics.motion import Array, Motion
from ..physics.vehicle import Vehicle
from .models.base import Model, rolled_out


@dataclass(frozen=True, slots=True)
class Residual:
    """Measured and modelled acceleration of one motion, filtered alike, and the force between them.

    Attributes
    ----------
    motion : the filtered motion
    measured, modelled : (n, 3) [m/s^2, m/s^2, rad/s^2]
    force : (n, 3) M (measured - modelled) [N, N, N m]
    """

    motion: Motion
    measured: Array
    modelled: Array
    force: Array


def residual(vehicle: Vehicle, motion: Motion, data: DataSet) -> Residual:
    """The residual of one motion of a data set.

    The measured acceleration is the central difference of the filtered velocity; the modelled one is evaluated along
    the filtered motion and passes through the same filter.

    Parameters
    ----------
    vehicle : the model
    motion : one of the motions of `data`
    data : with the recipe of the filter
    """
    measured = accelerations(motion)
    modelled = same_filter(modelled_acceleration(vehicle, motion), motion, data)
    return Residual(motion, measured, modelled, (measured - modelled) @ mass_matrix(vehicle))


def same_filter(values: Array, motion: Motion, data: DataSet) -> Array:
    """Pass a model's output through the filter that the measured velocities went through.

    Parameters
    ----------
    values : (n, ...) along the motion
    motion, data : one of the motions of a data set, and the data set with the recipe of the filter
    """
    if data.recipe.cutoff is None:
        return np.asarray(values, dtype=float)
    return low_pass(values, motion.time_step, data.recipe.cutoff, data.recipe.order)


def target_acceleration(vehicle: Vehicle, motion: Motion, data: DataSet, pure: bool) -> Array:
    """Target of a network's filtered output, (n, 3) [m/s^2, m/s^2, rad/s^2].

    Parameters
    ----------
    vehicle : that the network corrects
    motion, data : one of the motions of a data set, and the data set with the recipe of the filter
    pure : the network stands in the place of the physics
    """
    measured = accelerations(motion)
    return measured if pure else measured - same_filter(modelled_acceleration(vehicle, motion), motion, data)


HORIZONS = (2.0, 10.0, 30.0)
"""Rollout lengths [s]."""
SPACING = 0.5
"""Distance between rollout starts [s]."""
MOST_STARTS = 600
"""Rollouts of one horizon, about: longer logs have starts farther apart, which tell as much and take no more time."""
_NOISE_SEED = 60221
"""Any number: the same noise is drawn for every model."""


ACCELERATION_UNITS = {"surge": "m/s^2", "sway": "m/s^2", "yaw": "rad/s^2"}
ROLLOUT_UNITS = {"position": "m", "surge": "m/s", "sway": "m/s", "yaw": "rad/s"}


class ByAxis(Record):
    """Three errors as files have them [m/s^2, m/s^2, rad/s^2 of an acceleration, m/s, m/s, rad/s of a velocity]."""

    surge: Number = math.nan
    sway: Number = math.nan
    yaw: Number = math.nan

    def of(self, name: str) -> float:
        """The error by the name of its axis, or what else the record holds a number of."""
        result: float = getattr(self, name)
        return result


class AccelerationRecord(Record):
    """One-step errors on a data set as files have them."""

    rmse: ByAxis = ByAxis()
    mae: ByAxis = ByAxis()
    r2: ByAxis = ByAxis()


class RolloutRecord(ByAxis):
    """Open-loop errors over one horizon as files have them: position [m], and how many predictions ran away.

    `starts` is None where a file does not say how many there were.
    """

    position: Number = math.nan
    diverged: Whole = 0
    starts: Whole | None = None


def _horizon(key: object) -> object:
    try:
        known = isinstance(key, str) and math.isfinite(float(key))
    except ValueError:
        known = False
    if not known:
        raise ValueError("errors by axis, and by horizon in seconds")
    return key


Rollouts = Mapping[Annotated[str, BeforeValidator(_horizon)], RolloutRecord]
"""Open-loop errors by horizon [s]."""


@dataclass(frozen=True, slots=True)
class AccelerationScore:
    """One-step errors on a data set: rmse, mae [m/s^2, m/s^2, rad/s^2] and r2 [1], each (3,)."""

    rmse: Array
    mae: Array
    r2: Array

    @property
    def record(self) -> AccelerationRecord:
        """The same as `comparison.json` has it."""
        return AccelerationRecord(rmse=by_axis(self.rmse), mae=by_axis(self.mae), r2=by_axis(self.r2))


@dataclass(frozen=True, slots=True)
class RolloutScore:
    """Open-loop errors over one horizon: velocity rmse (3,) [m/s, m/s, rad/s], position rmse [m], counts.

    The root mean square runs over all rows of all rollouts; a diverged one counts with its clipped speeds.
    """

    velocity: Array
    position: float
    diverged: int
    starts: int

    @property
    def record(self) -> RolloutRecord:
        """The same as `comparison.json` has it."""
        surge, sway, yaw = self.velocity.tolist()
        counts = {"diverged": self.diverged, "starts": self.starts}
        return RolloutRecord(surge=surge, sway=sway, yaw=yaw, position=self.position, **counts)


def by_axis(values: Array) -> ByAxis:
    """Three errors under the names of the axes."""
    surge, sway, yaw = values.tolist()
    return ByAxis(surge=surge, sway=sway, yaw=yaw)


@dataclass(frozen=True, slots=True, eq=False)
class RolloutErrors:
    """Squared errors of open-loop rollouts over one horizon, motion by motion.

    Attributes
    ----------
    squares : (starts, 4) of each motion, in the order of time: mean square error over a rollout of u, v [m^2/s^2],
        r [rad^2/s^2] and position [m^2]
    spacing : time between the starts of each motion [s]
    diverged : how many rollouts reached `SPEED_LIMIT`
    started : (4,) mean square that the noise of the measured starts makes of the predictions, in the same units
    """

    squares: tuple[Array, ...]
    spacing: tuple[float, ...]
    diverged: int
    started: Array = field(default_factory=partial(np.zeros, 4))

    @property
    def score(self) -> RolloutScore:
        """The root mean square over all starts."""
        stacked = np.concatenate(self.squares)
        root = np.sqrt(stacked.mean(axis=0))
        return RolloutScore(root[:3], float(root[3]), self.diverged, stacked.shape[0])


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """All errors of a model on a data set, evaluated once; scores and their comparison are taken from them.

    Attributes
    ----------
    measured, acceleration : (n, 3) of each motion: measured acceleration, and measured minus modelled [m/s^2, m/s^2,
        rad/s^2]
    step : time between the rows of each motion [s]
    rollouts : by horizon [s]
    seconds : wall time of the evaluation [s]
    noise : (3,) mean square of the sensor noise on the measured speeds, which stands in every model's errors; see
        `speed_noise`
    """

    measured: tuple[Array, ...]
    acceleration: tuple[Array, ...]
    step: tuple[float, ...]
    rollouts: Mapping[str, RolloutErrors]
    seconds: float
    noise: Array

    @property
    def acceleration_score(self) -> AccelerationScore:
        """See `acceleration_score`."""
        return _score(self.measured, self.acceleration)

    @property
    def rollout_scores(self) -> Mapping[str, RolloutScore]:
        """See `rollout_scores`."""
        return {name: found.score for name, found in self.rollouts.items()}


def evaluate(model: Model, data: DataSet, horizons: Sequence[float] = HORIZONS) -> Errors:
    """All errors of a model on a data set, predictions over some horizons [s] among them.

    Parameters
    ----------
    model : to be scored
    data : on which it is scored
    horizons : lengths of rollouts [s]
    """
    return evaluate_all([model], data, horizons)[0]


def evaluate_all(models: Sequence[Model], data: DataSet, horizons: Sequence[float] = HORIZONS) -> list[Errors]:
    """The same of several models, which takes little longer where they are vehicles; each has its share of the time."""
    begun, noise = perf_counter(), speed_noise(data)
    rollouts = _rollout_errors(models, data, horizons, noise=noise)
    errors = [acceleration_errors(model, data) for model in models]
    step = tuple(motion.time_step for motion in data.motions)
    seconds = (perf_counter() - begun) / max(len(models), 1)
    return [Errors(*own, step, rolled, seconds, noise) for own, rolled in zip(errors, rollouts, strict=True)]


def speed_noise(data: DataSet) -> Array:
    """Mean square of the white noise that is left on the speeds of a data set, (3,) [m^2/s^2, m^2/s^2, rad^2/s^2].

    Its size comes from the rows before the low-pass, see `sensor_noise`. Slow errors of sensors are not in it.
    """
    level = sensor_noise(data.raw)
    left = [filtered_noise(motion, level, partial(same_filter, motion=motion, data=data)) for motion in data.raw]
    return np.asarray(np.average(left, axis=0, weights=[motion.time.size for motion in data.raw]))


def acceleration_errors(model: Model, data: DataSet) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Measured acceleration, and measured minus modelled, both filtered alike, (n, 3) of each motion."""
    measured = tuple(accelerations(motion) for motion in data.motions)
    modelled = (same_filter(model.acceleration(motion), motion, data) for motion in data.motions)
    return measured, tuple(one - other for one, other in zip(measured, modelled, strict=True))


def acceleration_score(model: Model, data: DataSet) -> AccelerationScore:
    """One-step score of a model: measured central differences against the model, both filtered alike.

    r2 is 1 - (sum of squared errors) / (sum of squares about the mean), on each axis; NaN with nothing to explain.
    """
    return _score(*acceleration_errors(model, data))


def rollout_scores(
    model: Model, data: DataSet, horizons: Sequence[float] = HORIZONS, spacing: float = SPACING
) -> Mapping[str, RolloutScore]:
    """Open-loop scores of a model by horizon [s]; a horizon longer than every motion is left out.

    Every start has room for its own horizon; one integration of the longest horizon serves the shorter ones.

    Parameters
    ----------
    model : to be scored
    data : on which it is scored
    horizons : lengths of rollouts [s]
    spacing : between starts [s]
    """
    return {name: found.score for name, found in rollout_errors(model, data, horizons, spacing).items()}


def rollout_errors(
    model: Model, data: DataSet, horizons: Sequence[float] = HORIZONS, spacing: float = SPACING
) -> Mapping[str, RolloutErrors]:
    """Squared errors of open-loop rollouts by horizon [s]; see `rollout_scores`."""
    return _rollout_errors([model], data, horizons, spacing)[0]


def _rollout_errors(
    models: Sequence[Model],
    data: DataSet,
    horizons: Sequence[float],
    spacing: float = SPACING,
    noise: Array | None = None,
) -> list[Mapping[str, RolloutErrors]]:
    """Errors of each model, and what noise of this mean square (3,) on the starts makes of them, where it is given."""
    spacing = max(spacing, data.seconds / MOST_STARTS)
    asked = [legs for motion in data.motions for legs in _starts(motion, horizons, spacing)]
    found = {model: _Rolled(horizons, data) for model in models}
    noisy = [] if noise is None or not noise.any() else [_noisier(legs, noise) for legs in asked]
    sources = {id(own.motion): legs.motion for own, legs in zip(noisy, asked, strict=bool(noisy))}
    calm: dict[tuple[Model, int, int], Array] = {}
    for model, legs, states in rolled_out(list(found), [*asked, *noisy]):
        source, first = sources.get(id(legs.motion)), int(legs.starts[0])
        if source is not None:
            found[model].spread(source, states - calm.pop((model, id(source), first)))
            continue
        found[model].take(legs, states)
        if noisy:
            calm[model, id(legs.motion), first] = states
    return [found[model].errors(data.motions, spacing) for model in models]


def _noisier(legs: Legs, noise: Array) -> Legs:
    """The same rollouts from speeds with white noise of a mean square (3,), the same at each call."""
    motion = legs.motion
    drawn = np.random.default_rng(_NOISE_SEED).standard_normal(motion.velocity.shape)
    return legs._replace(motion=replace(motion, velocity=motion.velocity + np.sqrt(noise) * drawn))


class _Rolled:
    """Rollouts of one model, of which only their squared errors are kept."""

    def __init__(self, horizons: Sequence[float], data: DataSet) -> None:
        self._horizons, self._data = horizons, data
        self._begun: dict[tuple[str, int], list[np.ndarray]] = {}
        self._squares: dict[tuple[str, int], list[Array]] = {}
        self._lost = dict.fromkeys([f"{h:g}" for h in horizons], 0)
        self._started: dict[str, list[Array]] = {}

    @np.errstate(over="ignore", invalid="ignore")  # of rollouts that run away
    def spread(self, motion: Motion, difference: Array) -> None:
        """Take what noise on the starts of some rollouts makes of their states, (starts, steps + 1, 6)."""
        place = (difference[..., :2] ** 2).sum(axis=-1, keepdims=True)
        for h in self._horizons:
            length = round(h / motion.time_step)
            if length < difference.shape[1]:
                ahead = difference[:, : length + 1, 3:]
                speeds = same_filter(ahead.swapaxes(0, 1), motion, self._data).swapaxes(0, 1)
                off = np.concatenate([speeds**2, place[:, : length + 1]], axis=-1)
                self._started.setdefault(f"{h:g}", []).append(off[:, 1:].mean(axis=1))

    @np.errstate(over="ignore", invalid="ignore")  # of rollouts that run away
    def take(self, legs: Legs, states: Array) -> None:
        """Take the states (starts, steps + 1, 6) of some rollouts."""
        motion, rows = legs.motion, legs.starts[:, None] + np.arange(legs.steps + 1)
        truth = np.column_stack([motion.position, motion.velocity])[rows]
        place = ((states[..., :2] - truth[..., :2]) ** 2).sum(axis=-1, keepdims=True)
        for h in self._horizons:
            key, length = (f"{h:g}", id(motion)), round(h / motion.time_step)
            if length <= legs.steps:
                self._begun.setdefault(key, []).append(legs.starts)
                ahead = states[:, : length + 1, 3:]
                # The record went through a low-pass, and lacks the quick turns of a prediction that did not.
                speeds = same_filter(ahead.swapaxes(0, 1), motion, self._data).swapaxes(0, 1)
                off = np.concatenate([(speeds - truth[:, : length + 1, 2:]) ** 2, place[:, : length + 1]], axis=-1)
                self._squares.setdefault(key, []).append(off[:, 1:].mean(axis=1))
                self._lost[key[0]] += int((np.abs(ahead[:, 1:]).max(axis=(1, 2)) >= SPEED_LIMIT).sum())

    def errors(self, motions: Sequence[Motion], spacing: float) -> Mapping[str, RolloutErrors]:
        """The squared errors by horizon, the starts in the order of time."""
        result: dict[str, RolloutErrors] = {}
        for name, lost in self._lost.items():
            inside = {(name, id(motion)): motion for motion in motions if (name, id(motion)) in self._squares}
            if inside:
                squares = (np.concatenate(self._squares[key]) for key in inside)
                order = (np.argsort(np.concatenate(self._begun[key])) for key in inside)
                ordered = tuple(square[places] for square, places in zip(squares, order, strict=True))
                apart = tuple(_every(motion, spacing) * motion.time_step for motion in inside.values())
                started = np.concatenate(self._started.get(name, [np.zeros((1, 4))])).mean(axis=0)
                result[name] = RolloutErrors(ordered, apart, lost, started)
        return result


def _every(motion: Motion, spacing: float) -> int:
    """Rows from one start to the next."""
    return max(1, round(spacing / motion.time_step))


def _starts(motion: Motion, horizons: Sequence[float], spacing: float) -> list[Legs]:
    """Starts along a motion, each with the longest horizon for which there is room."""
    step, found, counted = motion.time_step, [], -1
    lengths = {round(h / step) for h in horizons}
    for steps in sorted((n for n in lengths if n < motion.time.size), reverse=True):
        starts = np.arange(0, motion.time.size - steps, _every(motion, spacing))
        found.append(Legs(motion, starts[starts > counted], steps))
        counted = int(starts[-1])
    return [legs for legs in found if legs.starts.size]


def _score(measured: Sequence[Array], error: Sequence[Array]) -> AccelerationScore:
    truth, wrong = np.concatenate(measured), np.concatenate(error)
    spread = ((truth - truth.mean(axis=0)) ** 2).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        r2 = np.where(spread > 0, 1.0 - (wrong**2).sum(axis=0) / spread, np.nan)
    return AccelerationScore(np.sqrt((wrong**2).mean(axis=0)), np.abs(wrong).mean(axis=0), r2)
