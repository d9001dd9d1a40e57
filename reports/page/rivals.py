"""Models side by side, as the page shows them: error with its paired interval, laws kept and broken, size."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...comparison.facts import AuditRecord, ComparedModel, Comparison, PairedRecord, RulingRecord
from ...residuals.scores import RolloutRecord
from ..wording import LEAD, pick_horizon

MARKS = {"better": "\N{DOWNWARDS ARROW}", "worse": "\N{UPWARDS ARROW}", "no difference": "=", "too short to tell": "?"}
"""Signs of a paired difference; one is never told by its colour alone."""


@dataclass(frozen=True, slots=True)
class Rival:
    """A model in the picture.

    Attributes
    ----------
    model : as the comparison has it
    score : of its predictions, NaN where they diverged
    interval : of their position error [m], from the paired 95 % interval of its difference to the reference
    laws : verdict by law: pass, fail, noted, not applicable; empty when no law was asked
    """

    model: ComparedModel
    score: RolloutRecord
    interval: tuple[float, float] | None
    laws: dict[str, str]


def rivals(comparison: Comparison, audit: AuditRecord | None = None) -> list[Rival]:
    """Every compared model, the smallest prediction error first, those that ran away last."""
    horizon, reference = hero_horizon(comparison), reference_of(comparison)
    scores = {model.name: model.rollout.get(horizon) or RolloutRecord() for model in comparison.models}
    base = scores[reference].position if reference in scores else float("nan")
    found = []
    for model in comparison.models:
        low, high = _paired(comparison.differences, model.name, reference, horizon)
        interval = (max(base + low, 0.0), max(base + high, 0.0)) if low <= high and base == base else None
        laws = {law.law: law.outcome for law in laws_of(model, audit)}
        found.append(Rival(model, scores[model.name], interval, laws))
    return sorted(found, key=lambda one: (one.score.position != one.score.position, one.score.position))


def laws_of(model: ComparedModel, audit: AuditRecord | None) -> Sequence[RulingRecord]:
    """The laws of a compared model, from the comparison, or for the corrected one from the audit beside it."""
    return model.laws or (audit.laws if audit is not None and model.name == "corrected" else ())


def hero_horizon(comparison: Comparison) -> str:
    """The horizon [s] by which the models are drawn: the one that decides which to trust, else 10 s."""
    known = list(dict.fromkeys(key for model in comparison.models for key in model.rollout))
    return pick_horizon(known, comparison.best.horizon or LEAD)


def reference_of(comparison: Comparison) -> str:
    """The model against which the others are told: the corrected one where there is one, else the first.

    None that was fitted to the judged rows, whose errors are too small.
    """
    names = [model.name for model in comparison.models]
    paired = {name for item in comparison.differences for name in (item.model, item.against)}
    paired -= {model.name for model in comparison.models if model.fitted_here}
    return next((name for name in ("corrected", "calibrated", "nominal") if name in paired), names[0] if names else "")


def _paired(differences: Sequence[PairedRecord], model: str, reference: str, horizon: str) -> tuple[float, float]:
    """The 95 % interval of the difference in position error to the reference [m], told either way; NaN without."""
    for name, against, turned in ((model, reference, False), (reference, model, True)):
        told = difference(differences, name, against, "rollout", "position", horizon)
        low, high = (told and told.ci95) or (float("nan"), float("nan"))
        if low <= high:
            return (-high, -low) if turned else (low, high)
    return float("nan"), float("nan")


def difference(
    differences: Sequence[PairedRecord], model: str, against: str, quantity: str, axis: str, horizon: str | None = None
) -> PairedRecord | None:
    """The paired difference of a model to another in one error; None where it was not told."""
    wanted = (model, against, quantity, axis, horizon)
    return next((d for d in differences if (d.model, d.against, d.quantity, d.axis, d.horizon) == wanted), None)


def mark(told: PairedRecord | None) -> str:
    """The sign of a paired difference; nothing where there is none."""
    return MARKS.get(told.verdict, "") if told else ""
