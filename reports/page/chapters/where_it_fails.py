"""Where models fail and agree: maps, regimes, times and the structure of errors; measured against predicted motion."""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from ....comparison.facts import CORRECTED, Comparison
from ....comparison.failing.failures import Structure
from ....comparison.failing.places import FailingSeconds
from ....comparison.failing.rows import ACCELERATIONS, scene
from ....discovery.findings import FailingPlace
from ....physics.motion import AXES
from ....physics.presentation import NARROW, percent, share_removed, unit_text, words
from ....residuals.scores import ACCELERATION_UNITS
from ....residuals.series import SeriesTable
from ...model_words import band_words, held_words
from ...run_contents import RunFolder
from ...wording import goodness, models_sentence, ordinal, typeset
from ..figures import error_figures as draw
from ..figures.model_figures import speeds, track
from ..figures.svg import HEAT
from ..judged_pieces import MODELS, held_out_rows, liveliest_stretch, regime_rows
from ..markup import Html, card, element, enlargeable, figure, lines, listed, render
from .base import Chapter, Section
from .verdict import ARROW, legend

TITLE = "Where it fails"
_LOOKS = ("Fast or slow", "Early or late", "With the heading", "Over time")


def where_it_fails(run: RunFolder) -> Section:
    """Where the error of a run gathers before and after."""
    return Section(TITLE, failing(run.comparison, run.series, run.findings.failures))


def failing(comparison: Comparison, series: pd.DataFrame, known: Sequence[FailingPlace] = ()) -> Html:
    """Where the error gathers before and after: from above, by regime, in time, by frequency and heading.

    Parameters
    ----------
    series : of the two models of which the comparison tells that
    known : the places where it tells none
    """
    places, structure = comparison.failures or known, comparison.structure
    after = structure[-1].model if len(structure) > 1 else CORRECTED
    rows, held_out = regime_rows(series)
    whole = "all parts of the log, because the held-out part alone is too short for a map"
    source = "held-out data" if held_out else whole
    bars = figure(
        draw.regime_bars(draw.regime_table(rows, "before"), draw.regime_table(rows, "after")),
        f"Root-mean-square acceleration error by regime, on {source}. A tall orange bar beside a short blue one "
        "is a regime that the missing effects explain; two tall bars are a regime that still waits for its reason. "
        "The percentage under each bin is its share of the time.",
        cls="pair",
    )
    return render(
        _maps(series, places, after),
        _worst(places, models_sentence(comparison.models, structure)),
        legend(("before", "after"), after),
        bars,
        _times(structure),
        _structure(structure),
    )


def _maps(series: pd.DataFrame, places: Sequence[FailingPlace], after: str) -> Html:
    """The longest log from above, before and after, on one scale of colour."""
    axis = AXES.index(places[0].axis) if places and places[0].axis in AXES else _worst_axis(series)
    longest = series[series["log"] == series["log"].value_counts(sort=False).idxmax()]
    errors = [draw.local_error(longest, model, axis) for model in ("before", "after")]
    bounds = draw.heat_steps(float(scene(SeriesTable.of(longest)).spread[axis]), errors)
    titles = ["before: the nominal model", f"after: the {after} model"]
    alone = np.array_equal(*errors, equal_nan=True)
    if alone:
        errors, titles = errors[:1], ["the nominal model"]
    maps = zip(errors, titles, strict=True)
    drawings = [draw.error_map(longest, error, bounds, title, axis) for error, title in maps]
    between = [f"{low:g} to {low + bounds[0]:g}" for low in bounds[:-1]]
    texts = [f"under {bounds[0]:g}", *between, f"{bounds[-1]:g} and more"]
    unit = unit_text(ACCELERATION_UNITS[AXES[axis]])
    key = element(
        "div.key",
        element("span", f"{AXES[axis]} acceleration error [{unit}]:"),
        *(element("span", element("i"), text, cls=role) for role, text in zip(HEAT, texts, strict=True)),
    )
    several = " of the longest log" if series["log"].nunique() > 1 else ""
    caption = (
        f"The whole track{several} from above; the circle is its start. Thick, strong strokes are where the modelled "
        f"{AXES[axis]} acceleration errs, beside how large it usually is; "
        + ("nothing was added, so there is one map." if alone else "strokes that are gone after are what was missing.")
    )
    pair = element("div.plots pair", *map(enlargeable, drawings))
    return element("figure.card", key, pair, element("figcaption", caption))


def _worst_axis(series: pd.DataFrame) -> int:
    """The axis on which the first model errs most, as a share of what is measured there."""
    error = [np.nanstd(series[f"{name}_before"] - series[name]) for name in ACCELERATIONS]
    usual = [np.nanstd(series[name]) for name in ACCELERATIONS]
    return int(np.argmax(np.array(error) / np.maximum(usual, 1e-12)))


def _worst(places: Sequence[FailingPlace], whose: str) -> Html:
    """The regimes in which the error gathers, and what removes it; `whose` says of which models that is told."""
    if not places:
        return element("p.facts", f"No regime of speeds, turns or commands stands out in the error. {whose}".rstrip())
    columns: dict[str, Callable[[FailingPlace], str]] = {
        "model": lambda place: place.model,
        "where its error gathers": lambda place: place.where,
        "axis": lambda place: place.axis,
        "share of the error": lambda place: percent(place.share_of_error),
        "of the time": lambda p: f"{p.rows} rows" if p.share_of_rows is None else percent(p.share_of_rows),
        "error there": _fall,
        "removed by": _removed,
    }
    note = (
        "A regime is told when one half of the log proposes it and the other half agrees. An effect is named when "
        "adding it removes error there on held-out rows too; the percentage is of the squared error, and "
        "'more than all' where other effects, alone, would add to it."
    )
    return card(listed(places, columns, "lllrrrl"), element("p.facts", f"{whose} {note}".lstrip()))


def _times(structure: Sequence[Structure]) -> Html:
    """The stretches of time with the largest error."""
    found = [(one.model, place) for one in structure for place in one.segments]
    if not found:
        return Html("")
    columns: dict[str, Callable[[tuple[str, FailingSeconds]], str]] = {
        "model": lambda one: one[0],
        "when": lambda one: _span(one[1]),
        "what the boat was doing": lambda one: one[1].doing,
        "axis": lambda one: one[1].axis,
        "share of the error": lambda one: percent(one[1].share_of_error),
        "error then": lambda one: _fall(one[1]),
    }
    note = []
    if any(place.removed_by or place.unlinked for _, place in found):
        columns["removed by"] = lambda one: _removed(one[1])
        unseen = "An effect is named where adding it removes the error of seconds that it was not fitted to."
        note = [element("p.facts", unseen)]
    return card(element("h3", "The worst seconds"), listed(found, columns, "llllrrl"), *note)


def _span(place: FailingSeconds) -> str:
    log = f", log {place.log + 1}" * bool(place.log)
    return f"{place.begin:.0f} to {place.end:.0f} s".replace(" ", NARROW) + log


def _structure(structure: Sequence[Structure]) -> Html:
    """What the errors are like: spectra, headings, and in words."""
    known = [one for one in structure if one.frequency[AXES[0]].hz]
    if not known:
        return Html("")
    frequency, heading = [one.frequency for one in known], [one.heading for one in known]
    fast = figure(
        [draw.spectra(frequency, axis) for axis in AXES],
        "Power of the measured acceleration and of the errors by frequency. An orange line as high as the measured one "
        "on the left is a slow force that is missing; where both errors meet on the right, it is noise.",
        cls="trio",
    )
    turned = figure(
        [draw.by_heading(heading, axis) for axis in AXES],
        "Median error by heading, with the range of its middle half. Points that rise and fall once around the compass "
        "are a current, a wind or a compass error; points on the line are none of these.",
        cls="trio",
    )
    told = []
    for title, look in zip(_LOOKS, structure[0].looks, strict=True):
        told += [element("dt", title), *(element("dd", f"{axis}: {look[axis].sentence}") for axis in AXES)]
    title = element("h3", f"The error of the {structure[0].model} model in words")
    in_words = card(title, element("dl.told", *told))
    key = legend(("measured", "before", "after") if len(known) > 1 else ("measured", "before"), structure[-1].model)
    return render(element("h3", "What the error is like"), key, fast, turned, in_words)


def _fall(place: FailingPlace | FailingSeconds) -> Html:
    """Error in a place, before and below it after where both are known: a cell so narrow that none cuts it."""
    ends = [end for end in (place.rmse, place.rmse_after) if end is not None]
    unit, signs = unit_text(place.unit), ("", f"{ARROW} ")
    return lines(f"{sign}{typeset(end, 2)} {unit}" for sign, end in zip(signs, ends, strict=False))


def _removed(place: FailingPlace | FailingSeconds) -> Html:
    if not place.removed_by and place.unlinked:
        return element("span.facts", place.unlinked)
    return lines(f"{words(one.effect)} ({share_removed(one.share_removed)})" for one in place.removed_by)


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
    scatters = [draw.scatter(rows, axis, _title(run.comparison, axis, "r2", "R²", "")) for axis in AXES]
    outside = sum(beyond for _, beyond in scatters)
    stride = draw.scatter_stride(rows)
    shown = "the" if stride == 1 else f"every {ordinal(stride)} of the"
    some = "1 prediction lies" if outside == 1 else f"{outside} predictions lie"
    left_out = f" {some} outside the frames." if outside else ""
    scattered = figure(
        [drawing for drawing, _ in scatters],
        f"Accelerations of {shown} {source}, along the measured motion: a point on the dashed line is predicted "
        "exactly, and points that leave it in a curve or a band are physics that the model has wrong. A round cloud "
        f"about zero is an axis that hardly moves beyond the noise of the sensors.{left_out}",
        cls="three",
    )
    units = {axis: unit_text(ACCELERATION_UNITS[axis]) for axis in AXES}
    errors = figure(
        [draw.histogram(rows, axis, _title(run.comparison, axis, "rmse", "rms", unit)) for axis, unit in units.items()],
        "How often a prediction errs by how much. A narrow hill at zero is a good model, a hill beside zero is a bias, "
        "and a wide or double hill is physics that depends on the motion and is not in the model. The outermost bars "
        "also hold what lies beyond them.",
        cls="three",
    )
    return [scattered, errors]


def _title(comparison: Comparison, axis: str, key: str, name: str, unit: str) -> str:
    """The axis, and the figure of the nominal and the corrected model as the comparison has it."""
    scores = {model.name: model.acceleration for model in comparison.models}
    values = [getattr(scores[name], key).of(axis) for name in ("nominal", "corrected") if name in scores]
    known = [goodness(value) if key == "r2" else typeset(value, 2) for value in values if value == value]
    return f"{axis}   {name} {f' {ARROW} '.join(known)} {unit}".rstrip() if known else axis


AGREEMENT = Chapter(60, agreement, folded=True)
WHERE_IT_FAILS = Chapter(70, where_it_fails, folded=True)
