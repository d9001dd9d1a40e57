"""The closed loop: a controller steers the true boat along a track, and sees of it what sensors see."""

from dataclasses import dataclass
from time import thread_time

import numpy as np

from ..physics.frames import Array
from ..physics.vehicle import Vehicle
from .base import Controller
from .feed_forward import FeedForward
from .known_model import PERIOD, KnownModel
from .nmpc import PredictiveControl
from .observer import Observer
from .tracks import Track
from .true_boat import Surroundings, TrueBoat

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
    seconds : (n - 1,) of processor time that the controller took for each period [s]
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
    motion, command = (
        np.tile(boat.motion, (rows, 1)),
        np.tile(known.inverse.command(np.zeros(known.thrusters)), (rows, 1)),
    )
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
