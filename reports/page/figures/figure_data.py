"""What the figures draw, worked out from the run folder's tables: rollout pieces, held-out rows, coefficient rows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ....discovery.findings import FoundEffect
from ....physics.effects import BY_NAME
from ....physics.errors import VehicleError
from ....physics.vehicle import Vehicle

SHOWN_SECONDS = 120.0  # longest stretch of held-out motion drawn as lines
SHOWN_POINTS = 600  # points per line after thinning
ENOUGH_SECONDS = 60.0  # held-out motion shorter than this cannot fill the regimes
ACCELERATIONS = {"surge": "u_dot", "sway": "v_dot", "yaw": "r_dot"}  # columns of the series
PREDICTED = ("u", "v", "r", "north", "east")


@dataclass(frozen=True, slots=True)
class CoefficientRow:
    """One coefficient of a missing effect: before, after, and the 95 % interval of the value after [`unit`]."""

    symbol: str
    unit: str
    before: float
    after: float
    interval: tuple[float, float]


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


def coefficient_rows(
    candidates: Sequence[FoundEffect], missing: Sequence[str], nominal: Vehicle, corrected: Vehicle
) -> list[CoefficientRow]:
    """The coefficients of the missing effects; an interval of an added amount is shifted by the nominal value."""
    rows = []
    for candidate in candidates:
        if candidate.effect not in missing:
            continue
        effect = BY_NAME.get(candidate.effect)
        for term in candidate.terms:
            symbol, value = term.symbol, term.value
            low, high = term.ci95 or (np.nan, np.nan)
            before, after = vehicle_value(nominal, symbol), vehicle_value(corrected, symbol)
            shift = before if effect is not None and effect.added else 0.0
            after = after if np.isfinite(after) else value + shift
            interval = (low + shift, high + shift) if np.isfinite([low, high]).all() else (after, after)
            if np.isfinite([before, after]).all():
                rows.append(CoefficientRow(symbol, term.unit, before, after, interval))
    return rows


def vehicle_value(vehicle: Vehicle, symbol: str) -> float:
    """A vehicle's value of a symbol; NaN when it has no such parameter."""
    try:
        return vehicle.value(symbol)
    except VehicleError:
        return float("nan")
