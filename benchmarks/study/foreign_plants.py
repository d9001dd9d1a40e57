"""Plants, changes and causes of foreign worlds: each sets what is true of a world before its boat is driven."""

from math import cos, exp, hypot, pi, sin, sqrt

import numpy as np

from .foreign_boats import WATER, Body, play, wandering
from .foreign_effects import moments, moved, thrusts
from .foreign_orders import ship, way_of
from .foreign_world import Array, Force, World


def six_degrees(world: World) -> None:
    """Roll, pitch and heave with the periods of small boats, a centre of gravity above the waterline, deep screws."""
    p, rng = world.file.values, world.rng
    beam = 1.3 * sum(abs(t.y) for t in world.file.thrusters)
    length = 4.0 * sqrt(p["inertia_z"] / p["mass"])
    world.body = Body(
        z_g=-float(rng.uniform(0.02, 0.1)) * length,
        roll=float(rng.uniform(3.0, 6.0)),
        pitch=float(rng.uniform(3.5, 6.0)),
        heave=float(rng.uniform(4.0, 7.0)),
        damped=(float(rng.uniform(0.06, 0.2)), 0.25, 0.35),
        inertia_x=1.3 * p["mass"] * (0.4 * beam) ** 2,
        inertia_y=1.8 * p["mass"] * (0.25 * length) ** 2,
        deep=float(rng.uniform(0.02, 0.06)) * length,
        shaft=float(rng.uniform(0.05, 0.12)) * length,
    )
    world.step = 0.02
    world.record.rate = float(rng.choice((10.0, 50.0)))


def strips(world: World) -> None:
    """Cross-flow drag of strips along the hull (Fossen 2021, eq. 6.131) takes the place of linear drag in sway."""
    p = world.file.values
    length, beam = 4.0 * sqrt(p["inertia_z"] / p["mass"]), 1.3 * sum(abs(t.y) for t in world.file.thrusters)
    draught = p["mass"] / (0.5 * WATER * length * beam)
    size = 0.5 * WATER * world.rng.uniform(0.8, 1.5) * draught * length
    places = (np.linspace(-0.5, 0.5, 15) * length).tolist()
    world.values["Y_v"] = 0.3 * p["Y_v"]

    def make(force: Array, share: Array) -> Force:
        def drag(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            v, r = s[4], s[5]
            Y = N = 0.0
            for x in places:
                flow = v + x * r
                local = -size / len(places) * flow * abs(flow)
                Y, N = Y + local, N + x * local
            return 0.0, Y, N

        return drag

    world.forces.append(make)


def propeller(world: World) -> None:
    """Thrust falls with the speed of the water at each propeller, K_T linear in J (Fossen 2021, eq. 9.7)."""
    top = max(float(world.typical()[0]), 0.1)
    places = [t.y for t in world.file.thrusters]
    full = thrusts(world) / len(places)
    loss = world.rng.uniform(0.15, 0.4) * full / top

    def make(force: Array, share: Array) -> Force:
        turns = np.sqrt(np.abs(force) / full).tolist()

        def drag(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            X = N = 0.0
            for y, n in zip(places, turns[k], strict=True):
                lost = loss * n * (s[3] - y * s[5])
                X, N = X - lost, N + y * lost
            return X, 0.0, N

        return drag

    world.forces.append(make)


def euler(world: World) -> None:
    world.integrator, world.step, world.record.rate = "euler", 0.02, float(world.rng.choice((10.0, 50.0)))


def gazebo(world: World) -> None:
    world.integrator, world.step, world.record.rate = "semi-implicit", 0.02, float(world.rng.choice((10.0, 50.0)))


def coarse(world: World) -> None:
    world.step, world.record.rate = 0.05, float(world.rng.choice((10.0, 20.0)))


def turning_current(world: World) -> None:
    """The current keeps its speed and turns, as tides do in a bay."""
    size, angle = world.rng.uniform(0.15, 0.35), world.rng.uniform(-pi, pi)
    rate = world.rng.choice([-1.0, 1.0]) * world.rng.uniform(1.0, 2.2) / world.seconds

    def current(t: float) -> tuple[float, float, float, float]:
        n, e = size * cos(angle + rate * t), size * sin(angle + rate * t)
        return n, e, -rate * e, rate * n

    world.current = current


def battery(world: World) -> None:
    """Thrust falls faster as the battery runs down."""
    left, seconds = world.rng.uniform(0.15, 0.35), world.seconds
    world.pushes.append(lambda force, time, share: force * (1.0 - left * (time / seconds) ** 1.5)[:, None])


def fouling(world: World) -> None:
    rate = float(world.rng.uniform(0.06, 0.2))
    world.growth = lambda t: 1.0 + rate * t / 60.0
    world.known["fouling_rate"] = rate


def _blown(world: World, north: Array, east: Array) -> None:
    """Force of an air that moves so over ground [m/s], on a superstructure whose areas go with the hull's size."""
    size = (world.file.values["mass"] / 30.0) ** (2.0 / 3.0)
    bow, side = 0.06 * size * world.rng.uniform(0.8, 1.4), 0.13 * size * world.rng.uniform(0.8, 1.4)
    arm = world.rng.uniform(-0.1, 0.1) * 2.0 * sqrt(world.file.values["inertia_z"] / world.file.values["mass"])
    n, e = north.tolist(), east.tolist()

    def make(force: Array, share: Array) -> Force:
        def blow(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            co, si = cos(s[2]), sin(s[2])
            ahead, aside = co * n[k] + si * e[k] - s[3], co * e[k] - si * n[k] - s[4]
            speed = hypot(ahead, aside)
            return bow * ahead * speed, side * aside * speed, arm * side * aside * speed

        return blow

    world.forces.append(make)


def gusts(world: World) -> None:
    """A wind of 4 to 8 m/s whose gusts are a quarter of it and last for seconds; nobody measures it."""
    mean, angle, rng = world.rng.uniform(4.0, 8.0), world.rng.uniform(-pi, pi), world.rng
    count = world.steps + 1
    gust = [0.25 * mean * wandering(rng, count, 5.0, world.step) for _ in range(2)]
    _blown(world, mean * cos(angle) + gust[0], mean * sin(angle) + gust[1])


def rising_wind(world: World) -> None:
    angle, most = world.rng.uniform(-pi, pi), world.rng.uniform(6.0, 10.0)
    speed = np.linspace(0.2 * most, most, world.steps + 1)
    _blown(world, speed * cos(angle), speed * sin(angle))


def payload(world: World) -> None:
    """A payload slides at an instant: ahead, astern, or to a side."""
    symbol, size = (("x_g", 0.15), ("y_g", 0.08))[int(world.rng.integers(2))]
    change = world.rng.choice([-1.0, 1.0]) * world.rng.uniform(0.6, 1.2) * size
    edge = float(world.rng.uniform(0.3, 0.7)) * world.seconds
    world.later = (edge, {symbol: world.values[symbol] + float(change)})
    world.part.add("cg_offset" if symbol == "x_g" else "lateral_cg")


def weaker(world: World) -> None:
    edge, left = world.rng.uniform(0.3, 0.7) * world.seconds, world.rng.uniform(0.5, 0.8)

    def change(force: Array, time: Array, share: Array) -> Array:
        found = force.copy()
        found[time >= edge, 0] *= left
        return found

    world.pushes.append(change)


def _ahead(world: World, kind: str) -> None:
    """A drag along the hull of a shape that the catalogue lacks, a good part of the known one at top speed."""
    p, top = world.file.values, max(float(world.typical()[0]), 0.1)
    size = world.rng.uniform(0.4, 0.8) * -(p["X_u"] + p["X_uu"] * top) * top
    knee, hump = 0.55 * top, 0.7 * top

    def make(force: Array, share: Array) -> Force:
        def kinked(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            over = max(abs(s[3]) - knee, 0.0) / (top - knee)
            return (-size * over if s[3] > 0.0 else size * over), 0.0, 0.0

        def unsigned(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            return -size * (s[3] / top) ** 2, 0.0, 0.0

        def cubic(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            return -size * (s[3] / top) ** 3, 0.0, 0.0

        def humped(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            return -size * s[3] / hump * exp(-(((abs(s[3]) - hump) / (0.15 * top)) ** 2)), 0.0, 0.0

        return {"kink": kinked, "unsigned": unsigned, "cubic": cubic, "hump": humped}[kind]

    world.forces.append(make)


def kink(world: World) -> None:
    _ahead(world, "kink")


def unsigned(world: World) -> None:
    _ahead(world, "unsigned")
    if world.programme != "rich":  # never astern: the same as with a sign
        world.part.add("surge_quadratic_damping")


def cubic(world: World) -> None:
    _ahead(world, "cubic")


def hump(world: World) -> None:
    _ahead(world, "hump")


def uneven_thrust(world: World) -> None:
    """Unlike thrusts turn the boat to one side, whichever of them is the greater."""
    full = thrusts(world) / len(world.file.thrusters)
    size = world.rng.choice([-1.0, 1.0]) * world.rng.uniform(0.15, 0.3) * moments(world)

    def make(force: Array, share: Array) -> Force:
        turn = (size * ((force[:, 0] - force[:, 1]) / (2.0 * full)) ** 2).tolist()
        return lambda k, t, s: (0.0, 0.0, turn[k])

    world.forces.append(make)


def wash(world: World) -> None:
    """The wash of thrusters that push ahead passes a skeg, which resists turning as long as it does."""
    size = world.rng.uniform(0.8, 1.6) * -world.file.values["N_r"] / thrusts(world)

    def make(force: Array, share: Array) -> Force:
        pushed = (size * force.clip(0.0).sum(axis=1)).tolist()
        return lambda k, t, s: (0.0, 0.0, -pushed[k] * s[5])

    world.forces.append(make)


def bank(world: World) -> None:
    """A bank draws a passing hull near and turns its bow away (Norrbin 1974), the more the nearer it is."""
    side, angle = float(world.rng.uniform(4.0, 12.0)), float(world.rng.uniform(-pi, pi))
    p, (u, _, _) = world.file.values, world.typical().tolist()
    pull = world.rng.uniform(0.15, 0.3) * thrusts(world) / u**2
    arm = 0.5 * sqrt(p["inertia_z"] / p["mass"])

    def make(force: Array, share: Array) -> Force:
        def drawn(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            away = side - s[0] * cos(angle) - s[1] * sin(angle)
            near = pull * s[3] ** 2 * exp(-abs(away) / 8.0) * (1.0 if away > 0.0 else -1.0)
            aside = near * sin(angle - s[2])
            return 0.0, aside, -arm * aside

        return drawn

    world.forces.append(make)


def backlash(world: World) -> None:
    half = float(world.rng.uniform(0.05, 0.12))
    world.actuators.append(lambda share: play(share, half))


def wave_drift(world: World) -> None:
    """Waves push a boat down the wind, groups of them by fits, and shake it at their own period."""
    rng, angle, count = world.rng, world.rng.uniform(-pi, pi), world.steps + 1
    size, pace, phase = world.rng.uniform(0.05, 0.12) * thrusts(world), rng.uniform(1.5, 3.0), rng.uniform(0.0, 6.0)
    height = np.hypot(*[wandering(rng, count, 8.0, world.step) for _ in range(2)])
    drift, shake = (size * 0.5 * height**2).tolist(), (size * height).tolist()
    arm = 0.1 * sqrt(world.file.values["inertia_z"] / world.file.values["mass"])

    def make(force: Array, share: Array) -> Force:
        def push(k: int, t: float, s: list[float]) -> tuple[float, float, float]:
            fit = drift[k] + shake[k] * sin(pace * t + phase)
            aside = fit * sin(angle - s[2])
            return fit * cos(angle - s[2]), aside, arm * aside

        return push

    world.forces.append(make)


def heavier_in_proportion(world: World) -> None:
    """All masses, drags and thrusts are greater by a fifth, so that no motion differs."""
    symbols = {*world.file.added_mass, *world.file.damping, *world.file.coupling, "mass", "inertia_z"}
    world.values |= {symbol: 1.2 * world.values[symbol] for symbol in symbols}
    world.pushes.append(lambda force, time, share: 1.2 * force)


def heavier_on_straight_runs(world: World) -> None:
    world.programme = "straight"
    moved(world, "mass_offset", "mass", 0.2 * world.file.values["mass"])


def slow_ship(world: World) -> None:
    """A vessel of 10 to 40 m with logs of 10 to 20 minutes."""
    world.new(ship(world.rng))
    world.stretch = float(np.clip(way_of(world.file) / 8.0, 2.0, 15.0))
    world.seconds = round(float(world.rng.uniform(600.0, 1200.0)))
    world.step, world.record.rate = 0.1, float(world.rng.choice((2.0, 5.0, 10.0)))
    world.record.command_rate = world.record.rate


def short(world: World) -> None:
    world.seconds = round(float(world.rng.uniform(20.0, 120.0)))
