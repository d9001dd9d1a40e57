"""Logs of undertow's own simulator: effects of the catalogue hidden in them, nothing at all, or a piece of a log.

Every log is written to a file and read as a user's. Seeds say all: the same one gives the same log.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from undertow.discovery.evidence.weighing import CERTAINLY
from undertow.physics.effects import EFFECTS
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.integration import rollout
from undertow.physics.momentum_balance import mass_matrix, thruster_matrix
from undertow.physics.motion import Array, Motion, wrap_angle
from undertow.physics.thrusters import command_of, neutral_command
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects, materiality, random_hull
from undertow.physics.worlds.world import FINE_STEP, Sensors, SimulatedLog, World

from .oracle import in_words, rivals, search_of
from .scoring import MATERIAL
from .verb import Logged
from .worlds import ALL, DURATION, NOISES, PARTS, SEEDS, STEP, VEHICLES, Case, Part, dominant, draw, merged, with_each

FRESH = {"rich": "zigzag", "zigzag": "gentle", "gentle": "zigzag", "waypoints": "zigzag"}
"""What the same boat drives on the fresh log."""
FRESH_SECONDS, FRESH_SEED = 120.0, 5_000_000
Key = tuple[str, int]


# Hidden effects


def plain_keys(purpose: str) -> list[Key]:
    """Parts and seeds, mixed, so that the first logs are a sample of all."""
    start, block = SEEDS[purpose]
    keys = [
        ((n + 0.5) / part.full, name, start + block * k + n)
        for k, (name, part) in enumerate(PARTS.items())
        for n in range(part.full)
    ]
    return [(name, seed) for _, name, seed in sorted(keys)]


def plain(kind: str, seed: int) -> Logged:
    """A log of a part of `PARTS`."""
    start, block = next((s, b) for s, b in SEEDS.values() if s <= seed < s + b * len(PARTS))
    case = draw(PARTS[kind], (seed - start) % block, seed)
    return logged("plain", kind, seed, case, bound=(lambda: bound(case)) if case.hidden else None)


def logged(
    study: str,
    kind: str,
    seed: int,
    case: Case,
    log: SimulatedLog | None = None,
    bound: Callable[[], str] | None = None,
) -> Logged:
    """A case as the verb is asked about it, with a fresh run of the same boat."""
    true, programme = case.log.vehicle, case.setting["programme"]

    def fresh(path: Path, day: int) -> Path:
        """What the same boat does on another day."""
        return World(true, FRESH[programme], FRESH_SECONDS, seed + day * FRESH_SEED).run(NOISES["field"]).write(path)

    return Logged(
        study,
        kind,
        seed,
        case.nominal,
        (log or case.log).write,
        fresh=fresh,
        note=", ".join(str(case.setting[name]) for name in ("vehicle", "programme", "noise")),
        true=frozenset(case.hidden),
        known=merged(case.hidden),
        dominant=dominant(case.nominal, with_each(case.nominal, case.hidden), case.log.truth),
        matters=float(materiality(case.nominal, true, case.log.truth).max()) if case.hidden else 0.0,
        bound=bound,
    )


def bound(case: Case) -> str:
    """Why a judge who knows what is hidden could not name it from this log, in words; empty where one could.

    An effect that hardly changes rollouts beside the others is immaterial to anybody; and a rival that the truth beats
    by less than 10.6 is right in more than one of 1,000 logs like this one, whatever the method.
    """
    for name in case.hidden:
        others = merged({other: values for other, values in case.hidden.items() if other != name})
        share = materiality(apply_effects(case.nominal, others), case.log.vehicle, case.log.truth).max()
        if share < MATERIAL:
            return f"without {name}, 10 s rollouts change by {100.0 * share:.1f} %"
    search = search_of([case.log.motion(STEP)], case.nominal)
    true = search.evaluate(apply_effects(case.nominal, merged(case.hidden)), tuple(case.hidden))
    best = min(rivals(search, true), key=lambda one: one[2])
    return in_words(best) if best[2] < CERTAINLY else ""


# Nothing hidden

EMPTY = {"tuning": (200_000, 600), "reporting": (270_000, 3_000)}
"""First seed and number of logs; those from 210,000 on were reported once."""
DRIVEN = ("rich", "zigzag", "gentle", "rich", "waypoints", "rich", "zigzag", "gentle", "waves", "waypoints")
"""What boats in which nothing is hidden do, in turn; each noise takes its turn after that."""


def empty_keys(purpose: str) -> list[Key]:
    """Programmes and seeds."""
    start, logs = EMPTY[purpose]
    return [(DRIVEN[n % len(DRIVEN)], start + n) for n in range(logs)]


def empty(kind: str, seed: int) -> Logged:
    """A log in which nothing is hidden."""
    number = seed % 10_000 // len(DRIVEN)
    if kind == "waves":
        case = draw(Part("", 0, 0, ALL, ("field", "rough"), waves=True), number, seed)
    else:
        case = draw(Part("", 0, 0, ("rich" if kind == "waypoints" else kind,), tuple(NOISES)), number, seed)
    if kind != "waypoints":
        return logged("nothing", kind, seed, case)
    rng = np.random.default_rng([seed, 15])
    nominal = random_hull(load_vehicle(VEHICLES[number % len(VEHICLES)]), rng)
    log = piloted(nominal, NOISES[case.setting["noise"]], rng)
    return Logged("nothing", kind, seed, nominal, log.write, note=f"{nominal.name}, waypoints, {case.setting['noise']}")


PILOT_STEP = 0.1
"""Period of an autopilot, which sees and orders ten times a second [s]."""


def piloted(vehicle: Vehicle, sensors: Sensors, rng: np.random.Generator) -> SimulatedLog:
    """A boat whose autopilot steers for waypoints by what its sensors say, noise and all, as the log has it.

    The thrust is added to a boat that is given no commands, for these follow from the motion. Its hull must have
    thrusters that act at once.
    """
    rows, fine = round(DURATION / PILOT_STEP) + 1, round(PILOT_STEP / FINE_STEP)
    sizes = [sensors.position] * 2 + [sensors.heading] + [sensors.speed] * 2 + [sensors.yaw_rate]
    seen = np.array(sizes) * rng.standard_normal((rows, 6))
    orders = np.tile([neutral_command(unit) for unit in vehicle.thrusters], (rows, 1))
    inverse, matrix = np.linalg.inv(mass_matrix(vehicle)), thruster_matrix(vehicle)
    sides = np.array([np.sign(unit.y) for unit in vehicle.thrusters])
    goal, cruise, push = np.zeros(2), 0.0, np.zeros((3, 1))
    turning, damping = rng.uniform(0.3, 0.8), rng.uniform(0.2, 0.6)

    def added(step: int, state: Array) -> Array:
        nonlocal goal, cruise, push
        row, left = divmod(step, fine)
        if left == 0:
            seen[row] += state[:6, 0]
            if step == 0 or np.hypot(*(goal - seen[row, :2])) < 4.0:
                goal, cruise = rng.uniform(-40.0, 40.0, 2), rng.uniform(0.35, 0.9)
            away = goal - seen[row, :2]
            error = float(wrap_angle(np.arctan2(away[1], away[0]) - seen[row, 2]))
            turn = np.clip(turning * error - damping * seen[row, 5], -0.6, 0.6)
            share = np.clip(cruise * max(np.cos(error), 0.0) - sides * turn, -1.0, 1.0)
            given = zip(vehicle.thrusters, share, strict=True)
            orders[row] = [float(command_of(unit, np.array(x))) for unit, x in given]
            thrust = [unit.lasting(orders[row, k : k + 1])[0] for k, unit in enumerate(vehicle.thrusters)]
            push = inverse @ matrix @ np.array(thrust)
        return push

    time = FINE_STEP * np.arange((rows - 1) * fine + 1, dtype=float)
    still = np.tile([neutral_command(unit) for unit in vehicle.thrusters], (time.size, 1))
    names = tuple(unit.name for unit in vehicle.thrusters)
    start = Motion(time, np.zeros((time.size, 2)), np.zeros(time.size), np.zeros((time.size, 3)), still, names)
    found = rollout(vehicle, start, np.array([0]), time.size - 1, added).states[0]
    truth = replace(start, position=found[:, :2].copy(), heading=found[:, 2].copy(), velocity=found[:, 3:].copy())
    seen[-1] += found[-1, :6]
    orders[-1] = orders[-2]
    truth = replace(truth, commands=np.append(np.repeat(orders[:-1], fine, axis=0), orders[-1:], axis=0))
    stamps = PILOT_STEP * np.arange(rows, dtype=float)
    return SimulatedLog(vehicle, truth, stamps, seen, stamps, orders)


# Hulls that turn by themselves

TURNING = {
    "turning": Part("one effect, open loop", 1, 0, ALL, ("field", "low"), turning=True),
    "steered": Part("one effect, steered for waypoints", 1, 0, ("rich",), ("field", "low"), turning=True),
    "turning, nothing": Part("nothing, open loop", 0, 0, ALL, ("field", "low", "rough"), turning=True),
    "steered, nothing": Part("nothing, steered", 0, 0, ("rich",), ("field", "low", "rough"), turning=True),
}
TURNS = {"tuning": (900_000, 40), "reporting": (950_000, 80)}
"""First seed and number of logs of a kind."""
UNSEEN = {"thruster_lag", "input_delay", "advance_loss", "battery_sag", "apparent_wind"}
"""What acts between an order and its thrust, or needs a channel of its own: `piloted` knows nothing of it."""


def turning_keys(purpose: str) -> list[Key]:
    """Kinds and seeds, in turn."""
    start, logs = TURNS[purpose]
    return [(kind, start + 1000 * k + n) for n in range(logs) for k, kind in enumerate(TURNING)]


def turning(kind: str, seed: int) -> Logged:
    """A log of a hull that turns by itself, under programmes or under an autopilot that keeps it straight."""
    number, part = seed % 1000, TURNING[kind]
    number += number // len(EFFECTS)
    if not kind.startswith("steered"):
        return logged("turning", kind, seed, draw(part, number, seed))
    case = next(c for k in range(len(EFFECTS)) if not UNSEEN & {*(c := draw(part, number + k, seed)).hidden})
    log = piloted(case.log.vehicle, NOISES[case.setting["noise"]], np.random.default_rng([seed, 15]))
    return logged("turning", kind, seed, replace(case, log=log, setting=case.setting | {"programme": "waypoints"}))


# Waves, and sensors whose noise is not white

SEAS = {
    "waves": Part("one effect, in waves", 1, 0, ALL, ("field", "rough"), waves=True),
    "drifting sensors": Part("one effect, noise that lasts", 1, 0, ALL, ("field", "low")),
    "two in waves": Part("two effects, in waves", 2, 0, ALL, ("field", "rough"), waves=True),
    "nothing": Part("noise that lasts alone", 0, 0, ALL, ("field", "low")),
}
SEA = {"tuning": (800_000, 60), "reporting": (850_000, 100)}
"""First seed and number of logs of a kind, of which nothing hidden has a third."""
LASTING = ((0.15, 8.0), (0.15, 8.0), (0.012, 15.0), (0.025, 2.0), (0.025, 2.0), (0.002, 1.0))
"""Noise of a filter that merges a receiver, a compass and a gyro, by column: size [m, m, rad, m/s, m/s, rad/s], and the
time after which it is forgotten [s]."""


def sea_keys(purpose: str) -> list[Key]:
    """Kinds and seeds, in turn."""
    start, logs = SEA[purpose]
    kinds = list(SEAS)
    return [
        (kind, start + 1000 * k + n)
        for n in range(logs)
        for k, kind in enumerate(kinds)
        if kind != "nothing" or n % 3 == 0
    ]


def sea(kind: str, seed: int) -> Logged:
    """A log of effects that act in waves, or are measured with noise that lasts."""
    number = seed % 1000
    case = draw(SEAS[kind], number + number // len(EFFECTS), seed)
    if SEAS[kind].waves:
        return logged("seas", kind, seed, case)
    rng = np.random.default_rng([seed, 16])
    return logged("seas", kind, seed, case, with_lasting_noise(case.log, float(rng.uniform(0.4, 1.2)), rng))


def with_lasting_noise(log: SimulatedLog, share: float, rng: np.random.Generator) -> SimulatedLog:
    """The log with so much more of the noise of a filter as is usual, see `LASTING`."""
    lasting = np.stack([coloured(log.odometry_time, share * size, time, rng) for size, time in LASTING], axis=1)
    return replace(log, odometry=log.odometry + lasting)


def coloured(time: Array, size: float, memory: float, rng: np.random.Generator) -> Array:
    """Noise of a standard deviation that is forgotten exponentially, at some instants [s]."""
    kept = np.exp(-np.diff(time) / memory)
    fresh = rng.standard_normal(time.size)
    found = np.empty(time.size)
    found[0] = fresh[0]
    for k, share in enumerate(kept.tolist()):
        found[k + 1] = share * found[k] + np.sqrt(1.0 - share**2) * fresh[k + 1]
    return size * found


# Files that are a little wrong everywhere

WORN = {
    "worn": Part("one effect, a file that is a little off", 1, 0, ALL, ("field", "low", "rough")),
    "worn, noise that lasts": Part("the same, noise that lasts", 1, 0, ALL, ("field", "low")),
    "worn, nothing else": Part("a file that is a little off", 0, 0, ALL, ("field", "low", "rough")),
}
WORN_LOGS = {"tuning": (700_000, 40), "reporting": (750_000, 100)}
"""First seed and number of logs of a kind, of which nothing else has a third."""
OFF, TOLD_OFF = (0.03, 0.1), 0.005
"""Standard deviation by which the numbers of a file are off, as shares, and the share from which one is told as off."""
_MASSES = {"mass", "X_udot", "Y_vdot", "N_uv"}
"""What is one number to a log, or nearly: m - X_udot, m - Y_vdot, and the moment that their difference makes."""
_OWN = ("hull", "coupling", "mass")
"""Families of effects whose numbers a file states; it states the force and the arms of its thrusters, too."""


def worn_keys(purpose: str) -> list[Key]:
    """Kinds and seeds, in turn."""
    start, logs = WORN_LOGS[purpose]
    kinds = list(WORN)
    return [
        (kind, start + 1000 * k + n)
        for n in range(logs)
        for k, kind in enumerate(kinds)
        if WORN[kind].hidden or n % 3 == 0
    ]


def worn(kind: str, seed: int) -> Logged:
    """A log of one effect, or of none, and a file whose numbers are all a little off, as those of a tank test are."""
    number, rng = seed % 1000, np.random.default_rng([seed, 17])
    case = draw(WORN[kind], number + number // len(EFFECTS), seed)
    symbols = {p.symbol for e in EFFECTS if e.family in _OWN for p in e.parameters} | {"thrust_scale", "arm_scale"}
    stated = sorted(s for s in symbols if case.nominal.value(s) != 0.0)
    for _ in range(50):
        shares = rng.uniform(*OFF) * rng.standard_normal(len(stated))
        off = dict(zip(stated, shares.tolist(), strict=True))
        file = case.nominal.with_values({s: case.nominal.value(s) * np.exp(share) for s, share in off.items()})
        with suppress(RequestError, VehicleError):
            file.checked()
            break
    else:
        raise RequestError(f"seed {seed}: no sound file in fifty draws")
    changed = {s for s, share in off.items() if abs(share) > TOLD_OFF}
    if changed & _MASSES:
        changed |= _MASSES
    part = {e.name for e in EFFECTS if set(e.symbols) & changed} - {name.partition("[")[0] for name in case.hidden}
    absolute = {s for e in EFFECTS if not e.added for s in e.symbols}
    values = {s: case.nominal.value(s) - (0.0 if s in absolute else file.value(s)) for s in off.keys() - _MASSES}
    for s, value in merged(case.hidden).items():
        values[s] = value + (0.0 if s in absolute or s not in off else case.nominal.value(s) - file.value(s))
    log = case.log
    if kind == "worn, noise that lasts":
        log = with_lasting_noise(log, float(rng.uniform(0.4, 1.2)), rng)
    found = logged("worn", kind, seed, replace(case, nominal=file), log)
    return replace(found, part=frozenset(part), known=values)


# Pieces of logs

SHORT = {"tuning": (220_000, 60), "reporting": (280_000, 100)}
"""First seed and number of logs, of which each has all lengths; those from 230,000 on were reported once."""
LENGTHS = (20.0, 30.0, 45.0, 60.0, 90.0, 120.0, DURATION)
"""Lengths of the pieces [s]; the last is the whole log."""
NONE_IN = 5
"""Every so many logs one has nothing hidden."""


def short_keys(purpose: str) -> list[Key]:
    """Lengths and seeds."""
    start, logs = SHORT[purpose]
    return [(f"{length:g} s", start + n) for n in range(logs) for length in LENGTHS]


def short(kind: str, seed: int) -> Logged:
    """A piece of a log of one hidden effect, each of the catalogue in turn, or of none, from a random moment on."""
    number, length = seed % 10_000, float(kind.split()[0])
    # One number further each time all effects had their turn, lest each meets one programme alone.
    turn = number + number // len(EFFECTS)
    case = draw(Part("", int(number % NONE_IN != NONE_IN - 1), 0, ALL), turn, seed)
    begin = float(np.random.default_rng([seed, 6, round(length)]).uniform(0.0, max(DURATION - length, 0.0)))
    return logged("short", kind, seed, case, piece(case.log, begin, begin + length))


def piece(log: SimulatedLog, begin: float, end: float) -> SimulatedLog:
    """The rows of a log from one time to another [s], and the commands from a step before to a step after."""
    rows = (log.odometry_time >= begin - STEP) & (log.odometry_time <= end + STEP)
    orders = (log.command_time >= begin - 0.2) & (log.command_time <= end + 0.2)
    wind = None if log.wind is None else log.wind[rows]
    return replace(
        log,
        odometry_time=log.odometry_time[rows],
        odometry=log.odometry[rows],
        command_time=log.command_time[orders],
        commands=log.commands[orders],
        wind=wind,
    )
