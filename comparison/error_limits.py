"""Error limits: read from a file in the words of the field, and held against the errors of a model."""

import math
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, ValidationError, field_validator, model_validator

from ..physics.errors import RequestError, one_line, shown
from ..physics.file_records import Flag, Number, Record
from ..physics.files import on_top, write_text
from ..physics.motion import AXES
from ..physics.presentation import Card, listing
from ..physics.reading import Positive, complaint, complaints, read_yaml, reason, unknown_key
from ..residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, AccelerationRecord, ByAxis, Rollouts
from .facts import ComparedModel

WRITTEN_BY = "ci --write-limits"
ROLLED = ("position", *AXES)
"""What is predicted, in the order of the file."""
_SHORTEST = 0.1
"""Shortest prediction [s]: a row of the logs as they are judged, or two."""
_LONGEST = 600.0
"""Longest prediction that may be asked for [s]: after ten minutes open loop no boat is where its model is."""
_LEAST = 1e-6
"""Least limit that is written: errors below it are rounding, which another processor makes differently."""
_DIGITS = 2
"""Digits of a limit that is written, rounded up: it is a margin, not a measurement."""
_REMEDY = "'undertow ci LOG --vehicle V --write-limits limits.yaml' writes one from today's errors"


class AxisLimits(BaseModel):
    """Largest root mean square error on each axis; None where there is no limit."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    surge: Positive | None = None
    sway: Positive | None = None
    yaw: Positive | None = None

    def given(self) -> dict[str, float]:
        """The limits that there are, by name."""
        return {name: value for name in ROLLED if (value := getattr(self, name, None)) is not None}


class PredictionLimits(AxisLimits):
    """The same of open-loop predictions over one horizon, and of the position [m]."""

    position: Positive | None = None


class Limits(BaseModel):
    """Error limits that a vehicle must hold on its logs.

    Attributes
    ----------
    predictions : by seconds ahead: errors of open-loop predictions [m, m/s, m/s, rad/s]
    acceleration : one-step errors [m/s^2, m/s^2, rad/s^2]
    laws : "pass" where the vehicle must keep the laws of a hull along the logs; None where nobody asks
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    predictions: dict[float, PredictionLimits] = {}
    acceleration: AxisLimits = AxisLimits()
    laws: Literal["pass"] | None = None

    @field_validator("predictions", mode="before")
    @classmethod
    def _by_seconds(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        result: dict[float, Any] = {}
        for key, errors in given.items():
            seconds = _seconds(key)
            if seconds in result:
                raise ValueError(f"{seconds:g} s stands twice; keep one")
            result[seconds] = errors
        return result

    @model_validator(mode="after")
    def _some(self) -> Self:
        if not self.laws and not self.acceleration.given() and not any(e.given() for e in self.predictions.values()):
            raise ValueError("expected at least one limit, as in 'predictions: {10: {position: 1.5}}'")
        return self

    @property
    def horizons(self) -> tuple[float, ...]:
        """The predictions that are asked for, from the shortest to the longest [s]."""
        return tuple(sorted(seconds for seconds, errors in self.predictions.items() if errors.given()))

    def save(self, path: str | os.PathLike[str], about: str = "") -> Path:
        """Write a limits file, with units as remarks; `about` says above it where its numbers are from."""
        return write_text(path, on_top(WRITTEN_BY, self.text(about)))

    def text(self, about: str = "") -> str:
        """The limits as a file has them."""
        lines = [f"# {one_line(about)}"] if about else []
        if self.horizons:
            lines.append("predictions:  # root mean square errors of open-loop predictions, by seconds ahead")
        for seconds in self.horizons:
            lines.append(f"  {seconds:g}: {_entry(self.predictions[seconds].given(), ROLLOUT_UNITS)}")
        if self.acceleration.given():
            lines.append(f"acceleration: {_entry(self.acceleration.given(), ACCELERATION_UNITS)}")
        if self.laws:
            lines.append("laws: pass  # what 'undertow check' asks of a hull")
        return "\n".join(lines) + "\n"


def load_limits(path: str | os.PathLike[str]) -> Limits:
    """Read a limits file.

    Raises
    ------
    RequestError
        when there is none, or it holds something else; an unknown key is named with the nearest known one.
    """
    try:
        content = read_yaml(path)
    except FileNotFoundError:
        raise RequestError(f"expected a limits file at {os.fspath(path)}, but there is none; {_REMEDY}") from None
    except (OSError, ValueError) as error:
        raise RequestError(f"{os.fspath(path)} cannot be read ({reason(error)}); {_REMEDY}") from None
    return limits_from_dict(content, os.fspath(path))


def limits_from_dict(data: Any, where: str) -> Limits:
    """Limits from plain data; see `load_limits`."""
    if not isinstance(data, dict):
        keys = listing(list(Limits.model_fields))
        raise RequestError(f"{where}: expected the keys {keys}, got {shown(data)}; {_REMEDY}")
    try:
        return Limits.model_validate(data)
    except ValidationError as error:
        raise RequestError(f"{where}: {complaints(error.errors(include_url=False), _in_words)}") from None


def with_margin(acceleration: AccelerationRecord, rollout: Rollouts, margin: float, *, lawful: bool) -> Limits:
    """Limits above errors as they are now, by a share of them.

    Parameters
    ----------
    acceleration, rollout : errors as they are
    margin : share by which a limit lies above them
    lawful : whether the laws must be kept

    Raises
    ------
    RequestError
        when an error is no finite number, of which nothing can be a share.
    """
    grown = {
        float(name): PredictionLimits(**{axis: _above(errors.of(axis), margin) for axis in ROLLED})
        for name, errors in rollout.items()
    }
    steps = AxisLimits(**{axis: _above(acceleration.rmse.of(axis), margin) for axis in AXES})
    return Limits(predictions=grown, acceleration=steps, laws="pass" if lawful else None)


def _above(error: float, margin: float) -> float:
    if not math.isfinite(error):
        text = "an error of the vehicle is not finite, so no limit can be made of it; see 'undertow compare'"
        raise RequestError(text)
    wanted = max(error * (1.0 + margin), _LEAST)
    unit = 10.0 ** (math.floor(math.log10(wanted)) + 1 - _DIGITS)
    return float(f"{math.ceil(round(wanted / unit, 9)) * unit:.{_DIGITS + 1}g}")


def _seconds(key: Any) -> float:
    """A horizon, as a number or a text of one."""
    seconds = math.nan
    with suppress(TypeError, ValueError, OverflowError):
        seconds = math.nan if isinstance(key, bool) else float(key)
    if not _SHORTEST <= seconds <= _LONGEST:
        raise ValueError(f"expected seconds ahead, {_SHORTEST:g} to {_LONGEST:g}, such as 10, got {shown(key)}")
    return round(seconds, 3)


def _entry(values: Mapping[str, float], units: Mapping[str, str]) -> str:
    text = ", ".join(f"{name}: {value:g}" for name, value in values.items())
    return f"{{{text}}}  # {', '.join(units[name] for name in values)}"


def _in_words(item: Any) -> str:
    """One of pydantic's complaints about a limits file."""
    path = [str(part).removesuffix(".0") for part in item["loc"]]  # pydantic names a horizon as Python writes it
    if item["type"] != "extra_forbidden":
        units = ROLLOUT_UNITS if path[:1] == ["predictions"] else ACCELERATION_UNITS
        return complaint(item, path, units.get(path[-1], "") if path else "")
    known = PredictionLimits if path[:1] == ["predictions"] else AxisLimits if len(path) > 1 else Limits
    return unknown_key(path[-1], known.model_fields, ".".join(path[:-1]) or "the limits file")


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
    found: list[HeldLimit] = []

    def hold(
        quantity: str, errors: ByAxis, limits: AxisLimits, units: Mapping[str, str], horizon: str = "", lost: str = ""
    ) -> None:
        for axis, limit in limits.given().items():
            measured = errors.of(axis)
            one = HeldLimit(quantity=quantity, axis=axis, measured=measured, limit=limit, holds=measured <= limit)
            found.append(one.but(unit=units[axis], horizon=horizon or None, told=lost))

    for seconds in limits.horizons:
        name = f"{seconds:g}"
        errors = model.rollout.get(name)
        if errors is None:
            raise RequestError(
                f"predictions: {name}: no stretch of the logs is longer than {name} s, so nothing tells whether this "
                "limit holds; leave it out, or give a longer log"
            )
        lost = f"{errors.diverged} of {errors.starts} ran away" if errors.diverged else ""
        hold("prediction", errors, limits.predictions[seconds], ROLLOUT_UNITS, name, lost)
    hold("acceleration", model.acceleration.rmse, limits.acceleration, ACCELERATION_UNITS)
    if limits.laws:
        broken = [law.law for law in model.laws if law.outcome == "fail"]
        holds, text = model.audit == "pass", ", ".join(broken)
        found.append(HeldLimit(quantity="laws", measured=len(broken), limit=0.0, holds=holds, told=text))
    return tuple(found)
