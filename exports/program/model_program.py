"""A vehicle as a program of five functions, made by sending symbols through the force equation itself.

`thrust` makes forces of lasting commands, `rates` the rate of change of the motion, `derivatives` is both, for solvers.
`start` and `step` simulate as `physics.integration.rollout` does: Runge-Kutta steps of one length, lag by first-order
hold, delayed forces between their samples. What lag and delay keep of late commands are states.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from ...physics.errors import RequestError
from ...physics.forces import ForceEquation, relative_velocity, remaining_thrust
from ...physics.integration import runge_kutta
from ...physics.motion import body_to_earth
from ...physics.sampled_series import lag_weights, lags
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle
from .symbols import Function, Group, Symbol, function, is_known, symbolic

_MOST_KEPT = 1000
"""Commands that a state keeps for thrusters with a delay: eight thrusters, 2 s late, in steps of 20 ms."""


class LateCommands(NamedTuple):
    """How a thruster answers.

    Attributes
    ----------
    lags : commands are kept behind their lag, and the last one without it, too
    whole, part : steps by which the force is late
    names : of the commands that are kept, the newest first
    """

    thruster: Thruster
    time_step: float
    lags: bool
    whole: int
    part: float
    names: tuple[str, ...]

    def after(self, before: Sequence[Symbol], command: Symbol) -> list[Symbol]:
        """The commands that are kept after a step that ends with a command."""
        if not self.lags:
            return [command, *before[:-1]]
        a, b0, b1 = lag_weights(self.thruster.lag, self.time_step)
        return [symbolic(a * before[0] + b0 * before[-1] + b1 * command), *before[:-2], command]

    def force(self, kept: Sequence[Symbol]) -> tuple[Symbol, Symbol]:
        """Force and loss of the thruster: between two samples, as `sampled_series.shift` has it."""
        force, load = lasting(self.thruster, kept[self.whole])
        if not self.part:
            return force, load
        earlier = lasting(self.thruster, kept[self.whole + 1])
        between = [symbolic(b + (1.0 - self.part) * (a - b)) for a, b in zip((force, load), earlier, strict=True)]
        return between[0], between[1]


def late_commands(vehicle: Vehicle, time_step: float) -> list[LateCommands]:
    """What is kept for each thruster, in steps of a length [s].

    Raises
    ------
    RequestError
        when a delay is a great many steps.
    """
    result = [_late(thruster, time_step) for thruster in vehicle.thrusters]
    kept = sum(len(one.names) for one in result)
    if kept > _MOST_KEPT:
        raise RequestError(
            f"export: with steps of {time_step:g} s, {kept} commands are on their way in the delays; at most "
            f"{_MOST_KEPT} are written, so take a longer --time-step"
        )
    return result


def _late(thruster: Thruster, time_step: float) -> LateCommands:
    place = thruster.late / time_step
    whole, part = int(place), place - int(place)
    slow = lags(thruster.lag, time_step)
    kept = "lagged" if slow else "command"
    names = tuple(f"{kept}_{thruster.name}_{k}" for k in range(whole + 1 + (part > 0.0)))
    return LateCommands(thruster, time_step, slow, whole, part, (*names, f"asked_{thruster.name}") if slow else names)


def lasting(thruster: Thruster, command: Any) -> tuple[Symbol, Symbol]:
    """See `Thruster.lasting`."""
    force, load = thruster.lasting(command)
    return symbolic(force), symbolic(load)


MOTION = ("north", "east", "psi", "u", "v", "r")
WAKE = ("q_v", "q_r")
_MOTION_TOLD = "north, east [m], psi [rad], u, v [m/s], r [rad/s] over ground"
_AIR = Group("air", "velocity of the air over ground, towards north and east [m/s]", ("air_north", "air_east"))
_MINUTES = Group("minutes", "time since the beginning of the log [min]", ("minutes",), single=True)

ACCELERATIONS = ("u_dot_added", "v_dot_added", "r_dot_added")
_ADDED = Group("added", "acceleration that is held during the step [m/s^2, m/s^2, rad/s^2]", ACCELERATIONS)
Corrected = Literal["no", "beside", "in place"]
_FORCELESS: dict[str, float] = dict.fromkeys(("memory_sway", "memory_yaw", "wind_x", "wind_y", "wind_n"), 0.0)
"""What a model without physics of its own lacks of what a vehicle's state keeps."""


@dataclass(frozen=True, slots=True)
class Program:
    """The functions of a vehicle, in an order in which each calls only earlier ones.

    Attributes
    ----------
    vehicle : whose they are
    time_step : of `step` [s]
    """

    vehicle: Vehicle
    time_step: float
    thrust: Function
    rates: Function
    derivatives: Function
    start: Function
    step: Function

    @property
    def functions(self) -> tuple[Function, ...]:
        """All of them."""
        return self.thrust, self.rates, self.derivatives, self.start, self.step

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the numbers of which `step` makes the next."""
        return self.step.inputs[0].members


class _Outside(NamedTuple):
    """What acts on the hull at one time, as `rates` takes it."""

    force: Sequence[Symbol]
    load: Sequence[Symbol]
    air: Sequence[Symbol]
    minutes: Sequence[Symbol]


def program_of(vehicle: Vehicle, time_step: float, *, corrected: Corrected = "no") -> Program:
    """The program of a vehicle, for steps of a length [s].

    Parameters
    ----------
    corrected : `step` takes an acceleration `added`, which is held in it, beside that of the forces or in its place

    Raises
    ------
    RequestError
        when a delay is a great many steps.
    """
    if corrected == "in place":
        vehicle = vehicle.with_values(_FORCELESS)
    equation = ForceEquation(vehicle)
    thrust, rates = _thrust(vehicle), _coasting() if corrected == "in place" else _rates(equation)
    derivatives = _derivatives(vehicle, thrust, rates)
    late = late_commands(vehicle, time_step)
    start = _start(equation, late)
    return Program(
        vehicle,
        time_step,
        thrust,
        rates,
        derivatives,
        start,
        _step(equation, late, rates, time_step, corrected != "no"),
    )


def _motion(equation: ForceEquation) -> Group:
    wake = ", and the velocities q_v [m/s], q_r [rad/s] that the wake remembers" * equation.has_memory
    return Group("motion", _MOTION_TOLD + wake, MOTION + WAKE * equation.has_memory)


def _command(vehicle: Vehicle, told: str = "") -> Group:
    units = {"pwm": "us", "normalized": "-1 to 1", "rad_s": "rad/s", "newton": "N", "tau": "N or N m"}
    named = ", ".join(f"{t.channel} [{units[t.command]}]" for t in vehicle.thrusters)
    return Group("command", f"{named}{told}", tuple(t.channel for t in vehicle.thrusters))


def _thrust(vehicle: Vehicle) -> Function:
    command = _command(vehicle)
    pairs = [lasting(t, symbol) for t, symbol in zip(vehicle.thrusters, command.symbols, strict=True)]
    names = tuple(t.name for t in vehicle.thrusters)
    force = Group("force", "of each thruster at rest [N]", names)
    load = Group("load", "what it loses per metre a second ahead [N s/m]", names)
    outputs = [(force, [pair[0] for pair in pairs])]
    if any(not is_known(pair[1], 0.0) for pair in pairs):
        outputs.append((load, [pair[1] for pair in pairs]))
    return function("thrust", "Forces of commands that have lasted.", [command], outputs)


def _rates(equation: ForceEquation) -> Function:
    vehicle = equation.vehicle
    names = tuple(t.name for t in vehicle.thrusters)
    motion = _motion(equation)
    force = Group("force", "of each thruster at rest [N]", names)
    load = Group("load", "what it loses per metre a second ahead [N s/m]", names)
    psi, u, v, r = motion.symbols[2:6]
    (minutes,) = _MINUTES.symbols
    memory = motion.symbols[6:8] if equation.has_memory else None
    loads = load.symbols if any(t.advance_loss for t in vehicle.thrusters) else None
    relative: Any = relative_velocity(vehicle, psi, (u, v, r), minutes)  # type: ignore[arg-type]
    balance: Any = equation.force(
        relative,
        psi,  # type: ignore[arg-type]
        np.array(force.symbols, dtype=object),
        None if loads is None else np.array(loads, dtype=object),
        memory,  # type: ignore[arg-type]
        _AIR.symbols,  # type: ignore[arg-type]
        minutes,  # type: ignore[arg-type]
    )
    found = [*body_to_earth(psi, u, v), r, *equation.acceleration(balance, relative, (u, v, r), psi)]  # type: ignore[arg-type]
    if memory is not None:
        time = vehicle.values["memory_time"]
        found += [(relative[1] - memory[0]) / time, (relative[2] - memory[1]) / time]
    labels = dict(zip(motion.symbols, motion.members, strict=True)) | dict(zip(balance, "XYN", strict=True))
    labels |= {np.cos(psi): "cos_psi", np.sin(psi): "sin_psi"}
    if relative[0] is not u:
        labels |= {relative[0]: "u_r", relative[1]: "v_r"}
    rate = Group("rate", "of change of the motion, per second", tuple(f"{name}_dot" for name in motion.members))
    about = "Rate of change of the motion under forces of the thrusters."
    inputs = [motion, force, load, _AIR, _MINUTES]
    return function("rates", about, inputs, [(rate, [symbolic(each) for each in found])], labels)


def _coasting() -> Function:
    motion = Group("motion", _MOTION_TOLD, MOTION)
    psi, u, v, r = motion.symbols[2:]
    rate = Group("rate", "of change of the motion, per second", tuple(f"{name}_dot" for name in MOTION))
    found = [*body_to_earth(psi, u, v), r, *[0.0] * 3]  # type: ignore[arg-type]
    about = "Rate of change of a motion on which no force acts."
    return function("rates", about, [motion], [(rate, [symbolic(each) for each in found])])


def _derivatives(vehicle: Vehicle, thrust: Function, rates: Function) -> Function:
    lagging = [t for t in vehicle.thrusters if t.lag > 0.0]
    motion = rates.inputs[0]
    lagged = "; then the lagged command of each thruster with a lag" * bool(lagging)
    state = Group("state", motion.about + lagged, motion.members + tuple(f"lagged_{t.name}" for t in lagging))
    command = _command(vehicle, "; the delay is the caller's" * any(t.delay for t in vehicle.thrusters))
    (minutes,) = _MINUTES.symbols
    behind = dict(zip([t.name for t in lagging], state.symbols[len(motion.members) :], strict=True))
    acting = [behind.get(t.name, c) for t, c in zip(vehicle.thrusters, command.symbols, strict=True)]
    pushes = [_worn(vehicle, group, minutes) for group in thrust(command=acting)]
    (found,) = rates(
        motion=state.symbols[: len(motion.members)],
        air=_AIR.symbols,
        minutes=[minutes],
        **dict(zip(("force", "load"), pushes, strict=False)),
    )
    following = [
        symbolic((c - behind[t.name]) / t.lag)
        for t, c in zip(vehicle.thrusters, command.symbols, strict=True)
        if t.name in behind
    ]
    rate = Group("rate", "of change of the state, per second", tuple(f"{name}_dot" for name in state.members))
    about = "Rate of change of the state under commands, for a solver of differential equations."
    return function("derivatives", about, [state, command, _AIR, _MINUTES], [(rate, [*found, *following])])


def _worn(vehicle: Vehicle, forces: Any, minutes: Any) -> list[Symbol]:
    """Forces or losses of each thruster, less what battery and wear take."""
    pairs = zip(vehicle.thrusters, forces, strict=True)
    return [symbolic(remaining_thrust(t, minutes) * force if t.thrust_rate else force) for t, force in pairs]


def _state(equation: ForceEquation, late: list[LateCommands], air: bool) -> Group:
    names = [*_motion(equation).members, *(_AIR.members * air), *(name for one in late for name in one.names)]
    slow = ", behind their lag" * any(one.lags for one in late)
    text = f"motion{', air' * air}, and the commands that still act{slow}"
    return Group("state", f"{text}; the number after one says how many steps ago it was", tuple(names))


def _blows(equation: ForceEquation) -> bool:
    return any(equation.vehicle.values[symbol] for symbol in ("wind_x", "wind_y", "wind_n"))


def _start(equation: ForceEquation, late: list[LateCommands]) -> Function:
    vehicle, air = equation.vehicle, _blows(equation)
    motion = Group("motion", _MOTION_TOLD, MOTION)
    command = _command(vehicle, ", which have lasted")
    (minutes,) = _MINUTES.symbols
    found = [*motion.symbols]
    if equation.has_memory:
        found += relative_velocity(vehicle, motion.symbols[2], motion.symbols[3:], minutes)[1:]  # type: ignore[arg-type]
    found += _AIR.symbols * air
    for one, symbol in zip(late, command.symbols, strict=True):
        found += [symbol] * len(one.names)
    about = "The state at the beginning, from a motion and commands that have lasted."
    outputs = [(_state(equation, late, air), [symbolic(each) for each in found])]
    return function("start", about, [motion, command, _AIR, _MINUTES], outputs)


def _step(
    equation: ForceEquation, late: list[LateCommands], rates: Function, time_step: float, corrected: bool
) -> Function:
    vehicle, air = equation.vehicle, _blows(equation)
    state = _state(equation, late, air)
    command = _command(vehicle, ", at the end of the step; linear within it")
    symbols = dict(zip(state.members, state.symbols, strict=True))
    (minutes,) = _MINUTES.symbols
    begins: list[tuple[Symbol, Symbol]] = []
    ends: list[tuple[Symbol, Symbol]] = []
    kept: list[Symbol] = []
    for one, symbol in zip(late, command.symbols, strict=True):
        before = [symbols[name] for name in one.names]
        after = one.after(before, symbol)
        begins.append(one.force(before))
        ends.append(one.force(after))
        kept += after
    winds = [symbols[name] for name in _AIR.members] if air else list(_AIR.symbols)
    begin = _outside(vehicle, begins, winds, minutes)
    end = _outside(vehicle, ends, _AIR.symbols, minutes + time_step / 60.0)
    middle = _Outside(
        _between(begin.force, end.force),
        _between(begin.load, end.load),
        _between(begin.air, end.air),
        [symbolic(minutes + 0.5 * time_step / 60.0)],
    )
    moved = rates.inputs[0].members

    def slope(x: Any, outside: _Outside) -> Any:
        (found,) = rates(motion=list(x), **outside._asdict())
        slopes = np.array(found, dtype=object)
        if corrected:
            slopes[3:6] += np.array(_ADDED.symbols, dtype=object)
        return slopes

    motion = np.array(state.symbols[: len(moved)], dtype=object)
    found = runge_kutta(slope, motion, (begin, middle, end), time_step)
    about = f"The state {time_step!r} s later, by one step of the classical Runge-Kutta method."
    changed = [*found.tolist(), *_AIR.symbols * air, *kept]
    after = Group("after", f"the next {state.about}", state.members)
    return function("step", about, [state, command, _AIR, _MINUTES, _ADDED], [(after, changed)])


def network_inputs(vehicle: Vehicle, time_step: float, heading: bool) -> Function:
    """What a network beside the vehicle sees in a state of its steps, see `residuals.models.network_inputs`."""
    equation, late = ForceEquation(vehicle), late_commands(vehicle, time_step)
    state = _state(equation, late, _blows(equation))
    symbols = dict(zip(state.members, state.symbols, strict=True))
    psi, u, v, r = (symbols[name] for name in MOTION[2:])
    (minutes,) = _MINUTES.symbols
    pairs = [one.force([symbols[name] for name in one.names]) for one in late]
    pushes = _outside(vehicle, pairs, (), minutes).force
    seen = [*relative_velocity(vehicle, psi, (u, v, r)), *pushes]  # type: ignore[arg-type]
    if heading:
        seen += [np.cos(psi), np.sin(psi)]
    names = ("u", "v", "r", *(t.name for t in vehicle.thrusters), *(("cos_psi", "sin_psi") if heading else ()))
    group = Group("seen", "velocity through the water [m/s, m/s, rad/s], thrusts [N], and heading if it sees it", names)
    about = "What the network sees in a state."
    return function("seen", about, [state, _MINUTES], [(group, [symbolic(each) for each in seen])])


def _outside(vehicle: Vehicle, pairs: Sequence[tuple[Symbol, Symbol]], winds: Sequence[Symbol], at: Any) -> _Outside:
    """What acts at one time, from force and loss of each thruster."""
    force, load = (_worn(vehicle, line, at) for line in zip(*pairs, strict=True))
    return _Outside(force, load, winds, [symbolic(at)])


def _between(before: Sequence[Symbol], after: Sequence[Symbol]) -> list[Symbol]:
    return [symbolic(0.5 * (a + b)) for a, b in zip(before, after, strict=True)]
