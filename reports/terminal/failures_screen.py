"""Where the models fail, on the terminal: the worst places with what removes them, and what the error is like."""

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ...comparison.failing.failures import Structure
from ...discovery.findings import FailingPlace
from ...physics.frames import AXES
from ...physics.in_words import number, percent, share_removed, unit_text, words
from .layout import Fitting, Prose, glossary, plain_table, section

_NEWS = {
    *("slow force", "answer to commands", "slow, of unknown origin"),
    *("early", "late"),
    "depends on heading",
    *("drifts", "grows", "shrinks"),
}
"""Verdicts of the looks at an error that are news."""


def failures_table(places: Sequence[FailingPlace], whose: str = "") -> RenderableType:
    """Where the models fail; `whose` says of which models that is told.

    What removes the error stands in a column of its own where there is room, else below the place.
    """
    return Fitting([_failures_in(places, whose, beside) for beside in (True, False)])


def structure_list(structure: Sequence[Structure]) -> RenderableType | None:
    """What is plain about the error of the first model by frequency, lag, heading and time; None when nothing is."""
    if not structure:
        return None
    first = structure[0]
    looks = (first.frequency, first.lag, first.heading, first.drift)
    pairs = [(axis, unit_text(told[axis].sentence)) for axis in AXES for told in looks if told[axis].verdict in _NEWS]
    return section(f"What the error of the {first.model} model is like", glossary(pairs)) if pairs else None


def _failures_in(places: Sequence[FailingPlace], whose: str, beside: bool) -> Table:
    rows_of = {place.rows_of for place in places if place.rows_of is not None}
    title = f"Where it fails ({', '.join(map(_rows_in_words, sorted(rows_of)))})" if rows_of else "Where it fails"
    known = any(place.removed_by for place in places)
    caption = "Removed by: adding it lowers the error there on held-out rows too." if known else ""
    if any(one.share_removed > 1.0 for place in places for one in place.removed_by):
        caption += " More than all: others, alone, would add to it."
    caption = caption if places else "The error is spread evenly: no regime stands out."
    table = plain_table(title, " ".join(filter(None, (whose, caption))))
    table.show_header = bool(places)
    table.add_column("model", no_wrap=True)
    table.add_column("where")
    table.add_column("axis", no_wrap=True)
    table.add_column("share of\nerror", justify="right", no_wrap=True)
    table.add_column("share of\ntime", justify="right", no_wrap=True)
    table.add_column("error\nthere", justify="right", no_wrap=True)
    if known and beside:
        table.add_column("removed by", no_wrap=True)
    for place in places:
        removed = [f"{words(one.effect)} {share_removed(one.share_removed)}" for one in place.removed_by]
        below = [] if beside or not removed else [f"removed by {', '.join(removed)}"]
        if place.unlinked:
            below.append(f"removed by: {place.unlinked}")
        table.add_row(
            Text(place.model),
            Group(*map(Prose, [place.where, *below])),
            Text(place.axis),
            percent(place.share_of_error),
            percent(place.share_of_rows, blank=""),
            Text("" if place.rmse is None else f"{number(place.rmse, 2)} {unit_text(place.unit)}"),
            *[Text("\n".join(removed))] * (known and beside),
        )
    return table


def _rows_in_words(rows_of: str) -> str:
    return {"all": "whole log", "test": "held-out part"}.get(rows_of, f"{rows_of} part")
