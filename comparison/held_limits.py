"""Whether a model holds limits on its logs: measured errors beside those that are allowed."""

from collections.abc import Iterator
from typing import ClassVar

from ..physics.cards import Card
from ..physics.errors import RequestError
from ..physics.file_records import Flag, Number, Record
from ..residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS
from .error_limits import Limits
from .facts import ComparedModel


class HeldLimit(Record):
    """A limit and what was measured.

    Attributes
    ----------
    quantity : "prediction", "acceleration" or "laws"
    horizon : of a prediction [s], as a text
    axis : or "position"; empty for the laws
    measured, limit : root mean square errors with their `unit`; of the laws, how many are broken
    told : the laws that are broken, or how many predictions ran away
    """

    quantity: str
    horizon: str | None = None
    axis: str = ""
    measured: Number
    limit: Number
    unit: str = ""
    holds: Flag
    told: str = ""


class HeldLimits(Card, Record):
    """All limits of a model on its logs; `verdict` is "holds" or "broken"."""

    SCHEMA: ClassVar[str] = "undertow.ci/1"

    verdict: str
    model: str
    logs: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    limits: tuple[HeldLimit, ...]
    notes: tuple[str, ...] = ()

    @property
    def broken(self) -> tuple[HeldLimit, ...]:
        """The limits that are not held."""
        return tuple(one for one in self.limits if not one.holds)

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        return [
            ("model", self.model),
            ("limits", f"{len(self.limits)}, {len(self.broken)} broken"),
            ("broken", ", ".join(" ".join((one.horizon or "", one.quantity, one.axis)) for one in self.broken)),
        ]


def held(model: ComparedModel, limits: Limits) -> tuple[HeldLimit, ...]:
    """Every limit beside the errors of a model, in the order of the file.

    Raises
    ------
    RequestError
        when the logs have no room for a prediction that has a limit.
    """
    return tuple(_each(model, limits))


def _each(model: ComparedModel, limits: Limits) -> Iterator[HeldLimit]:
    for seconds in limits.horizons:
        name = f"{seconds:g}"
        errors = model.rollout.get(name)
        if errors is None:
            raise RequestError(
                f"predictions: {name}: no stretch of the logs is longer than {name} s, so nothing tells whether this "
                "limit holds; leave it out, or give a longer log"
            )
        lost = f"{errors.diverged} of {errors.starts} ran away" if errors.diverged else ""
        for axis, limit in limits.predictions[seconds].given().items():
            unit, measured = ROLLOUT_UNITS[axis], errors.of(axis)
            holds = measured <= limit
            yield HeldLimit(
                quantity="prediction", horizon=name, axis=axis, measured=measured, limit=limit, unit=unit, holds=holds,
                told=lost,
            )  # fmt: skip
    for axis, limit in limits.acceleration.given().items():
        unit, measured = ACCELERATION_UNITS[axis], model.acceleration.rmse.of(axis)
        yield HeldLimit(
            quantity="acceleration", axis=axis, measured=measured, limit=limit, unit=unit, holds=measured <= limit
        )
    if limits.laws:
        broken = [law.law for law in model.laws if law.counts and law.verdict == "fail"]
        told = ", ".join(broken)
        yield HeldLimit(quantity="laws", measured=len(broken), limit=0.0, holds=model.audit == "pass", told=told)
