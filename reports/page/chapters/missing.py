"""The section of the report page that names the missing effects and ranks every effect that was tried."""

from collections.abc import Sequence

from ....discovery.effect_findings import EffectFinding, FittedTerm
from ....physics.presentation import listing, percent, share_removed, unit_text
from ....physics.vehicle import Vehicle
from ...run_contents import RunFolder
from ...sureness import (
    BACK,
    COMES_BACK,
    coefficient_rows,
    comes_back,
    file_numbers,
    in_order,
    odds,
    sure_caption,
    verdict_word,
)
from ...wording import effect_words, interval, risen, twins, within
from ..figures.figures import coefficients, ranked_effects
from ..markup import Html, element, figure, folded, lines, render, table
from ..outcome import hero, section_title
from .base import Chapter, Section

_COLOURS = (
    ("missing", "strong blue ones are missing"),
    ("likely", "faint blue ones are likely"),
    ("possible", "those with a rim alone are possible and stand in the corrected model"),
)
"""What the colours of the ranking mean."""
_BEGINS = {"missing": "The model is missing this", "likely": "Probably missing", "possible": "Possible"}
"""How the line begins that says how sure a card is."""

_ALIGNED = "llrllrrl"
"""Columns of the table of effects, to the left or to the right."""


def missing_effects(run: RunFolder) -> Section:
    """The effects to add as sentences with equations, the ranking of all candidates, and terms without a name."""
    findings = run.findings
    candidates, unnamed = in_order(findings.candidates), findings.unnamed
    chosen = in_order(findings.added)
    horizon, _ = hero(findings.steps, run.comparison.best.horizon)
    cards = [_effect(item, run.nominal, risen(findings.steps, horizon, item)) for item in chosen]
    parts = [element("div", *cards, cls="columns")] * bool(chosen)
    drawings = []
    if candidates:
        colours = [text for verdict, text in _COLOURS if any(item.verdict == verdict for item in chosen)]
        key = f" Of the bars, {listing(colours)}." if colours else ""
        caption = f"{BACK.capitalize()}: {COMES_BACK}. {sure_caption(candidates).capitalize()}.{key}"
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
        parts.append(folded("Every effect that was tried, surest first", *_tried(candidates, run.nominal)))
    if unnamed:
        parts.append(element("div", *unnamed_terms(unnamed), cls="card"))
    return Section(section_title(findings, run.comparison), render(*parts))


def _effect(item: EffectFinding, nominal: Vehicle, worse: Sequence[str]) -> Html:
    numbers, known, others = file_numbers(item, nominal), odds(item), twins(item)
    begins = _BEGINS.get(item.verdict, verdict_word(item).capitalize())
    return element(
        "div",
        element("h3", effect_words(item).capitalize()),
        element("p", element("span", f"{begins}: {known}" if known else begins, cls=f"tag {item.verdict}")),
        *(element("p", element("b", f"{one.told()}.")) for one in numbers if one.filed()),
        element("p", unit_text(item.sentence)),
        *[element("div", item.equation, cls="equation")] * bool(item.equation),
        *(element("div", element("b", one.told())) for one in numbers if not one.filed()),
        *[element("p", worth, cls="facts") for worth in [_worth(item)] if worth],
        *(element("p", text, cls="warn") for text in worse),
        *[element("p", f"This log cannot tell it from {listing(others)}.", cls="warn")] * bool(others),
        cls=f"card effect {item.verdict}".replace(" evidence", ""),
    )


def _worth(item: EffectFinding) -> str:
    """What comes back of the unseen error without an effect."""
    if not (force := comes_back(item)):
        return ""
    rollout = None if item.claim is None else item.claim.worth.rollout
    ahead = "" if rollout is None else f", and {share_removed(rollout)} of that of predictions"
    return f"Left out alone, {force} of an axis's squared force error on unseen rows comes back{ahead}."


def _tried(candidates: Sequence[EffectFinding], nominal: Vehicle) -> list[Html]:
    """What has evidence, or cannot be judged; then what has none, folded away."""
    without = [item for item in candidates if item.verdict == "no evidence"]
    others = [item for item in candidates if item.verdict != "no evidence"]
    parts = [effect_table(others, nominal)] * bool(others)
    if without:
        summary = element("summary", f"{len(without)} effects without evidence")
        parts.append(element("details", summary, effect_table(without, nominal)))
    return [*parts, element("p", f"{sure_caption(candidates).capitalize()}.", cls="facts")]


def effect_table(candidates: Sequence[EffectFinding], nominal: Vehicle) -> Html:
    """Effects with their verdicts, values, 95 % intervals, and what each is worth, a row each."""
    rows = []
    for item in candidates:
        numbers, verdict = file_numbers(item, nominal), item.verdict
        rows.append(
            (
                effect_words(item),
                element(
                    "span",
                    verdict_word(item),
                    cls=f"tag {verdict}" if verdict != "no evidence" else "tag",
                ),
                odds(item),
                render(*lines(f"{one.symbol} = {one.amount()}" for one in numbers)),
                render(*lines(interval(one.ci95) for one in numbers)),
                render(*lines(one.filed() for one in numbers if any(each.filed() for each in numbers))),
                comes_back(item),
                render(*lines(twins(item))),
            )
        )
    head = (*("effect", "verdict", "sure", "value", "95 % interval", "in the file"), BACK, "not to be told from")
    filled = [k for k in range(len(head)) if any(row[k] for row in rows)]
    return table(
        [head[k] for k in filled], [[row[k] for k in filled] for row in rows], "".join(_ALIGNED[k] for k in filled)
    )


def unnamed_terms(terms: Sequence[FittedTerm]) -> list[Html]:
    """The terms without a name as a table under its title."""
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


MISSING_EFFECTS = Chapter(30, missing_effects)
