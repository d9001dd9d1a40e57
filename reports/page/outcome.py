"""What adding the missing effects did to the predictions, in a sentence that says first when they got worse."""

from collections.abc import Sequence
from math import isfinite

from ...comparison.facts import CORRECTED, NOMINAL, Comparison
from ...discovery.findings import Findings, Step
from ...physics.in_words import listing, number, share_removed
from ...residuals.scores import ROLLOUT_UNITS
from ..wording import CALIBRATED, LEAD, pick_horizon
from .rivals import difference

_LEVEL = 0.01
"""Share by which an error must change to be called changed; `residuals.paired` asks for as much."""


def hero(steps: Sequence[Step], deciding: str = "") -> tuple[str, str]:
    """The rollout horizon [s] and the quantity that the story leads with.

    Parameters
    ----------
    deciding : the horizon that decides which model to trust, see `comparison.facts.Best`; the story leads with it
    """
    horizon = pick_horizon(list(steps[0].rollout_rmse), deciding or LEAD)
    known = [name for name in ROLLOUT_UNITS if any(isfinite(step.rollout(horizon).of(name)) for step in steps)]
    return horizon, known[0] if known else "position"


def gets_worse(steps: Sequence[Step], deciding: str = "") -> bool:
    """Whether the error that the story leads with is larger after the last step, or the predictions run away there."""
    before, after = _ends(steps, deciding)
    return len(steps) > 1 and before == before and not after <= before * (1.0 + _LEVEL)


def outcome(findings: Findings, comparison: Comparison) -> str:
    """What was added did to the error of the lead horizon, as a sentence; empty where nothing was added.

    Parameters
    ----------
    comparison : its paired difference says what may be chance
    """
    steps = findings.steps
    before, after = _ends(steps, comparison.best.horizon)
    if len(steps) < 2 or before != before:
        return ""
    horizon, metric = hero(steps, comparison.best.horizon)
    unit, added = ROLLOUT_UNITS[metric], [step for step in steps[1:] if step.added != CALIBRATED]
    adding = [f"adding {'it' if len(added) == 1 else 'them'}"] * bool(added)
    done = listing([*["calibrating its parameters"] * bool(findings.calibrated), *adding]) or "what was done"
    what, where = f"the {metric} error of {horizon} s predictions", "on motion that the fit never saw"
    if after != after:
        return f"{done.capitalize()} makes predictions over {horizon} s run away {where}."
    ends = f"{number(before, 2)} to {number(after, 2)} {unit}"
    told = difference(comparison.differences, CORRECTED, NOMINAL, "rollout", metric, horizon)
    doubt = {
        "no difference": ", which may be chance",
        "too short to tell": ", on too few rows to exclude chance",
    }.get("" if told is None else told.verdict, "")
    if gets_worse(steps, comparison.best.horizon):
        return f"{done.capitalize()} makes {what} worse {where}, from {ends}{doubt}."
    if after >= before * (1.0 - _LEVEL):
        return f"{done.capitalize()} leaves {what} as it was {where}, {number(before, 2)} {unit}."
    return f"{done.capitalize()} removes {share_removed(1.0 - after / before)} of {what} {where}{doubt}."


def also_worse(findings: Findings, comparison: Comparison) -> str:
    """Which other errors grew by more than chance, as a sentence; empty where none did."""
    led = hero(findings.steps, comparison.best.horizon)
    grown = [one.in_words for one in comparison.worsened if (one.horizon, one.axis) != led]
    return f"By more than chance, these errors grow: {listing(grown)}." if grown else ""


def opening(findings: Findings, comparison: Comparison) -> list[str]:
    """How the terminal begins: headline, why, what it did to the error, and which model to trust; bad news first."""
    did, said = outcome(findings, comparison), [findings.headline, " ".join(findings.reasons)]
    told = [did, also_worse(findings, comparison)]
    first = [*told, *said] if gets_worse(findings.steps, comparison.best.horizon) else [*said, *told]
    again = findings.folds.in_words(bool(findings.added)) if findings.folds else ""
    return [text for text in (*first, again, comparison.best.sentence) if text]


def _ends(steps: Sequence[Step], deciding: str) -> tuple[float, float]:
    horizon, metric = hero(steps, deciding)
    return steps[0].rollout(horizon).of(metric), steps[-1].rollout(horizon).of(metric)
