"""Where the correction of a network fades, as its `model.yaml` has it."""

from typing import TYPE_CHECKING

import numpy as np
from pydantic import BaseModel, ConfigDict

from ...physics.errors import RequestError
from ...physics.quantities import Number, Positive

if TYPE_CHECKING:
    from ..networks.fade import Reach


class FadeRecord(BaseModel):
    """A `networks.fade.Reach`: the distance at which nothing is left, and the ends of what training has seen."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    distance: Positive
    lower: tuple[Number, ...]
    upper: tuple[Number, ...]

    @classmethod
    def of(cls, reach: "Reach") -> "FadeRecord":
        """What a file keeps of a reach."""
        return cls(distance=reach.fade, lower=tuple(reach.lower), upper=tuple(reach.upper))

    def reach(self, inputs: int, where: str) -> "Reach":
        """The reach of a network that knows so many velocities and thrusts; loads torch.

        Raises
        ------
        RequestError
            when the numbers are too many or too few for it; `where` names the file.
        """
        from ..networks.fade import Reach, directions

        sides = len(directions(inputs))
        if (len(self.lower), len(self.upper)) != (sides, sides):
            raise RequestError(
                f"{where}: fade: expected {sides} ends below and {sides} above, got {len(self.lower)} and "
                f"{len(self.upper)}; the file is damaged, so train the network again"
            )
        return Reach(self.distance, np.array(self.lower), np.array(self.upper))
