"""A boat of another simulator: its own equations, its thrusters with their faults, what else acts on it, and its runs.

A simulator gives its equations as a function of the loads (X, Y, N) of everything outside it, as MCSimPython and
PythonVehicleSimulator do, in plain floats. Thrusters, faults and other causes are added here, once for all of them. A
run keeps its states and commands, so that a boat without one of its causes is simulated from the same starts.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, exp, sin
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from undertow.physics.vehicle import Vehicle

Array = NDArray[np.float64]
State = list[float]
Numbers = Mapping[str, float]
Loads = tuple[float, float, float]
"""Forces ahead and to starboard [N] and moment to starboard [N m]."""
Planar = tuple[float, float, float, float, float, float]
"""North, east [m], heading [rad], and u, v, r relative to the water [m/s, m/s, rad/s]."""
Water = Callable[[float, float, float], tuple[float, float]]
"""Velocity of the water north and east [m/s] at a time [s] and a place [m]."""
Equations = Callable[[State, Loads, tuple[float, float]], State]
"""Derivative of a simulator's state under loads, where the water moves so fast north and east [m/s]."""
Law = Callable[[float], float]
"""Force of a thruster [N] at a command in its unit."""
Pilot = Callable[[float, Sequence[float]], list[float]]
"""Commands in the units of the thrusters, from the time [s] and north, east, heading, u, v, r as they are measured."""


class Force(Protocol):
    """A load beside the thrusters', with a memory of its own or without."""

    def __call__(self, t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        """Loads at a time [s], where the thrusters push so hard [N]."""
        ...

    def advance(self, t: float, step: float, at: Planar) -> None:
        """Take its own memory one step [s] on."""
        ...


@dataclass(frozen=True, slots=True)
class Simple:
    """A force without a memory."""

    load: Callable[[float, Planar, Sequence[float]], Loads]

    def __call__(self, t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        return self.load(t, at, pushes)

    def advance(self, t: float, step: float, at: Planar) -> None:
        """Remember nothing."""


@dataclass(frozen=True, slots=True)
class Craft:
    """One boat of a simulator with nothing hidden, and the file that says what it is.

    Attributes
    ----------
    simulator : its name
    file : the vehicle file, by linear algebra from the simulator's own numbers
    numbers : the simulator's masses and arms, in the symbols of the file where both know them
    equations : its equations of motion for such numbers
    laws, ends : force law of each thruster, and its commands at full astern and full ahead
    lag : time constant of its propellers that the file holds as well [s]
    step, stages : of the integration [s]; stages 4 is Runge and Kutta's classical method, 2 the midpoint rule
    pace : how much longer manoeuvres last than those of a small boat
    length : of the hull [m]
    places : where x, y, psi, u, v, r stand in the state
    rest : the state in which it lies still at the origin, heading north
    exact : effects of the catalogue that changing this simulator makes, and nothing else
    own : effects that the simulator has and the file has not, with their symbols and values
    """

    simulator: str
    file: Vehicle
    numbers: Numbers
    equations: Callable[[Numbers], Equations]
    laws: tuple[Law, ...]
    ends: tuple[tuple[float, float], ...]
    step: float
    pace: float
    length: float
    exact: frozenset[str]
    lag: float = 0.0
    stages: int = 4
    places: tuple[int, int, int, int, int, int] = (0, 1, 2, 3, 4, 5)
    rest: tuple[float, ...] = (0.0,) * 6
    own: Mapping[str, tuple[str, float]] = field(default_factory=dict)

    @property
    def full(self) -> tuple[float, ...]:
        """Force of each thruster at full command ahead [N]."""
        return tuple(abs(law(ahead)) for law, (_, ahead) in zip(self.laws, self.ends, strict=True))

    @property
    def levers(self) -> list[Loads]:
        """Loads of each thruster for one newton."""
        return [(cos(t.angle), sin(t.angle), t.x * sin(t.angle) - t.y * cos(t.angle)) for t in self.file.thrusters]

    def command(self, shares: Sequence[float]) -> list[float]:
        """Commands in the units of the thrusters, of shares of full command from -1 to 1."""
        pairs = zip(shares, self.ends, strict=True)
        return [share * ahead if share > 0.0 else -share * astern for share, (astern, ahead) in pairs]


@dataclass(frozen=True, slots=True)
class Course:
    """A run: states (n + 1, size) and planar states (n + 1, 6) on an even grid, and commands (n, thrusters)."""

    step: float
    states: Array
    planar: Array
    commands: Array

    @property
    def time(self) -> Array:
        """Instants of the states [s]."""
        return self.step * np.arange(len(self.states), dtype=float)


@dataclass
class Plant:
    """A craft and all that is hidden in it.

    `derivatives` are added hydrodynamic derivatives of SNAME by symbol; `trim`, `wind` and `water` are constant loads
    on the body, a force fixed to the earth and the velocity of the water; `thrusts` change the forces of the thrusters
    from the time, the planar state and the forces; `commands` make what changes the commands of a step in order;
    `forces` make what acts beside; `later` holds a time [s] and the numbers from then on. Faults of the thrusters have
    the names of the catalogue.
    """

    craft: Craft
    numbers: dict[str, float] = field(default_factory=dict)
    derivatives: dict[str, float] = field(default_factory=dict)
    trim: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    wind: tuple[float, float] = (0.0, 0.0)
    water: Water | None = None
    scales: list[float] = field(default_factory=list)
    arm_scale: float = 1.0
    thrust_rate: float = 0.0
    reverse_scale: float = 1.0
    thrust_exponent: float = 1.0
    dead_zone: float = 0.0
    lag: float = 0.0
    delay: float = 0.0
    advance_loss: float = 0.0
    thrusts: list[Callable[[float, Planar, list[float]], list[float]]] = field(default_factory=list)
    commands: list[Callable[[], Callable[[list[float]], list[float]]]] = field(default_factory=list)
    forces: list[Callable[[], Force]] = field(default_factory=list)
    later: tuple[float, dict[str, float]] | None = None

    def __post_init__(self) -> None:
        self.numbers = self.numbers or dict(self.craft.numbers)
        self.scales = self.scales or [1.0] * len(self.craft.laws)
        self.lag = self.lag or self.craft.lag

    def run(self, pilot: Pilot, seconds: float, beat: float, heading: float) -> Course:
        """Drive the boat from rest; the pilot is asked once in a beat [s].

        Raises
        ------
        ArithmeticError
            where the motion runs away.
        """
        h, act, where = self.craft.step, _Actuators(self), self.craft.places
        every, steps = round(beat / h), round(seconds / h)
        state = list(self.craft.rest)
        state[where[2]] = heading
        motion = _Motion(self)
        states, given, command = [state], [], [0.0] * len(self.craft.laws)
        for k in range(steps):
            if k % every == 0:
                command = pilot(k * h, [state[i] for i in where])
            given.append(command)
            state = motion.stepped(k * h, state, act.pushes(k * h, command), act.shares)
            states.append(state)
        found = np.array(states)
        if not np.all(np.isfinite(found)):
            raise ArithmeticError("the boat runs away")
        return Course(h, found, found[:, list(where)], np.array(given))

    def replayed(self, course: Course, rows: Sequence[int], steps: int) -> Array:
        """Planar states (rows, steps + 1, 6) from states of another plant's run, under the same commands."""
        act, h, where = _Actuators(self), self.craft.step, list(self.craft.places)
        pushed = []
        for k, command in enumerate(course.commands.tolist()):
            pushed.append((act.pushes(k * h, command), act.shares))
        found = []
        for row in rows:
            motion, state = _Motion(self), course.states[row].tolist()
            states = [state]
            for k in range(row, row + steps):
                state = motion.stepped(k * h, state, *pushed[k])
                states.append(state)
            found.append(np.array(states)[:, where])
        return np.array(found)


class _Actuators:
    """From commands to forces, step by step: delay, lag, the thruster's law, and its faults in their order."""

    def __init__(self, plant: Plant) -> None:
        craft = plant.craft
        self._plant, self._laws, self._full = plant, craft.laws, craft.full
        self._astern = [abs(law(low)) for law, (low, _) in zip(craft.laws, craft.ends, strict=True)]
        self._reach = [max(abs(low), abs(high)) for low, high in craft.ends]
        self._changes = [make() for make in plant.commands]
        self._queue: list[list[float]] = [[0.0] * len(craft.laws) for _ in range(round(plant.delay / craft.step))]
        self._held = [0.0] * len(craft.laws)
        whole, half = (
            (0.0, 0.0) if plant.lag <= 0.0 else (exp(-craft.step / plant.lag), exp(-0.5 * craft.step / plant.lag))
        )
        self._whole, self._half = whole, half
        self.shares: list[float] = [0.0] * len(craft.laws)

    def pushes(self, t: float, command: list[float]) -> list[float]:
        """Forces [N] in the middle of the step that begins now, at no speed."""
        for change in self._changes:
            command = change(command)
        if self._queue:
            self._queue.append(command)
            command = self._queue.pop(0)
        middle = [c + (held - c) * self._half for c, held in zip(command, self._held, strict=True)]
        self._held = [c + (held - c) * self._whole for c, held in zip(command, self._held, strict=True)]
        self.shares = [abs(c) / reach for c, reach in zip(middle, self._reach, strict=True)]
        worn = 1.0 + self._plant.thrust_rate * t / 60.0
        return [self._force(k, c) * worn for k, c in enumerate(middle)]

    def _force(self, k: int, command: float) -> float:
        plant = self._plant
        if self.shares[k] <= plant.dead_zone and plant.dead_zone:
            self.shares[k] = 0.0
            return 0.0
        force = self._laws[k](command)
        if plant.thrust_exponent != 1.0 and force:
            full = self._full[k] if force > 0.0 else self._astern[k]
            force = (full if force > 0.0 else -full) * (abs(force) / full) ** plant.thrust_exponent
        if force < 0.0:
            force *= plant.reverse_scale
        return force * plant.scales[k]


class _Motion:
    """The motion of a plant, step by step."""

    def __init__(self, plant: Plant) -> None:
        craft = plant.craft
        self._h, self._where, self._stages = craft.step, craft.places, craft.stages
        self._equations, self._water, self._thrusts = craft.equations(plant.numbers), plant.water, plant.thrusts
        self._later = None if plant.later is None else (plant.later[0], craft.equations(plant.numbers | plant.later[1]))
        self._levers = [(x, y, n * plant.arm_scale) for x, y, n in craft.levers]
        self._loss = plant.advance_loss
        self._forces: list[Force] = [make() for make in plant.forces]
        if plant.derivatives:
            self._forces.append(Simple(damping(plant.derivatives)))
        if any(plant.trim):
            constant = (plant.trim[0], plant.trim[1], plant.trim[2])
            self._forces.append(Simple(lambda t, at, pushes: constant))
        if any(plant.wind):
            self._forces.append(Simple(fixed_to_earth(*plant.wind)))

    def stepped(self, t: float, s: State, pushes: list[float], shares: list[float]) -> State:
        """The state one step on."""
        h = self._h
        if self._later is not None and t >= self._later[0]:
            self._equations, self._later = self._later[1], None
        for force in self._forces:
            force.advance(t, h, self._seen(t, s)[0])
        a = self._rates(t, s, pushes, shares)
        b = self._rates(t + 0.5 * h, [x + 0.5 * h * y for x, y in zip(s, a, strict=True)], pushes, shares)
        if self._stages == 2:
            return [x + h * y for x, y in zip(s, b, strict=True)]
        c = self._rates(t + 0.5 * h, [x + 0.5 * h * y for x, y in zip(s, b, strict=True)], pushes, shares)
        d = self._rates(t + h, [x + h * y for x, y in zip(s, c, strict=True)], pushes, shares)
        sixth = h / 6.0
        return [x + sixth * (p + 2.0 * (q + r) + w) for x, p, q, r, w in zip(s, a, b, c, d, strict=True)]

    def _seen(self, t: float, s: State) -> tuple[Planar, tuple[float, float]]:
        """The planar state relative to the water, and how the water moves."""
        x, y, psi, u, v, r = (s[k] for k in self._where)
        if self._water is None:
            return (x, y, psi, u, v, r), (0.0, 0.0)
        north, east = self._water(t, x, y)
        co, si = cos(psi), sin(psi)
        return (x, y, psi, u - co * north - si * east, v - co * east + si * north, r), (north, east)

    def _rates(self, t: float, s: State, pushes: list[float], shares: list[float]) -> State:
        at, water = self._seen(t, s)
        if self._loss:
            pushes = [push - self._loss * share * at[3] for push, share in zip(pushes, shares, strict=True)]
        for change in self._thrusts:
            pushes = change(t, at, pushes)
        X = Y = N = 0.0
        for push, (ahead, aside, turn) in zip(pushes, self._levers, strict=True):
            X, Y, N = X + ahead * push, Y + aside * push, N + turn * push
        for force in self._forces:
            x, y, n = force(t, at, pushes)
            X, Y, N = X + x, Y + y, N + n
        return self._equations(s, (X, Y, N), water)


def damping(values: Numbers) -> Callable[[float, Planar, Sequence[float]], Loads]:
    """Loads of added hydrodynamic derivatives (SNAME 1950; Fossen 2021, section 6.5)."""
    names = ("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr", "N_ur", "Y_r", "N_v", "N_uv", "Y_ur", "X_vr")
    X_u, X_uu, Y_v, Y_vv, N_r, N_rr, N_ur, Y_r, N_v, N_uv, Y_ur, X_vr = (values.get(name, 0.0) for name in names)
    if unknown := set(values) - set(names):
        raise ValueError(f"expected derivatives among {', '.join(names)}, got {', '.join(sorted(unknown))}")

    def load(t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        _, _, _, u, v, r = at
        return (
            (X_u + X_uu * abs(u)) * u + X_vr * v * r,
            (Y_v + Y_vv * abs(v)) * v + (Y_r + Y_ur * u) * r,
            (N_r + N_rr * abs(r) + N_ur * abs(u)) * r + (N_v + N_uv * u) * v,
        )

    return load


def moved_by(s: State, water: tuple[float, float]) -> tuple[Loads, Loads, tuple[float, float]]:
    """Rates of x, y, psi; u, v, r relative to the water; derivative of the water's velocity in axes of the boat.

    The last is that of a steady current in axes that turn (Fossen 2021, section 10.3).
    """
    _, _, psi, u, v, r = s
    co, si = cos(psi), sin(psi)
    kin = u * co - v * si, u * si + v * co, r
    ahead, aside = co * water[0] + si * water[1], co * water[1] - si * water[0]
    return kin, (u - ahead, v - aside, r), (r * aside, -r * ahead)


def fixed_to_earth(north: float, east: float) -> Callable[[float, Planar, Sequence[float]], Loads]:
    """A force [N] that keeps its direction over ground."""

    def load(t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        co, si = cos(at[2]), sin(at[2])
        return co * north + si * east, co * east - si * north, 0.0

    return load
