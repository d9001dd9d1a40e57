"""A perceptron that is the same to port and to starboard, and says nothing of a boat at rest without thrust."""

from typing import ClassVar, final

import numpy as np
import torch
from torch import Tensor, nn

from ...physics.errors import RequestError
from ...physics.frames import Array
from .base import Memory, Network, Scaling, hidden_layers, quiet_head
from .mlp import MLP

_SIDES = (1.0, -1.0, -1.0)
"""What becomes of surge, sway and yaw in a mirror along the keel."""
_ALIKE = 0.2
"""Share of the strongest thruster's effect by which a thruster may differ from the mirrored one of its partner: arms
and centres of gravity that discovery moved a little leave a hull's thrusters pairs."""


@final
class Symmetric(Network):
    """Half of a perceptron of tanh and of its image in a mirror along the keel, less what both say at rest.

    A hull that is symmetric has f(u, -v, -r, T') = (f_u, -f_v, -f_r), where T' are the thrusts with port and starboard
    exchanged (Fossen 2021, section 6.3: port-starboard symmetry); what a vehicle lacks of such a hull has it, too,
    where the vehicle knows what is not symmetric. It is one of the physical priors that residuals of ship models are
    given in the literature, with rest and a bound, which tanh gives. It learns from each turn what holds for the other
    side.

    Raises
    ------
    RequestError
        where it is to see the heading, since what pushes by heading has sides, or thrusters are not in pairs.
    """

    name: ClassVar[str] = "symmetric"

    def __init__(self, scaling: Scaling, *, units: int = 128, layers: int = 1) -> None:
        super().__init__(scaling, {"units": units, "layers": layers})
        if self.width > 3 + scaling.drives:
            raise RequestError(
                "network symmetric: expected no heading: a current or a wind does not push alike on both sides; leave "
                "--heading out, or take another network"
            )
        self.body = hidden_layers(self.width, units, layers, nn.Tanh)
        self.head = quiet_head(units)
        for label, values in (("image", _image(scaling.reach)), ("sides", _SIDES)):
            self.register_buffer(label, torch.as_tensor(values, dtype=torch.float32), persistent=False)

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        mean, scale, image, sides = (self.get_buffer(n) for n in ("input_mean", "input_scale", "image", "sides"))
        mirrored = (inputs @ image - mean) / scale
        own, other, rest = (self.head(self.body(x)) for x in (standardised, mirrored, -mean / scale))
        even = own + other * sides - rest * (1.0 + sides)
        return 0.5 * even, ()

    def plain(self) -> MLP:
        """The same as one perceptron of twice the units."""
        mean, scale, image, sides = (
            self.get_buffer(n).double() for n in ("input_mean", "input_scale", "image", "sides")
        )
        units, layers = int(self.options["units"]), int(self.options["layers"])
        with torch.random.fork_rng(devices=[]):
            found = MLP(self.scaling, units=2 * units, layers=layers, activation=2).to(self.get_buffer("input_mean"))
        found.fade = self.fade
        mine, theirs = ([*(m for m in net.body if isinstance(m, nn.Linear)), net.head] for net in (self, found))
        with torch.no_grad():
            for k, (own, other) in enumerate(zip(mine, theirs, strict=True)):
                weight, bias = own.weight.double(), own.bias.double()
                if k == 0:
                    turned = weight / scale @ image.mT
                    halves = weight, turned * scale
                    other.bias.copy_(torch.cat((bias, bias + turned @ mean - weight / scale @ mean)))
                    other.weight.copy_(torch.cat(halves))
                elif own is self.head:
                    other.weight.copy_(0.5 * torch.cat((weight, sides[:, None] * weight), dim=1))
                    rest = self.head(self.body(-self.get_buffer("input_mean") / self.get_buffer("input_scale")))
                    other.bias.copy_(0.5 * (1.0 + sides) * (bias - rest.double()))
                else:
                    other.weight.copy_(torch.block_diag(weight, weight))
                    other.bias.copy_(torch.cat((bias, bias)))
        return found


def _image(reach: Array) -> Array:
    """Matrix (inputs, inputs) by which a row of inputs from the right becomes that of the mirrored motion."""
    drives = reach.shape[1]
    mirrored = reach * np.array(_SIDES)[:, None]
    off = np.abs(mirrored[:, :, None] - reach[:, None, :]).sum(axis=0)
    partner = off.argmin(axis=1)
    paired = bool((partner[partner] == np.arange(drives)).all())
    if not paired or off.min(axis=1).max() > _ALIKE * np.abs(reach).sum(axis=0).max():
        raise RequestError(
            "network symmetric: expected each thruster to have a partner on the other side, or to lie on the keel; "
            "this vehicle's have none; take another network, such as mlp"
        )
    found = np.zeros((3 + drives, 3 + drives))
    found[range(3), range(3)] = _SIDES
    found[3 + np.arange(drives), 3 + partner] = 1.0
    return found
