"""Chapters on identifiability: what the log can tell apart, and which manoeuvres would settle what it leaves open."""

from collections.abc import Sequence

from ....discovery.findings import Advice
from ....discovery.identifiability.rehearsal import Identifiability
from ....physics.presentation import listing, words
from ...run_contents import RunFolder
from ...wording import typeset
from ..figures.effect_figures import excitation
from ..markup import Html, element, figure
from .base import Chapter, Section


def identified(run: RunFolder) -> Section | None:
    """Effects that look alike in this log, those that leave no trace, and how far each is excited."""
    told = run.findings.identifiability
    if told is None:
        return None
    decided = [
        item.effect for item in run.findings.candidates if item.verdict == "missing" and not item.indistinguishable_from
    ]
    facts = element("div", *_facts(told, decided), cls="card")
    drawing = [
        figure(
            [excitation(told.excitation)],
            "Force that a plausible amount of each effect would make in this log, as a share of the force at work "
            "on its axis. An effect with a short bar can hide in this log, however large it may be elsewhere.",
            cls="one",
        )
    ] * bool(told.excitation)
    return Section("What this log can tell", element("div", facts, *drawing, cls="columns"))


def _facts(told: Identifiability, decided: Sequence[str] = ()) -> list[Html]:
    """Sentences on what cannot be told apart or seen; one that says all is well where none is needed.

    Parameters
    ----------
    decided : effects that are missing for sure, with none that does as well in their place
    """
    lines = []
    for group in told.groups:
        chosen = [name for name in group if name.split("[")[0] in decided]
        alike = f"{_names(group).capitalize()} move alike in this log"
        if chosen and len(chosen) < len(group):
            verb = "fits" if len(chosen) == 1 else "fit"
            lines.append(
                f"{alike}, but not so much that they could not be told apart: {_names(chosen)} {verb} held-out data "
                "clearly better than any of the others alone. A mixture may fit as well, so a part of the value may "
                "be theirs."
            )
        else:
            lines.append(f"{alike}; a mixture of them may fit as well as one.")
    if told.noise_limited:
        lines.append(f"Hardly more than sensor noise: {_names(told.noise_limited)}.")
    if told.dormant:
        lines.append(f"Never excited, so neither found nor excluded: {_names(told.dormant)}.")
    if told.absorbed:
        lines.append(f"No trace beside what the calibration explains: {_names(told.absorbed)}.")
    if told.quiet_axes:
        axes = listing(told.quiet_axes)
        lines.append(f"Hardly moves beyond sensor noise: {axes}. Little can be said of its effects.")
    if not lines:
        lines.append("Every effect of the catalogue that the log's channels allow is excited and can be told apart.")
    parts = [element("h3", "Alike, hidden, or never excited"), element("ul", *(element("li", line) for line in lines))]
    if told.condition is not None:
        parts.append(
            element(
                "p",
                f"Condition number of all effects together: {typeset(told.condition, 2)} (1 is ideal; in the "
                "thousands, some mixtures of effects cannot be told apart).",
                cls="facts",
            )
        )
    return parts


def _names(names: Sequence[str]) -> str:
    return listing([words(name) for name in names])


def advised(items: Sequence[Advice]) -> Html:
    """Manoeuvres and what each would tell, as a list."""
    return element("ul", *(element("li", element("b", item.manoeuvre), f": {item.why}") for item in items))


def record_next(run: RunFolder) -> Section | None:
    """The manoeuvres that would settle what the log leaves open."""
    advice = run.findings.advice
    return Section("What to record next", element("div", advised(advice), cls="card")) if advice else None


ADVISED = Chapter(35, record_next, folded=True)
IDENTIFIED = Chapter(130, identified, folded=True)
