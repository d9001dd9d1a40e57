"""What `compare` shows on the terminal: the model to trust, then all numbers, marked where they are no chance."""

import math
from collections.abc import Mapping, Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ...comparison.differences import PairedRecord
from ...comparison.facts import ComparedModel, Comparison, Domain, Held
from ...physics.frames import AXES
from ...physics.in_words import number, percent, unit_text
from ...residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, RolloutRecord
from ..band_words import held_words
from ..wording import INTERVAL_HOLDS, held_shares, judged_rows
from .layout import BAD, GOOD, Fitting, Prose, bullets, plain_table, section, stacked

MARKS = {"better": "<", "worse": ">", "no difference": "=", "too short to tell": "?"}
FITTED_HERE = "*"
"""The mark of a model that was fitted to rows that are judged."""
_STYLES = {"better": GOOD, "worse": BAD}
_ROLLED = (*AXES, "position")

Marks = Mapping[tuple[str, str, str | None, str], str]
"""Verdicts of differences by model, quantity, horizon and axis."""


def best_text(found: Comparison) -> RenderableType | None:
    """Which model to trust, and why; None where nothing says so."""
    return Prose(found.best.sentence, style=f"bold {trust_style(found)}") if found.best.sentence else None


def trust_style(found: Comparison) -> str:
    """Good where a model is to be trusted, bad where none is."""
    return GOOD if found.best.model else BAD


def comparison_table(
    models: Sequence[ComparedModel], split: str, differences: Sequence[PairedRecord] = ()
) -> RenderableType:
    """All compared models, a line each: acceleration, predictions by horizon, and laws, size, time and range.

    Parameters
    ----------
    models : the first is the one against which the marks tell
    split : the part of the logs that judges, or "all"
    differences : between models, which give the marks
    """
    where = judged_rows(split)
    first = models[0].name
    verdicts = {(d.model, d.quantity, d.horizon, d.axis): d.verdict for d in differences if d.against == first}
    legend = _legend(set(verdicts.values()), first, any(model.fitted_here for model in models))
    tables = [
        Fitting([_accelerations(models, where, verdicts, mae) for mae in (True, False)]),
        _predictions(models, where, verdicts),
        _beside(models),
        *([_intervals(models)] if any(model.interval for model in models) else []),
        *(Prose(told) for model in models if (told := held_words(model.held, model.name))),
    ]
    return stacked([legend, *tables] if legend else tables)


def notes_list(comparison: Comparison) -> RenderableType | None:
    """What a reader must know of the comparison; None where there is nothing."""
    names, notes = tuple(model.name for model in comparison.models), comparison.notes
    # A note may begin with the name of a model, which keeps its letters.
    told = [f"{note if note.startswith(names) else note[:1].upper() + note[1:]}." for note in notes]
    return section("Notes", bullets(told)) if notes else None


def _legend(told: set[str], first: str, fitted: bool) -> RenderableType | None:
    """What the marks mean that the tables have; `fitted` says that a name has one."""
    meaning = {
        "better": f"a smaller error than {first}'s by more than chance",
        "worse": "a larger one",
        "no difference": "cannot be told apart on these rows, which is not to say equal",
        "too short to tell": "too few rows to tell",
    }
    marks = [f"{MARKS[verdict]} {text}" for verdict, text in meaning.items() if verdict in told]
    texts = [f"Marks beside numbers: {'; '.join(marks)}."] * bool(marks)
    texts += [f"{FITTED_HERE} beside a name: fitted to rows that are judged, its errors are too small."] * fitted
    return Prose(" ".join(texts)) if texts else None


def _name(model: ComparedModel) -> Text:
    return Text(f"{model.name} {FITTED_HERE}" if model.fitted_here else model.name)


def _accelerations(models: Sequence[ComparedModel], where: str, verdicts: Marks, mae: bool) -> Table:
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
        found, name = model.acceleration, model.name
        cells = [_marked(found.rmse.of(axis), verdicts.get((name, "acceleration", None, axis))) for axis in AXES]
        cells += [Text(number(found.mae.of(axis))) for axis in AXES] * mae
        table.add_row(_name(model), *cells, *(Text(_share(found.r2.of(axis))) for axis in AXES))
    return table


def _predictions(models: Sequence[ComparedModel], where: str, verdicts: Marks) -> Table:
    table = plain_table(f"Predictions on {where}: root mean square errors")
    horizons = sorted({key for model in models for key in model.rollout}, key=float)
    lost = any(error.diverged for model in models for error in model.rollout.values())
    table.add_column("ahead", no_wrap=True, justify="right")
    _model_column(table)
    for axis in _ROLLED:
        table.add_column(f"{axis}\n{ROLLOUT_UNITS[axis]}", justify="right", no_wrap=True)
    if lost:
        table.add_column("diverged", justify="right", no_wrap=True)
    for horizon in horizons:
        for k, model in enumerate(models):
            error = model.rollout.get(horizon) or RolloutRecord()
            cells = [_marked(error.of(a), verdicts.get((model.name, "rollout", horizon, a))) for a in _ROLLED]
            cells += [Text(f"{error.diverged} of {'?' if error.starts is None else error.starts}")] * lost
            table.add_row(f"{horizon} s" if k == 0 else "", _name(model), *cells, end_section=model is models[-1])
    return table


def _beside(models: Sequence[ComparedModel]) -> Table:
    domains = [model.domain or Domain() for model in models]
    within, outside = domains[0].inside.rows, domains[0].outside.rows
    beyond = outside > 0
    timed = any(model.seconds_to_evaluate is not None for model in models)
    caption = (
        f"outside: acceleration error at the {outside} of {within + outside} rows with a speed or thrust beyond the "
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
        cells = [Text(model.audit, style=_STYLES["worse"] if model.audit == "fail" else "")]
        cells += [Text(number(model.parameters))]
        if timed:
            cells += [Text(number(s, 2, blank="")) for s in (model.seconds_to_fit, model.seconds_to_evaluate)]
        if beyond:
            cells += [Text(_ratio(domain, axis)) for axis in AXES]
        table.add_row(_name(model), *cells)
    return table


def _intervals(models: Sequence[ComparedModel]) -> Table:
    """What the intervals of networks hold of the judged rows; vehicles have none."""
    table = plain_table("Intervals", INTERVAL_HOLDS)
    _model_column(table)
    for where in ("holds", "holds\nbeyond"):
        table.add_column(where, justify="right", no_wrap=True)
    for model in models:
        if model.interval:
            table.add_row(_name(model), *(Text(held_shares(side)) for side in _sides(model)))
    return table


def _sides(model: ComparedModel) -> tuple[Held | None, Held | None]:
    found = model.interval
    return (None, None) if found is None else (found.inside, found.outside)


def _model_column(table: Table) -> None:
    table.add_column("model", min_width=8, overflow="fold")


def _marked(value: float, verdict: str | None) -> Text:
    """A number with its mark; the place of the mark stays free where there is none, so that numbers stand in line."""
    return Text(f"{number(value)} {MARKS.get(verdict or '', ' ')}", style=_STYLES.get(verdict or "", ""))


def _share(value: float) -> str:
    """R squared, to three places; far below zero whole numbers do."""
    return "n/a" if value != value else f"{round(value, 3) + 0.0:.3f}" if value > -10.0 else number(value, 2)


def _ratio(domain: Domain, axis: str) -> str:
    inside, outside = (
        math.nan if side.rmse is None else side.rmse.of(axis) for side in (domain.inside, domain.outside)
    )
    return percent(outside / inside) if inside > 0.0 else "n/a"
