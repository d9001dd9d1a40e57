"""The laws of a hull: what the auditor says of every model, and the state in which each broken law is broken."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..markup import Html, element, render, table
from ..rivals import laws_of, verdict_of
from ..run_folder import RunFolder
from ..wording import listing, number, typeset, unit_text

SIGNS = {"pass": "\N{BULLET} pass", "fail": "\N{MULTIPLICATION SIGN} fail", "noted": "\N{WHITE CIRCLE} noted"}
STATE_UNITS = {"u": "m/s", "v": "m/s", "r": "rad/s", "psi": "rad", "from": "s", "to": "s"}
Law = Mapping[str, Any]


def laws(run: RunFolder) -> Html:
    """What is broken by any model with its counterexample, then all laws of each; nothing without an audit."""
    audits = {"corrected": run.audit} if run.audit else {}
    judged = {str(model["name"]): laws_of(model, audits) for model in run.comparison["models"]}
    if run.audit and not judged.get("corrected"):
        judged["corrected"] = run.audit["laws"]
    judged = {name: told for name, told in judged.items() if told}
    if not judged:
        return Html("")
    units: Mapping[str, Any] = {**STATE_UNITS, **(run.audit.get("units") or {})}
    broken = [
        (name, str(law["law"]), _worst(law), _words(law, units))
        for name, told in judged.items()
        for law in _ordered(told)
        if verdict_of(law) == "fail"
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
    notes = [_asked(run.audit)] if run.audit else []
    notes.append("Margins are distances from breaking a law. What is searched is not proved.")
    if any(verdict_of(law) == "noted" for told in judged.values() for law in told):
        notes.append("Noted: broken, but a real boat may, so the audit does not fail by it.")
    notes += [str(note) for note in run.audit.get("notes") or []]
    parts += [element("p", note, cls="facts") for note in notes]
    own = [verdict_of(law) for law in judged.get("corrected") or []]
    verdict = run.audit.get("verdict") or ("fail" if "fail" in own else "pass" if own else "")
    title = {"pass": ": the corrected model keeps them", "fail": ": the corrected model breaks one"}.get(verdict, "")
    return render(element("h2", f"Laws of a hull{title}"), element("div", *parts, cls="card"))


def _table(told: Sequence[Law], units: Mapping[str, Any]) -> Html:
    rows = [
        (
            str(law["law"]),
            element("b", SIGNS.get(verdict_of(law), verdict_of(law)), cls=verdict_of(law)),
            _margin(law),
            _worst(law),
            _proof(law),
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


def _ordered(told: Sequence[Law]) -> list[Law]:
    rank = {"fail": 0, "noted": 1}
    return sorted(told, key=lambda law: rank.get(verdict_of(law), 2))


def _worst(law: Law) -> str:
    worst = law.get("worst") or {}
    return f"{typeset(worst.get('value'), 2, blank='')} {unit_text(str(worst.get('unit') or ''))}".strip()


def _words(law: Law, units: Mapping[str, Any]) -> Html:
    """The sentence, and under it the state of the worst value."""
    state = [
        f"{name} {typeset(amount, 2)} {unit_text(str(units.get(name) or ''))}".strip()
        for name, amount in ((law.get("worst") or {}).get("at") or {}).items()
    ]
    sentence = str(law.get("sentence") or "")
    return render(sentence, *[element("small", f"at {', '.join(state)}")] * bool(state))


def _margin(law: Law) -> str:
    margin = law.get("margin") or {}
    if margin.get("value") is None:
        return ""
    return f"{typeset(margin['value'], 2)} {unit_text(str(margin.get('unit') or ''))}".rstrip()


def _proof(law: Law) -> str:
    proof = str(law.get("proof") or "")
    return "" if proof == "none" else proof


def _asked(audit: Mapping[str, Any]) -> str:
    box: Mapping[str, Any] = audit.get("envelope") or {}
    units: Mapping[str, Any] = audit.get("units") or {}
    ends = [
        f"{name} from {number(low)} to {number(high)} {unit_text(str(units.get(name) or ''))}"
        for name, (low, high) in box.items()
    ]
    return f"Asked for {listing(ends)}: {audit.get('envelope_from', 'the envelope')}."


def _listed(judged: Mapping[str, Any]) -> str:
    return listing(list(judged))
