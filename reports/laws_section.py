"""The section of the page on the laws of a hull: what the auditor says of the corrected model."""

from collections.abc import Mapping
from typing import Any

from .markup import Html, element, render, table
from .run_folder import RunFolder
from .wording import listing, number, unit_text


def laws(run: RunFolder) -> Html:
    """A table of the laws with margin, proof and sentence, what is broken on top; nothing without an audit."""
    audit = run.audit
    if not audit:
        return Html("")
    told = sorted(audit["laws"], key=lambda law: law.get("verdict") != "fail")
    rows = [
        (str(law["law"]), element("b", _verdict(law)), _margin(law), _proof(law), str(law.get("sentence") or ""))
        for law in told
    ]
    box: Mapping[str, Any] = audit.get("envelope") or {}
    units: Mapping[str, Any] = audit.get("units") or {}
    ends = [
        f"{name} from {number(low)} to {number(high)} {unit_text(str(units.get(name) or ''))}"
        for name, (low, high) in box.items()
    ]
    where = f"Asked for {listing(ends)}: {audit.get('envelope_from', 'the envelope')}. "
    notes = [*(audit.get("notes") or [])]
    if any(_verdict(law) == "noted" for law in told):
        notes.append("Noted: broken, but a real boat may, so the audit does not fail by it.")
    how = "Margins are distances from breaking a law. What is searched is not proved."
    parts = [
        element("p", where + how, cls="facts"),
        table(("law", "verdict", "margin", "how it is known", "in words"), rows, "llrll"),
        *(element("p", str(note)) for note in notes),
    ]
    return render(element("h2", f"Laws of a hull: {audit['verdict']}"), element("div", *parts, cls="card"))


def _verdict(law: Mapping[str, Any]) -> str:
    if law.get("verdict") == "fail" and not law.get("counts", True):
        return "noted"
    return str(law.get("verdict"))


def _margin(law: Mapping[str, Any]) -> str:
    margin = law.get("margin") or {}
    if margin.get("value") is None:
        return ""
    return f"{number(margin['value'], 2)} {unit_text(str(margin.get('unit') or ''))}".rstrip()


def _proof(law: Mapping[str, Any]) -> str:
    proof = str(law.get("proof") or "")
    return "" if proof == "none" else proof
