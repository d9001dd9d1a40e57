"""Sound logs: runs of boats whose records are right, drawn at random or from outside, for `sound_logs.py`.

Nothing is wrong with them: shipped vehicles and their sisters on the project's programmes, in calm water and in waves;
logs that begin at the step from rest; autopilots that ask for full throttle for minutes; boats of which one thruster
rests for long; slow heavy ships between waypoints; boats whose model lacks an effect, which is no fault of a log;
worlds of other simulators; and logs from outside. A run is recorded as often as its simulator lets it, at most 50 times
a second, and thinned from there.
"""

import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from boats import scaled, thruster
from quality import pwm_boat

from undertow.measurements.canonical import Channel, command_kind
from undertow.measurements.log import Log, read_log
from undertow.physics.effects import EFFECTS
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.momentum_balance import mass_matrix, thruster_matrix
from undertow.physics.motion import Array, body_to_earth
from undertow.physics.thrusters import resting_commands
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull
from undertow.physics.worlds.manoeuvres import COMMAND_STEP, programme, thruster_commands
from undertow.physics.worlds.world import NOISE, ODOMETRY_FIELDS, Orders, Sensors, SimulatedLog, World

from . import field_logs, foreign_kinds, foreign_logs
from .other_simulators import KINDS as OTHERS
from .other_simulators.worlds import world_of
from .worlds import ALL, DURATION, VEHICLES, WAVES, Part, draw

RATES = (50.0, 20.0, 10.0, 5.0, 2.0, 1.0)
"""Rows a second at which each run is recorded, as far as its simulator or its file holds them [Hz]."""
SHIPS = {
    "noise of 1 cm/s": Sensors(speed=0.01, yaw_rate=0.002, heading=0.005, position=0.05, jitter=0.001),
    "low noise": Sensors(speed=0.001, yaw_rate=0.0003, heading=0.001, position=0.005),
    "no noise": Sensors(),
}
"""What the sensors of ships do."""
_PUSHED = (0.2, 2.0)
"""Frequencies at which short waves push a small boat [Hz]."""
_LACKS = Part("one effect", 1, 0, ALL, ("field", "clean"))
_ROWS = round(DURATION / COMMAND_STEP) + 1
_GROUPS = ("plant", "file", "no name")
"""Groups of foreign kinds whose sensors and record are right."""
Drawn = tuple[Vehicle, SimulatedLog, str]
"""A boat, its log, and what is special about it."""


def calm(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A sister of a shipped vehicle in calm water, on each programme, with each noise in turn."""
    return _sailed(_sister(number, rng), number, seed, ("field", "rough", "clean"))


def in_waves(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """The same in waves."""
    boat, log, what = _sailed(_sister(number, rng), number, seed, ("field", "rough"), float(rng.uniform(*WAVES)))
    return (boat, _pushed(log, rng), f"{what}, pushed") if number % 2 else (boat, log, what)


def from_the_step(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A log whose first row is the first row of a command: the boat lies still, and is pushed from then on."""
    boat = _sister(number, rng)
    kind = ALL[number % len(ALL)]
    held = programme(boat, kind, DURATION + 1.0, seed)[round(1.0 / COMMAND_STEP) :]
    noise = ("field", "clean")[number // len(ALL) % 2]
    return boat, _driven(boat, held, rng, seed, NOISE[noise]), f"{kind}, {noise}"


def full_throttle(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """An autopilot at full throttle: one side stands at its limit for minutes, and the other steers."""
    boat = _sister(number, rng)
    turns = np.repeat(rng.uniform(0.0, 0.35, _ROWS), rng.integers(30, 200, _ROWS))[:_ROWS]
    long = rng.uniform(0.6, 0.95)
    turns[round(long * _ROWS) :] *= -1.0
    common = np.minimum(1.0, np.arange(_ROWS) / rng.uniform(1.0, 60.0))
    # One side is saturated where the turn adds to the throttle: a command beyond its range is cut at it.
    held = thruster_commands(boat, common, _smooth(turns, rng.uniform(0.2, 3.0)))
    noise = ("field", "clean")[number % 2]
    return boat, _driven(boat, held, rng, seed, NOISE[noise]), noise


def resting_thruster(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A boat of which one thruster rests for long stretches while the other works, half of the logs in waves."""
    boat = pwm_boat() if number % 2 else _sister(number, rng)
    boat = random_hull(boat, rng)
    kind = ALL[number % len(ALL)]
    held = programme(boat, kind, DURATION, seed)
    rest = resting_commands(boat.thrusters[0])
    assert rest is not None, "every boat that is drawn has one"
    one, neutral = int(rng.integers(2)), 0.5 * sum(rest)
    for begin in np.cumsum(rng.uniform(20.0, 60.0, 4) + np.array([0.0, 60.0, 60.0, 60.0])):
        first = round(begin / COMMAND_STEP)
        held[first : first + round(rng.uniform(20.0, 60.0) / COMMAND_STEP), one] = neutral
    noise, sea = ("field", "rough")[number // 4 % 2], ("calm", "waves", "pushed by waves")[number // 2 % 3]
    waves = float(rng.uniform(*WAVES)) if sea == "waves" else 0.0
    log = _driven(boat, held, rng, seed, replace(NOISE[noise], waves=waves))
    return boat, _pushed(log, rng) if sea == "pushed by waves" else log, f"{kind}, {noise}, {sea}"


def ship(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A slow heavy hull in newtons that an autopilot steers from waypoint to waypoint, at 10 Hz."""
    boat = _slow_hull(rng)
    noise = list(SHIPS)[number % len(SHIPS)]
    seconds = float(rng.uniform(400.0, 900.0))
    return boat, _driven(boat, _waypoints(boat, seconds, rng), rng, seed, SHIPS[noise]), noise


def lacking(number: int, seed: int, rng: np.random.Generator) -> Drawn:
    """A boat with an effect of the catalogue that its model lacks: what the verbs are for."""
    turn = number + number // len(EFFECTS)
    case = draw(_LACKS, turn, seed)
    return case.nominal, case.log, f"{case.setting['programme']}, {case.setting['noise']}, {', '.join(case.hidden)}"


OWN: dict[str, Callable[[int, int, np.random.Generator], Drawn]] = {
    "calm": calm,
    "in waves": in_waves,
    "from the step": from_the_step,
    "full throttle": full_throttle,
    "one thruster rests": resting_thruster,
    "slow ship": ship,
    "an effect is missing": lacking,
}
FOREIGN, OTHER = "a simulator of other assumptions", "simulators of others"
KINDS = (*OWN, FOREIGN, OTHER)
"""Kinds of runs that are drawn, in turn."""


class Run(NamedTuple):
    """A sound run: its kind, what is special about it, the vehicle file, and its log at the highest rate."""

    kind: str
    what: str
    vehicle: Vehicle
    log: Log


def drawn(first: int, number: int) -> Run:
    """The run of a number; the same first seed and number give the same.

    Raises
    ------
    RequestError
        where twenty draws give no sound vehicle.
    """
    seed, kind = first + number, KINDS[number % len(KINDS)]
    rng, turn = np.random.default_rng([seed, 8]), number // len(KINDS)
    for _ in range(20):
        with suppress(RequestError, VehicleError, ArithmeticError):  # no sound vehicle, or one that diverges: another
            if kind == FOREIGN:
                return _of_other_assumptions(turn, seed)
            if kind == OTHER:
                return _of_others(turn, seed + int(rng.integers(1_000_000)))
            boat, log, what = OWN[kind](turn, seed, rng)
            return Run(kind, what, boat, in_memory(log))
    raise RequestError(f"seed {seed}: no sound {kind} in twenty draws")


@cache
def from_outside() -> list[tuple[str, int]]:
    """Keys of logs of a boat on a lake, of Gazebo, and of others: those that lie beside the repository."""
    return field_logs.keys("reporting")


def outside(kind: str, number: int) -> Run:
    """One of them."""
    logged = field_logs.logged(kind, number)
    return Run(kind, logged.note or str(number), logged.vehicle, _read(logged.write))


def in_memory(log: SimulatedLog) -> Log:
    """A simulated log as a file of it is read, without the file."""
    columns = dict(zip(ODOMETRY_FIELDS, log.odometry.T, strict=True))
    columns["psi"] = (columns["psi"] + np.pi) % (2.0 * np.pi) - np.pi
    commands = zip((thruster.channel for thruster in log.vehicle.thrusters), log.commands.T, strict=True)
    channels = [Channel(name, log.odometry_time, values, f"odometry:{name}") for name, values in columns.items()]
    channels += [Channel(name, log.command_time, values, f"command:{name}") for name, values in commands]
    return Log(Path("log.csv"), {channel.name: channel for channel in channels})


def recorded(log: Log, number: int) -> dict[float, Log]:
    """The same run as it would have been recorded at each of `RATES` that it holds.

    By the number of the run in turn, commands stand in the rows of the motion, as in a wide table, or come at their own
    instants; and all channels are there, or no positions, or no speeds.
    """
    together, absent = bool(number % 2), ((), ("x", "y"), ("u", "v"))[number // 2 % 3]
    if set(absent) < set(log.channels) and {"x", "u"} <= set(log.channels):
        log = replace(log, channels={name: c for name, c in log.channels.items() if name not in absent})
    own = 1.0 / min(log.channels[name].period for name in ("psi", "r") if name in log.channels)
    rates = [rate for rate in RATES if rate < 1.05 * own] or [own]
    return {rate: _thinned(log, rate, together) for rate in rates}


def _thinned(log: Log, rate: float, together: bool) -> Log:
    found, kept = {}, {}
    begin = min(float(channel.time[0]) for channel in log.channels.values())
    stamps = log.channels["psi"].time
    for name, channel in log.channels.items():
        time, value = channel.time, channel.value
        if command_kind(name) and together:
            held = np.clip(np.searchsorted(time, stamps, "right") - 1, 0, None)
            time, value = stamps, value[held]
        elif command_kind(name):
            found[name] = channel
            continue
        if id(time) not in kept:
            slot = np.floor((time - begin) * rate + 0.01)
            keep = np.diff(slot, prepend=slot[0] - 1.0) > 0.0
            kept[id(time)] = (keep, time[keep])
        found[name] = replace(channel, time=kept[id(time)][1], value=value[kept[id(time)][0]])
    return replace(log, channels=found)


def _of_other_assumptions(turn: int, seed: int) -> Run:
    names = [name for name, kind in foreign_kinds.KINDS.items() if kind.group in _GROUPS]
    name = names[turn % len(names)]
    _, world, truth = foreign_logs.driven(name, seed)
    world.record = replace(world.record, rate=RATES[0])
    note = ", ".join(word for word in (name, world.programme, world.noise, world.note) if word)
    return Run(FOREIGN, note, world.file, _read(lambda path: world.log(truth, path)))


def _of_others(turn: int, seed: int) -> Run:
    names = [name for name, kind in OTHERS.items() if not kind.sensors and not kind.sampled]
    name = names[turn % len(names)]
    world, _ = world_of(name, OTHERS[name], seed)
    world = replace(world, book=replace(world.book, rate=RATES[0]))
    course = world.driven()
    note = ", ".join((name, world.craft.simulator, world.book.programme, world.book.noise))
    return Run(OTHER, note, world.craft.file, _read(lambda path: world.written(course, path)))


def _read(write: Callable[[Path], Path]) -> Log:
    with tempfile.TemporaryDirectory() as scratch:
        return read_log(write(Path(scratch) / "log.csv"))


def _sister(number: int, rng: np.random.Generator) -> Vehicle:
    return random_hull(load_vehicle(VEHICLES[number % len(VEHICLES)]), rng)


def _sailed(boat: Vehicle, number: int, seed: int, noises: Sequence[str], waves: float = 0.0) -> Drawn:
    kind, noise = ALL[number % len(ALL)], noises[number // len(ALL) % len(noises)]
    log = World(boat, kind, DURATION, seed).run(replace(NOISE[noise], waves=waves, odometry_rate=RATES[0]))
    return boat, log, f"{kind}, {noise}{f', waves of {waves:.2f} m/s' * bool(waves)}"


def _driven(boat: Vehicle, held: Array, rng: np.random.Generator, seed: int, sensors: Sensors) -> SimulatedLog:
    orders = Orders(held, float(rng.uniform(-np.pi, np.pi)))
    return World(boat, duration=COMMAND_STEP * (held.shape[0] - 1), seed=seed, orders=orders).run(
        replace(sensors, odometry_rate=RATES[0])
    )


def _pushed(log: SimulatedLog, rng: np.random.Generator) -> SimulatedLog:
    """The log of a boat that short waves push, too: surge, sway and yaw go up and down together, at 0.2 to 2 Hz."""
    time, omega = log.odometry_time, 2.0 * np.pi * rng.uniform(*_PUSHED, 80)
    phase = np.exp(1j * (np.outer(time, omega) + rng.uniform(0.0, 2.0 * np.pi, 80)))
    mixed = rng.standard_normal((80, 3)) + rng.uniform(0.0, 2.0) * rng.standard_normal(80)[:, None] * [1.0, 0.5, 1.0]
    size = float(rng.uniform(0.02, 0.12)) * np.array([1.0, 1.0, 0.6]) / np.sqrt(0.5 * (mixed**2).sum(axis=0))
    speed, way = (np.real(phase / (1j * omega) ** k @ (size * mixed)) for k in (1, 2))
    heading = log.odometry[:, 2] + way[:, 2]
    north, east = body_to_earth(log.odometry[:, 2], way[:, 0], way[:, 1])
    place = log.odometry[:, :2] + np.column_stack([north, east])
    return replace(log, odometry=np.column_stack([place, heading, log.odometry[:, 3:] + speed]))


def _smooth(series: Array, seconds: float) -> Array:
    """A series (n,) after a first-order lag, as an autopilot changes its mind."""
    share, found, now = min(1.0, COMMAND_STEP / seconds), np.empty_like(series), 0.0
    for k, wanted in enumerate(series.tolist()):
        now += share * (wanted - now)
        found[k] = now
    return found


def _slow_hull(rng: np.random.Generator) -> Vehicle:
    """A hull of 0.8 to 4 m that takes 10 to 60 s to answer, with two thrusters in newtons."""
    boat = scaled(random_hull(load_vehicle("blueboat"), rng), float(rng.uniform(0.8, 3.0)))
    heavier = float(rng.uniform(1.5, 6.0))
    boat = boat.with_values(
        {s: heavier * boat.value(s) for s in ("mass", "inertia_z", *boat.added_mass) if boat.value(s)}
    )
    inertia = np.diag(mass_matrix(boat))
    times, top = rng.uniform(10.0, 60.0), float(rng.uniform(0.15, 0.8))
    slow = {"X_u": -inertia[0] / times, "Y_v": -3.0 * inertia[1] / times, "N_r": -3.0 * inertia[2] / times}
    boat = boat.with_values({**dict.fromkeys(boat.damping, 0.0), **slow})
    newton = round(-0.5 * slow["X_u"] * top, 2)
    arm = max(0.2 * abs(boat.thrusters[0].x), 0.5 * abs(boat.thrusters[0].y))
    pair = tuple(thruster(n, boat.thrusters[0].x, y, 0.0, newton) for n, y in (("port", -arm), ("stbd", arm)))
    return boat.model_copy(update={"thrusters": pair, "name": "slow ship"}).checked()


def _waypoints(boat: Vehicle, seconds: float, rng: np.random.Generator) -> Array:
    """Commands of an autopilot that steers new headings, by a rough model of how the boat turns."""
    inertia, damping = float(mass_matrix(boat)[2, 2]), -boat.value("N_r")
    moment = float(np.abs(thruster_matrix(boat)[2] * [t.curve.force[-1] for t in boat.thrusters]).sum())  # type: ignore[union-attr]
    rows = round(seconds / COMMAND_STEP) + 1
    turn, heading, rate, wanted, until = np.zeros(rows), 0.0, 0.0, 0.0, 0.0
    common = float(rng.uniform(0.4, 1.0))
    throttle = np.full(rows, common)
    for k in range(rows):
        if COMMAND_STEP * k >= until:
            wanted += float(rng.uniform(-2.0, 2.0))
            until += float(rng.uniform(40.0, 150.0))
            common = float(np.clip(common + rng.uniform(-0.2, 0.2), 0.3, 1.0))
        throttle[k] = common
        turn[k] = np.clip(0.8 * (wanted - heading) - 8.0 * rate, -1.0, 1.0)
        rate += COMMAND_STEP * (moment * turn[k] - damping * rate) / inertia
        heading += COMMAND_STEP * rate
    return thruster_commands(boat, throttle, turn)
