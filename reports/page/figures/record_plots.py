"""Plots of findings and of comparisons for a notebook, and the drawing that those of a run share with them."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ....comparison.facts import Comparison
from ....discovery.findings import FailingPlace, Findings
from ....physics.errors import RequestError
from ....physics.presentation import Card, unit_text, words
from ....residuals.scores import ROLLOUT_UNITS, RolloutRecord
from ...sureness import CoefficientRow
from ...wording import pick_horizon

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MEASURED, BEFORE, AFTER, BETWEEN = "0.75", "tab:red", "tab:blue", "0.6"
"""Colours of what was measured, of the nominal, of the corrected model, and of those between."""
_LETTERS = 44
"""Letters of a place on a line: beside them half of a figure is left for its bar."""


class Drawings(Card):
    """Plots that show themselves as the list of their methods, and not all that they draw from."""

    __slots__ = ()

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        methods = {name: one for name, one in vars(type(self)).items() if callable(one) and name[0] != "_"}
        return [(f".{name}()", (one.__doc__ or "").partition("\n")[0]) for name, one in methods.items()]


@dataclass(frozen=True, slots=True, repr=False)
class FindingsPlots(Drawings):
    """What can be drawn of findings alone; every method takes axes to draw on, and gives them back."""

    findings: Findings

    def staircase(self, quantity: str = "position", horizon: str = "", ax: "Axes | None" = None) -> "Axes":
        """The error of predictions as effects are added, on rows that no fit saw.

        Parameters
        ----------
        quantity : surge, sway, yaw or position
        horizon : of the predictions [s]: "2", "10" or "30"; default: 10, or what there is

        Raises
        ------
        RequestError
            for a quantity or a horizon that was not judged.
        """
        steps = self.findings.steps
        colours = [BEFORE, *[BETWEEN] * (len(steps) - 2), AFTER][: len(steps)]
        names = [words(step.added) if step.added else "nominal" for step in steps]
        return _errors(names, [dict(step.rollout_rmse) for step in steps], (quantity, horizon), colours, ax)

    def coefficients(self, ax: "Axes | None" = None) -> "Axes":
        """The numbers that the log asks for of each missing or likely effect, over its value, with 95 % intervals."""
        terms = [term for c in self.findings.candidates if c.verdict in ("missing", "likely") for term in c.terms]
        ends = [(t.value, t.value) if t.ci95 is None else (t.ci95.lower, t.ci95.upper) for t in terms]
        rows = [CoefficientRow(t.symbol, t.unit, np.nan, t.value, end) for t, end in zip(terms, ends, strict=True)]
        return draw_coefficients(rows, ax)

    def failures(self, ax: "Axes | None" = None) -> "Axes":
        """The places where the nominal model's error gathers, and the share of its squared error that lies there."""
        return _places(self.findings.failures, ax)


@dataclass(frozen=True, slots=True, repr=False)
class ComparisonPlots(Drawings):
    """What can be drawn of a comparison; every method takes axes to draw on, and gives them back."""

    comparison: Comparison

    def errors(self, quantity: str = "position", horizon: str = "", ax: "Axes | None" = None) -> "Axes":
        """The error of each model's predictions on the same rows; the one to trust is blue, the nominal one red.

        Parameters
        ----------
        quantity, horizon : see `FindingsPlots.staircase`

        Raises
        ------
        RequestError
            for a quantity or a horizon that was not judged.
        """
        models, best = self.comparison.models, self.comparison.best.model
        colours = [AFTER if one.name == best else BETWEEN if k else BEFORE for k, one in enumerate(models)]
        errors = [dict(one.rollout) for one in models]
        return _errors([one.name for one in models], errors, (quantity, horizon), colours, ax)

    def failures(self, model: str = "", ax: "Axes | None" = None) -> "Axes":
        """The places where a model's error gathers, and the share of its squared error that lies there.

        Raises
        ------
        RequestError
            for a model of which no places were looked for.
        """
        places, wanted = self.comparison.failures, model or self.comparison.models[0].name
        found = [place for place in places if place.model == wanted]
        if model and not found:
            known = ", ".join(dict.fromkeys(place.model for place in places)) or "none"
            raise RequestError(f"plot: no failures of a model {model!r}; there are those of {known}")
        return _places(found, ax)


def new_axes(ax: Any) -> Any:
    """The axes that were given, or those of a new figure."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1]


def draw_coefficients(rows: Sequence[CoefficientRow], ax: "Axes | None") -> "Axes":
    """Numbers over their values, with intervals and, where they are known, the values before."""
    axes = new_axes(ax)
    for place, row in enumerate(rows):
        scale = row.after or 1.0
        axes.plot(np.array(row.interval) / scale, [place, place], color=AFTER, lw=5, alpha=0.4)
        axes.plot(row.after / scale, place, "o", color=AFTER)
        axes.plot(row.before / scale, place, "x", color=BEFORE)
    axes.set_yticks(range(len(rows)), [f"{row.symbol} = {row.after:.3g} {unit_text(row.unit)}" for row in rows])
    axes.invert_yaxis()
    known = any(np.isfinite(row.before) for row in rows)
    axes.set_xlabel("value over the corrected one (x: before)" if known else "value and 95 % interval, over the value")
    return axes


def _errors(
    names: Sequence[str],
    rollouts: Sequence[dict[str, RolloutRecord]],
    asked: tuple[str, str],
    colours: Sequence[str],
    ax: "Axes | None",
) -> "Axes":
    """Bars of the error of a quantity over a horizon."""
    quantity, horizon = asked[0], asked[1] or pick_horizon([key for one in rollouts for key in one])
    errors = [getattr(one.get(horizon), quantity, None) if quantity in ROLLOUT_UNITS else None for one in rollouts]
    values = [np.nan if error is None else float(error) for error in errors]
    if not np.isfinite(values).any():
        raise RequestError(f"plot: no error of {quantity} over {horizon} s; there are surge, sway, yaw, position")
    axes = new_axes(ax)
    axes.barh(range(len(names)), values, color=colours)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set(xlabel=f"{quantity} error of {horizon} s predictions [{unit_text(ROLLOUT_UNITS[quantity])}]")
    return axes


def _places(places: Sequence[FailingPlace], ax: "Axes | None") -> "Axes":
    """Bars of the share of the squared error that lies in each place, and of the rows."""
    axes = new_axes(ax)
    shares = [(100.0 * (place.share_of_error or 0.0), 100.0 * (place.share_of_rows or 0.0)) for place in places]
    for k, (error, rows) in enumerate(shares):
        axes.barh(k, error, color=BEFORE, label="" if k else "of the squared error on the axis")
        axes.barh(k, rows, height=0.3, color=MEASURED, label="" if k else "of the rows")
    names = [textwrap.fill(f"{place.axis}: {place.where}", _LETTERS) for place in places]
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set(xlabel="share [%]", xlim=(0.0, 100.0), title="" if places else "no place holds more than its share")
    if places:
        axes.legend()
    return axes
