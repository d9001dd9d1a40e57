"""What the figures draw, worked out from the run folder's tables: rollout pieces, held-out rows."""

import numpy as np
import pandas as pd

from ....comparison.failing.rows import ENOUGH_SECONDS

SHOWN_SECONDS = 120.0  # longest stretch of held-out motion drawn as lines
SHOWN_POINTS = 600  # points per line after thinning
ACCELERATIONS = {"surge": "u_dot", "sway": "v_dot", "yaw": "r_dot"}  # columns of the series
PREDICTED = ("u", "v", "r", "north", "east")
MODELS = ("before", "after")
_GAP = 0.5  # share of a step by which rows are farther apart, or nearer, where a record is interrupted


def liveliest_stretch(series: pd.DataFrame) -> pd.DataFrame:
    """The `SHOWN_SECONDS` of a log with the most motion, from a start of predictions on.

    Held-out rows, or all where none is marked as held out. The motion is the sum of the squared speeds, each in units
    of its mean square over these rows.
    """
    test, _ = held_out_rows(series)
    speeds = test[["u", "v", "r"]].to_numpy() ** 2
    motion = (speeds / np.maximum(speeds.mean(axis=0), 1e-12)).sum(axis=1)
    starts, log, time = restarts(test), test["log"].to_numpy(), test["time"].to_numpy()
    found = [(0.0, test[log == log[0]])]
    for one in pd.unique(log):
        rows = np.flatnonzero(log == one)
        first = rows[starts[rows]] if starts[rows].any() else rows[:1]
        until = rows[0] + np.searchsorted(time[rows], time[first] + SHOWN_SECONDS, "right")
        total = np.concatenate([[0.0], np.cumsum(motion)])
        worth = total[until] - total[first]
        best = int(np.argmax(worth))
        found.append((float(worth[best]), test.iloc[first[best] : until[best]]))
    return max(found, key=lambda pair: pair[0])[1]


def held_out_rows(series: pd.DataFrame) -> tuple[pd.DataFrame, bool]:
    """The rows that no fit saw, and True; the whole series and False when nothing is marked as held out."""
    test = series[series["part"] == "test"]
    return (series, False) if test.empty else (test, True)


def regime_rows(series: pd.DataFrame) -> tuple[pd.DataFrame, bool]:
    """The rows for the map of errors, and whether they are held out: the test rows when they last `ENOUGH_SECONDS`."""
    test = series[series["part"] == "test"]
    step = float(np.median(np.diff(series["time"]))) if len(series) > 1 else 0.0
    return (test, True) if len(test) * step >= ENOUGH_SECONDS else (series, False)


def rollouts(series: pd.DataFrame) -> pd.DataFrame:
    """Thin a stretch for drawing, mark the restarts of its predictions and break lines there and at gaps.

    Parameters
    ----------
    series : DataFrame
        Rows of one log of `series.csv`, in order.

    Returns
    -------
    DataFrame
        The same columns with `restart` (bool); the predictions are NaN in an extra row before each restart, so that
        no line is drawn from the end of one rollout to the start of the next, and what was measured is NaN there, too,
        where the record has a gap.
    """
    restart, time = restarts(series), series["time"].to_numpy()
    step = float(np.median(np.diff(time))) if len(series) > 1 else 0.0
    gap = interrupted(time, step)
    stride = max(1, len(series) // SHOWN_POINTS)
    keep = restart | gap | np.append(gap[1:], True) | (np.arange(len(series)) % stride == 0)  # and the row before a gap
    thinned = series.assign(restart=restart, gap=gap)[keep]
    breaks = thinned[thinned["restart"] | thinned["gap"]].copy()
    breaks[[f"{name}_{model}" for name in PREDICTED for model in MODELS]] = np.nan
    breaks.loc[breaks["gap"], list(PREDICTED)] = np.nan
    breaks["restart"] = False
    joined = pd.concat([breaks.assign(order=0), thinned.assign(order=1)])
    return joined.sort_values(["time", "order"], kind="stable").drop(columns=["order", "gap"]).reset_index(drop=True)


def interrupted(time: np.ndarray, step: float) -> np.ndarray:
    """Rows (n,) that do not follow the row before in time."""
    return np.append(False, np.abs(np.diff(time) - step) > _GAP * step)


def restarts(series: pd.DataFrame) -> np.ndarray:
    """Rows (n,) at which the predictions of both models are put back on the measurement."""
    gaps = [np.abs(series[f"{name}_{model}"] - series[name]) for name in PREDICTED for model in MODELS]
    restart = np.max(gaps, axis=0) < 1e-9
    # Two neighbouring rows that agree are a boat at rest, not two rollouts.
    restart[1:] &= ~restart[:-1]
    return restart
