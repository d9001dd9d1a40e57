"""Standardisation of features: mean and scale of the training part, kept in a small JSON file."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...physics.errors import RequestError, shown
from ...physics.files import write_text
from ...physics.motion import Array, Motion
from ...physics.reading import Plain, read_json, reason
from .resampling import feature_names, stacked

SCHEMA = "undertow.standardisation/1"


@dataclass(frozen=True, slots=True, eq=False)
class Standardisation:
    """Shift and scale of each feature.

    Attributes
    ----------
    names : of the features
    mean, scale : (features,) in the units of the features; a constant feature has the scale 1
    """

    names: tuple[str, ...]
    mean: Array
    scale: Array

    @classmethod
    def fit(cls, training: Sequence[Motion]) -> "Standardisation":
        """Mean and standard deviation of the features of the training motions, and of nothing else.

        Raises
        ------
        RequestError
            when there is no motion, or the motions differ in their thrusters.
        """
        if not training:
            raise RequestError("standardisation: expected at least one training motion, got none.")
        names = {feature_names(motion) for motion in training}
        if len(names) > 1:
            raise RequestError(f"standardisation: the motions differ in their features: {sorted(names)}.")
        return cls.of(names.pop(), stacked(training))

    @classmethod
    def of(cls, names: Sequence[str], values: Array) -> "Standardisation":
        """Mean and standard deviation of the columns of `values` (n, features), which are called `names`.

        Raises
        ------
        RequestError
            when there is no row, a name too few or too many, or a value that is not finite.
        """
        values = np.asarray(values, dtype=float)
        if values.ndim != 2 or values.shape[1] != len(names) or not values.shape[0]:
            raise RequestError(f"standardisation: expected rows of {len(names)} features, got shape {values.shape}.")
        if not np.isfinite(values).all():
            broken = [name for name, column in zip(names, values.T, strict=True) if not np.isfinite(column).all()]
            raise RequestError(f"standardisation: expected finite numbers, got others in {', '.join(broken)}.")
        spread = values.std(axis=0)
        constant = spread <= 1e-12 * np.maximum(1.0, np.abs(values).max(axis=0))
        return cls(tuple(names), values.mean(axis=0), np.where(constant, 1.0, spread))

    def apply(self, values: Array) -> Array:
        """Features (n, f) to zero mean and unit scale."""
        return (values - self.mean) / self.scale

    def undo(self, values: Array) -> Array:
        """Standardised features (n, f) back to their units."""
        return values * self.scale + self.mean

    def to_dict(self) -> Plain:
        """Give the content of the JSON file."""
        return {
            "schema": SCHEMA,
            "features": [
                {"name": name, "mean": float(mean), "scale": float(scale)}
                for name, mean, scale in zip(self.names, self.mean, self.scale, strict=True)
            ],
        }

    @classmethod
    def from_dict(cls, content: Any, where: str = "standardisation") -> "Standardisation":
        """Rebuild the standardisation that `to_dict` described.

        Raises
        ------
        RequestError
            when `content` is something else; `where` names it in the message.
        """
        if not isinstance(content, dict) or content.get("schema") != SCHEMA:
            came = content.get("schema") if isinstance(content, dict) else type(content).__name__
            raise RequestError(f"{where}: expected schema '{SCHEMA}', got {shown(came)}.")
        try:
            rows = [(str(row["name"]), float(row["mean"]), float(row["scale"])) for row in content["features"]]
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise RequestError(f"{where}: expected features with name, mean and scale ({error!r}).") from error
        values = np.array([row[1:] for row in rows]).reshape(len(rows), 2)
        if not rows or not np.isfinite(values).all() or (values[:, 1] <= 0).any():
            raise RequestError(f"{where}: expected finite means and positive scales, got {shown(rows)}.")
        return cls(tuple(row[0] for row in rows), values[:, 0], values[:, 1])

    def write(self, path: Path | str) -> None:
        """Write strict JSON to a temporary name beside `path`, then rename it."""
        write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n")

    @classmethod
    def read(cls, path: Path | str) -> "Standardisation":
        """Read what `write` wrote.

        Raises
        ------
        RequestError
            when the file is missing or is not a standardisation.
        """
        path = Path(path)
        try:
            content = read_json(path)
        except (OSError, ValueError) as error:
            raise RequestError(f"{path}: expected a JSON file with schema '{SCHEMA}' ({reason(error)}).") from error
        return cls.from_dict(content, str(path))
