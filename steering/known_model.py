"""What a controller knows of the boat: a model whose thrusters are commanded in newtons, as CasADi functions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..exports.formats.to_casadi import casadi_function, casadi_module
from ..exports.program.functions import Function
from ..exports.program.model_program import Program, network_inputs, program_of
from ..physics.errors import RequestError
from ..physics.forces import at_beginning, calm, held_acceleration
from ..physics.frames import Array
from ..physics.thrusters import neutral_command
from ..physics.vehicle import Vehicle
from ..residuals.models.base import Model, VehicleModel
from .thrust_inverse import ThrustInverse, in_newtons, thrust_inverse
from .tracks import pace_of

if TYPE_CHECKING:
    from ..residuals.models.network_walk import NetworkWalk

PERIOD = 0.2
"""Time from one command to the next [s]: autopilots of small boats steer at 5 to 50 Hz. At 5 Hz a plan of 20 steps
sees 4 s ahead, twice the time in which such a hull gathers way."""
_SAME_STEP = 0.01
"""Share by which the rows of a network may miss a part of the period: as much as its own rollouts take."""
_WILD, _TRIED = 2.0, 1e-4
"""Multiple of the pace at which the hull's quickness is judged, and the change of velocity by which [m/s, rad/s]."""
_STABLE, _MOST_PARTS = 1.5, 8
"""Quickness times step that a step may have (classical Runge-Kutta is stable up to 2.8), and the most parts of a
period: beyond, a boat that stops within a hundredth of a second is no hull."""
_BREEZE = 1e-3
"""Wind of a model that feels it [m/s]: none to speak of, but where boat and air both rest, the derivative of the speed
between them does not exist, and a solver that is given no number for it does not end."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownModel:
    """A model as a controller uses it. The state is that of `exports.program`'s `step`: motion, wake, forces under way.

    Attributes
    ----------
    name : of the model
    program : of the vehicle in newtons, for steps of a part of a `PERIOD`
    inverse : from newtons to the commands of the model's own thrusters
    start : (motion (6,), force) -> state
    step : (state, force, added, minutes) -> state after `PERIOD`; `added` is an acceleration beside the model's own
    pulled : (state, minutes) -> acceleration (3,) without thrust, over ground
    pushed : (state, minutes) -> acceleration (3, thrusters) by a newton of each
    seen : (state, minutes) -> what a network beside it sees; None where there is none
    rows : rows of the network in a `PERIOD`
    walk : makes a network's walk; None where there is none
    """

    name: str
    program: Program
    inverse: ThrustInverse
    start: Any
    step: Any
    pulled: Any
    pushed: Any
    seen: Any = None
    rows: int = 1
    walk: "Callable[[], NetworkWalk] | None" = None

    @property
    def thrusters(self) -> int:
        """Their number."""
        return len(self.program.vehicle.thrusters)

    @property
    def lately(self) -> list[int]:
        """Places in the state of the force that each thruster was asked for last."""
        return _lately(self.program)

    @property
    def acting(self) -> list[int]:
        """Places in the state of the newest force of each thruster, behind its lag."""
        names = self.program.state
        return [
            names.index(f"lagged_{t.name}_0" if f"lagged_{t.name}_0" in names else f"command_{t.name}_0")
            for t in self.program.vehicle.thrusters
        ]


def known_model(model: Model) -> KnownModel:
    """A model as controllers use it.

    Raises
    ------
    RequestError
        when CasADi is missing, or the model is neither a formula nor a network beside one.
    """
    if not isinstance(model, VehicleModel) and model.kind != "hybrid":
        raise RequestError(
            f"control: expected a vehicle file, a run folder or a network beside physics, got {model.name} "
            f"({model.kind}); a controller needs a formula to plan with"
        )
    casadi, own = casadi_module(), in_newtons(model.vehicle)
    parts = _parts(model.vehicle)
    program = program_of(own, PERIOD / parts, corrected="beside")
    count = len(own.thrusters)
    symbols = {
        "state": casadi.SX.sym("state", len(program.state)),
        "command": casadi.SX.sym("force", count),
        "added": casadi.SX.sym("added", 3),
        "minutes": casadi.SX.sym("minutes", 1),
    }
    state, force, added, minutes = symbols.values()

    def asked(function: Function, **more: Any) -> Any:
        given = symbols | {"air": casadi.SX([_BREEZE] * 2), "load": casadi.SX.zeros(count)} | more
        return casadi_function(function)(*(given[group.name] for group in function.inputs))

    def made(name: str, takes: Sequence[Any], gives: Any) -> Any:
        return casadi.Function(name, takes, [gives])

    # No load: what a thruster loses under way is made up for by the inverse of its curve.
    motion = state[: len(program.rates.inputs[0].members)]
    pulled, push = (asked(program.rates, motion=motion, force=given)[3:6] for given in (casadi.SX.zeros(count), force))
    walk, rows, seen = _walk_of(model)
    looks = None if seen is None else made("seen", [state, minutes], asked(network_inputs(own, PERIOD / parts, seen)))
    after, last = state, state[_lately(program)]
    for k in range(parts):
        between = {"state": after, "command": last + (k + 1) / parts * (force - last)}
        after = asked(program.step, **between, minutes=minutes + k * PERIOD / parts / 60.0)
    return KnownModel(
        model.name,
        program,
        thrust_inverse(model.vehicle),
        made("start", [state[:6], force], asked(program.start, motion=state[:6])),
        made("step", [state, force, added, minutes], after),
        made("pulled", [state, minutes], pulled),
        made("pushed", [state, minutes], casadi.jacobian(push, force)),
        looks,
        rows,
        walk,
    )


def _lately(program: Program) -> list[int]:
    names = program.state
    return [
        names.index(f"asked_{t.name}" if f"asked_{t.name}" in names else f"command_{t.name}_0")
        for t in program.vehicle.thrusters
    ]


def _parts(vehicle: Vehicle) -> int:
    """Steps into which a period is cut, so that the fastest motion of the hull that a plan may try stays stable."""
    pace, tried = pace_of(vehicle), np.vstack([np.zeros(3), _TRIED * np.eye(3)])
    velocity = _WILD * np.array([pace.speed, 0.5 * pace.speed, pace.turn_rate]) + tried
    idle = np.tile([neutral_command(t) for t in vehicle.thrusters], (len(velocity), 1))
    slowed = held_acceleration(calm(at_beginning(vehicle)), velocity, np.zeros(len(velocity)), idle)
    fastest = np.abs(np.linalg.eigvals((slowed[1:] - slowed[0]).T / _TRIED)).max()
    return int(np.clip(np.ceil(PERIOD * fastest / _STABLE), 1, _MOST_PARTS))


def _walk_of(model: Model) -> "tuple[Callable[[], NetworkWalk] | None, int, bool | None]":
    """What makes the walk of a network, its rows in a `PERIOD`, and whether it sees the heading; none of a vehicle."""
    if isinstance(model, VehicleModel):
        return None, 1, None
    from ..residuals.models.network_model import NetworkModel  # with torch, which made it
    from ..residuals.models.network_walk import NetworkWalk

    if not isinstance(model, NetworkModel):
        raise RequestError(f"control: expected a network that undertow trained, got {model.name}")
    rows = round(PERIOD / model.time_step)
    if rows < 1 or abs(rows * model.time_step / PERIOD - 1.0) > _SAME_STEP:
        raise RequestError(
            f"control: expected a network whose rows are {PERIOD:g} s or a whole part of it apart, got "
            f"{model.time_step:g} s; train one on rows of 0.1 s"
        )
    return lambda: NetworkWalk(model), rows, model.heading


def numbers(found: Any) -> Array:
    """What a CasADi function gives, as an array without the axis that CasADi adds to a vector."""
    array = np.asarray(found, dtype=float)
    return array[:, 0] if array.ndim == 2 and array.shape[1] == 1 else array
