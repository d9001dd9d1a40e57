"""Limits of a model's errors, as a file says them: in the words of the field, and nothing that is not known."""

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, ValidationError, field_validator, model_validator

from ..physics.errors import RequestError
from ..physics.file_marks import on_top
from ..physics.files import write_text
from ..physics.frames import AXES
from ..physics.in_words import listing
from ..physics.printable import one_line, shown
from ..physics.quantities import Positive, complaint, complaints, unknown_key
from ..physics.reading import read_yaml, reason
from ..residuals.scores import ACCELERATION_UNITS, ROLLOUT_UNITS, AccelerationRecord, Rollouts

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
    """What a vehicle must hold on its logs.

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
        found: dict[float, Any] = {}
        for key, errors in given.items():
            seconds = _seconds(key)
            if seconds in found:
                raise ValueError(f"{seconds:g} s stands twice; keep one")
            found[seconds] = errors
        return found

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
        raise RequestError(
            f"{where}: expected the keys {listing(list(Limits.model_fields))}, got {shown(data)}; {_REMEDY}"
        )
    try:
        return Limits.model_validate(data)
    except ValidationError as error:
        raise RequestError(f"{where}: {complaints(error.errors(include_url=False), _in_words)}") from None


def with_margin(acceleration: AccelerationRecord, rollout: Rollouts, margin: float, *, lawful: bool) -> Limits:
    """Limits above errors as they are now, by a share of them.

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
        raise RequestError(
            "an error of the vehicle is not finite, so no limit can be made of it; see 'undertow compare'"
        )
    wanted = max(error * (1.0 + margin), _LEAST)
    unit = 10.0 ** (math.floor(math.log10(wanted)) + 1 - _DIGITS)
    return float(f"{math.ceil(round(wanted / unit, 9)) * unit:.{_DIGITS + 1}g}")


def _seconds(key: Any) -> float:
    """A horizon, as a number or a text of one."""
    try:
        seconds = math.nan if isinstance(key, bool) else float(key)
    except (TypeError, ValueError, OverflowError):
        seconds = math.nan
    if not _SHORTEST <= seconds <= _LONGEST:
        raise ValueError(f"expected seconds ahead, {_SHORTEST:g} to {_LONGEST:g}, such as 10, got {shown(key)}")
    return round(seconds, 3)


def _entry(values: Mapping[str, float], units: Mapping[str, str]) -> str:
    told = ", ".join(f"{name}: {value:g}" for name, value in values.items())
    return f"{{{told}}}  # {', '.join(units[name] for name in values)}"


def _in_words(item: Any) -> str:
    """One of pydantic's complaints about a limits file."""
    path = [str(part).removesuffix(".0") for part in item["loc"]]  # pydantic names a horizon as Python writes it
    if item["type"] != "extra_forbidden":
        units = ROLLOUT_UNITS if path[:1] == ["predictions"] else ACCELERATION_UNITS
        return complaint(item, path, units.get(path[-1], "") if path else "")
    known = PredictionLimits if path[:1] == ["predictions"] else AxisLimits if len(path) > 1 else Limits
    return unknown_key(path[-1], known.model_fields, ".".join(path[:-1]) or "the limits file")
