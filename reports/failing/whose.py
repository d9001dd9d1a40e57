"""Of which models the places are told, and of which not: nobody may take silence for a model without faults."""

from collections.abc import Mapping
from typing import Any

from ..wording import listing


def told_of(comparison: Mapping[str, Any]) -> str:
    """The models whose failures are told, and those that were not looked at, as a sentence; empty where none say.

    Examples
    --------
    >>> names = ("nominal", "lstm", "tcn", "hold velocity")
    >>> models = [{"name": name, "kind": "baseline" if " " in name else "hybrid"} for name in names]
    >>> told_of({"models": models, "structure": [{"model": "nominal"}, {"model": "tcn"}]})
    'Told of nominal and tcn; not looked at: lstm.'
    """
    shown = [str(one["model"]) for one in comparison.get("structure") or []]
    models = comparison.get("models") or []
    others = [str(m["name"]) for m in models if m.get("kind") != "baseline" and str(m["name"]) not in shown]
    if not shown:
        return ""
    return f"Told of {listing(shown)}{f'; not looked at: {listing(others)}' if others else ''}."
