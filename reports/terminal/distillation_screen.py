"""Distillation of a model on the rows that it was prepared for, and the same as tables for the terminal."""

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ...discovery.distillation.distilled import Distilled
from ...physics.in_words import number, percent, unit_text, words
from .layout import Prose, bullets, plain_table, section, stacked


def distilled_table(found: Distilled) -> RenderableType:
    """The headline, the share explained by axis, the effects with their values, and what remains in words."""
    parts: list[RenderableType] = [Prose(found.headline, "bold")]
    if any(axis.matters for axis in found.axes):
        parts.append(_shares(found))
    if found.effects or found.unnamed:
        parts.append(_effects(found))
    parts.append(section("What remains", bullets([axis.sentence for axis in found.axes])))
    return stacked(parts)


def _shares(found: Distilled) -> Table:
    traded = "; all axes are fitted at once, and an effect may explain less of one for more of another"
    more = traded if any(axis.traded for axis in found.axes) else ""
    table = plain_table("Share of the correction explained", f"along {found.seconds:.0f} s of motion{more}")
    table.add_column("axis", no_wrap=True)
    headings = ("correction", "named", "with\npossible", "with\nunnamed", "of the rest:\nmemory")
    for text in headings:
        table.add_column(text, justify="right", no_wrap=True)
    for axis in found.axes:
        shares = (axis.named, axis.possible, axis.explained, axis.past and axis.past.memory)
        size = f"{number(axis.correction, 2)} {axis.unit}"
        table.add_row(axis.axis, size, *(_explained(share) for share in shares))
    return table


def _explained(share: float | None) -> str:
    return "none" if share is not None and share < 0.0 else percent(share, blank="-")


def _effects(found: Distilled) -> Table:
    table = plain_table("What it holds")
    table.add_column("effect", overflow="fold")
    for text in ("verdict", "value", "95 % interval"):
        table.add_column(text, no_wrap=True)
    rows = [(words(part.effect), part.verdict, part.terms) for part in found.effects]
    rows += [(term.symbol, "unnamed", (term,)) for term in found.unnamed]
    for name, verdict, terms in rows:
        for k, term in enumerate(terms):
            ends = f"{number(term.ci95.lower)} to {number(term.ci95.upper)}" if term.ci95 else ""
            value = f"{term.symbol} {number(term.value)} {unit_text(term.unit)}".rstrip()
            if verdict == "unnamed":
                value = f"{number(term.value)} {unit_text(term.unit)}".rstrip()
            table.add_row(*map(Text, (name if k == 0 else "", verdict if k == 0 else "", value, ends)))
    return table
