"""The same findings as tables for the terminal: readable at 80 columns, plain when piped."""

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Column, Table
from rich.text import Text

from ...comparison.facts import Comparison
from ...discovery.effect_findings import EffectFinding, FittedTerm
from ...discovery.findings import Advice, Calibrated, Findings, NotCalibrated, SensorError, Step
from ...discovery.lawful.laws_over import Passivity
from ...discovery.search.estimation import Interval
from ...physics.motion import AXES
from ...physics.presentation import listing, number, percent, unit_text, words
from ...physics.vehicle import Vehicle
from ...residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, ByAxis, RolloutRecord
from .. import sureness, wording
from ..page.outcome import gets_worse, opening_parts
from . import layout
from .comparison_screen import ROLLED, trust_style

VERDICT_STYLES = {
    "missing": layout.FOUND,
    "likely": layout.LIKELY,
    "possible": layout.UNSURE,
    "cannot tell": layout.UNSURE,
    "no evidence": layout.ASIDE,
}
HEADLINE_STYLES = VERDICT_STYLES | {"nothing missing": layout.GOOD, "undecided": layout.UNSURE}

_GAPS = ((" ", " "), ("\n", " "), ("\n", "\n"))
"""What parts the words of a table of effects, from wide to narrow; see `_effects_in`."""
_ALONE = "calibrated alone"
"""The name of the model of a calibration in the table of steps."""
_WORSE = 1.05
"""Share of the error before from which it is said to be larger: less may be chance on one part of a log."""


def opening_lines(findings: Findings, comparison: Comparison, nominal: Vehicle) -> list[layout.Prose]:
    """How the terminal begins, in the colours of what is said: see `page.outcome.opening_parts`."""
    parts = opening_parts(findings, comparison, nominal)
    opens = findings.verdict == "nothing missing" and any(part == "answer" for part, _ in parts)
    styles = {
        "headline": HEADLINE_STYLES["undecided" if opens else findings.verdict],
        "done": layout.BAD if gets_worse(findings.steps, comparison.best.horizon) else layout.GOOD,
        "grown": layout.UNSURE,
        "cannot": layout.BAD,
        "trust": trust_style(comparison),
    }
    return [layout.Prose(text, styles.get(part, "")) for part, text in parts]


def steps_table(
    steps: Sequence[Step],
    candidates: Sequence[EffectFinding] = (),
    comparison: Comparison | None = None,
    deciding: str = "",
) -> Table:
    """The error falling: one row per added effect, acceleration and rollout error per axis on held-out data.

    Last comes what a calibration reaches to which nothing is added: more than that is what the effects explain.

    Parameters
    ----------
    steps : the nominal model first
    candidates : effects, which tell the thruster of one that concerns one
    comparison : of all models on the same rows
    deciding : the horizon that decides which to trust [s]; default: that of the comparison, else 10 s
    """
    deciding = deciding or (comparison.best.horizon if comparison else "")
    horizon = _horizon(steps, deciding)
    models = comparison.models if comparison else ()
    calibrated = any(step.added == wording.CALIBRATED for step in steps)
    accelerations = [f"{axis}\nacc.\n{unit_text(ACCELERATION_UNITS[axis])}" for axis in AXES]
    rolled = [f"{axis.replace('position', 'pos.')}\n{horizon} s\n{ROLLOUT_UNITS[axis]}" for axis in ROLLED]
    first = Column("model" if calibrated else "effect added", min_width=12)
    title = f"Error on held-out data: acceleration (acc.) and {horizon} s predictions"
    table = layout.plain_table(title, columns=[first, *layout.number_columns(*accelerations, *rolled)])
    names = _names(candidates)
    for index, step in enumerate(steps):
        added = step.added
        style = (layout.BAD if gets_worse(steps, deciding) else layout.GOOD) if index == len(steps) - 1 > 0 else ""
        named = wording.step_words(step) if step.thruster else f"+ {names.get(str(added), words(str(added)))}"
        label = wording.OWN_NUMBERS if added == wording.CALIBRATED else named if added else "nominal model"
        errors = _errors(step.acceleration_rmse, step.rollout(horizon))
        table.add_row(Text(label, overflow="fold"), *errors, style=style)
    for model in models:
        if model.name == wording.CALIBRATED and horizon in model.rollout:
            table.add_row(_ALONE, *_errors(model.acceleration.rmse, model.rollout[horizon]), style=layout.ASIDE)
    return table


def _errors(acceleration: ByAxis, rollout: RolloutRecord) -> list[str]:
    """The cells of a row of errors."""
    return [number(error, 2) for error in (*map(acceleration.of, AXES), *map(rollout.of, ROLLED))]


def remaining_error(steps: Sequence[Step], deciding: str = "") -> str:
    """What is left of the rollout error after the last step, by axis, and which errors a step made larger.

    Empty when nothing was added.
    """
    horizon = _horizon(steps, deciding)
    if len(steps) < 2 or not all(horizon in step.rollout_rmse for step in (steps[0], steps[-1])):
        return ""
    before, after = (step.rollout(horizon) for step in (steps[0], steps[-1]))
    ratios = {axis: after.of(axis) / max(before.of(axis), 1e-12) for axis in ROLLED}
    shares = ", ".join(f"{axis} {percent(ratio)}" for axis, ratio in ratios.items())
    worse = [axis for axis, ratio in ratios.items() if ratio > _WORSE]
    larger = f" Larger than before: {listing(worse)}." if worse else ""
    text = f"Held-out {horizon} s rollout error after, as a share of before: {shares}.{larger}"
    return " ".join([text, *wording.risen(steps, horizon)])


def candidates_table(
    candidates: Sequence[EffectFinding], nominal: Vehicle, *, most: int = 12, short: bool = False
) -> RenderableType:
    """The `most` surest effects with verdict, odds, value and 95 % interval, and the error that returns without each.

    Parameters
    ----------
    nominal : the vehicle as its file has it: values are those of a corrected file, beside what this one says
    short : say in one line what the columns are
    """
    rest = len(candidates) - most
    more = f"\n{rest} effects more are in findings.json." if rest > 0 else ""
    caption = sureness.SURE_IN_SHORT if short else _caption(candidates)
    return _effects("Effects, surest first", sureness.in_order(candidates)[:most], nominal, f"{caption}{more}")


def added_table(candidates: Sequence[EffectFinding], nominal: Vehicle) -> RenderableType:
    """The effects that a person added by name, with their fitted values; see `candidates_table`."""
    return _effects("Effects added, fitted together", sureness.in_order(candidates), nominal, _caption(candidates))


def unnamed_table(terms: Sequence[FittedTerm]) -> Table | None:
    """Terms that no effect of the catalogue stands for: axis, monomial, value, 95 % interval, how often selected."""
    columns = [*layout.word_columns("axis"), *layout.text_columns("form")]
    columns += [*layout.word_columns("value", "95 % interval"), *layout.number_columns("selected in")]
    rows = []
    for term in terms:
        value = f"{wording.within(term.value, term.ci95, minus='-')} {unit_text(term.unit)}".rstrip()
        rows.append((term.axis, term.form, value, _interval(term.ci95), percent(term.inclusion, blank="")))
    caption = "a term here is a hint, not a cause"
    return layout.plain_table("Terms without a name", caption, columns, rows) if rows else None


def calibrated_table(rows: Sequence[Calibrated]) -> RenderableType:
    """Parameters before and after calibration with 95 % intervals; the unit is the first to go where it is narrow."""
    known = any(row.at_limit or row.ci95 is not None for row in rows)
    columns = [*layout.word_columns("parameter"), *layout.number_columns("before", "after")]
    columns += layout.word_columns(*["95 % interval"] * known, "unit")
    caption = "* held by the law of dissipation; the interval is the log's own" * any(row.held_by_law for row in rows)
    cells = []
    for row in rows:
        after, ends = _after(row) + "*" * row.held_by_law, "at its limit" if row.at_limit else _interval(row.ci95)
        cells.append((row.symbol, number(row.before, 4), after, *[ends] * known, unit_text(row.unit)))
    return layout.fitting("Calibrated parameters", caption, columns, cells, [range(4 + known), range(3 + known)])


def not_calibrated_list(left: Sequence[NotCalibrated], absorbed: Sequence[str] = ()) -> RenderableType | None:
    """Parameters that were to be calibrated and stay as they were, with the reason, and effects that took no part."""
    kept = layout.section("Left as they were", layout.glossary((item.symbol, item.why) for item in left))
    took_no_part = layout.Prose(wording.absorbed_sentence(absorbed)) if absorbed else None
    return layout.stacked([kept, took_no_part]) if kept or took_no_part else None


def energy_text(passivity: Passivity | None) -> Group | None:
    """How the law of dissipation stands in the corrected model: verdict, price, binding corner, proof."""
    if passivity is None:
        return None
    told = layout.Prose(" ".join(wording.energy_lines(passivity)))
    return layout.section(f"Energy: {wording.energy_verdict(passivity)}", told)


def missing_in_words(findings: Findings, nominal: Vehicle) -> Group | None:
    """What each effect of the corrected model means, in a sentence; None when there is none.

    Of a number that the vehicle file has, what is wrong with it stands first.
    """
    pairs = []
    for item in sureness.in_order(findings.added):
        wrong = [f"{one.told(minus='-')}." for one in sureness.file_numbers(item, nominal) if one.filed()]
        if told := " ".join([*wrong, unit_text(item.sentence)]).strip():
            pairs.append((wording.effect_words(item), told))
    return layout.section("What the corrected model adds, in words", layout.glossary(pairs))


def sensors_list(sensors: Sequence[SensorError]) -> Group | None:
    """What the sensors and their record do wrong, in sentences; None where they do nothing."""
    told = [sensor.sentence for sensor in sensors if sensor.verdict != "no evidence"]
    return layout.section("What the log does wrong", layout.bullets(told))


def not_judged(candidates: Sequence[EffectFinding]) -> str:
    """The effects that this log cannot show, as a sentence; empty when there are none."""
    names = list(dict.fromkeys(wording.effect_words(item) for item in candidates if item.cannot_tell))
    return f"Could not be judged in this log: {listing(names)}." if names else ""


def advice_list(advice: Sequence[Advice]) -> Group | None:
    """Manoeuvres that would settle what this log leaves open, each said once; None when there are none."""
    reasons: dict[str, list[str]] = {}
    for item in advice:
        reasons.setdefault(item.manoeuvre, []).append(item.why)
    lines = [f"{manoeuvre}: {'; '.join(dict.fromkeys(why))}" for manoeuvre, why in reasons.items()]
    return layout.section("What to record next", layout.bullets(lines))


def _caption(candidates: Sequence[EffectFinding]) -> str:
    """What the columns of a table of effects are."""
    return f"{sureness.sure_caption(candidates)}; {sureness.BACK}: {sureness.COMES_BACK}"


def _effects(title: str, candidates: Sequence[EffectFinding], nominal: Vehicle, caption: str) -> RenderableType:
    """Effects with values: each interval beside its value where there is room, or else below it."""
    return layout.Fitting([_effects_in(candidates, nominal, (title, caption), *gaps) for gaps in _GAPS])


def _effects_in(
    candidates: Sequence[EffectFinding], nominal: Vehicle, told: tuple[str, str], gap: str, gap_in_heading: str
) -> Table:
    """The table with its columns and rows.

    Parameters
    ----------
    told : its title and its caption
    gap, gap_in_heading : what stands between a value and its interval, and between two words of the last heading
    """
    columns = [Column("effect", min_width=14), *layout.word_columns("verdict"), *layout.number_columns("sure")]
    columns += layout.text_columns("value (95 %)")
    columns += layout.number_columns(f"comes{gap_in_heading}back\nwithout{gap_in_heading}it")
    rows = []
    for item in candidates:
        verdict, others = sureness.verdict_word(item), wording.twins(item)
        name = wording.effect_words(item) + (f"\n(or {', '.join(others)})" if others else "")
        numbers = sureness.file_numbers(item, nominal) if verdict != "no evidence" else ()
        values, styled = "\n".join(_value(one, gap) for one in numbers), VERDICT_STYLES.get(verdict, "")
        rows.append((name, Text(verdict, style=styled), sureness.odds(item), values, sureness.comes_back(item)))
    return layout.plain_table(*told, columns, rows)


def _after(row: Calibrated) -> str:
    """A calibrated value, to the decimals of its interval unless a limit or a law holds it."""
    known = None if row.at_limit or row.held_by_law else row.ci95
    return wording.within(row.after, known, minus="-") if known else number(row.after, 4)


def _names(candidates: Sequence[EffectFinding]) -> dict[str, str]:
    """Effects in words, with the thruster where only one is meant."""
    found: dict[str, list[str]] = {}
    for item in candidates:
        found.setdefault(item.effect, []).append(wording.effect_words(item))
    return {effect: names[0] if len(names) == 1 else words(effect) for effect, names in found.items()}


def _horizon(steps: Sequence[Step], deciding: str) -> str:
    return wording.pick_horizon([key for step in steps for key in step.rollout_rmse], deciding or wording.LEAD)


def _interval(ends: Interval | tuple[float, float] | None) -> str:
    return wording.interval(ends, minus="-", blank="")


def _value(one: sureness.FileNumber, gap: str) -> str:
    """A number with its interval, and below it what the vehicle file says."""
    ends = _interval(one.ci95)
    filed = f"\nthe file says {one.filed(minus='-')}" if one.filed() else ""
    written = "" if one.written is None else f"\nwritten by the laws: {number(one.written, 4)}"
    return f"{one.symbol} = {one.amount(minus='-')}{f'{gap}({ends})' if ends else ''}{filed}{written}"
