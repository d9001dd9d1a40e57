"""Where the models fail, on the terminal: the worst places with what removes them, and what the error is like."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ..layout import Fitting, Prose, glossary, plain_table, section
from ..wording import AXES, number, percent, share_removed, unit_text, words
from .whose import told_of

_WORTH_TELLING = {
    "frequency": {"slow force", "answer to commands", "slow, of unknown origin"},
    "lag": {"early", "late"},
    "heading": {"depends on heading"},
    "drift": {"drifts", "grows", "shrinks"},
}
"""Verdicts of the looks at an error that are news."""


def failures_table(failures: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> RenderableType:
    """Where the models fail: the content of `comparison.json` (or `findings.json`), or its list of failures.

    What removes the error stands in a column of its own where there is room, else below the place.
    """
    places = (failures.get("failures") or []) if isinstance(failures, Mapping) else failures
    whose = told_of(failures) if isinstance(failures, Mapping) else ""
    return Fitting([_failures_in(places, whose, beside) for beside in (True, False)])


def structure_list(comparison: Mapping[str, Any]) -> RenderableType | None:
    """What is plain about the error of the first model by frequency, lag, heading and time; None when nothing is."""
    structure = comparison.get("structure") or []
    if not structure:
        return None
    first = structure[0]
    pairs = []
    for axis in AXES:
        for look, news in _WORTH_TELLING.items():
            found = first[look][axis]
            if found["verdict"] in news:
                pairs.append((axis, unit_text(str(found["sentence"]))))
    return section(f"What the error of the {first['model']} model is like", glossary(pairs)) if pairs else None


def _failures_in(places: Sequence[Mapping[str, Any]], whose: str, beside: bool) -> Table:
    rows_of = {str(place["rows_of"]) for place in places if "rows_of" in place}
    title = f"Where it fails ({', '.join(map(_rows_in_words, sorted(rows_of)))})" if rows_of else "Where it fails"
    known = any(place.get("removed_by") for place in places)
    caption = "Removed by: adding it lowers the error there on held-out rows too." if known else ""
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
        removed = [
            f"{words(str(one['effect']))} {share_removed(one['share_removed'])}"
            for one in place.get("removed_by") or []
        ]
        where = str(place.get("where", ""))
        below = [] if beside or not removed else [f"removed by {', '.join(removed)}"]
        if place.get("unlinked"):
            below.append(f"removed by: {place['unlinked']}")
        table.add_row(
            Text(str(place.get("model", "nominal"))),
            Group(*map(Prose, [where, *below])),
            Text(str(place.get("axis", ""))),
            percent(place.get("share_of_error")),
            percent(place.get("share_of_rows"), blank=""),
            Text(f"{number(place['rmse'], 2)} {unit_text(str(place.get('unit', '')))}" if "rmse" in place else ""),
            *[Text("\n".join(removed))] * (known and beside),
        )
    return table


def _rows_in_words(rows_of: str) -> str:
    return {"all": "whole log", "test": "held-out part"}.get(rows_of, f"{rows_of} part")
