"""Whether half of a model is doubted: then what stands beside that is no more certain than the rest.

Effects of one model are fitted together, so each takes its size beside all others. Where half of them are only the
nearest names for something else, the sum of them follows that, and the one that nothing speaks against is a part of
the same sum. Rollouts fit all axes together; on the force balance only what acts on one axis is.
"""

from collections.abc import Collection, Sequence

from ...physics.in_words import listing, words
from ..candidates.candidate import Kind
from .weighing import Evidence

_MANY = 2
"""Doubted effects from which they are a crowd: one may be beside what acts by itself. Of 611 logs of
`benchmarks/hidden_effects.py` with one to three effects, none that got a name had two."""


def mostly_doubted(
    evidence: Sequence[Evidence], kept: Collection[str], doubted: Collection[str], least: float | None = None
) -> dict[str, str]:
    """The doubted effects beside each certain one that are half or more of what was fitted with it, by key, in words.

    Parameters
    ----------
    kept : keys of the effects that stand in the corrected model
    doubted : keys of those of them that are not certain
    least : share of the force on an axis from which an effect acts there, where axes are fitted apart; None where
        all effects are fitted together
    """
    selected = [e for e in evidence if e.selected and e.kind is Kind.EFFECT]
    found = {}
    for own in (e for e in selected if e.key in kept and e.key not in doubted):
        beside = [e for e in selected if least is None or ((e.share >= least) & (own.share >= least)).any()]
        unsure = [e.key for e in beside if e.key not in kept or e.key in doubted]
        if len(unsure) >= _MANY and 2 * len(unsure) >= len(beside):
            found[own.key] = listing([words(key) for key in unsure])
    return found
