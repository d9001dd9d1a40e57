"""Screens of `compare` and `control`: the model to trust, all numbers, where models fail, and how near they steer."""

import math
from collections.abc import Mapping, Sequence

from rich.console import Group, RenderableType
from rich.table import Column, Table
from rich.text import Text

from ...comparison.facts import ROLLED, ComparedModel, Comparison, Domain, PairedRecord
from ...comparison.failing.failures import Structure
from ...discovery.findings import FailingPlace
from ...physics.motion import AXES
from ...physics.presentation import number, percent, share_removed, unit_text, words
from ...residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, RolloutRecord
from ...steering.closed_loop import PERFECT, ControlRecord, Tracking
from ..model_words import held_words
from ..page.outcome import cannot
from ..wording import INTERVAL_HOLDS, held_shares, judged_rows
from . import layout

MARKS = {"better": "<", "worse": ">", "no difference": "=", "too short to tell": "?"}
FITTED_HERE = "*"
"""The mark of a model that was fitted to rows that are judged."""
_STYLES = {"better": layout.GOOD, "worse": layout.BAD}
Marks = Mapping[tuple[str, str, str | None, str], str]
"""Verdicts of differences by model, quantity, horizon and axis."""


def best_text(found: Comparison) -> RenderableType | None:
    """Which model to trust, why, and what it cannot do; None where nothing says so."""
    if not found.best.sentence:
        return None
    weak = layout.Prose(told, layout.BAD) if (told := cannot(found)) else None
    return layout.stacked([layout.Prose(found.best.sentence, style=f"bold {trust_style(found)}"), weak])


def trust_style(found: Comparison) -> str:
    """Good where a model is to be trusted, bad where none is."""
    return layout.GOOD if found.best.model else layout.BAD


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
    return layout.stacked(
        [
            legend,
            _accelerations(models, where, verdicts),
            _predictions(models, where, verdicts),
            _laws_and_size(models),
            _intervals(models),
            *(layout.Prose(told) for model in models if (told := held_words(model.held, model.name))),
        ]
    )


def notes_list(comparison: Comparison) -> RenderableType | None:
    """What a reader must know of the comparison; None where there is nothing."""
    names, notes = tuple(model.name for model in comparison.models), comparison.notes
    # A note may begin with the name of a model, which keeps its letters.
    texts = [f"{note if note.startswith(names) else note[:1].upper() + note[1:]}." for note in notes]
    return layout.section("Notes", layout.bullets(texts))


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
    return layout.Prose(" ".join(texts)) if texts else None


def _name(model: ComparedModel) -> Text:
    return Text(f"{model.name} {FITTED_HERE}" if model.fitted_here else model.name)


def _accelerations(models: Sequence[ComparedModel], where: str, verdicts: Marks) -> RenderableType:
    """Where it is narrow the mean absolute errors go first, then the shares explained."""
    heads = [f"{axis}\n{error}\n{unit_text(ACCELERATION_UNITS[axis])}" for error in ("RMSE", "MAE") for axis in AXES]
    heads += [f"{axis}\nR²" for axis in AXES]
    rows = []
    for model in models:
        found, marks = model.acceleration, (verdicts.get((model.name, "acceleration", None, axis)) for axis in AXES)
        errors = [_marked(found.rmse.of(axis), verdict) for axis, verdict in zip(AXES, marks, strict=True)]
        means, shares = ([of(one.of(axis)) for axis in AXES] for of, one in ((number, found.mae), (_share, found.r2)))
        rows.append((_name(model), *errors, *means, *shares))
    columns, kept = [_model_column(), *layout.number_columns(*heads)], [range(10), (0, 1, 2, 3, 7, 8, 9), range(4)]
    return layout.fitting(f"Acceleration on {where}", "", columns, rows, kept)


def _predictions(models: Sequence[ComparedModel], where: str, verdicts: Marks) -> Table:
    horizons = sorted({key for model in models for key in model.rollout}, key=float)
    lost = any(error.diverged for model in models for error in model.rollout.values())
    heads = [f"{axis}\n{ROLLOUT_UNITS[axis]}" for axis in ROLLED] + ["diverged"] * lost
    columns = [*layout.number_columns("ahead"), _model_column(), *layout.number_columns(*heads)]
    table = layout.plain_table(f"Predictions on {where}: root mean square errors", columns=columns)
    for horizon in horizons:
        for k, model in enumerate(models):
            error = model.rollout.get(horizon) or RolloutRecord()
            cells = [_marked(error.of(a), verdicts.get((model.name, "rollout", horizon, a))) for a in ROLLED]
            ran = [f"{error.diverged} of {'?' if error.starts is None else error.starts}"] * lost
            table.add_row(f"{horizon} s" * (k == 0), _name(model), *cells, *ran, end_section=model is models[-1])
    return table


def _laws_and_size(models: Sequence[ComparedModel]) -> RenderableType:
    """Where it is narrow the numbers fitted and the times go."""
    domains = [model.domain or Domain() for model in models]
    within, outside = domains[0].inside.rows, domains[0].outside.rows
    beyond = outside > 0
    timed = any(model.seconds_to_evaluate is not None for model in models)
    caption = (
        f"outside: acceleration error at the {outside} of {within + outside} rows with a speed or thrust beyond the "
        "training part's, over that at the others"
    )
    heads = ["numbers\nfitted", *["to fit\ns", "to evaluate\ns"] * timed]
    heads += [f"{axis}\noutside" for axis in AXES] * beyond
    columns = [_model_column(), *layout.word_columns("laws of\na hull"), *layout.number_columns(*heads)]
    rows = []
    for model, domain in zip(models, domains, strict=True):
        verdict = Text(model.audit, style=_STYLES["worse"] if model.audit == "fail" else "")
        times = [number(s, 2, blank="") for s in (model.seconds_to_fit, model.seconds_to_evaluate) if timed]
        ratios = [_ratio(domain, axis) for axis in AXES if beyond]
        rows.append((_name(model), verdict, number(model.parameters), *times, *ratios))
    places = range(len(columns))
    outside_alone = [k for k in places if k < 2 or k > 2 + 2 * timed]
    return layout.fitting("Laws, size and range", caption * beyond, columns, rows, [places, outside_alone])


def _intervals(models: Sequence[ComparedModel]) -> Table | None:
    """What the intervals of networks hold of the judged rows; vehicles have none."""
    columns = [_model_column(), *layout.number_columns("holds", "holds\nbeyond")]
    found = [(_name(model), model.interval) for model in models if model.interval]
    rows = [(name, held_shares(one.inside), held_shares(one.outside)) for name, one in found]
    return layout.plain_table("Intervals", INTERVAL_HOLDS, columns, rows) if rows else None


def _model_column() -> Column:
    return Column("model", min_width=8, overflow="fold")


def _marked(value: float, verdict: str | None) -> Text:
    """A number with its mark; the place of the mark stays free where there is none, so that numbers stand in line."""
    return Text(f"{number(value)} {MARKS.get(verdict or '', ' ')}", style=_STYLES.get(verdict or "", ""))


def _share(value: float) -> str:
    """R squared, to three places; far below zero whole numbers do."""
    return "n/a" if value != value else f"{round(value, 3) + 0.0:.3f}" if value > -10.0 else number(value, 2)


def _ratio(domain: Domain, axis: str) -> str:
    sides = (domain.inside, domain.outside)
    inside, outside = (math.nan if side.rmse is None else side.rmse.of(axis) for side in sides)
    return percent(outside / inside) if inside > 0.0 else "n/a"


_NEWS = {
    *("slow force", "answer to commands", "slow, of unknown origin"),
    *("early", "late"),
    "depends on heading",
    *("drifts", "grows", "shrinks"),
}
"""Verdicts of the looks at an error that are news."""


def failures_table(places: Sequence[FailingPlace], whose: str = "") -> RenderableType:
    """Where the models fail; `whose` says of which models that is told.

    What removes the error stands in a column of its own where there is room, else below the place.
    """
    return layout.Fitting([_failures_in(places, whose, beside) for beside in (True, False)])


def structure_list(structure: Sequence[Structure]) -> RenderableType | None:
    """What is plain about the error of the first model by frequency, lag, heading and time; None when nothing is."""
    if not structure:
        return None
    first = structure[0]
    told = [(axis, look[axis]) for axis in AXES for look in first.looks]
    pairs = [(axis, unit_text(one.sentence)) for axis, one in told if one.verdict in _NEWS]
    return layout.section(f"What the error of the {first.model} model is like", layout.glossary(pairs))


def _failures_in(places: Sequence[FailingPlace], whose: str, beside: bool) -> Table:
    rows_of = {place.rows_of for place in places if place.rows_of is not None}
    title = f"Where it fails ({', '.join(map(_rows_in_words, sorted(rows_of)))})" if rows_of else "Where it fails"
    known = any(place.removed_by for place in places)
    caption = "Removed by: adding it lowers the error there on held-out rows too." if known else ""
    if any(one.share_removed > 1.0 for place in places for one in place.removed_by):
        caption += " More than all: others, alone, would add to it."
    caption = caption if places else "No regime of speeds, turns or commands stands out in the error."
    columns = [*layout.word_columns("model"), Column("where"), *layout.word_columns("axis")]
    columns += layout.number_columns("share of\nerror", "share of\ntime", "error\nthere")
    columns += layout.word_columns(*["removed by"] * (known and beside))
    rows = []
    for place in places:
        removed = [f"{words(one.effect)} {share_removed(one.share_removed)}" for one in place.removed_by]
        below = [f"removed by {', '.join(removed)}"] * (bool(removed) and not beside)
        below += [f"removed by: {place.unlinked}"] * bool(place.unlinked)
        where = Group(*map(layout.Prose, [place.where, *below]))
        shares = (percent(place.share_of_error), percent(place.share_of_rows, blank=""))
        error = "" if place.rmse is None else f"{number(place.rmse, 2)} {unit_text(place.unit)}"
        rows.append((place.model, where, place.axis, *shares, error, *["\n".join(removed)] * (known and beside)))
    table = layout.plain_table(title, " ".join(filter(None, (whose, caption))), columns, rows)
    table.show_header = bool(places)
    return table


def _rows_in_words(rows_of: str) -> str:
    return {"all": "whole log", "test": "held-out part"}.get(rows_of, f"{rows_of} part")


_MATTERS = 0.05
"""Share by which an error must differ to be coloured: what gusts and noise change it by from seed to seed."""


def control_tables(record: ControlRecord) -> RenderableType:
    """A table for each track, and what its columns are."""
    tracks = dict.fromkeys(result.track for result in record.results)
    legend = (
        "error: root mean square of the distance from the moving point. effort: of the commands, as a share of full. "
        "off lane: share of the time farther from the point than it moves in a second. step: median of the "
        f"controller's processor time. The model called {PERFECT} is the true boat itself."
    )
    return layout.stacked([*(_table(record, track) for track in tracks), layout.Prose(legend, "dim")])


def _table(record: ControlRecord, track: str) -> RenderableType:
    results = [result for result in record.results if result.track == track]
    heads = ("error [m]", f"against {results[0].model}", "effort", "off lane", "at limit", "step [ms]", "failures")
    columns = [*layout.word_columns("model"), *(Column(head, justify="right") for head in heads)]
    rows = []
    for place, row in enumerate(results):
        name, merit = Text(row.model, style=layout.FOUND if row.model == PERFECT else ""), row.merit
        shares = [f"{100.0 * share:.0f} %" for share in (merit.off_lane, merit.at_limit)]
        errors = (f"{merit.rmse:.3f}", _against(row) if place else "", f"{merit.effort:.2f}")
        rows.append((name, *errors, *shares, f"{merit.step:.1f}", _failures(row)))
    return layout.plain_table(f"{track}, {record.controller} ({record.speed:.2f} m/s)", "", columns, rows)


def _against(row: Tracking) -> Text:
    share = row.against_first
    style = layout.GOOD if share < -_MATTERS else layout.BAD if share > _MATTERS else ""
    return Text(f"{100.0 * share:+.0f} %", style=style)


def _failures(row: Tracking) -> Text:
    text = "lost" if row.merit.lost else str(row.merit.unsolved or "none")
    return Text(text, style=layout.BAD if text != "none" else "")
