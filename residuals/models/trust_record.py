"""The trust region of a network's correction, as its `model.yaml` has it."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import BaseModel, ConfigDict, model_validator

from ...physics.errors import RequestError
from ...physics.reading import Number, Positive

if TYPE_CHECKING:
    from ..networks.trust import Trust


class TrustRecord(BaseModel):
    """A `networks.trust.Trust`, by axis; the `fade` of older files is one reach, within which a correction is whole."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    lower: tuple[Number, ...]
    upper: tuple[Number, ...]
    reaches: tuple[Positive, ...]
    weights: tuple[tuple[Number, ...], tuple[Number, ...], tuple[Number, ...]]
    error: tuple[tuple[Number, ...], tuple[Number, ...], tuple[Number, ...]]

    @model_validator(mode="before")
    @classmethod
    def _of_an_older_file(cls, said: object) -> object:
        if not (isinstance(said, dict) and "distance" in said):
            return said
        rest = {name: value for name, value in said.items() if name != "distance"}
        return {"reaches": [said["distance"]], "weights": [[1.0, 0.0]] * 3, "error": [[0.0, 0.0]] * 3} | rest

    @classmethod
    def of(cls, trust: "Trust") -> "TrustRecord":
        """Record of a trust region for a file."""
        names = ("lower", "upper", "reaches", "weights", "error")
        return cls.model_validate({name: getattr(trust, name).tolist() for name in names})

    def trust(self, inputs: int, where: str) -> "Trust":
        """Trust region of a network that knows so many velocities and thrusts; loads torch.

        Raises
        ------
        RequestError
            when the numbers are too many or too few for it, or no shares; `where` names the file.
        """
        from ..networks.trust import Trust, directions

        sides, count = len(directions(inputs)), len(self.reaches)
        if (len(self.lower), len(self.upper)) != (sides, sides):
            raise RequestError(
                f"{where}: expected {sides} ends below and {sides} above of what training has seen, got "
                f"{len(self.lower)} and {len(self.upper)}; the file is damaged, so train the network again"
            )
        rows = (*self.weights, *self.error)
        if (
            not count
            or any(len(row) != count + 1 for row in rows)
            or any(min(row) < 0.0 or sum(row) > 1.0 + 1e-6 for row in self.weights)
        ):
            raise RequestError(
                f"{where}: trust: expected for each axis {count + 1} shares of at least 0 and at most 1 together, "
                f"got {self.weights}; the file is damaged, so train the network again"
            )
        return Trust(*(np.array(getattr(self, name)) for name in ("lower", "upper", "reaches", "weights", "error")))
