"""Where is a function of state largest? Quasi-random sampling of a box, then projected gradient ascent.

The function is a black box that is asked for many states at once, so gradients are central differences: with four
coordinates that costs what backpropagation would, and serves networks, formulas and foreign code alike.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from ..frames import Array

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
    """How hard to look.

    Attributes
    ----------
    starts : of gradient ascent
    steps : of each ascent
    first, shrink : length of the first step as a share of the box, and its factor where a step does not rise
    apart : starts are at least this share of the box apart, so that they do not climb the same hill
    """

    starts: int = 24
    steps: int = 30
    first: float = 0.08
    shrink: float = 0.5
    apart: float = 0.12


def spread(box: Box, count: int, seed: int) -> Array:
    """Sobol points (count, d): evenly over the box, `count` rounded up to a power of two (Sobol 1967)."""
    points = qmc.Sobol(box.low.size, rng=np.random.default_rng(seed)).random_base2(int(np.ceil(np.log2(max(count, 2)))))
    return box.low + box.width * points


def rays(states: Array, box: Box, seed: int) -> Array:
    """A quarter of the states drawn towards rest by up to a thousand, and the corners of the velocities' box.

    Linear terms show at low speed and cubic ones at high speed, the largest values of either often in a corner.
    """
    rng = np.random.default_rng([seed, 17])
    near = states[: states.shape[0] // 4].copy()
    near[:, :3] *= 10.0 ** rng.uniform(-3.0, 0.0, (near.shape[0], 1))
    grid = np.stack(np.meshgrid(*([lo, 0.0, hi] for lo, hi in zip(box.low[:3], box.high[:3], strict=True))), axis=-1)
    corners = grid.reshape(-1, 3)
    corners = corners[np.any(corners != 0.0, axis=1)]
    heading = np.zeros((corners.shape[0], box.low.size - 3))
    return np.concatenate([near, np.concatenate([corners, heading], axis=1)])


def climb(value: Value, states: Array, found: Array, box: Box, settings: SearchSettings | None = None) -> Array:
    """States (n, d) to which gradient ascent leads from the best of some states, whose values are `found`.

    Columns of the states beyond those of the box are carried along as they are.
    """
    chosen = settings or SearchSettings()
    size = box.low.size
    start = states[_apart(states[:, :size], found, box, chosen)]
    here, carried = start[:, :size], start[:, size:]
    count = here.shape[0]
    probe = 1e-3 * box.width
    steps = np.concatenate([np.diag(probe), -np.diag(probe)])
    best = value(start)
    length = np.full(count, chosen.first)
    for _ in range(chosen.steps):
        asked = np.clip(here[:, None, :] + steps, box.low, box.high)
        whole = np.concatenate([asked, np.repeat(carried[:, None], 2 * size, axis=1)], axis=2)
        said = value(whole.reshape(-1, start.shape[1])).reshape(count, 2 * size)
        gap = (asked[:, :size] - asked[:, size:]).diagonal(axis1=1, axis2=2) / box.width
        slope = (said[:, :size] - said[:, size:]) / np.maximum(gap, 1e-12)
        blocked = ((here >= box.high) & (slope > 0)) | ((here <= box.low) & (slope < 0))
        slope = np.where(blocked, 0.0, slope)
        norm = np.linalg.norm(slope, axis=1, keepdims=True)
        trial = np.clip(here + length[:, None] * slope / np.maximum(norm, 1e-300) * box.width, box.low, box.high)
        reached = value(np.concatenate([trial, carried], axis=1))
        better = reached > best
        here = np.where(better[:, None], trial, here)
        best = np.where(better, reached, best)
        length = np.where(better, 1.3 * length, chosen.shrink * length)
    return np.concatenate([here, carried], axis=1)


def _apart(states: Array, found: Array, box: Box, settings: SearchSettings) -> np.ndarray:
    """Numbers of the best states that keep their distance from one another."""
    order = np.argsort(-found, kind="stable")[:1024]
    scaled = states[order] / box.width
    taken: list[int] = []
    for k in range(order.size):
        if all(np.abs(scaled[k] - scaled[j]).max() > settings.apart for j in taken):
            taken.append(k)
        if len(taken) == settings.starts:
            break
    return order[taken]
