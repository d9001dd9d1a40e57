"""Plots of a run for a notebook: matplotlib axes that a person can go on with.

They show what the page shows, in plain colours and on axes of the caller's choice.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ....discovery.findings import Findings
from ....physics.effects import BY_NAME
from ....physics.errors import RequestError
from ....physics.frames import AXES, FORCE_UNITS
from ....physics.in_words import listing, unit_text
from ....physics.vehicle import Vehicle
from ....residuals.series import RESTART
from ...run_contents import RunFolder
from ..coefficients import coefficient_rows
from .figure_data import liveliest_stretch, rollouts
from .missing_force import SIGNALS, MissingForce, means, missing_force, signals
from .record_plots import AFTER, BEFORE, MEASURED, Drawings, FindingsPlots, draw_coefficients, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .prediction_slider import PredictionSlider


@dataclass(frozen=True, slots=True, repr=False)
class Plots(Drawings):
    """What can be drawn of a run; every method but the slider takes axes to draw on, and gives them back.

    Attributes
    ----------
    findings, nominal, corrected : of the run
    series : `series.csv`, a row each time step
    deciding : horizon of the predictions that the run leads with, see `comparison.facts.Best`
    """

    findings: Findings
    series: pd.DataFrame
    nominal: Vehicle
    corrected: Vehicle
    deciding: str = ""

    def staircase(self, quantity: str = "position", horizon: str = "", ax: "Axes | None" = None) -> "Axes":
        """The error of predictions as effects are added, on rows that no fit saw.

        See `FindingsPlots.staircase`.
        """
        return FindingsPlots(self.findings).staircase(quantity, horizon, ax)

    def predictions(self, axes: "Sequence[Axes]" = ()) -> "Sequence[Axes]":
        """Measured speeds, and those of both models, restarted every 10 s, over two minutes with most motion."""
        if not axes:
            import matplotlib.pyplot as plt

            axes = list(plt.subplots(3, 1, sharex=True, layout="constrained")[1])
        runs = rollouts(liveliest_stretch(self.series))
        for one, name in zip(axes, ("u", "v", "r"), strict=True):
            for colour, ending, width in ((MEASURED, "", 4.0), (BEFORE, "_before", 1.0), (AFTER, "_after", 1.0)):
                one.plot(runs["time"], runs[f"{name}{ending}"], color=colour, lw=width, label=_named(ending))
            if f"{name}_band" in runs:
                ends = (runs[f"{name}_after"] + sign * runs[f"{name}_band"] for sign in (-1.0, 1.0))
                one.fill_between(runs["time"], *ends, color=AFTER, alpha=0.2, lw=0, label="band")
            one.set_ylabel(f"{name} [{unit_text(SIGNALS[name])}]")
        axes[0].legend(loc="upper right")
        axes[-1].set_xlabel("time in the log [s]")
        return axes

    def force(self, what: str = "", against: str = "", ax: "Axes | None" = None) -> "Axes":
        """The force that the nominal model lacks over what it depends on, and what the correction makes of it.

        Parameters
        ----------
        what : surge, sway or yaw, or an effect, on whose axis it is drawn; default: the first effect that is missing
        against : a column of the series: u, v, r, psi, u_dot, ... or a command; default: over which it is seen best

        Raises
        ------
        RequestError
            for an axis, an effect or a column that is not there.
        """
        if against and against not in signals(self.series):
            listed = ", ".join(signals(self.series))
            raise RequestError(f"plot: no column {against!r} in the series; there are {listed}")
        found = self._lacking(self._axis(what), against)
        axes = new_axes(ax)
        axes.plot(found.values, found.lacking, ".", color=MEASURED, ms=2, label="measured less nominal model")
        axes.plot(*means(found.values, found.lacking), "o", color=BEFORE, label="its means")
        axes.plot(*means(found.values, found.added), "-", color=AFTER, lw=2, label="what was added")
        unit = unit_text(FORCE_UNITS[found.axis])
        axes.set(xlabel=found.label, ylabel=f"{AXES[found.axis]} [{unit}]", ylim=found.ends)
        axes.legend()
        return axes

    def coefficients(self, ax: "Axes | None" = None) -> "Axes":
        """The coefficients of effects in the model before and after, each over its value after, with 95 % intervals."""
        added = [effect.effect for effect in self.findings.added]
        rows = coefficient_rows(self.findings.candidates, added, self.nominal, self.corrected)
        return draw_coefficients(rows, ax)

    def slider(self, symbol: str = "") -> "PredictionSlider":
        """A slider of a number that the run changed, which predicts anew: in a notebook with ipywidgets, else a card.

        Parameters
        ----------
        symbol : of the number; default: the first

        Raises
        ------
        RequestError
            when the run changed no such number, or no judged stretch is as long as a prediction.
        """
        from ..chapters.play import knobs_of
        from ..judged_pieces import JudgedPieces
        from ..outcome import hero
        from .prediction_slider import PredictionSlider

        knobs = knobs_of(self.nominal, self.corrected)
        knob = next((one for one in knobs if symbol in ("", one.symbol)), None)
        if knob is None:
            there = (
                f"there are {listing([one.symbol for one in knobs])}" if knobs else "model.yaml is the nominal model"
            )
            raise RequestError(f"slider: expected a number that the run changed, got {symbol!r}; {there}")

        horizon, metric = hero(self.findings.steps, self.deciding)
        told, drawn = (
            JudgedPieces.of(self.findings, self.series, self.nominal, self.corrected, seconds)
            for seconds in (float(horizon), RESTART)
        )
        if not drawn.pieces:
            raise RequestError(f"slider: expected a judged stretch of {RESTART:g} s or more; give a longer log")

        def draw(series: pd.DataFrame, axes: "Sequence[Axes]") -> object:
            return replace(self, series=series).predictions(axes)

        return PredictionSlider(told, drawn, horizon, metric, draw, knobs, knob, knob.after)

    def failures(self, axis: str = "surge", model: str = "before", ax: "Axes | None" = None) -> "Axes":
        """Where a model fails: its error of acceleration over surge speed and yaw rate, a point a row.

        Parameters
        ----------
        axis : surge, sway or yaw
        model : "before" or "after"
        """
        index = self._axis(axis)
        column = ("u_dot", "v_dot", "r_dot")[index]
        error = np.abs((self.series[column] - self.series[f"{column}_{model}"]).to_numpy(dtype=float))
        axes = new_axes(ax)
        order = np.argsort(error)
        drawn = axes.scatter(
            self.series["u"].to_numpy()[order],
            self.series["r"].to_numpy()[order],
            c=error[order],
            s=4,
            cmap="viridis_r",
            vmin=0.0,
            vmax=float(np.nanquantile(error, 0.98)),
        )
        unit = unit_text(SIGNALS[column])
        axes.figure.colorbar(drawn, ax=axes, label=f"error of {AXES[index]} acceleration [{unit}]")
        axes.set(xlabel="u [m/s]", ylabel="r [rad/s]")
        return axes

    def _axis(self, what: str) -> int:
        name = what or next(iter((*self.findings.missing, *self.findings.likely)), "surge")
        if name in AXES:
            return AXES.index(name)
        found = next((c for c in self.findings.candidates if c.effect == name), None)
        if found is None and name not in BY_NAME:
            raise RequestError(f"plot: expected surge, sway, yaw or an effect, got {what!r}")
        axes = [term.axis for term in found.terms if term.axis in AXES] if found else []
        if axes:
            return AXES.index(axes[0])
        return max(range(3), key=lambda axis: self._lacking(axis).told)

    def _lacking(self, axis: int, against: str = "") -> MissingForce:
        return missing_force(self.series, self.nominal, axis, against, self.findings.criterion.unjudged)


def of_folder(run: RunFolder) -> Plots:
    """What can be drawn of a run that was written."""
    return Plots(run.findings, run.series, run.nominal, run.corrected, run.comparison.best.horizon)


def _named(ending: str) -> str:
    return {"": "measured", "_before": "nominal", "_after": "corrected"}[ending]
