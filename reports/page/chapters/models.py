"""All models side by side: errors and laws in one picture, then the figures, and what the auditor says of each."""

import math
from collections.abc import Callable, Mapping, Sequence

from ....comparison.facts import Amount, AuditRecord, ComparedModel, Comparison, Domain, PairedRecord, RulingRecord
from ....physics.motion import AXES
from ....physics.presentation import listing, unit_text
from ....residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, ByAxis, RolloutRecord
from ... import wording
from ...run_contents import MARKS, RunFolder, difference, hero_horizon, laws_of, reference_of, rivals
from ..figures.model_figures import trust
from ..markup import Html, card, details, element, figure, folded, lines, listed, paragraphs, render, table
from .base import Chapter, Section

KEY = f"""{MARKS["better"]} surely better and {MARKS["worse"]} surely worse than the reference (the 95 % interval of the
 paired difference, from blocks of the log, leaves out zero), {MARKS["no difference"]} cannot be told apart on
 these rows, which is not to say equal, {MARKS["too short to tell"]} too short to tell.""".replace("\n", "")
MEANING = {
    "calibrated": "the nominal model with its own numbers fitted as 'undertow fit' does, with no effect beside them; "
    f"the step '{wording.OWN_NUMBERS}' has the numbers of the corrected model",
    "zero acceleration": "body velocities stay as they are",
    "hold velocity": "velocity over ground and turn rate stay as they are",
}


TITLE = "Which model to trust"


def models(comparison: Comparison, audit: AuditRecord | None = None, *, short_of: str = "") -> Html:
    """The picture, then the tables, with every paired difference folded away; without tables where `short_of` a run."""
    horizon, reference = hero_horizon(comparison), reference_of(comparison)
    shown = rivals(comparison, audit)
    best = comparison.best
    caption = (
        "Look for the row at the top whose mark is a blue disc: it keeps the laws of a hull. "
        f"{'The model to trust is in bold. ' if best.model else 'None is in bold: none is to be trusted. '}"
        "An orange diamond breaks one, a grey ring was not asked; a mark grows with the number of fitted values. "
        "At the right, one column a law: a dot is kept, a cross is broken, a ring is broken but noted only, a dash "
        "does not apply."
    )
    if any(rival.interval for rival in shown):
        caption += (
            f" Bands are 95 % intervals of the difference to the {reference} model, on the same stretches of "
            "the log: where a band reaches that model's mark, the log cannot tell the two apart."
        )
    return render(
        *paragraphs([unit_text(best.sentence)], "verdict"),
        figure([trust(shown, horizon, best.model, short_of)], caption, cls="wide"),
        *([] if short_of else [folded("The numbers of all models", *_tables(comparison))]),
    )


def _tables(comparison: Comparison) -> list[Html]:
    models = comparison.models
    base = _table_reference(comparison)
    notes = [f"Errors on {wording.judged_rows(comparison.split)}, root mean square unless said otherwise."]
    if comparison.differences:
        notes.append(f"{KEY} The reference is the {base} model.")
    notes += [f"{name}: {text}." for name, text in MEANING.items() if any(m.name == name for m in models)]
    notes += comparison.notes
    parts = [
        element("h3", "Models compared: predictions"),
        _rollouts(comparison, base),
        element("h3", "Models compared: accelerations"),
        _accelerations(comparison, base),
        element("h3", "Models compared: size, time, laws"),
        _costs(models),
        *paragraphs(notes),
    ]
    if any(model.acceleration.mae != ByAxis() for model in models):
        parts.append(details("mean absolute errors", _mean_errors(models)))
    if comparison.differences:
        parts.append(details("every paired difference", *_differences(comparison.differences)))
    return parts


def _table_reference(comparison: Comparison) -> str:
    """The marks tell against the nominal model, which a reader knows, where that was asked."""
    against = {item.against for item in comparison.differences}
    return "nominal" if "nominal" in against else reference_of(comparison)


def _rollouts(comparison: Comparison, base: str) -> Html:
    models = comparison.models
    horizons = sorted({key for model in models for key in model.rollout}, key=float)
    hero = hero_horizon(comparison)
    head = ["model", *(f"position, {seconds} s [m]" for seconds in horizons)]
    head += [f"{axis}, {hero} s [{ROLLOUT_UNITS[axis]}]" for axis in AXES] + ["ran away"]
    rows = []
    for model in models:
        scores = [model.rollout.get(seconds) for seconds in horizons]
        ran = [f"{e.diverged} of {e.starts}, {s} s" for e, s in zip(scores, horizons, strict=True) if e and e.diverged]
        judged = any(errors and errors.starts for errors in scores)
        cells = [_rolled(comparison, model, base, seconds, "position") for seconds in horizons]
        cells += [_rolled(comparison, model, base, hero, axis) for axis in AXES]
        rows.append([model.name, *cells, lines(ran) if ran else "none" * judged])
    return table(head, rows)


def _rolled(comparison: Comparison, model: ComparedModel, base: str, seconds: str, axis: str) -> str:
    """An error of predictions over a horizon, with its mark."""
    errors = model.rollout.get(seconds) or RolloutRecord()
    value = wording.typeset(errors.of(axis), blank="diverged" if errors.diverged else "n/a")
    return _marked(value, difference(comparison.differences, model.name, base, "rollout", axis, seconds))


def _accelerations(comparison: Comparison, base: str) -> Html:
    models = comparison.models
    domain = any(m.domain and m.domain.outside.rows and m.domain.inside.rows for m in models)
    units = {axis: unit_text(ACCELERATION_UNITS[axis]) for axis in AXES}
    head = ["model", *(f"{axis} [{units[axis]}]" for axis in AXES), *(f"R², {axis}" for axis in AXES)]
    head += [f"{axis}, outside / inside" for axis in AXES] * domain
    rows = []
    for model in models:
        score = model.acceleration
        told = [difference(comparison.differences, model.name, base, "acceleration", axis) for axis in AXES]
        rmse = [_marked(wording.typeset(score.rmse.of(axis)), item) for axis, item in zip(AXES, told, strict=True)]
        row = [model.name, *rmse, *(wording.goodness(score.r2.of(axis)) for axis in AXES)]
        rows.append(row + [_domain(model, axis) for axis in AXES] * domain)
    return render(table(head, rows), *paragraphs([_domain_note(models)]))


def _domain(model: ComparedModel, axis: str) -> str:
    """The error outside of what the training part spans, beside that inside."""
    known = model.domain or Domain()
    errors = (math.nan if side.rmse is None else side.rmse.of(axis) for side in (known.outside, known.inside))
    return " / ".join(wording.typeset(error, blank="none") for error in errors)


def _domain_note(models: Sequence[ComparedModel]) -> str:
    """What inside and outside mean, with the number of rows; nothing where that was not asked."""
    told = next((model.domain for model in models if model.domain), None)
    if told is None:
        return ""
    outside, inside = told.outside.rows, told.inside.rows
    if not outside or not inside:
        where = "leaves" if outside else "lies within"
        return f"Every judged row {where} the speeds and thrusts that the training part spans."
    return (
        f"Outside: {outside} rows with speeds or thrusts that the training part does not span, against {inside} rows "
        "inside. A model that knows the physics errs alike on both."
    )


def _costs(models: Sequence[ComparedModel]) -> Html:
    """Size, times and laws; a time that no model knows has no column."""
    times = {
        "time to fit [s]": [model.seconds_to_fit for model in models],
        "time to evaluate [s]": [model.seconds_to_evaluate for model in models],
    }
    times = {title: taken for title, taken in times.items() if any(one is not None for one in taken)}
    sides = ("inside", "outside") if any(model.interval for model in models) else ()
    rows = []
    for k, model in enumerate(models):
        held = [wording.held_shares(getattr(model.interval, side, None)) for side in sides]
        took = [wording.typeset(taken[k], blank="not recorded") for taken in times.values()]
        rows.append((model.name, model.kind, wording.typeset(model.parameters), *held, *took, model.audit))
    intervals = [f"interval holds, {'within' if side == 'inside' else 'beyond'}" for side in sides]
    found = table(("model", "kind", "fitted values", *intervals, *times, "laws"), rows, "ll")
    note = f"{wording.INTERVAL_HOLDS[0].upper()}{wording.INTERVAL_HOLDS[1:]}."
    return render(found, *paragraphs([note] * bool(sides)))


def _mean_errors(models: Sequence[ComparedModel]) -> Html:
    rows = [(model.name, *(wording.typeset(model.acceleration.mae.of(axis)) for axis in AXES)) for model in models]
    return table(("model", *(f"{axis} [{unit_text(ACCELERATION_UNITS[axis])}]" for axis in AXES)), rows)


def _differences(differences: Sequence[PairedRecord]) -> list[Html]:
    columns: dict[str, Callable[[PairedRecord], str]] = {
        "model": lambda item: item.model,
        "against": lambda item: item.against,
        "error": lambda i: f"{i.quantity}, {i.axis}{f', {i.horizon} s' if i.horizon else ''}",
        "difference": lambda item: f"{wording.within(item.difference, item.ci95)} {unit_text(item.unit)}",
        "95 % interval": lambda item: wording.interval(item.ci95),
        "verdict": lambda item: item.verdict,
        "blocks": lambda item: wording.typeset(item.blocks, blank=""),
    }
    note = (
        "Blocks: how many stretches of the log, each drawn as a whole, the interval rests on; on two or three it is "
        'rough. "No difference" is one that cannot be told on these rows, not equality.'
    )
    return [element("p.facts", note), listed(differences, columns, "lllrrlr")]


def _marked(value: str, told: PairedRecord | None) -> str:
    sign = MARKS.get(told.verdict) if told else None
    if told is None or not sign:
        return value
    cls = {"better": "mark better", "worse": "mark worse"}.get(told.verdict, "mark")
    return render(value, " ", element("span", sign, cls=cls, title=told.verdict))


SIGNS = {"pass": "\N{BULLET} pass", "fail": "\N{MULTIPLICATION SIGN} fail", "noted": "\N{WHITE CIRCLE} noted"}


def laws(run: RunFolder) -> Section | None:
    """What is broken by any model with its counterexample, then all laws of each; nothing without an audit."""
    audit = run.audit
    judged = {model.name: laws_of(model, audit) for model in run.comparison.models}
    if audit is not None and not judged.get("corrected"):
        judged["corrected"] = audit.laws
    judged = {name: told for name, told in judged.items() if told}
    if not judged:
        return None
    units = {**wording.STATE_UNITS, **({} if audit is None else audit.units)}
    broken = [
        (name, law.law, _amount(law.worst), _words(law, units))
        for name, told in judged.items()
        for law in _ordered(told)
        if law.outcome == "fail"
    ]
    parts = [element("p", f"{listing(list(judged))}: no law that counts is broken.")]
    if broken:
        head = ("model", "broken law", "worst value", "in words, and the state in which it was found")
        parts = [element("h3", "Counterexamples"), element("div.wordy", table(head, broken, "llrl"))]
    for name, told in judged.items():
        opened = {"open": "open"} if name == "corrected" else {}
        summary = element("summary", f"all laws, {name} model")
        parts.append(element("details", summary, _table(told, units), **opened))
    notes = [] if audit is None else [_asked(audit)]
    notes.append("Margins are distances from breaking a law. What is searched is not proved.")
    if any(law.outcome == "noted" for told in judged.values() for law in told):
        notes.append("Noted: broken, but a real boat may, so the audit does not fail by it.")
    notes += [] if audit is None else audit.notes
    parts += paragraphs(notes)
    own = [law.outcome for law in judged.get("corrected") or []]
    verdict = (audit.verdict if audit else "") or ("fail" if "fail" in own else "pass" if own else "")
    title = {"pass": ": the corrected model keeps them", "fail": ": the corrected model breaks one"}.get(verdict, "")
    return Section(f"Laws of a hull{title}", card(*parts))


def _table(told: Sequence[RulingRecord], units: Mapping[str, str]) -> Html:
    columns: dict[str, Callable[[RulingRecord], str]] = {
        "law": lambda law: law.law,
        "verdict": lambda law: element("b", SIGNS.get(law.outcome, law.outcome), cls=law.outcome),
        "margin": lambda law: _amount(law.margin),
        "worst value": lambda law: _amount(law.worst),
        "how it is known": lambda law: "" if law.proof in (None, "none") else law.proof,
        "in words, and where it is nearest to breaking": lambda law: _words(law, units),
    }
    return element("div.wordy", listed(_ordered(told), columns, "llrrll"))


def _ordered(told: Sequence[RulingRecord]) -> list[RulingRecord]:
    return sorted(told, key=lambda law: {"fail": 0, "noted": 1}.get(law.outcome, 2))


def _amount(found: Amount | None) -> str:
    """A number with its unit; nothing where there is none."""
    if found is None or found.value is None:
        return ""
    return f"{wording.typeset(found.value, 2)} {unit_text(found.unit)}".rstrip()


def _words(law: RulingRecord, units: Mapping[str, str]) -> Html:
    """The sentence, and under it the state of the worst value."""
    state = [
        f"{name} {wording.typeset(amount, 2)} {unit_text(units.get(name, ''))}".strip()
        for name, amount in ({} if law.worst is None else law.worst.at).items()
    ]
    return render(law.sentence, *[element("small", f"at {', '.join(state)}")] * bool(state))


def _asked(audit: AuditRecord) -> str:
    return f"Asked for {wording.range_words(audit.envelope, audit.units)}: {audit.envelope_from}."


MODELS = Chapter(50, lambda run: Section(TITLE, models(run.comparison, run.audit)))
LAWS = Chapter(120, laws, folded=True)
