"""The model of a controller: CasADi functions in newtons, inverse thrust curves, an observer of the missing push."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, final

import numpy as np

from ..exports.formats.base import required
from ..exports.formats.to_casadi import casadi_function
from ..exports.program.model_program import Program, network_inputs, program_of
from ..exports.program.symbols import Function
from ..physics.errors import RequestError
from ..physics.forces import at_beginning, calm, held_acceleration, held_thrust, remaining_thrust
from ..physics.motion import Array, wrap_angle
from ..physics.thrusters import TableCurve, Thruster, command_of, neutral_command
from ..physics.vehicle import Vehicle
from ..residuals.models.base import Model, VehicleModel
from .tracks import pace_of

if TYPE_CHECKING:
    from ..residuals.models.network_model import NetworkWalk


_POINTS = 801
"""Commands at which a curve is looked up: 400 a side, so that neighbours are less than the noise of a motor apart."""
_WIDE = 10.0
"""Multiple of the most force up to which a force of `in_newtons` goes in a straight line: bounds end it, not a bend."""


@dataclass(frozen=True, slots=True, eq=False)
class ThrustInverse:
    """The inverse of each thruster's curve, dead zone, scales and loss under way.

    Attributes
    ----------
    vehicle : whose curves they are
    commands : (thrusters, n) from one end of each curve to the other, in the thrusters' own units
    forces, losses : (thrusters, n) force at rest [N] and loss per advance speed [N s/m] of these commands
    lower, upper : (thrusters,) forces at rest that its commands reach [N]
    """

    vehicle: Vehicle
    commands: Array
    forces: Array
    losses: Array

    @property
    def lower(self) -> Array:
        """Least force of each thruster at rest [N]."""
        return self.forces.min(axis=1)

    @property
    def upper(self) -> Array:
        """Largest force of each thruster at rest [N]."""
        return self.forces.max(axis=1)

    def command(self, force: Array, minutes: float = 0.0, advance: float = 0.0) -> Array:
        """Commands (thrusters,) in the thrusters' own units that give forces (thrusters,) [N].

        Parameters
        ----------
        minutes : since the beginning, for a thrust that wears
        advance : surge speed through the water [m/s], where forces are those under way; 0 for forces at rest
        """
        found = []
        for k, thruster in enumerate(self.vehicle.thrusters):
            made = remaining_thrust(thruster, np.array(minutes)) * (self.forces[k] - advance * self.losses[k])
            way = 1 if made[-1] >= made[0] else -1
            found.append(_looked_up(float(force[k]), np.maximum.accumulate(made[::way]), self.commands[k, ::way]))
        return np.array(found)

    def at_rest(self, command: Array, minutes: float = 0.0) -> Array:
        """Forces at rest (thrusters,) that commands (thrusters,) give [N]."""
        force, _ = held_thrust(self.vehicle, command[None])
        return force[:, 0] * [float(remaining_thrust(t, np.array(minutes))) for t in self.vehicle.thrusters]

    def share(self, command: Array) -> Array:
        """Commands (n, thrusters) as shares of full command."""
        pairs = enumerate(self.vehicle.thrusters)
        return np.column_stack([t.curve.normalised(command[:, k], t.command) for k, t in pairs])


def _looked_up(force: float, rising: Array, order: Array) -> float:
    """The command of a force; on a flat stretch, its middle, so that no thrust is asked for by a thruster at rest."""
    low, high = np.searchsorted(rising, force - 1e-9), np.searchsorted(rising, force + 1e-9, side="right")
    if high > low:
        return float(0.5 * (order[low] + order[high - 1]))
    return float(np.interp(force, rising, order))


def thrust_inverse(vehicle: Vehicle) -> ThrustInverse:
    """The inverse of a vehicle's thrusters."""
    commands = np.array([command_of(t, np.linspace(-1.0, 1.0, _POINTS)) for t in vehicle.thrusters])
    return ThrustInverse(vehicle, commands, *held_thrust(vehicle, commands.T))


def in_newtons(vehicle: Vehicle) -> Vehicle:
    """The vehicle with thrusters that are commanded in newtons at rest: places, lag, delay and loss under way stay.

    A controller that plans in newtons has a smooth problem whatever the curves are: a dead zone, of which a derivative
    says nothing, is the inverse's. The lag then acts on the force in place of the command, and the loss goes with the
    force, not the command; on straight curves both are the same.
    """
    inverse = thrust_inverse(vehicle)
    ends = np.maximum(np.abs(inverse.lower), np.abs(inverse.upper))
    thrusters = tuple(_straight(t, float(end)) for t, end in zip(vehicle.thrusters, ends, strict=True))
    return vehicle.model_copy(update={"thrusters": thrusters}).with_values({})


def _straight(thruster: Thruster, most: float) -> Thruster:
    wide = _WIDE * max(most, 1e-9)
    kept = thruster.model_dump(include={"name", "x", "y", "angle", "lag", "delay", "arm_scale"})
    curve = TableCurve(kind="table", command=(-wide, wide), force=(-wide, wide))
    command = "tau" if thruster.command == "tau" else "newton"
    return Thruster(**kept, command=command, curve=curve, advance_loss=_WIDE * thruster.advance_loss)


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
        return _places(self.program, "asked_{}")

    @property
    def acting(self) -> list[int]:
        """Places in the state of the newest force of each thruster, behind its lag."""
        return _places(self.program, "lagged_{}_0")


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
    casadi, own = required("casadi"), in_newtons(model.vehicle)
    parts = _parts(model.vehicle)
    program = program_of(own, PERIOD / parts, corrected="beside")
    count = len(own.thrusters)
    sizes = {"state": len(program.state), "command": count, "added": 3, "minutes": 1}
    symbols = {name: casadi.SX.sym(name, size) for name, size in sizes.items()}
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
    after, last = state, state[_places(program, "asked_{}")]
    for k in range(parts):
        between = {"state": after, "command": last + (k + 1) / parts * (force - last)}
        after = asked(program.step, **between, minutes=minutes + k * PERIOD / parts / 60.0)
    return KnownModel(
        model.name,
        program,
        thrust_inverse(model.vehicle),
        made("start", [state[:6], force], asked(program.start, motion=state[:6], minutes=casadi.SX(1, 1))),
        made("step", [state, force, added, minutes], after),
        made("pulled", [state, minutes], pulled),
        made("pushed", [state, minutes], casadi.jacobian(push, force)),
        looks,
        rows,
        walk,
    )


def _places(program: Program, form: str) -> list[int]:
    """Places in the state of what each thruster has under a name of this form, or else of its newest command."""
    pairs = [(form.format(t.name), f"command_{t.name}_0") for t in program.vehicle.thrusters]
    return [program.state.index(name if name in program.state else other) for name, other in pairs]


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
    from ..residuals.models.network_model import NetworkModel, NetworkWalk

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
