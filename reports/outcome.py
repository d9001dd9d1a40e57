"""What adding the missing effects did to the predictions, in a sentence that says first when they got worse."""

from collections.abc import Mapping, Sequence
from typing import Any

from .rivals import difference
from .wording import ROLLOUT_UNITS, finite, listing, number, percent, pick_horizon

_LEVEL = 0.01
"""Share by which an error must change to be called changed; `residuals.paired` asks for as much."""

Step = Mapping[str, Any]


def hero(steps: Sequence[Step]) -> tuple[str, str]:
    """The rollout horizon [s] and the quantity that the story leads with."""
    rollout = steps[0]["rollout_rmse"]
    horizon = pick_horizon(list(rollout))
    return horizon, next((name for name in ROLLOUT_UNITS if name in rollout.get(horizon, {})), "position")


def gets_worse(findings: Mapping[str, Any]) -> bool:
    """Whether the error that the story leads with is larger after the last step, or the predictions run away there."""
    before, after = _ends(findings)
    return len(findings["steps"]) > 1 and before == before and not after <= before * (1.0 + _LEVEL)


def outcome(findings: Mapping[str, Any], comparison: Mapping[str, Any]) -> str:
    """What was added did to the error of the lead horizon, as a sentence; empty where nothing was added.

    Parameters
    ----------
    findings, comparison : as in `findings.json` and `comparison.json`; the paired difference says what may be chance
    """
    steps = findings["steps"]
    before, after = _ends(findings)
    if len(steps) < 2 or before != before:
        return ""
    horizon, metric = hero(steps)
    unit, missing = ROLLOUT_UNITS[metric], findings.get("missing") or []
    added = [f"adding {'it' if len(missing) == 1 else 'them'}"] * bool(missing)
    done = listing([*["calibrating its parameters"] * bool(findings.get("calibrated")), *added]) or "what was done"
    what, where = f"the {metric} error of {horizon} s predictions", "on motion that the fit never saw"
    if after != after:
        return f"{done.capitalize()} makes predictions over {horizon} s run away {where}."
    ends = f"{number(before, 2)} to {number(after, 2)} {unit}"
    told = difference(comparison, "corrected", "nominal", "rollout", metric, horizon) or {}
    doubt = {
        "no difference": ", which may be chance",
        "too short to tell": ", on too few rows to exclude chance",
    }.get(str(told.get("verdict")), "")
    if gets_worse(findings):
        return f"{done.capitalize()} makes {what} worse {where}, from {ends}{doubt}."
    if after >= before * (1.0 - _LEVEL):
        return f"{done.capitalize()} leaves {what} as it was {where}, {number(before, 2)} {unit}."
    return f"{done.capitalize()} removes {percent(1.0 - after / before)} of {what} {where}{doubt}."


def opening(findings: Mapping[str, Any], comparison: Mapping[str, Any]) -> list[str]:
    """How the terminal begins: headline, what it did to the error, and which model to trust; bad news first."""
    did, headline = outcome(findings, comparison), str(findings.get("headline") or "")
    sentence = str((comparison.get("best") or {}).get("sentence") or "")
    first = [did, headline] if gets_worse(findings) else [headline, did]
    return [text for text in (*first, sentence) if text]


def _ends(findings: Mapping[str, Any]) -> tuple[float, float]:
    steps = findings["steps"]
    horizon, metric = hero(steps)
    before, after = (finite(step["rollout_rmse"].get(horizon, {}).get(metric)) for step in (steps[0], steps[-1]))
    return before, after
