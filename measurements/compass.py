"""Compass deviation: a heading error that changes with the heading makes false sway velocity in proportion to speed.

GPS velocity turned by a heading that is wrong by delta shows v = u tan(delta) on a straight run. The deviation is
smooth, delta = A + B sin(psi) + C cos(psi) (semicircular part of the classical coefficients; Denne 1979, Magnetic
Compass Deviation and Correction, chapter 2). A current makes sway that does not grow with speed, a turn sway in
proportion to the yaw rate; both are fitted too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..physics.forces import apparent_wind
from ..physics.motion import Array, Motion, body_to_earth, earth_to_body
from .statistics.blocks import block_scores, numbered_on, robust_squares, sandwich

FAST = 0.2
"""Share of the top surge speed from which a row can show a deviation: what it makes grows with speed, and slower rows
show drift."""
_TOP = 0.99
"""Share of all rows that are no faster than the top surge speed: false fixes are fewer than one in a hundred."""
STRAIGHT = 0.1
"""Yaw rate [rad/s] up to which a run counts as straight: 6 degrees a second, beyond what a boat yaws about its
course."""
BENT = 0.6
"""Largest part of a deviation that changes with the heading [rad]: iron on board makes no more, and a boat that is
pushed aside does. A constant one, of a sensor that is mounted askew, may be any."""
_LEAST = np.radians(1.0)
"""Deviation from which there is one [rad]: a degree makes 0.017 m/s of sway at 1 m/s, what good sensors add in
noise."""
SOUND = np.radians(2.0)
"""Deviation up to which a compass is right [rad]: two make 0.035 m/s of sway at 1 m/s, what rough sensors add in
noise."""
_USUAL = np.radians(10.0)
"""Size of a coefficient that is nothing unusual [rad]; one far above is held back: one heading alone asks for it."""
_NONE = 1e-4
"""Size [rad] of a coefficient that is known to be none."""
_EXPLAINS, _PLAINLY = 0.3, 0.7
"""Shares of the squared sway velocity that a deviation explains to be one, and to be plain: of less than 0.3 the rest
makes more than twice as much, and of more than 0.7 no drift or lift makes as much."""
_AGREE, _MOST_AGREE = 0.75, 0.78
"""Share of stretches in which it leaves less, for the same two: 3 of 4, and 4 of 5 less a fiftieth."""
_CLEARLY = 5.0
"""Standard errors that a deviation must reach to be plain; with few stretches their estimate is too small."""
_BLOCK = 5.0
"""Length of a stretch that counts once [s]: rows of one run err together, and of longer stretches there are too few."""
_LAZY = 0.02, 0.2
"""Of a boat whose fastest turns lie between these [rad/s], no run is straight by the measure of `STRAIGHT`: its drift
in a turn passes for a deviation."""
_SECTORS, _MOST_SECTORS = 12, 7
"""Sectors of the compass, and those on which the boat must have run straight before the curve is told."""
_IN_SECTOR = 1.0
"""Time of straight running from which a sector counts [s]."""
_LEAST_BLOCKS = 4
"""Stretches without which nothing is said: of fewer, 3 of 4 cannot agree."""


@dataclass(frozen=True, slots=True)
class Compass:
    """How a compass deviates: delta = constant + sine sin(psi) + cosine cos(psi) [rad], course minus heading.

    Attributes
    ----------
    constant, sine, cosine : the coefficients [rad]; zero where there are too few straight runs
    size : root mean square deviation on straight runs [rad]
    error : its standard error, all headings of the straight runs together [rad]; infinite without straight runs
    explained : share of the squared sway velocity on straight runs that it explains beyond a current, 0..1
    agree : share of 5 s stretches of straight running in which it leaves less
    lazy : the boat never turns fast, so that no run is straight for certain
    sectors : of the twelve of the compass, those on which the boat ran straight
    """

    constant: float
    sine: float
    cosine: float
    size: float
    error: float
    explained: float
    agree: float
    lazy: bool = False
    sectors: int = _SECTORS

    @property
    def deviates(self) -> bool:
        """True for a deviation of a degree that explains 30 % of what the rest leaves, as 3 of 4 stretches agree."""
        return self.size >= _LEAST and self.explained >= _EXPLAINS and self.agree >= _AGREE

    @property
    def plain(self) -> bool:
        """True for a deviation that no drift or lift could pass for.

        It explains 70 %, as 4 of 5 stretches agree, and is five times its standard error: seven coefficients explain
        much of any dozen seconds of straight running. A boat that never turns fast shows no straight run.
        """
        bent = float(np.hypot(self.sine, self.cosine)) > BENT
        clear = self.size >= _CLEARLY * self.error and not self.lazy and not bent
        return self.deviates and clear and self.explained >= _PLAINLY and self.agree >= _MOST_AGREE

    @property
    def sound(self) -> bool:
        """True when the runs show that it does not deviate by more than two degrees."""
        return not self.deviates and self.size + 2.0 * self.error <= SOUND

    @property
    def curve_known(self) -> bool:
        """True when the straight runs had headings enough to tell the deviation on every heading."""
        return self.sectors >= _MOST_SECTORS

    @property
    def sentence(self) -> str:
        """The same in words."""
        size, limit = (float(np.degrees(x)) for x in (self.size, SOUND))
        if not np.isfinite(self.error):
            return f"too few straight runs to tell whether the compass is right to within {limit:g} degrees"
        if self.lazy:
            return "the boat turns too slowly for its drift in a turn to be told from a deviation of the compass"
        if self.plain and not self.curve_known:
            return (
                f"on the headings of its straight runs, the boat goes {size:.1f} degrees beside its heading; on "
                "others, which these are too few to tell, the deviation is an estimate"
            )
        if self.plain:
            a, b, c = (float(np.degrees(x)) for x in (self.constant, self.sine, self.cosine))
            return (
                f"the compass deviates by about {a:.1f} {b:+.1f} sin(psi) {c:+.1f} cos(psi) degrees, which makes "
                f"{100.0 * self.explained:.0f} % of the sway velocity on straight runs beyond a current"
            )
        if self.deviates:
            return self.doubt
        if self.sound:
            return f"the compass is right to within {limit:g} degrees"
        return (
            f"the straight runs tell neither that the compass is right to within {limit:g} degrees nor that it deviates"
        )

    @property
    def doubt(self) -> str:
        """The words for a deviation that drift may pass for."""
        return (
            f"the straight runs ask for a deviation of {np.degrees(self.size):.1f} +- {np.degrees(self.error):.1f} "
            "degrees, which may as well be the drift of the hull"
        )

    def at(self, heading: Array) -> Array:
        """The deviation at headings [rad], same shape [rad]."""
        return self.constant + self.sine * np.sin(heading) + self.cosine * np.cos(heading)


def compass_of(motions: Sequence[Motion], *, constant: bool = False) -> Compass:
    """What the straight runs of motions say of the compass.

    Sway velocity is fitted by speed times the deviation, beside a current and a turn, with weights that false rows do
    not sway; coefficients far above ten degrees are held back, since one heading alone cannot tell them apart. The
    standard error counts stretches of 5 s, not rows.

    Parameters
    ----------
    constant : the deviation is known to be the same on every heading
    """
    rows, block = _rows(motions)
    count = int(block.max()) + 1 if block.size else 0
    if count < _LEAST_BLOCKS:
        return Compass(0.0, 0.0, 0.0, 0.0, float("inf"), 0.0, 0.0)
    sway, speed, heading, rate = rows.T
    turning = np.concatenate([np.abs(motion.velocity[:, 2]) for motion in motions])
    others = np.column_stack([np.cos(heading), np.sin(heading), rate, speed * rate])
    shape = np.column_stack([np.ones_like(speed), np.sin(heading), np.cos(heading)])
    both = np.column_stack([speed[:, None] * shape, others])
    held = np.array([1.0 / _USUAL, *([1.0 / (_NONE if constant else _USUAL)] * 2), *([0.0] * 4)])
    found, weight, inverse = robust_squares(both, sway, held)
    without, _, _ = robust_squares(others, sway, held[3:], weight)
    left, rest = sway - both @ found, sway - others @ without
    covariance = sandwich(inverse, block_scores(both, weight * left, block))[:3, :3]
    by_block = np.array([np.bincount(block, weight * e**2, count) for e in (left, rest)])
    return Compass(
        float(found[0]),
        float(found[1]),
        float(found[2]),
        float(np.sqrt(((shape @ found[:3]) ** 2).mean())),
        float(np.sqrt(np.einsum("ni,ij,nj->n", shape, covariance, shape).mean())),
        1.0 - float(by_block[0].sum() / max(float(by_block[1].sum()), 1e-300)),
        float((by_block[0] < by_block[1]).mean()),
        _LAZY[0] < float(np.quantile(turning, _TOP)) < _LAZY[1],
        _sectors(heading, motions[0].time_step),
    )


def _sectors(heading: Array, step: float) -> int:
    """In how many sectors straight runs with these headings of rows, `step` [s] apart, lasted."""
    place = np.floor((heading % (2.0 * np.pi)) / (2.0 * np.pi) * _SECTORS).astype(int)
    counts = np.bincount(np.minimum(place, _SECTORS - 1), minlength=_SECTORS)
    return int(np.count_nonzero(counts * step >= _IN_SECTOR))


def corrected(motion: Motion, compass: Compass) -> Motion:
    """A motion with its heading corrected, and its velocity over ground turned into the body by the new heading.

    The apparent wind, which the anemometer measures in the body, stays; the air over ground follows from it.
    """

    def turned(heading: Array, velocity: Array) -> tuple[Array, Array]:
        delta = compass.at(heading)
        surge, sway = earth_to_body(delta, velocity[:, 0], velocity[:, 1])
        return heading + delta, np.column_stack([surge, sway, velocity[:, 2]])

    return remeasured(motion, turned)


def remeasured(
    motion: Motion, measure: Callable[[Array, Array], tuple[Array, Array]], rows: Array | None = None
) -> Motion:
    """A motion with another heading (n,) and velocity (n, 3), its past too, under the same apparent wind.

    The anemometer measures in the body: the air over ground follows from what it saw.

    Parameters
    ----------
    measure : headings and velocities from those of the motion
    rows : velocities (n, 3) in their place, that are on time
    """
    heading, velocity = measure(motion.heading, motion.velocity if rows is None else rows)
    past = None if motion.past is None else np.column_stack(measure(motion.past[:, 0], motion.past[:, 1:]))
    air = motion.air
    if air is not None:
        ahead, starboard = apparent_wind(motion.heading, tuple(motion.velocity.T[:2]), tuple(air.T))
        air = np.column_stack(body_to_earth(heading, ahead + velocity[:, 0], starboard + velocity[:, 1]))
    return replace(motion, heading=heading, velocity=velocity, air=air, past=past)


def _rows(motions: Sequence[Motion]) -> tuple[Array, np.ndarray]:
    """Sway, surge, heading and yaw rate (n, 4) of the rows that can show a deviation, and their stretch of 5 s (n,)."""
    speeds = [np.abs(m.velocity[:, 0]) for m in motions]
    # A quantile, not the largest: one false fix would leave no row.
    fastest = float(np.quantile(np.concatenate(speeds), _TOP)) if speeds else 0.0
    found, blocks = [np.zeros((0, 4))], []
    for motion in motions:
        surge, sway, rate = motion.velocity.T
        use = (np.abs(surge) > max(FAST * fastest, 1e-6)) & (np.abs(rate) < STRAIGHT)
        stretch = ((motion.time - motion.time[0]) // _BLOCK).astype(int)[use]
        found.append(np.column_stack([sway, surge, motion.heading, rate])[use])
        blocks.append(np.unique(stretch, return_inverse=True)[1])
    return np.concatenate(found), numbered_on(blocks)
