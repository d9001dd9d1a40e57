"""Who drives: programmes of held orders, and autopilots that follow lawn-mower legs or waypoints by line of sight."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from ..foreign_orders import SLOT, ordered
from .craft import Craft, Pilot

Array = NDArray[np.float64]
OPEN, CLOSED = ("rich", "zigzag", "gentle"), ("lawn-mower", "waypoints")
PROGRAMMES = (*OPEN, *CLOSED)
_LEFT = 0.4
"""Share of full command that is left for steering."""
_STILL = 1.0
"""Time for which nothing is asked at first [s], so that propellers and record begin at rest."""


def pilot_of(name: str, craft: Craft, seconds: float, noise: Sequence[float], rng: np.random.Generator) -> Pilot:
    """A pilot of a programme; autopilots see the motion with the noise of the log (place, heading, speed, rate)."""
    if name in OPEN:
        return _held(name, craft, seconds, rng)
    sight = _Sight.drawn(name, craft, seconds, rng)

    def pilot(t: float, seen: Sequence[float]) -> list[float]:
        if t < _STILL:
            return [0.0] * len(craft.laws)
        sizes = (noise[0], noise[0], noise[1], noise[2], noise[2], noise[3])
        return sight(t, [x + size * float(rng.standard_normal()) for x, size in zip(seen, sizes, strict=True)])

    return pilot


def _held(name: str, craft: Craft, seconds: float, rng: np.random.Generator) -> Pilot:
    """Orders of a programme; a thruster that pushes aside has orders of its own."""
    orders = ordered(name, seconds + 1.0, rng, craft.pace)
    aside = _telegraph(len(orders), craft.pace, rng)

    def pilot(t: float, seen: Sequence[float]) -> list[float]:
        if t < _STILL:
            return [0.0] * len(craft.laws)
        row = min(round(t / SLOT), len(orders) - 1)
        return craft.command(shared(craft, float(orders[row, 0]), float(orders[row, 1]), float(aside[row])))

    return pilot


def _telegraph(count: int, pace: float, rng: np.random.Generator) -> Array:
    """Orders that jump: nothing half of the time, else up to 0.6 of full command to a side."""
    found: list[Array] = [np.zeros(0)]
    while sum(map(len, found)) < count:
        order = 0.0 if rng.random() < 0.5 else float(rng.uniform(-0.6, 0.6))
        found.append(np.full(max(1, round(rng.uniform(3.0, 8.0) * pace / SLOT)), order))
    return np.concatenate(found)[:count]


def shared(craft: Craft, common: float, turn: float, aside: float) -> list[float]:
    """Shares of full command: port has the sum of the orders, starboard the difference."""
    found = []
    for unit in craft.file.thrusters:
        if abs(cos(unit.angle)) < 0.1:
            found.append(aside)
            continue
        side = 0.0 if abs(unit.y) < 1e-9 else (1.0 if unit.y > 0.0 else -1.0)
        found.append(min(max(common - side * turn, -1.0), 1.0))
    return found


@dataclass
class _Sight:
    """Line-of-sight guidance with an integral (Fossen 2021, section 12.3) over a PID of the heading, at 10 Hz.

    `track` are points north, east [m]; `ahead` is the look-ahead distance and `near` the circle of acceptance [m];
    `gains` are proportional [1/rad], integral [1/(rad s)] and derivative [s/rad]; `speeds` are the common order of each
    leg in turn.
    """

    craft: Craft
    track: list[tuple[float, float]]
    ahead: float
    near: float
    gains: tuple[float, float, float]
    speeds: list[float]
    leg: int = 0
    lasting: float = 0.0
    before: float = field(default=-1.0)

    @classmethod
    def drawn(cls, name: str, craft: Craft, seconds: float, rng: np.random.Generator) -> "_Sight":
        """Tracks and gains that suit a craft; the log has time for eight legs and more."""
        speed, moment, inertia, drag = _abilities(craft)
        ahead = max(1.5 * craft.length, 2.0 * speed * craft.pace)
        natural = float(rng.uniform(0.6, 1.2)) / craft.pace
        turning = float(rng.uniform(0.8, 1.2)) * 2.0 * natural
        rate = max(turning * inertia - drag, 0.1 * drag) / moment
        gain = natural**2 * inertia / moment
        leg = min(max(0.08 * speed * seconds, 2.0 * ahead), 9.0 * ahead)
        track = (_lawn if name == "lawn-mower" else _scattered)(ahead, leg, rng)
        speeds = [float(x) for x in rng.uniform(0.35, 0.75, 8)]
        return cls(craft, track, ahead, 0.8 * ahead, (gain, 0.05 * gain * natural, rate), speeds)

    def __call__(self, t: float, seen: Sequence[float]) -> list[float]:
        x, y, psi, _, _, r = seen
        last, goal = self.track[self.leg % len(self.track)], self.track[(self.leg + 1) % len(self.track)]
        if hypot(goal[0] - x, goal[1] - y) < self.near or _passed(last, goal, x, y):
            self.leg, self.lasting = self.leg + 1, 0.0
            last, goal = self.track[self.leg % len(self.track)], self.track[(self.leg + 1) % len(self.track)]
        course = atan2(goal[1] - last[1], goal[0] - last[0])
        off = cos(course) * (y - last[1]) - sin(course) * (x - last[0])
        error = (course - atan2(off, self.ahead) - psi + pi) % (2.0 * pi) - pi
        step, self.before = (t - self.before if self.before >= 0.0 else 0.0), t
        if abs(error) < 0.5:
            self.lasting += step * error
        gain, integral, rate = self.gains
        turn = gain * error + integral * self.lasting - rate * r
        turn = min(max(turn, -_LEFT), _LEFT)
        common = self.speeds[self.leg % len(self.speeds)] * (1.0 if abs(error) < 0.8 else 0.5)
        return self.craft.command(shared(self.craft, common, turn, 0.5 * turn))


def _passed(last: tuple[float, float], goal: tuple[float, float], x: float, y: float) -> bool:
    """Whether a point lies beyond the end of a leg."""
    north, east = goal[0] - last[0], goal[1] - last[1]
    return (x - goal[0]) * north + (y - goal[1]) * east > 0.0


def _abilities(craft: Craft) -> tuple[float, float, float, float]:
    """Speed at half of full thrust [m/s], full moment [N m], inertia [kg m^2] and drag in yaw [N m s/rad]."""
    p = craft.file.values
    push = 0.5 * sum(full * abs(ahead) for full, (ahead, _, _) in zip(craft.full, craft.levers, strict=True))
    moment = sum(
        full * abs(turn) for full, (ahead, _, turn) in zip(craft.full, craft.levers, strict=True) if ahead > 0.1
    )
    linear, quadratic = -p["X_u"], max(-p["X_uu"], 1e-9)
    speed = (-linear + (linear**2 + 4.0 * quadratic * push) ** 0.5) / (2.0 * quadratic)
    return speed, moment, p["inertia_z"] - p["N_rdot"], -p["N_r"]


def _lawn(ahead: float, leg: float, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Parallel legs, in a direction that is drawn."""
    long, apart, turned = (
        float(rng.uniform(0.8, 1.2)) * leg,
        float(rng.uniform(2.0, 3.0)) * ahead,
        rng.uniform(-pi, pi),
    )
    corners = []
    for k in range(24):
        ends = (0.0, long) if k % 2 == 0 else (long, 0.0)
        corners += [(along, k * apart) for along in ends]
    return [(a * cos(turned) - b * sin(turned), a * sin(turned) + b * cos(turned)) for a, b in corners]


def _scattered(ahead: float, leg: float, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Waypoints on a walk that turns by up to 140 degrees at each."""
    points, course = [(0.0, 0.0)], float(rng.uniform(-pi, pi))
    for _ in range(40):
        far = float(rng.uniform(0.6, 1.2)) * leg
        points.append((points[-1][0] + far * cos(course), points[-1][1] + far * sin(course)))
        course += float(rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 2.4))
    return points
