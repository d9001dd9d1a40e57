"""Division of logs: train, validation and test in order of time, cross-validation folds, and idle rows left out.

Each part is filtered after the cut, so that none sees rows of another. A boat that nobody drives only drifts, and says
nothing of how it answers.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from ...physics.errors import LogError
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from .prepare import DataSet, Recipe, filtered

PARTS = ("train", "validation", "test")
LEAST_PIECE = 1.0
"""A piece shorter than this [s] is dropped: it holds no more than the ends of a filter."""


@dataclass(frozen=True, slots=True)
class Split:
    """Three data sets that share no sample and no filter window."""

    train: DataSet
    validation: DataSet
    test: DataSet


def split(data: DataSet, recipe: Recipe | None = None) -> Split:
    """Divide each log of a data set in the order of time, by the shares and the guard of its recipe.

    The first share of the usable seconds of *every* log is for training, the next for validation, the last for test.
    The guard is dropped around each boundary, half on either side. If the recipe has a cutoff, each piece is filtered
    on its own, from the unfiltered motions, so no value of one part reaches another.

    Parameters
    ----------
    recipe : in the place of that of the data, for motions that were left without the filter that it asks for

    Raises
    ------
    LogError
        when a part with a positive share ends up with no motion.
    """
    recipe = recipe or data.recipe
    pieces: dict[str, list[Motion]] = {part: [] for part in PARTS}
    dropped = 0.0
    for _, group in groupby(data.raw, key=lambda motion: motion.source):
        dropped += _divide(tuple(group), recipe, pieces)
    for part, share in zip(PARTS, recipe.shares, strict=True):
        if share > 0 and not pieces[part]:
            raise LogError(
                f"expected motion for the {part} part ({share:.0%} of each log), got none from {data.seconds:.1f} s "
                f"with a guard of {recipe.guard:g} s. Give a longer log, other shares or a shorter guard."
            )
    shares = "/".join(f"{100 * share:.0f}" for share in recipe.shares)
    notes = [*data.notes, f"split: chronological {shares} of each log, guard {recipe.guard:g} s"]
    if dropped:
        notes.append(f"split: pieces under {LEAST_PIECE:g} s dropped, {dropped:.1f} s in all")
    return Split(*(filtered(tuple(pieces[part]), tuple(notes), recipe) for part in PARTS))


def _divide(motions: tuple[Motion, ...], recipe: Recipe, pieces: dict[str, list[Motion]]) -> float:
    """Cut the motions of one log; the clock counts usable seconds only, so that gaps do not shift the shares."""
    total = sum(motion.duration for motion in motions)
    ends = total * np.cumsum(recipe.shares)
    half = 0.5 * recipe.guard
    dropped = 0.0
    for part, low, high in zip(PARTS, (0.0, *ends[:-1]), ends, strict=True):
        low = low + half if low > 0 else low
        high = high - half if high < total - 1e-9 else np.inf
        begun = 0.0
        for motion in motions:
            clock = begun + motion.time - motion.time[0]
            begun += motion.duration
            start, stop = np.searchsorted(clock, (low - 1e-9, high - 1e-9))
            seconds = (stop - start - 1) * motion.time_step
            if seconds >= LEAST_PIECE:
                pieces[part].append(motion.slice(int(start), int(stop)))
            elif stop > start:
                dropped += max(seconds, 0.0)
    return dropped


IDLE = 8.0
"""Time without any command after which rows are idle [s]: before, a boat still slows down."""
_IDLE_COMMAND = 0.03
"""Share of full command that is none: trim and rounding of a stick at neutral."""


def active(motion: Motion, vehicle: Vehicle, idle: float = IDLE) -> np.ndarray:
    """True on rows with a command within the last `idle` seconds, (n,).

    Parameters
    ----------
    motion : with commands
    vehicle : whose neutral commands count as none
    idle : [s]
    """
    commands = motion.commands if motion.run_up is None else np.concatenate([motion.run_up, motion.commands])
    sizes = [np.abs(t.curve.normalised(commands[:, k], t.command)) for k, t in enumerate(vehicle.thrusters)]
    on = np.max(sizes, axis=0) > _IDLE_COMMAND
    row = np.arange(on.size)
    last = np.maximum.accumulate(np.where(on, row, -np.inf))
    return (row - last <= idle / motion.time_step)[on.size - motion.time.size :]


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
        """True when a motion lies in it from beginning to end."""
        begin, end = motion.time[0] + _EDGE, motion.time[-1] - _EDGE
        return any(source == motion.source and start <= begin and end <= stop for source, start, stop in self.stretches)

    def touched(self, source: str, begin: Array, end: Array) -> np.ndarray:
        """Which of some spans of a log (n,) [s] reach into it.

        Parameters
        ----------
        source : the log
        begin, end : of the spans (n,) [s]
        """
        result = np.zeros(begin.shape, bool)
        for name, start, stop in self.stretches:
            if name == source:
                result |= (begin < stop - _EDGE) & (end > start + _EDGE)
        return result


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

    Parameters
    ----------
    data : prepared, unfiltered
    folds : that cut
    vehicle : whose commands tell idle rows
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
