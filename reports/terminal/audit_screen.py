"""Screens of `check` and `ci`: the laws as a table, and limits beside what was measured."""

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ...comparison.audit import Audit
from ...comparison.error_limits import HeldLimit, HeldLimits
from ...physics.laws.audit.base import Ruling
from ...physics.presentation import listing, number, percent, unit_text
from ..wording import STATE_UNITS, range_words
from .layout import (
    ASIDE,
    BAD,
    GOOD,
    UNSURE,
    Fitting,
    Prose,
    bullets,
    number_columns,
    plain_table,
    section,
    text_columns,
    word_columns,
)

_STYLES = {"pass": GOOD, "fail": BAD, "noted": UNSURE, "n/a": ASIDE}
_SHORT = {"share of full thrust": "full thrust", "of the rigid body's": "rigid body", "times the expected": "expected"}


def audit_screen(audit: Audit) -> list[RenderableType]:
    """The table of laws, and the sentences: first what is broken, then the rest."""
    return [Fitting([_table(audit, full) for full in (True, False)]), *_words(audit)]


def headline(audit: Audit) -> str:
    """The verdict in one or two sentences."""
    box = audit.envelope.to_dict()
    where = f"Judged for {range_words({name: box[name] for name in 'uvr'})}, from {audit.envelope_from}."
    if audit.verdict == "pass":
        return f"{audit.model} breaks no law. {where}"
    broken = listing([f"the law '{ruling.law}'" for ruling in audit.violations])
    return f"{audit.model} breaks {broken}. {where}"


def _verdict(ruling: Ruling) -> str:
    if ruling.verdict == "not applicable":
        return "n/a"
    return "noted" if ruling.verdict == "fail" and not ruling.counts else ruling.verdict


def _table(audit: Audit, full: bool) -> Table:
    loose = any(_verdict(r) == "noted" for r in audit.rulings)
    caption = "margin: what is let pass less the worst found" + "; noted: broken, but does not count" * loose
    last = word_columns(*["worst case"] * full, "proof")
    columns = [*word_columns("law", "verdict"), *number_columns("margin"), *last]
    table = plain_table(f"Laws: {audit.verdict}", caption, columns)
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
    return ", ".join(f"{name} {value:.2f}" for name, value in found.items() if name in STATE_UNITS)


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


_MOST = 3
"""Broken limits that the first sentence names: the table has all."""


def verdict_text(found: HeldLimits) -> str:
    """Whether the model holds its limits, and which it breaks, the worst first."""
    count, broken = len(found.limits), sorted(found.broken, key=_share, reverse=True)
    if not broken:
        return f"{found.model} holds {'its limit' if count == 1 else f'all {count} limits'}."
    named = [_sentence(one) for one in broken[:_MOST]]
    more = [f"{len(broken) - _MOST} more"] if len(broken) > _MOST else []
    return f"{found.model} breaks {len(broken)} of {count} limits: {listing([*named, *more])}."


def limits_table(found: HeldLimits) -> RenderableType:
    """All limits, a line each."""
    told = any(one.told for one in found.limits)
    columns = [*text_columns("error", "axis"), *number_columns("measured", "limit", "of it")]
    columns += [*word_columns("unit", "holds"), *text_columns(*[""] * told)]
    table = plain_table("", columns=columns)
    for one in found.limits:
        holds = Text("yes", style=GOOD) if one.holds else Text("NO", style=BAD)
        share = percent(one.measured / one.limit) if one.limit > 0.0 else ""
        cells = [what(one), one.axis, number(one.measured), number(one.limit), share, unit_text(one.unit)]
        table.add_row(*cells, holds, *[one.told] * told)
    return table


def what(one: HeldLimit) -> str:
    """What is limited, in words."""
    if one.horizon is not None:
        return f"{one.horizon} s prediction"
    return "laws broken" if one.quantity == "laws" else one.quantity


def _share(one: HeldLimit) -> float:
    return one.measured / one.limit if one.limit > 0.0 else float("inf")


def _sentence(one: HeldLimit) -> str:
    if one.quantity == "laws":
        return f"the laws of a hull ({one.told})"
    unit = unit_text(one.unit)
    return f"{what(one)} of {one.axis}, {number(one.measured)} {unit} where {number(one.limit)} {unit} are allowed"
