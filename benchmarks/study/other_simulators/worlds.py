"""One world of another simulator: drawn, driven, logged, with what is true of it and how much each cause matters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from undertow.physics.errors import VehicleError
from undertow.physics.integration import rollout
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle

from ..foreign_sensors import CHANNELS, NOISES, Record, Sense, Truth, recorded, write
from ..oracle import why_untold
from ..verb import Logged
from .craft import Course, Craft, Plant
from .effects import Hidden, Sizes, effects, sizes_of
from .kinds import SIMULATORS, Kind, with_hulls
from .nameless import NAMELESS
from .pilots import CLOSED, PROGRAMMES, pilot_of

Array = NDArray[np.float64]
STUDY = "other simulators"
NOISE: dict[str, tuple[float, float, float, float]] = {
    "none": (0.0, 0.0, 0.0, 0.0),
    "low": (0.01, 0.001, 0.002, 0.001),
    "ordinary": (0.05, 0.0052, 0.01, 0.003),
    "rough": NOISES["rough"],
}
"""Standard deviations of place [m], heading [rad], speed [m/s] and yaw rate [rad/s]."""
RATES = ((5.0, (1.0, 5.0)), (10.0, (1.0, 2.0, 5.0, 10.0)), (20.0, (1.0, 2.0, 5.0, 10.0, 20.0)))
"""Rows in a second, and commands in a second that such rows can hold."""
STARTS, HORIZON, GRID = 14, 10.0, 0.05
"""Rollouts that say how much a cause matters, their length [s], and the grid on which the file's boat is simulated."""
_DRAWS, _WILD = 30, 6.0
"""Worlds drawn until one is sound, and how many times the speeds of a boat with nothing hidden make a wild one."""
_SLIGHT = 0.003
"""Share of the motion below which what is hidden makes no difference of which one could have the most."""


@dataclass(frozen=True, slots=True)
class Logbook:
    """How a run is driven and written."""

    programme: str
    noise: str
    seconds: float
    rate: float
    command_rate: float
    sampled: bool

    @property
    def beat(self) -> float:
        """Time between two commands that act [s]."""
        return 1.0 / self.command_rate


@dataclass(frozen=True, slots=True)
class World:
    """A boat with what is hidden in it, its sensors and its logbook."""

    seed: int
    craft: Craft
    hidden: tuple[Hidden, ...]
    senses: tuple[Sense, ...]
    book: Logbook

    def plant(self, without: str = "") -> Plant:
        """The boat with what is hidden, without one of its causes; a constant force of its own is held against."""
        plant = Plant(self.craft)
        if without == "surge_trim" and without in self.craft.own:
            plant.trim[0] -= self.craft.own[without][1]
        for cause in self.hidden:
            if cause.key != without:
                cause.change(plant)
        return plant

    def driven(self, run: int = 0) -> Course:
        """A run of the boat; each number is another one."""
        rng = np.random.default_rng([self.seed, 21, run])
        pilot = pilot_of(self.book.programme, self.craft, self.book.seconds, NOISE[self.book.noise], rng)
        return self.plant().run(pilot, self.book.seconds, self.book.beat, float(rng.uniform(-np.pi, np.pi)))

    def written(self, course: Course, path: Path, run: int = 0) -> Path:
        """Write what sensors and the logger make of a run."""
        rng = np.random.default_rng([self.seed, 22, run])
        truth: Truth = {"t": course.time, **{name: course.planar[:, k] for k, name in enumerate(CHANNELS)}}
        for sense in self.senses:
            sense(truth, rng)
        slow = self.book.command_rate / (10.0 if self.book.sampled else 1.0)
        stamps, values = recorded(course.commands, course.step, Record(rate=self.book.rate, command_rate=slow))
        table = sampled(truth, self.book.rate, NOISE[self.book.noise], rng)
        channels = tuple(f"{t.command}_{t.name}" for t in self.craft.file.thrusters)
        return write(path, table, channels, stamps, values, long=False)


def sampled(
    truth: Truth, rate: float, noise: tuple[float, float, float, float], rng: np.random.Generator
) -> pd.DataFrame:
    """Rows of a log with noise, headings from -pi to pi."""
    place, heading, speed, turn = noise
    count = int(truth["t"][-1] * rate + 1e-6) + 1
    table = pd.DataFrame({"t": np.arange(count) / rate})
    for name, size in zip(CHANNELS, (place, place, heading, speed, speed, turn), strict=True):
        table[name] = np.interp(table["t"], truth["t"], truth[name]) + size * rng.standard_normal(count)
    table["psi"] = (table["psi"] + np.pi) % (2.0 * np.pi) - np.pi
    return table


def logged(kind: str, seed: int) -> Logged:
    """A log of a kind, with another run of the same boat; the same seed gives the same.

    Raises
    ------
    KeyError
        for a kind that there is not.
    RuntimeError
        where no draw gives a sound world.
    """
    kinds = with_hulls()
    for draw in range(_DRAWS):
        try:
            return _drawn(kind, kinds[kind], seed, draw)
        except (ArithmeticError, VehicleError):  # it runs away, or no such vehicle can be: another
            continue
    raise RuntimeError(f"{kind}, seed {seed}: no sound world in {_DRAWS} draws")


def _drawn(name: str, kind: Kind, seed: int, draw: int) -> Logged:
    world, sizes = world_of(name, kind, seed, draw)
    course = world.driven()
    _check(course, sizes)
    apart = shares(world, course)
    named = [cause for cause in world.hidden if cause.named]
    other = _rerun(world, draw)
    part = {
        *kind.part,
        *SIMULATORS[_simulator(name, kind, seed)].part,
        *(p for cause in world.hidden for p in cause.part),
    }
    true = {*kind.true, *world.craft.own, *(cause.key for cause in named)}
    known = dict(world.craft.own.values()) | {s: value for cause in named for s, value in cause.known.items()}
    note = ", ".join(
        (world.craft.simulator, world.book.programme, world.book.noise, *(cause.key for cause in world.hidden))
    )

    def log(path: Path) -> Path:
        return world.written(course, path)

    return Logged(
        *(STUDY, name, seed, world.craft.file, log),
        lambda path, day: _again(other, path, day),
        note=note,
        true=frozenset(true),
        part=frozenset(part - true),
        sensors=frozenset(kind.sensors),
        known=known,
        nameless=bool(kind.nameless),
        dominant=apart.dominant,
        matters=apart.matters,
        bound=partial(why_untold, log, world.craft.file, true, part) if true and not kind.sensors else None,
    )


def _again(world: World, path: Path, day: int) -> Path:
    """Write the run of another day of a boat, the first that does not run away.

    Raises
    ------
    RuntimeError
        where all do.
    """
    for run in range((day - 1) * _DRAWS + 1, day * _DRAWS):
        try:
            return world.written(world.driven(run), path, run)
        except ArithmeticError:
            continue
    raise RuntimeError(f"seed {world.seed}: another run of the boat always runs away")


def _simulator(name: str, kind: Kind, seed: int) -> str:
    """The simulators of a kind take turns."""
    return kind.simulators[(seed + len(name)) % len(kind.simulators)]


def world_of(name: str, kind: Kind, seed: int, draw: int = 0) -> tuple[World, Sizes]:
    """A world of a kind, not driven yet, and what is large for its boat."""
    rng = np.random.default_rng([seed, draw, *name.encode()])
    craft = (kind.make or SIMULATORS[_simulator(name, kind, seed)].make)(rng)
    sizes = sizes_of(craft, seed)
    hidden: list[Hidden] = []
    if kind.nameless in NAMELESS:
        hidden.append(NAMELESS[kind.nameless](craft, sizes, rng))
    if kind.effects and not (kind.sometimes and rng.random() < 0.5):
        first = seed + draw if kind.effects == 1 and not kind.sometimes else None
        hidden += effects(kind.effects, craft, sizes, rng, first)
    senses = () if kind.sensor is None else (kind.sensor(craft, sizes, rng),)
    programme = str(rng.choice(PROGRAMMES))
    return World(seed, craft, tuple(hidden), senses, _logbook(programme, kind, craft, rng)), sizes


def _logbook(programme: str, kind: Kind, craft: Craft, rng: np.random.Generator) -> Logbook:
    """Rates, noise and length of a log; autopilots steer at 10 Hz, and slow boats need the longer logs."""
    noise = str(rng.choice(tuple(NOISE), p=(0.2, 0.25, 0.4, 0.15)))
    rate, fits = RATES[int(rng.integers(len(RATES)))]
    if programme in CLOSED or kind.sampled:
        rate, command = max(rate, 10.0), 10.0
    else:
        command = float(rng.choice([f for f in fits if f >= 2.0 / craft.pace]))
    low, high = (120.0, 600.0) if craft.pace <= 3.0 else (480.0, 900.0)
    seconds = float(round(low + (high - low) * float(rng.random()) ** 1.5))
    return Logbook(programme, noise, seconds, rate, command, kind.sampled)


def _rerun(world: World, draw: int) -> World:
    """The same boat under another programme."""
    rng = np.random.default_rng([world.seed, draw, 23])
    programme = str(rng.choice([p for p in PROGRAMMES if p != world.book.programme]))
    book = world.book
    command = 10.0 if programme in CLOSED else book.command_rate
    seconds = min(book.seconds, 300.0 * max(1.0, world.craft.pace / 3.0))
    again = replace(book, programme=programme, seconds=seconds, rate=max(book.rate, command), command_rate=command)
    return replace(world, book=again)


def _check(course: Course, sizes: Sizes) -> None:
    """Raise ArithmeticError where a motion is wild: not the boat that the file speaks of."""
    most = np.quantile(np.abs(course.planar[:, 3:]), 0.99, axis=0)
    u, v, r = sizes.speed
    if np.any(most > _WILD * np.array([u, max(v, 0.2 * u), r])):  # a current carries a boat aside
        raise ArithmeticError("the boat runs away")


@dataclass(frozen=True, slots=True)
class Shares:
    """How far the file's boat parts from the truth in 10 s, as a share of the motion on the worst axis; and by what."""

    matters: float
    dominant: str
    by_cause: dict[str, float]


def shares(world: World, course: Course, file: Vehicle | None = None) -> Shares:
    """What each named cause is worth: how much less the file's boat would part from a boat without it.

    Squared differences of u, v and r are summed as shares of their mean squares. Another `file` than the craft's own
    may be asked about.
    """
    steps = round(HORIZON / course.step)
    rows = np.linspace(0, len(course.states) - 1 - steps, STARTS).astype(int)
    every = max(1, round(GRID / course.step))
    rows = rows // every * every
    ours = file_rollouts(file or world.craft.file, course, rows, every)
    window = rows[:, None] + every * np.arange(ours.shape[1])
    real = course.planar[window][:, :, 3:]
    whole = np.maximum((real**2).mean(axis=(0, 1)), 1e-12)
    squares = ((ours - real) ** 2).mean(axis=(0, 1)) / whole
    matters, total = float(np.sqrt(squares.max())), float(squares.sum())
    by_cause: dict[str, float] = {}
    keys = [*world.craft.own, *(cause.key for cause in world.hidden if cause.named)]
    for key in keys:
        if key == "cross_flow_drag":  # nothing is hidden beside it
            by_cause[key] = 1.0
            continue
        bare = world.plant(key).replayed(course, rows.tolist(), steps)[:, ::every, 3:]
        left = float((((ours - bare) ** 2).mean(axis=(0, 1)) / whole).sum())
        by_cause[key] = 1.0 - left / max(total, 1e-12)
    best = max(by_cause, key=lambda key: by_cause[key], default="")
    dominant = best if best and by_cause[best] > 0.5 and matters > _SLIGHT else ""
    return Shares(matters, dominant, by_cause)


def file_rollouts(file: Vehicle, course: Course, rows: Sequence[int] | Array, every: int) -> Array:
    """u, v, r (starts, steps + 1, 3) of the file's boat from states of a run, on each `every`-th of its instants."""
    halves = np.repeat(course.commands, 2, axis=0)
    halves = np.concatenate([np.repeat(halves[:1], every, axis=0), halves, np.repeat(halves[-1:], every + 2, axis=0)])
    sums = np.cumsum(np.concatenate([np.zeros((1, halves.shape[1])), halves]), axis=0)
    first = 2 * np.arange(0, len(course.states), every)
    motion = Motion(
        time=course.time[::every],
        position=course.planar[::every, :2],
        heading=np.unwrap(course.planar[::every, 2]),
        velocity=course.planar[::every, 3:],
        commands=(sums[first + 2 * every] - sums[first]) / (2 * every),
        thrusters=tuple(unit.name for unit in file.thrusters),
        source="truth",
    )
    steps = round(HORIZON / (every * course.step))
    return rollout(file, motion, np.asarray(rows) // every, steps, placed=False).states[:, :, 1:]
