"""Measured against predicted: motion over time and from above, accelerations as scatter, their errors as histograms."""

import pandas as pd

from ....comparison.facts import Comparison
from ....physics.motion import AXES
from ....physics.presentation import unit_text
from ....residuals.scores import ACCELERATION_UNITS
from ...band_words import band_words, held_words
from ...run_contents import RunFolder
from ...wording import goodness, ordinal, typeset
from ..figures.error_figures import histogram, scatter, scatter_stride
from ..figures.figures import speeds, track
from ..judged_pieces import MODELS, held_out_rows, liveliest_stretch
from ..markup import Html, figure, render
from .base import Chapter, Section
from .verdict import legend

ARROW = "\N{RIGHTWARDS ARROW}"


def agreement(run: RunFolder) -> Section:
    """Speeds over time and the track, then the accelerations of all held-out rows."""
    seen = motion(run.series, "that the fit never saw", run.comparison, "corrected")
    return Section("Measured against predicted", render(seen, legend(MODELS), *_pointwise(run)))


def motion(series: pd.DataFrame, which: str, comparison: Comparison, after: str) -> Html:
    """Measured and predicted speeds over time, and the track, with the key of their colours.

    Parameters
    ----------
    series : of the nominal model, and of the model whose name is `after`
    which : what motion it is, in words
    comparison : holds the band of the second model
    """
    drawn = next((model for model in comparison.models if model.band is not None), None)
    banded = drawn is not None and "position_band" in series
    told = [band_words(drawn.band), held_words(drawn.held, drawn.name)] if drawn is not None and banded else []
    roles = ("measured", "before", "after", *["band"] * banded)
    stretch = liveliest_stretch(series)
    seconds = stretch["time"].iloc[-1] - stretch["time"].iloc[0]
    over_time = figure(
        [speeds(stretch)],
        f"The {typeset(float(seconds), 2)} s with the most motion {which}. At each dotted line the predictions start "
        "again from the measured state and then run open loop: the farther a coloured line strays before the next one, "
        f"the worse the model. Lines that leave the frame go on outside it. {' '.join(told)}".rstrip(),
        cls="wide",
    )
    from_above = figure(
        [track(stretch)],
        "The same motion from above. Every branch that leaves the measured track is one prediction; circles mark "
        f"the starts{', discs the band where a prediction ends' * banded}.",
        cls="one",
    )
    return render(legend(roles, after), over_time, from_above)


def _pointwise(run: RunFolder) -> list[Html]:
    """The scatter and the histogram of each axis, on the held-out rows."""
    rows, held_out = held_out_rows(run.series)
    source = "held-out rows" if held_out else "rows of the log (none is held out)"
    drawings, outside = [], 0
    for axis in AXES:
        drawing, beyond = scatter(rows, axis, _title(run.comparison, axis, "r2", "R²", ""))
        drawings.append(drawing)
        outside += beyond
    stride = scatter_stride(rows)
    shown = "the" if stride == 1 else f"every {ordinal(stride)} of the"
    some = "1 prediction lies" if outside == 1 else f"{outside} predictions lie"
    left_out = f" {some} outside the frames." if outside else ""
    scattered = figure(
        drawings,
        f"Accelerations of {shown} {source}, along the measured motion: a point on the dashed line is predicted "
        "exactly, and points that leave it in a curve or a band are physics that the model has wrong. A round cloud "
        f"about zero is an axis that hardly moves beyond the noise of the sensors.{left_out}",
        cls="three",
    )
    bars = [
        histogram(rows, axis, _title(run.comparison, axis, "rmse", "rms", unit_text(ACCELERATION_UNITS[axis])))
        for axis in AXES
    ]
    errors = figure(
        bars,
        "How often a prediction errs by how much. A narrow hill at zero is a good model, a hill beside zero is a bias, "
        "and a wide or double hill is physics that depends on the motion and is not in the model. The outermost bars "
        "also hold what lies beyond them.",
        cls="three",
    )
    return [scattered, errors]


def _title(comparison: Comparison, axis: str, key: str, name: str, unit: str) -> str:
    """The axis, and the figure of the nominal and the corrected model as the comparison has it."""
    values = [
        (model.acceleration.r2 if key == "r2" else model.acceleration.rmse).of(axis)
        for wanted in ("nominal", "corrected")
        for model in comparison.models
        if model.name == wanted
    ]
    known = [goodness(value) if key == "r2" else typeset(value, 2) for value in values if value == value]
    return f"{axis}   {name} {f' {ARROW} '.join(known)} {unit}".rstrip() if known else axis


AGREEMENT = Chapter(60, agreement, folded=True)
