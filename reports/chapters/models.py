"""All models side by side: error and laws in one picture, then the figures, with marks where a difference is sure."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..figures_models import trust
from ..markup import Html, element, figure, lines, render, table
from ..rivals import MARKS, difference, hero_horizon, mark, reference_of, rivals
from ..run_folder import RunFolder
from ..wording import ACCELERATION_UNITS, AXES, ROLLOUT_UNITS, finite, goodness, interval, typeset, unit_text, within

KEY = f"""{MARKS["better"]} surely better and {MARKS["worse"]} surely worse than the reference (the 95 % interval of the
 paired difference, from blocks of the log, leaves out zero), {MARKS["no difference"]} cannot be told apart on
 these rows, which is not to say equal, {MARKS["too short to tell"]} too short to tell.""".replace("\n", "")
MEANING = {
    "zero acceleration": "body velocities stay as they are",
    "hold velocity": "velocity over ground and turn rate stay as they are",
}
Model = Mapping[str, Any]


def models(run: RunFolder, *, title: str = "h2", short_of: str = "") -> Html:
    """The picture, then the tables, with every paired difference folded away; without tables where `short_of` a run."""
    comparison = run.comparison
    horizon, reference = hero_horizon(comparison), reference_of(comparison)
    audits = {"corrected": run.audit} if run.audit else {}
    shown = rivals(comparison, audits)
    paired = any(rival.interval for rival in shown)
    caption = (
        "Look for the row at the top whose mark is a blue disc: it keeps the laws of a hull. The model to trust is in "
        "bold. An orange diamond breaks one, a grey ring was not asked; a mark grows with the number of fitted values. "
        "At the right, one column a law: a dot is kept, a cross is broken, a ring is broken but noted only, a dash "
        "does not apply."
    )
    if paired:
        caption += (
            f" Bands are 95 % intervals of the difference to the {reference} model, on the same stretches of "
            "the log: where a band reaches that model's mark, the log cannot tell the two apart."
        )
    best = comparison.get("best") or {}
    told = [element("p", unit_text(str(best["sentence"])), cls="verdict")] if best.get("sentence") else []
    return render(
        element(title, "Which model to trust"),
        *told,
        figure([trust(shown, horizon, str(best.get("model") or ""), short_of)], caption, cls="wide"),
        *([] if short_of else [element("div", *_tables(comparison), cls="card")]),
    )


def _tables(comparison: Mapping[str, Any]) -> list[Html]:
    models = comparison["models"]
    base = _table_reference(comparison)
    notes = [f"Errors on the {comparison.get('split', 'held-out')} part, root mean square unless said otherwise."]
    if comparison.get("differences"):
        notes.append(f"{KEY} The reference is the {base} model.")
    notes += [f"{name}: {text}." for name, text in MEANING.items() if any(m["name"] == name for m in models)]
    notes += [str(note) for note in comparison.get("notes") or []]
    parts = [
        element("h3", "Models compared: predictions"),
        _rollouts(comparison, base),
        element("h3", "Models compared: accelerations"),
        _accelerations(comparison, base),
        element("h3", "Models compared: size, time, laws"),
        _costs(models),
        *(element("p", note, cls="facts") for note in notes),
    ]
    if any((model.get("acceleration") or {}).get("mae") for model in models):
        parts.append(element("details", element("summary", "mean absolute errors"), _mean_errors(models)))
    if comparison.get("differences"):
        parts.append(element("details", element("summary", "every paired difference"), *_differences(comparison)))
    return parts


def _table_reference(comparison: Mapping[str, Any]) -> str:
    """The marks tell against the nominal model, which a reader knows, where that was asked."""
    against = {str(item.get("against")) for item in comparison.get("differences") or []}
    return "nominal" if "nominal" in against else reference_of(comparison)


def _rollouts(comparison: Mapping[str, Any], base: str) -> Html:
    models = comparison["models"]
    horizons = sorted({key for model in models for key in model.get("rollout") or {}}, key=float)
    hero = hero_horizon(comparison)
    head = ["model", *(f"position, {seconds} s [m]" for seconds in horizons)]
    head += [f"{axis}, {hero} s [{ROLLOUT_UNITS[axis]}]" for axis in AXES] + ["ran away"]
    rows = []
    for model in models:
        name, score = str(model["name"]), model.get("rollout") or {}

        def cell(seconds: str, axis: str, name: str = name, score: Model = score) -> str:
            errors = score.get(seconds) or {}
            value = typeset(errors.get(axis), blank="diverged" if errors.get("diverged") else "n/a")
            return _marked(value, difference(comparison, name, base, "rollout", axis, seconds))

        away = [(score.get(s) or {}).get("diverged") for s in horizons]
        starts = [(score.get(s) or {}).get("starts") for s in horizons]
        ran = [f"{a} of {n}, {s} s" for a, n, s in zip(away, starts, horizons, strict=True) if a]
        rows.append(
            [
                name,
                *(cell(seconds, "position") for seconds in horizons),
                *(cell(hero, axis) for axis in AXES),
                render(*lines(ran)) if ran else ("none" if any(n for n in starts) else ""),
            ]
        )
    return table(head, rows)


def _accelerations(comparison: Mapping[str, Any], base: str) -> Html:
    models = comparison["models"]
    domain = any(_rows(model, "outside") and _rows(model, "inside") for model in models)
    units = {axis: unit_text(ACCELERATION_UNITS[axis]) for axis in AXES}
    head = ["model", *(f"{axis} [{units[axis]}]" for axis in AXES), *(f"R², {axis}" for axis in AXES)]
    head += [f"{axis}, outside / inside" for axis in AXES] * domain
    rows = []
    for model in models:
        score = model.get("acceleration") or {}
        told = [difference(comparison, str(model["name"]), base, "acceleration", axis) for axis in AXES]
        rmse = [
            _marked(typeset((score.get("rmse") or {}).get(axis)), item) for axis, item in zip(AXES, told, strict=True)
        ]
        row = [str(model["name"]), *rmse, *(goodness((score.get("r2") or {}).get(axis)) for axis in AXES)]
        rows.append(row + [_domain(model, axis) for axis in AXES] * domain)
    note = _domain_note(models)
    return render(table(head, rows), *[element("p", note, cls="facts")] * bool(note))


def _domain(model: Model, axis: str) -> str:
    """The error outside of what the training part spans, beside that inside."""
    parts = []
    for where in ("outside", "inside"):
        errors = ((model.get("domain") or {}).get(where) or {}).get("rmse") or {}
        parts.append(typeset(errors.get(axis), blank="none"))
    return " / ".join(parts)


def _rows(model: Model, where: str) -> int:
    """How many judged rows lie inside or outside of what the training part spans; 0 where that was not asked."""
    rows = finite(((model.get("domain") or {}).get(where) or {}).get("rows"))
    return int(rows) if rows == rows else 0


def _domain_note(models: Sequence[Model]) -> str:
    """What inside and outside mean, with the number of rows; nothing where that was not asked."""
    told = next((model for model in models if model.get("domain")), None)
    if told is None:
        return ""
    outside, inside = _rows(told, "outside"), _rows(told, "inside")
    if not outside:
        return "Every judged row lies within the speeds and thrusts that the training part spans."
    if not inside:
        return "Every judged row leaves the speeds and thrusts that the training part spans."
    return (
        f"Outside: {outside} rows with speeds or thrusts that the training part does not span, against {inside} rows "
        "inside. A model that knows the physics errs alike on both."
    )


def _costs(models: Sequence[Model]) -> Html:
    """Size, times and laws; a time that no model knows has no column."""
    times = {f"seconds_to_{what}": f"time to {what} [s]" for what in ("fit", "evaluate")}
    times = {key: title for key, title in times.items() if any(model.get(key) is not None for model in models)}
    rows = [
        (
            str(model["name"]),
            str(model.get("kind", "")),
            typeset(model.get("parameters")),
            *(typeset(model.get(key), blank="not recorded") for key in times),
            str(model.get("audit", "not run")),
        )
        for model in models
    ]
    return table(("model", "kind", "fitted values", *times.values(), "laws"), rows, "ll")


def _mean_errors(models: Sequence[Model]) -> Html:
    rows = [
        (
            str(model["name"]),
            *(typeset(((model.get("acceleration") or {}).get("mae") or {}).get(axis)) for axis in AXES),
        )
        for model in models
    ]
    return table(("model", *(f"{axis} [{unit_text(ACCELERATION_UNITS[axis])}]" for axis in AXES)), rows)


def _differences(comparison: Mapping[str, Any]) -> list[Html]:
    rows = []
    for item in comparison["differences"]:
        seconds = f", {item['horizon']} s" if item.get("horizon") else ""
        rows.append(
            (
                str(item.get("model")),
                str(item.get("against")),
                f"{item.get('quantity')}, {item.get('axis')}{seconds}",
                f"{within(item.get('difference'), item.get('ci95'))} {unit_text(str(item.get('unit') or ''))}",
                interval(item.get("ci95")),
                str(item.get("verdict", "")),
                typeset(item.get("blocks"), blank=""),
            )
        )
    head = ("model", "against", "error", "difference", "95 % interval", "verdict", "blocks")
    note = (
        "Blocks: how many stretches of the log, each drawn as a whole, the interval rests on; on two or three it is "
        'rough. "No difference" is one that cannot be told on these rows, not equality.'
    )
    return [element("p", note, cls="facts"), table(head, rows, "lllrrlr")]


def _marked(value: str, told: Mapping[str, Any] | None) -> str:
    sign = mark(told)
    if not sign:
        return value
    verdict = str((told or {}).get("verdict"))
    cls = {"better": "mark better", "worse": "mark worse"}.get(verdict, "mark")
    return render(value, " ", element("span", sign, cls=cls, attributes={"title": verdict}))
