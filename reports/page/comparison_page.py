"""The page of a comparison: which model to trust, how errors grow, the motion as it was predicted, where that fails."""

from pathlib import Path

from ...physics.in_words import listing, unit_text
from ..run_contents import ComparisonFolder
from ..wording import judged_rows
from .chapters.agreement import motion
from .chapters.models import TITLE, models
from .chapters.where_it_fails import TITLE as WHERE
from .chapters.where_it_fails import failing
from .figures.growth_figure import growth
from .markup import Html, element, figure, render
from .page import document

GROWTH = (
    "Root mean square over predictions from every half second, open loop from measured states: lower is better. A "
    "dashed line is a guess that knows nothing of the boat: a model above it is of no use at that length."
)

MOST = 3  # logs that a line names before it counts them


def comparison_page(folder: ComparisonFolder) -> str:
    """The HTML text of the page."""
    found = folder.comparison
    ends = list(dict.fromkeys([found.models[0].name, *(one.model for one in found.structure)]))
    verdict, _, why = found.best.sentence.partition(": ")
    several = len(found.logs) > 1
    logs = listing([Path(log).name for log in found.logs]) if len(found.logs) <= MOST else f"{len(found.logs)} logs"
    rows = judged_rows(found.split)
    fitted = [model.name for model in found.models if model.fitted_here]
    not_counted = f" Marked, because fitted to rows that are judged: {listing(fitted)}." if fitted else ""
    sections = [
        *(element("p", unit_text(text), cls="card warning") for text in found.warnings),
        element("h1", f"{verdict}." if why else verdict),
        *[element("p", unit_text(f"{why[:1].upper()}{why[1:]}"), cls="lead")] * bool(why),
        element("p", f"Judged on {rows} of {logs}.{not_counted}", cls="lead"),
        element("h2", TITLE),
        models(found.but(best=found.best.but(sentence=""))),
        element("h2", "How the error grows"),
        figure([growth(found.models, ends)], GROWTH, cls="wide"),
        element("h2", "Measured against predicted"),
        motion(folder.series, f"of {'one of the logs' if several else logs}", found, ends[-1]),
        _folded(WHERE, failing(found, folder.series)),
    ]
    return document(logs, f"models compared on {logs}", sections)


def _folded(title: str, body: Html) -> Html:
    return element("section", element("details", element("summary", element("h2", title)), render(body), cls="folded"))
