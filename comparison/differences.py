"""Which differences between models are more than chance, quantity by quantity."""

from collections.abc import Sequence

import numpy as np

from ..discovery.findings import Rise
from ..measurements.statistics.blocks import Difference, paired_difference
from ..physics.file_records import Number, Record, Whole
from ..physics.motion import AXES, Array
from ..physics.presentation import percent
from ..residuals.models.base import Model
from ..residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, ByAxis, Errors


class PairedRecord(Record):
    """How an error of a model differs from that of another on the same rows, as `comparison.json` has it.

    Attributes
    ----------
    model, against : the two
    quantity : "acceleration" or "rollout"
    horizon : of the rollout [s]; None for the acceleration
    axis : of the error
    difference, relative, ci95 : model minus reference [`unit`], the same over the reference's error, and its 95 %
        interval; None where the rows are too few
    verdict : "better", "worse", "no difference" or "too short to tell"
    blocks : how many stretches the interval rests on
    """

    model: str
    against: str
    quantity: str
    horizon: str | None = None
    axis: str
    difference: Number | None = None
    relative: Number | None = None
    ci95: tuple[Number, Number] | None = None
    unit: str = ""
    verdict: str = ""
    blocks: Whole | None = None

    @property
    def in_words(self) -> str:
        """Which error it is, and by what share it changed, as a part of a sentence."""
        what = "acceleration" if self.horizon is None else f"of {self.horizon} s predictions"
        return f"{self.axis} {what} by {percent(abs(self.relative or 0.0))}"


ROLLED = (*AXES, "position")
"""What the columns of the squared errors of rollouts are."""


def differences(models: Sequence[tuple[Model, Errors]], references: Sequence[str]) -> list[PairedRecord]:
    """Every model against each reference that stands before it, baselines against the first model only.

    Entries are as `comparison.json` has them.
    """
    found = []
    for k, (model, errors) in enumerate(models):
        for other, base in models[: 1 if model.kind == "baseline" else k]:
            if k > 0 and other.name in references:
                found += _against(model.name, errors, other.name, base)
    return found


def rises(errors: Errors, before: Errors) -> tuple[Rise, ...]:
    """Which errors are larger than those before on the same rows, by more than chance."""
    found = []
    for told in _against("", errors, "", before):
        if told.verdict == "worse":
            ends = [_error_of(one, told.horizon).of(told.axis) for one in (before, errors)]
            found.append(Rise(horizon=told.horizon, axis=told.axis, before=ends[0], after=ends[1], unit=told.unit))
    return tuple(found)


def _error_of(errors: Errors, horizon: str | None) -> ByAxis:
    """Root mean square errors of the predictions over a horizon; of the acceleration without one."""
    return errors.acceleration_score.record.rmse if horizon is None else errors.rollout_scores[horizon].record


def _against(name: str, errors: Errors, other: str, base: Errors) -> list[PairedRecord]:
    told = []
    for axis, ours, theirs in zip(AXES, squares(errors).T, squares(base).T, strict=True):
        done = paired_difference(ours, theirs)
        told.append(_entry(name, other, "acceleration", None, axis, done, ACCELERATION_UNITS[axis]))
    for horizon in errors.rollouts:
        shortest = rows_of(errors, horizon)
        pair = zip(ROLLED, rolled(errors, horizon).T, rolled(base, horizon).T, strict=True)
        for axis, ours, theirs in pair:
            done = paired_difference(ours, theirs, shortest)
            told.append(_entry(name, other, "rollout", horizon, axis, done, ROLLOUT_UNITS[axis]))
    return told


def squares(errors: Errors) -> Array:
    """Squared errors of the acceleration on all rows (n, 3)."""
    return np.square(np.concatenate(errors.acceleration))


def rolled(errors: Errors, horizon: str) -> Array:
    """Mean squared errors of all rollouts over a horizon (starts, 4)."""
    return np.concatenate(errors.rollouts[horizon].squares)


def rows_of(errors: Errors, horizon: str) -> int:
    """How many starts lie within one horizon: rollouts from them share rows."""
    return max(1, round(float(horizon) / min(errors.rollouts[horizon].spacing)))


def _entry(
    name: str, other: str, quantity: str, horizon: str | None, axis: str, done: Difference, unit: str
) -> PairedRecord:
    return PairedRecord(
        model=name,
        against=other,
        quantity=quantity,
        horizon=horizon,
        axis=axis,
        difference=done.difference,
        relative=done.relative,
        ci95=done.ci95,
        unit=unit,
        verdict=done.verdict,
        blocks=done.blocks,
    )
