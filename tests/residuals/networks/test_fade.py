"""A correction fades beyond what training has seen, and nowhere else."""

import numpy as np
import pytest
import torch
from torch import Tensor

from undertow.measurements.preparation.standardisation import Standardisation
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import scaling_of
from undertow.residuals.networks.base import Network
from undertow.residuals.networks.fade import Fade, Reach, directions
from undertow.residuals.networks.registry import NETWORKS, build

HULL = load_vehicle("blueboat")
KNOWN = 5
"""Velocities and thrusts of the boat."""
SEEN = np.random.default_rng(4).normal(size=(6, 50, KNOWN)).cumsum(axis=1) / 7.0
"""Windows of standardised inputs: random walks."""


def faded(name: str, fade: float = 0.5, heading: bool = False) -> Network:
    """A network of random numbers that has seen `SEEN`."""
    names = input_names(HULL, heading)
    constants = Standardisation(names, np.zeros(len(names)), np.ones(len(names)))
    network = build(name, scaling_of(HULL, constants, np.ones(3))).double()
    with torch.no_grad():
        for parameter in filter(torch.is_floating_point, network.parameters()):  # trees have whole numbers, too
            parameter.copy_(0.3 * torch.randn(parameter.shape, generator=torch.Generator().manual_seed(1)))
    network.fade_beyond(Reach.of(SEEN.reshape(-1, KNOWN), fade))
    return network.eval()


def tensor(seen: np.ndarray, heading: bool = False) -> Tensor:
    turned = np.zeros((*seen.shape[:-1], 2 * heading))
    return torch.as_tensor(np.concatenate([seen, turned], axis=-1))


def unfaded(network: Network, seen: Tensor) -> Tensor:
    fade, network.fade = network.fade, None
    said, _ = network(seen)
    network.fade = fade
    return said


@torch.no_grad()
@pytest.mark.parametrize(
    ("name", "heading"), [(n, h) for n in NETWORKS for h in (False, True) if not (h and n == "symmetric")]
)
def test_what_training_has_seen_is_not_touched(name: str, heading: bool):
    network = faded(name, heading=heading)
    assert torch.equal(network(tensor(SEEN, heading))[0], unfaded(network, tensor(SEEN, heading)))


@torch.no_grad()
@pytest.mark.parametrize("name", NETWORKS)
def test_far_from_it_nothing_is_left(name: str):
    network = faded(name)
    far = tensor(SEEN + np.array([0.0, 20.0, 0.0, 0.0, 0.0]))
    assert unfaded(network, far).abs().max() > 1e-3
    assert not network(far)[0].any()


def test_the_weight_is_that_of_the_distance_beyond_and_smooth():
    """One input alone: sides at 1 and, of its sum and difference with one that is at rest, at sqrt(1/2)."""
    fade = Fade(Reach.of(np.array([[1.0, 0.0], [-1.0, 0.0]]), 0.5), 2).double()
    assert directions(2).tolist() == [[1.0, 0.0], [0.0, 1.0], [0.5**0.5, 0.5**0.5], [0.5**0.5, -(0.5**0.5)]]
    x = torch.linspace(0.9, 1.6, 701, dtype=torch.float64, requires_grad=True)
    weight = fade(torch.stack([x, torch.zeros_like(x)], dim=-1))[:, 0]
    beyond = torch.relu(x.detach() - 1.0) * 2.0**0.5  # one side of weight 1, two of 1/2
    expected = torch.relu(1.0 - (beyond / 0.5) ** 2) ** 2
    torch.testing.assert_close(weight.detach(), expected, rtol=0.0, atol=2e-4)
    (slope,) = torch.autograd.grad(weight.sum(), x)
    assert slope.diff().abs().max() < 0.2, "no jump of the slope, which goes to 4.5 and back"
    assert slope.min() < -3.0


def test_what_was_met_apart_is_not_known_together():
    """Each of two inputs reached 1 while the other was at rest."""
    fade = Fade(Reach.of(np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]), 0.5), 2)
    known = torch.tensor([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0], [0.6, 0.6], [1.0, 1.0]])
    assert fade(known)[:, 0].tolist() == pytest.approx([1.0, 1.0, 1.0, (1.0 - 0.02 / 0.25) ** 2, 0.0], abs=1e-3)
