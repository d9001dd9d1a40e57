"""What `ci` shows on the terminal: whether the limits hold, then each beside what was measured."""

from rich.console import RenderableType
from rich.text import Text

from ...comparison.held_limits import HeldLimit, HeldLimits
from ...physics.in_words import listing, number, percent, unit_text
from .layout import BAD, GOOD, plain_table

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
    table = plain_table("")
    for name in ("error", "axis"):
        table.add_column(name, overflow="fold")
    for name in ("measured", "limit", "of it"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    table.add_column("holds", no_wrap=True)
    told = any(one.told for one in found.limits)
    if told:
        table.add_column("", overflow="fold")
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
