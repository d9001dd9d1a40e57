"""What the figures draw, worked out from the run folder's tables: rollout pieces, held-out rows."""

import numpy as np
import pandas as pd

from ....comparison.failing.rows import ENOUGH_SECONDS

SHOWN_SECONDS = 120.0  # longest stretch of held-out motion drawn as lines
SHOWN_POINTS = 600  # points per line after thinning
ACCELERATIONS = {"surge": "u_dot", "sway": "v_dot", "yaw": "r_dot"}  # columns of the series
PREDICTED = ("u", "v", "r", "north", "east")


def held_out_stretch(series: pd.DataFrame) -> pd.DataFrame:
    """The first `SHOWN_SECONDS` of the longest held-out log; of the whole series when nothing is marked as held out."""
    test, _ = held_out_rows(series)
    longest = test["log"].value_counts(sort=False).idxmax()
    stretch = test[test["log"] == longest]
    return stretch[stretch["time"] <= stretch["time"].iloc[0] + SHOWN_SECONDS]


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
    """Thin a stretch for drawing, mark the restarts of its predictions and break their lines there.

    Parameters
    ----------
    series : DataFrame
        Rows of one log of `series.csv`, in order.

    Returns
    -------
    DataFrame
        The same columns with `restart` (bool); the predictions are NaN in an extra row before each restart, so that
        no line is drawn from the end of one rollout to the start of the next.
    """
    models = ("before", "after")
    gaps = [np.abs(series[f"{name}_{model}"] - series[name]) for name in PREDICTED for model in models]
    restart = np.max(gaps, axis=0) < 1e-9
    # Two neighbouring rows that agree are a boat at rest, not two rollouts.
    restart[1:] &= ~restart[:-1]
    stride = max(1, len(series) // SHOWN_POINTS)
    keep = restart | (np.arange(len(series)) % stride == 0)
    thinned = series.assign(restart=restart)[keep]
    breaks = thinned[thinned["restart"]].copy()
    breaks[[f"{name}_{model}" for name in PREDICTED for model in models]] = np.nan
    breaks["restart"] = False
    joined = pd.concat([breaks.assign(order=0), thinned.assign(order=1)])
    return joined.sort_values(["time", "order"], kind="stable").drop(columns="order").reset_index(drop=True)
