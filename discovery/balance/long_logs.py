"""Motions before the search: a long log thinned to pieces, and a compass deviation taken away.

Half an hour of a log bounds the search. Half of the pieces form a D-optimal design, built greedily (Fedorov 1972), so
that a rare manoeuvre is kept; the others are spread evenly over time, so that a slow change is kept.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...measurements.compass import SOUND, corrected
from ...measurements.kinematics import compass_shown
from ...physics.motion import Array, Motion
from .base import WeakSettings

MOST_TESTS = 7_500
"""Test functions that a search works on: at the usual stride, 25 minutes."""
_SLACK = 1.2
"""Times as many that are searched as they are: pieces do not add up to the limit exactly."""
_PIECE = 500
"""Test functions of a piece: 100 s hold a few manoeuvres from beginning to end; each piece costs time of its own."""
_RIDGE = 1e-6
"""Of the mean square of a signal: what has never been seen tells much, but not without end."""


def subsample_long_log(motions: Sequence[Motion], settings: WeakSettings) -> tuple[tuple[Motion, ...], str]:
    """The stretches of a long log that it is searched on, in the order of time, and what to say of it.

    A log of no more than `MOST_TESTS` test functions is itself, and there is nothing to say.
    """
    pieces = [piece for number, motion in enumerate(motions) for piece in _cut(number, motion, settings)]
    tests = sum(motion.time.size // _stride(motion, settings) for motion in motions)
    if tests <= _SLACK * MOST_TESTS:
        return tuple(motions), ""
    length = np.array([(stop - start) // _stride(motions[number], settings) for number, start, stop in pieces])
    grams = np.stack([_gram(motions[number].slice(start, stop)) for number, start, stop in pieces])
    size = np.sqrt(np.einsum("kii->i", grams) / len(grams))
    size[size == 0.0] = 1.0
    grams /= size[:, None] * size
    telling = _most_telling(grams, length)
    others = np.setdiff1d(np.arange(len(pieces)), telling)
    count = int((MOST_TESTS - length[telling].sum()) / max(1.0, length[others].mean())) if others.size else 0
    evenly = others[np.linspace(0, others.size - 1, min(count, others.size)).round().astype(int)]
    chosen = [pieces[k] for k in sorted({*telling, *evenly.tolist()})]
    found = tuple(motions[number].slice(start, stop) for number, start, stop in _joined(chosen))
    text = (
        f"effects are searched for on {len(chosen)} pieces of this long log, "
        f"{sum(m.duration for m in found) / 60.0:.0f} of its {sum(m.duration for m in motions) / 60.0:.0f} min: those "
        "that tell most, and others spread evenly; errors of predictions are those of the rows that judge"
    )
    return found, text


def _stride(motion: Motion, settings: WeakSettings) -> int:
    return max(1, round(settings.stride / motion.time_step))


def _cut(number: int, motion: Motion, settings: WeakSettings) -> Iterator[tuple[int, int, int]]:
    """Pieces of a motion (number, first row, last row but one), all but the last of one length."""
    rows = _PIECE * _stride(motion, settings)
    edges = [*range(0, max(1, motion.time.size - rows // 2), rows), motion.time.size]
    for start, stop in pairwise(edges):
        yield number, start, stop


def _gram(piece: Motion) -> Array:
    """Mean products of what forces are made of: speeds, their squares, their changes, commands, the heading."""
    u, v, r = piece.velocity.T
    turned = [f(piece.heading) for f in (np.cos, np.sin)]
    signals = [
        *(u, v, r, u * abs(u), v * abs(v), r * abs(r), u * v, u * r, v * r, abs(u), *turned, u * turned[0]),
        *(u * turned[1], *np.gradient(piece.velocity, axis=0).T),
        *(c for k in piece.commands.T for c in (k, k * abs(k), k * abs(k) * k)),
    ]
    columns = np.column_stack(signals)
    return np.asarray(columns.T @ columns / len(columns))


def _most_telling(grams: Array, length: np.ndarray) -> list[int]:
    """Pieces (pieces, n, n) that raise the determinant of the sum of their products most, one after the other.

    They are half of what is searched, by their length in test functions (pieces,).
    """
    total = _RIDGE * np.eye(grams.shape[1])
    result: list[int] = []
    while len(result) < len(grams) and length[result].sum() < MOST_TESTS // 2:
        gains = np.linalg.slogdet(total + grams)[1]
        gains[result] = -np.inf
        result.append(int(gains.argmax()))
        total = total + grams[result[-1]]
    return result


def _joined(pieces: Sequence[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    """Pieces in the order of time, those that follow each other as one."""
    result: list[tuple[int, int, int]] = []
    for number, start, stop in pieces:
        if result and result[-1][0] == number and result[-1][2] == start:
            start = result.pop()[1]
        result.append((number, start, stop))
    return result


UNKNOWN = float(np.radians(5.0))
"""Deviation that a compass on a boat may have of which nothing is known [rad]: one that was swung has less."""
STRAIGHT_RUNS = "compass_on_straight_runs"
"""Name of the correction for a compass deviation that straight runs show: of what is fitted on rollouts alone."""


@dataclass(frozen=True, slots=True)
class CorrectedMotions:
    """Motions without what sensors add to them.

    Attributes
    ----------
    motions : the motions without it
    turned : standard deviation of what the heading may lack for all that the log shows [rad]; 0 where it is right
    deviates : the compass does, so that no law of sway is learnt beside what a correction leaves of it
    notes : the same in words
    """

    motions: tuple[Motion, ...]
    turned: float
    deviates: bool
    notes: tuple[str, ...]


def correct_compass(motions: Sequence[Motion]) -> CorrectedMotions:
    """Find a compass deviation, and correct headings and velocities for it.

    What stays unknown of the deviation is left out of what is judged.
    """
    compass = compass_shown(motions)
    if compass.sound:
        return CorrectedMotions(tuple(motions), 0.0, False, ())
    turned = min(float(np.hypot(compass.size, compass.error)), UNKNOWN)
    deviates = compass.plain or compass.size > SOUND  # straight runs speak against it, if not for sure
    judged = [
        *(["heading and velocities are corrected"] if compass.plain else []),
        *(["no law of sway is judged"] if deviates else []),
        f"forces are judged beside a deviation of {np.degrees(turned):.1f} degrees",
    ]
    clear = (corrected(m, compass) for m in motions) if compass.plain else motions
    return CorrectedMotions(tuple(clear), turned, deviates, (f"{compass.sentence}; {', '.join(judged)}",))
