"""The tracks of all models over each other: where each took the boat, beside where it was to go."""

import io
from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from ....steering.closed_loop import Passage
from ....steering.tracking import PERFECT, ControlRecord
from ....steering.tracks import TRACKS

_LOOK: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "undertow control",
    "font.size": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
}
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
        stream = io.StringIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": "undertow control"})
    return stream.getvalue()


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
