"""Drawings of measured against predicted acceleration: a scatter and a histogram of the error for each axis."""

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter
from numpy.typing import NDArray

from ....physics.in_words import unit_text
from ....residuals.scores import ACCELERATION_UNITS
from ..markup import Html
from .figure_data import ACCELERATIONS, MODELS
from .svg import ROLES, STYLE, Look, canvas, drawn, panel

POINTS = 400  # of each model in a scatter
BINS = 31
"""Odd, so that the middle one holds what is hardly wrong at all."""
SIZE = (318, 300)
"""Width and height of a panel [px]: three stand beside each other on the page."""
Floats = NDArray[np.float64]


def scatter(rows: pd.DataFrame, axis: str, title: str) -> tuple[Html, int]:
    """Measured acceleration across, predicted up, before and after; and how many points lie outside the frame.

    Parameters
    ----------
    rows : of `series.csv`
    axis : surge, sway or yaw
    title : told above the drawing
    """
    name, unit = ACCELERATIONS[axis], unit_text(ACCELERATION_UNITS[axis])
    measured = rows[name].to_numpy(float)
    stride = scatter_stride(rows)
    low, high = _frame(measured, [rows[f"{name}_{model}"].to_numpy(float) for model in MODELS])
    outside = 0
    with matplotlib.rc_context({**STYLE, "path.simplify": False}):
        width, height = SIZE
        figure = canvas(width, height)
        axes = panel(figure, 58, 26, width - 66, height - 72)
        axes.plot([low, high], [low, high], color=ROLES["muted"], linewidth=1.0, dashes=(4, 3))
        for model in MODELS:
            predicted = rows[f"{name}_{model}"].to_numpy(float)
            seen = np.isfinite(predicted) & np.isfinite(measured)
            inside = seen & (predicted >= low) & (predicted <= high)
            outside += int(np.count_nonzero(seen & ~inside))
            _dots(axes, measured[inside][::stride], predicted[inside][::stride], model)
        axes.set(xlim=(low, high), ylim=(low, high), xlabel=f"measured [{unit}]", ylabel=f"predicted [{unit}]")
        axes.locator_params(nbins=5)
        axes.set_title(title, loc="left", fontsize=12, pad=6)
        return drawn(figure, f"measured and predicted {axis} acceleration"), outside


def scatter_stride(rows: pd.DataFrame) -> int:
    """Every how many-th row is drawn as a point."""
    return max(1, len(rows) // POINTS)


def histogram(rows: pd.DataFrame, axis: str, title: str) -> Html:
    """How often the predicted acceleration is wrong by how much, before and after, in bins of equal width.

    What lies beyond the outermost bins is counted in them.
    """
    name, unit = ACCELERATIONS[axis], unit_text(ACCELERATION_UNITS[axis])
    errors = [(rows[f"{name}_{model}"] - rows[name]).to_numpy(float) for model in MODELS]
    errors = [error[np.isfinite(error)] for error in errors]
    reach = max((float(np.quantile(np.abs(error), 0.99)) for error in errors if error.size), default=0.0) or 1e-9
    edges = np.linspace(-reach, reach, BINS + 1)
    with matplotlib.rc_context(STYLE):
        width, height = SIZE[0], 236
        figure = canvas(width, height)
        axes = panel(figure, 58, 26, width - 66, height - 72)
        for model, error, fill in zip(MODELS, errors, (0.25, 0.35), strict=True):
            counts, _ = np.histogram(np.clip(error, -reach, reach), edges)
            share = counts / max(error.size, 1)
            axes.stairs(share, edges, fill=True, color=ROLES[model], alpha=fill)
            axes.stairs(share, edges, color=ROLES[model], linewidth=1.6)
        axes.axvline(0.0, color=ROLES["muted"], linewidth=1.0, dashes=(4, 3))
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
        axes.set(xlim=(-reach, reach), xlabel=f"predicted less measured [{unit}]", ylabel="share of the time")
        axes.set_ylim(bottom=0.0)
        axes.locator_params(nbins=5)
        axes.set_title(title, loc="left", fontsize=12, pad=6)
        return drawn(figure, f"error of the predicted {axis} acceleration")


def _dots(axes: Axes, across: Floats, up: Floats, model: str) -> None:
    """Points as one path of lines without length, whose round ends are dots: a third of the bytes of markers."""
    gap = np.full_like(across, np.nan)
    look: Look = {"color": ROLES[model], "linewidth": 3.4, "alpha": 0.55, "solid_capstyle": "round"}
    axes.plot(np.column_stack([across, across, gap]).ravel(), np.column_stack([up, up, gap]).ravel(), **look)


def _frame(measured: Floats, predicted: list[Floats]) -> tuple[float, float]:
    """Ends that hold all that was measured, and nearly all of the predictions unless they run far away."""
    known = measured[np.isfinite(measured)]
    if not known.size:
        return -1.0, 1.0
    low, high = float(known.min()), float(known.max())
    reach = max(high - low, 1e-6)
    for values in predicted:
        ends = np.quantile(values[np.isfinite(values)], (0.01, 0.99)) if np.isfinite(values).any() else (low, high)
        low, high = min(low, float(ends[0])), max(high, float(ends[1]))
    middle = 0.5 * (float(known.min()) + float(known.max()))
    low, high = max(low, middle - 1.5 * reach), min(high, middle + 1.5 * reach)
    margin = 0.04 * (high - low)
    return low - margin, high + margin
