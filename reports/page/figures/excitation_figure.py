"""The drawing of how far the log excites each effect."""

from collections.abc import Mapping

import matplotlib
import numpy as np

from ....discovery.identifiability.visible import Excitation
from ....physics.in_words import percent, words
from ..markup import Html
from .svg import ROLES, STYLE, Look, canvas, drawn, panel

FULL = 0.5  # bars end here: half of the force at work is plenty


def excitation(told: Mapping[str, Excitation]) -> Html:
    """One bar an effect, the least excited on top; bars of the well excited are cut at half of the force at work.

    Parameters
    ----------
    told : by effect
    """
    shares = {name: item.share for name, item in told.items()}
    order = sorted(shares, key=lambda name: (shares[name] != shares[name], shares[name]))
    left, width, height = 208, 460, 12 + 17 * len(order)
    with matplotlib.rc_context(STYLE):
        figure = canvas(width, height)
        axes = panel(figure, left, 4, width - left - 62, height - 8)
        values = np.nan_to_num(np.array([shares[name] for name in order]))
        fill = [ROLES["before"] if value < 0.02 else ROLES["between"] for value in values]
        axes.barh(np.arange(len(order)), np.minimum(values, FULL), height=0.62, color=fill)
        beside: Look = {"textcoords": "offset points", "va": "center", "size": 10.5}
        for row, name in enumerate(order):
            axes.annotate(words(name), (0, row), (-8, 0), xycoords=axes.get_yaxis_transform(), ha="right", **beside)
            axes.annotate(percent(shares[name]), (min(values[row], FULL), row), (6, 0), **beside)
        axes.set(ylim=(len(order) - 0.5, -0.5), xlim=(0.0, FULL), xticks=[], yticks=[])
        axes.grid(visible=False)
        axes.spines["bottom"].set_visible(False)
        return drawn(figure, "how far the log excites each effect")
