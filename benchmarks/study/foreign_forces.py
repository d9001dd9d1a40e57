"""Forces that the catalogue does not hold, for the studies of what is made of them."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from undertow.physics.integration import rollout
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle
from undertow.physics.worlds.world import FINE_STEP, World

Array = NDArray[np.float64]
Force = Callable[[float, Array, Array], Array]
"""Force (3,) [N, N, N m] from the time [s], a state (6,) and the commands, as shares of full command."""
SECONDS = 240.0
FOLLOWS = {
    "drag with a kink": "surge:u",
    "drag without a sign": "surge:u",
    "drag of a power of three": "surge:u",
    "strips of cross-flow": "sway:v sway:r yaw:v yaw:r",
    "thrust lost in turns": "surge:r surge:thrust",
    "gusts": "surge:heading sway:heading surge:time sway:time",
    "a net that is caught": "surge:u surge:time",
    "thrust that ends early": "surge:thrust",
    "a propeller that is hit": "surge:thrust yaw:thrust surge:time yaw:time",
    "a hull that rolls": "sway:v sway:r yaw:v yaw:r",
    "a wall near by": "sway:u sway:place",
    "thrusters that disturb each other": "surge:thrust",
    "drag of turns to one side": "yaw:r",
    "a tether": "surge:place sway:place",
    "water that sloshes": "surge:u",
    "drag with hysteresis": "surge:u",
    "propellers that draw air": "surge:thrust surge:v",
    "shallow water": "surge:u surge:place",
    "a hump of wave drag": "surge:u",
    "lift that stalls": "sway:u sway:v",
    "thrust that sets in late": "surge:thrust surge:time",
    "a trim that sets in": "yaw:time",
    "drag of a power of one and a half": "sway:v yaw:v",
}
"""Which signals the force of each cause follows, on which axis."""


@dataclass(frozen=True)
class Foreign(World):
    """A world with one force more."""

    force: Force = lambda t, x, c: np.zeros(3)

    def _driven(self, start: Motion) -> Motion:
        inverse = np.linalg.inv(mass_matrix(self.vehicle))
        pairs = zip(self.vehicle.thrusters, start.commands.T, strict=True)
        share = np.column_stack([unit.curve.normalised(given, unit.command) for unit, given in pairs])

        def added(step: int, state: Array) -> Array:
            return (inverse @ self.force(step * FINE_STEP, state[:, 0], share[step]))[:, None]

        found = rollout(self.vehicle, start, np.array([0]), start.time.size - 1, added).states[0]
        return replace(start, position=found[:, :2].copy(), heading=found[:, 2].copy(), velocity=found[:, 3:].copy())


def causes(hull: Vehicle, rng: np.random.Generator) -> dict[str, Force]:
    """Forces that the catalogue does not hold, of plausible sizes for a hull of thirty kilograms."""
    size = hull.mass / 30.0
    much = rng.uniform(0.7, 1.4)
    edges = rng.uniform(60.0, 180.0, 2)
    walk = np.cumsum(rng.standard_normal((round(SECONDS / FINE_STEP) + 2, 2)), axis=0) * np.sqrt(FINE_STEP)
    gust = walk - np.array([np.convolve(w, np.full(1000, 1e-3), "same") for w in walk.T]).T

    def strips(x: Array) -> Array:
        along = np.linspace(-0.5, 0.5, 9)
        flow = x[4] + along * x[5]
        drag = -40.0 * size * much * flow * np.abs(flow) / along.size
        return np.array([0.0, drag.sum(), (drag * along).sum()])

    k = size * much
    roll, slosh, slow = Swing(9.0, 1.2), Swing(4.0, 0.4), Slow()
    post, downhill = rng.uniform(-20.0, 20.0, 2), rng.uniform(0.0, 2.0 * np.pi)

    def tether(x: Array) -> Array:
        apart = x[:2] - post
        return _turned(x[2], -1.2 * k * max(np.hypot(*apart) - 15.0, 0.0) * apart / max(np.hypot(*apart), 1.0))

    def rolled(t: float, x: Array) -> Array:
        return -4.0 * k * roll(t, 3.0 * x[4] * x[5] + 2.0 * x[4]) * np.array([0.0, 10.0, 1.0])

    return {
        "drag with a kink": lambda t, x, c: _ahead(-25.0 * k * np.sign(x[3]) * max(abs(x[3]) - 0.8, 0.0)),
        "drag without a sign": lambda t, x, c: _ahead(-7.0 * k * x[3] ** 2),
        "drag of a power of three": lambda t, x, c: _ahead(-8.0 * k * x[3] ** 3),
        "strips of cross-flow": lambda t, x, c: strips(x),
        "thrust lost in turns": lambda t, x, c: _ahead(-14.0 * k * abs(x[5]) * c.clip(0.0).sum()),
        "gusts": lambda t, x, c: _turned(x[2], 5.0 * k * gust[int(t / FINE_STEP)]),
        "a net that is caught": lambda t, x, c: _ahead(-12.0 * k * x[3] * (t > edges[0])),
        "thrust that ends early": lambda t, x, c: _ahead(-30.0 * k * (c.clip(0.6) - 0.6).sum()),
        "a propeller that is hit": lambda t, x, c: -8.0 * k * c[0] * (t > edges[1]) * np.array([1.0, 0.0, 0.3]),
        "a hull that rolls": lambda t, x, c: rolled(t, x),
        "a wall near by": lambda t, x, c: np.array([0.0, -6.0 * k * x[3] ** 2 * np.cos(0.05 * x[0]), 0.0]),
        "thrusters that disturb each other": lambda t, x, c: _ahead(-20.0 * k * c.clip(0.0).prod()),
        "drag of turns to one side": lambda t, x, c: np.array([0.0, 0.0, -5.0 * k * max(x[5], 0.0) ** 2]),
        "a tether": lambda t, x, c: tether(x),
        "water that sloshes": lambda t, x, c: _ahead(-15.0 * k * slosh(t, x[3])),
        "drag with hysteresis": lambda t, x, c: _ahead(-14.0 * k * x[3] * (abs(x[3]) - abs(slow(t, x[3])))),
        "propellers that draw air": lambda t, x, c: _ahead(-18.0 * k * c.clip(0.0).sum() * (abs(x[4]) > 0.12)),
        "shallow water": lambda t, x, c: _ahead(
            -9.0 * k * x[3] * abs(x[3]) * (x[0] * np.cos(downhill) + x[1] * np.sin(downhill) > 5.0)
        ),
        "a hump of wave drag": lambda t, x, c: _ahead(-12.0 * k * x[3] * np.exp(-(((abs(x[3]) - 1.0) / 0.25) ** 2))),
        "lift that stalls": lambda t, x, c: np.array(
            [0.0, -60.0 * k * x[3] * x[4] * np.exp(-((x[4] / 0.1) ** 2)), 0.0]
        ),
        "thrust that sets in late": lambda t, x, c: _ahead(-10.0 * k * c.sum() * (t < edges[0])),
        "a trim that sets in": lambda t, x, c: np.array([0.0, 0.0, 2.5 * k * (t > edges[1])]),
        "drag of a power of one and a half": lambda t, x, c: (
            np.array([0.0, -30.0 * k, -12.0 * k]) * x[4] * abs(x[4]) ** 0.5
        ),
    }


@dataclass
class Swing:
    """An angle or a mass on a spring that the motion sets swinging, as a hull free to roll or water in it."""

    stiffness: float
    damping: float
    time: float = 0.0
    place: float = 0.0
    rate: float = 0.0

    def __call__(self, t: float, drive: float) -> float:
        """Where it is at a time [s], under what drives it; stiffness and damping are per its inertia [1/s^2, 1/s]."""
        step, self.time = max(t - self.time, 0.0), t
        self.rate += step * (drive - self.stiffness * self.place - self.damping * self.rate)
        self.place += step * self.rate
        return self.place


@dataclass
class Slow:
    """What is left of a speed some seconds later."""

    time: float = 0.0
    mean: float = 0.0

    def __call__(self, t: float, speed: float) -> float:
        """Mean speed [m/s] at a time, of some eight seconds."""
        step, self.time = max(t - self.time, 0.0), t
        self.mean += step * (speed - self.mean) / 8.0
        return self.mean


def _ahead(force: float) -> Array:
    return np.array([force, 0.0, 0.0])


def _turned(heading: float, force: Array) -> Array:
    c, s = np.cos(heading), np.sin(heading)
    return np.array([c * force[0] + s * force[1], c * force[1] - s * force[0], 0.0])
