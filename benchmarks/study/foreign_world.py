"""A foreign world: a vehicle file, a true boat that differs from it, orders, sensors and a logger, and its drive."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from undertow.physics.vehicle import Vehicle

from .foreign_boats import Body, Current, Force, Rates, driven, lagged, planar, spatial
from .foreign_orders import SLOT, commands, ordered, shares, thrust
from .foreign_sensors import CHANNELS, Record, Sense, Spoil, Truth, recorded, rolled_flat, sampled, write

Array = NDArray[np.float64]
STARTS, HORIZON, FASTEST = 12, 10.0, 12.0
"""Rollouts by which it is measured how much is hidden, their length [s] for a small boat, and the speed [m/s, rad/s]
beyond which a motion has run away."""


@dataclass
class World:
    """What a kind of world sets before the boat is driven.

    Attributes
    ----------
    file : the vehicle that discovery is given
    values : parameters of the true hull by symbol; those of the file where nothing is wrong
    arms : factor of the lever arms of all thrusters
    stretch : how much longer manoeuvres last than those of a small boat
    step, integrator : of the simulation
    actuators : what becomes of shares of full command (n, thrusters) before they act
    pushes : what becomes of the thrusters' forces (n, thrusters) [N], with the time (n,) [s] and the shares
    forces : of other causes, made when the forces of the thrusters (n, thrusters) and their shares are known
    later : time [s] and parameters that the hull has from then on
    between : whether orders change between the instants of the record
    true : effects that are what is hidden; part : effects that are a fair part of it; sensors : errors that are
    known : true values of parameters, in the way of the findings
    """

    seed: int
    rng: np.random.Generator
    file: Vehicle
    programme: str
    noise: str
    seconds: float = 240.0
    stretch: float = 1.0
    step: float = 0.01
    integrator: str = "rk4"
    values: dict[str, float] = field(default_factory=dict)
    arms: float = 1.0
    actuators: list[Callable[[Array], Array]] = field(default_factory=list)
    pushes: list[Callable[[Array, Array, Array], Array]] = field(default_factory=list)
    forces: list[Callable[[Array, Array], Force]] = field(default_factory=list)
    current: Current | None = None
    growth: Callable[[float], float] | None = None
    body: Body | None = None
    later: tuple[float, dict[str, float]] | None = None
    between: bool = False
    record: Record = field(default_factory=Record)
    senses: list[Sense] = field(default_factory=list)
    spoils: list[Spoil] = field(default_factory=list)
    true: set[str] = field(default_factory=set)
    part: set[str] = field(default_factory=set)
    sensors: set[str] = field(default_factory=set)
    known: dict[str, float] = field(default_factory=dict)
    note: str = ""

    def __post_init__(self) -> None:
        if not self.values:
            self.values = dict(self.file.values)

    @property
    def steps(self) -> int:
        """Of the simulation."""
        return round(self.seconds / self.step)

    @property
    def time(self) -> Array:
        """Instants of the simulation [s]."""
        return self.step * np.arange(self.steps + 1, dtype=float)

    def new(self, file: Vehicle) -> None:
        """Take another vehicle, with nothing wrong."""
        self.file, self.values = file, dict(file.values)

    def asked(self) -> Array:
        """Shares of full command that are asked for, (steps + 1, thrusters), always the same."""
        rng = np.random.default_rng([self.seed, 5])
        orders = ordered(self.programme, self.seconds, rng, self.stretch)
        stamps = SLOT * np.arange(len(orders))
        if self.between:
            stamps[1:] -= rng.uniform(0.0, SLOT, len(orders) - 1)
        rows = np.clip(np.searchsorted(stamps, self.time + 1e-9, "right") - 1, 0, None)
        return shares(self.file, orders[rows])

    def ideal(self) -> tuple[Rates, Array]:
        """The boat of the file under what is asked, and its shares of full command."""
        asked = self.asked()
        push = self._push(self._thrusts(asked), 1.0)
        return planar(self.file.values, push), asked

    def typical(self) -> Array:
        """Speeds of the file's boat that one row in twenty exceeds (3,) [m/s, m/s, rad/s]."""
        rates, _ = self.ideal()
        states = driven(rates, [0.0] * 6, self.steps, self.step)
        return np.maximum(np.quantile(np.abs(states[:, 3:]), 0.95, axis=0), 1e-3)

    def _thrusts(self, share: Array) -> Array:
        given = commands(self.file, share)
        return np.column_stack([thrust(t, column) for t, column in zip(self.file.thrusters, given.T, strict=True)])

    def _push(self, force: Array, arms: float) -> list[list[float]]:
        """Forces and moments; equal thrusts cancel to the bit, for a boat on a straight run is not to leave it."""
        turns = np.array([-t.y * arms for t in self.file.thrusters])
        return np.column_stack([force.sum(axis=1), np.zeros(len(force)), (force * turns).sum(axis=1)]).tolist()

    def _rates(self, force: Array, share: Array) -> Rates:
        push = self._push(force, self.arms)
        if self.body is not None:
            return spatial(self.values, push, self.body)
        others = [make(force, share) for make in self.forces]

        def more(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            X = Y = N = 0.0
            for other in others:
                x, y, n = other(k, t, s)
                X, Y, N = X + x, Y + y, N + n
            return X, Y, N

        added = more if len(others) > 1 else others[0] if others else None
        rates = planar(self.values, push, added, self.current, self.growth)
        if self.later is None:
            return rates
        edge, changes = self.later
        after = planar({**self.values, **changes}, push, added, self.current, self.growth)
        return lambda k, t, s: (rates if t < edge else after)(k, t, s)

    def drive(self) -> Truth:
        """The true motion on the simulation's grid.

        Raises
        ------
        ArithmeticError
            where it runs away.
        """
        share = self.asked()
        for actuator in self.actuators:
            share = actuator(share)
        force, time = self._thrusts(share), self.time
        for change in self.pushes:
            force = change(force, time, share)
        heading, rates = float(self.rng.uniform(-np.pi, np.pi)), self._rates(force, share)
        if self.body is not None:
            states = driven(rates, [*[0.0] * 5, heading, *[0.0] * 6], self.steps, self.step, self.integrator)
            truth = rolled_flat(states, time)
        else:
            states = driven(rates, [0.0, 0.0, heading, 0.0, 0.0, 0.0], self.steps, self.step, self.integrator)
            truth = {"t": time, **{name: states[:, k] for k, name in enumerate(CHANNELS)}}
        speeds = np.abs([truth[name] for name in "uvr"])
        if not np.all(np.isfinite(speeds)) or speeds.max() > FASTEST:
            raise ArithmeticError("the boat runs away")
        return truth

    def matters(self, truth: Truth) -> float:
        """How far the file's boat parts from the truth in rollouts of 10 s, on the worst axis, as a share of it."""
        rates, _ = self.ideal()
        steps = round(HORIZON * self.stretch / self.step)
        if steps >= self.steps // 2:
            steps = self.steps // 2
        columns = np.column_stack([truth[name] for name in CHANNELS])
        apart, whole = np.zeros(3), np.zeros(3)
        for first in np.linspace(0, self.steps - steps, STARTS).astype(int):
            own = driven(rates, columns[first].tolist(), steps, self.step, first=int(first))
            real = columns[first : first + steps + 1, 3:]
            apart += ((own[:, 3:] - real) ** 2).mean(axis=0)
            whole += (real**2).mean(axis=0)
        return float(np.sqrt(apart / np.maximum(whole, 1e-12)).max())

    def log(self, truth: Truth, path: Path) -> Path:
        """Write what sensors and the logger make of the truth."""
        sensed = dict(truth)
        for sense in self.senses:
            sense(sensed, self.rng)
        table = sampled(sensed, self.record, self.noise, self.rng)
        for spoil in self.spoils:
            table = spoil(table, self.rng)
        stamps, values = recorded(commands(self.file, self.asked()), self.step, self.record)
        channels = tuple(f"{t.command}_{t.name}" for t in self.file.thrusters)
        return write(path, table, channels, stamps, values, long=self.record.long)


def delayed(seconds: float, step: float) -> Callable[[Array], Array]:
    """Shares that act so much later [s]."""
    rows = round(seconds / step)
    return lambda share: np.concatenate([np.repeat(share[:1], rows, axis=0), share])[: len(share)]


def with_lag(seconds: float, step: float) -> Callable[[Array], Array]:
    """Shares that follow with a first-order lag [s]; within a step they are held at its middle."""

    def act(share: Array) -> Array:
        found = lagged(share, seconds, step)
        before = np.concatenate([found[:1], found[:-1]])
        return 0.5 * (before + found)

    return act
