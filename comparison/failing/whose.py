"""Of which models the places are told, and of which not: nobody may take silence for a model without faults."""

from collections.abc import Sequence

from ...reports.wording import listing
from ..facts import ComparedModel
from .failures import Structure


def told_of(models: Sequence[ComparedModel], structure: Sequence[Structure]) -> str:
    """The models whose failures are told, and those that were not looked at, as a sentence; empty where none say."""
    shown = [one.model for one in structure]
    others = [m.name for m in models if m.kind != "baseline" and m.name not in shown]
    if not shown:
        return ""
    return f"Told of {listing(shown)}{f'; not looked at: {listing(others)}' if others else ''}."
