"""Straight lines above and below an activation on an interval, from which bounds on a whole network are made.

Of ReLU they are those of Zhang et al. 2018 (CROWN): a chord above, and zero or the identity below. Of tanh, which is
concave above zero and convex below it, a chord lies on one side and a tangent on the other. Where zero is inside, the
tangent above touches where it still passes over the lower end; where no such point is left, the chord is above.
"""

from collections.abc import Callable

import numpy as np

from ...physics.motion import Array

Line = tuple[Array, Array]
"""Slope, never below zero, and offset of a line for each interval."""
Relaxation = Callable[[Array, Array], tuple[Line, Line]]
"""The lines below and above an activation on intervals from their least and their most, of any one shape."""

_HALVINGS = 12
"""Of the interval in which a tangent touches: it is then found to a four-thousandth of it, and it bounds anyhow."""
_TINY = 1e-300
"""Stands for the width of an interval that has none."""


def relu_lines(least: Array, most: Array) -> tuple[Line, Line]:
    """Lines below and above max(0, x); where zero is inside, of the two below the one that leaves less between.

    >>> import numpy as np
    >>> relu_lines(np.array([-1.0]), np.array([3.0]))
    ((array([1.]), array([0.])), (array([0.75]), array([0.75])))
    """
    torn, right = (least < 0.0) & (most > 0.0), (least >= 0.0).astype(float)
    chord = np.where(torn, most / np.maximum(most - least, _TINY), right)
    keep = np.where(torn, (most > -least).astype(float), right)
    return (keep, 0.0 * keep), (chord, np.where(torn, -chord * least, 0.0))


def tanh_lines(least: Array, most: Array) -> tuple[Line, Line]:
    """Lines below and above tanh; it is odd, so that those below are those above seen from the other side."""
    slope, offset = _above_tanh(-most, -least)
    return (slope, -offset), _above_tanh(least, most)


def _above_tanh(least: Array, most: Array) -> Line:
    """A line above tanh: a tangent at the middle or, where that is not above, as near to it as one is; else a chord."""
    low, high = np.tanh(least), np.tanh(most)
    chord = (high - low) / np.maximum(most - least, _TINY)
    touch, torn = 0.5 * (least + most), (least < 0.0) & (most > 0.0)
    touch[torn] = np.maximum(touch[torn], _touching(least[torn], most[torn]))
    there = np.tanh(touch)
    tangent = (touch >= 0.0) & (_over(touch, least) | (least >= 0.0))
    slope = np.where(tangent, 1.0 - there**2, chord)
    return slope, np.where(tangent, there - slope * touch, low - chord * least)


def _touching(least: Array, most: Array) -> Array:
    """Where above zero the tangent of tanh passes over the end below zero, or the upper end where nowhere before it."""
    near, far = np.zeros_like(most), most
    for _ in range(_HALVINGS):
        middle = 0.5 * (near + far)
        over = _over(middle, least)
        near, far = np.where(over, near, middle), np.where(over, middle, far)
    return far


def _over(touch: Array, end: Array) -> np.ndarray:
    """Whether the tangent of tanh at `touch` lies above tanh at `end`."""
    there = np.tanh(touch)
    return there + (1.0 - there**2) * (end - touch) >= np.tanh(end)
