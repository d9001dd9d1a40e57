"""Drawings of a model's errors: scatter and histogram, the track coloured by error, spectra, heading, and regimes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, NullLocator, PercentFormatter
from numpy.typing import NDArray

from ....comparison.failing.features import round_number, splits
from ....comparison.failing.frequency import Frequency
from ....comparison.failing.rows import Array, acceleration_error, scene, squared
from ....comparison.failing.trends import Heading
from ....measurements.statistics.signals import running_mean
from ....physics.motion import AXES
from ....physics.presentation import MINUS, percent, unit_text
from ....residuals.scores import ACCELERATION_UNITS
from ....residuals.series import SeriesTable
from ..judged_pieces import ACCELERATIONS, MODELS
from ..markup import Html
from .svg import HEAT, PANEL, ROLES, Look, canvas, chart, drawn, panel

POINTS = 400  # of each model in a scatter
BINS = 31
"""Odd, so that the middle one holds what is hardly wrong at all."""


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
    with chart(PANEL, simplify=False) as axes:
        axes.plot([low, high], [low, high], color=ROLES["muted"], linewidth=1.0, dashes=(4, 3))
        for model in MODELS:
            predicted = rows[f"{name}_{model}"].to_numpy(float)
            seen = np.isfinite(predicted) & np.isfinite(measured)
            inside = seen & (predicted >= low) & (predicted <= high)
            outside += int(np.count_nonzero(seen & ~inside))
            _dots(axes, measured[inside][::stride], predicted[inside][::stride], model)
        axes.set(xlim=(low, high), ylim=(low, high), xlabel=f"measured [{unit}]", ylabel=f"predicted [{unit}]")
        axes.set_title(title)
        axes.locator_params(nbins=5)
        return drawn(axes, f"measured and predicted {axis} acceleration"), outside


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
    with chart((PANEL[0], 236)) as axes:
        for model, error, fill in zip(MODELS, errors, (0.25, 0.35), strict=True):
            counts, _ = np.histogram(np.clip(error, -reach, reach), edges)
            share = counts / max(error.size, 1)
            axes.stairs(share, edges, fill=True, color=ROLES[model], alpha=fill)
            axes.stairs(share, edges, color=ROLES[model], linewidth=1.6)
        axes.axvline(0.0, color=ROLES["muted"], linewidth=1.0, dashes=(4, 3))
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
        axes.set(xlim=(-reach, reach), ylim=(0.0, None), title=title)
        axes.set(xlabel=f"predicted less measured [{unit}]", ylabel="share of the time")
        axes.locator_params(nbins=5)
        return drawn(axes, f"error of the predicted {axis} acceleration")


def _dots(axes: Axes, across: Array, up: Array, model: str) -> None:
    """Points as one path of lines without length, whose round ends are dots: a third of the bytes of markers."""
    gap = np.full_like(across, np.nan)
    look: Look = {"color": ROLES[model], "linewidth": 3.4, "alpha": 0.55, "solid_capstyle": "round"}
    axes.plot(np.column_stack([across, across, gap]).ravel(), np.column_stack([up, up, gap]).ravel(), **look)


def _frame(measured: Array, predicted: list[Array]) -> tuple[float, float]:
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


_POINTS = 900
"""Points of a track that are drawn; more cannot be told apart."""
_SMOOTH = 1.0
"""Error on the map is the root mean square over so many seconds."""
_WIDTHS = (2.2, 2.6, 3.2, 4.0, 5.0, 6.2)
"""Width of the line by step of error, so that the map reads without colour."""

_RAISED = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")


def heat_steps(usual: float, errors: Sequence[Array]) -> Array:
    """The five bounds between six steps of error that a reader can remember, for several maps together.

    The last is the `usual` acceleration of the axis or a little more, so that noise, which is far below, stays pale
    however small all errors are; where errors are larger, it is what only one in fifty exceeds.
    """
    known = np.concatenate(errors)
    known = known[np.isfinite(known)]
    top = float(np.quantile(known, 0.98)) if known.size else 0.0
    step = round_number(0.999 * max(usual, top, 1e-9) / 5.0, (1.0, 2.0, 2.5, 5.0, 10.0))
    return step * np.arange(1, 6, dtype=np.float64)


def local_error(series: pd.DataFrame, model: str, axis: int) -> Array:
    """Size of the acceleration error of a model on an axis about every row, (n,), NaN at the edges."""
    stage = scene(SeriesTable.of(series), model)
    error = stage.error[:, axis]
    rows = max(1, round(_SMOOTH / stage.step))
    size = np.sqrt(np.maximum(running_mean(np.square(np.nan_to_num(error)), rows), 0.0))
    return np.where(np.isfinite(error), size, np.nan)


def error_map(series: pd.DataFrame, error: Array, bounds: Array, title: str, axis: int) -> Html:
    """The track of one log from above, east to the right, coloured and widened by the error on an axis.

    Parameters
    ----------
    series : rows of one log, in order
    error : (n,) size of the error [unit of the axis' acceleration]
    bounds : (5,) between the steps of colour
    """
    north, east = series["north"].to_numpy(float), series["east"].to_numpy(float)
    step = np.digitize(np.nan_to_num(error), bounds)
    stride = max(1, len(series) // _POINTS)
    rows = np.arange(0, len(series), stride)
    # A thinned row bears the worst of the rows that it stands for.
    level = np.array([step[k : k + stride].max() for k in rows])
    gap = np.flatnonzero(np.diff(scene(SeriesTable.of(series)).stretch[rows]) != 0)
    with chart((460, 400), (52, 28, 6, 46)) as axes:
        axes.plot(_broken(east[rows], gap), _broken(north[rows], gap), color=ROLES[HEAT[0]], lw=_WIDTHS[0])
        for k in range(1, len(HEAT)):
            x, y = _pieces(east[rows], north[rows], level == k, gap)
            if x.size:
                axes.plot(x, y, color=ROLES[HEAT[k]], linewidth=_WIDTHS[k])
        axes.plot(east[:1], north[:1], "o", color=ROLES["surface"], mec=ROLES["ink"], ms=6)
        axes.set_aspect("equal", adjustable="datalim")
        axes.locator_params(nbins=6)
        axes.set(xlabel="east [m]", ylabel="north [m]")
        axes.set_title(title, fontsize=12.5, weight="bold", pad=8)
        return drawn(axes, f"track coloured by {AXES[axis]} error, {title}")


def spectra(frequency: Sequence[Mapping[str, Frequency]], axis: str) -> Html:
    """Power spectra of the measured acceleration and of the errors before and after, on one axis."""
    with chart((320, 220), (54, 28, 8, 46)) as axes:
        first = frequency[0][axis]
        axes.loglog(first.hz, _positive(first.measured), color=ROLES["measured"], linewidth=4.0)
        for role, found in zip(("before", "after"), frequency, strict=False):
            axes.loglog(found[axis].hz, _positive(found[axis].error), color=ROLES[role], linewidth=1.8)
        axes.set_xlabel("frequency [Hz]", labelpad=3)
        axes.set_xticks([0.1, 1.0], ["0.1", "1"])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_minor_locator(NullLocator())
        low, high = np.log10(axes.get_ylim())
        powers = np.arange(np.ceil(low), np.floor(high) + 1, 2 if high - low > 3.0 else 1)
        axes.set_yticks(10.0**powers, ["10" + str(int(power)).translate(_RAISED) for power in powers])
        _title(axes, axis, first.unit)
        return drawn(axes, f"spectra of the {axis} acceleration and its error")


def by_heading(heading: Sequence[Mapping[str, Heading]], axis: str) -> Html:
    """Median error on headings near each direction, before and after, with the range of its middle half."""
    sectors = heading[0][axis].sectors
    with chart((320, 190), (54, 28, 8, 26)) as axes:
        places = np.arange(len(sectors))
        axes.axhline(0.0, color=ROLES["grid"], linewidth=1.4)
        for shift, role, found in zip((-0.15, 0.15), ("before", "after"), heading, strict=False):
            middle, spread = np.array([found[axis].mean, found[axis].spread], dtype=float)
            axes.vlines(places + shift, middle - spread, middle + spread, ROLES[role], linewidth=3.0, alpha=0.4)
            axes.plot(places + shift, middle, "o", color=ROLES[role], markersize=5)
        axes.set_xticks(places, sectors)
        axes.set_xlim(-0.6, len(sectors) - 0.4)
        axes.grid(visible=False, axis="x")
        axes.locator_params(axis="y", nbins=4)
        _title(axes, axis, ACCELERATION_UNITS[axis])
        return drawn(axes, f"{axis} error by heading")


def _title(axes: Axes, axis: str, unit: str, pad: int = 5) -> None:
    """An axis of the boat and a unit over a small drawing."""
    axes.set_title(f"{axis} [{unit_text(unit)}]", fontsize=11, color=ROLES["muted"], pad=pad)


def _broken(values: Array, gap: NDArray[np.intp]) -> Array:
    return np.insert(values, gap + 1, np.nan)


def _pieces(x: Array, y: Array, chosen: NDArray[np.bool_], gap: NDArray[np.intp]) -> tuple[Array, Array]:
    """The chosen points, each run of them as a line that reaches half-way to its neighbours, NaN between the runs."""
    points, found = np.stack([x, y]), [np.zeros((2, 0))]
    ends = np.flatnonzero(np.diff(chosen.astype(int)) | np.isin(np.arange(chosen.size - 1), gap)) + 1
    for part in np.split(np.arange(chosen.size), ends):
        if chosen[part[0]]:
            first, last = part[0], part[-1]
            before = first if first == 0 or first - 1 in gap else first - 1
            after = last if last == chosen.size - 1 or last in gap else last + 1
            start, stop = 0.5 * (points[:, first] + points[:, before]), 0.5 * (points[:, last] + points[:, after])
            found.append(np.column_stack([start, points[:, part], stop, [np.nan, np.nan]]))
    across, up = np.concatenate(found, axis=1)
    return across, up


def _positive(values: Sequence[float]) -> Array:
    """For a logarithmic axis: nothing where there is no power."""
    known = np.array(values, dtype=float)
    return np.where(known > 0.0, known, np.nan)


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
    records: list[tuple[object, ...]] = []
    for split in splits(table):
        squares, counts = _sums(error, split.codes, len(split.labels))
        for index, label in enumerate(split.labels):
            if not counts[index].any():
                continue
            for column, axis in enumerate(AXES):
                rows, total, square = int(counts[index, column]), squares[:, column].sum(), squares[index, column]
                share_of_rows = rows / max(int(counts[:, column].sum()), 1)
                low, high = split.edges[index : index + 2] if split.edges else (np.nan, np.nan)
                rmse = float(np.sqrt(square / rows)) if rows else np.nan
                share = float(square / total) if total > 0.0 else share_of_rows
                place = (split.by, label, low, high, axis, rows, share_of_rows)
                records.append((*place, rmse, ACCELERATION_UNITS[axis], share))
    return pd.DataFrame.from_records(records, columns=list(_COLUMNS))


def _sums(error: Array, codes: NDArray[np.intp], size: int) -> tuple[Array, Array]:
    """Sum of squares and count of finite errors per code, each of shape (size, 3)."""
    squares, counted = (
        np.column_stack([np.bincount(codes, column, size) for column in each.T]).astype(float)
        for each in (squared(error), np.isfinite(error))
    )
    return squares, counted


REGIME_TITLES = {"surge speed": "by surge speed [m/s]", "yaw rate": "by yaw rate [rad/s], starboard positive"}
REGIME_LABELS = {
    "thrusters idle": "idle",
    "thruster idle": "idle",
    "both thrusters ahead": "both\nahead",
    "all thrusters ahead": "all\nahead",
    "both thrusters astern": "both\nastern",
    "all thrusters astern": "all\nastern",
    "thrusters opposed to turn": "opposed,\nturning",
    "thrust against the motion": "against\nthe motion",
    **{f"{side}-{way}": f"{side}-\n{way}" for side in ("north", "south") for way in ("east", "west")},
}


def regime_bars(before: pd.DataFrame, after: pd.DataFrame) -> list[Html]:
    """Acceleration error by regime, before and after: one drawing per quantity, a row of bars per axis.

    Parameters
    ----------
    before, after : DataFrame
        Tables of `regime_table`; every drawing has the same scale per axis, so they can be compared.
    """
    largest = pd.concat([before, after]).groupby("axis")["rmse"].max()
    tops = (1.08 * largest.clip(lower=1e-12)).to_dict()
    quantities = pd.unique(before["by"])
    return [_regime_drawing(by, before[before["by"] == by], after[after["by"] == by], tops) for by in quantities]


def _regime_drawing(by: str, before: pd.DataFrame, after: pd.DataFrame, tops: Mapping[Any, float]) -> Html:
    width, left, tall, height = 460, 46, 62, 332
    with canvas(width, height) as figure:
        for row, (axis, rows) in enumerate(before.groupby("axis", sort=False)):
            axes = panel(figure, left, 46 + row * (tall + 22), width - left - 6, tall)
            places = np.arange(len(rows))
            axes.bar(places - 0.2, rows["rmse"], 0.38, color=ROLES["before"])
            # Of some regimes one model may know nothing.
            later = after[after["axis"] == axis].set_index("regime")["rmse"]
            axes.bar(places + 0.2, later.reindex(rows["regime"]), 0.38, color=ROLES["after"])
            axes.set(xlim=(-0.5, len(rows) - 0.5), ylim=(0.0, tops[axis]), xticks=[])
            axes.locator_params(axis="y", nbins=3)
            _title(axes, str(axis), rows["unit"].iloc[0], pad=4)
            if row == 2:
                _regime_labels(axes, rows)
        figure.text(2 / width, 1 - 16 / height, REGIME_TITLES.get(by, f"by {by}"), weight="bold", fontsize=12.5)
        return drawn(figure, f"acceleration error by {by}, before and after")


def _regime_labels(axes: Axes, rows: pd.DataFrame) -> None:
    """Edges between numeric bins, names under the others, and under each its share of the time."""
    under = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
    under |= {"ha": "center", "va": "top", "size": 10.5}
    numeric = bool(rows["low"].notna().all())
    if numeric:
        # Low enough that the first edge clears the zero of the axis beside it.
        for place, edge in enumerate([*rows["low"], rows["high"].iloc[-1]]):
            axes.annotate(f"{edge:g}".replace("-", MINUS), (place - 0.5, 0), (0, -9), **under)
    for place, (label, share) in enumerate(zip(rows["regime"], rows["share_of_rows"], strict=True)):
        if not numeric:
            axes.annotate(REGIME_LABELS.get(str(label), str(label)), (place, 0), (0, -4), linespacing=1.0, **under)
        axes.annotate(percent(share), (place, 0), (0, -23 if numeric else -32), color=ROLES["muted"], **under)
