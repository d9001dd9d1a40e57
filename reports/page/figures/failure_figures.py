"""Drawings of where models fail: the track coloured by error, spectra, and the error by heading."""

from collections.abc import Mapping, Sequence

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.ticker import NullFormatter, NullLocator
from numpy.typing import NDArray

from ....comparison.failing.frequency import Frequency
from ....comparison.failing.heading import Heading
from ....comparison.failing.rows import Array, scene
from ....measurements.statistics.running import running_mean
from ....physics.frames import AXES
from ....physics.in_words import unit_text
from ....residuals.scores import ACCELERATION_UNITS
from ....residuals.series_table import SeriesTable
from ..markup import Html
from .svg import HEAT, ROLES, STYLE, canvas, drawn, panel

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
    raw = max(usual, top, 1e-9) / 5.0
    power = float(10.0 ** np.floor(np.log10(raw)))
    nice = next(nice for nice in (1.0, 2.0, 2.5, 5.0, 10.0) if nice * power >= raw * 0.999)
    return np.asarray(nice * power * np.arange(1, 6), dtype=float)


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
    width, height = 460, 400
    north, east = series["north"].to_numpy(float), series["east"].to_numpy(float)
    step = np.digitize(np.nan_to_num(error), bounds)
    stride = max(1, len(series) // _POINTS)
    rows = np.arange(0, len(series), stride)
    # A thinned row bears the worst of the rows that it stands for.
    level = np.array([step[k : k + stride].max() for k in rows])
    gap = np.flatnonzero(np.diff(scene(SeriesTable.of(series)).stretch[rows]) != 0)
    with matplotlib.rc_context(STYLE):
        figure = canvas(width, height)
        axes = panel(figure, 52, 28, width - 58, height - 74)
        axes.plot(_broken(east[rows], gap), _broken(north[rows], gap), color=ROLES[HEAT[0]], lw=_WIDTHS[0])
        for k in range(1, len(HEAT)):
            x, y = _pieces(east[rows], north[rows], level == k, gap)
            if x.size:
                axes.plot(x, y, color=ROLES[HEAT[k]], linewidth=_WIDTHS[k])
        axes.plot(east[:1], north[:1], "o", color=ROLES["surface"], mec=ROLES["ink"], ms=6)
        axes.set_aspect("equal", adjustable="datalim")
        axes.locator_params(nbins=6)
        axes.set(xlabel="east [m]", ylabel="north [m]")
        axes.set_title(title, loc="left", fontsize=12.5, weight="bold", pad=8)
        return drawn(figure, f"track coloured by {AXES[axis]} error, {title}")


def spectra(frequency: Sequence[Mapping[str, Frequency]], axis: str) -> Html:
    """Power spectra of the measured acceleration and of the errors before and after, on one axis."""
    width, height = 320, 220
    with matplotlib.rc_context(STYLE):
        figure = canvas(width, height)
        axes = panel(figure, 54, 28, width - 62, height - 74)
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
        axes.set_title(f"{axis} [{unit_text(first.unit)}]", loc="left", fontsize=11, color=ROLES["muted"], pad=5)
        return drawn(figure, f"spectra of the {axis} acceleration and its error")


def by_heading(heading: Sequence[Mapping[str, Heading]], axis: str) -> Html:
    """Median error on headings near each direction, before and after, with the range of its middle half."""
    width, height = 320, 190
    sectors = heading[0][axis].sectors
    with matplotlib.rc_context(STYLE):
        figure = canvas(width, height)
        axes = panel(figure, 54, 28, width - 62, height - 54)
        places = np.arange(len(sectors))
        axes.axhline(0.0, color=ROLES["grid"], linewidth=1.4)
        for shift, role, found in zip((-0.15, 0.15), ("before", "after"), heading, strict=False):
            middle = np.array([np.nan if value is None else value for value in found[axis].mean])
            spread = np.array([np.nan if value is None else value for value in found[axis].spread])
            axes.vlines(places + shift, middle - spread, middle + spread, ROLES[role], linewidth=3.0, alpha=0.4)
            axes.plot(places + shift, middle, "o", color=ROLES[role], markersize=5)
        axes.set_xticks(places, sectors)
        axes.set_xlim(-0.6, len(sectors) - 0.4)
        axes.grid(visible=False, axis="x")
        axes.locator_params(axis="y", nbins=4)
        unit = unit_text(ACCELERATION_UNITS[axis])
        axes.set_title(f"{axis} [{unit}]", loc="left", fontsize=11, color=ROLES["muted"], pad=5)
        return drawn(figure, f"{axis} error by heading")


def _broken(values: Array, gap: NDArray[np.intp]) -> Array:
    return np.insert(values, gap + 1, np.nan)


def _pieces(x: Array, y: Array, chosen: NDArray[np.bool_], gap: NDArray[np.intp]) -> tuple[Array, Array]:
    """The chosen points, each run of them as a line that reaches half-way to its neighbours, NaN between the runs."""
    found_x: list[Array] = []
    found_y: list[Array] = []
    ends = np.flatnonzero(np.diff(chosen.astype(int)) | np.isin(np.arange(chosen.size - 1), gap)) + 1
    for part in np.split(np.arange(chosen.size), ends):
        if chosen[part[0]]:
            for values, found in ((x, found_x), (y, found_y)):
                first, last = part[0], part[-1]
                start = values[first] if first == 0 or first - 1 in gap else 0.5 * (values[first] + values[first - 1])
                stop = (
                    values[last] if last == chosen.size - 1 or last in gap else 0.5 * (values[last] + values[last + 1])
                )
                found.append(np.concatenate([[start], values[part], [stop, np.nan]]))
    if not found_x:
        return np.zeros(0), np.zeros(0)
    return np.concatenate(found_x), np.concatenate(found_y)


def _positive(values: Sequence[float]) -> Array:
    """For a logarithmic axis: nothing where there is no power."""
    known = np.array(values, dtype=float)
    return np.where(known > 0.0, known, np.nan)
