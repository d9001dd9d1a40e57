"""The drawing of one number of several runs side by side."""

from collections.abc import Sequence
from math import isfinite

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from ....physics.in_words import MINUS, number, unit_text
from ...wording import interval
from ..fleet import Relation, SharedNumber
from ..markup import Html
from .svg import ROLES, STYLE, Look, canvas, drawn, panel

LINE, HEAD, LEFT, WIDTH, RIGHT = 22, 30, 84, 440, 190
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
    height = HEAD + LINE * len(names) + 10
    with matplotlib.rc_context(STYLE):
        figure = canvas(WIDTH, height)
        axes = panel(figure, LEFT, HEAD, WIDTH - LEFT - RIGHT, LINE * len(names))
        unit = unit_text(shared.unit)
        head = f"{shared.symbol} {f'[{unit}]' if unit else ''}".strip()
        figure.text(0.0, 1.0 - 18 / height, head, weight="bold")
        figure.text(1.0, 1.0 - 18 / height, shared.relation.value, ha="right", color=ROLES["muted"])
        _draw(axes, shared, names)
        return drawn(figure, f"{shared.symbol} in each run: {shared.relation.value}")


def _draw(axes: Axes, shared: SharedNumber, names: Sequence[str]) -> None:
    beside: Look = {"textcoords": "offset points", "va": "center", "xycoords": axes.get_yaxis_transform()}
    bands = [(one.number.ci95 or (one.number.value,) * 2) if one else None for one in shared.held]
    ends = [
        end for one, band in zip(shared.held, bands, strict=True) if one and band for end in (*band, one.number.value)
    ]
    ends += [value for value, one in zip(shared.filed, shared.held, strict=True) if one is None and isfinite(value)]
    margin = 0.08 * (max(ends) - min(ends)) or 0.1 * abs(ends[0]) or 0.1
    if shared.relation is Relation.SAME:
        known = [band for band in bands if band is not None]
        low, high = max(band[0] for band in known), min(band[1] for band in known)
        axes.axvspan(low, max(low, high), color=ROLES["measured"], alpha=0.35, lw=0)
    for index, (name, one, band) in enumerate(zip(names, shared.held, bands, strict=True)):
        short = name if len(name) <= _LONGEST else f"{name[: _LONGEST - 1]}\N{HORIZONTAL ELLIPSIS}"
        axes.annotate(short, (0, index), (-8, 0), ha="right", **beside)
        if one is not None and band is not None:
            axes.plot(band, [index, index], color=ROLES["after"], lw=6, alpha=0.4)
            axes.plot(one.number.value, index, "o", color=ROLES["after"], ms=7)
            text = f"{one.number.amount().removesuffix(unit_text(shared.unit)).rstrip()} ({interval(one.number.ci95)})"
        else:
            filed = shared.filed[index]
            axes.plot(
                filed if isfinite(filed) else np.nan, index, "o", color=ROLES["surface"], mec=ROLES["before"], ms=7
            )
            text = f"{number(filed, minus=MINUS)} in the file" if isfinite(filed) else shared.elsewhere[index]
        axes.annotate(text, (1, index), (8, 0), ha="left", color=ROLES["muted"], size=10.5, **beside)
    axes.set(ylim=(len(names) - 0.5, -0.5), xlim=(min(ends) - margin, max(ends) + margin), xticks=[], yticks=[])
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
