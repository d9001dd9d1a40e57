"""The drawing of how the error of predictions grows with their length, a line a model."""

from collections.abc import Sequence

import matplotlib
import numpy as np

from ....comparison.facts import ComparedModel
from ....physics.in_words import MINUS, number
from ..markup import Html
from .svg import ROLES, STYLE, canvas, drawn, panel

WIDTH, HEIGHT, LEFT, RIGHT = 980, 360, 60, 250
"""Of the figure, and left of the lines and right of them, where their names stand [px]."""
LINE = 20
"""Least distance between two names [px]."""
LONGEST_NAME = 22  # letters that fit beside the lines, with the last error


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
    with matplotlib.rc_context(STYLE):
        figure = canvas(WIDTH, HEIGHT)
        axes = panel(figure, LEFT, 12, WIDTH - LEFT - RIGHT, HEIGHT - 60)
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
        tall = HEIGHT - 60
        at = [tall * float(axes.transAxes.inverted().transform(axes.transData.transform((s[-1], e[-1])))[1])
              for _, (s, e) in lines]  # fmt: skip
        for (model, (_, error)), place in zip(lines, _apart(at, tall), strict=True):
            name = model.name
            name = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}\N{HORIZONTAL ELLIPSIS}"
            text, colour = f"{name}, {number(error[-1], 2, minus=MINUS)} m", colours.get(model.name, ROLES["muted"])
            axes.annotate(text, (1.0, place / tall), (12, 0), xycoords="axes fraction",
                          textcoords="offset points", va="center", color=colour,
                          weight="bold" if model.name in colours else "normal")  # fmt: skip
        return drawn(figure, "position error of each model by the length of its predictions")


def _apart(places: Sequence[float], tall: float) -> list[float]:
    """Heights from the top down that are `LINE` apart at least, each as near to its place as those above leave it."""
    found: list[float] = []
    for place in places:
        found.append(min(place, found[-1] - LINE) if found else place)
    lift = max(0.0, -min(found, default=0.0))
    return [min(place + lift, tall) for place in found] if len(found) * LINE <= tall else found
