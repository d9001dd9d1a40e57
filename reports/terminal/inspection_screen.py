"""Screens of `inspect` and `init`: what a log holds, what its checks found, and the vehicle that it shows."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Column, Table
from rich.text import Text

from ...measurements.canonical import command_kind, unit_of
from ...measurements.inspection import ChannelSummary, Inspection, Inspections
from ...measurements.quality.checks.excitation import Excitation
from ...measurements.quality.record import Finding, Verdict
from ...measurements.thrusters_in_log import DetectedThruster
from ...physics.presentation import listing, number, percent, unit_text
from ...physics.vehicle import Vehicle
from .layout import (
    ASIDE,
    BAD,
    GOOD,
    UNSURE,
    Prose,
    bullets,
    fitting,
    number_columns,
    plain_table,
    section,
    stacked,
    text_columns,
    word_columns,
)

STYLES = {"defect": BAD, "warning": UNSURE, "note": "cyan", "cannot tell": ASIDE, "ok": GOOD}
_TABLED = ("defect", "warning", "note")


def quality_parts(findings: Sequence[Finding]) -> list[RenderableType | None]:
    """Findings as sections: a table, what cannot be told, and what is fine."""

    def told(verdict: Verdict) -> Iterator[str]:
        return (f"{item.check}: {item.sentence}" for item in findings if item.verdict == verdict)

    return [
        _table([item for verdict in _TABLED for item in findings if item.verdict == verdict]),
        section("Cannot be told", bullets(told("cannot tell"), ASIDE)),
        section("Checked and sound", bullets(told("ok"))),
    ]


def style_of(findings: Sequence[Finding]) -> str:
    """The style of the worst finding."""
    verdicts = {item.verdict for item in findings}
    return next((STYLES[verdict] for verdict in _TABLED[:2] if verdict in verdicts), STYLES["ok"])


def _table(findings: Sequence[Finding]) -> Table | None:
    if not findings:
        return None
    count = sum(1 for item in findings if item.fix)
    caption = f"inspect LOG --fix OUT.csv writes a log with {count} of these put right" if count else ""
    columns = [*word_columns("check"), Column("what was found, what follows, and what to do")]
    table = plain_table("Quality", caption, columns)
    for item in findings:
        remedy = [Prose(f"> {item.cure}{' (--fix does it)' if item.fix else ''}")] if item.remedy else []
        name = Text(f"{item.check}\n{item.verdict}", style=STYLES[item.verdict])
        table.add_row(name, Group(Prose(item.told), *remedy), end_section=True)
    return table


_MOST_UNUSED = 12
_MOST_STRETCHES = 4
"""Names that are told of what is not used, and stretches: some lines, beside what is used."""
_COLUMNS: tuple[Verdict, ...] = ("defect", "warning", "cannot tell")
"""Verdicts that several logs are told apart by."""


def inspection_screen(inspection: Inspection, vehicle: Vehicle | None = None) -> RenderableType:
    """An inspection in words, then its channels in one table.

    Parameters
    ----------
    inspection : Inspection
        Of one log.
    vehicle : Vehicle, optional
        For which the log was inspected; None when none was named.
    """
    excitation, plan, quality = inspection.excitation, inspection.plan, inspection.quality
    length = f": {number(excitation.seconds)} s of usable motion" if excitation else ""
    style = BAD if plan.missing else style_of(quality)
    whose = f" for {vehicle.name}" if vehicle else ""
    if plan.missing:
        done = section(f"Not usable{whose}, because", bullets(plan.missing), style=BAD)
    else:
        done = section(f"What undertow would do with it{whose}", bullets(_plan(inspection, vehicle)))
    compared = [item.sentence for item in inspection.alignment if not quality]
    late, in_step = ([_sentence(t) for t in compared if ("in step" in t) is fine] for fine in (False, True))
    parts = [
        Prose(f"{inspection.path}{length}"),
        Prose(inspection.verdict, style) if inspection.verdict else None,
        *quality_parts(quality),
        done,
        section("Notes", *(bullets(texts, style) for texts, style in _notes(inspection))),
        _excitation(excitation, bool(quality)) if excitation else None,
        section("Time alignment", bullets(late, UNSURE), bullets(in_step)),
        _channels(inspection.channels) if inspection.channels else None,
    ]
    return stacked(parts)


def fixed_text(inspection: Inspection) -> RenderableType | None:
    """What `--fix` wrote, None where it was not asked."""
    fixed = inspection.fixed
    if fixed is None:
        return None
    done = section(f"Written to {fixed.path}", bullets(fixed.done or ["nothing had to be put right"]))
    return stacked([done, section("Not put right; the remedies above tell how", bullets(fixed.left or (), UNSURE))])


def inspections_screen(inspections: Inspections) -> RenderableType:
    """Several inspections: what the logs show together, then a line for each."""
    logs, quality = inspections.logs, inspections.quality or ()
    seconds = sum(log.excitation.seconds for log in logs if log.excitation)
    columns = [*text_columns("log"), *number_columns("seconds"), *map(Column, _COLUMNS)]
    rows = []
    for log in logs:
        checks = [dict.fromkeys(f.check for f in log.quality if f.verdict == verdict) for verdict in _COLUMNS]
        usable = number(log.excitation.seconds, blank="none") if log.excitation else "none"
        rows.append((Path(log.path).name, usable, *(Prose(", ".join(names)) for names in checks)))
    parts = [
        Prose(f"{len(logs)} logs together: {number(seconds)} s of usable motion"),
        Prose(str(inspections.verdict), style_of(quality)),
        *quality_parts(quality),
        plain_table("Each log by itself", "inspect one LOG for all about it", columns, rows),
        section("Notes", bullets(inspections.notes or ())),
    ]
    return stacked(parts)


def _plan(inspection: Inspection, vehicle: Vehicle | None) -> list[str]:
    """What would be done, step by step."""
    plan, recipe, lines = inspection.plan, inspection.plan.recipe, []
    if plan.segments:
        many = len(plan.segments)
        spans = [f"{_tenths(part.start)} to {_tenths(part.end)} s" for part in plan.segments[:_MOST_STRETCHES]]
        more = f" and {many - len(spans)} more" if many > len(spans) else ""
        text = f"{many} stretches without gaps" if many > 1 else "one stretch without gaps"
        lines.append(f"Take {text}: {', '.join(spans)}{more}.")
    commands = [channel.name for channel in inspection.channels if command_kind(channel.name)]
    if vehicle is not None:
        wanted = listing([thruster.channel for thruster in vehicle.thrusters])
        how = "held until the next command" if recipe.commands == "hold" else "interpolated"
        lines.append(f"Drive the model with {wanted}, {how}.")
    elif commands:
        lines.append(
            f"Commands in the log: {listing(commands)}. Whether they fit a vehicle, and whether its thrusters worked "
            "where their records stand still, --vehicle V tells: discover refuses a log where that is not so."
        )
    else:
        lines.append("No command of a thruster was recognised; without one, no vehicle can be judged. See --map.")
    lines.append("Search for missing effects at the log's own rate (at most 20 Hz), unfiltered.")
    low_pass = f", velocities low-passed at {recipe.cutoff:g} Hz" if recipe.cutoff else ""
    lines.append(f"Judge models at {plan.rate:g} Hz{low_pass}.")
    judged = recipe.shares[-1]
    seconds = sum(part.end - part.start for part in plan.segments)
    lines.append(
        f"compare fits on the first {percent(1.0 - judged)} of the time and judges on the last {percent(judged)} "
        f"({number(judged * seconds, 2)} s), which no fit sees; discover judges every part by models found without it."
    )
    return lines


def _notes(inspection: Inspection) -> list[tuple[Sequence[str], str]]:
    """Defects, then what was guessed and converted, then what was left out; each with its style."""
    unused, plan = inspection.unused, inspection.plan
    most = len(unused) if plan.missing else _MOST_UNUSED
    left_out = [f"Not used: {_by_topic(unused[:most])}"] if unused else []
    if len(unused) > most:
        left_out[0] += f"; and {len(unused) - most} more (--json has them all)"
    return [([_sentence(note) for note in plan.notes], UNSURE), (inspection.notes, ""), (left_out, "dim")]


def _by_topic(names: Sequence[str]) -> str:
    """Streams `topic:field` with each topic said once; bare columns as they are."""
    topics: dict[str, list[str]] = {}
    for name in names:
        topic, colon, field = name.rpartition(":")
        topics.setdefault(topic if colon else "", []).append(field)
    return "; ".join(
        f"{', '.join(fields)} of {topic}" if topic else ", ".join(fields) for topic, fields in topics.items()
    )


def _excitation(excitation: Excitation, told: bool) -> Group | None:
    """Facts, and what they do not show unless the checks have `told` it."""
    speeds = (("surge", excitation.u, "m/s"), ("sway", excitation.v, "m/s"), ("yaw rate", excitation.r, "rad/s"))
    ranges = [f"{name} {number(low, 2)} to {number(high, 2)} {unit}" for name, (low, high), unit in speeds]
    shares = [
        f"astern {percent(excitation.astern)}",
        f"turning to starboard {percent(excitation.turning_to_starboard)}",
        f"turning to port {percent(excitation.turning_to_port)}",
    ]
    facts = [f"Speeds: {', '.join(ranges)}.", f"Share of the time: {', '.join(shares)}."]
    return section("What the boat did", bullets(facts), bullets(() if told else excitation.sentences, UNSURE))


def _channels(channels: Sequence[ChannelSummary]) -> RenderableType:
    """The channels in one table; at a narrow width without noise, then without unit, rate and gaps."""
    columns = [*text_columns("channel"), *word_columns("unit"), *number_columns("rows", "rate\nHz", "gaps")]
    columns += number_columns("longest\ngap s", "range", "noise")
    rows = [
        (
            Text(channel.name),
            unit_text(channel.unit),
            number(channel.count),
            number(channel.rate, blank=""),
            number(channel.gaps),
            number(channel.longest_gap, blank=""),
            f"{number(channel.minimum)} to {number(channel.maximum)}",
            number(channel.noise, 2, blank=""),
        )
        for channel in channels
    ]
    gaps = (4, 5) if any(channel.gaps for channel in channels) else ()
    kept = [(0, 1, 2, 3, *gaps, 6, 7), (0, 1, 2, 3, *gaps, 6), (0, 2, *gaps, 6), (0, 6)]
    return fitting("Channels", "" if gaps else "no gaps", columns, rows, kept)


def _tenths(seconds: float) -> str:
    """A time [s] to a tenth; a stamp of ten digits keeps them.

    Examples
    --------
    >>> _tenths(0.05), _tenths(239.95), _tenths(1.7e9)
    ('0.1', '239.9', '1700000000')
    """
    return f"{seconds:.1f}".removesuffix(".0")


def _sentence(text: str) -> str:
    """The text with a capital letter, but not where it opens with the name of a channel.

    Examples
    --------
    >>> _sentence("the yaw rate r is late."), _sentence("u: 3 gaps")
    ('The yaw rate r is late.', 'u: 3 gaps')
    """
    return text if ":" in text.split(" ")[0] else text[:1].upper() + text[1:]


_HULL = ("mass", "inertia_z", "X_udot", "Y_vdot", "N_rdot", "X_u", "Y_v", "N_r")
_UNITS = {"mass": "kg", "inertia_z": "kg m^2"}


def init_screen(
    vehicle: Vehicle, thrusters: Sequence[DetectedThruster], doubts: Sequence[str]
) -> list[RenderableType | None]:
    """Thrusters, numbers of the hull with their sources, and what nobody told and no log shows."""
    return [
        _thrusters(vehicle, thrusters),
        _hull(vehicle),
        section("To look at", bullets(doubts), style=f"bold {UNSURE}"),
    ]


def _thrusters(vehicle: Vehicle, thrusters: Sequence[DetectedThruster]) -> Table:
    columns = [*word_columns("thruster", "side"), Column("told by")]
    columns += [Column(title, justify="right") for title in ("full astern", "neutral", "full ahead")]
    columns += [*word_columns("unit"), Column("N ahead", justify="right")]
    rows = []
    for one, built in zip(thrusters, vehicle.thrusters, strict=True):
        was = f"was {one.read_as}" if one.read_as != one.channel else ""
        done = ", ".join(filter(None, (was, "turned round" if one.turned else "")))
        ends = [number(end, 4) for end in (one.output.astern, one.output.neutral, one.output.ahead)]
        full = number(float(built.curve.thrust(np.array([one.output.ahead]), built.command)[0]))
        by = ("log; " + done if done else "log") if one.by_log else "name"
        rows.append((one.name, one.side or "?", by, *ends, unit_text(unit_of(one.channel)), full))
    return plain_table("Thrusters", "", columns, rows)


def _hull(vehicle: Vehicle) -> Table:
    columns = [*word_columns(""), Column("value", justify="right"), *word_columns("unit"), Column("where it is from")]
    units = {symbol: _UNITS.get(symbol) or vehicle.parameter(symbol).unit for symbol in _HULL}
    rows = [
        (symbol, number(vehicle.value(symbol)), unit_text(unit), Prose(_source(vehicle, symbol)))
        for symbol, unit in units.items()
    ]
    return plain_table("Hull", "", columns, rows)


def _source(vehicle: Vehicle, symbol: str) -> str:
    for entry in (vehicle.sources, vehicle.sources.get("added_mass"), vehicle.sources.get("damping")):
        if isinstance(entry, dict) and symbol in entry:
            return str(entry[symbol])
    return str(vehicle.sources.get("all", ""))
