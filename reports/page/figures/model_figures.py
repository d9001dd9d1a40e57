"""The drawing that puts all models side by side: how wrong they are, and which laws of a hull they break."""

import math
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from ....physics.in_words import MINUS, number
from ..markup import Html
from ..rivals import Rival
from .svg import ROLES, STYLE, Look, canvas, drawn, panel

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
    with matplotlib.rc_context(STYLE):
        figure = canvas(WIDTH if laws else LEFT + DOTS + GAP, height)
        errors = panel(figure, LEFT, top, DOTS, ROW * len(rivals))
        _errors(errors, rivals, best)
        errors.set_xlabel(f"position error of {horizon} s predictions [m], logarithmic: left is better")
        if laws:
            _legend(panel(figure, LEFT, 0, DOTS, top - 24))
            _laws(panel(figure, LEFT + DOTS + GAP, top, CELL * len(laws), ROW * len(rivals)), rivals, laws)
        return drawn(figure, f"prediction error and laws kept by each model{f' of {of}' if of else ''}")


def _errors(axes: Axes, rivals: Sequence[Rival], best: str) -> None:
    known = [rival.error for rival in rivals if rival.error > 0.0]
    low, high = min(known, default=0.1), max(known, default=1.0)
    ends = [end for rival in rivals if rival.interval for end in rival.interval if end > 0.3 * low]
    low, high = min([low, *ends]) / 1.35, max([high, *ends]) * 1.35
    axes.set(xscale="log", xlim=(low, high), ylim=(len(rivals) - 0.5, -0.5), yticks=[])
    axes.grid(visible=False, axis="y")
    axes.minorticks_off()
    ticks = [base * 10.0**power for power in range(-6, 7) for base in (1, 2, 5) if low <= base * 10.0**power <= high]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    beside: Look = {"textcoords": "offset points", "va": "center"}
    for row, rival in enumerate(rivals):
        strong = "bold" if rival.name == best else "normal"
        at_left = {**beside, "xycoords": axes.get_yaxis_transform(), "ha": "right"}
        name = rival.name
        name = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}\N{HORIZONTAL ELLIPSIS}"
        axes.annotate(name, (0, row), (-12, 7), **at_left, weight=strong)
        axes.annotate(_about(rival), (0, row), (-12, -8), **at_left, color=ROLES["muted"], size=10)
        axes.axhline(row + 0.5, color=ROLES["grid"], lw=0.6)
        if rival.error > 0.0:
            if rival.interval:
                span = np.clip(rival.interval, low, high)
                axes.plot(span, [row, row], color=COLOURS.get(rival.audit, ROLES["muted"]), lw=6, alpha=0.35)
            axes.plot(rival.error, row, SHAPES.get(rival.audit, "o"), **_look(rival))
        text = number(rival.error, 2, minus=MINUS, blank="diverged")
        if rival.diverged and rival.error > 0.0:
            text += f" ({rival.diverged} of {rival.starts} ran away)"
        ends = [end for end in (rival.interval or ()) if end > 0.0]
        place = min(max([rival.error, *ends]), high) if rival.error > 0.0 else low
        inside = place < low * (high / low) ** 0.72
        place = place if inside else max(min([rival.error, *ends]), low)
        axes.annotate(
            text, (place, row), (11 if inside else -11, 0), **beside, ha="left" if inside else "right", weight=strong
        )


def _legend(axes: Axes) -> None:
    """What the marks mean, above the errors."""
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axes.set_axis_off()
    for row, (audit, text) in enumerate((("pass", "keeps the laws"), ("fail", "breaks a law"), ("", "not asked"))):
        colour, height = COLOURS.get(audit, ROLES["muted"]), 0.62 - 0.26 * row
        look = {"color": colour if audit else ROLES["surface"], "mec": colour, "mew": 2.0}
        axes.plot(0.02, height, SHAPES.get(audit, "o"), ms=9, **look)
        axes.annotate(text, (0.02, height), (12, 0), textcoords="offset points", va="center", color=ROLES["muted"])


def _look(rival: Rival) -> Look:
    """A disc that grows with the number of parameters; hollow where no law was asked."""
    size = 7.0 + 1.6 * math.log10(1.0 + (rival.parameters or 0))
    colour = COLOURS.get(rival.audit, ROLES["muted"])
    return {"ms": size, "color": colour if rival.audit in COLOURS else ROLES["surface"], "mec": colour, "mew": 2.0}


def _about(rival: Rival) -> str:
    """The kind of the model, and how many numbers were fitted, or that they were to the rows that judge."""
    if rival.fitted_here:
        return f"{rival.kind}, fitted to these rows"
    if not rival.parameters:
        return rival.kind
    count = f"{rival.parameters:,}".replace(",", "\N{NO-BREAK SPACE}")
    return f"{rival.kind}, {count} fitted"


def _laws(axes: Axes, rivals: Sequence[Rival], laws: Sequence[str]) -> None:
    """A grid of verdicts: a dot where the law is kept, a cross where it is broken, a ring where that is only noted."""
    axes.set(xlim=(-0.5, len(laws) - 0.5), ylim=(len(rivals) - 0.5, -0.5), xticks=[], yticks=[])
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)
    axes.spines["left"].set_visible(False)
    for column, law in enumerate(laws):
        up: Look = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points"}
        axes.annotate(law, (column, 1.0), (-3, 8), **up, rotation=52, ha="left", va="bottom", size=10.5)
    for row, rival in enumerate(rivals):
        axes.axhline(row + 0.5, color=ROLES["grid"], lw=0.6)
        if not rival.laws:
            text = {"pass": "keeps the laws", "fail": "breaks a law"}.get(rival.audit, "not asked")
            axes.annotate(text, (0, row), (-8, 0), textcoords="offset points", va="center", color=ROLES["muted"])
        for column, law in enumerate(laws):
            verdict = rival.laws.get(law)
            if verdict == "fail":
                axes.plot(column, row, "X", ms=13, color=ROLES["before"], mec=ROLES["surface"], mew=0.5)
            elif verdict == "noted":
                axes.plot(column, row, "o", ms=8, color=ROLES["surface"], mec=ROLES["before"], mew=1.8)
            elif verdict == "pass":
                axes.plot(column, row, "o", ms=6, color=ROLES["after"])
            elif verdict is not None:
                axes.plot(column, row, "_", ms=7, color=ROLES["muted"], mew=1.5)
