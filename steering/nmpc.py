"""Nonlinear model predictive control: the forces of the next seconds that keep the model nearest to the track.

Multiple shooting over the model's own `step` (Bock and Plitt 1984), solved by fatrop (Vanroye et al. 2023), which
CasADi brings. Forces and their changes are bounded. A network beside the physics is heard along the last plan: what it
says there is taken as given, so that the problem stays that of the physics (as Salzmann et al. 2023 do, less their
derivatives).
"""

from typing import Any, ClassVar, final

import numpy as np

from ..exports.formats.to_casadi import casadi_module
from ..physics.frames import Array, body_to_earth
from .base import Asked, Controller
from .known_model import PERIOD, KnownModel, numbers
from .observer import Observer
from .tracks import Track

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
    """Plans `HORIZON` steps, and asks for the first."""

    name: ClassVar[str] = "nmpc"

    def __init__(self, known: KnownModel, track: Track) -> None:
        super().__init__(known, track)
        self._full = np.maximum(np.abs(known.inverse.lower), np.abs(known.inverse.upper))
        self._solver, self._rows = _solver(known, self._full)
        self._wildest = _WILDEST * np.array([track.pace.speed, track.pace.speed, track.pace.turn_rate])
        self._bounds = self._ends()
        self._plan: tuple[Array, Array] | None = None

    def _ends(self) -> tuple[Array, Array]:
        """Least and largest value of every unknown; the first state is what it is."""
        inverse, size = self.known.inverse, len(self.known.program.state)
        most = np.full((HORIZON + 1, size), np.inf)
        most[1:, 3:6] = self._wildest

        def lined(states: Array, shares: Array) -> Array:
            return np.append(np.column_stack([states[:-1], np.tile(shares, (HORIZON, 1))]).ravel(), states[-1])

        return lined(-most, inverse.lower / self._full), lined(most, inverse.upper / self._full)

    def ask(self, observer: Observer) -> Asked:
        """See `Controller.ask`."""
        belief, known = observer.belief, self.known
        states, shares = self._shifted(observer)
        added = observer.along(states)
        times = 60.0 * belief.minutes + PERIOD * np.arange(1, HORIZON + 1, dtype=float)
        points = self.track.at(times)
        wanted = np.column_stack([points[:, :2], *body_to_earth(points[:, 2], points[:, 3], np.zeros(HORIZON))])
        given = np.concatenate([belief.state, [belief.minutes], added.ravel(), wanted.ravel()])
        size, count = len(belief.state), known.thrusters
        stages = np.column_stack([states[:-1], shares]).ravel()
        found = self._solver(
            x0=np.concatenate([stages, states[-1]]),
            p=given,
            lbx=self._bounds[0],
            ubx=self._bounds[1],
            lbg=-self._rows,
            ubg=self._rows,
        )
        solved = bool(self._solver.stats()["success"])
        if solved:
            values = numbers(found["x"])
            table = values[: HORIZON * (size + count)].reshape(HORIZON, size + count)
            states, shares = np.vstack([table[:, :size], values[-size:]]), table[:, size:]
        self._plan = states, shares
        return Asked(shares[0] * self._full, solved=solved)

    def _within(self, state: Array) -> bool:
        """Whether a state is one that a plan may have."""
        return bool(np.isfinite(state).all() and (np.abs(state[3:6]) <= self._wildest).all())

    def _shifted(self, observer: Observer) -> tuple[Array, Array]:
        """States (steps + 1, state) and shares of force (steps, thrusters) of the last plan, a step on."""
        belief, known = observer.belief, self.known
        if self._plan is None:
            return np.tile(belief.state, (HORIZON + 1, 1)), np.tile(
                belief.state[known.lately] / self._full, (HORIZON, 1)
            )
        states, shares = self._plan
        after = numbers(known.step(states[-1], shares[-1] * self._full, belief.added, belief.minutes))
        after = after if self._within(after) else states[-1]
        return np.vstack([belief.state, states[2:], after]), np.vstack([shares[1:], shares[-1:]])


def _solver(known: KnownModel, full: Array) -> tuple[Any, Array]:
    """The solver of a model, and by how much each constraint may differ from zero."""
    casadi = casadi_module()
    size, count = len(known.program.state), known.thrusters
    begin, minutes = casadi.SX.sym("begin", size), casadi.SX.sym("minutes", 1)
    added, wanted = casadi.SX.sym("added", 3, HORIZON), casadi.SX.sym("wanted", 4, HORIZON)
    states = [casadi.SX.sym(f"x{k}", size) for k in range(HORIZON + 1)]
    shares = [casadi.SX.sym(f"f{k}", count) for k in range(HORIZON)]
    cost, constraints, rows, equal = 0.0, [], [], []

    def held(what: Any, most: float) -> None:
        constraints.append(what)
        rows.extend([most] * what.numel())
        equal.extend([most == 0.0] * what.numel())

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
        "equality": equal,
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
