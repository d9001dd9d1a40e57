"""The section of the report page that names the missing effects and ranks every effect that was tried."""

from collections.abc import Sequence

from ....discovery.found_effects import FoundEffect, FoundTerm
from ....physics.in_words import listing, percent, share_removed, unit_text
from ...run_contents import RunFolder
from ...wording import added_to, effect_words, interval, risen, twins, within
from ..coefficients import coefficient_rows
from ..figures.figures import coefficients, ranked_effects
from ..markup import Html, element, figure, folded, lines, render, table
from ..outcome import hero
from .base import Chapter, Section


def missing_effects(run: RunFolder) -> Section:
    """The effects to add as sentences with equations, the ranking of all candidates, and terms without a name."""
    findings = run.findings
    candidates, unnamed = findings.candidates, findings.unnamed
    chosen = findings.added
    doubted = [item for item in chosen if item.verdict != "missing"]
    undecided = (
        "What may be missing" if findings.verdict == "undecided" else "Nothing is missing that this log can show"
    )
    horizon, _ = hero(findings.steps, run.comparison.best.horizon)
    cards = [_effect(item, risen(findings.steps, horizon, item)) for item in chosen]
    parts = [element("div", *cards, cls="columns")] * bool(chosen)
    drawings = []
    if candidates:
        caption = (
            "The share of held-out error that each effect removes beside the others, on the axis where that is most, "
            "and how sure that is. Blue effects are in the corrected model"
            + (", those with a rim alone are in it without being certain." if doubted else ".")
        )
        drawings.append(figure([ranked_effects(candidates)], caption))
    rows = coefficient_rows(candidates, [item.effect for item in chosen], run.nominal, run.corrected)
    if rows:
        caption = (
            "From the nominal value (ring) to the corrected one (dot) with its 95 % interval (band). Each row has its "
            "own scale; the line is zero."
        )
        drawings.append(figure([coefficients(rows)], caption))
    parts.append(element("div", *drawings, cls="columns"))
    if candidates:
        parts.append(folded("Every effect that was tried, best first", *_tried(candidates)))
    if unnamed:
        parts.append(element("div", *_unnamed(unnamed), cls="card"))
    return Section("What is missing" if len(chosen) > len(doubted) else undecided, render(*parts))


def _effect(item: FoundEffect, worse: Sequence[str]) -> Html:
    values = [element("div", element("b", _value(term)), f"  (95 %: {interval(term.ci95)})") for term in item.terms]
    removed, sure = share_removed(item.error_drop), percent(item.confidence)
    others = twins(item)
    return element(
        "div",
        element("h3", effect_words(item).capitalize()),
        element("p", unit_text(item.sentence)),
        *[element("div", item.equation, cls="equation")] * bool(item.equation),
        *values,
        *[element("p", f"{added_to(item)} value.", cls="facts")] * bool(added_to(item)),
        element(
            "p", f"Removes {removed} of an axis's held-out error, beside the others; confidence {sure}.", cls="facts"
        ),
        *(element("p", text, cls="warn") for text in worse),
        *[element("p", f"This log cannot tell it from {listing(others)}.", cls="warn")] * bool(others),
        cls="card effect" if item.verdict == "missing" else "card effect doubted",
    )


def _tried(candidates: Sequence[FoundEffect]) -> list[Html]:
    """What has evidence, or cannot be judged; then what has none, folded away."""
    without = [item for item in candidates if item.verdict == "no evidence"]
    others = [item for item in candidates if item.verdict != "no evidence"]
    parts = [_candidates(others)] * bool(others)
    if without:
        summary = element("summary", f"{len(without)} effects without evidence")
        parts.append(element("details", summary, _candidates(without)))
    return parts


def _candidates(candidates: Sequence[FoundEffect]) -> Html:
    rows = []
    for item in candidates:
        unseen, terms, verdict = item.cannot_tell, item.terms, item.verdict
        rows.append(
            (
                effect_words(item),
                element(
                    "span",
                    "cannot tell" if unseen else verdict,
                    cls=f"tag {verdict}" if verdict in ("missing", "possible") else "tag",
                ),
                render(*lines(map(_value, terms))),
                render(*lines(interval(term.ci95) for term in terms)),
                "" if unseen else share_removed(item.error_drop),
                "" if unseen else percent(item.confidence),
                render(*lines(twins(item))),
            )
        )
    head = ("effect", "verdict", "value", "95 % interval", "error removed", "confidence", "not to be told from")
    return table(head, rows, "llllrrl")


def _unnamed(terms: Sequence[FoundTerm]) -> list[Html]:
    body = [
        (
            term.axis,
            term.form,
            within(term.value, term.ci95),
            interval(term.ci95),
            percent(term.inclusion, blank=""),
        )
        for term in terms
    ]
    note = "What no named effect explains, as the fewest monomials that do. A term here is a hint, not a cause. "
    note += "The last column says in how many of a hundred draws of parts of the log it is selected."
    return [
        element("h3", "Terms without a name"),
        element("p", note, cls="facts"),
        table(("axis", "form", "value [SI]", "95 % interval", "selected in"), body, "llrrr"),
    ]


def _value(term: FoundTerm) -> str:
    return f"{term.symbol} = {within(term.value, term.ci95)} {unit_text(term.unit)}".rstrip()


MISSING_EFFECTS = Chapter(30, missing_effects)
