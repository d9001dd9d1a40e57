"""Plots of a run for a notebook: matplotlib axes of the caller's choice, and a slider that predicts anew."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ....comparison.failing.rows import ACCELERATIONS
from ....discovery.effect_findings import FittedTerm
from ....discovery.findings import Findings
from ....physics.effects import BY_NAME
from ....physics.errors import RequestError
from ....physics.integration import rollout
from ....physics.motion import AXES, FORCE_UNITS, Motion
from ....physics.presentation import Card, listing, number, unit_text
from ....physics.registry_members import how_to_install
from ....physics.vehicle import Vehicle
from ....residuals.models.base import VehicleModel
from ....residuals.scores import SPACING
from ....residuals.series import BANDS, RESTART, restarted
from ...run_contents import RunFolder
from ...sureness import coefficient_rows
from ..chapters.play import STATES, Knob, knobs_of
from ..judged_pieces import JudgedPieces, Piece, liveliest_stretch, rollouts
from ..markup import LIGHT, NOTHING, Html, element
from ..outcome import Hero, hero
from .effect_figures import SIGNALS, MissingForce, convincing, force_drawing, means, missing_force, signals
from .record_plots import AFTER, BEFORE, MEASURED, Drawings, FindingsPlots, draw_coefficients, new_axes
from .svg import Look, saved

_LINES = (("measured", "", MEASURED, 4.0), ("nominal", "_before", BEFORE, 1.0), ("corrected", "_after", AFTER, 1.0))
"""What a line is of, the ending of its columns, its colour and its width."""


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
            for model, ending, colour, width in _LINES:
                one.plot(runs["time"], runs[f"{name}{ending}"], color=colour, lw=width, label=model)
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
        knobs = knobs_of(self.nominal, self.corrected)
        knob = next((one for one in knobs if symbol in ("", one.symbol)), None)
        if knob is None:
            names = listing([one.symbol for one in knobs])
            there = f"there are {names}" if knobs else "model.yaml is the nominal model"
            raise RequestError(f"slider: expected a number that the run changed, got {symbol!r}; {there}")

        led = hero(self.findings.steps, self.deciding)
        told, drawn = (
            JudgedPieces.of(self.findings, self.series, self.nominal, self.corrected, seconds)
            for seconds in (float(led.horizon), RESTART)
        )
        if not drawn.pieces:
            raise RequestError(f"slider: expected a judged stretch of {RESTART:g} s or more; give a longer log")

        def draw(series: pd.DataFrame, axes: "Sequence[Axes]") -> object:
            return replace(self, series=series).predictions(axes)

        return PredictionSlider(told, drawn, led, draw, knobs, knob, knob.after)

    def failures(self, axis: str = "surge", model: str = "before", ax: "Axes | None" = None) -> "Axes":
        """Where a model fails: its error of acceleration over surge speed and yaw rate, a point a row.

        Parameters
        ----------
        axis : surge, sway or yaw
        model : "before" or "after"
        """
        index = self._axis(axis)
        column = ACCELERATIONS[index]
        error = np.abs((self.series[column] - self.series[f"{column}_{model}"]).to_numpy(dtype=float))
        axes = new_axes(ax)
        order = np.argsort(error)
        look: Look = {"s": 4, "cmap": "viridis_r", "vmin": 0.0, "vmax": float(np.nanquantile(error, 0.98))}
        speed, rate = (self.series[name].to_numpy()[order] for name in ("u", "r"))
        drawn = axes.scatter(speed, rate, c=error[order], **look)
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


_PREDICTED = ("north", "east", "psi", "u", "v", "r")
"""The states of a prediction."""
_STEPS = 200
"""Places of the slider between its ends, as on the page."""
_HOW = f"a slider stands here where ipywidgets is: {how_to_install('notebook')}"


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class PredictionSlider(Card):
    """Predictions with one number moved: a slider in a notebook with ipywidgets, a card without.

    The error is that of the run's headline, counted alike: each part of the logs is predicted by the model that was
    fitted without it, and each of these models takes the share of its change that the slider says. A run without such
    models has its error on rows that its one model saw, and says so.

    Attributes
    ----------
    told, drawn : stretches that the error counts, and those that are drawn
    led : the error that is told
    draw : draws measured and predicted speeds of a series on three axes
    knobs : all numbers that the run changed
    knob : the one that is moved, with its values before and after
    value : where it is put, in the unit of the vehicle file
    """

    told: JudgedPieces
    drawn: JudgedPieces
    led: Hero
    draw: Callable[[pd.DataFrame, Sequence[Axes]], object]
    knobs: Sequence[Knob]
    knob: Knob
    value: float

    def at(self, value: float) -> "PredictionSlider":
        """The same with the number put elsewhere."""
        return replace(self, value=float(value))

    @property
    def error(self) -> float:
        """Root mean square error of the predictions that the run's headline tells of."""
        columns = [_PREDICTED.index(name) for name in STATES[self.led.metric]]
        squares = []
        for vehicle, motion, _ in self._moved(self.told):
            steps, every = round(float(self.led.horizon) / motion.time_step), max(1, round(SPACING / motion.time_step))
            starts = np.arange(0, motion.time.size - steps, every)
            ahead = np.arange(1, steps + 1)
            states = rollout(vehicle, motion, starts, steps).states[:, ahead]
            measured = np.column_stack([motion.position, motion.heading, motion.velocity])
            off = (states - measured[starts[:, None] + ahead])[..., columns]
            squares.append((off**2).sum(axis=-1).mean(axis=1))
        return float(np.sqrt(np.concatenate(squares).mean())) if squares else float("nan")

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        unit = unit_text(self.knob.unit)
        ends = f"before {number(self.knob.before, 3)}, after {number(self.knob.after, 3)}"
        what = f"{self.knob.symbol} = {number(self.value, 3)} {unit}".rstrip()
        text = f"{self.led.in_words}{self.told.some}: {number(self.error, 2)} {self.led.unit}"
        how = [] if find_spec("ipywidgets") else [("slider", _HOW)]
        return [("number", f"{what} ({self.knob.what}; {ends})"), ("error", text), *how]

    def drawings(self) -> Mapping[str, str]:
        """See `Card`."""
        return {"predictions": self.picture()}

    def picture(self) -> Html:
        """Measured speeds, those of the nominal model, and those with the number where it is put."""
        moved = []
        for vehicle, motion, piece in self._moved(self.drawn):
            states = restarted([VehicleModel(vehicle, "moved")], [motion])[0][0]
            rows = piece.rows.drop(columns=BANDS, errors="ignore")  # no band of a model that is moved by hand
            predicted = {f"{name}_after": column for name, column in zip(_PREDICTED, states.T, strict=True)}
            moved.append(rows.assign(**predicted))
        figure = Figure(figsize=(9.0, 5.0), layout="constrained")
        FigureCanvasAgg(figure)
        self.draw(pd.concat(moved), list(figure.subplots(3, 1, sharex=True)))
        text = saved(figure, "undertow slider")
        return Html(text[text.index("<svg") :])

    def widget(self) -> Any:
        """The slider of ipywidgets over the card, which is drawn anew wherever it is let go.

        Raises
        ------
        ImportError
            where ipywidgets is not installed.
        """
        import ipywidgets  # pyright: ignore[reportMissingImports]

        slider = ipywidgets.FloatSlider(
            value=self.value,
            min=self.knob.low,
            max=self.knob.high,
            step=(self.knob.high - self.knob.low) / _STEPS,
            description=self.knob.symbol,
            continuous_update=False,
            readout_format=".3g",
        )
        shown = ipywidgets.HTML(self._repr_html_())
        slider.observe(lambda change: setattr(shown, "value", self.at(change["new"])._repr_html_()), "value")
        return ipywidgets.VBox([slider, shown])

    def _repr_mimebundle_(self, **asked: object) -> Mapping[str, object]:
        """What a notebook takes: the slider, or the card where ipywidgets is not installed."""
        try:
            return self.widget()._repr_mimebundle_(**asked)
        except ImportError:
            return {"text/plain": repr(self), "text/html": self._repr_html_()}

    def _moved(self, judged: JudgedPieces) -> Iterator[tuple[Vehicle, Motion, Piece]]:
        """The model that predicts each stretch, with the number where it is put, and the stretch as a motion."""
        share = (self.value - self.knob.before) / (self.knob.after - self.knob.before)
        models = judged.moved({knob.symbol: 1.0 for knob in self.knobs} | {self.knob.symbol: share})
        for piece in judged.pieces:
            yield models[piece.model], _motion(piece, models[piece.model]), piece


def _motion(piece: Piece, vehicle: Vehicle) -> Motion:
    """Rows of the series as a motion."""
    rows, time = piece.rows, piece.rows["time"].to_numpy()
    step = float(np.median(np.diff(time)))
    return Motion(
        time=time[0] + step * np.arange(time.size),
        position=rows[["north", "east"]].to_numpy(),
        heading=rows["psi"].to_numpy(),
        velocity=rows[["u", "v", "r"]].to_numpy(),
        commands=rows[[thruster.channel for thruster in vehicle.thrusters]].to_numpy(),
        thrusters=tuple(thruster.name for thruster in vehicle.thrusters),
        minutes=piece.begins + step / 60.0 * np.arange(time.size),
    )


_WIDTH, _HEIGHT, _MARGIN = 180.0, 14.0, 6.0
"""Size of an interval's drawing, and room for its marks at both ends [px]: a line of a table."""


def of_findings(findings: Findings) -> dict[str, str]:
    """The numbers of a card, each over its 95 % interval, by the label of its line."""
    label, terms = findings.in_play
    cells = [(term.in_words, interval_bar(term, null)) for term, null in terms]
    rows = [element("tr", element("td", name), element("td", bar)) for name, bar in cells]
    return {label: element("table", *rows)} if rows else {}


def of_run(findings: Findings, series: "pd.DataFrame", nominal: Vehicle) -> dict[str, str]:
    """The same, and the force that the model lacks, where what was added explains it, as the page has it."""
    best = [force_drawing(one) for one in convincing(findings, series, nominal)[:1]]
    paper = {"style": f"{' '.join(LIGHT.split())} --font: sans-serif; background: var(--card); width: 320px"}
    return of_findings(findings) | ({"force": element("div", *best, **paper)} if best else {})


def interval_bar(term: FittedTerm, null: float) -> Html:
    """Draw a number as a disc on its 95 % interval, beside a tick where nothing would be missing."""
    ends = (term.value, term.value) if term.ci95 is None else (term.ci95.lower, term.ci95.upper)
    marks = [term.value, *ends, null]
    if not all(math.isfinite(mark) for mark in marks):
        return NOTHING
    least, span = min(marks), (max(marks) - min(marks)) or 1.0
    at, low, high, absent = (f"{_MARGIN + (_WIDTH - 2 * _MARGIN) * (mark - least) / span:.1f}" for mark in marks)
    middle = f"{_HEIGHT / 2:g}"
    tick = element("line", x1=absent, x2=absent, y1="1", y2=f"{_HEIGHT - 1:g}", stroke="#d55e00", stroke_width="2")
    wide = element("line", x1=low, x2=high, y1=middle, y2=middle, stroke="#0072b2", stroke_width="3")
    disc = element("circle", cx=at, cy=middle, r="4", fill="#0072b2")
    size = {"width": f"{_WIDTH:g}", "height": f"{_HEIGHT:g}", "role": "img", "aria-label": term.in_words}
    return element("svg", tick, wide, disc, **size)
