"""Multiple shooting (Bock 1983): errors of open-loop rollouts as a balance, and a test between two models' rollouts.

From a start every 2.5 s the model runs under the logged commands; measured minus predicted velocity, averaged over bins
of 0.5 s, is the balance [m/s, m/s, rad/s] (output error). A force below the pointwise noise accumulates in a rollout,
and coloured sensor noise is not taken for a force that follows the motion. Errors of the start states are whitened out;
outliers count less (soft-L1; Triggs et al. 2000, section 4.3).
"""

from collections.abc import Sequence
from math import ceil
from typing import ClassVar, final

import numpy as np

from ...measurements.kinematics import corrected_for
from ...measurements.statistics.blocks import Difference, paired_ratio, spread
from ...physics.integration import Legs, rollouts
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from .base import LEAST_NOISE, MANY, Balance, Neighbourhood, Remembered, WeakSettings, cache_limit
from .sensitivity import Tangent, propagation
from .starts import (
    HORIZON,
    LEAST_BLOCKS,
    LEAST_STARTS,
    SPACING,
    WHOLE_HORIZON,
    Rollings,
    ShootingSettings,
    lay_out_rollouts,
)

TRIFLE = 0.03
"""Share of an error, or of a motion, up to which a change of it is a trifle: a model is called no worse for it, if it
is sure at all, and an effect that makes no more is no open question."""
FEWEST = LEAST_BLOCKS * LEAST_STARTS
"""Rollouts below which nothing is said: as few as a log that is judged by rollouts has."""
_NO_ERROR = 1e-12
"""Mean square error [m^2/s^2, rad^2/s^2] that is none: rollouts of an axis that does not move differ by rounding."""


def rollout_squares(motions: Sequence[Motion], vehicle: Vehicle, horizon: float = HORIZON) -> Array:
    """Mean square velocity errors of `horizon` [s] open-loop rollouts from measured starts every 2.5 s, (starts, 3).

    Parameters
    ----------
    motions : gap-free stretches; of one shorter than `horizon` there is no start
    vehicle : the model that is rolled out
    horizon : length of a rollout [s]
    """
    asked = _every(motions, horizon, SPACING)
    squares = [np.zeros((0, 3))]
    for legs, rolled in zip(asked, rollouts([(vehicle, legs) for legs in asked], placed=False), strict=True):
        window = legs.starts[:, None] + np.arange(1, legs.steps + 1)
        squares.append(((rolled.states[:, 1:, 1:] - legs.motion.velocity[window]) ** 2).mean(axis=1))
    return np.concatenate(squares)


def _every(motions: Sequence[Motion], horizon: float, spacing: float) -> list[Legs]:
    """Rollouts of `horizon` [s] from measured starts every `spacing` [s]; of motions long enough for one."""
    result = []
    for motion in motions:
        steps = round(horizon / motion.time_step)
        starts = np.arange(0, motion.time.size - steps, max(1, round(spacing / motion.time_step)))
        result += [Legs(motion, starts, steps)] if starts.size else []
    return result


def rollout_overlap(horizon: float, spacing: float = SPACING) -> int:
    """Number of rollouts of `horizon` [s], started every `spacing` [s], that run at any time, and so depend."""
    return max(1, ceil(horizon / spacing))


def error_increase(without: Array, within: Array, overlap: int) -> Difference:
    """Increase of the rollout errors from one model to another, paired over blocks of time.

    Parameters
    ----------
    without, within : (starts, 3) squared errors in the order of time, as from `rollout_squares`
    overlap : see `rollout_overlap`

    Returns
    -------
    Difference
        `difference` is the mean over the axes of the logarithm of the ratio of root mean square errors.
    """
    return paired_ratio(within + _NO_ERROR, without + _NO_ERROR, overlap, FEWEST)


def rollouts_contradict(without: Array, within: Array, overlap: int) -> bool:
    """True when rollouts with an effect are worse than without it, materially and surely (95 %); see `error_increase`.

    Parameters
    ----------
    without, within : mean square velocity errors (starts, 3) of the same rollouts without the effect and with it
    overlap : how many rollouts run at any time, see `rollout_overlap`
    """
    if without.shape[0] < FEWEST:
        return False
    rise = error_increase(without, within, overlap)
    return rise.ci95 is not None and rise.ci95[0] > 0.0 and 2.0 * rise.difference > TRIFLE


def predicts_worse(motions: Sequence[Motion], without: Vehicle, within: Vehicle) -> bool:
    """True when 10 s open-loop rollouts of one model are surely worse than another's: fits can wreck predictions.

    Parameters
    ----------
    motions : on which both models are rolled out
    without, within : the model before a change and after it
    """
    before, after = (rollout_squares(motions, vehicle, WHOLE_HORIZON) for vehicle in (without, within))
    return rollouts_contradict(before, after, rollout_overlap(WHOLE_HORIZON))


def rollout_difference(motions: Sequence[Motion], one: Vehicle, other: Vehicle) -> Array:
    """Difference of two models' rollouts along a log, (3,): root mean square, as a share of the rms motion.

    Rollouts of 10 s from common measured starts, end to end; zeros when no motion is long enough.

    Parameters
    ----------
    motions : whose starts and commands both models have
    one, other : the models; shares are of the rms motion of `one`
    """
    gap, size = np.zeros(3), np.full(3, 1e-12)
    asked = _every(motions, WHOLE_HORIZON, WHOLE_HORIZON)
    rolled = rollouts([(vehicle, legs) for vehicle in (one, other) for legs in asked], placed=False)
    states = [each.states[:, :, 1:] for each in rolled]
    for a, b in zip(states[: len(asked)], states[len(asked) :], strict=True):
        gap += ((a - b) ** 2).sum(axis=(0, 1))
        size += (a**2).sum(axis=(0, 1))
    return np.sqrt(gap / size)


__all__ = ["Shooting", "ShootingSettings"]

_NOISE_SEED = 20041
"""Any number: the same noise is drawn for every model, so that two of them can be compared."""
_HALVINGS = 5
"""After five a step is a thirtieth of the first: too short to lead anywhere."""
_DEVIATIONS = ("compass_constant", "compass_sine", "compass_cosine")
"""How a compass deviates: by a constant, and with the heading."""
_FREE = 10.0
"""Spreads of the errors by which a free start may err, a regulariser: of a hundred, predictions are the same to two
digits."""
_TURN = 0.01
"""Deviation by which their derivative is taken [rad]: what turns speeds is all but linear in so little."""
_STEP_SHARE = 0.02
"""Share of a parameter's step that bends no column by more than a few per cent; a judgement, not measured."""


@final
class Shooting(Balance):
    """Rollout errors of one or more motions, see `Balance`; a test is a bin of a rollout.

    Attributes
    ----------
    block : no block holds rollouts of two logs
    independent : rollouts scored, those that overlap counted once
    data : what no vehicle changes

    Parameters
    ----------
    motions : the gap-free stretches, unfiltered
    about : model whose rollouts tell how start errors spread and which starts no model follows
    settings : horizon, spacing, bins
    laid : rollouts laid out before over the same motions with the same settings; None to lay them out
    followed : (starts,) weights of the starts about models before this one, which none exceeds: a start that one model
        alone follows, as where a hull is unstable and turns to either side by a hair, is no evidence for that model

    Raises
    ------
    RequestError
        when the motions hold too few rollouts for a few blocks, or have time steps that do not fit together.
    """

    unit: ClassVar[tuple[str, str, str]] = ("m/s", "m/s", "rad/s")
    forces: ClassVar[bool] = False

    def __init__(
        self,
        motions: Sequence[Motion],
        about: Vehicle,
        settings: ShootingSettings | None = None,
        laid: Rollings | None = None,
        followed: Array | None = None,
    ) -> None:
        self.settings = settings or ShootingSettings()
        self.data = data = laid or lay_out_rollouts(motions, about, self.settings)
        self.motions, self.noise = data.motions, data.noise
        self.tests, self.overlap = WeakSettings(), rollout_overlap(self.settings.horizon, self.settings.spacing)
        self.sources = [m.source for m, rows in zip(data.motions, data.starts, strict=True) for _ in rows]
        self.bins = bins = data.measured.shape[0]
        self.block = np.repeat(_blocks(data, self.settings.blocks), bins)
        begin = np.concatenate([m.time[s] for m, s in zip(data.motions, data.starts, strict=True)])
        width = data.per_bin * data.step
        self.time = (begin[:, None] + width * (np.arange(bins) + 0.5)).ravel()
        scored = float((data.weight.mean(axis=1) > 0).mean(axis=0).sum())
        self.independent = scored * min(1.0, self.settings.spacing / self.settings.horizon)
        states = data.states(about)
        error = self._errors(states)
        seen = data.weight > 0
        floor = np.maximum(data.noise, LEAST_NOISE) / np.sqrt(data.per_bin)
        usual = [spread(error[:, a][seen[:, a]]) if seen[:, a].any() else 0.0 for a in range(3)]
        self.scale = np.maximum(np.array(usual), floor)
        quiet = bool((data.noise < LEAST_NOISE).all()) and not self.settings.free_starts
        moved = None if quiet else data.binned(propagation(data, about, states).transitions())
        self._whitener = self._whitening(moved, self._turned(about, error)) if self.settings.whiten else None
        robust = self._robust(error)
        self._followed = robust if followed is None else np.minimum(robust, followed)
        self._weight = np.sqrt(data.weight) * np.sqrt(self._followed)[None, None, :]
        self._noise = self.finished(self._drawn_noise(moved))

    @property
    def reach(self) -> tuple[np.ndarray, Array, Array]:
        """See `Balance.reach`: a whole rollout, for errors of its start are taken out of every bin."""
        data = self.data
        number = np.repeat(np.arange(len(data.starts)), [rows.size for rows in data.starts])
        begin = np.concatenate([m.time[rows] for m, rows in zip(data.motions, data.starts, strict=True)])
        first = np.repeat(begin, self.bins)
        return np.repeat(number, self.bins), first, first + data.steps * data.step

    def refreshed(self, about: Vehicle) -> "Shooting":
        """The same rollouts, with start errors and weights about another model."""
        return Shooting(self.motions, about, self.settings, self.data, self._followed)

    def about(self, vehicle: Vehicle) -> Neighbourhood:
        """The balance by the linearised rollouts of the vehicle; added mass bends a column, so that steps are small."""
        tangent = Tangent(self.data, vehicle, self.finished, self.with_noise)
        memo: Remembered[Array] = Remembered(cache_limit(MANY, tangent.balances(vehicle).shape))
        return Neighbourhood(tangent.balances, tangent.difference, memo, step_share=_STEP_SHARE)

    def residual(self, vehicle: Vehicle) -> Array:
        """Measured minus predicted velocity, (tests, 3) [m/s, m/s, rad/s]; zero for a perfect model and log."""
        return self.finished(self._errors(self.data.states(vehicle)))

    def noisy_residuals(self, vehicle: Vehicle) -> Array:
        """The balance, and the same with sensor noise added once more, (2, tests, 3).

        Columns of effects are predictions from the same starts, so that the noise stands in the balance alone.
        """
        return self.with_noise(self.residual(vehicle))

    def propagated_noise(self, vehicle: Vehicle, copies: int, seed: int) -> None:
        """None: rollouts are asked where the noise has a colour, and then only what is left tells of it."""

    def of_switches(self, vehicle: Vehicle) -> None:
        """None: rollouts are integrated."""

    def recorded(self, motions: Sequence[Motion], vehicle: Vehicle) -> Array:
        """See `Balance.recorded`, [m/s, m/s, rad/s]."""
        data = self.data.recorded(motions)
        return self.finished(self._errors(data.states(vehicle), data.measured))

    def with_noise(self, balance: Array) -> Array:
        """A balance and its noisier copy, (2, tests, 3); a single one for a log without noise."""
        return np.stack([balance, balance + self._noise] if self._noise.any() else [balance])

    def finished(self, errors: Array) -> Array:
        """Errors (bins, 3, starts) with start errors whitened out and weights applied, as rows (tests, 3)."""
        bins, _, starts = errors.shape
        if self._whitener is not None:
            flat = errors.transpose(2, 0, 1).reshape(starts, bins * 3, 1)
            errors = (self._whitener @ flat)[..., 0].reshape(starts, bins, 3).transpose(1, 2, 0)
        return self._rows(errors * self._weight)

    def _turned(self, about: Vehicle, error: Array) -> Array | None:
        """What a compass that deviates, as it usually may, makes of each rollout, (bins, 3, starts, 3); None by none.

        By a constant and by waves with the heading, of other numbers in each rollout, so that it may change with
        anything else, slowly. None, too, where rollouts run away.
        """
        if self.settings.turned == 0.0:
            return None
        found = []
        for name in _DEVIATIONS:
            other = self.data.recorded([corrected_for(motion, {name: _TURN}) for motion in self.data.motions])
            found.append((self._errors(other.states(about), other.measured) - error) * (self.settings.turned / _TURN))
        moved = np.stack(found, axis=3)
        return moved if np.isfinite(moved).all() else None

    def nearer(self, vehicle: Vehicle, moved: Vehicle) -> Vehicle:
        """A Gauss-Newton step from one model to another, halved until the rollouts do not get worse.

        The first model where five halvings do not help, as when its neighbours' rollouts diverge.
        """
        moves = {s: v for s, v in moved.values.items() if v != vehicle.value(s)}
        before = self._cost(vehicle)
        for _ in range(_HALVINGS + 1):
            cost = self._cost(moved)
            if np.isfinite(cost) and not cost > before:
                return moved
            moves = {s: 0.5 * (v + vehicle.value(s)) for s, v in moves.items()}
            moved = vehicle.with_values(moves)
        return vehicle

    def _cost(self, vehicle: Vehicle) -> float:
        return float(((self.residual(vehicle) / self.scale) ** 2).sum())

    def squares(self, vehicle: Vehicle) -> Array:
        """Weighted mean square errors of each rollout, (starts, 3) [m^2/s^2, m^2/s^2, rad^2/s^2]."""
        bins, _, starts = self.data.measured.shape
        return (self.residual(vehicle).reshape(starts, bins, 3) ** 2).mean(axis=1)

    @property
    def speeds(self) -> Array:
        """Those of the bins."""
        return self._rows(self.data.measured)

    def largest_contribution(self, vehicle: Vehicle) -> Array:
        """The larger of measured change since the start and what thrust adds to the rollout, (tests, 3), as speeds."""
        data = self.data
        change = data.measured - data.initial[:, 1:].T
        thrust = self._errors(data.states(vehicle.with_values({"thrust_scale": 0.0}))) - self._errors(
            data.states(vehicle)
        )
        return self._rows(np.maximum(np.abs(change), np.abs(thrust)) * self._weight)

    def _errors(self, states: Array, measured: Array | None = None) -> Array:
        predicted = self.data.binned(states[:, :, 1:].transpose(1, 2, 0))
        return (self.data.measured if measured is None else measured) - predicted

    @staticmethod
    def _rows(values: Array) -> Array:
        """(bins, 3, starts) as rows (starts x bins, 3), start by start."""
        return np.ascontiguousarray(values.transpose(2, 0, 1)).reshape(-1, 3)

    def _robust(self, error: Array) -> Array:
        """Weight of each start (starts,), 1 for one that the model follows (soft-L1)."""
        if not np.isfinite(self.settings.robust):
            return np.ones(error.shape[2])
        scored = self.data.weight
        size = (scored * (error / self.scale[None, :, None]) ** 2).sum(axis=(0, 1)) / np.maximum(
            scored.sum(axis=(0, 1)), 1e-9
        )
        return 1.0 / np.sqrt(1.0 + size / self.settings.robust**2)

    def _drawn_noise(self, spread: Array | None) -> Array:
        """Sensor noise of the bins, and what that of the starts makes of the rollouts, (bins, 3, starts)."""
        data = self.data
        bins, _, starts = data.measured.shape
        rng = np.random.default_rng(_NOISE_SEED)
        noise = (rng.standard_normal((starts, bins, 3)) * data.noise / np.sqrt(data.per_bin)).transpose(1, 2, 0)
        if spread is None:
            return noise
        begin = rng.standard_normal((starts, 3)) * data.noise * data.calmed[:, None]
        return noise - np.einsum("bijs,sj->bis", spread, begin)

    def _whitening(self, spread: Array | None, turned: Array | None) -> Array | None:
        """(starts, 3 bins, 3 bins): the inverse root of 1 + S N S^T + t t^T, in units of the error.

        N is the start's noise, S how it spreads, and t what the compass may make of the rollout, as a normal error of
        each (generalised least squares; Ljung 1999, section 7.4). None where neither is.
        """
        start = self.data.noise
        if self.settings.free_starts:
            start = np.maximum(start, _FREE * self.scale)
        parts = [] if spread is None else [spread.transpose(3, 0, 1, 2) * (start / self.scale[:, None])]
        parts += [] if turned is None else [turned.transpose(2, 0, 1, 3) / self.scale[:, None]]
        if not parts:
            return None
        s = np.concatenate(parts, axis=3)
        starts, bins = s.shape[:2]
        s = s.reshape(starts, bins * 3, -1)
        vectors, size, _ = np.linalg.svd(s, full_matrices=False)
        shrink = 1.0 - 1.0 / np.sqrt(1.0 + size**2)
        unit = np.tile(self.scale, bins)
        root = np.eye(bins * 3) - (vectors * shrink[:, None, :]) @ vectors.transpose(0, 2, 1)
        return root * unit[None, :, None] / unit[None, None, :]


def _blocks(data: Rollings, most: int) -> np.ndarray:
    """Block of each start (starts,): each log is cut into blocks across its gaps, of `LEAST_STARTS` or more.

    A log is a row of stretches of one source in which time goes on. There are no more than `most` blocks, unless there
    are more logs.
    """
    logs: list[int] = []
    before: Motion | None = None
    for motion, rows in zip(data.motions, data.starts, strict=True):
        if before is not None and motion.source == before.source and motion.time[0] > before.time[-1]:
            logs[-1] += rows.size
        else:
            logs.append(rows.size)
        before = motion
    counts, blocks = np.array(logs), np.ones(len(logs), dtype=int)
    while blocks.sum() < max(LEAST_BLOCKS, most):
        share = counts // (blocks + 1)
        if share.max() < LEAST_STARTS:
            break
        blocks[share.argmax()] += 1
    begun = np.cumsum(blocks) - blocks
    pairs = zip(begun, counts, blocks, strict=True)
    return np.concatenate([first + np.arange(count) * parts // count for first, count, parts in pairs])
