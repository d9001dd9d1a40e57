"""A network that walks along with a boat: what it says of each row as it comes, and of rows that are only planned."""

from typing import final

import numpy as np
import torch

from ...physics.motion import Array
from ..networks.base import Memory
from .network_model import NetworkModel, numbers
from .threads import one_thread


@final
class NetworkWalk:
    """A network beside the physics, fed a row at a time.

    Parameters
    ----------
    model : whose network it is; it sees what `network_inputs` has

    Attributes
    ----------
    said : (3,) what it said of the latest row [m/s^2, m/s^2, rad/s^2]
    """

    def __init__(self, model: NetworkModel) -> None:
        self._model = model
        self._memory: Memory | None = None
        self.said = np.zeros(3)

    def follow(self, seen: Array) -> Array:
        """What it says of rows (n, inputs) that have come, (n, 3), and it remembers them."""
        found, self._memory = self._asked(seen)
        self.said = found[-1]
        return found

    def ahead(self, seen: Array) -> Array:
        """What it would say of rows (n, inputs) that come next, (n, 3); it remembers nothing of them."""
        return self._asked(seen)[0]

    def _asked(self, seen: Array) -> tuple[Array, Memory]:
        with torch.inference_mode(), one_thread():
            said, memory = self._model.network(self._model.tensor(seen)[None], self._memory)
        return numbers(said[0]), memory
