"""Folds: stretches of the logs that a model is judged on, and that no fit and no selection of it has seen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from .dataset import DataSet
from .idle import active
from .split import LEAST_PIECE, filtered

_MOST, _LEAST = 4, 2
"""Folds: with four, three quarters of a log tell nearly what all of it tells, and each costs a fit."""
_SECONDS = 12.0
"""Least length of a fold where there are more than two [s]: it holds predictions of 10 s."""
JUDGED = 7200.0
"""Seconds of a long log that are judged: two hours tell an error as ten do, and their tables stay small."""
_SLACK = 1.2
"""Times as much that is judged as it is: pieces do not add up to the limit exactly."""
_PIECE = 300.0
"""Length of the pieces of a long log that are judged [s]: many predictions of 30 s."""
_EDGE = 1e-6
"""By how much stamps of one instant may differ [s]."""


@dataclass(frozen=True, slots=True)
class Fold:
    """Stretches of the logs: the source of each, its begin and its end [s]."""

    stretches: tuple[tuple[str, float, float], ...]

    def holds(self, motion: Motion) -> bool:
        """Whether a motion lies in it from beginning to end."""
        begin, end = motion.time[0] + _EDGE, motion.time[-1] - _EDGE
        return any(source == motion.source and start <= begin and end <= stop for source, start, stop in self.stretches)

    def touched(self, source: str, begin: Array, end: Array) -> np.ndarray:
        """Which of some spans of a log (n,) [s] reach into it."""
        found = np.zeros(begin.shape, bool)
        for name, start, stop in self.stretches:
            if name == source:
                found |= (begin < stop - _EDGE) & (end > start + _EDGE)
        return found


def folds_of(motions: Sequence[Motion]) -> tuple[Fold, ...]:
    """Cut motions into two to four parts of one length, in the order in which they come: of many logs, whole ones."""
    ends = np.cumsum([0.0, *(motion.duration for motion in motions)])
    count = int(np.clip(ends[-1] // _SECONDS, _LEAST, _MOST))
    edges = np.linspace(0.0, ends[-1], count + 1)
    edges[-1] = np.inf
    return tuple(Fold(tuple(_within(motions, ends, low, high))) for low, high in pairwise(edges))


def _within(motions: Sequence[Motion], ends: Array, low: float, high: float) -> Iterator[tuple[str, float, float]]:
    for motion, begun in zip(motions, ends[:-1], strict=True):
        start, stop = max(low, begun) - begun, min(high - begun, motion.duration)
        if stop - start > _EDGE:
            yield motion.source, float(motion.time[0] + start), float(motion.time[0] + stop)


def cut(data: DataSet, folds: Sequence[Fold], vehicle: Vehicle) -> DataSet:
    """The motions cut where folds begin and end, without idle rows; each piece is filtered as the recipe says.

    Of many hours, pieces that are spread evenly over them. Notes tell what is left out.
    """
    driven, told = [active(motion, vehicle) for motion in data.raw], []
    idle = sum(float((~rows).sum()) * motion.time_step for motion, rows in zip(data.raw, driven, strict=True))
    pieces = [piece for motion, rows in zip(data.raw, driven, strict=True) for piece in _pieces(motion, folds, rows)]
    if not pieces:  # a boat that only drifts is judged as it drifts
        pieces = [piece for m in data.raw for piece in _pieces(m, folds, np.ones(m.time.size, bool))]
    elif idle >= 1.0:
        told.append(f"{idle:.0f} s in which nothing is commanded are not judged")
    seconds = sum(piece.duration for piece in pieces)
    if seconds > _SLACK * JUDGED:
        pieces = _spread(pieces)
        told.append(
            f"models are judged on {len(pieces)} pieces spread evenly over this long log, "
            f"{sum(piece.duration for piece in pieces) / 60.0:.0f} of its {seconds / 60.0:.0f} min"
        )
    return filtered(tuple(pieces), (*data.notes, *told), data.recipe)


def _spread(motions: Sequence[Motion]) -> list[Motion]:
    """Pieces of motions, evenly spread over them, that add up to what is judged of a long log."""
    short: list[Motion] = []
    for motion in motions:
        edges = np.linspace(0, motion.time.size, max(1, round(motion.duration / _PIECE)) + 1).round().astype(int)
        short += [motion.slice(start, stop) for start, stop in pairwise(edges.tolist())]
    count = min(len(short), round(JUDGED / _PIECE))
    return [short[k] for k in np.linspace(0, len(short) - 1, count).round().astype(int)]


def _pieces(motion: Motion, folds: Sequence[Fold], judged: np.ndarray) -> Iterator[Motion]:
    times = {t for fold in folds for source, *ends in fold.stretches if source == motion.source for t in ends}
    rows = np.searchsorted(motion.time, sorted(t - _EDGE for t in times))
    turns = np.flatnonzero(np.diff(judged)) + 1
    for start, stop in pairwise(np.unique([0, *rows.tolist(), *turns.tolist(), motion.time.size]).tolist()):
        if judged[start] and (stop - start - 1) * motion.time_step >= LEAST_PIECE:
            yield motion.slice(start, stop)
