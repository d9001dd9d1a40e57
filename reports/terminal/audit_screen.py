"""What `check` shows on the terminal: the laws as a table, and what they say in plain words."""

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ...comparison.audit import Audit
from ...physics.in_words import listing, number, percent, unit_text
from ...physics.laws.audit.base import Ruling
from .layout import ASIDE, BAD, GOOD, UNSURE, Fitting, Prose, bullets, plain_table, section

_STYLES = {"pass": GOOD, "fail": BAD, "noted": UNSURE, "n/a": ASIDE}
_SHORT = {"share of full thrust": "full thrust", "of the rigid body's": "rigid body", "times the expected": "expected"}
_UNITS = {"u": "m/s", "v": "m/s", "r": "rad/s", "psi": "rad", "from": "s", "to": "s"}


def audit_screen(audit: Audit) -> list[RenderableType]:
    """The table of laws, and the sentences: first what is broken, then the rest."""
    return [Fitting([_table(audit, full) for full in (True, False)]), *_words(audit)]


def headline(audit: Audit) -> str:
    """The verdict in one or two sentences."""
    box = audit.envelope.to_dict()
    ends = [f"{name} from {number(box[name][0])} to {number(box[name][1])} {_UNITS[name]}" for name in "uvr"]
    where = f"Judged for {listing(ends)}, from {audit.envelope_from}."
    if audit.verdict == "pass":
        return f"{audit.model} breaks no law. {where}"
    return f"{audit.model} breaks {listing([_name(r) for r in audit.violations])}. {where}"


def _name(ruling: Ruling) -> str:
    return f"the law '{ruling.law}'"


def _verdict(ruling: Ruling) -> str:
    if ruling.verdict == "not applicable":
        return "n/a"
    return "noted" if ruling.verdict == "fail" and not ruling.counts else ruling.verdict


def _table(audit: Audit, full: bool) -> Table:
    loose = any(_verdict(r) == "noted" for r in audit.rulings)
    caption = "margin: what is let pass less the worst found" + "; noted: broken, but does not count" * loose
    table = plain_table(f"Laws: {audit.verdict}", caption)
    table.add_column("law", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("margin", no_wrap=True, justify="right")
    if full:
        table.add_column("worst case", no_wrap=True)
    table.add_column("proof", no_wrap=True)
    for ruling in audit.rulings:
        verdict = _verdict(ruling)
        cells = [ruling.law, Text(verdict, style=_STYLES[verdict]), _margin(ruling)]
        cells += [_place(ruling)] if full else []
        table.add_row(*cells, "" if ruling.proof == "none" else ruling.proof)
    return table


def _margin(ruling: Ruling) -> str:
    if ruling.margin is None:
        return ""
    if ruling.margin < -1e100:
        return "unbounded"
    unit = _SHORT.get(ruling.unit, unit_text(ruling.unit))
    return f"{number(ruling.margin, 2)} {unit}".rstrip()


def _place(ruling: Ruling) -> str:
    found = dict(ruling.at or {})
    if "from" in found:
        return f"{found['from']:.1f} to {found['to']:.1f} s"
    return ", ".join(f"{name} {value:.2f}" for name, value in found.items() if name in _UNITS)


def _words(audit: Audit) -> list[RenderableType]:
    """Sentences of the laws that are broken, in bold, and of the rest."""
    broken = [r for r in audit.rulings if r.verdict == "fail"]
    told = []
    for r in broken:
        often = f" ({percent(r.share)} of what was tried)" if r.share and r.share > 0 else ""
        told.append(f"{r.law}: {r.sentence}{often}")
    others = [r.sentence for r in audit.rulings if r.verdict == "pass"]
    parts: list[RenderableType] = [section("What is broken", bullets(told))] if told else []
    if others:
        parts.append(section("What holds", bullets(others)))
    return [*parts, *(Prose(note) for note in audit.notes)]
