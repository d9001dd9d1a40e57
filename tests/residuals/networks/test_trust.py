"""A correction counts by its gain: what parts of a log that it did not know say of it, by the distance from there."""

import numpy as np
import pytest
import torch
from torch import Tensor

from undertow.measurements.preparation.resampling import Standardisation
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import scaling_of
from undertow.residuals.networks.base import Network
from undertow.residuals.networks.registry import NETWORKS, build
from undertow.residuals.networks.trust import ENDS, NARROW, Gain, HeldOutTrial, Trust, directions, stacked

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
    network.trust(Trust.within(SEEN.reshape(-1, KNOWN), fade))
    return network.eval()


def tensor(seen: np.ndarray, heading: bool = False) -> Tensor:
    turned = np.zeros((*seen.shape[:-1], 2 * heading))
    return torch.as_tensor(np.concatenate([seen, turned], axis=-1))


def whole(network: Network, seen: Tensor) -> Tensor:
    gain, network.gain = network.gain, None
    said, _ = network(seen)
    network.gain = gain
    return said


@torch.no_grad()
@pytest.mark.parametrize(
    ("name", "heading"), [(n, h) for n in NETWORKS for h in (False, True) if not (h and n.startswith("symmetric"))]
)
def test_what_training_has_seen_is_not_touched_by_a_reach(name: str, heading: bool):
    network = faded(name, heading=heading)
    assert torch.equal(network(tensor(SEEN, heading))[0], whole(network, tensor(SEEN, heading)))


@torch.no_grad()
@pytest.mark.parametrize("name", NETWORKS)
def test_beyond_the_last_reach_nothing_is_left_but_what_does_not_fade(name: str):
    network = faded(name)
    far = tensor(SEEN + np.array([0.0, 20.0, 0.0, 0.0, 0.0]))
    assert whole(network, far).abs().max() > 1e-3
    assert not network(far)[0].any()
    trust = network.gain.trust  # type: ignore[union-attr]
    alike = name == "port_hamiltonian"  # whose stores take what the gain leaves, too
    weights = np.array([[0.5, 0.25]] * 3 if alike else [[0.5, 0.25], [0.0, 1.0], [0.5, 0.0]])
    network.trust(Trust(trust.lower, trust.upper, trust.reaches, weights, 0.0 * weights))
    network.double()
    if not alike:
        assert network(far)[0].numpy() == pytest.approx(whole(network, far).numpy() * weights[:, 1], abs=1e-9)
    assert network.gain(far).numpy() == pytest.approx(np.broadcast_to(weights[:, 1], (*far.shape[:2], 3)))  # type: ignore[misc]


def test_the_gain_is_that_of_the_distance_beyond_and_smooth():
    """One input alone: sides at 1 and, of its sum and difference with one that is at rest, at sqrt(1/2)."""
    gain = Gain(Trust.within(np.array([[1.0, 0.0], [-1.0, 0.0]]), 0.5), 2).double()
    assert directions(2).tolist() == [[1.0, 0.0], [0.0, 1.0], [0.5**0.5, 0.5**0.5], [0.5**0.5, -(0.5**0.5)]]
    x = torch.linspace(0.9, 1.6, 701, dtype=torch.float64, requires_grad=True)
    weight = gain(torch.stack([x, torch.zeros_like(x)], dim=-1))[:, 0]
    beyond = torch.relu(x.detach() - 1.0) * 2.0**0.5  # one side of weight 1, two of 1/2
    expected = torch.relu(1.0 - (beyond / 0.5) ** 2) ** 2
    torch.testing.assert_close(weight.detach(), expected, rtol=0.0, atol=2e-4)
    assert weight.detach().numpy() == pytest.approx(gain.trust.gain(beyond.numpy())[:, 0], abs=2e-4)
    (slope,) = torch.autograd.grad(weight.sum(), x)
    assert slope.diff().abs().max() < 0.2, "no jump of the slope, which goes to 4.5 and back"
    assert slope.min() < -3.0


def test_what_was_met_apart_is_not_known_together():
    """Each of two inputs reached 1 while the other was at rest."""
    gain = Gain(Trust.within(np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]), 0.5), 2)
    known = torch.tensor([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0], [0.6, 0.6], [1.0, 1.0]])
    assert gain(known)[:, 0].tolist() == pytest.approx([1.0, 1.0, 1.0, (1.0 - 0.02 / 0.25) ** 2, 0.0], abs=1e-3)


# What parts of a log tell of it


def stretches(holds: float, beyond: float, noise: float = 0.0, seed: int = 0) -> list[HeldOutTrial]:
    """Corrections of which so much is lacking within the training, and so much 4 deviations and more beyond it."""
    rng, found = np.random.default_rng(seed), []
    for k in range(20):
        said = np.cumsum(rng.normal(size=(100, 3)), axis=0) / 10.0
        far = np.where(rng.uniform(size=100) < 0.5, 0.0, rng.uniform(4.0, 6.0, 100))
        share = np.where(far > 0.0, beyond, holds)[:, None]
        found.append(HeldOutTrial(share * said + noise * rng.normal(size=said.shape), said, far, ("log", k)))
    return found


@pytest.mark.parametrize(
    ("holds", "beyond"), [(1.0, 1.0), (1.0, 0.0), (0.6, 0.3), (0.0, 0.0), (-1.0, -1.0), (2.0, 2.0)]
)
def test_the_gain_is_what_was_lacking_of_what_was_said(holds: float, beyond: float):
    reaches, weights, error = stacked(stretches(holds, beyond), 20)
    trust = Trust(np.zeros(25), np.zeros(25), reaches, weights, error)
    assert reaches.tolist() == [NARROW, 1.0, 2.0, 4.0, 4.0 * ENDS]
    near, far, gone = trust.gain(np.array([0.0, 5.0, 4.0 * ENDS]))
    assert near == pytest.approx(np.clip(holds, 0.0, 1.0), abs=0.02)
    assert far == pytest.approx(np.clip(beyond, 0.0, 1.0) * (1.0 - (5.0 / reaches[-1]) ** 2) ** 2, abs=0.02)
    assert gone.tolist() == [0.0, 0.0, 0.0], "it ends"
    steps = np.diff(trust.gain(np.linspace(0.0, 8.0, 100)), axis=0)
    assert (steps <= 1e-12).all(), "no correction is trusted more where it is farther from home"


def test_what_chance_would_give_has_a_large_error_and_a_small_gain():
    """Noise ten times as large as what is said tells little, and the standard error says so."""
    sure, unsure = (stacked(stretches(0.5, 0.5, noise), 20) for noise in (0.1, 10.0))
    assert (sure[2][:, 0] < 0.02).all()
    assert (unsure[2][:, 0] > 5.0 * sure[2][:, 0]).all()
    none = np.mean([stacked(stretches(0.0, 0.0, 1.0, seed), 20)[1].sum(axis=1) for seed in range(5)])
    assert none < 0.1


def test_what_nobody_tried_is_not_dared():
    near = [one._replace(distance=0.0 * one.distance) for one in stretches(1.0, 1.0)]
    reaches, weights, _ = stacked(near, 20)
    assert (reaches.tolist(), weights[:, 1].tolist()) == ([NARROW], [0.0, 0.0, 0.0])
    assert weights[:, 0] == pytest.approx(1.0, abs=1e-6)
    reaches, weights, error = stacked([], 20)
    assert (reaches.tolist(), weights.any(), error.any()) == ([NARROW], False, False)


def test_a_correction_whose_form_keeps_laws_has_one_gain():
    mixed = [one._replace(lacking=one.predicted * np.array([1.0, 0.0, 0.5])) for one in stretches(1.0, 1.0)]
    _, apart, _ = stacked(mixed, 20)
    _, alike, _ = stacked(mixed, 20, common=True)
    assert apart.sum(axis=1) == pytest.approx([1.0, 0.0, 0.5], abs=0.02)
    assert (alike == alike[0]).all()
    assert 0.0 < alike[0].sum() < 1.0
