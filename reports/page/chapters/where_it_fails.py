"""The page's section on where the models fail: map before and after, regimes, times, and the structure of the error."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from ....comparison.facts import CORRECTED, Comparison
from ....comparison.failing.failures import Structure
from ....comparison.failing.places import FailingSeconds
from ....comparison.failing.rows import scene
from ....discovery.findings import FailingPlace
from ....physics.motion import AXES
from ....physics.presentation import NARROW, percent, share_removed, unit_text, words
from ....residuals.scores import ACCELERATION_UNITS
from ....residuals.series import SeriesTable
from ...run_contents import RunFolder
from ...wording import models_sentence, typeset
from ..figures.error_figures import by_heading, error_map, heat_steps, local_error, regime_table, spectra
from ..figures.figures import regime_bars
from ..figures.svg import HEAT
from ..judged_pieces import regime_rows
from ..markup import Html, element, enlargeable, figure, lines, render, table
from .base import Chapter, Section
from .verdict import legend

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
    source = (
        "held-out data" if held_out else "all parts of the log, because the held-out part alone is too short for a map"
    )
    bars = figure(
        regime_bars(regime_table(rows, "before"), regime_table(rows, "after")),
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
    errors = [local_error(longest, model, axis) for model in ("before", "after")]
    bounds = heat_steps(float(scene(SeriesTable.of(longest)).spread[axis]), errors)
    titles = ["before: the nominal model", f"after: the {after} model"]
    alone = np.array_equal(*errors, equal_nan=True)
    if alone:
        errors, titles = errors[:1], ["the nominal model"]
    drawings = [error_map(longest, error, bounds, title, axis) for error, title in zip(errors, titles, strict=True)]
    texts = [
        f"under {bounds[0]:g}",
        *(f"{low:g} to {low + bounds[0]:g}" for low in bounds[:-1]),
        f"{bounds[-1]:g} and more",
    ]
    unit = unit_text(ACCELERATION_UNITS[AXES[axis]])
    key = element(
        "div",
        element("span", f"{AXES[axis]} acceleration error [{unit}]:"),
        *(element("span", element("i"), text, cls=role) for role, text in zip(HEAT, texts, strict=True)),
        cls="key",
    )
    several = " of the longest log" if series["log"].nunique() > 1 else ""
    caption = (
        f"The whole track{several} from above; the circle is its start. Thick, strong strokes are where the modelled "
        f"{AXES[axis]} acceleration errs, beside how large it usually is; "
        + ("nothing was added, so there is one map." if alone else "strokes that are gone after are what was missing.")
    )
    return element(
        "figure",
        key,
        element("div", *map(enlargeable, drawings), cls="plots pair"),
        element("figcaption", caption),
        cls="card",
    )


def _worst_axis(series: pd.DataFrame) -> int:
    """The axis on which the first model errs most, as a share of what is measured there."""
    names = ("u_dot", "v_dot", "r_dot")
    error = [float(np.nanstd(series[f"{name}_before"] - series[name])) for name in names]
    return int(np.argmax([e / max(float(np.nanstd(series[n])), 1e-12) for e, n in zip(error, names, strict=True)]))


def _worst(places: Sequence[FailingPlace], whose: str) -> Html:
    """The regimes in which the error gathers, and what removes it; `whose` says of which models that is told."""
    if not places:
        text = f"No regime stands out: what error there is, is spread evenly. {whose}".rstrip()
        return element("p", text, cls="facts")
    rows = [
        (
            place.model,
            place.where,
            place.axis,
            percent(place.share_of_error),
            f"{place.rows} rows" if place.share_of_rows is None else percent(place.share_of_rows),
            _fall(place),
            _removed(place),
        )
        for place in places
    ]
    head = (
        "model",
        "where its error gathers",
        "axis",
        "share of the error",
        "of the time",
        "error there",
        "removed by",
    )
    note = (
        "A regime is told when one half of the log proposes it and the other half agrees. An effect is named when "
        "adding it removes error there on held-out rows too; the percentage is of the squared error, and "
        "'more than all' where other effects, alone, would add to it."
    )
    return element(
        "div", table(head, rows, "lllrrrl"), element("p", f"{whose} {note}".lstrip(), cls="facts"), cls="card"
    )


def _times(structure: Sequence[Structure]) -> Html:
    """The stretches of time with the largest error."""
    linked = any(place.removed_by or place.unlinked for one in structure for place in one.segments)
    rows = [
        (
            one.model,
            f"{place.begin:.0f} to {place.end:.0f} s".replace(" ", NARROW) + f", log {place.log + 1}" * bool(place.log),
            place.doing,
            place.axis,
            percent(place.share_of_error),
            _fall(place),
            *[_removed(place)] * linked,
        )
        for one in structure
        for place in one.segments
    ]
    if not rows:
        return Html("")
    head = (
        "model",
        "when",
        "what the boat was doing",
        "axis",
        "share of the error",
        "error then",
        *["removed by"] * linked,
    )
    unseen = "An effect is named where adding it removes the error of seconds that it was not fitted to."
    note = [element("p", unseen, cls="facts")] * linked
    return element("div", element("h3", "The worst seconds"), table(head, rows, "llllrrl"), *note, cls="card")


def _structure(structure: Sequence[Structure]) -> Html:
    """What the errors are like: spectra, headings, and in words."""
    known = [one for one in structure if one.frequency[AXES[0]].hz]
    if not known:
        return Html("")
    frequency, heading = [one.frequency for one in known], [one.heading for one in known]
    fast = figure(
        [spectra(frequency, axis) for axis in AXES],
        "Power of the measured acceleration and of the errors by frequency. An orange line as high as the measured one "
        "on the left is a slow force that is missing; where both errors meet on the right, it is noise.",
        cls="trio",
    )
    turned = figure(
        [by_heading(heading, axis) for axis in AXES],
        "Median error by heading, with the range of its middle half. Points that rise and fall once around the compass "
        "are a current, a wind or a compass error; points on the line are none of these.",
        cls="trio",
    )
    first = structure[0]
    told = []
    for title, look in zip(_LOOKS, (first.frequency, first.lag, first.heading, first.drift), strict=True):
        sentences = [f"{axis}: {look[axis].sentence}" for axis in AXES]
        told += [element("dt", title), *(element("dd", text) for text in sentences)]
    in_words = element(
        "div",
        element("h3", f"The error of the {first.model} model in words"),
        element("dl", *told, cls="told"),
        cls="card",
    )
    key = legend(("measured", "before", "after") if len(known) > 1 else ("measured", "before"), structure[-1].model)
    return render(element("h3", "What the error is like"), key, fast, turned, in_words)


def _fall(place: FailingPlace | FailingSeconds) -> Html:
    """Error in a place, before and below it after where both are known: a cell so narrow that none cuts it."""
    ends = [end for end in (place.rmse, place.rmse_after) if end is not None]
    unit, signs = unit_text(place.unit), ("", "\N{RIGHTWARDS ARROW} ")
    return render(*lines(f"{sign}{typeset(end, 2)} {unit}" for sign, end in zip(signs, ends, strict=False)))


def _removed(place: FailingPlace | FailingSeconds) -> Html:
    if not place.removed_by and place.unlinked:
        return element("span", place.unlinked, cls="facts")
    return render(*lines(f"{words(one.effect)} ({share_removed(one.share_removed)})" for one in place.removed_by))


WHERE_IT_FAILS = Chapter(70, where_it_fails, folded=True)
