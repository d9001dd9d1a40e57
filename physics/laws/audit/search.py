"""Maximisation of a function of state: quasi-random points in a box, projected gradient ascent, random steps.

The function is a black box asked for many states at once, so gradients are central differences; networks, formulas and
foreign code are served alike.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...motion import Array

Value = Callable[[Array], Array]


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """Ends of each coordinate, (d,) each."""

    low: Array
    high: Array

    @property
    def width(self) -> Array:
        """Length of each side (d,)."""
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """Effort of the search.

    Attributes
    ----------
    starts : of gradient ascent
    steps : of each ascent
    first, shrink : length of the first step as a share of the box, and its factor where a step does not rise
    apart : starts are at least this share of the box apart, so that they do not climb the same hill
    finalists : of the tops that ascent reached, from which is felt at random for higher ones
    rounds, trials : of random steps from the finalists, and how many states are tried in each round from each
    """

    starts: int = 48
    steps: int = 16
    first: float = 0.08
    shrink: float = 0.5
    apart: float = 0.12
    finalists: int = 8
    rounds: int = 40
    trials: int = 24


_GENERATOR = 1267
"""Lattices that it makes leave boxes of three points' volume empty as seldom as Sobol's points do: 1 to 4 % of them, in
3 to 8 coordinates, for 2^12 to 2^14 points."""


def spread(box: Box, count: int, seed: int) -> Array:
    """Points (count, d) of a shifted Korobov lattice (Sloan and Joe 1994, section 4.2): evenly over the box.

    `count` is rounded up to a power of two.

    Parameters
    ----------
    box : ends of each coordinate
    count : points
    seed : of the shift
    """
    size, count = box.low.size, 2 ** int(np.ceil(np.log2(max(count, 2))))
    lattice = np.outer(np.arange(count), [pow(_GENERATOR, k, count) for k in range(size)]) % count / count
    return box.low + box.width * ((lattice + np.random.default_rng(seed).random(size)) % 1.0)


_ENDS, _STILL, _EVEN = 0.12, 0.12, 0.64
"""Shares of a coordinate that is drawn near either end, exactly at its neutral value, and evenly."""
_NEAR = 0.08
"""How far from an end of a coordinate counts as near it, as a share of the box; half of these lie at the end itself."""


def spiked(box: Box, neutral: Array, count: int, seed: int) -> Array:
    """Points (count, d), each coordinate often near an end of its side or exactly neutral.

    Corners, edges and faces of the box, motion along one axis and single commands are met so in all combinations:
    evenly drawn points come near none of them.

    Parameters
    ----------
    neutral : (d,) value that means nothing: no speed, no thrust; nan where none does, as of a heading: drawn evenly
    """
    points = spread(Box(0.0 * box.low, 0.0 * box.low + 1.0), count, seed)
    shares = (points - _EVEN) / _ENDS
    low = np.clip(2.0 * shares - 1.0, 0.0, 1.0) * _NEAR
    high = 1.0 - np.clip(2.0 * shares - 3.0, 0.0, 1.0) * _NEAR
    drawn = np.select(
        [points < _EVEN, points < _EVEN + _ENDS, points < _EVEN + 2.0 * _ENDS], [points / _EVEN, low, high]
    )
    found = box.low + box.width * drawn
    still = (points >= 1.0 - _STILL) & np.isfinite(neutral)
    found = np.where(still, np.nan_to_num(neutral), found)
    return np.where(np.isfinite(neutral), found, box.low + box.width * points)


def rays(states: Array, box: Box, seed: int) -> Array:
    """A quarter of the states drawn towards rest by up to a thousand, and the corners of the velocities' box.

    Linear terms show at low speed and cubic ones at high speed, the largest values of either often in a corner.

    Parameters
    ----------
    states : (n, d), velocities first
    box : ends of each coordinate
    seed : of the draws
    """
    rng = np.random.default_rng([seed, 17])
    near = states[: states.shape[0] // 4].copy()
    near[:, :3] *= 10.0 ** rng.uniform(-3.0, 0.0, (near.shape[0], 1))
    grid = np.stack(np.meshgrid(*([lo, 0.0, hi] for lo, hi in zip(box.low[:3], box.high[:3], strict=True))), axis=-1)
    corners = grid.reshape(-1, 3)
    corners = corners[np.any(corners != 0.0, axis=1)]
    heading = np.zeros((corners.shape[0], box.low.size - 3))
    return np.concatenate([near, np.concatenate([corners, heading], axis=1)])


def climb(
    value: Value, states: Array, found: Array, box: Box, settings: SearchSettings | None = None, seed: int = 0
) -> Array:
    """States (n, d) to which a search leads from the best of some states, whose values are `found`.

    Gradient ascent goes up hills; random steps from the best tops, at all scales and along some of the coordinates
    only, then follow ridges, where the slope jumps (power under thrust has one where thrust begins to brake). A
    coordinate whose side has no length stays there.

    Parameters
    ----------
    value : function of states (n, d), larger is worse
    states, found : (n, d), and their values (n,)
    box : ends of each coordinate
    settings : how hard to look
    seed : of the random steps
    """
    chosen = settings or SearchSettings()
    start = np.clip(states[_apart(states, found, box, chosen)], box.low, box.high)
    tops, best = _ascended(value, start, box, chosen)
    order = np.argsort(-best, kind="stable")[: chosen.finalists]
    felt = _felt(value, tops[order], best[order], box, chosen, seed)
    return np.concatenate([tops, felt])


def _ascended(value: Value, here: Array, box: Box, chosen: SearchSettings) -> tuple[Array, Array]:
    """Where projected gradient ascent leads from each state, and the values there."""
    free = np.flatnonzero(box.width > 0.0)
    count, size = here.shape[0], free.size
    probe = 1e-3 * np.diag(box.width)[free]
    steps = np.concatenate([probe, -probe])
    best, length = value(here), np.full(count, chosen.first)
    for _ in range(chosen.steps):
        asked = np.clip(here[:, None, :] + steps, box.low, box.high)
        said = value(asked.reshape(-1, here.shape[1])).reshape(count, 2 * size)
        gap = (asked[:, :size] - asked[:, size:])[:, np.arange(size), free] / box.width[free]
        rise = (said[:, :size] - said[:, size:]) / np.maximum(gap, 1e-12)
        slope = np.zeros_like(here)
        slope[:, free] = rise
        blocked = ((here >= box.high) & (slope > 0)) | ((here <= box.low) & (slope < 0))
        slope = np.where(blocked, 0.0, slope)
        norm = np.linalg.norm(slope, axis=1, keepdims=True)
        trial = np.clip(here + length[:, None] * slope / np.maximum(norm, 1e-300) * box.width, box.low, box.high)
        reached = value(trial)
        better = reached > best
        here = np.where(better[:, None], trial, here)
        best = np.where(better, reached, best)
        length = np.where(better, 1.3 * length, chosen.shrink * length)
    return here, best


def _felt(value: Value, here: Array, best: Array, box: Box, chosen: SearchSettings, seed: int) -> Array:
    """Where random steps lead from each state: of lengths between 0.001 % and 30 % of the box, along some sides.

    One coordinate in eight is tried at exactly zero, where powers have their kinks. A third of the trials goes on as
    the last step that rose did, with a little of another beside it, as a ridge oblique to the sides needs.
    """
    rng = np.random.default_rng([seed, 23])
    count, size = here.shape
    rows, third = np.arange(count), chosen.trials // 3
    last = np.zeros_like(here)
    width = np.where(box.width > 0.0, box.width, 1.0)
    for _ in range(chosen.rounds):
        shape = (count, chosen.trials, size)
        moved = rng.normal(size=shape) * (rng.random(shape) < 0.5) * 10.0 ** rng.uniform(-5.0, -0.5, (*shape[:2], 1))
        going = last[:, None] * 10.0 ** rng.uniform(-1.0, 1.0, (count, third, 1))
        slight = np.linalg.norm(going, axis=2, keepdims=True) * 10.0 ** rng.uniform(-2.0, 0.0, (count, third, 1))
        aside = rng.normal(size=(count, third, size)) * slight
        moved[:, :third] = np.where(np.any(last, axis=1)[:, None, None], going + aside, moved[:, :third])
        trial = here[:, None, :] + moved * box.width
        trial[:, third:][rng.random((count, chosen.trials - third, size)) < 0.125] = 0.0
        trial = np.clip(trial, box.low, box.high)
        said = value(trial.reshape(-1, size)).reshape(count, chosen.trials)
        k = np.argmax(said, axis=1)
        better = (said[rows, k] > best)[:, None]
        last = np.where(better, (trial[rows, k] - here) / width, last)
        here = np.where(better, trial[rows, k], here)
        best = np.where(better[:, 0], said[rows, k], best)
    return here


def _apart(states: Array, found: Array, box: Box, settings: SearchSettings) -> np.ndarray:
    """Numbers of the best states that keep their distance from one another."""
    free = box.width > 0.0
    order = np.argsort(-found, kind="stable")[:2048]
    scaled = states[order][:, free] / box.width[free]
    near = np.zeros(order.size, dtype=bool)
    taken: list[int] = []
    for k in range(order.size):
        if near[k]:
            continue
        taken.append(k)
        near |= np.abs(scaled - scaled[k]).max(axis=1) <= settings.apart
        if len(taken) == settings.starts:
            break
    return order[taken]
