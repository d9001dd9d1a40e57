"""Boosted regression trees (Friedman 2001) as plain arrays: a learner of tables, asked like any network."""

from typing import ClassVar, NamedTuple, final

import numpy as np
import torch
from torch import Tensor, nn

from ...physics.errors import RequestError
from .base import Grown, Memory, Network, Scaling, fixed


class Nodes(NamedTuple):
    """The nodes of all trees of the three axes, (3, trees, nodes) each.

    A node sends an input up to the threshold to `left`, and else to `right`; a leaf sends all to itself.

    Attributes
    ----------
    feature : input that is asked
    threshold : of the standardised input
    left, right : nodes
    value : of a leaf, in units of the output; 0 elsewhere
    """

    feature: np.ndarray
    threshold: np.ndarray
    left: np.ndarray
    right: np.ndarray
    value: np.ndarray


@final
class Trees(Network):
    """The sum of `units` trees of at most `leaves` leaves for each axis, and a constant; without memory.

    Trees are grown by `training.tabular_fit`, not by steps along a gradient; before, all are alike and say nothing.
    Beyond their training they say what they said at its edge.
    """

    name: ClassVar[str] = "trees"
    grown: ClassVar[Grown | None] = Grown("trees", "grown")

    def __init__(self, scaling: Scaling, *, units: int = 60, leaves: int = 31) -> None:
        if leaves < 2:
            raise RequestError(f"network trees: expected at least 2 leaves, got {leaves}")
        super().__init__(scaling, {"units": units, "leaves": leaves})
        shape = (3, units, 2 * leaves - 1)
        self.threshold = fixed(torch.zeros(shape))  # first: its type is that of the network
        node, tree = torch.arange(shape[-1]), torch.arange(units)[:, None]
        inner = 2 * node + 2 < shape[-1]  # each node is followed by two, as in a heap
        heap = (node + tree) % self.width, *(torch.where(inner, 2 * node + k, node) for k in (1, 2))
        self.feature, self.left, self.right = (fixed(part.expand(shape).clone()) for part in heap)
        # What the correction is proportional to, as in the other networks.
        zeros = (("value", fixed(torch.zeros(shape))), ("constant", fixed(torch.zeros(3))))
        self.head = nn.ParameterDict(zeros)

    def plant(self, nodes: Nodes, constant: np.ndarray) -> None:
        """Take over grown trees, and what is added to them (3,), in units of the output."""
        for name, grown in nodes._asdict().items():
            own = self.head["value"] if name == "value" else self.get_parameter(name)
            own.copy_(torch.as_tensor(grown))
        self.head["constant"].copy_(torch.as_tensor(constant))

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        seen = standardised.reshape(-1, standardised.shape[-1])
        axes, trees, nodes = self.feature.shape
        root = nodes * torch.arange(axes * trees, device=seen.device)
        at = root.expand(seen.shape[0], -1)
        for _ in range(nodes):
            low = seen.gather(1, self.feature.take(at)) <= self.threshold.take(at)
            after = root + torch.where(low, self.left.take(at), self.right.take(at))
            if torch.equal(after, at):  # all have come to a leaf
                break
            at = after
        said = self.head["value"].take(at).reshape(seen.shape[0], axes, trees).sum(-1) + self.head["constant"]
        return said.reshape(*standardised.shape[:-1], 3), ()
