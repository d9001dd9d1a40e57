"""The first chapters of the report page: the verdict, the error falling step by step, what is missing and to record."""

from collections.abc import Callable, Collection, Sequence

from ....discovery.effect_findings import EffectFinding, FittedTerm
from ....discovery.findings import Advice
from ....discovery.identifiability.rehearsal import Identifiability
from ....physics.motion import AXES
from ....physics.presentation import listing, percent, sentence_case, share_removed, unit_text, words
from ....physics.vehicle import Vehicle
from ....residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS
from ... import sureness
from ...run_contents import RunFolder
from ...wording import cut, effect_words, interval, risen, step_words, twins, typeset, within
from .. import outcome
from ..figures.effect_figures import coefficients, convincing, excitation, force_drawing, ranked_effects
from ..figures.model_figures import step_bars
from ..markup import Html, bullets, card, details, element, figure, folded, lines, listed, paragraphs, render, table
from .base import Chapter, Section

ARROW = "\N{RIGHTWARDS ARROW}"
LEGEND = (
    ("measured", "measured"),
    ("before", "before: the nominal model"),
    ("after", "after: the corrected model"),
    ("yours", "with your values"),
    ("band", "band of the corrected model"),
)
LONGEST_NAME = 30  # letters of an effect's name that fit beside the bars


def headline(run: RunFolder, *, title: str = "h1") -> Html:
    """The verdict, below it why and what became of the error, in words and as big figures; then how sure that is."""
    findings, steps = run.findings, run.findings.steps
    led = outcome.hero(steps, run.comparison.best.horizon)
    answered = outcome.answer(findings, run.comparison, run.nominal)
    parts = outcome.opening_parts(findings, run.comparison, run.nominal)

    def told(*labels: str) -> str:
        return " ".join(text for label, text in parts if label in labels)

    sentences = [told("again"), unit_text(told("trust"))]
    for place in findings.failures[: 0 if outcome.recommendation(findings, run.comparison) else 1]:
        share = f"{percent(place.share_of_error)} of the {place.axis} error"
        sentences.append(f"The nominal model fails most here: {place.where} ({share}).")
    changed = len(steps) > 1
    figures = [_big(led.before, led.unit, "before", "before" if changed else "the nominal model")]
    if changed:
        figures += [element("span.arrow", ARROW), _big(led.after, led.unit, "after", "after")]
    ends = (steps[0], steps[-1])[: 1 + changed]
    by_axis = []
    for axis in AXES:
        errors = (typeset(step.rollout(led.horizon).of(axis), 2) for step in ends)
        by_axis.append(f"{axis} {f' {ARROW} '.join(errors)} {ROLLOUT_UNITS[axis]}")
    what = element(
        "div.what",
        element("strong", led.in_words),
        lines(["root mean square, open loop, on held-out data"]),
        element("div.axes", *(element("span", text) for text in by_axis)),
    )
    return render(
        *paragraphs(map(unit_text, findings.warnings), "card warning"),
        element(title, unit_text(outcome.headline(findings, run.comparison))),
        *paragraphs([told("cannot")], "warn"),
        *[element("dl.answer", *(_line(line) for line in answered))] * bool(answered),
        *paragraphs([unit_text(told("why")), told("done", "grown", "likely")], "lead"),
        element("div.card numbers", *figures, what),
        *paragraphs([" ".join(filter(None, sentences))], "lead"),
    )


def falling_error(run: RunFolder) -> Section:
    """Rollout and acceleration errors after each added effect."""
    steps = run.findings.steps
    horizon = outcome.hero(steps, run.comparison.best.horizon).horizon
    names = ["nominal model", *(cut(step_words(step), LONGEST_NAME) for step in steps[1:])]

    ahead = [step.rollout(horizon) for step in steps]
    along = [step.acceleration_rmse for step in steps]
    top = [step_bars("position", "m", [errors.position for errors in ahead], names)]
    top += [step_bars(axis, ROLLOUT_UNITS[axis], [errors.of(axis) for errors in ahead]) for axis in AXES]
    bottom = [step_bars(axis, ACCELERATION_UNITS[axis], [errors.of(axis) for errors in along]) for axis in AXES]
    side = element(
        "div.side", element("b", "Acceleration error"), lines(["along the measured motion,", "after the same steps"])
    )
    caption = (
        "Read downwards: each row adds one effect, and shorter is better. Every column has its own scale. Predictions "
        "run open loop from measured states; all errors are root mean squares on held-out data."
    )
    drawing = element(
        "figure.card",
        element("h3", f"Error of {horizon} s predictions"),
        element("div.plots steps", *top),
        element("div.plots steps", side, *bottom),
        element("figcaption", caption),
        *paragraphs(risen(steps, horizon), "warn"),
    )
    return Section("The error, step by step" if len(steps) > 1 else "The error of the nominal model", drawing)


def legend(roles: Sequence[str] = ("measured", "before", "after"), after: str = "corrected") -> Html:
    """What the colours mean; `after` is the name of the second model."""
    texts = ((role, text.replace("corrected", after)) for role, text in LEGEND if role in roles)
    return element("div.key", *(element("span", element("i"), text, cls=role) for role, text in texts))


def _line(line: outcome.Line) -> Html:
    return render(element("dt", line.label), element("dd", unit_text(f"{line.text[:1].upper()}{line.text[1:]}")))


def _big(value: float, unit: str, cls: str, label: str) -> Html:
    return element("div", element("b", f"{typeset(value, 2)} {unit}"), element("small", label), cls=f"big {cls}")


HEADLINE = Chapter(10, lambda run: Section("", headline(run)))
FALLING_ERROR = Chapter(20, falling_error)


_COLOURS = (
    ("missing", "strong blue ones are missing"),
    ("likely", "faint blue ones are likely"),
    ("possible", "those with a rim alone are possible and stand in the corrected model"),
)
"""What the colours of the ranking mean."""
_BEGINS = {"missing": "The model is missing this", "likely": "Probably missing", "possible": "Possible"}
"""How the line begins that says how sure a card is."""


def missing_effects(run: RunFolder) -> Section:
    """The effects to add as sentences with equations, the ranking of all candidates, and terms without a name."""
    findings = run.findings
    candidates, unnamed = sureness.in_order(findings.candidates), findings.unnamed
    chosen = sureness.in_order(findings.added)
    horizon = outcome.hero(findings.steps, run.comparison.best.horizon).horizon
    cards = [_effect(item, run.nominal, risen(findings.steps, horizon, item)) for item in chosen]
    parts = [element("div.columns", *cards)] * bool(chosen)
    drawings = []
    if candidates:
        colours = [text for verdict, text in _COLOURS if any(item.verdict == verdict for item in chosen)]
        key = f" Of the bars, {listing(colours)}." if colours else ""
        sure = sureness.sure_caption(candidates).capitalize()
        caption = f"{sureness.BACK.capitalize()}: {sureness.COMES_BACK}. {sure}.{key}"
        drawings.append(figure([ranked_effects(candidates)], caption))
    rows = sureness.coefficient_rows(candidates, [item.effect for item in chosen], run.nominal, run.corrected)
    if rows:
        caption = (
            "From the nominal value (ring) to the corrected one (dot) with its 95 % interval (band). Each row has its "
            "own scale; the line is zero."
        )
        drawings.append(figure([coefficients(rows)], caption))
    parts.append(element("div.columns", *drawings))
    if candidates:
        parts.append(folded("Every effect that was tried, surest first", *_tried(candidates, run.nominal)))
    if unnamed:
        parts.append(card(*unnamed_terms(unnamed)))
    return Section(outcome.section_title(findings, run.comparison), render(*parts))


def _effect(item: EffectFinding, nominal: Vehicle, worse: Sequence[str]) -> Html:
    numbers, known, others = sureness.file_numbers(item, nominal), sureness.odds(item), twins(item)
    begins = _BEGINS.get(item.verdict, sureness.verdict_word(item).capitalize())
    return element(
        "div",
        element("h3", sentence_case(effect_words(item))),
        element("p", element("span", f"{begins}: {known}" if known else begins, cls=f"tag {item.verdict}")),
        *(element("p", element("b", f"{one.told()}.")) for one in numbers if one.filed()),
        element("p", unit_text(item.sentence)),
        *[element("div.equation", item.equation)] * bool(item.equation),
        *(element("div", element("b", one.told())) for one in numbers if not one.filed()),
        *paragraphs([_worth(item)]),
        *paragraphs([*worse, f"This log cannot tell it from {listing(others)}." * bool(others)], "warn"),
        cls=f"card effect {item.verdict}".replace(" evidence", ""),
    )


def _worth(item: EffectFinding) -> str:
    """What comes back of the unseen error without an effect."""
    if not (force := sureness.comes_back(item)):
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
        parts.append(details(f"{len(without)} effects without evidence", effect_table(without, nominal)))
    return [*parts, element("p.facts", f"{sureness.sure_caption(candidates).capitalize()}.")]


def effect_table(candidates: Sequence[EffectFinding], nominal: Vehicle) -> Html:
    """Effects with their verdicts, values, 95 % intervals, and what each is worth, a row each."""

    def numbers(item: EffectFinding) -> list[sureness.FileNumber]:
        return sureness.file_numbers(item, nominal)

    def verdict(item: EffectFinding) -> Html:
        tag = f"tag {item.verdict}" if item.verdict != "no evidence" else "tag"
        return element("span", sureness.verdict_word(item), cls=tag)

    def in_the_file(item: EffectFinding) -> Html:
        filed = [one.filed() for one in numbers(item)]
        return lines(filed if any(filed) else [])

    columns: dict[str, Callable[[EffectFinding], str]] = {
        "effect": effect_words,
        "verdict": verdict,
        "sure": sureness.odds,
        "value": lambda item: lines(f"{one.symbol} = {one.amount()}" for one in numbers(item)),
        "95 % interval": lambda item: lines(interval(one.ci95) for one in numbers(item)),
        "in the file": in_the_file,
        sureness.BACK: sureness.comes_back,
        "not to be told from": lambda item: lines(twins(item)),
    }
    return listed(candidates, columns, "llrllrrl", filled=True)


def unnamed_terms(terms: Sequence[FittedTerm]) -> list[Html]:
    """The terms without a name as a table under its title."""
    body = [
        (term.axis, term.form, within(term.value, term.ci95), interval(term.ci95), percent(term.inclusion, blank=""))
        for term in terms
    ]
    note = "What no named effect explains, as the fewest monomials that do. A term here is a hint, not a cause. "
    note += "The last column says in how many of a hundred draws of parts of the log it is selected."
    return [
        element("h3", "Terms without a name"),
        element("p.facts", note),
        table(("axis", "form", "value [SI]", "95 % interval", "selected in"), body, "llrrr"),
    ]


def what_convinces(run: RunFolder) -> Section | None:
    """The force that the nominal model lacks over what it depends on, and what was added, axis by axis."""
    found = convincing(run.findings, run.series, run.nominal)
    if not found:
        return None
    caption = (
        "Grey: the measured force less that of the nominal model, a dot a row; discs: its means. Line: what was added "
        "to the model, averaged over the same rows. Where the line runs through the discs, the model has what it "
        "lacked. Each is drawn over the signal over which that is seen best; what depends on several scatters."
    )
    title = "The force that is missing" if run.findings.missing else "The force that the nominal model lacks"
    return Section(title, figure(list(map(force_drawing, found)), caption, cls="three"))


def identified(run: RunFolder) -> Section | None:
    """Effects that look alike in this log, those that leave no trace, and how far each is excited."""
    told = run.findings.identifiability
    if told is None:
        return None
    sure = [item for item in run.findings.candidates if item.verdict == "missing"]
    written = {item.key for item in run.findings.candidates if item.in_model}
    facts = card(*_facts(told, [item.effect for item in sure if not item.indistinguishable_from], written))
    caption = (
        "Force that a plausible amount of each effect would make in this log, as a share of the force at work on its "
        "axis. An effect with a short bar can hide in this log, however large it may be elsewhere."
    )
    drawing = [figure([excitation(told.excitation)], caption, cls="one")] * bool(told.excitation)
    return Section("What this log can tell", element("div.columns", facts, *drawing))


def _facts(told: Identifiability, decided: Sequence[str] = (), written: Collection[str] = ()) -> list[Html]:
    """Sentences on what cannot be told apart or seen; one that says all is well where none is needed.

    Parameters
    ----------
    decided : effects that are missing for sure, with none that does as well in their place
    written : keys of the effects of the corrected model, which were found whatever was foretold of them
    """
    texts = []
    for group in told.groups:
        chosen = [name for name in group if name.split("[")[0] in decided]
        alike = f"{sentence_case(_names(group))} move alike in this log"
        if chosen and len(chosen) < len(group):
            verb = "fits" if len(chosen) == 1 else "fit"
            texts.append(
                f"{alike}, but not so much that they could not be told apart: {_names(chosen)} {verb} held-out data "
                "clearly better than any of the others alone. A mixture may fit as well, so a part of the value may "
                "be theirs."
            )
        else:
            texts.append(f"{alike}; a mixture of them may fit as well as one.")
    hidden = {
        "Hardly more than sensor noise": told.noise_limited,
        "Never excited, so neither found nor excluded": told.dormant,
        "No trace beside what the calibration explains": told.absorbed,
    }
    left = {why: [name for name in names if name not in written] for why, names in hidden.items()}
    texts += [f"{why}: {_names(names)}." for why, names in left.items() if names]
    if told.quiet_axes:
        axes = listing(told.quiet_axes)
        texts.append(f"Hardly moves beyond sensor noise: {axes}. Little can be said of its effects.")
    well = "Every effect of the catalogue that the log's channels allow is excited and can be told apart."
    condition = "" if told.condition is None else (
        f"Condition number of all effects together: {typeset(told.condition, 2)} (1 is ideal; in the thousands, some "
        "mixtures of effects cannot be told apart)."
    )  # fmt: skip
    return [element("h3", "Alike, hidden, or never excited"), *bullets(texts or [well]), *paragraphs([condition])]


def _names(names: Sequence[str]) -> str:
    return listing([words(name) for name in names])


def advised(items: Sequence[Advice]) -> list[Html]:
    """Manoeuvres and what each would tell, as a list; nothing for none."""
    return bullets(render(element("b", item.manoeuvre), f": {item.why}") for item in items)


def record_next(run: RunFolder) -> Section | None:
    """The manoeuvres that would settle what the log leaves open."""
    advice = advised(run.findings.advice)
    return Section("What to record next", card(*advice)) if advice else None


_MOST_EFFECTS = 8
"""Effects in the table: with the picture and the errors below it, so many leave the summary on two pages."""
_MOST_ADVICE = 3
"""Manoeuvres below the errors, surest use first: an hour on the water has no more."""


def in_numbers(run: RunFolder) -> Section | None:
    """The effects of the corrected model, each with its value, its 95 % interval and how sure it is."""
    chosen, unnamed = sureness.in_order(run.findings.added), run.findings.unnamed
    parts: list[Html] = [effect_table(chosen[:_MOST_EFFECTS], run.nominal)] * bool(chosen)
    if len(chosen) > _MOST_EFFECTS:
        parts.append(element("p.facts", f"{len(chosen) - _MOST_EFFECTS} more stand in the appendix."))
    parts += unnamed_terms(unnamed[:_MOST_EFFECTS]) if unnamed else []
    return _on_paper(outcome.section_title(run.findings, run.comparison), parts)


def next_on_paper(run: RunFolder) -> Section | None:
    """The manoeuvres that would settle what the log leaves open."""
    return _on_paper("What to record next", advised(run.findings.advice[:_MOST_ADVICE]))


def _on_paper(title: str, parts: list[Html]) -> Section | None:
    return Section("", render(element("h2", title), *parts), "paper") if parts else None


IN_NUMBERS = Chapter(12, in_numbers)
WHAT_CONVINCES = Chapter(15, what_convinces)
RECORD_NEXT = Chapter(24, next_on_paper)
APPENDIX = Chapter(26, lambda run: Section("", element("h1", "Appendix"), "paper appendix"))
MISSING_EFFECTS = Chapter(30, missing_effects)
ADVISED = Chapter(35, record_next, folded=True)
IDENTIFIED = Chapter(130, identified, folded=True)
