"""The numbers and where they come from: corrected and calibrated parameters, energy, the log, how the page was made."""

from collections.abc import Mapping, Sequence
from typing import Any

from ....measurements.inspection import Inspection
from ....physics.errors import VehicleError
from ....physics.presentation import MINUS, number, unit_text, words
from ....physics.vehicle import Vehicle
from ...run_contents import RunFolder
from ...wording import absorbed_sentence, energy_lines, energy_verdict, interval, trimmed
from ..markup import Html, details, element, render, table
from .base import Chapter, Section


def parameter_table(run: RunFolder) -> Section:
    """The vehicle before and after: what changed on top, what stayed folded away."""
    before, after = run.nominal.values, run.corrected.values
    changed, same = [], []
    for symbol in dict.fromkeys((*before, *after)):
        old, new = (vehicle.get(symbol, 0.0) for vehicle in (before, after))
        unit = unit_text(_unit(run.corrected if symbol in after else run.nominal, symbol))
        if abs(new - old) > 1e-9 * max(abs(old), abs(new)):
            change = f"{100.0 * (new / old - 1.0):+.0f} %".replace("-", MINUS) if old else "new"
            changed.append((symbol, trimmed(old), element("b", trimmed(new)), unit, change))
        elif old:
            same.append((symbol, trimmed(old), unit))
    if changed:
        inner = [table(("symbol", "nominal", "corrected", "unit", "change"), changed, "lrrl")]
    else:
        inner = [element("p", "The corrected vehicle has the same parameters as the nominal one.")]
    if same:
        kept = table(("symbol", "value", "unit"), same, "lrl")
        inner.append(details(f"{len(same)} parameters kept as they were", kept))
    return Section("Corrected parameters", element("div", *inner, cls="card"))


def calibrated(run: RunFolder) -> Section | None:
    """The parameters that were calibrated while effects were judged, those that were not, and why."""
    found = run.findings
    rows = [
        (
            item.symbol,
            trimmed(item.before),
            element("b", trimmed(item.after)),
            "at its limit" if item.at_limit else interval(item.ci95) + " *" * item.held_by_law,
            unit_text(item.unit),
        )
        for item in found.calibrated
    ]
    if not rows:
        return None
    notes = [f"{item.symbol} stays as it was: {item.why}." for item in found.left]
    notes += filter(None, [absorbed_sentence(found.absorbed)])
    if any(item.held_by_law for item in found.calibrated):
        notes.append("* Held by the law of dissipation; the interval is what the log alone asks for.")
    text = (
        "These parameters were free in every model, so that a number that is merely wrong is not taken for an effect "
        "that is missing."
    )
    head = ("symbol", "nominal", "calibrated", "95 % interval", "unit")
    inner = [element("p", text, cls="facts"), table(head, rows, "lrrll"), *bullets(notes)]
    return Section("Calibrated parameters", element("div", *inner, cls="card"))


def energy(run: RunFolder) -> Section | None:
    """How the law of dissipation stands in the corrected model: verdict, price, binding corner, proof."""
    passivity = run.findings.passivity
    if passivity is None:
        return None
    return Section(
        f"Energy: {energy_verdict(passivity)}",
        element("div", *(element("p", text) for text in energy_lines(passivity)), cls="card"),
    )


def data(run: RunFolder) -> Section:
    """What the log is: rows, seconds, split, notes, and the quality of each log where it was inspected."""
    about = run.findings.data
    counts = run.series["part"].value_counts()
    shares = ", ".join(f"{part} {counts[part]}" for part in ("train", "validation", "test") if part in counts)
    facts = [
        ("logs", ", ".join(run.comparison.logs)),
        ("rows", number(len(run.series) if about.rows is None else about.rows, 6)),
        ("length", f"{number(about.seconds, 4)} s"),
        ("split", about.split),
        ("rows by part", shares),
        ("vehicle", run.nominal.name),
    ]
    rows = [(name, value) for name, value in facts if value]
    inner = [table(("the log", ""), rows, "ll"), *bullets(list(about.notes))]
    if run.inspections:
        inner.append(_quality(run.inspections))
    for inspection in run.inspections:
        inner.append(details(f"inspection of {inspection.path}", *_tree(inspection)))
    return Section("The log", element("div", *inner, cls="card"))


def _unit(vehicle: Vehicle, symbol: str) -> str:
    try:
        return vehicle.parameter(symbol).unit
    except VehicleError:
        return ""


def plain(value: Any) -> str:
    """Any plain data as text."""
    if isinstance(value, float | int) and not isinstance(value, bool):
        return trimmed(value)
    if isinstance(value, Mapping):
        return "; ".join(f"{words(str(name))} {plain(inner)}" for name, inner in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(plain, value))
    return "n/a" if value is None else str(value)


def bullets(texts: list[str]) -> list[Html]:
    """A list of sentences; nothing for none."""
    return [element("ul", *(element("li", text) for text in texts))] if texts else []


def _quality(inspections: Sequence[Inspection]) -> Html:
    """The quality of the measured motion, one row a log; of several channels or comparisons the worst counts."""
    noisy = {"u": "m/s", "v": "m/s", "r": "rad/s"}
    rows = []
    for log in inspections:
        channels = {channel.name: channel for channel in log.channels}
        motion = [channels[name] for name in ("x", "y", "psi", "u", "v", "r") if name in channels]
        facts = (
            log.excitation.seconds if log.excitation else None,
            min((channel.rate for channel in motion if channel.rate is not None), default=None),
            max((channel.longest_gap for channel in motion if channel.longest_gap is not None), default=None),
            max((abs(pair.offset) for pair in log.alignment if pair.offset is not None), default=None),
            *(channels[name].noise if name in channels else None for name in noisy),
        )
        gaps = max((channel.gaps for channel in motion), default=0)
        rows.append((log.path, str(len(log.plan.segments)), str(gaps), *(number(fact, blank="") for fact in facts)))
    noise = (f"noise of {name} {unit}" for name, unit in noisy.items())
    head = ("", "stretches", "gaps", "usable s", "rate Hz", "longest gap s", "out of step s", *noise)
    return table(head, rows, caption="quality of the measured motion")


def _tree(inspection: Inspection) -> list[Html]:
    """All of an inspection as tables: a list of records becomes one table, everything else a row of facts."""
    facts, tables = [], []
    for name, value in inspection.to_dict().items():
        records = (
            value
            if isinstance(value, list | tuple) and value and all(isinstance(item, Mapping) for item in value)
            else None
        )
        if records:
            head = list(dict.fromkeys(str(key) for item in records for key in item))
            body = [[plain(item.get(key, "")) for key in head] for item in records]
            align = "".join(
                "l" if any(isinstance(item.get(key), str | Mapping | list) for item in records) else "r" for key in head
            )
            tables.append(table([words(key) for key in head], body, align, caption=words(str(name))))
        elif name != "schema":
            facts.append((words(str(name)), plain(value)))
    return [*([table(("", ""), facts, "ll")] if facts else []), *tables]


STORY = (
    "The measured force is compared with the force of the nominal model. Every effect of the catalogue competes to "
    "explain the difference, effects are selected together, and each must lower the error on data it was not fitted "
    "to. This page is made only from the files below."
)


def made(run: RunFolder) -> Section:
    """What was demanded of an effect, how to make the run again, and the files with their digests."""
    demands = [f"{words(name)}: {plain(value)}" for name, value in run.findings.criterion.to_dict().items() if value]
    record = run.record
    facts: list[tuple[str, Html]] = []
    if record.command:
        facts.append(("made again, in the run folder, by", element("code", record.command)))
    if record.seed is not None:
        facts.append(("seed", render(plain(record.seed))))
    if record.versions:
        facts.append(("versions", render(", ".join(f"{name} {number}" for name, number in record.versions.items()))))
    logs = [
        (element("code", item.path), element("code", item.sha256 or "not there any more")) for item in record.log_sha256
    ]
    files = [(element("code", name), element("code", digest)) for name, digest in sorted(run.digests.items())]
    parts = [element("p", STORY)]
    parts += [table(("", ""), facts, "ll")] * bool(facts)
    parts += [table(("log", "SHA-256"), logs, "ll")] * bool(logs)
    if demands:
        parts += [element("p", element("b", "Demanded of an effect")), *bullets(demands)]
    parts.append(details("files and the start of their SHA-256", table(("file", "digest"), files, "ll")))
    return Section("How this was made", element("footer", *parts, cls="card"))


PARAMETER_TABLE = Chapter(90, parameter_table, folded=True)
CALIBRATED = Chapter(100, calibrated, folded=True)
ENERGY = Chapter(110, energy, folded=True)
DATA = Chapter(140, data, folded=True)
MADE = Chapter(150, made, folded=True)
