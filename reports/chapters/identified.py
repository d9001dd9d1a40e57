"""What the log can show and tell apart, and which manoeuvres would settle what it leaves open."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..figures_excitation import excitation
from ..markup import Html, element, figure, render
from ..run_folder import RunFolder
from ..wording import listing, typeset, words


def identified(run: RunFolder) -> Html:
    """Effects that look alike in this log, those that leave no trace, how far each is excited, and the advice."""
    told: Mapping[str, Any] = run.findings.get("identifiability") or {}
    advice = _advice(run.findings.get("advice") or [])
    if not told and not advice:
        return Html("")
    parts: list[Html] = [element("h2", "What this log can tell")]
    if told:
        decided = [
            str(item["effect"])
            for item in run.findings["candidates"]
            if item["verdict"] == "missing" and not item.get("indistinguishable_from")
        ]
        facts = element("div", *_facts(told, decided), cls="card")
        excited = told.get("excitation") or {}
        shown = {str(name): share for name, share in excited.items() if isinstance(share, Mapping)}
        drawing = [
            figure(
                [excitation(shown)],
                "Force that a plausible amount of each effect would make in this log, as a share of the force at work "
                "on its axis. An effect with a short bar can hide in this log, however large it may be elsewhere.",
                cls="one",
            )
        ] * bool(shown)
        parts.append(element("div", facts, *drawing, cls="columns"))
    if advice:
        parts.append(element("div", element("h3", "What to record next"), element("ul", *advice), cls="card"))
    return render(*parts)


def _facts(told: Mapping[str, Any], decided: Sequence[str] = ()) -> list[Html]:
    """Sentences on what cannot be told apart or seen; one that says all is well where none is needed.

    Parameters
    ----------
    decided : effects that are missing for sure, with none that does as well in their place
    """
    lines = []
    for group in told.get("groups") or []:
        chosen = [name for name in group if str(name).split("[")[0] in decided]
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
    for group in told.get("noise_limited") or []:
        lines.append(f"Sensor noise hides the difference between {_names(group)}.")
    if told.get("dormant"):
        lines.append(f"Never excited, so neither found nor excluded: {_names(told['dormant'])}.")
    if told.get("absorbed"):
        lines.append(f"No trace beside what the calibration explains: {_names(told['absorbed'])}.")
    if told.get("quiet_axes"):
        axes = listing([str(axis) for axis in told["quiet_axes"]])
        lines.append(f"Hardly moves beyond sensor noise: {axes}. Little can be said of its effects.")
    if not lines:
        lines.append("Every effect of the catalogue that the log's channels allow is excited and can be told apart.")
    parts = [element("h3", "Alike, hidden, or never excited"), element("ul", *(element("li", line) for line in lines))]
    condition = told.get("condition")
    if isinstance(condition, int | float):
        parts.append(
            element(
                "p",
                f"Condition number of all effects together: {typeset(float(condition), 2)} (1 is ideal; in the "
                "thousands, some mixtures of effects cannot be told apart).",
                cls="facts",
            )
        )
    return parts


def _names(names: Sequence[Any]) -> str:
    return listing([words(str(name)) for name in names])


def _advice(items: Sequence[Mapping[str, Any]]) -> list[Html]:
    return [element("li", element("b", str(item.get("manoeuvre", ""))), f": {item.get('why', '')}") for item in items]
