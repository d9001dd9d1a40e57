"""Drawings of several boats and runs: the hull diary, and one number of several runs side by side."""

from collections.abc import Callable, Sequence
from datetime import date
from math import isfinite

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter, date2num, num2date
from matplotlib.ticker import MaxNLocator

from ....physics.presentation import MINUS, number, unit_text
from ... import hull_diary
from ...wording import cut, interval
from ..fleet import Relation, SharedNumber
from ..markup import Html, element
from .svg import BESIDE, ROLES, Look, bare_rows, beside, canvas, chart, drawn, panel

LINE, LEFT, WIDTH, RIGHT, FOOT = 26, 120, 1060, 24, 34
"""Height of a boat, left edge, width of the strip and room at its right, height of its dates [px]."""
_LETTER = 6.0
"""Width of a letter in the name of a change, with what stands about it [px]."""
_DOT = "a1.7 1.7 0 1 0 3.4 0a1.7 1.7 0 1 0-3.4 0"
"""A dot, from its left end."""
WIDE, TALL, _LEFT = 330, 168, 46
"""Size of the drawing of a parameter, and the left edge of its axis [px]."""


def strip(diary: hull_diary.DiaryFacts, boats: Sequence[hull_diary.BoatRecord]) -> Html:
    """A line a boat: a tick for each day that it logged, a bar since a change, its cause, and the day of the alarm."""
    height = LINE * len(boats) + FOOT
    with canvas(WIDTH, height) as figure:
        axes = panel(figure, LEFT, 4, WIDTH - LEFT - RIGHT, LINE * len(boats))
        first, last = min(_at(boat.first) for boat in boats), max(_at(boat.last) for boat in boats)
        for row, boat in enumerate(boats):
            days = sorted({_at(one.day) for parameter in boat.parameters for one in parameter.rows})
            axes.plot(days, np.full(len(days), row), "|", color=ROLES["measured"], ms=9, mew=1.1)
            odd = [_at(one.day) for one in boat.odd_days]
            axes.plot(odd, np.full(len(odd), row), "o", color=ROLES["before"], ms=8, mfc="none", mew=1.6)
            for k, change in enumerate(boat.changes):
                end = _at(boat.changes[k + 1].first) if k + 1 < len(boat.changes) else _at(boat.last)
                _bar(axes, row, change, end)
            _names(axes, row, boat.changes, (first, last))
            weight = "bold" if boat.changes else "normal"
            beside(axes, cut(boat.boat, 16), row, -8, ha="right", weight=weight)
        margin = max(0.01 * (last - first), 0.5)
        axes.set(ylim=(len(boats) - 0.5, -0.5), xlim=(first - margin, last + margin), yticks=[])
        _dates(axes, 10)
        axes.spines["left"].set_visible(False)
        return drawn(figure, f"the days of {len(diary.boats)} boats and what changed")


def _bar(axes: Axes, row: int, change: hull_diary.ChangeRecord, end: float) -> None:
    first = _at(change.first)
    axes.plot([_at(change.earliest), _at(change.latest)], [row, row], color=ROLES["before"], lw=2.5, alpha=0.55)
    axes.fill_between([first, max(end, first + 0.5)], row - 0.3, row + 0.3, color=ROLES["before"], alpha=0.25, lw=0)
    axes.plot([first, first], [row - 0.38, row + 0.38], color=ROLES["before"], lw=2.5)
    axes.plot(_at(change.alarm), row, "o", color=ROLES["before"], ms=5.5)


def _names(axes: Axes, row: int, changes: Sequence[hull_diary.ChangeRecord], ends: tuple[float, float]) -> None:
    """The names and sizes of changes, on whichever side of their marks there is room; the latest first."""
    beside: Look = {**BESIDE, "size": 10.5}
    box = {"boxstyle": "square,pad=0.15", "facecolor": ROLES["surface"], "edgecolor": "none", "alpha": 0.85}
    taken: list[tuple[float, float]] = []
    for change in reversed(changes):
        text = f"{hull_diary.causes_words(change)} {hull_diary.signed(hull_diary.telling(change).share.value)}"
        wide = _LETTER * (len(text) + 2) * (ends[1] - ends[0]) / (WIDTH - LEFT - RIGHT)
        right, left = max(_at(change.alarm), _at(change.latest)), _at(change.earliest)
        places = {"left": (right, right + wide), "right": (left - wide, left)}
        free = {
            side: low >= ends[0] and high <= ends[1]
            for side, (low, high) in places.items()
            if all(high <= begin or low >= end for begin, end in taken)
        }
        if not free or (taken and not any(free.values())):
            continue  # a name over another would hide both; the sentences have it
        side = next((side for side, inside in free.items() if inside), "right")
        place = right if side == "left" else left
        axes.annotate(text, (place, row), (9 if side == "left" else -9, 0), ha=side, bbox=box, **beside)
        taken.append(places[side])


def course(boat: hull_diary.BoatRecord, one: hull_diary.BoatParameter, fleet: hull_diary.FleetParameter) -> Html:
    """A parameter over the days of a boat: its days with their intervals, the boats' band, and where it changed.

    Written by hand: a fleet has hundreds of these, and each is a few marks of one kind.
    """
    days = np.array([_at(row.day) for row in one.rows])
    low, value, high = (np.array([getattr(row.seen, end) for row in one.rows]) for end in ("low", "value", "high"))
    mean, spread = fleet.mean.value, fleet.spread.value
    band = np.array([mean - 2.0 * spread, mean + 2.0 * spread]) if np.isfinite(mean + spread) else value[:0]
    bottom, top = float(low.min()), float(high.max())  # of the boat: the band of a fleet may be far wider
    margin = 0.05 * (top - bottom) or 1.0
    first, last = _at(boat.first), _at(boat.last)
    along = _scaled((first, last + 1.0), (_LEFT, WIDE - 8.0))
    up = _scaled((bottom - margin, top + margin), (TALL - 26.0, 26.0))
    parts: list[Html] = []
    for tick in MaxNLocator(4).tick_values(bottom, top):
        if bottom <= tick <= top:
            parts.append(_path(f"M{_LEFT:.1f} {up(tick):.1f}H{WIDE - 8.0:.1f}", "grid", 0.6))
            parts.append(_text(_LEFT - 6.0, up(tick) + 4.0, f"{tick:g}".replace("-", MINUS), "end"))
    if band.size:
        edges = sorted(up(min(max(float(end), bottom - margin), top + margin)) for end in band)
        parts.append(_box(_LEFT, edges[0], WIDE - 8.0 - _LEFT, edges[1] - edges[0], "measured", 0.3))
    for change in boat.changes:
        edges = [along(_at(change.earliest)), along(_at(change.latest) + 1.0)]
        parts.append(_box(edges[0], 26.0, edges[1] - edges[0], TALL - 52.0, "before", 0.2))
        parts.append(_path(f"M{along(_at(change.first)):.1f} 26V{TALL - 26}", "before", 1.6))
    bars = (f"M{along(d + 0.5):.1f} {up(b):.1f}V{up(t):.1f}" for d, b, t in zip(days, low, high, strict=True))
    dots = (f"M{along(d + 0.5) - 1.7:.1f} {up(v):.1f}{_DOT}" for d, v in zip(days, value, strict=True))
    parts += [_path("".join(bars), "after", 1.1, 0.3), element("path", d="".join(dots), fill="var(--after)")]
    for place, anchor in ((first, "start"), (last, "end")):
        date_text = num2date(place).strftime("%d %b %Y").lstrip("0")
        parts.append(_text(along(place) if anchor == "start" else WIDE - 8.0, TALL - 8.0, date_text, anchor))
    unit = unit_text(fleet.unit)
    title = f"{hull_diary.plain(one.name)}{f' [{unit}]' if unit else ''}{': differs' if one.differs else ''}"
    parts.append(_text(0.0, 14.0, title, "start", "ink", "600"))
    label = f"{hull_diary.plain(one.name)} of {boat.boat} by day"
    return element("svg", *parts, viewBox=f"0 0 {WIDE} {TALL}", role="img", aria_label=label)


def _scaled(ends: tuple[float, float], pixels: tuple[float, float]) -> Callable[[float], float]:
    (low, high), (first, last) = ends, pixels
    return lambda value: first + (float(value) - low) / (high - low) * (last - first)


def _path(data: str, role: str, width: float, opacity: float = 1.0) -> Html:
    look = {"stroke": f"var(--{role})", "stroke-width": f"{width}", "stroke-opacity": f"{opacity}"}
    return element("path", d=data, fill="none", stroke_linecap="round", **look)


def _box(left: float, top: float, width: float, height: float, role: str, opacity: float) -> Html:
    place = {"x": f"{left:.1f}", "y": f"{top:.1f}", "width": f"{width:.1f}", "height": f"{height:.1f}"}
    return element("rect", **place, fill=f"var(--{role})", fill_opacity=f"{opacity}")


def _text(left: float, base: float, text: str, anchor: str, role: str = "muted", weight: str = "400") -> Html:
    look = {"font-size": "11.5", "font-weight": weight, "text-anchor": anchor, "fill": f"var(--{role})"}
    return element("text", text, x=f"{left:.1f}", y=f"{base:.1f}", font_family="var(--font)", **look)


def _dates(axes: Axes, most: int) -> None:
    axes.xaxis_date()
    first, last = axes.get_xlim()
    locator = AutoDateLocator(minticks=4 if last - first > 7.0 else 2, maxticks=most)  # two months are no scale
    axes.xaxis.set_major_locator(locator)
    formats = ["%Y", "%b", "%d %b", "%H:%M", "%H:%M", "%S.%f"]
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator, formats=formats, show_offset=False))


def _at(day: str) -> float:
    return float(date2num(date.fromisoformat(day)))


RUNS_LINE, RUNS_HEAD, RUNS_LEFT, RUNS_WIDTH, RUNS_RIGHT = 22, 30, 84, 440, 190
"""Height of a run and of the head above it, left edge of the axis, width of the figure, room for numbers [px]."""
_LONGEST = 10
"""Letters of a run's name that fit beside the axis."""


def side_by_side(shared: SharedNumber, names: Sequence[str]) -> Html:
    """A number, one row a run: value (dot) and 95 % interval (band), or the file's value (ring) where it is not found.

    Parameters
    ----------
    shared : as `shared_numbers` finds it
    names : of the runs
    """
    height = RUNS_HEAD + RUNS_LINE * len(names) + 10
    with chart((RUNS_WIDTH, height), (RUNS_LEFT, RUNS_HEAD, RUNS_RIGHT, 10)) as axes:
        unit = unit_text(shared.unit)
        head = f"{shared.symbol} {f'[{unit}]' if unit else ''}".strip()
        axes.figure.text(0.0, 1.0 - 18 / height, head, weight="bold")
        axes.figure.text(1.0, 1.0 - 18 / height, shared.relation.value, ha="right", color=ROLES["muted"])
        _draw(axes, shared, names)
        return drawn(axes, f"{shared.symbol} in each run: {shared.relation.value}")


def _draw(axes: Axes, shared: SharedNumber, names: Sequence[str]) -> None:
    bands = [(one.number.ci95 or (one.number.value,) * 2) for one in shared.held if one]
    ends = [end for band in bands for end in band] + [one.number.value for one in shared.held if one]
    ends += [value for value, one in zip(shared.filed, shared.held, strict=True) if one is None and isfinite(value)]
    margin = 0.08 * (max(ends) - min(ends)) or 0.1 * abs(ends[0]) or 0.1
    if shared.relation is Relation.SAME:
        low, high = max(low for low, _ in bands), min(high for _, high in bands)
        axes.axvspan(low, max(low, high), color=ROLES["measured"], alpha=0.35, lw=0)
    for index, (name, one) in enumerate(zip(names, shared.held, strict=True)):
        beside(axes, cut(name, _LONGEST), index, -8, ha="right")
        if one is not None:
            axes.plot(one.number.ci95 or [one.number.value] * 2, [index, index], color=ROLES["after"], lw=6, alpha=0.4)
            axes.plot(one.number.value, index, "o", color=ROLES["after"], ms=7)
            text = f"{one.number.amount().removesuffix(unit_text(shared.unit)).rstrip()} ({interval(one.number.ci95)})"
        else:
            filed = shared.filed[index]
            axes.plot(filed, index, "o", color=ROLES["surface"], mec=ROLES["before"], ms=7)
            text = f"{number(filed, minus=MINUS)} in the file" if isfinite(filed) else shared.elsewhere[index]
        beside(axes, text, index, 8, right=True, ha="left", color=ROLES["muted"], size=10.5)
    bare_rows(axes, len(names), (min(ends) - margin, max(ends) + margin))
    axes.spines[:].set_visible(False)
