"""Controllers: line-of-sight path following by feedback linearisation, and nonlinear model predictive control.

A controller takes a belief and a track, and gives forces of the thrusters. Line of sight and feedback linearisation
follow Fossen, *Handbook of Marine Craft Hydrodynamics and Motion Control* (2nd ed., 2021), chapters 12 and 16; the push
that the observer learns is the integral.
"""

from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple, final

import numpy as np

from ..exports.formats.base import required
from ..physics.forces import relative_velocity
from ..physics.motion import Array, body_to_earth, earth_to_body, wrap_angle
from .known_model import PERIOD, Belief, KnownModel, Observer, numbers
from .tracks import Pace, Track


class ControlRequest(NamedTuple):
    """What a controller asks for, to be reached at the end of the period.

    Attributes
    ----------
    force : (thrusters,) [N]
    advance : surge speed through the water at which the forces are meant [m/s]; 0 for forces at rest
    solved : whether what it solves was solved; where not, it asks for what it had planned before
    """

    force: Array
    advance: float = 0.0
    solved: bool = True


class Controller(ABC):
    """A controller that knows one model.

    Parameters
    ----------
    known : its model
    track : that it is to follow

    Attributes
    ----------
    name : how the command line calls it
    """

    name: ClassVar[str]

    def __init__(self, known: KnownModel, track: Track) -> None:
        self.known, self.track = known, track

    @abstractmethod
    def ask(self, observer: Observer) -> ControlRequest:
        """Forces for what is believed now."""


LOOKAHEAD = 4.0
"""Lookahead distance, in seconds at the pace's speed: some lengths of the hull, as the book advises."""
_CATCH_UP = 3.0
"""Time in which an along-track error is made good [s]."""
_FASTEST = 1.6
"""Share of the pace's speed that catching up may ask for: under a half of full thrust where drag is quadratic."""
_SLOW = 0.2
"""Share of the pace's speed below which steering fades: it turns round where the boat changes to astern, without a jump
of the course, and at such a speed no course would bring the boat to its line."""
_AT_PLACE = 0.3
"""Distance within which a boat is at its place, in seconds at the pace's speed: what positions are measured to."""


class Steering(NamedTuple):
    """Speed along the hull [m/s], course over ground [rad], and what both are expected to change by.

    Attributes
    ----------
    rise : of the speed [m/s^2]
    turn, turn_rise : of the course [rad/s, rad/s^2]
    way : 1 ahead, -1 where the boat goes backwards along the course's line, between them where hardly any way is wanted
    """

    speed: float
    course: float
    rise: float = 0.0
    turn: float = 0.0
    turn_rise: float = 0.0
    way: float = 1.0


def line_of_sight(point: Array, place: Array, heading: float, pace: Pace) -> Steering:
    """Steering towards a point of a track.

    Parameters
    ----------
    point : (7,) of `Track.at`
    place : (2,) north, east of the boat [m]
    heading : of the boat [rad]
    """
    north, east, course, speed, turn, rise, turn_rise = point.tolist()
    if speed == 0.0 and rise == 0.0:
        return _kept_place(np.array([north, east]) - place, heading, pace)
    along, across = earth_to_body(np.array(course), place[0] - north, place[1] - east)
    towards = np.arctan2(float(across), LOOKAHEAD * pace.speed)
    most = _FASTEST * pace.speed
    wanted = float(np.clip(speed - float(along) / _CATCH_UP, -most, most))
    way = float(np.clip(wanted / (_SLOW * pace.speed), -1.0, 1.0))
    return Steering(wanted, course - way * towards, rise, turn, turn_rise, way)


def _kept_place(away: Array, heading: float, pace: Pace) -> Steering:
    """Towards a place, bow or stern first, whichever is nearer; at the place, with the bow where it is."""
    distance = float(np.hypot(*away))
    if distance < _AT_PLACE * pace.speed:
        return Steering(0.0, heading, way=0.0)
    course = float(np.arctan2(away[1], away[0]))
    off = float(wrap_angle(np.array(course - heading)))
    way = 1.0 if abs(off) <= 0.5 * np.pi else -1.0
    speed = min(distance / _CATCH_UP, pace.speed) * abs(np.cos(off))
    return Steering(way * speed, course if way > 0.0 else course + np.pi, way=way)


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

    def ask(self, observer: Observer) -> ControlRequest:
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
        through, _, _ = relative_velocity(self.known.program.vehicle, state[2], tuple(state[3:6]), minutes)
        return ControlRequest(self._ahead_of_lag(force, state), float(through))

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


HORIZON = 20
"""Steps of a plan: 4 s."""
QUICKEST = 0.4
"""Time in which a force may go from rest to full [s]: motor controllers of such boats allow no more, to spare gears."""
_PLACE, _SPEED, _RATE, _CHANGE = 0.1, 0.2, 1.0, 0.3
"""Errors that weigh alike: of place [m], of velocity over ground [m/s], yaw rate [rad/s], and change of force within a
step, as a share of full. A tenth of a metre is what positions are measured to; the others keep plans smooth."""
_ITERATIONS = 40
"""Iterations after which a plan is given up: from the last one shifted, five to ten do."""
_TOLERANCE = 1e-4
"""Of the solver, whose unknowns are metres, seconds and shares of full force: far below what is measured."""
_WILDEST = 4.0
"""Multiple of the pace's speed and yaw rate beyond which no plan goes: a solver that tries larger ones meets drags at
which a step of the model overflows, and does not come back."""
_BARRIER = 1e-2
"""Barrier with which the solver begins: the last plan is near the next one, so it need not keep far from the bounds."""
_STEADY = {"watchdog_shortened_iter_trigger": 0}
"""No leaps of the solver to see whether it gets better: they end far from any motion of a boat."""


@final
class PredictiveControl(Controller):
    """Plans `HORIZON` steps, and asks for the first.

    Multiple shooting over the model's own `step` (Bock and Plitt 1984), solved by fatrop (Vanroye et al. 2023), which
    CasADi brings. Forces and their changes are bounded. A network beside the physics is heard along the last plan: what
    it says there is taken as given, so that the problem stays that of the physics (as Salzmann et al. 2023 do, less
    their derivatives).
    """

    name: ClassVar[str] = "nmpc"

    def __init__(self, known: KnownModel, track: Track) -> None:
        super().__init__(known, track)
        self._full = np.maximum(np.abs(known.inverse.lower), np.abs(known.inverse.upper))
        self._solver, self._rows = _solver(known, self._full)
        self._wildest = _WILDEST * np.array([track.pace.speed, track.pace.speed, track.pace.turn_rate])
        most = np.full((HORIZON + 1, len(known.program.state)), np.inf)
        most[1:, 3:6] = self._wildest  # the first state is what it is
        limits = (-most, known.inverse.lower), (most, known.inverse.upper)
        self._bounds = [_lined(states, np.tile(force / self._full, (HORIZON, 1))) for states, force in limits]
        self._plan: tuple[Array, Array] | None = None

    def ask(self, observer: Observer) -> ControlRequest:
        """See `Controller.ask`."""
        belief, known = observer.belief, self.known
        states, shares = self._shifted(observer)
        added = observer.along(states)
        times = 60.0 * belief.minutes + PERIOD * np.arange(1, HORIZON + 1, dtype=float)
        points = self.track.at(times)
        wanted = np.column_stack([points[:, :2], *body_to_earth(points[:, 2], points[:, 3], np.zeros(HORIZON))])
        given = np.concatenate([belief.state, [belief.minutes], added.ravel(), wanted.ravel()])
        size, count = len(belief.state), known.thrusters
        begin, (least, most) = _lined(states, shares), self._bounds
        found = self._solver(x0=begin, p=given, lbx=least, ubx=most, lbg=-self._rows, ubg=self._rows)
        solved = bool(self._solver.stats()["success"])
        if solved:
            values = numbers(found["x"])
            table = values[: HORIZON * (size + count)].reshape(HORIZON, size + count)
            states, shares = np.vstack([table[:, :size], values[-size:]]), table[:, size:]
        self._plan = states, shares
        return ControlRequest(shares[0] * self._full, solved=solved)

    def _shifted(self, observer: Observer) -> tuple[Array, Array]:
        """States (steps + 1, state) and shares of force (steps, thrusters) of the last plan, a step on."""
        belief, known = observer.belief, self.known
        if self._plan is None:
            shares = belief.state[known.lately] / self._full
            return np.tile(belief.state, (HORIZON + 1, 1)), np.tile(shares, (HORIZON, 1))
        states, shares = self._plan
        after = numbers(known.step(states[-1], shares[-1] * self._full, belief.added, belief.minutes))
        if not (np.isfinite(after).all() and (np.abs(after[3:6]) <= self._wildest).all()):
            after = states[-1]  # no plan may have such a state
        return np.vstack([belief.state, states[2:], after]), np.vstack([shares[1:], shares[-1:]])


def _lined(states: Array, shares: Array) -> Array:
    """The unknowns in the order of the solver: each state with the shares of force after it, and the last state."""
    return np.append(np.column_stack([states[:-1], shares]).ravel(), states[-1])


def _solver(known: KnownModel, full: Array) -> tuple[Any, Array]:
    """The solver of a model, and by how much each constraint may differ from zero."""
    casadi = required("casadi")
    size, count = len(known.program.state), known.thrusters
    begin, minutes = casadi.SX.sym("begin", size), casadi.SX.sym("minutes", 1)
    added, wanted = casadi.SX.sym("added", 3, HORIZON), casadi.SX.sym("wanted", 4, HORIZON)
    states = [casadi.SX.sym(f"x{k}", size) for k in range(HORIZON + 1)]
    shares = [casadi.SX.sym(f"f{k}", count) for k in range(HORIZON)]
    cost, constraints, rows = 0.0, [], list[float]()

    def held(what: Any, most: float) -> None:
        constraints.append(what)
        rows.extend([most] * what.numel())

    for k in range(HORIZON):
        at = minutes + k * PERIOD / 60.0
        held(states[k + 1] - known.step(states[k], shares[k] * full, added[:, k], at), 0.0)  # fatrop wants this sign
        if k == 0:
            held(states[0] - begin, 0.0)
        change = shares[k] - states[k][known.lately] / full
        held(change, PERIOD / QUICKEST)
        cost += casadi.sumsqr(change) / _CHANGE**2 + _strayed(casadi, states[k + 1], wanted[:, k])
    stages = [part for pair in zip(states, shares, strict=False) for part in pair]
    problem = {
        "x": casadi.vertcat(*stages, states[-1]),
        "p": casadi.vertcat(begin, minutes, casadi.vec(added), casadi.vec(wanted)),
        "f": cost,
        "g": casadi.vertcat(*constraints),
    }
    options = {
        "structure_detection": "auto",
        "equality": [most == 0.0 for most in rows],
        "print_time": False,
        "error_on_fail": False,
        "fatrop": {"print_level": 0, "max_iter": _ITERATIONS, "tol": _TOLERANCE, "mu_init": _BARRIER, **_STEADY},
    }
    return casadi.nlpsol("plan", "fatrop", problem, options), np.array(rows)


def _strayed(casadi: Any, state: Any, wanted: Any) -> Any:
    """What a state costs: its distance from the point, its velocity over ground against the point's, and turning."""
    psi, u, v, r = (state[k] for k in range(2, 6))
    north = casadi.cos(psi) * u - casadi.sin(psi) * v
    east = casadi.sin(psi) * u + casadi.cos(psi) * v
    place = casadi.sumsqr(state[:2] - wanted[:2]) / _PLACE**2
    return place + casadi.sumsqr(casadi.vertcat(north, east) - wanted[2:]) / _SPEED**2 + (r / _RATE) ** 2
