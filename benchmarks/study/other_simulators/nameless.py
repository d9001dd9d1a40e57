"""Causes outside the catalogue, as other simulators or waters have them: each is made for a craft and its sizes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, exp, hypot, pi, sin, tanh

import numpy as np

from .craft import Craft, Loads, Planar, Plant, Simple
from .effects import Change, Hidden, Sizes

Load = Callable[[float, Planar, Sequence[float]], Loads]
Maker = Callable[[Craft, Sizes, np.random.Generator], Hidden]


def _beside(load: Load) -> Change:
    return lambda plant: plant.forces.append(lambda: Simple(load))


def _hidden(key: str, change: Change, *part: str) -> Hidden:
    return Hidden(key, change, named=False, part=part)


def _ahead(force: Callable[[float, Planar, Sequence[float]], float]) -> Change:
    return _beside(lambda t, at, pushes: (force(t, at, pushes), 0.0, 0.0))


def kink(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """A hull that begins to plough: drag that sets in above a speed."""
    size, knee, top = float(rng.uniform(0.5, 1.0)) * s.drag[0], float(rng.uniform(0.5, 0.65)) * s.speed[0], s.speed[0]

    def drag(t: float, at: Planar, pushes: Sequence[float]) -> float:
        over = max(abs(at[3]) - knee, 0.0) / (top - knee)
        return -size * over if at[3] > 0.0 else size * over

    return _hidden("drag with a kink", _ahead(drag), "surge_quadratic_damping")


def power(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """Drag to the power 1.3: between linear and quadratic drag, which are both a part of it."""
    size, top = float(rng.uniform(0.4, 0.8)) * s.drag[0], s.speed[0]

    def drag(t: float, at: Planar, pushes: Sequence[float]) -> float:
        u = at[3]
        return -size * (abs(u) / top) ** 1.3 * (1.0 if u > 0.0 else -1.0)

    parts = ("surge_linear_damping", "surge_quadratic_damping")
    return _hidden("drag to the power 1.3", _ahead(drag), *parts)


def lost_in_turns(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """Propellers that draw air in turns: thrust falls with the rate of turn, to a half at most."""
    share, rate = float(rng.uniform(0.2, 0.45)), s.speed[2]

    def change(plant: Plant) -> None:
        plant.thrusts.append(lambda t, at, pushes: [x * (1.0 - share * min(abs(at[5]) / rate, 1.0)) for x in pushes])

    return _hidden("thrust lost in turns", change)


@dataclass
class Slosh:
    """Water in a tank: a mass that a spring and a damper couple to the hull ahead (Ibrahim 2005, section 5.2).

    `mass` [kg], `pace` natural frequency [rad/s], `damped` share of critical damping; `place` and `rate` are of the
    mass relative to the hull [m, m/s].
    """

    mass: float
    pace: float
    damped: float
    place: float = 0.0
    speed: float = 0.0

    def _push(self, u: float) -> float:
        return self.mass * (self.pace**2 * self.place + 2.0 * self.damped * self.pace * (self.speed - u))

    def __call__(self, t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        return self._push(at[3]), 0.0, 0.0

    def advance(self, t: float, step: float, at: Planar) -> None:
        """Move the water."""
        self.speed -= step * self._push(at[3]) / self.mass
        self.place += step * (self.speed - at[3])


def sloshing(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    share, period = float(rng.uniform(0.15, 0.35)), float(rng.uniform(1.5, 3.0)) * craft.pace
    mass, damped = share * craft.numbers["mass"], float(rng.uniform(0.03, 0.1))
    make = lambda: Slosh(mass, 2.0 * pi / period, damped)  # noqa: E731
    return _hidden("sloshing", lambda plant: plant.forces.append(make), "surge_added_mass", "mass_offset")


def waves(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """First-order forces of a narrow sea of twelve waves, and their mean drift (Fossen 2021, section 10.2)."""
    angle, size = float(rng.uniform(-pi, pi)), float(rng.uniform(0.1, 0.25)) * s.thrust
    peak = 2.0 * pi / (float(rng.uniform(2.0, 3.5)) * max(1.0, craft.pace**0.5))
    paces = peak * rng.uniform(0.8, 1.3, 12)
    shares = np.exp(-(((paces / peak - 1.0) / 0.15) ** 2)) + 0.1
    parts = list(
        zip(
            paces.tolist(),
            (shares / np.linalg.norm(shares)).tolist(),
            rng.uniform(0.0, 2.0 * pi, 12).tolist(),
            strict=True,
        )
    )
    co, si, arm = cos(angle), sin(angle), 0.1 * craft.length

    def load(t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        along = at[0] * co + at[1] * si
        height = sum(a * sin(w * t - w * w / 9.81 * along + p) for w, a, p in parts)
        force = size * (height + 0.3)
        aside = force * sin(angle - at[2])
        return force * cos(angle - at[2]), aside, arm * aside

    return _hidden("wave forces", _beside(load), "mean_wind")


def half_way(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """Weed or a net is caught at an instant: more drag ahead from then on, off the centre line."""
    edge, size = float(rng.uniform(45.0, 75.0)) * craft.pace, float(rng.uniform(0.6, 1.2)) * s.drag[0] / s.speed[0]
    arm = float(rng.choice([-1.0, 1.0])) * 0.1 * craft.length

    def load(t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        drag = -size * at[3] if t >= edge else 0.0
        return drag, 0.0, -arm * drag

    return _hidden("a hull that changes half way", _beside(load), "surge_linear_damping")


def lighter(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """A cargo goes overboard at an instant."""
    edge, left = float(rng.uniform(45.0, 75.0)) * craft.pace, float(rng.uniform(0.65, 0.8))
    mass = left * craft.numbers["mass"]
    return _hidden(
        "a cargo that goes overboard", lambda plant: setattr(plant, "later", (edge, {"mass": mass})), "mass_offset"
    )


def behind_a_wall(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """A current that a wall shades: on one side of a line the water stands."""
    size, angle = float(rng.uniform(0.25, 0.45)) * s.speed[0], float(rng.uniform(-pi, pi))
    wide = 2.0 * craft.length
    n, e = size * cos(angle), size * sin(angle)

    def water(t: float, x: float, y: float) -> tuple[float, float]:
        open_water = 0.5 * (1.0 + tanh((x * sin(angle) - y * cos(angle)) / wide))
        return n * open_water, e * open_water

    return _hidden(
        "wake behind a wall", lambda plant: setattr(plant, "water", water), "steady_current", "turning_current"
    )


def uneven(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """Unlike thrusts turn the boat to one side, whichever of them is the greater."""
    size, full = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.15, 0.3)) * s.moment, max(craft.full)

    def load(t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        return 0.0, 0.0, size * ((pushes[0] - pushes[1]) / (2.0 * full)) ** 2

    return _hidden("moment of unlike thrusts", _beside(load))


def norrbin(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """A yaw moment that goes with the cube of the rate of turn (Norrbin 1963)."""
    size, rate = float(rng.uniform(0.5, 1.0)) * s.drag[2], s.speed[2]
    load: Load = lambda t, at, pushes: (0.0, 0.0, -size * (at[5] / rate) ** 3)  # noqa: E731
    return _hidden("Norrbin's cube", _beside(load), "yaw_quadratic_damping")


@dataclass
class Slow:
    """Drag that a hull still has of the speed it had: -size u (|u| - |mean of the last seconds|)."""

    size: float
    memory: float
    mean: float = 0.0

    def __call__(self, t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        return -self.size * at[3] * (abs(at[3]) - abs(self.mean)), 0.0, 0.0

    def advance(self, t: float, step: float, at: Planar) -> None:
        """Forget a little."""
        self.mean += step / self.memory * (at[3] - self.mean)


def hysteresis(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    size, memory = float(rng.uniform(1.0, 2.0)) * s.drag[0] / s.speed[0] ** 2, 6.0 * craft.pace
    return _hidden("drag with hysteresis", lambda plant: plant.forces.append(lambda: Slow(size, memory)))


def stalling(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """Lift of a fin that stalls as the drift grows."""
    u, v, _ = s.speed
    size, arm = float(rng.uniform(0.8, 1.5)) * s.drag[1] / (u * v), -0.3 * craft.length

    def load(t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        lift = -size * at[3] * at[4] * exp(-((at[4] / (0.6 * v)) ** 2)) if at[3] > 0.0 else 0.0
        return 0.0, lift, arm * lift

    return _hidden("lift that stalls", _beside(load), "sway_linear_damping", "sway_yaw_coupling")


@dataclass
class Gusts:
    """A wind of a mean and a part that wanders, on areas ahead and aside [kg/m]; nobody measures it."""

    mean: tuple[float, float]
    spread: float
    memory: float
    areas: tuple[float, float]
    rng: np.random.Generator
    now: tuple[float, float] = (0.0, 0.0)

    def __call__(self, t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        co, si = cos(at[2]), sin(at[2])
        north, east = self.mean[0] + self.now[0], self.mean[1] + self.now[1]
        ahead, aside = co * north + si * east - at[3], co * east - si * north - at[4]
        speed = hypot(ahead, aside)
        return self.areas[0] * ahead * speed, self.areas[1] * aside * speed, 0.0

    def advance(self, t: float, step: float, at: Planar) -> None:
        """Let the gust wander on."""
        shake = self.spread * (2.0 * step / self.memory) ** 0.5
        n, e = self.now
        dn, de = self.rng.standard_normal(2).tolist()
        self.now = n - step / self.memory * n + shake * dn, e - step / self.memory * e + shake * de


def gusts(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    mean, angle, seed = float(rng.uniform(4.0, 8.0)), float(rng.uniform(-pi, pi)), int(rng.integers(2**31))
    areas = tuple(float(rng.uniform(a, b)) * s.thrust / mean**2 for a, b in ((0.05, 0.1), (0.08, 0.16)))
    along = mean * cos(angle), mean * sin(angle)
    make = lambda: Gusts(along, 0.3 * mean, 5.0, (areas[0], areas[1]), np.random.default_rng(seed))  # noqa: E731
    parts = ("mean_wind", "surge_linear_damping", "sway_linear_damping")
    return _hidden("gusts", lambda plant: plant.forces.append(make), *parts)


def backlash(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """Slack in the linkage: the command moves the thruster when the slack is taken up."""
    share = float(rng.uniform(0.06, 0.14))
    half = [share * max(abs(low), abs(high)) for low, high in craft.ends]

    def make() -> Callable[[list[float]], list[float]]:
        now = [0.0] * len(half)

        def act(command: list[float]) -> list[float]:
            for k, (c, h) in enumerate(zip(command, half, strict=True)):
                now[k] = min(max(now[k], c - h), c + h)
            return list(now)

        return act

    return _hidden(
        "backlash of the thrusters", lambda plant: plant.commands.append(make), "thrust_dead_zone", "thruster_lag"
    )


def slew(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """A limit of how fast the thrusters change: from nothing to full in so many seconds."""
    seconds = float(rng.uniform(1.0, 2.5)) * min(craft.pace, 4.0)
    most = [craft.step / seconds * max(abs(low), abs(high)) for low, high in craft.ends]

    def make() -> Callable[[list[float]], list[float]]:
        now = [0.0] * len(most)

        def act(command: list[float]) -> list[float]:
            for k, (c, m) in enumerate(zip(command, most, strict=True)):
                now[k] += min(max(c - now[k], -m), m)
            return list(now)

        return act

    return _hidden("a slew limit", lambda plant: plant.commands.append(make), "thruster_lag", "input_delay")


def tether(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """A line to a post that pulls where it is taut."""
    reach = float(rng.uniform(4.0, 8.0)) * s.speed[0] * craft.pace
    stiff = float(rng.uniform(0.1, 0.25)) * s.thrust / reach
    angle = float(rng.uniform(-pi, pi))
    post = reach * cos(angle), reach * sin(angle)

    def load(t: float, at: Planar, pushes: Sequence[float]) -> Loads:
        north, east = post[0] - at[0], post[1] - at[1]
        apart = max(hypot(north, east), 1e-6)
        pull = min(stiff * max(apart - reach, 0.0), 0.35 * s.thrust) / apart
        co, si = cos(at[2]), sin(at[2])
        return pull * (co * north + si * east), pull * (co * east - si * north), 0.0

    return _hidden("a tether", _beside(load))


def fades(craft: Craft, s: Sizes, rng: np.random.Generator) -> Hidden:
    """One thruster is hit by something at an instant and is weak from then on."""
    edge, left = float(rng.uniform(45.0, 75.0)) * craft.pace, float(rng.uniform(0.4, 0.7))

    def change(plant: Plant) -> None:
        plant.thrusts.append(lambda t, at, pushes: [pushes[0] * (left if t >= edge else 1.0), *pushes[1:]])

    return _hidden("a thruster that weakens", change, "thruster_asymmetry")


NAMELESS: dict[str, Maker] = {
    "drag with a kink": kink,
    "drag to the power 1.3": power,
    "thrust lost in turns": lost_in_turns,
    "sloshing": sloshing,
    "wave forces": waves,
    "a hull that changes half way": half_way,
    "a cargo that goes overboard": lighter,
    "wake behind a wall": behind_a_wall,
    "moment of unlike thrusts": uneven,
    "Norrbin's cube": norrbin,
    "drag with hysteresis": hysteresis,
    "lift that stalls": stalling,
    "gusts": gusts,
    "backlash of the thrusters": backlash,
    "a slew limit": slew,
    "a tether": tether,
    "a thruster that weakens": fades,
}
"""Every cause without a name, by what it is."""
