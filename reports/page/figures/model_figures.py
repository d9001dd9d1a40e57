"""Drawings of models: errors and laws, errors by horizon and step, speeds and tracks beside the measured ones."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from ....comparison.facts import ComparedModel
from ....physics.presentation import MINUS, finite, number, unit_text
from ....steering.closed_loop import PERFECT, ControlRecord, Passage
from ....steering.tracks import TRACKS
from ...run_contents import Rival
from ...wording import cut
from ..judged_pieces import rollouts
from ..markup import Html
from .svg import BESIDE, ROLES, Look, bare_rows, canvas, chart, drawn, panel, saved

ROW = 40
"""Height of a model [px]: its name, and marks above each other that can be told apart."""
WIDTH, LEFT, DOTS, GAP, CELL = 980, 196, 376, 66, 26
"""Of the figure, of the names, of the errors, between these and the laws, and of a law [px]: ten laws fit the width."""
LONGEST_NAME = 24  # letters that fit beside the marks
COLOURS = {"pass": ROLES["after"], "fail": ROLES["before"]}
SHAPES = {"pass": "o", "fail": "D"}


def trust(rivals: Sequence[Rival], horizon: str, best: str, of: str = "") -> Html:
    """One row a model: the position error of its predictions with the paired interval, then the laws, one a column.

    Parameters
    ----------
    rivals : best first
    horizon : of the predictions [s]
    best : the model to trust, in bold
    of : the run, where a page has more than one such drawing
    """
    laws = list(dict.fromkeys(law for rival in rivals for law in rival.laws))
    top = 132 if laws else 40
    height = top + ROW * len(rivals) + 44
    with canvas(WIDTH if laws else LEFT + DOTS + GAP, height) as figure:
        errors = panel(figure, LEFT, top, DOTS, ROW * len(rivals))
        _errors(errors, rivals, best)
        errors.set_xlabel(f"position error of {horizon} s predictions [m], logarithmic: left is better")
        if laws:
            _legend(panel(figure, LEFT, 0, DOTS, top - 24))
            _laws(panel(figure, LEFT + DOTS + GAP, top, CELL * len(laws), ROW * len(rivals)), rivals, laws)
        return drawn(figure, f"prediction error and laws kept by each model{f' of {of}' if of else ''}")


def _errors(axes: Axes, rivals: Sequence[Rival], best: str) -> None:
    known = [rival.score.position for rival in rivals if rival.score.position > 0.0]
    low, high = min(known, default=0.1), max(known, default=1.0)
    ends = [end for rival in rivals if rival.interval for end in rival.interval if end > 0.3 * low]
    low, high = min([low, *ends]) / 1.35, max([high, *ends]) * 1.35
    axes.set(xscale="log", xlim=(low, high), ylim=(len(rivals) - 0.5, -0.5), yticks=[])
    axes.grid(visible=False, axis="y")
    axes.minorticks_off()
    ticks = [base * 10.0**power for power in range(-6, 7) for base in (1, 2, 5) if low <= base * 10.0**power <= high]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    for row, rival in enumerate(rivals):
        strong = "bold" if rival.model.name == best else "normal"
        at_left: Look = {**BESIDE, "xycoords": axes.get_yaxis_transform(), "ha": "right"}
        axes.annotate(cut(rival.model.name, LONGEST_NAME), (0, row), (-12, 7), **at_left, weight=strong)
        axes.annotate(_about(rival), (0, row), (-12, -8), **at_left, color=ROLES["muted"], size=10)
        axes.axhline(row + 0.5, color=ROLES["grid"], lw=0.6)
        error, audit = rival.score.position, rival.model.audit
        text = number(error, 2, minus=MINUS, blank="diverged")
        if error > 0.0:
            if rival.interval:
                look: Look = {"color": COLOURS.get(audit, ROLES["muted"]), "lw": 6, "alpha": 0.35}
                axes.plot(np.clip(rival.interval, low, high), [row, row], **look)
            size = 7.0 + 1.6 * math.log10(1.0 + (rival.model.parameters or 0))
            axes.plot(error, row, SHAPES.get(audit, "o"), ms=size, **_look(audit))
            text += f" ({rival.score.diverged} of {rival.score.starts or 0} ran away)" * bool(rival.score.diverged)
        ends = [end for end in (rival.interval or ()) if end > 0.0]
        place = min(max([error, *ends]), high) if error > 0.0 else low
        inside = place < low * (high / low) ** 0.72
        place = place if inside else max(min([error, *ends]), low)
        shift, side = (11, "left") if inside else (-11, "right")
        axes.annotate(text, (place, row), (shift, 0), **BESIDE, ha=side, weight=strong)


def _legend(axes: Axes) -> None:
    """What the marks mean, above the errors."""
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axes.set_axis_off()
    for row, (audit, text) in enumerate((("pass", "keeps the laws"), ("fail", "breaks a law"), ("", "not asked"))):
        height = 0.62 - 0.26 * row
        axes.plot(0.02, height, SHAPES.get(audit, "o"), ms=9, **_look(audit))
        axes.annotate(text, (0.02, height), (12, 0), **BESIDE, color=ROLES["muted"])


def _look(audit: str) -> Look:
    """The colours of a mark by the verdict of the laws; hollow where no law was asked."""
    return {"color": COLOURS.get(audit, ROLES["surface"]), "mec": COLOURS.get(audit, ROLES["muted"]), "mew": 2.0}


def _about(rival: Rival) -> str:
    """The kind of the model, and how many numbers were fitted, or that they were to the rows that judge."""
    if rival.model.fitted_here:
        return f"{rival.model.kind}, fitted to these rows"
    if not rival.model.parameters:
        return rival.model.kind
    count = f"{rival.model.parameters:,}".replace(",", "\N{NO-BREAK SPACE}")
    return f"{rival.model.kind}, {count} fitted"


_VERDICTS: dict[str, Look] = {
    "fail": {"marker": "X", "ms": 13, "color": ROLES["before"], "mec": ROLES["surface"], "mew": 0.5},
    "noted": {"marker": "o", "ms": 8, "color": ROLES["surface"], "mec": ROLES["before"], "mew": 1.8},
    "pass": {"marker": "o", "ms": 6, "color": ROLES["after"]},
    "not applicable": {"marker": "_", "ms": 7, "color": ROLES["muted"], "mew": 1.5},
}
"""Marks of the verdicts on a law."""


def _laws(axes: Axes, rivals: Sequence[Rival], laws: Sequence[str]) -> None:
    """A grid of verdicts: a dot where the law is kept, a cross where it is broken, a ring where that is only noted."""
    bare_rows(axes, len(rivals), (-0.5, len(laws) - 0.5))
    axes.spines["left"].set_visible(False)
    for column, law in enumerate(laws):
        up: Look = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points"}
        axes.annotate(law, (column, 1.0), (-3, 8), **up, rotation=52, ha="left", va="bottom", size=10.5)
    for row, rival in enumerate(rivals):
        axes.axhline(row + 0.5, color=ROLES["grid"], lw=0.6)
        if not rival.laws:
            text = {"pass": "keeps the laws", "fail": "breaks a law"}.get(rival.model.audit, "not asked")
            axes.annotate(text, (0, row), (-8, 0), **BESIDE, color=ROLES["muted"])
        for column, law in enumerate(laws):
            if law in rival.laws:
                axes.plot(column, row, ls="", **_VERDICTS.get(rival.laws[law], _VERDICTS["not applicable"]))


GROWTH_HEIGHT = 360  # of the figure [px]
GROWTH_LINE = 20
"""Least distance between two names [px]."""
LONGEST_LABEL = 22  # letters that fit beside the lines, with the last error


def growth(models: Sequence[ComparedModel], ends: Sequence[str]) -> Html:
    """Position error by the length of predictions, both logarithmic: straight lines of one slope grow alike.

    Parameters
    ----------
    models : of which each has errors by horizon; an error that is not finite is left out
    ends : names of the model in the colour of *before* and of the one in that of *after*; the others are grey
    """
    colours = dict(zip(ends, (ROLES["before"], ROLES["after"]), strict=False))
    lines = []
    for model in models:
        found = [(float(key), model.rollout[key].position) for key in sorted(model.rollout, key=float)]
        known = [(seconds, error) for seconds, error in found if np.isfinite(error) and error > 0.0]
        lines += [(model, np.array(known).T)] if known else []
    lines.sort(key=lambda line: -line[1][1][-1])
    with chart((980, GROWTH_HEIGHT), (60, 12, 250, 48)) as axes:
        for model, (seconds, error) in lines:
            own = model.name in colours
            style = "-" if own else "--" if model.kind == "baseline" else ":"
            colour = colours.get(model.name, ROLES["muted"])
            axes.plot(seconds, error, style, color=colour, marker="o", ms=6, lw=2.5 if own else 1.5, zorder=2 + own)
        axes.set(xscale="log", yscale="log", xlabel="length of the prediction [s]", ylabel="position error [m]")
        ticks = sorted({seconds for _, line in lines for seconds in line[0]})
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.minorticks_off()
        tall = GROWTH_HEIGHT - 60
        up = axes.transData + axes.transAxes.inverted()
        at = [tall * float(up.transform((seconds[-1], error[-1]))[1]) for _, (seconds, error) in lines]
        for (model, (_, error)), place in zip(lines, _apart(at, tall), strict=True):
            text = f"{cut(model.name, LONGEST_LABEL)}, {number(error[-1], 2, minus=MINUS)} m"
            look: Look = {**BESIDE, "color": colours.get(model.name, ROLES["muted"])}
            look["weight"] = "bold" if model.name in colours else "normal"
            axes.annotate(text, (1.0, place / tall), (12, 0), xycoords="axes fraction", **look)
        return drawn(axes, "position error of each model by the length of its predictions")


def _apart(places: Sequence[float], tall: float) -> list[float]:
    """Heights from the top down that are `LINE` apart at least, each as near to its place as those above leave it."""
    found: list[float] = []
    for place in places:
        found.append(min(place, found[-1] - GROWTH_LINE) if found else place)
    lift = max(0.0, -min(found, default=0.0))
    return [min(place + lift, tall) for place in found] if len(found) * GROWTH_LINE <= tall else found


_LOOK: dict[Any, Any] = {"font.size": 10.0, "axes.spines.top": False, "axes.spines.right": False}
_WANTED, _FIRST, _PERFECT = "0.8", "tab:red", "0.15"
"""Colours of what was wanted, of the first model and of the perfect one, as in the plots of a run."""
_OTHERS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown")
_SIDE = 4.6
"""Width and height of a track [inch]: three of them beside each other fit a page."""
_ABREAST = 3
"""Tracks beside each other."""
_STRAIGHT = 1e-6
"""Turn of a track below which its plan says nothing [rad]: its error is then drawn over time."""


def track_figure(record: ControlRecord, passages: Mapping[tuple[str, str], Passage]) -> str:
    """The figure as SVG.

    Parameters
    ----------
    passages : by track and model
    """
    tracks = list(dict.fromkeys(result.track for result in record.results))
    wide = min(len(tracks), _ABREAST)
    tall = -(-len(tracks) // _ABREAST)
    with matplotlib.rc_context(_LOOK):
        figure = Figure(figsize=(_SIDE * wide, (_SIDE + 0.9) * tall), layout="constrained")
        FigureCanvasSVG(figure)
        for place, track in enumerate(tracks):
            _draw(figure.add_subplot(tall, wide, place + 1), record, track, passages)
        return saved(figure, "undertow control", Creator="undertow control")


def _draw(axes: Axes, record: ControlRecord, track: str, passages: Mapping[tuple[str, str], Passage]) -> None:
    rows = [result for result in record.results if result.track == track]
    points = passages[track, rows[0].model].track.at(passages[track, rows[0].model].time)
    plan = np.ptp(points[:, 2]) > _STRAIGHT
    if plan:
        axes.plot(points[:, 1], points[:, 0], color=_WANTED, lw=7.0, solid_capstyle="round", label="wanted")
    colours = iter(_OTHERS * len(rows))
    for place, row in enumerate(rows):
        done = passages[track, row.model]
        last = row.model == PERFECT
        colour = _FIRST if place == 0 else _PERFECT if last else next(colours)
        label = f"{row.model}: {row.merit.rmse:.2f} m"
        style = {"color": colour, "lw": 1.0 if last else 1.8, "ls": "--" if last else "-", "label": label}
        if plan:
            axes.plot(done.motion[:, 1], done.motion[:, 0], **style)
        else:
            axes.plot(done.time, np.hypot(*(done.motion[:, :2] - points[:, :2]).T), **style)
    axes.set_title(f"{track}: {TRACKS[track].about}", loc="left", fontsize=10.5)
    if plan:
        axes.set(xlabel="east [m]", ylabel="north [m]", aspect="equal", adjustable="datalim")
    else:
        axes.set(xlabel="time [s]", ylabel="distance from the wanted place [m]", ylim=(0.0, None))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), frameon=False, ncols=2, title="RMS distance from it")


SPEEDS = (("u", "surge speed", "m/s"), ("v", "sway speed", "m/s"), ("r", "yaw rate", "rad/s"))
POSITION = ("position", "distance of the predicted from the measured position", "m")
BAND: Look = {"color": ROLES["after"], "alpha": 0.2, "linewidth": 0.0}
LINES = (("measured", "", 5.0), ("before", "_before", 1.5), ("after", "_after", 1.5))
"""Name, ending of its columns and width of its line: measured is widest, so that it shows beneath what is near it."""


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
    with chart((width, height), (left, 30, 52, 4)) as axes:
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
        bare_rows(axes, len(values), (0.0, max(lengths.max(), 1e-12)))
        axes.set_yticks(range(len(values)))
        axes.tick_params(length=0.0)
        axes.figure.text(left / width, 1 - 18 / height, f"{title} [{unit_text(unit)}]", color=ROLES["muted"])
        return drawn(axes, f"{title} error after each step, {unit}")


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
            axes.set_title(f"{title} [{unit}]")
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
    # The measured line stays readable where a prediction runs away.
    low, high = runs[name].min(), runs[name].max()
    margin = max(0.6 * (high - low), 1e-3)
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, low - margin), min(top, high + margin))


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
    runs = rollouts(series)
    north, east = runs["north"].mean(), runs["east"].mean()
    with chart((460, 420), (56, 6, 6, 46)) as axes:
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
        return drawn(axes, "measured and predicted track")


def _discs(axes: Axes, runs: pd.DataFrame) -> None:
    """The disc that holds the position at the end of each prediction of the corrected model."""
    there = runs["north_after"].notna()
    ends = runs[there & ~there.shift(-1, fill_value=False)]
    for north, east, radius in ends[["north_after", "east_after", "position_band"]].dropna().to_numpy(dtype=float):
        axes.add_patch(Circle((east, north), radius, **BAND))
