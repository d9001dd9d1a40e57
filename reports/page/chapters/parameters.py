"""Equations and numbers, and where they come from: corrected model, parameters, energy, log, how the page was made."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ....discovery.findings import Calibrated
from ....exports import elements as mathml
from ....exports.known_facts import UNITS, letters
from ....measurements.inspection import Inspection
from ....physics.effects import EFFECTS, PARAMETERS
from ....physics.errors import VehicleError
from ....physics.momentum_balance import Balance, BalanceTerm, balances, factor_symbols, values_of
from ....physics.presentation import MINUS, listing, number, unit_text, words
from ....physics.vehicle import SHARED_THRUSTER_KEYS, Vehicle
from ...run_contents import RunFolder
from ...sureness import known_intervals, vehicle_value
from ...wording import absorbed_sentence, energy_lines, energy_verdict, interval, trimmed
from ..markup import Html, bullets, card, details, element, listed, paragraphs, render, table
from .base import Chapter, Section

Intervals = Mapping[str, tuple[float, float]]


def equations(run: RunFolder) -> Section:
    """The momentum balance of the corrected vehicle, axis by axis, then what acts on thrust, water and memory."""
    known = known_intervals(run.findings, run.nominal)
    ends = {symbol: (low, high) for symbol, (low, high) in known.items() if low < high}
    cards = [_axis(line, run, ends) for line in balances(run.corrected)]
    changed = [symbol for symbol, value in run.corrected.values.items() if _moved(run, symbol, value)]
    removed = [
        symbol
        for symbol in changed
        if symbol in PARAMETERS and run.corrected.value(symbol) == PARAMETERS[symbol].null != run.nominal.value(symbol)
    ]
    notes = [
        "Blue terms are new or changed." if changed else "The corrected model has the numbers of the nominal one.",
        "Below a term stand symbol and unit of its coefficient and, where it was fitted, the 95 % interval.",
        letters(run.corrected),
    ]
    if removed:
        notes.append(f"No longer there: {listing(removed)}.")
    body = element("div.card balances", *cards, *_beside(run, ends), *paragraphs(notes))
    return Section("The corrected model in equations", body)


def _axis(line: Balance, run: RunFolder, ends: Intervals) -> Html:
    title = f"{line.axis.capitalize()} [{UNITS[line.axis]}]"
    sides = (line.inertia, line.force)
    inertia, force = ([_term(term, k == 0, run, ends) for k, term in enumerate(side)] for side in sides)
    equals, nothing = (element("span.term", mathml.formula(one)) for one in (mathml.sign("="), mathml.number("0")))
    parts = [*inertia, equals, *(force or [nothing])]
    return render(element("h3", title), element("div.balance", *parts, role="math", aria_label=spoken(line)))


def spoken(line: Balance) -> str:
    """The balance of one axis as text, for those who hear the page."""
    return f"{_plain_side(line.inertia)} = {_plain_side(line.force) or '0'}"


def _plain_side(terms: tuple[BalanceTerm, ...]) -> str:
    texts = []
    for k, term in enumerate(terms):
        amount = " ".join([trimmed(abs(term.coefficient)), *(name.replace("T:", "T_") for name in term.factors)])
        minus = term.coefficient < 0
        texts.append((f"{MINUS} " if minus else "+ ") + amount if k else MINUS * minus + amount)
    return " ".join(texts)


def _term(term: BalanceTerm, first: bool, run: RunFolder, ends: Intervals) -> Html:
    """A summand over the name of its coefficient and the interval of that."""
    parts = [] if first else [mathml.sign(MINUS if term.coefficient < 0 else "+")]
    amount = term.coefficient if first else abs(term.coefficient)
    if amount != 1.0 or not term.factors:
        parts.append(mathml.number(trimmed(amount)))
    parts.append(mathml.product(term.factors))
    within = [symbol for name in term.factors for symbol in _of_thruster(name)]
    moved = any(_moved(run, name, vehicle_value(run.corrected, name)) for name in (*term.symbols, *within))
    below = []
    if len(term.symbols) == 1:
        name = term.symbols[0]
        label = [mathml.formula(mathml.symbol(name))] if ":" not in name else ["no name"]
        below.append(element("small", *label, f" [{unit_text(run.corrected.parameter(name).unit)}]"))
        below += [element("small", interval(list(ends[name])))] if name in ends else []
    elif moved and term.symbols:
        named = [name for name in term.symbols if _moved(run, name, vehicle_value(run.corrected, name))]
        below.append(element("small", *[mathml.formula(mathml.symbol(name)) for name in named]))
    return element("span", mathml.formula(*parts), *below, cls="term new" if moved else "term")


def _of_thruster(factor: str) -> tuple[str, ...]:
    """The parameters that act on the force of a thruster; none for any other factor."""
    return (f"{factor[2:]}_scale", *SHARED_THRUSTER_KEYS) if factor.startswith("T:") else ()


def _beside(run: RunFolder, ends: Intervals) -> list[Html]:
    """What acts within a factor: gains and lags of the thrusters, the current, the time of the memory."""
    rows = []
    for name in factor_symbols(run.corrected):
        after, before = (_amount(vehicle, name) for vehicle in (run.corrected, run.nominal))
        parameter = run.corrected.parameter(name)
        law = next((effect.equation for effect in EFFECTS if parameter in effect.parameters), "")
        was = "" if before == after else f"was {before}"
        amount = element("b" if was else "span", f"{after} {unit_text(parameter.unit)}".rstrip())
        span = interval(list(ends[name])) if name in ends else ""
        rows.append((element("code", name), amount, span, was, element("code", law)))
    if not rows:
        return []
    head = ("within the terms", "value", "95 % interval", "", "what it does")
    return [element("h3", "Thrust, water and memory"), element("div.wordy", table(head, rows, "lrrll"))]


def _amount(vehicle: Vehicle, symbol: str) -> str:
    """The value of a parameter, or of each thruster that has its own."""
    if symbol not in vehicle.values:
        return trimmed(vehicle_value(vehicle, symbol))
    own = [trimmed(value) for value in values_of(vehicle, symbol)]
    if len(own) == 1:
        return own[0]
    return ", ".join(f"{value} ({t.name})" for value, t in zip(own, vehicle.thrusters, strict=True))


def _moved(run: RunFolder, symbol: str, after: float) -> bool:
    before = vehicle_value(run.nominal, symbol)
    return abs(after - before) > 1e-9 * max(abs(after), abs(before))


EQUATIONS = Chapter(80, equations, folded=True)


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
    inner = [element("p", "The corrected vehicle has the same parameters as the nominal one.")]
    if changed:
        inner = [table(("symbol", "nominal", "corrected", "unit", "change"), changed, "lrrl")]
    if same:
        kept = table(("symbol", "value", "unit"), same, "lrl")
        inner.append(details(f"{len(same)} parameters kept as they were", kept))
    return Section("Corrected parameters", card(*inner))


def calibrated(run: RunFolder) -> Section | None:
    """The parameters that were calibrated while effects were judged, those that were not, and why."""
    found = run.findings
    if not found.calibrated:
        return None
    columns: dict[str, Callable[[Calibrated], str]] = {
        "symbol": lambda item: item.symbol,
        "nominal": lambda item: trimmed(item.before),
        "calibrated": lambda item: element("b", trimmed(item.after)),
        "95 % interval": lambda i: "at its limit" if i.at_limit else interval(i.ci95) + " *" * i.held_by_law,
        "unit": lambda item: unit_text(item.unit),
    }
    if not any(item.at_limit or item.ci95 is not None for item in found.calibrated):
        del columns["95 % interval"]
    notes = [f"{item.symbol} stays as it was: {item.why}." for item in found.left]
    notes += filter(None, [absorbed_sentence(found.absorbed)])
    if any(item.held_by_law for item in found.calibrated):
        notes.append("* Held by the law of dissipation; the interval is what the log alone asks for.")
    text = (
        "These parameters were free in every model, so that a number that is merely wrong is not taken for an effect "
        "that is missing."
    )
    inner = [element("p.facts", text), listed(found.calibrated, columns, "lrrll"[: len(columns)]), *bullets(notes)]
    return Section("Calibrated parameters", card(*inner))


def energy(run: RunFolder) -> Section | None:
    """How the law of dissipation stands in the corrected model: verdict, price, binding corner, proof."""
    passivity = run.findings.passivity
    if passivity is None:
        return None
    told = [element("p", text) for text in energy_lines(passivity)]
    return Section(f"Energy: {energy_verdict(passivity)}", card(*told))


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
    inner += [_quality(run.inspections)] * bool(run.inspections)
    inner += [details(f"inspection of {one.path}", *_tree(one)) for one in run.inspections]
    return Section("The log", card(*inner))


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
        if isinstance(value, list | tuple) and value and all(isinstance(item, Mapping) for item in value):
            head = list(dict.fromkeys(str(key) for item in value for key in item))
            body = [[plain(item.get(key, "")) for key in head] for item in value]
            wordy = [any(isinstance(item.get(key), str | Mapping | list) for item in value) for key in head]
            align = "".join("l" if words_in else "r" for words_in in wordy)
            tables.append(table([words(key) for key in head], body, align, caption=words(str(name))))
        elif name != "schema":
            facts.append((words(str(name)), plain(value)))
    return [*[table(("", ""), facts, "ll")] * bool(facts), *tables]


STORY = (
    "The measured force is compared with the force of the nominal model. Every effect of the catalogue competes to "
    "explain the difference, effects are selected together, and each must lower the error on data it was not fitted "
    "to. This page is made only from the files below."
)


def made(run: RunFolder) -> Section:
    """What was demanded of an effect, how to make the run again, and the files with their digests."""
    demands = [f"{words(name)}: {plain(value)}" for name, value in run.findings.criterion.to_dict().items() if value]
    record = run.record
    every = {
        "made again, in the run folder, by": element("code", record.command) if record.command else "",
        "seed": "" if record.seed is None else plain(record.seed),
        "versions": ", ".join(f"{name} {number}" for name, number in record.versions.items()),
    }
    facts = [(name, fact) for name, fact in every.items() if fact]

    def codes(pairs: Iterable[tuple[str, str]]) -> list[tuple[Html, Html]]:
        return [(element("code", name), element("code", digest)) for name, digest in pairs]

    logs = codes((item.path, item.sha256 or "not there any more") for item in record.log_sha256)
    files = codes(sorted(run.digests.items()))
    parts = [element("p", STORY)]
    parts += [table(("", ""), facts, "ll")] * bool(facts)
    parts += [table(("log", "SHA-256"), logs, "ll")] * bool(logs)
    if demands:
        parts += [element("p", element("b", "Demanded of an effect")), *bullets(demands)]
    parts.append(details("files and the start of their SHA-256", table(("file", "digest"), files, "ll")))
    return Section("How this was made", element("footer.card", *parts))


PARAMETER_TABLE = Chapter(90, parameter_table, folded=True)
CALIBRATED = Chapter(100, calibrated, folded=True)
ENERGY = Chapter(110, energy, folded=True)
DATA = Chapter(140, data, folded=True)
MADE = Chapter(150, made, folded=True)
