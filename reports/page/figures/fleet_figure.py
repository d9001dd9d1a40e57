"""The drawing of the coefficients of several runs side by side."""

from collections.abc import Sequence

import matplotlib
from matplotlib.axes import Axes

from ....physics.in_words import unit_text
from ...wording import interval, within
from ..coefficients import CoefficientRow
from ..fleet import Shared
from ..markup import Html
from .svg import ROLES, STYLE, Look, canvas, drawn, panel

LINE, HEAD, LEFT, WIDTH, RIGHT = 22, 30, 150, 620, 200
"""Height of a run and of the head above it, left edge of the axis, width of the figure, room for numbers [px]."""


def side_by_side(effect: Shared, names: Sequence[str]) -> Html:
    """The coefficients of an effect, one row a run: value in the corrected vehicle (dot) and 95 % interval (band).

    Parameters
    ----------
    effect : as `shared_effects` finds it
    names : of the runs
    """
    symbols = effect.symbols
    counts = [sum(row is not None for row in effect.of(symbol)) for symbol in symbols]
    height = sum(HEAD + LINE * count + 10 for count in counts)
    with matplotlib.rc_context(STYLE):
        figure = canvas(WIDTH, height)
        top = 0
        for symbol, count in zip(symbols, counts, strict=True):
            rows = [(name, row) for name, row in zip(names, effect.of(symbol), strict=True) if row is not None]
            axes = panel(figure, LEFT, top + HEAD, WIDTH - LEFT - RIGHT, LINE * count)
            unit = unit_text(rows[0][1].unit)
            figure.text(0.0, 1.0 - (top + 18) / height, f"{symbol} {f'[{unit}]' if unit else ''}", weight="bold")
            _draw(axes, rows)
            top += HEAD + LINE * count + 10
        return drawn(figure, f"coefficients of {effect.effect} in each run")


def _draw(axes: Axes, rows: Sequence[tuple[str, CoefficientRow]]) -> None:
    beside: Look = {"textcoords": "offset points", "va": "center", "xycoords": axes.get_yaxis_transform()}
    ends = [end for _, row in rows for end in (*row.interval, row.after)]
    margin = 0.08 * (max(ends) - min(ends)) or 0.1 * abs(ends[0]) or 0.1
    common = max(row.interval[0] for _, row in rows), min(row.interval[1] for _, row in rows)
    if len(rows) > 1 and common[0] <= common[1]:
        axes.axvspan(*common, color=ROLES["measured"], alpha=0.35, lw=0)
    for index, (name, row) in enumerate(rows):
        axes.plot(row.interval, [index, index], color=ROLES["after"], lw=6, alpha=0.4)
        axes.plot(row.after, index, "o", color=ROLES["after"], ms=7)
        axes.annotate(
            name if len(name) < 20 else f"{name[:18]}\N{HORIZONTAL ELLIPSIS}", (0, index), (-8, 0), ha="right", **beside
        )
        text = f"{within(row.after, row.interval)} ({interval(row.interval)})"
        axes.annotate(text, (1, index), (8, 0), ha="left", color=ROLES["muted"], size=10.5, **beside)
    axes.set(ylim=(len(rows) - 0.5, -0.5), xlim=(min(ends) - margin, max(ends) + margin), xticks=[], yticks=[])
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
