"""What `compare` shows on the terminal: the model to trust, then all numbers, marked where they are no chance."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from .layout import Fitting, Prose, bullets, plain_table, section, stacked
from .wording import ACCELERATION_UNITS, AXES, ROLLOUT_UNITS, finite, number, percent, unit_text

MARKS = {"better": "<", "worse": ">", "no difference": "=", "too short to tell": "?"}
_STYLES = {"better": "green", "worse": "red"}
_ROLLED = (*AXES, "position")

Row = Mapping[str, Any]


def best_text(comparison: Mapping[str, Any]) -> RenderableType | None:
    """Which model to trust, and why; None where nothing says so."""
    sentence = str((comparison.get("best") or {}).get("sentence") or "")
    return Prose(sentence, style="bold") if sentence else None


def comparison_table(comparison: Mapping[str, Any]) -> RenderableType:
    """All compared models, a line each: acceleration, predictions by horizon, and laws, size, time and range."""
    models = comparison["models"]
    split = str(comparison.get("split", "held-out"))
    where = "all rows" if split == "all" else f"the {split} part"
    first = str(models[0]["name"])
    marked = [d for d in comparison.get("differences") or [] if d.get("against") == first]
    verdicts = {(d["model"], d["quantity"], d["horizon"], d["axis"]): str(d["verdict"]) for d in marked}
    legend = _legend(set(verdicts.values()), first)
    tables = [
        Fitting([_accelerations(models, where, verdicts, mae) for mae in (True, False)]),
        _predictions(models, where, verdicts),
        _beside(models),
    ]
    return stacked([legend, *tables] if legend else tables)


def notes_list(comparison: Mapping[str, Any]) -> RenderableType | None:
    """What a reader must know of the comparison; None where there is nothing."""
    names = tuple(str(model["name"]) for model in comparison.get("models") or [])
    notes = [str(note) for note in comparison.get("notes") or []]
    # A note may begin with the name of a model, which keeps its letters.
    told = [f"{note if note.startswith(names) else note[:1].upper() + note[1:]}." for note in notes]
    return section("Notes", bullets(told)) if notes else None


def _legend(told: set[str], first: str) -> RenderableType | None:
    """What the marks mean that the tables have."""
    meaning = {
        "better": f"a smaller error than {first}'s by more than chance",
        "worse": "a larger one",
        "no difference": "cannot be told apart on these rows, which is not to say equal",
        "too short to tell": "too few rows to tell",
    }
    marks = [f"{MARKS[verdict]} {text}" for verdict, text in meaning.items() if verdict in told]
    return Prose(f"Marks beside numbers: {'; '.join(marks)}.") if marks else None


def _accelerations(models: Sequence[Row], where: str, verdicts: Mapping[Any, str], mae: bool) -> Table:
    table = plain_table(f"Acceleration on {where}")
    _model_column(table)
    for axis in AXES:
        table.add_column(f"{axis}\nRMSE\n{unit_text(ACCELERATION_UNITS[axis])}", justify="right", no_wrap=True)
    if mae:
        for axis in AXES:
            table.add_column(f"{axis}\nMAE\n{unit_text(ACCELERATION_UNITS[axis])}", justify="right", no_wrap=True)
    for axis in AXES:
        table.add_column(f"{axis}\nR²", justify="right", no_wrap=True)
    for model in models:
        found = model.get("acceleration") or {}
        rmse, others, r2 = (found.get(key) or {} for key in ("rmse", "mae", "r2"))
        cells = [_marked(rmse.get(axis), verdicts.get((model["name"], "acceleration", None, axis))) for axis in AXES]
        cells += [Text(number(others.get(axis))) for axis in AXES] * mae
        table.add_row(_name(model), *cells, *(Text(_share(r2.get(axis))) for axis in AXES))
    return table


def _predictions(models: Sequence[Row], where: str, verdicts: Mapping[Any, str]) -> Table:
    table = plain_table(f"Predictions on {where}: root mean square errors")
    horizons = sorted({key for model in models for key in model.get("rollout") or {}}, key=float)
    lost = any((model["rollout"].get(h) or {}).get("diverged") for model in models for h in horizons)
    table.add_column("ahead", no_wrap=True, justify="right")
    _model_column(table)
    for axis in _ROLLED:
        table.add_column(f"{axis}\n{ROLLOUT_UNITS[axis]}", justify="right", no_wrap=True)
    if lost:
        table.add_column("diverged", justify="right", no_wrap=True)
    for horizon in horizons:
        for k, model in enumerate(models):
            error = model["rollout"].get(horizon) or {}
            cells = [_marked(error.get(a), verdicts.get((model["name"], "rollout", horizon, a))) for a in _ROLLED]
            cells += [Text(f"{error.get('diverged', 0)} of {error.get('starts', '?')}")] * lost
            table.add_row(f"{horizon} s" if k == 0 else "", _name(model), *cells, end_section=model is models[-1])
    return table


def _beside(models: Sequence[Row]) -> Table:
    domains = [model.get("domain") or {} for model in models]
    counts = [(domain.get(side) or {}).get("rows", 0) for domain in domains[:1] for side in ("inside", "outside")]
    beyond = len(counts) == 2 and counts[1] > 0
    timed = any(model.get("seconds_to_evaluate") is not None for model in models)
    caption = (
        f"outside: acceleration error at the {counts[1]} of {sum(counts)} rows with a speed or thrust beyond the "
        "training part's, over that at the others"
    )
    table = plain_table("Laws, size and range", caption * beyond)
    _model_column(table)
    table.add_column("laws of\na hull", no_wrap=True)
    table.add_column("numbers\nfitted", justify="right", no_wrap=True)
    if timed:
        table.add_column("to fit\ns", justify="right", no_wrap=True)
        table.add_column("to evaluate\ns", justify="right", no_wrap=True)
    if beyond:
        for axis in AXES:
            table.add_column(f"{axis}\noutside", justify="right", no_wrap=True)
    for model, domain in zip(models, domains, strict=True):
        verdict = str(model.get("audit", "not run"))
        cells = [Text(verdict, style=_STYLES["worse"] if verdict == "fail" else "")]
        cells += [Text(number(model.get("parameters")))]
        if timed:
            cells += [Text(number(model.get(f"seconds_to_{what}"), 2, blank="")) for what in ("fit", "evaluate")]
        if beyond:
            cells += [Text(_ratio(domain, axis)) for axis in AXES]
        table.add_row(_name(model), *cells)
    return table


def _model_column(table: Table) -> None:
    table.add_column("model", min_width=8, overflow="fold")


def _name(model: Row) -> Text:
    return Text(str(model["name"]))


def _marked(value: Any, verdict: str | None) -> Text:
    """A number with its mark; the place of the mark stays free where there is none, so that numbers stand in line."""
    return Text(f"{number(value)} {MARKS.get(verdict or '', ' ')}", style=_STYLES.get(verdict or "", ""))


def _share(value: Any) -> str:
    """R squared, to three places; far below zero whole numbers do."""
    value = finite(value)
    return "n/a" if value != value else f"{round(value, 3) + 0.0:.3f}" if value > -10.0 else number(value, 2)


def _ratio(domain: Mapping[str, Any], axis: str) -> str:
    inside, outside = (finite(((domain.get(s) or {}).get("rmse") or {}).get(axis)) for s in ("inside", "outside"))
    return percent(outside / inside) if inside > 0.0 else "n/a"
