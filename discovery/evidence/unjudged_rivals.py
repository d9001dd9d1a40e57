"""What cannot be judged, because a velocity may be wrong, may still be what acts: then no stand-in of it is sure.

Where the compass may be wrong, no effect that needs the sway velocity is judged. A moment that drifting makes is still
in the log, and effects of the turn rate, which have no such doubt, stand in for it in every rehearsal and every fold.
The force balance with the velocities as they were measured tells whether one that is not judged would do as well.
"""

from collections.abc import Sequence

from ...physics.in_words import words
from ..candidates.candidate import Candidate, Kind
from ..search.floating import Search, State
from .weighing import TELL_APART

_LETTERS = {"X": 0, "Y": 1, "N": 2}
"""The axis of a force by the letter with which the symbols of SNAME (1950) begin."""


def beside_unjudged(forces: Search, state: State, kept: Sequence[str], unjudged: Sequence[Candidate]) -> dict[str, str]:
    """Why effects are not certain in whose place one that was not judged does as well, by key.

    Parameters
    ----------
    forces : on the force balance, with the pool that was judged
    state : the model with everything that was selected
    kept : effects in question
    unjudged : candidates that need what may be wrong
    """
    unjudged = [candidate for candidate in unjudged if _axes(candidate)]
    named = [c for c in forces.pool if c.kind is Kind.EFFECT and c.key in kept and c.key in state.active]
    if not unjudged or not named:
        return {}
    wide = Search(forces.balance, forces.nominal, (*forces.pool, *unjudged), forces.settings)
    linear, scores = wide.linearise(state.vehicle, state.active)
    now = {key: linear.options[key][0] for key in state.active}
    score = wide.quick(scores, now)
    found: dict[str, list[str]] = {}
    for rival in unjudged:
        # What drifts otherwise than the model says moves surge and yaw, too: thrust can stand in for it.
        through_others = [[c.key] for c in named if not _axes(c)]
        alike = [c.key for c in named if _axes(c) and _axes(c) <= _axes(rival)]
        shapes = [option for option in linear.options[rival.key] if option.present]
        # Beside the rival, too: what acts besides it is not in its place.
        beside = min(score, *(wide.quick(scores, {**now, rival.key: shape}) for shape in shapes))
        for group in [*through_others, *([key] for key in alike), *([alike] if len(alike) > 1 else [])]:
            gone = {key: linear.options[key][1] for key in group}
            if min(wide.quick(scores, {**now, **gone, rival.key: shape}) for shape in shapes) < beside + TELL_APART:
                for key in group:
                    found.setdefault(key, []).append(rival.effect.name)
    return {key: " or ".join(map(words, dict.fromkeys(names))) for key, names in found.items()}


def _axes(candidate: Candidate) -> set[int]:
    """The axes on which a candidate acts, of an added mass those of its symbol; none where it acts through others."""
    own = [parameter for parameter in candidate.parameters if not parameter.grid]
    axes = [_LETTERS.get(p.symbol.partition("_")[0]) if p.axis is None else p.axis for p in own]
    return set() if None in axes else {axis for axis in axes if axis is not None}
