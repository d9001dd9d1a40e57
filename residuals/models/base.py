"""The interface of a model (accelerations along a motion, open-loop rollouts), a vehicle as a model, and the baselines.

A baseline lets motion go on as it is; a model that predicts worse knows nothing of the boat.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import ClassVar, Literal, final

import numpy as np

from ...measurements.preparation.split import Fold
from ...physics.forces import held_acceleration, modelled_acceleration
from ...physics.integration import Legs, Rollouts, rollout, rollouts
from ...physics.motion import Array, Motion, body_to_earth, earth_to_body
from ...physics.vehicle import Vehicle
from .band_record import PredictionBand
from .network_inputs import network_inputs

Kind = Literal["physics", "symbolic", "hybrid", "network", "baseline"]
_AT_ONCE = 300_000
"""Steps of all rollouts of one batch: enough for arrays to pay, and few enough for 50 MB whatever the log's length."""


class Model(ABC):
    """A model of motion under commands.

    Attributes
    ----------
    name : how tables call it
    kind : physics, symbolic, hybrid, network, or baseline
    parameters : how many numbers were fitted
    seconds_to_fit : time that fitting took [s]
    remembers : whether its acceleration may depend on the motion before
    vehicle : whose commands it takes
    rests_on : what makes sure that it dissipates: its `vehicle`, `itself` by construction, `nothing`, or `bounds` that
        `residuals.models.bounds` may find
    time_step : of rollouts, where no motion gives one [s]
    seen : lower and upper ends of u, v, r and the thrusts that it was trained on; None where it does not tell
    band : of its predictions, as its run or its own file has it; None where neither does
    fades : whether its correction counts by a gain that falls with the distance from its training
    far : distance beyond its training from which rows are far from it [standard deviations]: where its gain ends, or
        what other networks have hardly ever met
    """

    name: str
    kind: Kind
    parameters: int
    seconds_to_fit: float
    remembers: bool = True
    vehicle: Vehicle
    rests_on: Literal["vehicle", "itself", "bounds", "nothing"] = "nothing"
    time_step: float = 0.1
    seen: tuple[Array, Array] | None = None
    band: PredictionBand | None = None
    fades: bool = False
    far: float = 1.0

    @abstractmethod
    def acceleration(self, motion: Motion) -> Array:
        """Acceleration over ground along a measured motion, (n, 3) [m/s^2, m/s^2, rad/s^2]."""

    @abstractmethod
    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """Open-loop rollouts of `steps` steps from the rows `starts` of a measured motion.

        Parameters
        ----------
        motion : measured, with commands and their history
        starts : row numbers (batch,)
        steps : time steps of each rollout
        """

    def rollouts(self, asked: Sequence[Legs]) -> list[Rollouts]:
        """The rollouts of several motions."""
        return [self.rollout(*legs) for legs in asked]

    def beyond(self, motion: Motion) -> Array:
        """Distance of rows beyond the training data, (n,) [standard deviations]; 0 where it does not tell."""
        if self.seen is None:
            return np.zeros(motion.time.size)
        seen = network_inputs(self.vehicle, motion, heading=False)
        low, high = (ends[: seen.shape[1]] for ends in self.seen)  # two deviations to each side
        over = np.maximum(np.maximum(low - seen, seen - high), 0.0) / (0.25 * (high - low))
        return np.sqrt((over**2).sum(axis=1))

    def margin(self, motion: Motion) -> Array | None:
        """Margin of its acceleration about the measured one, (n, 3); None where it does not tell."""
        del motion
        return None

    @abstractmethod
    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """Acceleration over ground in states that have lasted, (n, 3) [m/s^2, m/s^2, rad/s^2], in still air.

        Parameters
        ----------
        velocity : (n, 3) over ground [m/s, m/s, rad/s]
        heading : (n,) [rad]
        commands : (n, thrusters) in the unit of the vehicle's thrusters
        """


def rolled_out(models: Sequence[Model], asked: Sequence[Legs]) -> Iterator[tuple[Model, Legs, Array]]:
    """Open-loop rollouts of each model, the longest first, and their states (batch, steps + 1, 6).

    A few at a time for the memory; those of vehicles side by side, in one batch.
    """
    vehicles = [model for model in models if isinstance(model, VehicleModel)]
    others = [[model] for model in models if not isinstance(model, VehicleModel)]
    for alike in filter(None, (vehicles, *others)):
        crowd: list[tuple[Model, Legs]] = []
        for part in (part for legs in sorted(asked, key=lambda legs: -legs.steps) for part in _cut(legs)):
            for model in alike:
                if sum(legs.starts.size * legs.steps for _, legs in (*crowd, (model, part))) > _AT_ONCE:
                    yield from _states(crowd)
                    crowd = []
                crowd.append((model, part))
        yield from _states(crowd)


def _states(crowd: Sequence[tuple[Model, Legs]]) -> Iterator[tuple[Model, Legs, Array]]:
    """What is rolled out, of vehicles or of one model."""
    driven = [(model.vehicle_in(legs.motion), legs) for model, legs in crowd if isinstance(model, VehicleModel)]
    every = rollouts(driven) if driven or not crowd else crowd[0][0].rollouts([legs for _, legs in crowd])
    for (model, legs), found in zip(crowd, every, strict=True):
        yield model, legs, found.states


def _cut(legs: Legs) -> list[Legs]:
    """The same rollouts in parts of at most `_AT_ONCE` steps."""
    most = max(1, _AT_ONCE // legs.steps)
    return [legs._replace(starts=legs.starts[k : k + most]) for k in range(0, legs.starts.size, most)]


@final
class VehicleModel(Model):
    """A vehicle file as a model.

    Parameters
    ----------
    unseen : folds of the log that it was fitted to, each with the vehicle that was fitted without it, which answers for
        the motions in it
    """

    def __init__(
        self,
        vehicle: Vehicle,
        name: str,
        kind: Kind = "physics",
        parameters: int = 0,
        seconds_to_fit: float = 0.0,
        unseen: Sequence[tuple[Fold, Vehicle]] = (),
    ) -> None:
        self.vehicle = vehicle
        self._unseen = tuple(unseen)
        self.rests_on = "vehicle"
        self.name = name
        self.kind = kind
        self.parameters = parameters
        self.seconds_to_fit = seconds_to_fit

    def acceleration(self, motion: Motion) -> Array:
        """See `Model.acceleration`."""
        return modelled_acceleration(self.vehicle_in(motion), motion)

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """See `Model.rollout`."""
        return rollout(self.vehicle_in(motion), motion, starts, steps)

    def rollouts(self, asked: Sequence[Legs]) -> list[Rollouts]:
        """See `Model.rollouts`."""
        return rollouts([(self.vehicle_in(legs.motion), legs) for legs in asked])

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`."""
        return held_acceleration(self.vehicle, velocity, heading, commands)

    @property
    def without_folds(self) -> tuple[tuple[Fold, Vehicle], ...]:
        """Folds of the log that it was fitted to, each with the vehicle that was fitted without it."""
        return self._unseen

    def vehicle_in(self, motion: Motion) -> Vehicle:
        """The vehicle that answers for a motion: the one that was fitted without it, where there is one."""
        return next((vehicle for fold, vehicle in self._unseen if fold.holds(motion)), self.vehicle)


_STRAIGHT = 1e-9
"""Yaw rate [rad/s] below which an arc is a straight line."""


class Baseline(Model):
    """Motion without forces, whose rollouts have a closed form."""

    kind: Kind = "baseline"
    parameters = 0
    seconds_to_fit = 0.0
    remembers = False

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle

    def acceleration(self, motion: Motion) -> Array:
        """See `Model.acceleration`."""
        return self.settled(motion.velocity, motion.heading, motion.commands)

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """See `Model.rollout`."""
        rows = np.asarray(starts, dtype=int)
        t = np.arange(steps + 1, dtype=float) * motion.time_step
        psi, nu = motion.heading[rows], motion.velocity[rows]
        states = np.empty((rows.size, steps + 1, 6))
        states[..., 2] = psi[:, None] + nu[:, 2:] * t
        states[..., 5] = nu[:, 2:]
        self._go(states, t, psi, nu)
        states[..., :2] += motion.position[rows][:, None]
        return Rollouts(states, np.zeros(rows.size, dtype=bool))

    @abstractmethod
    def _go(self, states: Array, t: Array, psi: Array, nu: Array) -> None:
        """Fill in the way made [m] and the velocities u, v [m/s] of states (starts, steps + 1, 6) at times t [s]."""


@final
class ZeroAcceleration(Baseline):
    """No acceleration: nu_dot = 0. Body velocities are held, so a boat that turns goes round in a circle."""

    name: ClassVar[str] = "zero acceleration"

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`."""
        return np.zeros_like(velocity)

    def _go(self, states: Array, t: Array, psi: Array, nu: Array) -> None:
        u, v, r = (x[:, None] for x in nu.T)
        states[..., 3], states[..., 4] = u, v
        turned = r * t
        still = np.abs(r) < _STRAIGHT
        rate = np.where(still, 1.0, r)
        ahead = np.where(still, t, np.sin(turned) / rate)
        aside = np.where(still, 0.5 * turned * t, 2.0 * np.sin(0.5 * turned) ** 2 / rate)
        states[..., 0], states[..., 1] = body_to_earth(psi[:, None], u * ahead - v * aside, u * aside + v * ahead)


@final
class HoldVelocity(Baseline):
    """No force in earth axes: velocity over ground and turn rate are held, u_dot = r v and v_dot = -r u."""

    name: ClassVar[str] = "hold velocity"

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`."""
        u, v, r = velocity.T
        return np.column_stack([r * v, -r * u, np.zeros_like(r)])

    def _go(self, states: Array, t: Array, psi: Array, nu: Array) -> None:
        north, east = (x[:, None] for x in body_to_earth(psi, nu[:, 0], nu[:, 1]))
        states[..., 0], states[..., 1] = north * t, east * t
        states[..., 3], states[..., 4] = earth_to_body(states[..., 2], north, east)


def baselines(vehicle: Vehicle) -> tuple[Model, ...]:
    """All baselines, for the commands of a vehicle."""
    return ZeroAcceleration(vehicle), HoldVelocity(vehicle)
