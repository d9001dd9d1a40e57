"""Whether half of a model is doubted: then what stands beside that is no more certain than the rest.

Effects of one model are fitted together, so each takes its size beside all others. Where half of them are only the
nearest names for something else, the sum of them follows that, and the one that nothing speaks against is a part of
the same sum.
"""

from collections.abc import Collection, Sequence

from ...physics.in_words import listing, words
from ..candidates.candidate import Kind
from .weighing import Evidence

_MANY = 2
"""Doubted effects from which they are a crowd: one may be beside what acts by itself. Of 611 logs of
`benchmarks/hidden_effects.py` with one to three effects, none that got a name had two."""


def mostly_doubted(evidence: Sequence[Evidence], kept: Collection[str], doubted: Collection[str]) -> str:
    """The doubted effects of a model of which they are half or more, in words; empty where they are few.

    Parameters
    ----------
    kept : keys of the effects that stand in the corrected model
    doubted : keys of those of them that are not certain
    """
    selected = [e.key for e in evidence if e.selected and e.kind is Kind.EFFECT]
    unsure = [key for key in selected if key not in kept or key in doubted]
    if len(unsure) < _MANY or 2 * len(unsure) < len(selected):
        return ""
    return listing([words(key) for key in unsure])
