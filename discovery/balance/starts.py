"""Rollouts laid over motions: starts, what was measured along them, and all that no model changes."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ...measurements.preparation.split import IDLE, active
from ...measurements.statistics.blocks import spread
from ...measurements.statistics.signals import running_median, sensor_noise
from ...physics.errors import RequestError
from ...physics.forces import held_acceleration, memory_states
from ...physics.integration import Around, Driven, integrate
from ...physics.motion import Array, Motion
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle
from .base import LEAST_NOISE, LateForces, Remembered

HORIZON, WHOLE_HORIZON = 5.0, 10.0
"""Lengths of a rollout [s]: long enough to accumulate a wrong force, short enough to forget a noisy start; and long
enough to judge a model as a whole. What is fitted to the longer ones comes nearer the truth where a log holds enough of
them (`benchmarks/calibration.py --horizons`)."""
SPACING = HORIZON / 2.0
"""Distance between starts [s]: each instant is predicted from two of them."""
LEAST_STARTS, LEAST_BLOCKS = 4, 2
"""Rollouts in a block, of which two overlap, so that two count: the fewest with degrees of freedom; and blocks that a
log must hold: of one nothing is held out."""
SHORTEST = 2.0
"""Shortest rollout [s]: numbers of hulls that turn by themselves come as near the truth with 2 s as with 3
(`benchmarks/calibration.py --turning`)."""
_EVERY, _STEP = 0.5, 1e-4
"""Time between the rows at which the growth of errors is asked [s], and change of a speed by which it is asked [m/s,
rad/s]."""
_SPIKE = 4.0
"""Standard deviations from its neighbours from which a row is false: a normal error is by chance, in one row of
16,000."""
_ROUNDING = 1e-4
"""Rounding of time steps, as a share: half a millisecond in a rollout of 5 s."""
_KEPT = 64_000_000
"""Bytes of responses that are kept: on five minutes of log, those of every starting shape of two thrusters."""
_ROLLED = 2
"""Vehicles whose rollouts are kept: the one that a fit stands at, and the one that it tries."""


@dataclass(frozen=True, slots=True)
class ShootingSettings:
    """Layout of rollouts over the motions, and their score.

    Attributes
    ----------
    horizon : length of a rollout [s]
    spacing : distance between starts [s]
    bin : over which errors are averaged [s]
    step : longest integration step [s]; a log with finer steps is thinned to it
    blocks : most contiguous blocks for held-out scores and block bootstrap
    idle : rows without any command for longer than this are not scored [s]
    whiten : errors of the start states are whitened out
    free_starts : with `whiten`, nothing is known of a start but what its rollout tells: a wave that moves the boat
        there is over soon, and what forgets its start the sooner would seem the better model
    robust : standard errors from which a start counts less; infinite for least squares
    turned : standard deviation of what the heading that turned the speeds may lack [rad]; what it may have made of the
        rollouts is whitened out
    """

    horizon: float = HORIZON
    spacing: float = SPACING
    bin: float = 0.5
    step: float = 0.1
    blocks: int = 16
    idle: float = IDLE
    whiten: bool = True
    free_starts: bool = False
    robust: float = 2.0
    turned: float = 0.0


def limit_horizon(settings: ShootingSettings, motions: Sequence[Motion], *vehicles: Vehicle) -> ShootingSettings:
    """The same rollouts, but of 2 s or no longer than it takes an error of their start to grow e-fold.

    A hull whose Munk moment is larger than what its skeg and damping hold turns by itself. Over some such times
    rollouts tell of the noise of their starts, and the model that damps most seems the best one. A log without noise
    has the longest horizon.

    Parameters
    ----------
    settings : with the longest horizon
    motions : at whose measured states, under way, growth is asked; the mean over them counts, and decay is no growth
    vehicles : the one of them whose errors grow fastest counts
    """
    if not vehicles or bool((sensor_noise(motions) < LEAST_NOISE).all()):
        return settings
    fastest = 0.0
    for vehicle in vehicles:
        rates = [np.zeros(1)]
        for motion in motions:
            rows = np.flatnonzero(active(motion, vehicle))[:: max(1, round(_EVERY / motion.time_step))]
            rates.append(growth_rate(vehicle, motion.velocity[rows], motion.heading[rows], motion.commands[rows]))
        fastest = max(fastest, float(np.maximum(np.concatenate(rates), 0.0).mean()))
    if fastest * settings.horizon <= 1.0 or settings.horizon <= SHORTEST:
        return settings
    horizon = max(SHORTEST, settings.bin * float(np.floor(1.0 / fastest / settings.bin)))
    return replace(settings, horizon=horizon, spacing=min(settings.spacing, 0.5 * horizon))


def growth_rate(vehicle: Vehicle, velocity: Array, heading: Array, commands: Array) -> Array:
    """Largest real part of an eigenvalue of d(nu_dot)/d(nu) in some states (n,) [1/s].

    Parameters
    ----------
    velocity, heading, commands : (n, 3), (n,), (n, thrusters), as `forces.held_acceleration` takes them
    """
    moved = [
        held_acceleration(vehicle, velocity + by, heading, commands)
        for step in _STEP * np.eye(3)
        for by in (step, -step)
    ]
    slope = np.stack([(more - less) / (2.0 * _STEP) for more, less in zip(moved[::2], moved[1::2], strict=True)], -1)
    return np.asarray(np.linalg.eigvals(slope).real.max(axis=-1))


@dataclass(frozen=True, slots=True)
class Rollings:
    """Everything about the rollouts that no vehicle changes.

    Attributes
    ----------
    motions : the gap-free stretches
    starts : for each motion, the rows on which rollouts begin
    stride : rows of each motion in one integration step
    step : integration step [s]
    steps, per_bin : integration steps of a rollout, and of a bin
    initial : (starts, 4) measured psi, u, v, r
    measured : (bins, 3, starts) mean measured velocity of each bin
    weight : (bins, 3, starts) share of the rows of each bin that count, 0 where the boat is idle
    noise : (3,) white sensor noise of one row
    window : (steps + 1, starts) rows of all motions along the rollouts
    counted : (n, 3) of each motion, 1 for a number that counts, 0 where the boat is idle or the number jumps
    air : (2, steps + 1, starts) velocity of the air over ground, north and east [m/s]; None where no log tells of it
    thrusts : what thrusters of a gain and a loss of one make of the commands
    kept : the same along the rollouts, whole rows late, which many models share
    rolled : states of the latest vehicles: a step that is tried is where the next one begins
    """

    motions: tuple[Motion, ...]
    starts: tuple[np.ndarray, ...]
    stride: tuple[int, ...]
    step: float
    steps: int
    per_bin: int
    initial: Array
    measured: Array
    weight: Array
    noise: Array
    thrusts: LateForces
    window: np.ndarray
    counted: tuple[Array, ...]
    air: Array | None = None
    kept: Remembered[Array] = field(init=False, default_factory=lambda: Remembered(_KEPT))
    rolled: deque[tuple[Vehicle, Array]] = field(init=False, default_factory=lambda: deque(maxlen=_ROLLED))

    def inputs(self, vehicle: Vehicle) -> tuple[Array, Array]:
        """Thrust and its advance loss along all rollouts, (thrusters, steps + 1, starts) each."""
        units = [self.response(k, thruster.unit) for k, thruster in enumerate(vehicle.thrusters)]
        pairs = list(zip(vehicle.thrusters, units, strict=True))
        return np.stack([t.gain * u[0] for t, u in pairs]), np.stack([t.advance_loss * u[1] for t, u in pairs])

    def response(self, index: int, unit: Thruster) -> tuple[Array, Array]:
        """Force [N] and load [N s/m] of a thruster along all rollouts, (steps + 1, starts) each."""
        shape = (index, unit.prompt_shape, unit.thrust_rate)

        def along(rows: tuple[int, ...]) -> Array:
            return self.kept.of((*shape, rows), partial(self._along, index, unit, rows))

        force, load = self.thrusts.between(unit, along, [rows.size for rows in self.starts])
        return force, load

    def _along(self, index: int, unit: Thruster, late: tuple[int, ...]) -> Array:
        """The same of whole rows late, (2, steps + 1, starts)."""
        ends = np.cumsum([motion.time.size for motion in self.motions])[:-1]
        parts = np.split(self.thrusts.shifted(index, unit, late), ends, axis=1)
        thin = np.concatenate([_thinned(part, stride) for part, stride in zip(parts, self.stride, strict=True)], axis=1)
        return thin.take(self.window, axis=1)

    def recorded(self, motions: Sequence[Motion]) -> "Rollings":
        """The same rollouts of the same motions, had other commands or velocities been recorded of them."""
        sizes = [(stride, self.steps, self.per_bin) for stride in self.stride]
        parts = zip(motions, self.counted, self.starts, sizes, strict=True)
        measured = [_bins(*part)[0].transpose(1, 2, 0) for part in parts]
        begin = zip(motions, self.starts, strict=True)
        return replace(
            self,
            motions=tuple(motions),
            initial=np.concatenate([np.column_stack([m.heading, _calm(m)])[rows] for m, rows in begin]),
            measured=np.concatenate(measured, axis=2),
            thrusts=LateForces(motions),
        )

    def states(self, vehicle: Vehicle) -> Array:
        """Open-loop psi, u, v, r along all rollouts, (starts, steps + 1, 4)."""
        for known, states in self.rolled:
            if known is vehicle:
                return states
        self.rolled.append((vehicle, self._rolled_out(vehicle)))
        return self.rolled[-1][1]

    def _rolled_out(self, vehicle: Vehicle) -> Array:
        thrust, load = self.inputs(vehicle)
        remembers = vehicle.values["memory_sway"] or vehicle.values["memory_yaw"]
        memory = self.memory(vehicle) if remembers else None
        with np.errstate(over="ignore", invalid="ignore"):
            around = Around(self.air, self.minutes[0])
            return integrate(Driven(vehicle, self.initial, thrust, load, memory, around), self.step).states

    @property
    def minutes(self) -> Array:
        """Time since the beginning of the log along all rollouts, (steps + 1, starts)."""
        begin = np.concatenate([m.minutes[rows] for m, rows in zip(self.motions, self.starts, strict=True)])
        return begin + self.step / 60.0 * np.arange(self.steps + 1)[:, None]

    @property
    def calmed(self) -> Array:
        """Share of the noise of one row that is left in each start, the median of a few rows, (starts,).

        The variance of a median of n normal numbers is about pi / (2 n + pi - 2) of theirs.
        """
        left = [np.sqrt(np.pi / (2.0 * _calm_rows(m) + np.pi - 2.0)) for m in self.motions]
        return np.repeat(left, [rows.size for rows in self.starts])

    def memory(self, vehicle: Vehicle) -> Array:
        """Wake memory of sway speed and yaw rate at the starts, (starts, 2), from the motion before them."""
        pairs = zip(self.motions, self.starts, strict=True)
        return np.concatenate([np.column_stack(memory_states(vehicle, m))[rows] for m, rows in pairs])

    def binned(self, series: Array) -> Array:
        """Means over the bins of a series (steps + 1, ...) whose first row is the start: (bins, ...)."""
        return series[1:].reshape(-1, self.per_bin, *series.shape[1:]).mean(axis=1)


def lay_out_rollouts(motions: Sequence[Motion], vehicle: Vehicle, settings: ShootingSettings) -> Rollings:
    """Lay starts over the motions, and bin what was measured.

    Parameters
    ----------
    motions : gap-free stretches, in the order of time
    vehicle : the model whose thrusters and water are asked
    settings : spacing, horizon, bin and integration step [s]

    Raises
    ------
    RequestError
        when the motions hold too few rollouts, or when the time step of one does not go into the integration step.
    """
    coarsest = max((m.time_step for m in motions), default=settings.step)
    step = coarsest * max(1, round(settings.step / coarsest))
    per_bin = max(1, round(settings.bin / step))
    steps = per_bin * max(1, round(settings.horizon / (per_bin * step)))
    kept, starts, strides, masks, initial, measured, weight, windows, air = [], [], [], [], [], [], [], [], []
    for motion in motions:
        stride = max(1, round(step / motion.time_step))
        if abs(stride * motion.time_step - step) > _ROUNDING * step:
            raise RequestError(
                f"shooting: expected time steps that go into the integration step of {step:g} s, got "
                f"{motion.time_step:g} s in {motion.source or 'a motion without a source'}; prepare all logs with one "
                f"time step, such as that of the coarsest, {coarsest:g} s"
            )
        length = steps * stride
        rows = np.arange(0, motion.time.size - length, max(1, round(settings.spacing / motion.time_step)))
        counted = active(motion, vehicle, settings.idle).astype(float)[:, None] * _clean(motion)
        mean, share = _bins(motion, counted, rows, (stride, steps, per_bin))
        used = (share > 0).any(axis=(1, 2))
        if not used.any():
            continue
        begun = rows[used]
        window = begun + stride * np.arange(steps + 1)[:, None]
        windows.append(sum(before.time.size for before in kept) + window)
        blown = np.zeros((motion.time.size, 2)) if motion.air is None else motion.air  # still without an anemometer
        air.append(_thinned(blown.T, stride)[:, window])
        kept.append(motion)
        starts.append(begun)
        strides.append(stride)
        masks.append(counted)
        initial.append(np.column_stack([motion.heading, _calm(motion)])[begun])
        measured.append(mean[used].transpose(1, 2, 0))
        weight.append(share[used].transpose(1, 2, 0))
    count = sum(rows.size for rows in starts)
    if count < LEAST_BLOCKS * LEAST_STARTS:
        raise RequestError(
            f"shooting: {count} rollouts of {settings.horizon:g} s with commands fit into the log, at least "
            f"{LEAST_BLOCKS * LEAST_STARTS} are needed; give a longer log"
        )
    return Rollings(
        tuple(kept),
        tuple(starts),
        tuple(strides),
        step,
        steps,
        per_bin,
        np.concatenate(initial),
        np.concatenate(measured, axis=2),
        np.concatenate(weight, axis=2),
        sensor_noise(kept),
        LateForces(kept),
        np.concatenate(windows, axis=1),
        tuple(masks),
        None if all(motion.air is None for motion in kept) else np.concatenate(air, axis=2),
    )


def _bins(motion: Motion, counted: Array, rows: np.ndarray, sizes: tuple[int, int, int]) -> tuple[Array, Array]:
    """Mean velocity of each bin of rollouts that begin on `rows`, and the share that counts, (starts, bins, 3) each.

    Parameters
    ----------
    counted : (n, 3) of each number of the motion, 1 or 0
    sizes : rows in a step, steps of a rollout, and steps in a bin
    """
    stride, steps, per_bin = sizes
    window = rows[:, None] + stride * np.arange(1, steps + 1)
    shape = (rows.size, steps // per_bin, per_bin, 3)
    # Thinned about the predicted rows: means over the rows between them would lag behind the prediction.
    series = (motion.velocity, motion.velocity * counted, counted)
    value, seen, share = (_thinned(x.T, stride).T[window].reshape(shape) for x in series)
    total = share.sum(axis=2)
    return np.where(total > 0, seen.sum(axis=2) / np.maximum(total, 1e-12), value.mean(axis=2)), total / per_bin


def _clean(motion: Motion) -> np.ndarray:
    """False on rows whose velocity jumps out of its neighbours by more than the motion and its noise can, (n, 3)."""
    middle = _calm(motion)
    away = np.abs(motion.velocity - middle)
    usual = spread(away, axis=0) + LEAST_NOISE
    return away <= np.maximum(_SPIKE * usual, 0.02 * np.ptp(motion.velocity, axis=0))


def _calm(motion: Motion) -> Array:
    """Velocities without single false rows: the median over half a second, (n, 3)."""
    return running_median(motion.velocity, _calm_rows(motion))


def _calm_rows(motion: Motion) -> int:
    return 2 * round(0.25 / motion.time_step) + 1


def _thinned(series: Array, stride: int) -> Array:
    """A series (channels, n) averaged over `stride` rows about each row, so that thinning keeps its area."""
    if stride == 1:
        return series
    padded = np.pad(series, ((0, 0), (stride, stride)), mode="edge")
    kernel = np.convolve(np.ones(stride), np.ones(stride)) / stride**2
    half = kernel.size // 2
    parts = [w * padded[:, stride + k - half : stride + k - half + series.shape[1]] for k, w in enumerate(kernel)]
    return np.sum(parts, axis=0)
