"""The laws of a hull: what the auditor says of every model, and the state in which each broken law is broken."""

from collections.abc import Mapping, Sequence

from ....comparison.facts import Amount, AuditRecord, RulingRecord
from ....physics.presentation import listing, number, unit_text
from ...run_contents import RunFolder
from ...wording import typeset
from ..markup import Html, element, render, table
from ..rivals import laws_of
from .base import Chapter, Section

SIGNS = {"pass": "\N{BULLET} pass", "fail": "\N{MULTIPLICATION SIGN} fail", "noted": "\N{WHITE CIRCLE} noted"}
STATE_UNITS = {"u": "m/s", "v": "m/s", "r": "rad/s", "psi": "rad", "from": "s", "to": "s"}


def laws(run: RunFolder) -> Section | None:
    """What is broken by any model with its counterexample, then all laws of each; nothing without an audit."""
    audit = run.audit
    judged = {model.name: laws_of(model, audit) for model in run.comparison.models}
    if audit is not None and not judged.get("corrected"):
        judged["corrected"] = audit.laws
    judged = {name: told for name, told in judged.items() if told}
    if not judged:
        return None
    units = {**STATE_UNITS, **({} if audit is None else audit.units)}
    broken = [
        (name, law.law, _amount(law.worst), _words(law, units))
        for name, told in judged.items()
        for law in _ordered(told)
        if law.outcome == "fail"
    ]
    parts: list[Html] = []
    if broken:
        head = ("model", "broken law", "worst value", "in words, and the state in which it was found")
        parts += [element("h3", "Counterexamples"), element("div", table(head, broken, "llrl"), cls="wordy")]
    else:
        parts.append(element("p", f"{_listed(judged)}: no law that counts is broken."))
    for name, told in judged.items():
        opened = {"open": "open"} if name == "corrected" else {}
        summary = element("summary", f"all laws, {name} model")
        parts.append(element("details", summary, _table(told, units), attributes=opened))
    notes = [] if audit is None else [_asked(audit)]
    notes.append("Margins are distances from breaking a law. What is searched is not proved.")
    if any(law.outcome == "noted" for told in judged.values() for law in told):
        notes.append("Noted: broken, but a real boat may, so the audit does not fail by it.")
    notes += [] if audit is None else audit.notes
    parts += [element("p", note, cls="facts") for note in notes]
    own = [law.outcome for law in judged.get("corrected") or []]
    verdict = (audit.verdict if audit else "") or ("fail" if "fail" in own else "pass" if own else "")
    title = {"pass": ": the corrected model keeps them", "fail": ": the corrected model breaks one"}.get(verdict, "")
    return Section(f"Laws of a hull{title}", element("div", *parts, cls="card"))


def _table(told: Sequence[RulingRecord], units: Mapping[str, str]) -> Html:
    rows = [
        (
            law.law,
            element("b", SIGNS.get(law.outcome, law.outcome), cls=law.outcome),
            _amount(law.margin),
            _amount(law.worst),
            "" if law.proof in (None, "none") else law.proof,
            _words(law, units),
        )
        for law in _ordered(told)
    ]
    head = (
        "law",
        "verdict",
        "margin",
        "worst value",
        "how it is known",
        "in words, and where it is nearest to breaking",
    )
    return element("div", table(head, rows, "llrrll"), cls="wordy")


def _ordered(told: Sequence[RulingRecord]) -> list[RulingRecord]:
    rank = {"fail": 0, "noted": 1}
    return sorted(told, key=lambda law: rank.get(law.outcome, 2))


def _amount(found: Amount | None) -> str:
    """A number with its unit; nothing where there is none."""
    if found is None or found.value is None:
        return ""
    return f"{typeset(found.value, 2)} {unit_text(found.unit)}".rstrip()


def _words(law: RulingRecord, units: Mapping[str, str]) -> Html:
    """The sentence, and under it the state of the worst value."""
    state = [
        f"{name} {typeset(amount, 2)} {unit_text(units.get(name, ''))}".strip()
        for name, amount in ({} if law.worst is None else law.worst.at).items()
    ]
    return render(law.sentence, *[element("small", f"at {', '.join(state)}")] * bool(state))


def _asked(audit: AuditRecord) -> str:
    ends = [
        f"{name} from {number(low)} to {number(high)} {unit_text(audit.units.get(name, ''))}"
        for name, (low, high) in audit.envelope.items()
    ]
    return f"Asked for {listing(ends)}: {audit.envelope_from}."


def _listed(judged: Mapping[str, object]) -> str:
    return listing(list(judged))


LAWS = Chapter(120, laws, folded=True)
