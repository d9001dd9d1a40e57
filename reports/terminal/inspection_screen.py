"""An inspection as a screen: what would be done with the log, what to mind, what the boat did, and the channels."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ...measurements.canonical import command_kind
from ...physics.in_words import finite, listing, number, percent, unit_text
from ...physics.vehicle import Vehicle
from .layout import Fitting, Prose, bullets, plain_table, section, stacked
from .quality_table import quality_parts, style_of

_MOST_UNUSED = 12
_MOST_STRETCHES = 4
"""Names that are told of what is not used, and stretches: some lines, beside what is used."""
WARNING = "yellow"


def inspection_screen(inspection: Mapping[str, Any], vehicle: Vehicle | None = None) -> RenderableType:
    """An inspection (`Inspection.to_dict()`, or its JSON) in words, then its channels in one table.

    Parameters
    ----------
    inspection : mapping
        As `inspect --json` prints it.
    vehicle : Vehicle, optional
        For which the log was inspected; None when none was named.
    """
    excitation: Mapping[str, Any] = inspection.get("excitation") or {}
    plan: Mapping[str, Any] = inspection.get("plan") or {}
    length = f": {number(excitation['seconds'])} s of usable motion" if "seconds" in excitation else ""
    quality: Sequence[Mapping[str, Any]] = inspection.get("quality") or []
    parts: list[RenderableType] = [Prose(f"{inspection.get('path', 'log')}{length}")]
    if inspection.get("verdict"):
        parts.append(Prose(str(inspection["verdict"]), "bold red" if plan.get("missing") else style_of(quality)))
    parts += quality_parts(quality)
    if plan.get("missing"):
        title = f"Not usable for {vehicle.name}, because" if vehicle else "Not usable, because"
        parts.append(section(title, bullets(plan["missing"]), style="bold red"))
    elif plan:
        title = f"What undertow would do with it for {vehicle.name}" if vehicle else "What undertow would do with it"
        parts.append(section(title, bullets(_plan(inspection, plan, vehicle))))
    notes = [bullets(texts, style) for texts, style in _notes(inspection, plan) if texts]
    if notes:
        parts.append(section("Notes", *notes))
    if excitation:
        sentences = [bullets(texts, style) for texts, style in _excitation(excitation, bool(quality)) if texts]
        parts.append(section("What the boat did", *sentences))
    compared = [str(item["sentence"]) for item in inspection.get("alignment") or [] if "sentence" in item]
    if compared and not quality:
        late, in_step = ([_sentence(t) for t in compared if ("in step" in t) is fine] for fine in (False, True))
        lists = [bullets(texts, style) for texts, style in ((late, WARNING), (in_step, "")) if texts]
        parts.append(section("Time alignment", *lists))
    channels = inspection.get("channels") or []
    if channels:
        parts.append(_channels(channels))
    return stacked(parts)


def fixed_text(inspection: Mapping[str, Any]) -> RenderableType | None:
    """What `--fix` wrote, None where it was not asked."""
    fixed: Mapping[str, Any] | None = inspection.get("fixed")
    if not fixed:
        return None
    done = [str(text) for text in fixed["done"]] or ["nothing had to be put right"]
    parts = [section(f"Written to {fixed['path']}", bullets(done))]
    if fixed["left"]:
        parts.append(section("Not put right; the remedies above tell how", bullets(list(fixed["left"]), WARNING)))
    return stacked(parts)


def inspections_screen(inspections: Mapping[str, Any]) -> RenderableType:
    """Several inspections (`Inspections.to_dict()`): what the logs show together, then a line for each."""
    logs: Sequence[Mapping[str, Any]] = inspections.get("logs") or []
    quality: Sequence[Mapping[str, Any]] = inspections.get("quality") or []
    seconds = sum(finite((log.get("excitation") or {}).get("seconds")) for log in logs if log.get("excitation"))
    parts: list[RenderableType] = [Prose(f"{len(logs)} logs together: {number(seconds)} s of usable motion")]
    parts.append(Prose(str(inspections.get("verdict")), style_of(quality)))
    parts += quality_parts(quality)
    table = plain_table("Each log by itself", "inspect one LOG for all about it")
    table.add_column("log", overflow="fold")
    table.add_column("seconds", justify="right", no_wrap=True)
    for verdict in ("defect", "warning", "cannot tell"):
        table.add_column(verdict)
    for log in logs:
        checks = [
            Prose(
                ", ".join(dict.fromkeys(str(f["check"]) for f in log.get("quality") or [] if f["verdict"] == verdict))
            )
            for verdict in ("defect", "warning", "cannot tell")
        ]
        usable = number((log.get("excitation") or {}).get("seconds"), blank="none")
        table.add_row(Text(Path(str(log.get("path"))).name), usable, *checks)
    parts.append(table)
    if inspections.get("notes"):
        parts.append(section("Notes", bullets([str(note) for note in inspections["notes"]])))
    return stacked(parts)


def _plan(inspection: Mapping[str, Any], plan: Mapping[str, Any], vehicle: Vehicle | None) -> list[str]:
    """What would be done, step by step."""
    recipe: Mapping[str, Any] = plan.get("recipe") or {}
    lines = []
    stretches = [(finite(part.get("start")), finite(part.get("end"))) for part in plan.get("segments") or []]
    if stretches:
        spans = [f"{_tenths(low)} to {_tenths(high)} s" for low, high in stretches[:_MOST_STRETCHES]]
        more = f" and {len(stretches) - len(spans)} more" if len(stretches) > len(spans) else ""
        many = f"{len(stretches)} stretches without gaps" if len(stretches) > 1 else "one stretch without gaps"
        lines.append(f"Take {many}: {', '.join(spans)}{more}.")
    names = [str(channel.get("name")) for channel in inspection.get("channels") or []]
    commands = [name for name in names if command_kind(name)]
    if vehicle is not None:
        wanted = listing([thruster.channel for thruster in vehicle.thrusters])
        how = "held until the next command" if recipe.get("commands", "hold") == "hold" else "interpolated"
        lines.append(f"Drive the model with {wanted}, {how}.")
    elif commands:
        lines.append(f"Commands in the log: {listing(commands)}. Whether they fit a vehicle, --vehicle V tells.")
    else:
        lines.append("No command of a thruster was recognised; without one, no vehicle can be judged. See --map.")
    lines.append("Search for missing effects at the log's own rate (at most 20 Hz), unfiltered.")
    low_pass = f", velocities low-passed at {_short(recipe['cutoff'])} Hz" if recipe.get("cutoff") else ""
    lines.append(f"Judge models at {_short(plan.get('rate'))} Hz{low_pass}.")
    shares = recipe.get("shares")
    if shares:
        seconds = sum(high - low for low, high in stretches)
        lines.append(
            f"Fit on the first {percent(1.0 - shares[-1])} of the time and judge on the last {percent(shares[-1])} "
            f"({number(shares[-1] * seconds, 2)} s), which no fit sees."
        )
    return lines


def _notes(inspection: Mapping[str, Any], plan: Mapping[str, Any]) -> list[tuple[list[str], str]]:
    """Defects, then what was guessed and converted, then what was left out; each with its style."""
    unused = [str(name) for name in inspection.get("unused") or []]
    most = len(unused) if plan.get("missing") else _MOST_UNUSED
    left_out = [f"Not used: {_by_topic(unused[:most])}"] if unused else []
    if len(unused) > most:
        left_out[0] += f"; and {len(unused) - most} more (--json has them all)"
    return [
        ([_sentence(str(note)) for note in plan.get("notes") or []], WARNING),
        ([str(note) for note in inspection.get("notes") or []], ""),
        (left_out, "dim"),
    ]


def _by_topic(names: Sequence[str]) -> str:
    """Streams `topic:field` with each topic said once; bare columns as they are."""
    topics: dict[str, list[str]] = {}
    for name in names:
        topic, colon, field = name.rpartition(":")
        topics.setdefault(topic if colon else "", []).append(field)
    return "; ".join(
        f"{', '.join(fields)} of {topic}" if topic else ", ".join(fields) for topic, fields in topics.items()
    )


def _excitation(excitation: Mapping[str, Any], told: bool) -> list[tuple[list[str], str]]:
    """Facts, and what they do not show unless the checks have `told` it."""
    ranges = [
        f"{name} {number(excitation[key][0], 2)} to {number(excitation[key][1], 2)} {unit}"
        for key, name, unit in (("u", "surge", "m/s"), ("v", "sway", "m/s"), ("r", "yaw rate", "rad/s"))
        if key in excitation
    ]
    shares = [
        f"{words} {percent(excitation[key])}"
        for key, words in (
            ("astern", "astern"),
            ("turning_to_starboard", "turning to starboard"),
            ("turning_to_port", "turning to port"),
        )
        if key in excitation
    ]
    facts = [f"Speeds: {', '.join(ranges)}."] if ranges else []
    facts += [f"Share of the time: {', '.join(shares)}."] if shares else []
    unseen = [] if told else [str(text) for text in excitation.get("sentences") or []]
    return [(facts, ""), (unseen, WARNING)]


def _channels(channels: Sequence[Mapping[str, Any]]) -> RenderableType:
    """The channels in one table; at a narrow width without noise, then without unit, rate and gaps."""
    has_gaps = any(channel.get("gaps") for channel in channels)
    gaps = ("gaps", "longest") if has_gaps else ()
    every = (
        ("unit", "rows", "rate", *gaps, "range", "noise"),
        ("unit", "rows", "rate", *gaps, "range"),
        ("rows", *gaps, "range"),
        ("range",),
    )
    without_gaps = "" if has_gaps else "no gaps"
    return Fitting([_channel_table(channels, columns, without_gaps) for columns in every])


def _channel_table(channels: Sequence[Mapping[str, Any]], columns: Sequence[str], caption: str) -> Table:
    heads = {"rate": "rate\nHz", "longest": "longest\ngap s"}
    table = plain_table("Channels", caption)
    table.add_column("channel", overflow="fold")
    for column in columns:
        table.add_column(heads.get(column, column), justify="left" if column == "unit" else "right", no_wrap=True)
    for channel in channels:
        cells = {
            "unit": unit_text(str(channel.get("unit", ""))),
            "rows": number(channel.get("count"), blank=""),
            "rate": number(channel.get("rate"), blank=""),
            "gaps": number(channel.get("gaps"), blank=""),
            "longest": number(channel.get("longest_gap"), blank=""),
            "range": _range(channel.get("minimum"), channel.get("maximum")),
            "noise": number(channel.get("noise"), 2, blank=""),
        }
        table.add_row(Text(str(channel.get("name"))), *(Text(cells[column]) for column in columns))
    return table


def _range(low: Any, high: Any) -> str:
    return "" if low is None or high is None else f"{number(low)} to {number(high)}"


def _tenths(seconds: float) -> str:
    """A time [s] to a tenth; a stamp of ten digits keeps them.

    Examples
    --------
    >>> _tenths(0.05), _tenths(239.95), _tenths(1.7e9)
    ('0.1', '239.9', '1700000000')
    """
    return f"{seconds:.1f}".removesuffix(".0")


def _short(value: Any) -> str:
    """A setting as a person would write it.

    Examples
    --------
    >>> _short(10.0), _short(1.2)
    ('10', '1.2')
    """
    return f"{finite(value):g}"


def _sentence(text: str) -> str:
    """The text with a capital letter, but not where it opens with the name of a channel.

    Examples
    --------
    >>> _sentence("the yaw rate r is late."), _sentence("u: 3 gaps")
    ('The yaw rate r is late.', 'u: 3 gaps')
    """
    return text if ":" in text.split(" ")[0] else text[:1].upper() + text[1:]
