"""A force that is the same to port and to starboard, and nothing of a boat at rest without thrust."""

from typing import ClassVar, final

import numpy as np
import torch
from torch import Tensor, nn

from ...physics.errors import RequestError
from ...physics.motion import Array
from .base import Memory, Network, Scaling, hidden_layers, quiet_head
from .mlp import MLP

SIDES = (1.0, -1.0, -1.0)
"""What becomes of surge, sway and yaw in a mirror along the keel."""
_ALIKE = 0.2
"""Share of the strongest thruster's effect by which a thruster may differ from the image of its partner: arms and
centres of gravity that discovery moved a little leave a hull's thrusters pairs."""


@final
class Symmetric(Network):
    """Half of a perceptron of tanh and of its image in a mirror along the keel, less what both say at rest.

    The force of a symmetric hull is X, Y, N at (u, v, r, T) and X, -Y, -N at (u, -v, -r, T'), where T' are the thrusts
    with port and starboard exchanged (Fossen 2021, section 6.3), and so is what a vehicle lacks of such a hull, where
    it knows what is not symmetric. Fang et al. give residuals of ships this prior, with rest and a bound, which tanh
    gives. What is said is a force; the vehicle's mass makes an acceleration of it. What is known of a turn is known of
    its image: means, scales and the distance from training are those of both.

    Raises
    ------
    RequestError
        where it is to see the heading, since what pushes by heading has sides, or a thruster has no partner.
    """

    name: ClassVar[str] = "symmetric"
    rests_on = "bounds"
    image: Tensor
    sides: Tensor
    pulled: Tensor

    def __init__(self, scaling: Scaling, *, units: int = 128, layers: int = 1) -> None:
        super().__init__(scaling, {"units": units, "layers": layers})
        refuse_heading(self)
        self.body = hidden_layers(self.width, units, layers, nn.Tanh)
        self.head = quiet_head(units)
        force = np.diag(scaling.mass) * scaling.output
        pulled = np.linalg.inv(scaling.mass) * force / scaling.output[:, None]
        constants = {"image": image_of(scaling.reach), "sides": np.array(SIDES), "pulled": pulled}
        self.hold(constants, persistent=False)

    @classmethod
    def alike(cls, rows: Array, reach: Array) -> Array:
        """See `Network.alike`: their images."""
        seen = rows[:, : 3 + reach.shape[1]]
        return np.concatenate([rows, np.hstack([seen @ image_of(reach), rows[:, seen.shape[1] :]])])

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        mean, scale, sides = self.input_mean, self.input_scale, self.sides
        mirrored = (inputs @ self.image - mean) / scale
        own, other, rest = (self.head(self.body(x)) for x in (standardised, mirrored, -mean / scale))
        even = 0.5 * (own + other * sides - rest * (1.0 + sides))
        return even @ self.pulled.mT, ()

    @torch.no_grad()
    def plain(self) -> MLP:
        """The same as one perceptron of twice the units."""
        constants = (self.input_mean, self.input_scale, self.image, self.sides, self.pulled)
        mean, scale, image, sides, pulled = (x.double() for x in constants)
        units, layers = int(self.options["units"]), int(self.options["layers"])
        with torch.random.fork_rng(devices=[]):
            result = MLP(self.scaling, units=2 * units, layers=layers, activation=2).to(self.input_mean)
        result.gain = self.gain
        mine, theirs = ([m for m in net.body if isinstance(m, nn.Linear)] for net in (self, result))
        for k, (own, both) in enumerate(zip(mine, theirs, strict=True)):
            weight, bias = own.weight.double(), own.bias.double()
            if k:
                both.weight.copy_(torch.block_diag(weight, weight))
                both.bias.copy_(bias.repeat(2))
            else:
                turned = weight / scale @ image.mT
                both.weight.copy_(torch.cat((weight, turned * scale)))
                both.bias.copy_(torch.cat((bias, bias + (turned @ mean - weight / scale @ mean))))
        weight, bias = self.head.weight.double(), self.head.bias.double()
        rest = self.head(self.body((-mean / scale).to(self.input_mean))).double()
        result.head.weight.copy_(0.5 * pulled @ torch.cat((weight, sides[:, None] * weight), dim=1))
        result.head.bias.copy_(0.5 * pulled @ ((1.0 + sides) * (bias - rest)))
        return result


def refuse_heading(network: Network) -> None:
    """Refuse a symmetric network that is to see the heading.

    Raises
    ------
    RequestError
        where it is, since what pushes by heading has sides.
    """
    if network.width > 3 + network.scaling.drives:
        raise RequestError(
            f"network {network.name}: expected no heading: a current or a wind does not push alike on both sides; "
            "leave --heading out, or take another network"
        )


def image_of(reach: Array) -> Array:
    """Matrix (inputs, inputs) by which a row of velocities and thrusts from the right becomes that of its image.

    The partner of a thruster pushes as its image does, or the other way: one on the keel that pushes aside is its own.

    Parameters
    ----------
    reach : thruster matrix (3, thrusters)

    Raises
    ------
    RequestError
        where a thruster has no partner.
    """
    drives = reach.shape[1]
    images = (reach * np.array(SIDES)[:, None])[:, :, None]
    off = np.stack([np.abs(images - sign * reach[:, None, :]).sum(axis=0) for sign in (1.0, -1.0)], axis=-1)
    best = off.reshape(drives, -1).argmin(axis=1)
    partner, sign = best // 2, np.where(best % 2, -1.0, 1.0)
    paired = bool((partner[partner] == np.arange(drives)).all()) and bool((sign[partner] == sign).all())
    if not paired or off.min(axis=(1, 2)).max() > _ALIKE * np.abs(reach).sum(axis=0).max():
        raise RequestError(
            "a symmetric network: expected each thruster to have a partner on the other side, or to sit on the keel; "
            "this vehicle has one without; take another network, such as mlp"
        )
    result = np.zeros((3 + drives, 3 + drives))
    result[range(3), range(3)] = SIDES
    result[3 + np.arange(drives), 3 + partner] = sign
    return result
