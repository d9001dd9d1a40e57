"""The corrected model in formulas: the momentum balance of each axis with its numbers, what is new in it marked."""

from collections.abc import Mapping

from ....exports import elements as mathml
from ....exports.known_facts import UNITS, letters
from ....physics.effects import EFFECTS, PARAMETERS
from ....physics.momentum_balance import Balance, BalanceTerm, balances, factor_symbols, values_of
from ....physics.presentation import MINUS, listing, unit_text
from ....physics.vehicle import SHARED_THRUSTER_KEYS, Vehicle
from ...run_contents import RunFolder
from ...sureness import coefficient_rows, vehicle_value
from ...wording import interval, trimmed
from ..markup import Html, element, paragraphs, render, table
from .base import Chapter, Section

Intervals = Mapping[str, tuple[float, float]]


def equations(run: RunFolder) -> Section:
    """The momentum balance of the corrected vehicle, axis by axis, then what acts on thrust, water and memory."""
    ends = intervals_of(run)
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
    beside = _beside(run, ends)
    return Section(
        "The corrected model in equations",
        element("div", *cards, *beside, *paragraphs(notes), cls="card balances"),
    )


def intervals_of(run: RunFolder) -> dict[str, tuple[float, float]]:
    """The 95 % interval of the value in the corrected vehicle, by symbol, for every number that was fitted."""
    findings = run.findings
    rows = coefficient_rows(findings.candidates, [c.effect for c in findings.added], run.nominal, run.corrected)
    result = {row.symbol: row.interval for row in rows if row.interval[0] < row.interval[1]}
    told = [(item.symbol, item.ci95) for item in findings.calibrated]
    told += [(term.symbol or f"{term.axis}:{term.form}", term.ci95) for term in findings.unnamed]
    for name, ends in told:
        if ends is not None and ends.lower < ends.upper:
            result.setdefault(name, (ends.lower, ends.upper))
    return result


def _axis(line: Balance, run: RunFolder, ends: Intervals) -> Html:
    words = f"{line.axis.capitalize()} [{UNITS[line.axis]}]"
    inertia, force = (
        [_term(term, k == 0, run, ends) for k, term in enumerate(side)] for side in (line.inertia, line.force)
    )
    equals, nothing = (
        element("span", mathml.formula(one), cls="term") for one in (mathml.sign("="), mathml.number("0"))
    )
    parts = [*inertia, equals, *(force or [nothing])]
    return render(
        element("h3", words),
        element("div", *parts, cls="balance", attributes={"role": "math", "aria-label": plain(line)}),
    )


def plain(line: Balance) -> str:
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
    return [element("h3", "Thrust, water and memory"), element("div", table(head, rows, "lrrll"), cls="wordy")]


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
