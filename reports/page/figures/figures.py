"""The figures of the report: matplotlib drawings as inline SVG whose colours are the page's CSS variables."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from ....discovery.effect_findings import EffectFinding
from ....physics.presentation import MINUS, finite, number, percent, unit_text, words
from ...sureness import BACK, CoefficientRow, comes_back, odds, worth
from ..judged_pieces import rollouts
from ..markup import Html
from .svg import ROLES, Look, canvas, drawn, panel

SPEEDS = (("u", "surge speed", "m/s"), ("v", "sway speed", "m/s"), ("r", "yaw rate", "rad/s"))
POSITION = ("position", "distance of the predicted from the measured position", "m")
BAND: Look = {"color": ROLES["after"], "alpha": 0.2, "linewidth": 0.0}
LINES = (("measured", "", 5.0), ("before", "_before", 1.5), ("after", "_after", 1.5))
"""Name, ending of its columns and width of its line: measured is widest, so that it shows beneath what is near it."""
BESIDE: Look = {"xycoords": "data", "textcoords": "offset points", "va": "center"}
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


def step_bars(title: str, unit: str, values: Sequence[Any], names: Sequence[str] | None = None) -> Html:
    """Horizontal bars, one per step of the correction, the nominal model on top.

    Parameters
    ----------
    title, unit : str
        What is measured, and its unit.
    values : sequence
        One error per step, in `unit`; null where the rollout diverged.
    names : sequence of str, optional
        The step names; bare step numbers without them.
    """
    left, width = (214, 472) if names else (22, 162)
    height = 34 + 27 * len(values)
    with canvas(width, height) as figure:
        axes = panel(figure, left, 30, width - left - 52, height - 34)
        shown = np.array([finite(value) for value in values])
        lengths = np.nan_to_num(shown)
        colours = [ROLES["before"], *[ROLES["between"]] * (len(values) - 2), ROLES["after"]][: len(values)]
        axes.barh(np.arange(len(values)), lengths, height=0.62, color=colours)
        for index, value in enumerate(shown):
            strong = "bold" if index in (0, len(values) - 1) else "normal"
            text = number(value, 2, minus=MINUS, blank="diverged")
            axes.annotate(text, (lengths[index], index), (5, 0), **BESIDE, weight=strong)
            if names:
                axes.annotate(names[index], (0, index), (-24, 0), **BESIDE, ha="right", weight=strong)
        axes.set(
            ylim=(len(values) - 0.5, -0.5), xlim=(0.0, max(lengths.max(), 1e-12)), xticks=[], yticks=range(len(values))
        )
        axes.grid(visible=False)
        axes.tick_params(length=0.0)
        axes.spines["bottom"].set_visible(False)
        figure.text(left / width, 1 - 18 / height, f"{title} [{unit_text(unit)}]", color=ROLES["muted"])
        return drawn(figure, f"{title} error after each step, {unit}")


def speeds(series: pd.DataFrame) -> Html:
    """Measured and predicted speeds over time and the error of the position, predictions restarted every 10 s.

    With the band of the corrected model, where the series has it.
    """
    width, height, left, tall = 960, 650, 52, 124
    runs = rollouts(series)
    with canvas(width, height) as figure:
        for row, (name, title, unit) in enumerate((*SPEEDS, POSITION)):
            axes = panel(figure, left, 22 + row * (tall + 32), width - left - 16, tall)
            if (name, title, unit) == POSITION:
                _position_error(axes, runs)
            else:
                _speed(axes, runs, name)
            restarts = runs.loc[runs["restart"], "time"]
            axes.vlines(restarts, 0, 1, ROLES["muted"], (0, (1, 3)), transform=axes.get_xaxis_transform(), lw=0.9)
            axes.set_xlim(runs["time"].min(), runs["time"].max())
            axes.grid(visible=False, axis="x")
            axes.set_title(f"{title} [{unit}]", loc="left", fontsize=12, pad=6)
            axes.locator_params(axis="y", nbins=5)
            if row < len(SPEEDS):
                axes.set_xticklabels([])
        axes.set_xlabel("time in the log [s]")
        return drawn(figure, "measured and predicted speeds and the error of the position over time")


def _speed(axes: Axes, runs: pd.DataFrame, name: str) -> None:
    if f"{name}_band" in runs:
        middle, half = runs[f"{name}_after"], runs[f"{name}_band"]
        axes.fill_between(runs["time"], middle - half, middle + half, **BAND)
    for role, suffix, thickness in LINES:
        axes.plot(runs["time"], runs[f"{name}{suffix}"], color=ROLES[role], linewidth=thickness)
    _limit(axes, runs, name)


def _position_error(axes: Axes, runs: pd.DataFrame) -> None:
    """How far the predicted positions are from the measured one; the frame holds the corrected model and its band."""
    if "position_band" in runs:
        axes.fill_between(runs["time"], 0.0, runs["position_band"].where(runs["u_after"].notna()), **BAND)
    for role, suffix, thickness in LINES[1:]:
        error = np.hypot(runs[f"north{suffix}"] - runs["north"], runs[f"east{suffix}"] - runs["east"])
        axes.plot(runs["time"], error, color=ROLES[role], linewidth=thickness)
    shown = [error, runs["position_band"]] if "position_band" in runs else [error]
    axes.set_ylim(0.0, max(1.1 * max(float(np.nanmax(one, initial=0.0)) for one in shown), 1e-3))


def track(series: pd.DataFrame) -> Html:
    """Measured and predicted track, east to the right and north up, predictions restarted every 10 s."""
    width, height = 460, 420
    runs = rollouts(series)
    north, east = runs["north"].mean(), runs["east"].mean()
    with canvas(width, height) as figure:
        axes = panel(figure, 56, 6, width - 62, height - 52)
        if "position_band" in runs:
            _discs(axes, runs)
        for role, suffix, thickness in LINES:
            axes.plot(runs[f"east{suffix}"], runs[f"north{suffix}"], color=ROLES[role], linewidth=thickness)
        starts = runs[runs["restart"]]
        axes.plot(starts["east"], starts["north"], "o", color=ROLES["surface"], mec=ROLES["ink"], ms=6)
        span = max(np.ptp(runs["north"].dropna()), np.ptp(runs["east"].dropna()), 1.0)
        # A diverged prediction must not shrink the boat's own track to a dot.
        axes.set_aspect("equal", adjustable="datalim")
        if max(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())) > 3.0 * span:
            ratio = axes.bbox.width / axes.bbox.height
            wide, high = span * max(ratio, 1.0), span * max(1.0 / ratio, 1.0)
            axes.set(xlim=(east - wide, east + wide), ylim=(north - high, north + high))
        axes.locator_params(nbins=6)
        axes.set(xlabel="east [m]", ylabel="north [m]")
        return drawn(figure, "measured and predicted track")


def _discs(axes: Axes, runs: pd.DataFrame) -> None:
    """The disc that holds the position at the end of each prediction of the corrected model."""
    there = runs["north_after"].notna()
    ends = runs[there & ~there.shift(-1, fill_value=False)]
    for north, east, radius in ends[["north_after", "east_after", "position_band"]].dropna().to_numpy(dtype=float):
        axes.add_patch(Circle((east, north), radius, **BAND))


def regime_bars(before: pd.DataFrame, after: pd.DataFrame) -> list[Html]:
    """Acceleration error by regime, before and after: one drawing per quantity, a row of bars per axis.

    Parameters
    ----------
    before, after : DataFrame
        Tables of `regimes.regime_table`; every drawing has the same scale per axis, so they can be compared.
    """
    tops = {axis: 1.08 * max(before_rows["rmse"].max(), 1e-12) for axis, before_rows in before.groupby("axis")}
    for axis, rows in after.groupby("axis"):
        tops[axis] = max(tops[axis], 1.08 * rows["rmse"].max())
    return [
        _regime_drawing(by, before[before["by"] == by], after[after["by"] == by], tops)
        for by in pd.unique(before["by"])
    ]


def _regime_drawing(by: str, before: pd.DataFrame, after: pd.DataFrame, tops: Mapping[Any, float]) -> Html:
    width, left, tall, height = 460, 46, 62, 332
    with canvas(width, height) as figure:
        for row, (axis, rows) in enumerate(before.groupby("axis", sort=False)):
            axes = panel(figure, left, 46 + row * (tall + 22), width - left - 6, tall)
            places = np.arange(len(rows))
            axes.bar(places - 0.2, rows["rmse"], 0.38, color=ROLES["before"])
            later = after[after["axis"] == axis].set_index("regime")[
                "rmse"
            ]  # of some regimes one model may know nothing
            axes.bar(places + 0.2, later.reindex(rows["regime"]), 0.38, color=ROLES["after"])
            axes.set(xlim=(-0.5, len(rows) - 0.5), ylim=(0.0, tops[axis]), xticks=[])
            axes.locator_params(axis="y", nbins=3)
            title = f"{axis} [{unit_text(rows['unit'].iloc[0])}]"
            axes.set_title(title, loc="left", fontsize=11, color=ROLES["muted"], pad=4)
            if row == 2:
                _regime_labels(axes, rows)
        figure.text(2 / width, 1 - 16 / height, REGIME_TITLES.get(by, f"by {by}"), weight="bold", fontsize=12.5)
        return drawn(figure, f"acceleration error by {by}, before and after")


def _regime_labels(axes: Axes, rows: pd.DataFrame) -> None:
    """Edges between numeric bins, names under the others, and under each its share of the time."""
    under = {
        "xycoords": ("data", "axes fraction"),
        "textcoords": "offset points",
        "ha": "center",
        "va": "top",
        "size": 10.5,
    }
    numeric = bool(rows["low"].notna().all())
    if numeric:
        # Low enough that the first edge clears the zero of the axis beside it.
        for place, edge in enumerate([*rows["low"], rows["high"].iloc[-1]]):
            axes.annotate(f"{edge:g}".replace("-", MINUS), (place - 0.5, 0), (0, -9), **under)
    for place, (label, share) in enumerate(zip(rows["regime"], rows["share_of_rows"], strict=True)):
        if not numeric:
            axes.annotate(REGIME_LABELS.get(str(label), str(label)), (place, 0), (0, -4), linespacing=1.0, **under)
        axes.annotate(percent(share), (place, 0), (0, -23 if numeric else -32), color=ROLES["muted"], **under)


def ranked_effects(candidates: Sequence[EffectFinding], most: int = 12) -> Html:
    """The best-ranked effects that the log can judge, by the share of the unseen error that comes back without each.

    A missing effect is strong blue, a likely one faint, a possible one in the corrected model has a rim alone.
    """
    shown = sorted([item for item in candidates if not item.cannot_tell][:most], key=worth, reverse=True)
    left, width, height = 190, 460, 34 + 24 * len(shown)
    drops = np.nan_to_num([worth(item) for item in shown])
    with canvas(width, height) as figure:
        axes = panel(figure, left, 30, width - left - 122, height - 34)
        fill, rim = zip(*map(_bar_colours, shown), strict=True) if shown else ((), ())
        bars = np.arange(len(shown)), np.maximum(drops, 0.0)
        axes.barh(*bars, height=0.56, color=fill, edgecolor=rim, linewidth=1.6)
        for index, item in enumerate(shown):
            edge: Look = {**BESIDE, "xycoords": axes.get_yaxis_transform(), "ha": "right"}
            bold: Look = {**edge, "weight": "bold" if item.in_model else "normal"}
            axes.annotate(words(item.effect), (0, index), (-8, 0), **bold)
            axes.annotate(comes_back(item), (1, index), (58, 0), **bold)
            axes.annotate(odds(item), (1, index), (120, 0), color=ROLES["muted"], **edge)
        axes.set(ylim=(len(shown) - 0.5, -0.5), xlim=(0.0, max(drops.max(initial=0.0), 1e-9)), xticks=[], yticks=[])
        axes.grid(visible=False)
        axes.spines["bottom"].set_visible(False)
        for place, text in ((-64, BACK), (-2, "sure")):
            figure.text(1 + place / width, 1 - 18 / height, text, ha="right", color=ROLES["muted"], size=11)
        return drawn(figure, "effects by the unseen force error that comes back without them, and how sure they are")


def _bar_colours(item: EffectFinding) -> tuple[str, str]:
    """Filling and rim of a bar."""
    if item.verdict in ("missing", "likely"):
        colour = ROLES["after" if item.verdict == "missing" else "likely"]
        return colour, colour
    plain = ROLES["between" if item.verdict == "possible" else "grid"]
    return (ROLES["surface"], ROLES["after"]) if item.in_model else (plain, plain)


def coefficients(rows: Sequence[CoefficientRow]) -> Html:
    """Coefficients before and after, with 95 % intervals of the value after; each row on its own scale from zero."""
    width, height = 460, 8 + 52 * len(rows)
    with canvas(width, height) as figure:
        axes = panel(figure, 2, 4, width - 4, height - 8)
        lowest = highest = 0.0
        for index, row in enumerate(rows):
            reach = max(abs(value) for value in (row.before, row.after, *row.interval)) or 1.0
            before, after, band = row.before / reach, row.after / reach, np.array(row.interval) / reach
            lowest, highest = min(lowest, before, after, *band), max(highest, before, after, *band)
            axes.plot([before, after], [index, index], color=ROLES["muted"], lw=1.0)
            axes.plot(band, [index, index], color=ROLES["after"], lw=7, alpha=0.4)
            axes.plot(before, index, "o", color=ROLES["surface"], mec=ROLES["before"], mew=2.0, ms=8)
            axes.plot(after, index, "o", color=ROLES["after"], ms=8)
            edge: Look = {"xycoords": axes.get_yaxis_transform()}
            change = f"{number(row.before, minus=MINUS)} \N{RIGHTWARDS ARROW} {number(row.after, minus=MINUS)}"
            axes.annotate(row.symbol, (0, index), (2, 20), **BESIDE | edge, weight="bold")
            axes.annotate(f"{change} {unit_text(row.unit)}", (1, index), (-2, 20), **BESIDE | edge, ha="right")
        axes.axvline(0.0, color=ROLES["grid"], lw=1.2, zorder=0)
        margin = 0.05 * (highest - lowest)
        axes.set(ylim=(len(rows) - 0.65, -0.65), xlim=(lowest - margin, highest + margin), xticks=[], yticks=[])
        axes.grid(visible=False)
        axes.spines[:].set_visible(False)
        return drawn(figure, "coefficients before and after with 95 % intervals")


def _limit(axes: Axes, runs: pd.DataFrame, name: str) -> None:
    """Keep the measured line readable where a prediction runs away."""
    low, high = runs[name].min(), runs[name].max()
    margin = max(0.6 * (high - low), 1e-3)
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, low - margin), min(top, high + margin))
