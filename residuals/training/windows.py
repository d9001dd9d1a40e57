"""Chronological windows of rows for training, the filter of the output, and augmentation of a batch."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from scipy.linalg import convolution_matrix
from torch import Tensor

from ...measurements.preparation.prepare import DataSet, Recipe
from ...measurements.preparation.resampling import low_pass
from ...measurements.statistics.signals import noise_on_rows
from ...physics.errors import RequestError
from ...physics.forces import actuation, memory_states, stated_push
from ...physics.laws.damping_power import damping_power
from ...physics.laws.energy import INSIDE, allowed_power, thrust_power
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from ...physics.worlds.hidden_effects import random_hull
from ..models.network_inputs import network_inputs
from ..scores import target_acceleration
from .training_settings import TrainingSettings

_LEAST_TAP = 1e-3
"""Taps of the filter's impulse response below this are cut off."""
_REACH = 1000
"""Rows on each side of the impulse from which the response is read."""


@dataclass(frozen=True, slots=True)
class Windows:
    """Windows of one length, stacked; each row of a window is a row of a motion.

    Attributes
    ----------
    inputs : (windows, rows, inputs) what the network sees, SI
    target : (windows, rows, 3) measured minus (for a hybrid) modelled acceleration, filtered alike
    allowed, base : (windows, rows) [W] gain that is aimed at at most, see `energy.INSIDE`, and the physics' own
    states : (windows, rows, 6) heading [rad], velocity over ground, wake memory of sway speed and yaw rate
    thrust, load : (windows, rows, thrusters) [N], [N s/m]
    air : (windows, rows, 2) velocity of the air over ground [m/s]
    first : first row of a window that may be compared: earlier ones warm the network up
    reach : rows that the filter needs on each side of a row that is compared
    time_step : [s]
    """

    inputs: Array
    target: Array
    allowed: Array
    base: Array
    states: Array
    thrust: Array
    load: Array
    air: Array
    first: int
    reach: int
    time_step: float

    @property
    def compared(self) -> slice:
        """Rows of a window on which measured and modelled acceleration are compared."""
        return slice(self.first + self.reach, self.inputs.shape[1] - self.reach)

    def filter_matrix(self, taps: Array) -> Array:
        """The filter as a matrix (compared rows, rows), so that one product filters a batch of windows."""
        return convolution_matrix(taps[::-1], self.inputs.shape[1], mode="valid")[self.first :]


def filter_taps(recipe: Recipe, time_step: float) -> Array:
    """The zero-phase low-pass of a recipe as a symmetric filter (2 reach + 1,) that adds up to one.

    It is the impulse response of what `same_filter` does away from the ends; [1.0] without a cutoff.
    """
    if recipe.cutoff is None:
        return np.ones(1)
    impulse = np.zeros(2 * _REACH + 1)
    impulse[_REACH] = 1.0
    response = low_pass(impulse, time_step, recipe.cutoff, recipe.order)
    reach = int(np.flatnonzero(np.abs(response) >= _LEAST_TAP)[-1]) - _REACH
    taps = response[_REACH - reach : _REACH + reach + 1]
    return taps / taps.sum()


def windows_of(
    data: DataSet, vehicle: Vehicle, *, pure: bool, heading: bool, seconds: float, warm_up: float, overlap: float = 0.5
) -> Windows:
    """Cut the motions of a data set into windows.

    Windows overlap by a share, or by more where each compared row would else not be in one.

    Parameters
    ----------
    data : filtered motions
    pure : whether the network stands in the place of the physics
    heading : whether the network sees it
    seconds : length of a window [s]
    warm_up : at the start of a window, where nothing is compared [s]
    overlap : share of a window that the next one repeats

    Raises
    ------
    RequestError
        when the motions differ in their time step, or none is as long as a window, or a window is all edges.
    """
    steps = sorted({round(motion.time_step, 9) for motion in data.motions})
    if len(steps) != 1:
        raise RequestError(f"training: expected motions of one time step, got {steps} s; prepare them at one rate")
    step = steps[0]
    rows, first, reach = round(seconds / step), round(warm_up / step), filter_taps(data.recipe, step).size // 2
    kept = rows - first - 2 * reach
    if kept < 1:
        needed = (first + 2 * reach + 1) * step
        raise RequestError(
            f"training: a window of {seconds:g} s is all warm-up and filter edges; expected at least {needed:.1f} s"
        )
    motions = [motion for motion in data.motions if motion.time.size >= rows]
    if not motions:
        longest = max((motion.duration for motion in data.motions), default=0.0)
        raise RequestError(
            f"training: expected a stretch of at least {seconds:g} s without gaps, got {longest:.1f} s; give longer "
            "logs or shorter windows"
        )
    stride = max(1, min(round((1.0 - overlap) * rows), kept))
    pieces = [_window_rows(motion.time.size, rows, stride) for motion in motions]
    along = [_along(data, vehicle, motion, pure, heading) for motion in motions]
    columns = {
        name: np.concatenate([each[name][piece] for each, piece in zip(along, pieces, strict=True)])
        for name in along[0]
    }
    return Windows(**columns, first=first, reach=reach, time_step=step)


def _window_rows(length: int, rows: int, stride: int) -> np.ndarray:
    """Rows of a motion in each window (windows, rows), `stride` apart, the last one up to the end."""
    last = length - rows
    return np.append(np.arange(0, last, stride), last)[:, None] + np.arange(rows)


def _along(data: DataSet, vehicle: Vehicle, motion: Motion, pure: bool, heading: bool) -> dict[str, Array]:
    """Columns of `Windows` along a whole motion, by name."""
    seen, act = network_inputs(vehicle, motion, heading), actuation(vehicle, motion)
    speeds = seen[:, :3]
    if pure:
        base = -(speeds * stated_push(vehicle, motion.heading, tuple(speeds.T))).sum(axis=1)
    else:
        base = thrust_power(vehicle, motion) + damping_power(vehicle, speeds)
    return {
        "inputs": seen,
        "target": target_acceleration(vehicle, motion, data, pure),
        "allowed": allowed_power(vehicle, speeds, (act.thrust - act.load * seen[:, 0]).T, INSIDE),
        "base": base,
        "states": np.column_stack([motion.heading, motion.velocity, *memory_states(vehicle, motion)]),
        "thrust": act.thrust.T,
        "load": act.load.T,
        "air": np.zeros((motion.time.size, 2)) if motion.air is None else motion.air,
    }


SISTERS = 8
"""Hulls among which the physics of a window is drawn."""


def sister_targets(
    vehicle: Vehicle, settings: TrainingSettings, target: Array, *, pure: bool, cut_for: Callable[[Vehicle], Windows]
) -> Array | None:
    """Targets (sisters, windows, rows, 3) beside the physics of random sister hulls; None where none are asked for.

    They are centred on `target`, that beside the vehicle itself (windows, rows, 3): the network cannot see which sister
    is meant, so their mean is what it learns.

    Parameters
    ----------
    vehicle : of which hulls are sisters
    settings : of the training
    target : beside the vehicle itself (windows, rows, 3) [m/s^2, m/s^2, rad/s^2]
    pure : whether the network is without physics
    cut_for : cuts the training part into windows, beside the physics of a hull

    Raises
    ------
    RequestError
        for a pure network, which has no physics to vary.
    """
    spread = settings.augmentation.hull_spread
    if not spread:
        return None
    if pure:
        raise RequestError("augmentation: hull_spread varies the physics beside a network; a pure network has none")
    rng = np.random.default_rng([settings.seed, 12])
    targets = np.stack([cut_for(random_hull(vehicle, rng, spread)).target for _ in range(SISTERS)])
    return targets - targets.mean(axis=0) + target


def seen_noise(data: DataSet, settings: TrainingSettings, remembers: bool) -> Array:
    """White noise (3,) that is drawn onto the velocities that a network sees [m/s, m/s, rad/s].

    Parameters
    ----------
    data : the training part
    settings : of the training
    remembers : whether the network has a memory
    """
    wanted = settings.augmentation
    noise = np.array([wanted.speed_noise, wanted.speed_noise, wanted.yaw_rate_noise])
    own = settings.sensor_noise * noise_on_rows(data.raw) if remembers else 0.0
    return np.hypot(noise, own)


@final
class Augmenter:
    """Draws the variants of a batch of windows.

    Parameters
    ----------
    thrust_spread : of each thrust, see `Augmentation`; 0 for none
    noise : (3,) white noise on u, v [m/s] and r [rad/s]
    thrusters : number of thrust inputs
    targets : (sisters, windows, compared rows, 3), or None
    """

    def __init__(self, thrust_spread: float, noise: Array, thrusters: int, targets: Tensor | None) -> None:
        self.thrust_spread, self.thrusters, self.targets = thrust_spread, thrusters, targets
        self.noise = torch.as_tensor(noise, dtype=torch.float32)

    def __call__(self, inputs: Tensor, target: Tensor, index: Tensor, draw: torch.Generator) -> tuple[Tensor, Tensor]:
        """Inputs (batch, rows, inputs) and target (batch, compared rows, 3) of the windows `index`, varied."""
        batch = inputs.shape[0]
        if self.noise.any():
            noise = torch.zeros(inputs.shape)
            noise[..., :3] = torch.randn((*inputs.shape[:2], 3), generator=draw) * self.noise
            inputs = inputs + noise.to(inputs)
        if self.thrust_spread:
            gain = torch.ones((batch, 1, inputs.shape[-1]))
            spread = 2.0 * torch.rand((batch, 1, self.thrusters), generator=draw) - 1.0
            gain[..., 3 : 3 + self.thrusters] += self.thrust_spread * spread
            inputs = inputs * gain.to(inputs)
        if self.targets is not None:
            sister = torch.randint(self.targets.shape[0], (batch,), generator=draw).to(index)
            target = self.targets[sister, index]
        return inputs, target
