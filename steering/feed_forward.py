"""Path following by line of sight: the motion that is wanted, and the thrust that the model says it takes.

Feedback says how speed and yaw rate should change; the model's own force equation, solved for thrust at the belief,
says which forces do that (feedback linearisation, Fossen 2021, chapter 16). The lasting push that the observer learns
is its integral.
"""

from typing import ClassVar, final

import numpy as np

from ..physics.forces import relative_velocity
from ..physics.frames import Array, wrap_angle
from .base import Asked, Controller
from .guidance import Steering, line_of_sight
from .known_model import PERIOD, numbers
from .observer import Belief, Observer

_SPEED_TIME, _RATE_TIME, _HEADING_TIME = 0.7, 0.4, 1.0
"""Times in which errors of speed, yaw rate and heading are made good [s]. Heading and rate make a pair of poles of
damping 0.8 at 1.6 rad/s, speed and place (`guidance`) one of damping 1 at 0.7 rad/s: slower than the 0.4 s that command
and belief are late by, and a little quicker than the hulls of this kind are by themselves."""
_LEAD = 0.3
"""Lag that is left of a motor when more is asked of it than it should give [s]: less would ask for its limits."""
_SLOWEST = 0.3
"""Share of the pace's speed below which the drift angle says nothing: both speeds are then mostly noise."""
_MOST_DRIFT = 0.8
"""Drift angle beyond which the bow is not turned further [rad]: the boat is then being carried away."""


@final
class FeedForward(Controller):
    """Line-of-sight guidance over the model's inverse."""

    name: ClassVar[str] = "los"

    def ask(self, observer: Observer) -> Asked:
        """See `Controller.ask`."""
        belief = observer.belief
        state, late = self._when_it_acts(belief)
        minutes = belief.minutes + late * PERIOD / 60.0
        point = self.track.at(60.0 * minutes)[0]
        wanted = line_of_sight(point, state[:2], float(state[2]), self.track.pace)
        change = self._change(wanted, state)
        pull = numbers(self.known.pulled(state, minutes)) + belief.added
        push = np.asarray(self.known.pushed(state, minutes), dtype=float)
        force = self._shared(push[[0, 2]], change - pull[[0, 2]])
        force = self._ahead_of_lag(force, state)
        own = self.known.program.vehicle
        u, v, r = state[3:6]
        through, _, _ = relative_velocity(own, state[2], (u, v, r), minutes)
        return Asked(force, float(through))

    def _when_it_acts(self, belief: Belief) -> tuple[Array, int]:
        """The state at which what is asked for now acts, and in how many periods that is."""
        late = 1 + max(int(t.delay / PERIOD + 0.5) for t in self.known.program.vehicle.thrusters)
        state, last = belief.state, belief.state[self.known.lately]
        for k in range(late):
            minutes = belief.minutes + k * PERIOD / 60.0
            state = numbers(self.known.step(state, last, belief.added, minutes))
        return state, late

    def _change(self, wanted: Steering, state: Array) -> Array:
        """Rates of change of surge speed and yaw rate (2,) [m/s^2, rad/s^2]."""
        psi, u, v, r = state[2:6]
        fast = max(abs(u), _SLOWEST * self.track.pace.speed)
        drift = float(np.arctan2(v, fast)) * wanted.way
        bow = wanted.course - float(np.clip(drift, -_MOST_DRIFT, _MOST_DRIFT))
        rate = wanted.turn + float(wrap_angle(np.array(bow - psi))) / _HEADING_TIME
        most = 2.0 * self.track.pace.turn_rate
        rate = float(np.clip(rate, -most, most))
        return np.array([wanted.rise + (wanted.speed - u) / _SPEED_TIME, wanted.turn_rise + (rate - r) / _RATE_TIME])

    def _shared(self, push: Array, change: Array) -> Array:
        """Forces within the thrusters' limits (thrusters,) that make a change (2,), the turn before the way ahead."""
        lower, upper = self.known.inverse.lower, self.known.inverse.upper
        inverse = np.linalg.pinv(push)
        turn = np.clip(inverse[:, 1] * change[1], lower, upper)
        way = inverse[:, 0] * change[0]
        room = np.where(way > 0.0, upper - turn, lower - turn)
        share = np.divide(room, way, out=np.ones_like(way), where=np.abs(way) > 0.0)
        return turn + way * float(np.clip(share.min(), 0.0, 1.0))

    def _ahead_of_lag(self, force: Array, state: Array) -> Array:
        """More than is wanted of motors that lag, so that they are as quick as `_LEAD`."""
        lags = np.array([t.lag for t in self.known.program.vehicle.thrusters])
        acting = state[self.known.acting]
        eager = acting + (force - acting) * np.maximum(lags / _LEAD, 1.0)
        return np.clip(eager, self.known.inverse.lower, self.known.inverse.upper)
