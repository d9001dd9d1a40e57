"""Where a model fails: its acceleration error sorted by speed, turn rate, command and heading, and the worst places."""

from collections.abc import Iterator
from itertools import combinations_with_replacement, product
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .splits import Split, splits
from .wording import ACCELERATION_UNITS, AXES

ACCELERATIONS = ("u_dot", "v_dot", "r_dot")


def acceleration_error(series: pd.DataFrame, model: str = "before") -> NDArray[np.float64]:
    """Modelled minus measured acceleration, shape (rows, 3) [m/s^2, m/s^2, rad/s^2], NaN where either is missing."""
    return np.column_stack(
        [series[f"{name}_{model}"].to_numpy(float) - series[name].to_numpy(float) for name in ACCELERATIONS]
    )


def regime_table(series: pd.DataFrame, model: str = "before") -> pd.DataFrame:
    """The acceleration error of a model by regime.

    Parameters
    ----------
    series : DataFrame
        Rows of `series.csv`, all of them or the held-out ones.
    model : {'before', 'after'}
        The nominal or the corrected model.

    Returns
    -------
    DataFrame
        One row per quantity (`by`), `regime` and `axis`, with `low` and `high` (NaN unless numeric), `rows`,
        `share_of_rows`, `rmse` [`unit`] and `share_of_error` (of the squared error of that axis; sums to one over
        the regimes of a quantity). Regimes without rows are left out.
    """
    error = acceleration_error(series, model)
    records: list[dict[str, Any]] = []
    for split in splits(series):
        squares, counts = _sums(error, split.codes, len(split.labels))
        for index, label in enumerate(split.labels):
            if not counts[index].any():
                continue
            for column, axis in enumerate(AXES):
                rows, total = int(counts[index, column]), squares[:, column].sum()
                share_of_rows = rows / max(int(counts[:, column].sum()), 1)
                records.append(
                    {
                        "by": split.by,
                        "regime": label,
                        "low": split.edges[index] if split.edges else np.nan,
                        "high": split.edges[index + 1] if split.edges else np.nan,
                        "axis": axis,
                        "rows": rows,
                        "share_of_rows": share_of_rows,
                        "rmse": float(np.sqrt(squares[index, column] / rows)) if rows else np.nan,
                        "unit": ACCELERATION_UNITS[axis],
                        "share_of_error": float(squares[index, column] / total) if total > 0.0 else share_of_rows,
                    }
                )
    return pd.DataFrame.from_records(records)


def failures(series: pd.DataFrame, model: str = "before", *, limit: int = 4) -> list[dict[str, Any]]:
    """The few regimes that hold far more of the squared acceleration error than of the time.

    A place is a range of surge speed or yaw rate, a state of the thrusters, both together, or a range of headings. It
    is named when it holds at least 1.5 times as much of an axis' squared error as of the rows, and a tenth more; axes
    that the model predicts badly come first, and a place that repeats an earlier one is passed over.

    Parameters
    ----------
    series : DataFrame
        Rows of `series.csv`, all of them or the held-out ones.
    model : {'before', 'after'}
        The nominal or the corrected model.
    limit : int
        How many places to name at most; at most two of them on one axis.

    Returns
    -------
    list of dict
        Worst first: `model`, `where` (words with numbers), `axis`, `share_of_error`, `share_of_rows`, `rows`, `rmse`
        with its `unit`.
    """
    error = acceleration_error(series, model)
    measured = series[list(ACCELERATIONS)].to_numpy(float)
    with np.errstate(invalid="ignore"):
        spread = np.sqrt(_mean(np.square(measured - _mean(measured))))
        badness = np.minimum(np.sqrt(_mean(np.square(error))) / np.maximum(spread, 1e-12), 1.0)
    candidates = sorted(_candidates(error, splits(series), badness), key=lambda place: (-place[0], place[2]))
    found: list[dict[str, Any]] = []
    taken = np.zeros(error.shape, bool)
    for _, column, where, parts in candidates:
        if len(found) == limit:
            break
        axis = AXES[column]
        if sum(place["axis"] == axis for place in found) == 2:
            continue
        usable = np.isfinite(error[:, column])
        inside = np.logical_and.reduce([_inside(split, first, last) for split, first, last in parts]) & usable
        squares = np.square(np.where(usable, error[:, column], 0.0))
        if squares[inside & taken[:, column]].sum() > 0.5 * squares[inside].sum():
            continue
        taken[:, column] |= inside
        found.append(
            {
                "model": model,
                "where": where,
                "axis": axis,
                "share_of_error": round(float(squares[inside].sum() / squares.sum()), 4),
                "share_of_rows": round(float(inside.sum() / usable.sum()), 4),
                "rows": int(inside.sum()),
                "rmse": round(float(np.sqrt(squares[inside].mean())), 6),
                "unit": ACCELERATION_UNITS[axis],
            }
        )
    return found


def _candidates(
    error: NDArray[np.float64], by: tuple[Split, ...], badness: NDArray[np.float64]
) -> Iterator[tuple[float, int, str, list[tuple[Split, int, int]]]]:
    speed, rate, command, heading = by
    states = len(command.labels)
    for split in (speed, rate):
        size = len(split.labels)
        squares, counts = _sums(error, split.codes * states + command.codes, size * states)
        squares, counts = squares.reshape(size, states, 3), counts.reshape(size, states, 3)
        for first, last in combinations_with_replacement(range(size), 2):
            ranged = (split, first, last)
            if last - first + 1 < size:
                window = squares[first : last + 1].sum((0, 1)), counts[first : last + 1].sum((0, 1))
                yield from _scored(*window, squares.sum((0, 1)), counts.sum((0, 1)), badness, [ranged])
                for state in range(states):
                    window = squares[first : last + 1, state].sum(0), counts[first : last + 1, state].sum(0)
                    parts = [ranged, (command, state, state)]
                    yield from _scored(*window, squares.sum((0, 1)), counts.sum((0, 1)), badness, parts)
    for split, widest in ((command, 1), (heading, 4)):
        size = len(split.labels)
        squares, counts = _sums(error, split.codes, size)
        for first, width in product(range(size), range(1, widest + 1)):
            chosen = np.arange(first, first + width) % size
            window = squares[chosen].sum(0), counts[chosen].sum(0)
            parts = [(split, first, first + width - 1)]
            yield from _scored(*window, squares.sum(0), counts.sum(0), badness, parts)


def _scored(
    squares: NDArray[np.float64],
    counts: NDArray[np.float64],
    all_squares: NDArray[np.float64],
    all_counts: NDArray[np.float64],
    badness: NDArray[np.float64],
    parts: list[tuple[Split, int, int]],
) -> Iterator[tuple[float, int, str, list[tuple[Split, int, int]]]]:
    for column in range(3):
        if all_squares[column] <= 0.0:
            continue
        of_error, of_rows = squares[column] / all_squares[column], counts[column] / all_counts[column]
        # A place described by two quantities must earn the longer sentence.
        excess = of_error - of_rows - 0.03 * (len(parts) - 1)
        if 0.02 <= of_rows <= 0.5 and of_error >= 1.5 * of_rows and excess >= 0.1:
            where = ", ".join(split.phrase(first, last) for split, first, last in parts)
            yield float(excess * badness[column]), column, where, parts


def _inside(split: Split, first: int, last: int) -> NDArray[np.bool_]:
    return (split.codes - first) % len(split.labels) <= last - first


def _mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
    usable = np.isfinite(values)
    return np.where(usable, values, 0.0).sum(0) / np.maximum(usable.sum(0), 1)


def _sums(
    error: NDArray[np.float64], codes: NDArray[np.intp], size: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum of squares and count of finite errors per code, each of shape (size, 3)."""
    usable = np.isfinite(error)
    squares = np.square(np.where(usable, error, 0.0))
    total = [np.bincount(codes, squares[:, column], size) for column in range(3)]
    count = [np.bincount(codes, usable[:, column], size) for column in range(3)]
    return np.column_stack(total).astype(np.float64), np.column_stack(count).astype(np.float64)
