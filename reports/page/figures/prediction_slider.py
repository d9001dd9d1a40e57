"""A slider in a notebook: one number that a run found, and predictions anew wherever it is put."""

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ....physics.cards import Card
from ....physics.extras import how_to_install
from ....physics.frames import Array
from ....physics.in_words import number, unit_text
from ....physics.motion import Motion
from ....physics.simulation import rollout
from ....physics.vehicle import Vehicle
from ....residuals.models.base import VehicleModel
from ....residuals.scores import ROLLOUT_UNITS, SPACING
from ....residuals.series import BANDS, restarted
from ..chapters.play import STATES, Knob
from ..judged_pieces import JudgedPieces, Piece
from ..markup import Html

_PREDICTED = ("north", "east", "psi", "u", "v", "r")
"""The states of a prediction."""
_STEPS = 200
"""Places of the slider between its ends, as on the page."""
_LOOK: dict[Any, Any] = {"svg.fonttype": "none", "svg.hashsalt": "undertow slider"}
"""Letters stay letters, and one value has one picture, byte for byte."""
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
    horizon, metric : of the predictions whose error is told [s], and the quantity
    draw : draws measured and predicted speeds of a series on three axes
    knobs : all numbers that the run changed
    knob : the one that is moved, with its values before and after
    value : where it is put, in the unit of the vehicle file
    """

    told: JudgedPieces
    drawn: JudgedPieces
    horizon: str
    metric: str
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
        columns = [_PREDICTED.index(name) for name in STATES[self.metric]]
        squares = []
        for vehicle, motion, _ in self._moved(self.told):
            steps, every = round(float(self.horizon) / motion.time_step), max(1, round(SPACING / motion.time_step))
            starts = np.arange(0, motion.time.size - steps, every)
            ahead = np.arange(1, steps + 1)
            states = rollout(vehicle, motion, starts, steps).states[:, ahead]
            off = (states - _states(motion)[starts[:, None] + ahead])[..., columns]
            squares.append((off**2).sum(axis=-1).mean(axis=1))
        return float(np.sqrt(np.concatenate(squares).mean())) if squares else float("nan")

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        unit = unit_text(self.knob.unit)
        ends = f"before {number(self.knob.before, 3)}, after {number(self.knob.after, 3)}"
        what = f"{self.knob.symbol} = {number(self.value, 3)} {unit}".rstrip()
        what_error = f"{self.metric} error of {self.horizon} s predictions{self.told.some}"
        told = f"{what_error}: {number(self.error, 2)} {ROLLOUT_UNITS[self.metric]}"
        how = [] if find_spec("ipywidgets") else [("slider", _HOW)]
        return [("number", f"{what} ({self.knob.what}; {ends})"), ("error", told), *how]

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
        stream = io.StringIO()
        with matplotlib.rc_context(_LOOK):
            figure = Figure(figsize=(9.0, 5.0), layout="constrained")
            FigureCanvasAgg(figure)
            self.draw(pd.concat(moved), list(figure.subplots(3, 1, sharex=True)))
            figure.savefig(stream, format="svg", metadata={"Date": None})
        return Html(stream.getvalue()[stream.getvalue().index("<svg") :])

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


def _states(motion: Motion) -> Array:
    return np.column_stack([motion.position, motion.heading, motion.velocity])
