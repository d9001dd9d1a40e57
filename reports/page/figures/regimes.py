"""The acceleration error of a model sorted by speed, turn rate, command and heading, as the page draws it."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ....comparison.failing.bins import splits
from ....comparison.failing.rows import acceleration_error, scene
from ....physics.frames import AXES
from ....residuals.scores import ACCELERATION_UNITS
from ....residuals.series_table import SeriesTable

_COLUMNS = ("by", "regime", "low", "high", "axis", "rows", "share_of_rows", "rmse", "unit", "share_of_error")
"""Of a table of regimes, which a log that never moved leaves without rows."""


def regime_table(series: pd.DataFrame, model: str = "before") -> pd.DataFrame:
    """The acceleration error of a model by regime.

    Parameters
    ----------
    series : DataFrame
        Rows of `series.csv`, all of them or the held-out ones.
    model : {'before', 'after'}
        The nominal or the corrected model. Its error at the ends of a stretch, where the filter errs, does not count.

    Returns
    -------
    DataFrame
        One row per quantity (`by`), `regime` and `axis`, with `low` and `high` (NaN unless numeric), `rows`,
        `share_of_rows`, `rmse` [`unit`] and `share_of_error` (of the squared error of that axis; sums to one over
        the regimes of a quantity). Regimes without rows are left out.
    """
    table = SeriesTable.of(series)
    error = scene(table, model).error
    if not np.isfinite(error).any():
        error = acceleration_error(table, model)  # stretches so short that they are all edge
    records: list[dict[str, object]] = []
    for split in splits(table):
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
    return pd.DataFrame.from_records(records, columns=list(_COLUMNS))


def _sums(
    error: NDArray[np.float64], codes: NDArray[np.intp], size: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum of squares and count of finite errors per code, each of shape (size, 3)."""
    usable = np.isfinite(error)
    squares = np.square(np.where(usable, error, 0.0))
    total = [np.bincount(codes, squares[:, column], size) for column in range(3)]
    count = [np.bincount(codes, usable[:, column], size) for column in range(3)]
    return np.column_stack(total).astype(np.float64), np.column_stack(count).astype(np.float64)
