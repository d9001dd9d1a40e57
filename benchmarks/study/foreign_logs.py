"""Logs of worlds that break the assumptions of discovery: a simulator of our own, and causes without a name."""

from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from undertow.physics.effects import BY_NAME, EFFECTS
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull, typical_effect
from undertow.physics.worlds.world import NOISE, Sensors, World, simulate_world

from .foreign_forces import FOLLOWS, SECONDS, Foreign, causes
from .foreign_kinds import KINDS, prepare
from .foreign_orders import DRAWN, boat, commands
from .foreign_sensors import NOISES, Truth
from .foreign_world import World as ForeignWorld
from .oracle import why_untold
from .scoring import PAIR
from .verb import Drive, Logged
from .worlds import WAVES, Values, dominant, label, merged, parted, with_each

FIRST = {"tuning": 300_000, "reporting": 360_000}
"""First seeds; those from 310,000 to 310,004, 320,000 to 320,007, 330,000 to 330,011, 340,000 to 340,011 and 350,000 to
350,011 were reported once, and tuned on since."""
LOGS, _DRAWS = 600, 50
FORCES = {
    "cross-flow of strips": "sway:v sway:r yaw:v yaw:r",
    "drag with a kink": "surge:u",
    "drag without a sign": "surge:u",
    "drag of a power of three": "surge:u",
    "hump of wave drag": "surge:u",
    "moment of unlike thrusts": "yaw:thrust",
    "wash over a skeg": "yaw:r yaw:thrust",
    "bank": "sway:u sway:place yaw:u yaw:place",
    "backlash of the thrusters": "surge:thrust yaw:thrust",
    "drift in waves": "surge:heading sway:heading surge:time sway:time",
}
"""Which signals a force that has no name follows, on which axis, by kind."""
_TO_DRIVE_AGAIN = ("plant", "file", "no name")
"""Groups of kinds whose boat is the same on another day, and whose sensors and record are right."""
_AFRESH = 7_000_000
"""By how much the seed of the fresh run differs."""


def keys(purpose: str) -> list[tuple[str, int]]:
    """Kinds and seeds: so many logs in turn have each kind."""
    names = tuple(KINDS)
    return [(names[n % len(names)], FIRST[purpose] + n // len(names)) for n in range(LOGS)]


def world_of(name: str, seed: int) -> ForeignWorld:
    """A world of a kind, not driven yet."""
    rng = np.random.default_rng([seed, *name.encode()])
    programme, noise = str(rng.choice(DRAWN)), str(rng.choice(tuple(NOISES)))
    world = ForeignWorld(seed, rng, boat(rng), programme, noise)
    prepare(world, KINDS[name])
    return world


def driven(name: str, seed: int) -> tuple[ForeignWorld, ForeignWorld, Truth]:
    """A sound world of a kind: as it is before it is driven, and after, and its motion."""
    for draw in range(_DRAWS):
        with suppress(ArithmeticError, VehicleError):  # no sound world: another
            world = world_of(name, seed + 1_000_000 * draw)
            before = deepcopy(world)
            return before, world, world.drive()
    raise RuntimeError(f"{name}, seed {seed}: no sound world in {_DRAWS} draws")


def foreign(kind: str, seed: int) -> Logged:
    """A log of one of `KINDS`."""
    before, world, truth = driven(kind, seed)
    group = KINDS[kind].group

    def write(path: Path) -> Path:
        return deepcopy(world).log(truth, path)

    return Logged(
        *("foreign", kind, seed, world.file, write),
        fresh=_another_day(before) if group in _TO_DRIVE_AGAIN else None,
        note=", ".join(word for word in (world.programme, world.noise, world.note) if word),
        true=frozenset(world.true),
        part=frozenset(world.part),
        sensors=frozenset(world.sensors),
        known=world.known,
        nameless=kind in FORCES and not world.true,
        dominant=dominant(world.file, with_each(world.file, _hidden(world)), motion_of(world, truth)),
        matters=world.matters(truth),
        forces=frozenset(FORCES.get(kind, "").split()),
        bound=partial(why_untold, write, world.file, world.true, world.part)
        if world.true and not world.sensors
        else None,
    )


def _another_day(world: ForeignWorld) -> Drive:
    """Writes a run of the same boat with other orders and another noise of its sensors."""
    other = {"rich": "zigzag", "zigzag": "rich", "gentle": "zigzag"}

    def write(path: Path, day: int) -> Path:
        again = deepcopy(world)
        again.seed, again.programme = world.seed + day * _AFRESH, other.get(world.programme, world.programme)
        again.rng = np.random.default_rng([again.seed, 8])
        return again.log(again.drive(), path)

    return write


def _hidden(world: ForeignWorld) -> dict[str, Values]:
    """The effects of the catalogue that act, with their values, where these are known."""
    found = {}
    for name in world.true:
        values = {symbol: float(value) for symbol, value in world.known.items() if _is_of(name, symbol)}
        if values:
            found[name] = values
    return found


def _is_of(effect: str, symbol: str) -> bool:
    """Whether a parameter is one of an effect."""
    own = BY_NAME[effect]
    return symbol in own.symbols or (own.per_thruster and symbol.endswith("_scale"))


def motion_of(world: ForeignWorld, truth: Truth) -> Motion:
    """The true motion, and what was asked of the thrusters."""
    place = np.column_stack([truth["x"], truth["y"]])
    velocity = np.column_stack([truth[name] for name in "uvr"])
    thrusters = tuple(unit.name for unit in world.file.thrusters)
    given = commands(world.file, world.asked())
    return Motion(truth["t"], place, np.unwrap(truth["psi"]), velocity, given, thrusters)


# Causes without a name

PROGRAMMES, QUALITIES = ("rich", "zigzag", "gentle"), ("clean", "field", "rough")
NAMELESS = {"tuning": 9_000, "reporting": 18_000}
"""First seeds; those from 12,000 to 12,013, 15,000 to 15,007, 16,000 to 16,007 and 17,000 to 17,027 were reported once,
and tuned on since."""
CAUSES = tuple(FOLLOWS)
IN_WAVES = "nameless in waves"
"""The kind of causes without a name in waves, of the study of seas."""
_PAIRED = [e.name for e in EFFECTS if not e.channels and not e.requires]
_NAMELESS_LOGS = 400


def nameless_keys(purpose: str) -> list[tuple[str, int]]:
    """Causes and seeds: of two dozen worlds each has a cause of its own, the last two effects of the catalogue."""
    kinds = (*CAUSES, PAIR)
    logs = _NAMELESS_LOGS * len(kinds) // len(CAUSES) + 1
    return [(kinds[n % len(kinds)], NAMELESS[purpose] + n // len(kinds)) for n in range(logs)]


_SETS_IN = {
    "a trim that sets in": {"yaw_trim"},
    "a net that is caught": {"surge_linear_damping"},
    "a propeller that is hit": {"thruster_asymmetry"},
    "thrust that sets in late": {"thrust_scale"},
}
"""What of the catalogue is there on one side of an instant."""


def partly_true(cause: str, motion: Motion) -> set[str]:
    """Names that are a part of a cause."""
    if cause == "strips of cross-flow":
        return {"sway_quadratic_damping", "yaw_quadratic_damping", "cross_flow_drag"}
    if cause == "a hull that rolls":  # slowly, its angle follows the drift: a force and a moment in proportion to that
        return {"sway_linear_damping", "sway_yaw_coupling"}
    if cause == "water that sloshes":  # so does it, behind the speed
        return {"surge_linear_damping", "surge_added_mass"}
    if cause == "drag of turns to one side":  # half of r|r| and half of r^2, which has no name
        return {"yaw_quadratic_damping"}
    if cause in _SETS_IN:  # a boat that changes is told as one: the effect is there from an instant on
        return _SETS_IN[cause]
    seldom_astern = (motion.velocity[:, 0] < -0.05).mean() < 0.05  # drifting counts for nothing
    return {"surge_quadratic_damping"} if cause == "drag without a sign" and seldom_astern else set()


def nameless(cause: str, seed: int, waves: float = 0.0) -> Logged:
    """A hull with a force more that the catalogue does not hold, or with two effects that it does.

    Parameters
    ----------
    waves : significant amplitude of their orbital velocity [m/s], beside a force without a name
    """
    rng = np.random.default_rng([seed, *cause.encode()])
    for _ in range(_DRAWS):
        with suppress(RequestError):  # no sound world: another hull
            hull = random_hull(load_vehicle("blueboat"), rng)
            programme, noise = str(rng.choice(PROGRAMMES)), str(rng.choice(QUALITIES))
            if cause == PAIR:
                return _of_two(cause, seed, hull, programme, noise, rng)
            return _of_none(
                cause, seed, hull, programme, replace(NOISE[noise], waves=waves), f"{programme}, {noise}", rng
            )
    raise RequestError(f"seed {seed}: no sound world in {_DRAWS} draws")


def nameless_in_waves(seed: int) -> Logged:
    """A hull with a force that has no name, in waves; causes in turn."""
    cause = CAUSES[seed % len(CAUSES)]
    found = nameless(cause, seed, float(np.random.default_rng([seed, 17]).uniform(*WAVES)))
    return replace(found, study="seas", kind=IN_WAVES, note=f"{cause}, {found.note}")


def _of_none(
    cause: str,
    seed: int,
    hull: Vehicle,
    programme: str,
    noise: Sensors,
    note: str,
    rng: np.random.Generator,
) -> Logged:
    """A hull with a force that has no name."""
    state, first = rng.bit_generator.state, PROGRAMMES.index(programme)

    def world(programme: str, seed: int) -> World:
        """Drives the same hull, its force drawn anew, for some have a state."""
        again = np.random.default_rng()
        again.bit_generator.state = state
        return Foreign(hull, programme, SECONDS, seed, force=causes(hull, again)[cause])

    def fresh(path: Path, day: int) -> Path:
        """Another day's run, which drives something else."""
        return world(PROGRAMMES[(first - day) % len(PROGRAMMES)], seed + day * _AFRESH).run(NOISE["field"]).write(path)

    log = world(programme, seed).run(noise)
    return Logged(
        "nameless",
        cause,
        seed,
        hull,
        log.write,
        fresh=fresh,
        note=note,
        part=frozenset(partly_true(cause, log.motion())),
        nameless=True,
        matters=float(np.sqrt(parted(hull, log.truth).max())),
        forces=frozenset(FOLLOWS[cause].split()),
    )


def _of_two(cause: str, seed: int, hull: Vehicle, programme: str, noise: str, rng: np.random.Generator) -> Logged:
    """A hull with two effects of the catalogue, beside those with a force that has no name."""
    names = [str(name) for name in rng.choice(_PAIRED, 2, replace=False)]
    drawn = [typical_effect(name, hull, rng) for name in names]
    hidden = {label(name, list(values)): values for name, values in zip(names, drawn, strict=True)}
    log = simulate_world(hull, merged(hidden), programme=programme, duration=SECONDS, noise=noise, seed=seed)
    return Logged(
        "nameless",
        cause,
        seed,
        hull,
        log.write,
        note=f"{programme}, {noise}",
        true=frozenset(hidden),
        known=merged(hidden),
        dominant=dominant(hull, with_each(hull, hidden), log.truth),
        matters=float(np.sqrt(parted(hull, log.truth).max())),
    )
