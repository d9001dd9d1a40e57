"""What a controller believes of the boat: its model run along with what was measured, and the push that it lacks."""

from typing import NamedTuple, final

import numpy as np

from ..physics.frames import Array, wrap_angle
from .known_model import PERIOD, KnownModel, numbers

_TRUSTED = np.array([0.3, 0.3, 0.5, 0.4, 0.4, 0.5])
"""Share of each measurement in the belief: sensors of the field log (0.05 m, 0.3 deg, 0.015 m/s) against a model that
errs by some hundredths of a metre a second in a step."""
_PUSH_TIME = 10.0
"""Time in which a lasting push is learnt [s]: slower than all that the hull does by itself, as the integral of a
controller is, so that it takes away currents and trims and leaves manoeuvres to the model."""


class Belief(NamedTuple):
    """What is believed at one time.

    Attributes
    ----------
    state : of the model's `step`
    added : (3,) acceleration beside the model's own: what its network says, and the lasting push that was learnt
    push : (3,) the latter alone [m/s^2, m/s^2, rad/s^2]
    minutes : since the beginning
    """

    state: Array
    added: Array
    push: Array
    minutes: float


@final
class Observer:
    """An observer with fixed gains, the same whatever the model.

    Parameters
    ----------
    known : the model that is run
    measured : (6,) the first measurement: north, east [m], psi [rad], u, v [m/s], r [rad/s]; thrusters are at rest
    """

    def __init__(self, known: KnownModel, measured: Array) -> None:
        self._known = known
        self._walk = None if known.walk is None else known.walk()
        self.belief = Belief(numbers(known.start(measured, np.zeros(known.thrusters))), np.zeros(3), np.zeros(3), 0.0)
        self._seen = self._sees()
        if self._walk is not None:
            self.belief = self.belief._replace(added=self._walk.follow(self._seen[None])[-1])

    def learn(self, force: Array, measured: Array) -> Belief:
        """The belief after a `PERIOD` in which the forces at rest went to `force` (thrusters,), and a measurement."""
        before = self.belief
        state = numbers(self._known.step(before.state, force, before.added, before.minutes))
        news = measured - state[:6]
        news[2] = wrap_angle(news[2])
        state[:6] += _TRUSTED * news
        push = before.push + _TRUSTED[3:] * news[3:] / _PUSH_TIME
        self.belief = Belief(state, push, push, before.minutes + PERIOD / 60.0)
        if self._walk is not None:
            earlier, self._seen = self._seen, self._sees()
            parts = np.arange(1, self._known.rows + 1)[:, None] / self._known.rows
            said = self._walk.follow(earlier + parts * (self._seen - earlier))[-1]
            self.belief = self.belief._replace(added=push + said)
        return self.belief

    def along(self, states: Array) -> Array:
        """Acceleration beside the model's own on each step of a plan (steps, 3): states (steps + 1, state)."""
        belief, steps = self.belief, len(states) - 1
        if self._walk is None:
            return np.tile(belief.push, (steps, 1))
        minutes = belief.minutes + PERIOD / 60.0 * np.arange(steps + 1)
        seen = numbers(self._known.seen.map(steps + 1)(states.T, minutes)).T
        rows = self._known.rows
        where = np.arange(1, rows * steps + 1) / rows
        planned = np.column_stack([np.interp(where, np.arange(steps + 1), column) for column in seen.T])
        said = np.vstack([self._walk.said, self._walk.ahead(planned)])
        held = np.array([said[k * rows : (k + 1) * rows + 1].mean(axis=0) for k in range(steps)])
        return belief.push + held

    def _sees(self) -> Array:
        if self._walk is None:
            return np.zeros(0)
        return numbers(self._known.seen(self.belief.state, self.belief.minutes))
