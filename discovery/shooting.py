"""Multiple shooting: the error of open-loop rollouts as a balance that the search can work on, as on the weak form.

From a start every 2.5 s the model runs open loop under the logged commands; measured minus predicted velocity, averaged
over bins of half a second, is the balance [m/s, m/s, rad/s] (output error; Bock 1983 for multiple shooting). A force
that pointwise noise hides accumulates in a rollout, and coloured noise on the velocities is not mistaken for a force
that follows the motion. Errors of the measured start states are whitened out; starts and rows that no model can follow
count less (soft-L1, Triggs et al. 2000, section 4.3).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import median_filter

from ..measurements.alignment import noise_level
from ..physics.errors import RequestError
from ..physics.forces import actuation, memory_states
from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.simulation import integrate
from ..physics.thrusters import Thruster
from ..physics.vehicle import Vehicle
from .tangent import Tangent, transitions

_LEAST_STARTS, _LEAST_BLOCKS = 4, 3
_NOISE_SEED = 20041
_IDLE_COMMAND = 0.03
_SPIKE = 4.0
_KEPT = 16
_HALVINGS = 5
_LEAST_NOISE = np.array([1e-4, 1e-4, 1e-4])


@dataclass(frozen=True, slots=True)
class ShootingSettings:
    """How rollouts are laid over the motions and scored.

    Attributes
    ----------
    horizon : length of a rollout [s]
    spacing : distance between starts [s]
    bin : over which errors are averaged [s]
    step : longest integration step [s]; a log with finer steps is thinned to it
    blocks : most contiguous blocks for held-out scores and block bootstrap
    idle : rows without any command for longer than this are not scored [s]
    whiten : errors of the start states are whitened out
    robust : standard errors from which a start counts less; infinite for least squares
    """

    horizon: float = 5.0
    spacing: float = 2.5
    bin: float = 0.5
    step: float = 0.1
    blocks: int = 16
    idle: float = 8.0
    whiten: bool = True
    robust: float = 2.0


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
    initial : (starts, 6) measured north, east, psi, u, v, r
    measured : (bins, 3, starts) mean measured velocity of each bin
    weight : (bins, 3, starts) share of the rows of each bin that count, 0 where the boat is idle
    noise : (3,) white sensor noise of one row
    kept : thrust and loss by thrusters, which many models share
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
    kept: dict[tuple[Thruster, ...], tuple[Array, Array]] = field(default_factory=dict)

    def inputs(self, vehicle: Vehicle) -> tuple[Array, Array]:
        """Thrust and its advance loss along all rollouts, (thrusters, steps + 1, starts) each; the latest are kept."""
        if vehicle.thrusters in self.kept:
            return self.kept[vehicle.thrusters]
        thrust, load = [], []
        for motion, starts, stride in zip(self.motions, self.starts, self.stride, strict=True):
            act = actuation(vehicle, motion)
            window = starts[None, :] + stride * np.arange(self.steps + 1)[:, None]
            thrust.append(_thinned(act.thrust, stride)[:, window])
            load.append(_thinned(act.load, stride)[:, window])
        if len(self.kept) >= _KEPT:
            self.kept.pop(next(iter(self.kept)))
        self.kept[vehicle.thrusters] = np.concatenate(thrust, axis=2), np.concatenate(load, axis=2)
        return self.kept[vehicle.thrusters]

    def states(self, vehicle: Vehicle) -> Array:
        """Open-loop states along all rollouts, (starts, steps + 1, 6)."""
        thrust, load = self.inputs(vehicle)
        remembers = vehicle.values["memory_sway"] or vehicle.values["memory_yaw"]
        memory = self.memory(vehicle) if remembers else None
        with np.errstate(over="ignore", invalid="ignore"):
            return integrate(vehicle, self.step, self.initial, thrust, load, memory).states

    def memory(self, vehicle: Vehicle) -> Array:
        """Wake memory of sway speed and yaw rate at the starts, (starts, 2), from the motion before them."""
        pairs = zip(self.motions, self.starts, strict=True)
        return np.concatenate([np.column_stack(memory_states(vehicle, m))[rows] for m, rows in pairs])

    def binned(self, series: Array) -> Array:
        """Means over the bins of a series (steps + 1, ...) whose first row is the start: (bins, ...)."""
        return series[1:].reshape(-1, self.per_bin, *series.shape[1:]).mean(axis=1)


class Shooting:
    """Rollout errors of one or more motions, in the form that `Search` and `Linearisation` take.

    Attributes
    ----------
    motions : the gap-free stretches; no rollout reaches across two of them
    time : (tests,) time of each bin [s]
    block : (tests,) index of the contiguous block each bin belongs to; no block holds rollouts of two logs
    independent : effective number of independent tests: rollouts scored, those that overlap counted once
    noise : (3,) white sensor noise on u, v [m/s] and r [rad/s]
    memo : kept for the duck type; columns change with the model, so `about` gives each model a memo of its own
    blind : (3,) True for an axis that is not scored

    Parameters
    ----------
    motions : the gap-free stretches, unfiltered
    about : model whose rollouts tell how start errors spread and which starts no model follows
    settings : horizon, spacing, bins
    blind : axes that are not scored

    Raises
    ------
    RequestError
        when the motions hold too few rollouts for a few blocks.
    """

    unit = ("m/s", "m/s", "rad/s")
    forces = False

    def __init__(
        self,
        motions: Sequence[Motion],
        about: Vehicle,
        settings: ShootingSettings | None = None,
        blind: Sequence[bool] = (False, False, False),
    ) -> None:
        self.settings = settings or ShootingSettings()
        self._data = _lay(motions, about, self.settings)
        self._setup(about, np.asarray(blind, dtype=bool))

    def _setup(self, about: Vehicle, blind: np.ndarray) -> None:
        data = self._data
        self.motions, self.noise = data.motions, data.noise
        self.blind = blind
        self.memo: dict[tuple[object, ...], Array] = {}
        bins, _, starts = data.measured.shape
        self.block = np.repeat(_blocks(data, self.settings.blocks), bins)
        begin = np.concatenate([m.time[s] for m, s in zip(data.motions, data.starts, strict=True)])
        width = data.per_bin * data.step
        self.time = (begin[:, None] + width * (np.arange(bins) + 0.5)).ravel()
        scored = float((data.weight.mean(axis=1) > 0).mean(axis=0).sum())
        self.independent = scored * min(1.0, self.settings.spacing / self.settings.horizon)
        states = data.states(about)
        error = self._errors(states)
        seen = data.weight > 0
        floor = np.maximum(data.noise, _LEAST_NOISE) / np.sqrt(data.per_bin)
        middle = np.array([np.median(np.abs(error[:, a][seen[:, a]])) if seen[:, a].any() else 0.0 for a in range(3)])
        self.scale = np.maximum(1.4826 * middle, floor)
        self._whitener = self._whitening(about, states)
        self._weight = np.sqrt(data.weight) * np.sqrt(self._robust(error))[None, None, :]
        self._weight[:, blind] = 0.0
        rng = np.random.default_rng(_NOISE_SEED)
        noise = rng.standard_normal((starts * bins, 3)) * data.noise / np.sqrt(data.per_bin)
        self._noise = noise * self._rows(self._weight)

    def refreshed(self, about: Vehicle) -> "Shooting":
        """The same rollouts, with start errors and weights about another model."""
        other = object.__new__(Shooting)
        other.settings, other._data = self.settings, self._data
        other._setup(about, self.blind)
        return other

    def about(self, vehicle: Vehicle) -> Tangent:
        """The balance of models near one, by the linearised rollouts of that model."""
        return Tangent(self, vehicle)

    @property
    def data(self) -> Rollings:
        """What no vehicle changes."""
        return self._data

    def balance(self, vehicle: Vehicle) -> Array:
        """Measured minus predicted velocity, (tests, 3) [m/s, m/s, rad/s]; zero for a perfect model and log."""
        return self.finished(self._errors(self._data.states(vehicle)))

    def balances(self, vehicle: Vehicle) -> Array:
        """The balance, and the same with sensor noise added once more, (2, tests, 3).

        Columns of effects are predictions from the same starts, so that the noise stands in the balance alone.
        """
        return self.with_noise(self.balance(vehicle))

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

    def nearer(self, vehicle: Vehicle, moved: Vehicle) -> Vehicle:
        """A Gauss-Newton step from one model to another, halved until the rollouts do not get worse."""
        moves = {s: v for s, v in moved.values.items() if v != vehicle.value(s)}
        before = self._cost(vehicle)
        for _ in range(_HALVINGS):
            if self._cost(moved) <= before:
                break
            moves = {s: 0.5 * (v + vehicle.value(s)) for s, v in moves.items()}
            moved = vehicle.with_values(moves)
        return moved

    def _cost(self, vehicle: Vehicle) -> float:
        return float(((self.balance(vehicle) / self.scale) ** 2).sum())

    def squares(self, vehicle: Vehicle) -> Array:
        """Weighted mean square errors of each rollout, (starts, 3) [m^2/s^2, m^2/s^2, rad^2/s^2]."""
        bins, _, starts = self._data.measured.shape
        return (self.balance(vehicle).reshape(starts, bins, 3) ** 2).mean(axis=1)

    @property
    def sources(self) -> list[str]:
        """Where each rollout comes from."""
        return [m.source for m, rows in zip(self._data.motions, self._data.starts, strict=True) for _ in rows]

    def force_scale(self, vehicle: Vehicle) -> Array:
        """Size of the velocities that the forces make within a rollout (3,) [m/s, m/s, rad/s].

        The root mean square of the measured change since the start, or of what the thrust adds to a rollout of the
        model, whichever is larger.
        """
        return np.sqrt((self.largest_force(vehicle) ** 2).mean(axis=0))

    def largest_force(self, vehicle: Vehicle) -> Array:
        """The larger of measured change of velocity and what thrust adds to the prediction, (tests, 3)."""
        data = self._data
        change = data.measured - data.initial[:, 3:].T
        thrust = self._errors(data.states(vehicle.with_values({"thrust_scale": 0.0}))) - self._errors(
            data.states(vehicle)
        )
        return self._rows(np.maximum(np.abs(change), np.abs(thrust)) * self._weight)

    def _errors(self, states: Array) -> Array:
        predicted = self._data.binned(states[:, :, 3:].transpose(1, 2, 0))
        return self._data.measured - predicted

    @staticmethod
    def _rows(values: Array) -> Array:
        """(bins, 3, starts) as rows (starts x bins, 3), start by start."""
        return np.ascontiguousarray(values.transpose(2, 0, 1)).reshape(-1, 3)

    def _robust(self, error: Array) -> Array:
        """Weight of each start (starts,), 1 for one that the model follows (soft-L1)."""
        if not np.isfinite(self.settings.robust):
            return np.ones(error.shape[2])
        scored = self._data.weight * ~self.blind[None, :, None]
        size = (scored * (error / self.scale[None, :, None]) ** 2).sum(axis=(0, 1)) / np.maximum(
            scored.sum(axis=(0, 1)), 1e-9
        )
        return 1.0 / np.sqrt(1.0 + size / self.settings.robust**2)

    def _whitening(self, about: Vehicle, states: Array) -> Array | None:
        """(starts, 3 bins, 3 bins): the inverse root of 1 + S N S^T, N the start's noise in units of the error."""
        noise = self._data.noise
        if not self.settings.whiten or (noise < _LEAST_NOISE).all():
            return None
        spread = self._data.binned(transitions(self._data, about, states))
        bins, _, _, starts = spread.shape
        s = spread.transpose(3, 0, 1, 2) * (noise / self.scale[:, None])
        s = s.reshape(starts, bins * 3, 3)
        vectors, size, _ = np.linalg.svd(s, full_matrices=False)
        shrink = 1.0 - 1.0 / np.sqrt(1.0 + size**2)
        unit = np.tile(self.scale, bins)
        root = np.eye(bins * 3) - (vectors * shrink[:, None, :]) @ vectors.transpose(0, 2, 1)
        return root * unit[None, :, None] / unit[None, None, :]


def _lay(motions: Sequence[Motion], vehicle: Vehicle, settings: ShootingSettings) -> Rollings:
    """Lay starts over the motions, and bin what was measured."""
    finest = max((m.time_step for m in motions), default=settings.step)
    step = finest * max(1, round(settings.step / finest))
    per_bin = max(1, round(settings.bin / step))
    steps = per_bin * max(1, round(settings.horizon / (per_bin * step)))
    kept, starts, strides, initial, measured, weight = [], [], [], [], [], []
    for motion in motions:
        stride = max(1, round(step / motion.time_step))
        length = steps * stride
        rows = np.arange(0, motion.time.size - length, max(1, round(settings.spacing / motion.time_step)))
        counted = _active(motion, vehicle, settings.idle).astype(float)[:, None] * _clean(motion)
        window = rows[:, None] + stride * np.arange(1, steps + 1)
        shape = (rows.size, steps // per_bin, per_bin, 3)
        # Thinned about the predicted rows: means over the rows between them would lag behind the prediction.
        value, seen, share = (
            _thinned(x.T, stride).T[window].reshape(shape)
            for x in (motion.velocity, motion.velocity * counted, counted)
        )
        total = share.sum(axis=2)
        used = (total > 0).any(axis=(1, 2))
        if not used.any():
            continue
        mean = np.where(total > 0, seen.sum(axis=2) / np.maximum(total, 1e-12), value.mean(axis=2))
        kept.append(motion)
        starts.append(rows[used])
        strides.append(stride)
        initial.append(np.column_stack([motion.position, motion.heading, _calm(motion)])[rows[used]])
        measured.append(mean[used].transpose(1, 2, 0))
        weight.append((total / per_bin)[used].transpose(1, 2, 0))
    count = sum(rows.size for rows in starts)
    if count < _LEAST_BLOCKS * _LEAST_STARTS:
        raise RequestError(
            f"shooting: {count} rollouts of {settings.horizon:g} s with commands fit into the log, at least "
            f"{_LEAST_BLOCKS * _LEAST_STARTS} are needed; give a longer log"
        )
    rows = np.array([m.time.size for m in kept], dtype=float)
    levels = np.array([[noise_level(m.velocity[:, a]) or 0.0 for a in range(3)] for m in kept])
    noise = np.sqrt((levels**2 * rows[:, None]).sum(axis=0) / rows.sum())
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
        noise,
    )


def _blocks(data: Rollings, most: int) -> np.ndarray:
    """Block of each start (starts,): every motion is cut into blocks by its share, at least one each."""
    counts = np.array([rows.size for rows in data.starts])
    total = int(counts.sum())
    most = max(_LEAST_BLOCKS, min(most, total // _LEAST_STARTS))
    found, begun = [], 0
    for count in counts.tolist():
        blocks = max(1, min(round(most * count / total), count // _LEAST_STARTS))
        found.append(begun + np.arange(count) * blocks // count)
        begun += blocks
    return np.concatenate(found)


def _active(motion: Motion, vehicle: Vehicle, idle: float) -> np.ndarray:
    """True on rows with a command within the last `idle` seconds, (n,)."""
    commands = motion.commands if motion.run_up is None else np.concatenate([motion.run_up, motion.commands])
    sizes = [np.abs(t.curve.normalised(commands[:, k], t.command)) for k, t in enumerate(vehicle.thrusters)]
    on = np.max(sizes, axis=0) > _IDLE_COMMAND
    row = np.arange(on.size)
    last = np.maximum.accumulate(np.where(on, row, -np.inf))
    return (row - last <= idle / motion.time_step)[on.size - motion.time.size :]


def _clean(motion: Motion) -> np.ndarray:
    """False on rows whose velocity jumps out of its neighbours by more than the motion and its noise can, (n, 3)."""
    middle = _calm(motion)
    away = np.abs(motion.velocity - middle)
    spread = 1.4826 * np.median(away, axis=0) + _LEAST_NOISE
    return away <= np.maximum(_SPIKE * spread, 0.02 * np.ptp(motion.velocity, axis=0))


def _calm(motion: Motion) -> Array:
    """Velocities without single false rows: the median over half a second, (n, 3)."""
    width = 2 * round(0.25 / motion.time_step) + 1
    return median_filter(motion.velocity, size=(width, 1), mode="nearest")


def _thinned(series: Array, stride: int) -> Array:
    """A series (thrusters, n) averaged over `stride` rows about each row, so that thinning keeps its area."""
    if stride == 1:
        return series
    padded = np.pad(series, ((0, 0), (stride, stride)), mode="edge")
    kernel = np.convolve(np.ones(stride), np.ones(stride)) / stride**2
    half = kernel.size // 2
    parts = [w * padded[:, stride + k - half : stride + k - half + series.shape[1]] for k, w in enumerate(kernel)]
    return np.sum(parts, axis=0)
