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
from .symbols import Function, Group, function, is_known, symbolic

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

    def after(self, before: Sequence[Any], command: Any) -> list[Any]:
        """The commands that are kept after a step that ends with a command."""
        if not self.lags:
            return [command, *before[:-1]]
        a, b0, b1 = lag_weights(self.thruster.lag, self.time_step)
        return [a * before[0] + b0 * before[-1] + b1 * command, *before[:-2], command]

    def force(self, kept: Sequence[Any]) -> tuple[Any, Any]:
        """Force and loss of the thruster: between two samples, as `sampled_series.shift` has it."""
        force, load = map(symbolic, self.thruster.lasting(kept[self.whole]))
        if not self.part:
            return force, load
        before, lost = map(symbolic, self.thruster.lasting(kept[self.whole + 1]))
        share = 1.0 - self.part
        return before + share * (force - before), lost + share * (load - lost)


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


MOTION = ("north", "east", "psi", "u", "v", "r")
WAKE = ("q_v", "q_r")
_MOTION_TOLD = "north, east [m], psi [rad], u, v [m/s], r [rad/s] over ground"
_AIR = Group("air", "velocity of the air over ground, towards north and east [m/s]", ("air_north", "air_east"))
_MINUTES = Group("minutes", "time since the beginning of the log [min]", ("minutes",), single=True)
(_NOW,) = _MINUTES.symbols

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
    made = _Functions(vehicle.with_values(_FORCELESS) if corrected == "in place" else vehicle, time_step)
    thrust, rates = made.thrust(), made.rates(coasting=corrected == "in place")
    derivatives = made.derivatives(thrust, rates)
    return Program(
        made.vehicle, time_step, thrust, rates, derivatives, made.start(), made.step(rates, corrected != "no")
    )


def network_inputs(vehicle: Vehicle, time_step: float, heading: bool) -> Function:
    """What a network beside the vehicle sees in a state of its steps, see `residuals.models.network_inputs`."""
    return _Functions(vehicle, time_step).seen(heading)


class _Functions:
    """The functions of a vehicle, and the groups of numbers that they take and give."""

    def __init__(self, vehicle: Vehicle, time_step: float) -> None:
        self.vehicle, self._step = vehicle, time_step
        self._equation, self._late = ForceEquation(vehicle), late_commands(vehicle, time_step)
        memory, names = self._equation.has_memory, tuple(t.name for t in vehicle.thrusters)
        wake = ", and the velocities q_v [m/s], q_r [rad/s] that the wake remembers" * memory
        self._motion = Group("motion", _MOTION_TOLD + wake, MOTION + WAKE * memory)
        self._force = Group("force", "of each thruster at rest [N]", names)
        self._load = Group("load", "what it loses per metre a second ahead [N s/m]", names)
        self._blows = any(vehicle.values[symbol] for symbol in ("wind_x", "wind_y", "wind_n"))
        slow = ", behind their lag" * any(one.lags for one in self._late)
        text = f"motion{', air' * self._blows}, and the commands that still act{slow}"
        kept = (name for one in self._late for name in one.names)
        self._state = Group(
            "state",
            f"{text}; the number after one says how many steps ago it was",
            (*self._motion.members, *(_AIR.members * self._blows), *kept),
        )
        self._known = dict(zip(self._state.members, self._state.symbols, strict=True))

    def _command(self, told: str = "") -> Group:
        units = {"pwm": "us", "normalized": "-1 to 1", "rad_s": "rad/s", "newton": "N", "tau": "N or N m"}
        thrusters = self.vehicle.thrusters
        named = ", ".join(f"{t.channel} [{units[t.command]}]" for t in thrusters)
        return Group("command", f"{named}{told}", tuple(t.channel for t in thrusters))

    def _relative(self, motion: Sequence[Any], minutes: Any = 0.0) -> Any:
        psi, u, v, r = motion[2:6]
        return relative_velocity(self.vehicle, psi, (u, v, r), minutes)

    def _worn(self, forces: Any, minutes: Any) -> list[Any]:
        """Forces or losses of each thruster, less what battery and wear take."""
        pairs = zip(self.vehicle.thrusters, forces, strict=True)
        return [remaining_thrust(t, minutes) * force if t.thrust_rate else force for t, force in pairs]

    def _outside(self, kept: Sequence[Sequence[Any]], winds: Sequence[Any], at: Any) -> dict[str, Sequence[Any]]:
        """What acts on the hull at one time, as `rates` takes it, from the commands that are kept."""
        pairs = [one.force(commands) for one, commands in zip(self._late, kept, strict=True)]
        force, load = (self._worn(line, at) for line in zip(*pairs, strict=True))
        return {"force": force, "load": load, "air": winds, "minutes": [at]}

    def _kept(self) -> list[list[Any]]:
        """The commands of each thruster that a state keeps."""
        return [[self._known[name] for name in one.names] for one in self._late]

    def thrust(self) -> Function:
        """Forces of commands that have lasted."""
        command = self._command()
        pairs = [t.lasting(x) for t, x in zip(self.vehicle.thrusters, command.symbols, strict=True)]
        force, load = zip(*pairs, strict=True)
        loses = any(not is_known(symbolic(each), 0.0) for each in load)
        outputs = [(self._force, force), *([(self._load, load)] if loses else [])]
        return function("thrust", "Forces of commands that have lasted.", [command], outputs)

    def rates(self, coasting: bool) -> Function:
        """Rate of change of the motion, under forces or under none."""
        vehicle, equation, motion = self.vehicle, self._equation, self._motion
        psi, u, v, r, *memory = motion.symbols[2:]
        loses = any(t.advance_loss for t in vehicle.thrusters)
        force, load = (np.array(group.symbols, dtype=object) for group in (self._force, self._load))
        air, relative = _AIR.symbols, self._relative(motion.symbols, _NOW)
        balance: Any = equation.force(relative, psi, force, load if loses else None, memory or None, air, _NOW)  # type: ignore[arg-type]
        found = [*body_to_earth(psi, u, v), r]
        found += [0.0] * 3 if coasting else equation.acceleration(balance, relative, (u, v, r), psi)
        found += [(now - q) / vehicle.values["memory_time"] for now, q in zip(relative[1:], memory, strict=False)]
        labels = dict(zip((*motion.symbols, *balance), (*motion.members, *"XYN"), strict=True))
        labels |= {np.cos(psi): "cos_psi", np.sin(psi): "sin_psi"}
        if relative[0] is not u:
            labels |= {relative[0]: "u_r", relative[1]: "v_r"}
        rate = Group("rate", "of change of the motion, per second", tuple(f"{name}_dot" for name in motion.members))
        acts = "a motion on which no force acts" if coasting else "the motion under forces of the thrusters"
        inputs = [motion, self._force, self._load, _AIR, _MINUTES]
        return function("rates", f"Rate of change of {acts}.", inputs, [(rate, found)], labels)

    def derivatives(self, thrust: Function, rates: Function) -> Function:
        """Rate of change of the state under commands; the delay is the caller's."""
        thrusters, size = self.vehicle.thrusters, len(self._motion.members)
        lagging = [t for t in thrusters if t.lag > 0.0]
        about = self._motion.about + "; then the lagged command of each thruster with a lag" * bool(lagging)
        state = Group("state", about, self._motion.members + tuple(f"lagged_{t.name}" for t in lagging))
        command = self._command("; the delay is the caller's" * any(t.delay for t in thrusters))
        asked = dict(zip([t.name for t in thrusters], command.symbols, strict=True))
        lagged = dict(zip([t.name for t in lagging], state.symbols[size:], strict=True))
        pushes = [self._worn(group, _NOW) for group in thrust(command=[*(asked | lagged).values()])]
        acting = dict(zip(("force", "load"), pushes, strict=False))
        (found,) = rates(motion=state.symbols[:size], air=_AIR.symbols, minutes=[_NOW], **acting)
        following = [(asked[t.name] - lagged[t.name]) / t.lag for t in lagging]
        rate = Group("rate", "of change of the state, per second", tuple(f"{name}_dot" for name in state.members))
        text = "Rate of change of the state under commands, for a solver of differential equations."
        return function("derivatives", text, [state, command, _AIR, _MINUTES], [(rate, [*found, *following])])

    def start(self) -> Function:
        """The state at the beginning."""
        motion, command = Group("motion", _MOTION_TOLD, MOTION), self._command(", which have lasted")
        wake = self._relative(motion.symbols, _NOW)[1:] if self._equation.has_memory else ()
        found = [*motion.symbols, *wake, *(_AIR.symbols * self._blows)]
        for one, symbol in zip(self._late, command.symbols, strict=True):
            found += [symbol] * len(one.names)
        about = "The state at the beginning, from a motion and commands that have lasted."
        return function("start", about, [motion, command, _AIR, _MINUTES], [(self._state, found)])

    def step(self, rates: Function, corrected: bool) -> Function:
        """The state a step later."""
        command = self._command(", at the end of the step; linear within it")
        kept = self._kept()
        after = [one.after(*each) for one, *each in zip(self._late, kept, command.symbols, strict=True)]
        winds = [self._known[name] for name in _AIR.members] if self._blows else _AIR.symbols
        begin = self._outside(kept, winds, _NOW)
        end = self._outside(after, _AIR.symbols, _NOW + self._step / 60.0)
        middle: dict[str, Sequence[Any]]
        middle = {name: [0.5 * (a + b) for a, b in zip(begin[name], end[name], strict=True)] for name in begin}
        middle["minutes"] = [_NOW + 0.5 * self._step / 60.0]

        def slope(x: Any, outside: dict[str, Sequence[Any]]) -> Any:
            (found,) = rates(motion=list(x), **outside)
            slopes = np.array(found, dtype=object)
            if corrected:
                slopes[3:6] += np.array(_ADDED.symbols, dtype=object)
            return slopes

        motion = np.array(self._state.symbols[: len(self._motion.members)], dtype=object)
        moved = runge_kutta(slope, motion, (begin, middle, end), self._step)
        about = f"The state {self._step!r} s later, by one step of the classical Runge-Kutta method."
        changed = [*moved.tolist(), *(_AIR.symbols * self._blows), *(each for one in after for each in one)]
        outputs = [(Group("after", f"the next {self._state.about}", self._state.members), changed)]
        return function("step", about, [self._state, command, _AIR, _MINUTES, _ADDED], outputs)

    def seen(self, heading: bool) -> Function:
        """What a network sees in a state."""
        psi = self._known["psi"]
        turned = {"cos_psi": np.cos(psi), "sin_psi": np.sin(psi)} if heading else {}
        pushes = self._outside(self._kept(), (), _NOW)["force"]
        about = "velocity through the water [m/s, m/s, rad/s], thrusts [N], and heading if it sees it"
        group = Group("seen", about, ("u", "v", "r", *self._force.members, *turned))
        seen = [*self._relative(self._state.symbols), *pushes, *turned.values()]
        return function("seen", "What the network sees in a state.", [self._state, _MINUTES], [(group, seen)])
