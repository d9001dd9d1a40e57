"""Drawings as inline SVG whose colours are the page's CSS variables.

Colours stand for roles throughout: measured, before (the nominal model), after (the corrected one). A role is drawn
in a placeholder colour and replaced by `var(--role)`, so one drawing reads well on paper and on a dark screen.
"""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from ....physics.errors import printable
from ..markup import Html, escaped

Look = dict[str, Any]
"""How matplotlib is to draw something: its keyword arguments, of many types."""

BESIDE: Look = {"textcoords": "offset points", "va": "center"}
"""A text beside a place, at the middle of its height."""
PANEL = (318, 300)
"""Width and height of a drawing [px] of which three stand beside each other on the page."""
Margins = tuple[int, int, int, int]
ROLES = {
    "ink": "#010101",
    "muted": "#020202",
    "grid": "#030303",
    "surface": "#040404",
    "measured": "#050505",
    "before": "#060606",
    "after": "#070707",
    "between": "#080808",
    "likely": "#090909",
    # Error from small to large, on maps: steps of lightness, so that they can be told apart without colour.
    **{f"heat{step}": f"#0{step}0{step}1{step}" for step in range(1, 7)},
}
HEAT = tuple(f"heat{step}" for step in range(1, 7))
_MUTED = ROLES["muted"]
_TICKS = {"color": _MUTED, "labelcolor": _MUTED, "labelsize": 11.0, "major.size": 3.5, "major.width": 0.8}
"""The look of ticks and of the numbers beside them, of both axes."""
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.family": ["DejaVu Sans"],
    "font.size": 12.0,
    "text.color": ROLES["ink"],
    "axes.edgecolor": ROLES["grid"],
    "axes.labelcolor": _MUTED,
    "axes.facecolor": "none",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.titlelocation": "left",
    "axes.titlesize": 12.0,
    "axes.titlepad": 6.0,
    "axes.unicode_minus": True,
    "grid.color": ROLES["grid"],
    "grid.linewidth": 0.6,
    **{f"{axis}tick.{name}": value for axis in "xy" for name, value in _TICKS.items()},
    "lines.solid_capstyle": "round",
}
"""The look of all figures: text in pixels of the page, a little smaller than its own; thin lines for the grid."""


@contextmanager
def canvas(width: int, height: int, *, simplify: bool = True) -> Iterator[Figure]:
    """A figure whose SVG user unit is one pixel of the page, in the style of all figures while it is drawn.

    Parameters
    ----------
    simplify : points of a line that nobody could tell from it are left out
    """
    with matplotlib.rc_context({**STYLE, "path.simplify": simplify}):
        figure = Figure(figsize=(width / 72.0, height / 72.0), facecolor="none")
        FigureCanvasSVG(figure)
        yield figure


def panel(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """Axes placed in pixels from the upper left corner."""
    wide, tall = figure.get_size_inches() * 72.0
    return figure.add_axes((left / wide, 1.0 - (top + height) / tall, width / wide, height / tall))


@contextmanager
def chart(size: tuple[int, int], margins: Margins = (58, 26, 8, 46), *, simplify: bool = True) -> Iterator[Axes]:
    """The axes of a figure that has no others; see `canvas`.

    Parameters
    ----------
    size : width and height [px]
    margins : what is left free at the left, on top, at the right and at the bottom [px]
    """
    (width, height), (left, top, right, bottom) = size, margins
    with canvas(width, height, simplify=simplify) as figure:
        yield panel(figure, left, top, width - left - right, height - top - bottom)


def bare_rows(axes: Axes, count: int, ends: tuple[float, float]) -> None:
    """Leave of axes a row for each of some things, the first on top, and the line at their left."""
    axes.set(ylim=(count - 0.5, -0.5), xlim=ends, xticks=[], yticks=[])
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)


def beside(axes: Axes, text: str, row: float, shift: float, *, right: bool = False, **look: Any) -> None:
    """A text at the left end of a row, or at the right one, so far from it [px]."""
    axes.annotate(text, (float(right), row), (shift, 0), xycoords=axes.get_yaxis_transform(), **BESIDE, **look)


def saved(figure: Figure, salt: str, **metadata: str | None) -> str:
    """The text of a figure as a file of SVG: letters stay letters, and one picture has one text, byte for byte."""
    stream = io.StringIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": salt}):
        figure.savefig(stream, format="svg", metadata={"Date": None, **metadata})
    return stream.getvalue()


def drawn(shown: Figure | Axes, label: str) -> Html:
    """The figure as part of a page; `label` says what it shows, and keeps its names apart from another figure's."""
    figure: Any = shown.figure if isinstance(shown, Axes) else shown
    return inline(saved(figure, label, Creator=None, Format=None, Type=None), label)


def inline(text: str, label: str) -> Html:
    """Make a matplotlib SVG file part of a page.

    Parameters
    ----------
    text : str
        The file, drawn with `STYLE` in the placeholder colours of `ROLES`.
    label : str
        What the drawing shows, for those who cannot see it.

    Returns
    -------
    Html
        One `svg` element without metadata, namespaces or unused names: nothing in it points outside the page.
    """
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    box = re.search(r'viewBox="([^"]+)"', text)
    referenced = set(re.findall(r'(?:href="#|url\(#)([^")]+)', text))
    text = re.sub(r' id="([^"]+)"', lambda match: match[0] if match[1] in referenced else "", text)
    tag = f'<svg viewBox="{box[1] if box else ""}" role="img" aria-label="{escaped(label)}">'
    text = tag + text[text.index(">") + 1 :]
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"-?\d+\.\d{3,}", _shorter, tag[0]), text)
    text = re.sub(r"'DejaVu Sans'[^;\"]*", "var(--font)", text)
    for role, colour in ROLES.items():
        text = text.replace(colour, f"var(--{role})")
    return Html(printable(re.sub(r"\n\s*", "\n", text)).strip())


def _shorter(number: re.Match[str]) -> str:
    """A coordinate to a hundredth of a pixel."""
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")
