"""A Gaussian process of a symmetric hull: as plain arrays, and the same to port and to starboard."""

from typing import ClassVar, final

import numpy as np
from torch import Tensor

from ...physics.motion import Array
from .base import Memory, Scaling
from .gaussian_process import GaussianProcess
from .symmetric import SIDES, Symmetric, image_of, refuse_heading


@final
class SymmetricProcess(GaussianProcess):
    """The mean of a Gaussian process and of its image in a mirror along the keel: of a hull that is symmetric.

    Each row teaches its image, too, see `Symmetric`; it may push a boat at rest ahead or astern, and never to a side.

    Raises
    ------
    RequestError
        where it is to see the heading, or a thruster has no partner.
    """

    name: ClassVar[str] = "symmetric_gp"
    image: Tensor
    mirror: Tensor

    def __init__(self, scaling: Scaling, *, units: int = 400) -> None:
        super().__init__(scaling, units=units)
        refuse_heading(self)
        force = np.diag(SIDES) @ scaling.mass * scaling.output
        mirror = np.linalg.inv(scaling.mass) @ force / scaling.output[:, None]  # of a force: mass may lie aside
        self.hold({"image": image_of(scaling.reach), "mirror": mirror}, persistent=False)

    @classmethod
    def alike(cls, rows: Array, reach: Array) -> Array:
        """See `Network.alike`: their images."""
        return Symmetric.alike(rows, reach)

    def with_images(self, rows: Array, wanted: Array) -> tuple[Array, Array]:
        """See `GaussianProcess.with_images`: an image stands beside its row, in the same block of time."""
        image, mirror = self.image.double().numpy(), self.mirror.double().numpy()
        both = np.stack([rows, rows @ image], axis=1), np.stack([wanted, wanted @ mirror.T], axis=1)
        return both[0].reshape(-1, rows.shape[1]), both[1].reshape(-1, 3)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`; means and scales are those of rows and images, so that a mirror needs no units."""
        own, _ = super().correct(standardised, inputs, memory)
        other, _ = super().correct(standardised @ self.image, inputs, memory)
        return 0.5 * (own + other @ self.mirror.mT), ()
