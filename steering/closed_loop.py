"""Closed loop: a controller steers the true boat along a track, through noisy sensors; figures of merit judge it."""

from dataclasses import dataclass, replace
from time import thread_time
from typing import ClassVar, final

import numpy as np

from ..exports.formats.to_casadi import casadi_function
from ..exports.program.model_program import program_of
from ..physics.file_records import Flag, Number, Record, Whole
from ..physics.motion import Array
from ..physics.thrusters import neutral_command
from ..physics.vehicle import Vehicle
from ..physics.worlds.world import FINE_STEP, NOISE, Sensors
from .controllers import Controller, FeedForward, PredictiveControl
from .known_model import PERIOD, KnownModel, Observer, numbers
from .tracks import Track

_STREAMS = {"sensors": 1, "push": 2, "current": 3}
"""Numbers that keep the random series of a world apart."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What no model knows of a world.

    Attributes
    ----------
    push : deviation of the acceleration by gusts and waves [m/s^2, m/s^2, rad/s^2]
    push_time : time in which they change [s]
    current : speed of a steady current from anywhere [m/s], beside what the vehicle has
    sensors : what the controller measures with
    """

    push: tuple[float, float, float] = (0.02, 0.02, 0.01)
    push_time: float = 2.0
    current: float = 0.05
    sensors: Sensors = NOISE["field"]

    @property
    def calm(self) -> "Surroundings":
        """The same without anything that disturbs: sensors are exact and the water stands."""
        return replace(self, push=(0.0, 0.0, 0.0), current=0.0, sensors=NOISE["clean"])


@final
class TrueBoat:
    """A boat at sea, at rest over ground at the origin, heading north.

    Commands go in a straight line from one period's end to the next. The same seed gives the same gusts, current and
    sensor noise whoever steers.

    Parameters
    ----------
    vehicle : the true one
    seconds : for which there are gusts
    """

    def __init__(self, vehicle: Vehicle, surroundings: Surroundings, seconds: float, seed: int) -> None:
        drift = np.random.default_rng([seed, _STREAMS["current"]]).uniform(-np.pi, np.pi)
        drifts = {"current_north": np.cos(drift), "current_east": np.sin(drift)}
        current = {s: vehicle.value(s) + float(surroundings.current * part) for s, part in drifts.items()}
        self.vehicle = vehicle.with_values(current)
        program = program_of(self.vehicle, FINE_STEP, corrected="beside")
        self._groups = [group.name for group in program.step.inputs]
        self._step = casadi_function(program.step)
        self._fine = round(PERIOD / FINE_STEP)
        self._command = np.array([neutral_command(t) for t in vehicle.thrusters])
        begins = casadi_function(program.start)
        given = {"motion": np.zeros(6), "command": self._command, "minutes": 0.0, "air": np.zeros(2)}
        self._state = numbers(begins(*(given[group.name] for group in program.start.inputs)))
        rows = round(seconds / PERIOD) + 1
        self._pushes = _gusts(surroundings, rows, seed)
        own = surroundings.sensors
        deviation = np.array([own.position, own.position, own.heading, own.speed, own.speed, own.yaw_rate])
        self._noise = deviation * np.random.default_rng([seed, _STREAMS["sensors"]]).standard_normal((rows, 6))
        self._row = 0

    @property
    def motion(self) -> Array:
        """The truth (6,): north, east [m], psi [rad], u, v [m/s], r [rad/s]."""
        return self._state[:6]

    def measured(self) -> Array:
        """The motion (6,) as sensors have it."""
        return self.motion + self._noise[self._row]

    def advance(self, command: Array) -> None:
        """Go on for a `PERIOD`, in which the commands (thrusters,) go to these."""
        for k in range(1, self._fine + 1):
            given = {
                "state": self._state,
                "command": self._command + k / self._fine * (command - self._command),
                "added": self._pushes[self._row],
                "minutes": (self._row * PERIOD + (k - 1) * FINE_STEP) / 60.0,
                "air": np.zeros(2),
            }
            self._state = numbers(self._step(*(given[name] for name in self._groups)))
        self._command = command
        self._row += 1


def _gusts(surroundings: Surroundings, rows: int, seed: int) -> Array:
    """Accelerations (rows, 3): first-order processes of the given deviations."""
    rng = np.random.default_rng([seed, _STREAMS["push"]])
    keep = np.exp(-PERIOD / surroundings.push_time)
    found = rng.standard_normal((rows, 3))
    for k in range(1, rows):
        found[k] = keep * found[k - 1] + np.sqrt(1.0 - keep**2) * found[k]
    return found * np.array(surroundings.push)


CONTROLLERS: dict[str, type[Controller]] = {each.name: each for each in (FeedForward, PredictiveControl)}
"""The controllers by name."""
_LOST = 20.0
"""Distance from its point at which a boat counts as lost [m], and is no longer steered: it is off any of the tracks."""


@dataclass(frozen=True, slots=True, eq=False)
class Passage:
    """A track as a boat went it, a row each `PERIOD`.

    Attributes
    ----------
    track : that it was to follow
    motion : (n, 6) the truth; what comes after it was lost is its last place
    command : (n, thrusters) reached at each row, in the thrusters' units
    share : (n, thrusters) the same as shares of full command
    seconds : of processor time that the controller took for each period [s], (n - 1,) or until the boat was lost
    unsolved : periods for which its problem was not solved
    lost : whether it was lost on the way
    """

    track: Track
    motion: Array
    command: Array
    share: Array
    seconds: Array
    unsolved: int
    lost: bool

    @property
    def time(self) -> Array:
        """Instants of the rows [s]."""
        return PERIOD * np.arange(len(self.motion), dtype=float)


def drive(
    known: KnownModel, controller: str, vehicle: Vehicle, around: Surroundings, track: Track, seed: int
) -> Passage:
    """Steer a true boat along a track.

    Parameters
    ----------
    known : the controller's model
    controller : one of `CONTROLLERS`
    vehicle : the true boat, of which the controller sees measurements alone
    around : gusts, current and sensors
    seed : of what is random around the boat
    """
    rows = round(track.seconds / PERIOD) + 1
    boat = TrueBoat(vehicle, around, track.seconds, seed)
    observer = Observer(known, boat.measured())
    pilot = CONTROLLERS[controller](known, track)
    points = track.at(PERIOD * np.arange(rows, dtype=float))
    motion = np.tile(boat.motion, (rows, 1))
    command = np.tile(known.inverse.command(np.zeros(known.thrusters)), (rows, 1))
    spent, unsolved, lost = np.zeros(rows - 1), 0, False
    for k in range(1, rows):
        begun, minutes = thread_time(), observer.belief.minutes
        asked = pilot.ask(observer)
        force = np.clip(asked.force, known.inverse.lower, known.inverse.upper)
        command[k] = known.inverse.command(force, minutes, asked.advance)
        unsolved += not asked.solved
        spent[k - 1] = thread_time() - begun
        boat.advance(command[k])
        motion[k] = boat.motion
        if not np.hypot(*(motion[k, :2] - points[k, :2])) <= _LOST:
            motion[k:], command[k:], spent, lost = motion[k - 1], command[k], spent[:k], True
            break
        begun = thread_time()
        observer.learn(known.inverse.at_rest(command[k], minutes), boat.measured())
        spent[k - 1] += thread_time() - begun
    return Passage(track, motion, command, known.inverse.share(command), spent, unsolved, lost)


WIDE = 1.0
"""Half the width of the lane in which a boat is to stay about its point, in seconds at the pace's speed: about a length
of the hull."""
_FULL = 0.99
"""Share of full command from which a thruster is at its limit: what is left is rounding."""


class Merit(Record):
    """How well a boat was steered.

    Attributes
    ----------
    rmse : root mean square of the distance from the moving point [m]
    across : the same across the track alone [m]
    worst : largest distance [m]
    effort : root mean square of the commands as shares of full, over all thrusters
    off_lane : share of the time farther from the point than `WIDE`
    at_limit : share of the time with a thruster at its limit
    step : median of the processor time that the controller took for a period [ms]
    slow_step : time that one in twenty exceeded [ms]
    unsolved : periods whose problem was not solved
    lost : the boat was lost
    """

    rmse: Number
    across: Number
    worst: Number
    effort: Number
    off_lane: Number
    at_limit: Number
    step: Number
    slow_step: Number
    unsolved: Whole
    lost: Flag


def merit(passage: Passage) -> Merit:
    """The figures of a passage."""
    points = passage.track.at(passage.time)
    away = passage.motion[:, :2] - points[:, :2]
    across = -np.sin(points[:, 2]) * away[:, 0] + np.cos(points[:, 2]) * away[:, 1]
    distance = np.hypot(*away.T)
    share = np.abs(passage.share)
    return Merit(
        rmse=float(np.sqrt(np.mean(distance**2))),
        across=float(np.sqrt(np.mean(across**2))),
        worst=float(distance.max()),
        effort=float(np.sqrt(np.mean(share**2))),
        off_lane=float(np.mean(distance > WIDE * passage.track.pace.speed)),
        at_limit=float(np.mean(share.max(axis=1) >= _FULL)),
        step=1e3 * float(np.median(passage.seconds)),
        slow_step=1e3 * float(np.quantile(passage.seconds, 0.95)),
        unsolved=passage.unsolved,
        lost=passage.lost,
    )


PERFECT = "perfect"
"""Name of the model that is the true boat itself: no controller of the kind does much better."""


class Tracking(Record):
    """A model on a track.

    Attributes
    ----------
    model : its name
    track : one of `tracks.TRACKS`
    merit : its figures
    against_first : its RMSE less that of the first model, as a share of that
    """

    model: str
    track: str
    merit: Merit
    against_first: Number


class ControlRecord(Record):
    """All of a trial, as `undertow control --json` prints it.

    Attributes
    ----------
    vehicle : the true boat
    hidden : what it has beside its file, as symbol=value
    controller : that all models had
    speed, turn_rate : the pace of the tracks [m/s, rad/s]
    seed : of gusts, current and sensor noise
    results : track by track, the models in their order, the perfect one last
    """

    SCHEMA: ClassVar[str] = "undertow.control/1"
    vehicle: str
    hidden: tuple[str, ...]
    controller: str
    speed: Number
    turn_rate: Number
    seed: Whole
    results: tuple[Tracking, ...]
