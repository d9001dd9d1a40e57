"""Learnable residual: how much of what a vehicle leaves unexplained exceeds sensor noise and the log's preparation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..measurements.preparation.prepare import DataSet
from ..measurements.preparation.resampling import smooth
from ..measurements.statistics.signals import drawn_noise, noise_level, noise_on_rows
from ..physics.integration import rollout
from ..physics.motion import AXES, Array, Motion
from ..physics.vehicle import Vehicle
from .models.base import VehicleModel
from .scores import residual, rollout_scores

_DRAWS = 5
"""Times that noise is drawn anew: its own scatter then adds a tenth to that of the error."""
_WORTH = 2.0
"""Times what preparation leaves in rollouts that an error must be, noise apart, to be worth a network: at 2 a perfect
one would halve it."""
_HORIZONS = (10.0, 2.0)
"""Of the rollouts, the longest that fits into the motions [s]."""
_SPACING = 2.0
"""Between the starts of rollouts [s]."""
_SURE = 3.0
"""Standard deviations of its scatter by which a squared error must exceed the noise: by chance one axis in 700 does."""


@dataclass(frozen=True, slots=True, eq=False)
class LearnableResidual:
    """Residual of a vehicle on some motions, root mean squares (3,) [m/s^2, m/s^2, rad/s^2], and its learnable part.

    Noise of the sensors and preparation are what no model explains: differences, the filter, the instants of commands.

    Attributes
    ----------
    measured : the acceleration
    error : of the vehicle's
    noise : of that error, by the sensors alone
    preparation : of that error, by the preparation alone
    position : error of position in rollouts [m]
    position_floor, position_preparation : the same along twins that the vehicle itself has made, with the noise of the
        sensors and without [m]
    horizon : of the rollouts [s]; 0 where none fits
    scatter : relative deviation of a mean square over these motions: their rows are filtered, and tell less than as
        many of their own
    """

    measured: Array
    error: Array
    noise: Array
    preparation: Array
    position: float
    position_floor: float
    position_preparation: float
    horizon: float
    scatter: float

    @property
    def floor(self) -> Array:
        """Noise and preparation together."""
        return np.hypot(self.noise, self.preparation)

    @property
    def learnable(self) -> np.ndarray:
        """Mask of the axes on which the error is more than the floor, by more than chance."""
        return self.error**2 > self.floor**2 * (1.0 + _SURE * self.scatter)

    @property
    def worth_it(self) -> bool:
        """True when a network has something to learn on any axis, and much to gain in rollouts."""
        gain = self.position**2 - self.position_floor**2
        rolls = self.horizon == 0.0 or gain > (_WORTH**2 - 1.0) * self.position_preparation**2
        return bool(rolls and self.learnable.any())

    def to_dict(self) -> dict[str, dict[str, float | bool]]:
        """By axis, and of rollouts."""
        rollout = {
            "error": self.position,
            "floor": self.position_floor,
            "preparation": self.position_preparation,
            "horizon": self.horizon,
        }
        names = ("measured", "error", "noise", "preparation", "learnable")
        return {"position": rollout} | {
            axis: {name: getattr(self, name)[k].item() for name in names} for k, axis in enumerate(AXES)
        }


def measure_learnable_residual(vehicle: Vehicle, parts: Sequence[DataSet], seed: int = 0) -> LearnableResidual:
    """Measure what a vehicle leaves unexplained of the motions of parts that were prepared alike.

    The noise of the error is how much it changes when as much noise as the sensors have is drawn anew onto the
    unfiltered motions: that goes through the filter, the differences and the vehicle as the sensors' own did. What
    preparation leaves is the vehicle's error on a twin of each motion that the vehicle itself has made, see `twin`.

    Parameters
    ----------
    vehicle : the model whose residual is asked
    parts : prepared alike, filtered
    seed : of the noise that is drawn
    """
    data = parts[0]
    motions, raw = ([m for part in parts for m in getattr(part, kind)] for kind in ("motions", "raw"))
    own = [residual(vehicle, motion, data) for motion in motions]
    level, rng = noise_on_rows(raw), np.random.default_rng([seed, 17])
    errors = [each.measured - each.modelled for each in own]
    changes = [
        _error(vehicle, _noisy(motion, level, data, rng), data) - was
        for _ in range(_DRAWS)
        for motion, was in zip(raw, errors, strict=True)
    ]
    twins = [twin(vehicle, motion) for motion in raw]
    heard = [_heard(each, level, motion, rng) for each, motion in zip(twins, raw, strict=True)]
    prepared = [tuple(_filtered(each, data) for each in made) for made in (heard, twins)]
    horizon, (position, floor, preparation) = _rolled(vehicle, [replace(data, motions=m) for m in (motions, *prepared)])
    rate = 1.0 / motions[0].time_step
    seconds = sum(motion.duration for motion in motions)
    independent = seconds * min(rate, 2.0 * (data.recipe.cutoff or rate))
    return LearnableResidual(
        measured=_root([each.measured for each in own]),
        error=_root(errors),
        noise=_root(changes),
        preparation=_root([_error(vehicle, each, data) for each in prepared[1]]),
        position=position,
        position_floor=floor,
        position_preparation=preparation,
        horizon=horizon,
        scatter=float(np.sqrt(2.0 / max(independent, 1.0))),
    )


def twin(vehicle: Vehicle, motion: Motion) -> Motion:
    """The motion that a vehicle itself would have made, had each command come half a step of its record earlier.

    A record tells no better when a command came; one that is held where it changed between two records, or the other
    way round, is wrong by as much.
    """
    early = motion.time + 0.5 * (motion.command_step or motion.time_step)
    commands = np.column_stack([np.interp(early, motion.time, column) for column in motion.commands.T])
    driven = replace(motion, commands=commands)
    states = rollout(vehicle, driven, np.array([0]), motion.time.size - 1).states[0]
    return replace(motion, position=states[:, :2], heading=states[:, 2], velocity=states[:, 3:])


def _heard(made: Motion, level: Array, motion: Motion, rng: np.random.Generator) -> Motion:
    """A twin as the sensors of a motion would have recorded it."""
    place = np.column_stack([motion.position, motion.heading])
    drawn = rng.standard_normal(place.shape) * [noise_level(column) or 0.0 for column in place.T]
    return replace(
        made,
        position=made.position + drawn[:, :2],
        heading=made.heading + drawn[:, 2],
        velocity=made.velocity + drawn_noise(motion, level, rng),
    )


def _rolled(vehicle: Vehicle, each: Sequence[DataSet]) -> tuple[float, list[float]]:
    """The longest horizon [s] of rollouts that fits, and their error of position on each data set [m]; else zeros."""
    model = VehicleModel(vehicle, "alone")
    found = [rollout_scores(model, data, _HORIZONS, _SPACING) for data in each]
    horizon = next((h for h in _HORIZONS if f"{h:g}" in found[0]), 0.0)
    return horizon, [scores[f"{horizon:g}"].position if horizon else 0.0 for scores in found]


def _noisy(motion: Motion, level: Array, data: DataSet, rng: np.random.Generator) -> Motion:
    """A motion with noise on its velocities, filtered as the data are."""
    return _filtered(replace(motion, velocity=motion.velocity + drawn_noise(motion, level, rng)), data)


def _filtered(motion: Motion, data: DataSet) -> Motion:
    return motion if data.recipe.cutoff is None else smooth(motion, data.recipe.cutoff, data.recipe.order)


def _error(vehicle: Vehicle, motion: Motion, data: DataSet) -> Array:
    found = residual(vehicle, motion, data)
    return found.measured - found.modelled


def _root(parts: Sequence[Array]) -> Array:
    return np.sqrt((np.concatenate(parts) ** 2).mean(axis=0))
