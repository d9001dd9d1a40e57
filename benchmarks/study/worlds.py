"""What is hidden: the parts of the study, and the draw of each log."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from undertow.discovery.balance.starts import growth_rate
from undertow.physics.effects import EFFECTS, effect_named
from undertow.physics.errors import RequestError
from undertow.physics.forces import held_acceleration
from undertow.physics.integration import rollout
from undertow.physics.motion import Motion
from undertow.physics.thrusters import command_of
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects, random_hull, typical_effect, with_hull
from undertow.physics.worlds.world import NOISE, Sensors, SimulatedLog, World

SEEDS = {"tuning": (0, 110), "reporting": (60_000, 1_000)}
"""First seed, and how many each part has: settings are chosen on seeds 0 to 1,099, results are reported on others.
Those from 10,000 to 18,103 were reported once, and tuned on since."""
VEHICLES = ("blueboat", "otter", "blueboat_paper")
DURATION, STEP = 300.0, 0.05
WAVES = (0.05, 0.2)
"""Significant amplitude of the waves' orbital velocity, drawn between these [m/s]."""
ADDED = ("surge_added_mass", "sway_added_mass")
"""Of these and the mass of a hull whose centre of gravity is its origin, only the two sums act."""

Values = dict[str, float]


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the study: logs with the same number of hidden effects.

    `programmes` and `noises` take turns; `full` is the number of logs, each `seconds` long. Hulls that are `turning` do
    so by themselves under way, as boats with a deep bow and no skeg do.
    """

    title: str
    hidden: int
    full: int
    programmes: tuple[str, ...] = ("rich",)
    noises: tuple[str, ...] = ("field",)
    waves: bool = False
    seconds: float = DURATION
    turning: bool = False


ALL = ("rich", "zigzag", "gentle")
LOW = Sensors(speed=0.005, yaw_rate=0.002, heading=0.002, position=0.02, jitter=0.001, wind=0.1)
NOISES = {**NOISE, "low": LOW}
"""Noise of sensors by name; *low* is that of a good inertial unit with a precise satellite receiver."""
PARTS = {
    "singles": Part("one effect, rich, field", 1, 104),
    "rough": Part("one effect, rich, rough", 1, 104, noises=("rough",)),
    "clean": Part("one effect, rich, clean", 1, 28, noises=("clean",)),
    "pairs": Part("two effects, rich, field", 2, 80),
    "triples": Part("three effects, rich, field", 3, 60),
    "nothing": Part("nothing, all programmes, all noise", 0, 100, ALL, ("field", "rough", "clean")),
    "waves": Part("nothing but waves, all programmes", 0, 100, ALL, ("field", "rough"), waves=True),
    "gentle": Part("one effect, gentle, field", 1, 104, programmes=("gentle",)),
    "zigzag": Part("one effect, zigzag, field", 1, 104, programmes=("zigzag",)),
    "crowds": Part("five effects, rich, clean and field", 5, 60, noises=("clean", "field")),
}


@dataclass(frozen=True, slots=True)
class Case:
    """One log before it is looked at: the nominal hull, what is hidden from it (by label), and what was logged."""

    nominal: Vehicle
    hidden: dict[str, Values]
    log: SimulatedLog
    setting: dict[str, Any]


def draw(part: Part, number: int, seed: int) -> Case:
    """Draw log `number` of a part. Effects come in turn where one is hidden, at random where there are more.

    Every nominal hull states its size, so that cross-flow drag is looked for in every log, not only where it is hidden.
    """
    rng = np.random.default_rng([seed, 5])
    turn, effect = divmod(number, len(EFFECTS))
    base = VEHICLES[(effect + turn) % len(VEHICLES)]  # however many effects there are, each meets every vehicle in turn
    kind = part.programmes[number % len(part.programmes)]
    noise = part.noises[number // len(part.programmes) % len(part.noises)]
    waves = float(rng.uniform(*WAVES)) if part.waves else 0.0
    for _ in range(50):
        nominal = with_hull(random_hull(load_vehicle(base), rng), np.random.default_rng([seed, 9]))
        nominal = turning(nominal, float(rng.uniform(*GROWTH))) if part.turning else nominal
        names = [str(name) for name in rng.choice([e.name for e in EFFECTS], part.hidden, replace=False)]
        if part.hidden == 1:
            names = [EFFECTS[effect].name]
        if any(other in effect_named(name).includes for name in names for other in names):
            continue  # a general effect beside a special case of it: no log could tell
        if (nominal.x_g, nominal.y_g) == (0.0, 0.0) and "mass_offset" in names and set(names) & set(ADDED):
            continue  # only the sums of masses act on such a hull: the two are another two
        try:
            sizes = [(name, typical_effect(name, nominal, rng)) for name in names]
            hidden = {label(name, list(values)): values for name, values in sizes}
            true = apply_effects(nominal, merged(hidden))
            log = World(true, kind, part.seconds, seed).run(replace(NOISES[noise], waves=waves))
        except RequestError:
            continue  # no sound vehicle, or one that the effect hardly touches: another hull
        setting = {"seed": seed, "vehicle": base, "programme": kind, "noise": noise, "waves": round(waves, 3)}
        return Case(nominal, hidden, log, setting)
    raise RequestError(f"seed {seed}: no sound world in fifty draws")


GROWTH, CRUISE = (0.3, 1.2), 0.6
"""Rate at which a small turn of a turning hull grows under way [1/s], and the share of its top speed of that."""
_FARTHEST = 1e5
"""Munk moment beyond which none is looked for [N s^2/m]."""
_STATED = (0.05, 0.04, 0.3)
"""Y_r and N_v of a turning hull as shares of its Y_v [m], and its N_ur as a share of its N_r [s/m]."""


def turning(vehicle: Vehicle, growth: float) -> Vehicle:
    """The vehicle with a Munk moment so large that it turns by itself, and what a file of such a hull states as a rule.

    Parameters
    ----------
    growth : largest real part of an eigenvalue of its linearised equation of motion at cruising speed [1/s]
    """
    across, around = vehicle.value("Y_v"), vehicle.value("N_r")
    stated = {"Y_r": _STATED[0] * across, "N_v": _STATED[1] * across, "N_ur": _STATED[2] * around}
    vehicle = vehicle.with_values({symbol: round(value, 3) for symbol, value in stated.items()})
    full = np.array([[command_of(unit, np.array(1.0)) for unit in vehicle.thrusters]])
    speed = np.zeros((1, 3))
    for _ in range(600):  # half a minute at full thrust
        speed[:, 0] += STEP * held_acceleration(vehicle, speed, np.zeros(1), full)[:, 0]
    cruise = CRUISE * speed * [1.0, 0.0, 0.0]

    def too_slow(moment: float) -> float:
        boat = vehicle.with_values({"N_uv": moment})
        return growth - float(growth_rate(boat, cruise, np.zeros(1), 0.0 * full)[0])

    far = 1.0  # a Munk moment of this sign holds a course
    while too_slow(far) * too_slow(-far) > 0.0:
        far *= 2.0
        if far > _FARTHEST:
            raise RequestError(f"turning: no Munk moment makes {vehicle.name} turn by itself at {growth:g} /s")
    moment = brentq(too_slow, -far, far)
    return vehicle.with_values({"N_uv": round(moment, 3)}).checked()


def label(name: str, symbols: Sequence[str]) -> str:
    """An effect's name, with the thruster where it concerns one."""
    one = name == "thruster_asymmetry" and symbols
    return f"{name}[{symbols[0].removesuffix('_scale')}]" if one else name


def merged(hidden: Mapping[str, Values]) -> Values:
    """All values by symbol; no two effects of the catalogue share one."""
    return {symbol: value for values in hidden.values() for symbol, value in values.items()}


def parted(vehicle: Vehicle, truth: Motion) -> np.ndarray:
    """Squared error of 10 s rollouts of a vehicle from twelve starts, as shares of the squared motion (3,).

    Parameters
    ----------
    truth : the motion without noise
    """
    steps = round(10.0 / truth.time_step)
    starts = np.linspace(0, truth.time.size - steps - 1, 12).astype(int)
    real = truth.velocity[starts[:, None] + np.arange(steps + 1)]
    apart = rollout(vehicle, truth, starts, steps).states[:, :, 3:] - real
    return (apart**2).mean(axis=(0, 1)) / np.maximum((real**2).mean(axis=(0, 1)), 1e-12)


def dominant(nominal: Vehicle, alone: Mapping[str, Vehicle], truth: Motion) -> str:
    """The effect that alone takes more than half of the nominal model's squared error in rollouts, or nothing.

    Parameters
    ----------
    alone : the nominal vehicle with one of the hidden effects each, by effect
    truth : see `parted`
    """
    left = {name: float(parted(vehicle, truth).sum()) for name, vehicle in alone.items()}
    best = min(left, key=lambda name: left[name], default="")
    return best if best and left[best] < 0.5 * float(parted(nominal, truth).sum()) else ""


def with_each(nominal: Vehicle, hidden: Mapping[str, Values]) -> dict[str, Vehicle]:
    """The nominal vehicle with each of the hidden effects alone, by its label, where such a vehicle can be."""
    found = {}
    for name, values in hidden.items():
        with suppress(RequestError):
            found[name] = apply_effects(nominal, values)
    return found
