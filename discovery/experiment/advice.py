"""Advice: the manoeuvres that would settle what a log leaves open, chosen by rehearsing all of them on the model."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil

import numpy as np

from ...physics.motion import AXES
from ...physics.presentation import listing, words
from ..candidates.candidate import Kind
from ..evidence.weighing import CERTAINLY, Evidence
from ..findings import BY_OTHER_MEANS, Advice
from ..identifiability.rehearsal import Identifiability, Rehearsal, rehearse
from ..search.floating import Search, State
from .separation import Separation, separate_effects

MOST_ITEMS = 6
"""Most manoeuvres advised."""
_AS_GOOD = 0.7
"""Share of the best trial's gain from which another will do."""
_BEYOND_DOUBT = 2.0 * CERTAINLY
"""Log-likelihood from which a trial settles a question nine times of ten, if its effect is as large as is plausible."""
_MOST_RUNS = 4
"""Times that a manoeuvre may be asked for: more would not be driven."""
_MOST_NAMED = 4
"""Questions in one sentence; the others are counted, or it would not be read."""
_VISIBLE = 0.01
"""Share of a force below which nobody would call an effect shown."""


def advise(
    search: Search,
    state: State,
    questions: Mapping[str, Sequence[str]],
    plausible: Mapping[str, tuple[float, ...]],
    rehearsal: Rehearsal | None = None,
) -> tuple[Advice, ...]:
    """Manoeuvres that would settle open questions, each with what it would settle, at most six.

    What the search selected comes first. The trial that parts most pairs is taken until none is left; one that parts a
    pair with seven tenths of the best one's gain will do, and so will one chosen already that parts it beyond doubt.

    Parameters
    ----------
    state : the model that the search ended with
    questions : candidates in doubt, each with its look-alikes; one without is told from anything that could hide it
    plausible : an amount for each amplitude column of every candidate, for effects that the log does not show
    rehearsal : of `state`, if there is one already
    """
    rehearsal = rehearsal or (rehearse(search, state.vehicle, state.active) if questions else None)
    if rehearsal is None or not questions:
        return ()
    every = separate_effects(search, state, questions, plausible, rehearsal)
    partings = [p if len(p.effects) > 1 else _where_visible(p) for p in every]
    promising = [p for p in partings if p.gain.max() >= CERTAINLY / _MOST_RUNS]
    plan: dict[int, list[Separation]] = {}
    for left in ([p for p in promising if p.selected], [p for p in promising if not p.selected]):
        while left and len(plan) < MOST_ITEMS:
            ahead = [k for k in plan if any(_settles(p, k) for p in left)]
            trial = max(ahead or range(len(rehearsal.trials)), key=lambda k: _worth(left, k))
            settled = [p for p in left if _settles(p, trial)]
            plan.setdefault(trial, []).extend(settled)
            left = [p for p in left if p not in settled]
    items = []
    for trial, settled in plan.items():
        runs = max(ceil(CERTAINLY / p.gain[trial]) for p in settled)
        often = f", {runs} times" if runs > 1 else ""
        first = next((p for p in settled if len(p.effects) > 1), settled[0])
        text, why = rehearsal.trials[trial].text + often, reasons(settled, trial)
        items.append(Advice(manoeuvre=text, why=why, effects=first.effects))
    hopeless = [p for p in every if p.selected and p.gain.max() < CERTAINLY / _MOST_RUNS]
    if hopeless:
        items.append(advise_otherwise(hopeless, len(rehearsal.trials)))
    return tuple(items[:MOST_ITEMS])


def advise_otherwise(hopeless: Sequence[Separation], trials: int) -> Advice:
    """What to do where none of so many trials would do."""
    purposes = "; ".join(map(_purpose, hopeless[:_MOST_NAMED]))
    why = f"{purposes}: none of the {trials} manoeuvres that were rehearsed would do"
    return Advice(manoeuvre=BY_OTHER_MEANS, why=why)


def open_questions(
    evidence: Sequence[Evidence], sure: Sequence[str], known: Identifiability
) -> dict[str, tuple[str, ...]]:
    """What a discovery leaves open: selected effects that are not sure, with look-alikes; and those it cannot see.

    Effects that would explain faint structure are asked about with their look-alikes, each group once. An effect that
    the log does not show has no look-alikes there but in name.

    Parameters
    ----------
    evidence : of all candidates
    sure : keys of the effects that are missing for sure
    known : which candidates the log excites and tells apart

    Returns
    -------
    Keys of the effects in question, each with its look-alikes.
    """
    blind = {*known.dormant, *known.absorbed, *known.noise_limited}
    chosen = [e for e in evidence if e.selected and e.kind is Kind.EFFECT and e.key not in sure]
    questions = {e.key: () if e.key in blind else e.indistinguishable_from for e in chosen}
    for e in evidence:
        if e.faint and not any(e.key in rivals for rivals in questions.values()):
            questions[e.key] = e.indistinguishable_from
    asked = {e.key for e in evidence if e.faint}
    return questions | {e.key: () for e in evidence if not e.selected and e.key in blind and e.key not in asked}


def _where_visible(parting: Separation) -> Separation:
    """The same without axes of trials on which so little of an effect would act that nobody would call it shown.

    What log and trial tell together the log then tells without it. It is another thing for look-alikes: a trial in
    which one of them acts alone tells of the other, which is left in the log.
    """
    return replace(parting, information=np.where(parting.share >= _VISIBLE, parting.information, 0.0))


def _serves(parting: Separation, trial: int) -> bool:
    return bool(parting.gain[trial] >= _AS_GOOD * float(parting.gain.max()))


def _settles(parting: Separation, trial: int) -> bool:
    """True when a trial that is to be driven anyway is enough."""
    return _serves(parting, trial) or bool(parting.gain[trial] >= _BEYOND_DOUBT)


def _worth(partings: Sequence[Separation], trial: int) -> tuple[int, float]:
    """How many partings a trial serves, and how well in comparison with the best trial for each."""
    served = [p for p in partings if _serves(p, trial)]
    return len(served), float(sum(p.gain[trial] / p.gain.max() for p in served))


def reasons(settled: Sequence[Separation], trial: int) -> str:
    """Why a trial is advised: what it would tell or show, with the shares of force, there and in the log so far.

    Pairs are told together, with the numbers of the pair that is hardest to part.
    """
    pairs = [p for p in settled if len(p.effects) > 1]
    told = []
    if pairs:
        names = list(dict.fromkeys(key for p in pairs for key in p.effects))
        hardest = min(pairs, key=lambda p: p.gain[trial])
        who = (
            "they would differ"
            if len(pairs) == 1
            else f"even {listing([words(key) for key in hardest.effects])} would differ"
        )
        told.append(f"would tell {_apart(names)}: {who} by {_shares(hardest, trial)}")
    single = sorted((p for p in settled if len(p.effects) == 1), key=lambda p: -p.gain[trial])
    told += [f"{_purpose(p)}: it would make {_shares(p, trial)}" for p in single if p.selected]
    hidden = [p for p in single if not p.selected]
    if hidden:
        # Some show in a trial by being told from others there and not by their size: their shares would say nothing.
        larger = [p for p in hidden if _larger(p, trial)][:_MOST_NAMED]
        shown = [f"{words(p.effects[0])} as {_shares(p, trial)}" for p in larger]
        names = [words(p.effects[0]) for p in hidden[: 0 if shown else _MOST_NAMED]]
        more = len(hidden) - len(shown) - len(names)
        what = f"show a plausible {', '.join(shown)}" if shown else f"tell from the others {', '.join(names)}"
        rest = f" and {more} more effect{'s' * (more > 1)}" if more > 0 else ""
        told.append(f"would {what}{rest}")
    return "; ".join(told)


def _shares(p: Separation, trial: int) -> str:
    axis = _telling_axis(p, trial)
    more = p.share[trial, axis] > p.before[axis]
    beside = "" if more else ", beside more that is like it"
    here = f" (in this log: {_percent(p.before[axis])}{beside})"
    return f"{_percent(p.share[trial, axis])} of the {AXES[axis]} force{here}"


def _larger(p: Separation, trial: int) -> bool:
    axis = _telling_axis(p, trial)
    return bool(p.share[trial, axis] > max(_VISIBLE, p.before[axis]))


def _telling_axis(p: Separation, trial: int) -> int:
    """The axis on which a trial tells most."""
    return int(np.argmax(p.information[trial]))


def _purpose(p: Separation) -> str:
    several = len(p.effects) > 1
    return (
        f"would tell {_apart(p.effects)}" if several else f"would settle whether there is {words(''.join(p.effects))}"
    )


def _apart(keys: Sequence[str]) -> str:
    names = [words(key) for key in keys]
    if len(names) == 2:
        return " from ".join(names)
    more = len(names) - _MOST_NAMED
    return f"{listing([*names[:_MOST_NAMED], *[f'{more} more'] * (more > 0)])} apart"


def _percent(share: float) -> str:
    if share > 1.0:
        return "more than all"
    return f"{share:.0%}".replace("%", " %") if share >= 0.0095 else f"{share:.1%}".replace("%", " %")
