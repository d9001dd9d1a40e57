"""Bounds on perceptrons: lines that enclose their activation, proofs on the knife edge, and planted violations."""

import numpy as np
import pytest
import torch
from judging import BOX, HULL

from undertow.comparison.audit import witness_of
from undertow.measurements.preparation.resampling import Standardisation
from undertow.physics.laws.audit.search import Box, climb, spread
from undertow.physics.laws.energy import TOLERANCE, full_force
from undertow.physics.motion import Array
from undertow.physics.vehicle import Hull
from undertow.residuals.models.bounds import bound_power, relu_lines, tanh_lines
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import NetworkModel, scaling_of
from undertow.residuals.networks.base import Network
from undertow.residuals.networks.registry import build

LOW, HIGH = np.array(BOX.lower), np.array(BOX.upper)
EVERY_ACTIVATION = pytest.mark.parametrize("activation", [1, 2], ids=["relu", "tanh"])
EVERY_LINE = pytest.mark.parametrize(
    ("lines", "curve"), [(relu_lines, lambda x: np.maximum(x, 0.0)), (tanh_lines, np.tanh)], ids=["relu", "tanh"]
)


def perceptron(activation: int, units: int = 128, layers: int = 1, size: float = 0.0) -> Network:
    """A perceptron of random weights of some size, in double precision."""
    scale = np.concatenate([0.4 * (HIGH - LOW), np.full(len(HULL.thrusters), 20.0)])
    names = input_names(HULL, False)
    constants = scaling_of(HULL, Standardisation(names, np.zeros(len(names)), scale), np.array([0.1, 0.05, 0.1]))
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = build("mlp", constants, {"units": units, "layers": layers, "activation": activation}).double()
    generator = torch.Generator().manual_seed(units + layers)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(size * torch.randn(parameter.shape, generator=generator))
    return network


def highest(model: NetworkModel, force: Array) -> float:
    """The largest power in the envelope less that of a force along each axis [W], found by search."""
    witness, box = witness_of(model, BOX), Box(np.append(LOW, 0.0), np.append(HIGH, 0.0))

    def value(states: Array) -> Array:
        return witness.power(states) - np.abs(states[:, :3]) @ force

    states = spread(box, 4096, 0)
    tops = climb(value, states, value(states), box)
    return float(value(tops).max())


@EVERY_LINE
def test_lines_enclose_the_activation(lines, curve) -> None:
    rng = np.random.default_rng(0)
    middle = rng.normal(size=4000) * 10.0 ** rng.uniform(-3.0, 1.5, 4000)
    half = np.abs(rng.normal(size=4000)) * 10.0 ** rng.uniform(-6.0, 1.5, 4000)
    half[:50] = 0.0
    least, most = middle - half, middle + half
    (below, under), (above, over) = lines(least, most)
    assert (below >= 0.0).all(), "bounds keep their side through a layer"
    assert (above >= 0.0).all()
    for share in np.linspace(0.0, 1.0, 101):
        x = (1.0 - share) * least + share * most
        assert (below * x + under <= curve(x) + 1e-12).all()
        assert (above * x + over >= curve(x) - 1e-12).all()


def test_lines_of_tanh_close_by_the_square_of_the_interval() -> None:
    middle = np.linspace(-2.0, 2.0, 81)

    def gap(half: float) -> float:
        (below, under), (above, over) = tanh_lines(middle - half, middle + half)
        return float(((above - below) * middle + over - under).max())

    assert gap(0.01) < 1.1e-2 * gap(0.1)
    assert gap(0.1) < 0.5 * 0.77 * 0.1**2 * 1.05, "no more than half of the largest curvature of tanh"


@EVERY_ACTIVATION
@pytest.mark.parametrize(("units", "layers"), [(32, 1), (128, 1), (64, 2)])
@pytest.mark.parametrize("share", [0.0, TOLERANCE], ids=["power", "beside a force"])
def test_a_proof_turns_on_the_knife_edge(activation: int, units: int, layers: int, share: float) -> None:
    model = NetworkModel(HULL, perceptron(activation, units, layers, size=0.5 / layers), 0.1)
    force = share * full_force(HULL)
    most = highest(model, force)
    assert most > 0.01, "this network gives power, so that there is an edge"
    assert bound_power(model, BOX, 1.01 * most, force).proved
    found = bound_power(model, BOX, 0.99 * most, force)
    assert not found.proved
    assert found.against is not None
    power = witness_of(model, BOX).power(np.append(found.against, 0.0)[None])[0]
    assert 0.99 * most < power - np.abs(found.against) @ force <= most * (1.0 + 1e-3)


@EVERY_ACTIVATION
@pytest.mark.parametrize("pure", [False, True])
def test_no_sampled_state_exceeds_what_is_proved(activation: int, pure: bool) -> None:
    model = NetworkModel(HULL, perceptron(activation, size=0.3), 0.1, pure=pure)
    witness = witness_of(model, BOX)
    states = np.random.default_rng(1).uniform(LOW, HIGH, (20000, 3))
    power = witness.power(np.column_stack([states, np.zeros(len(states))]))
    proved = [limit for limit in np.geomspace(0.25, 64.0, 33) if bound_power(model, BOX, limit).proved]
    assert power.max() <= proved[0] < 1.25 * max(highest(model, np.zeros(3)), 0.25), "the steps are of a fifth"


def test_cross_flow_drag_takes_part_in_the_proof() -> None:
    """On its knife edge, with drag across the hull that pays for much of what the network gives."""
    hull = HULL.model_copy(update={"hull": Hull(length=2.0, draught=0.3)}).with_values({"cross_flow": 2.0})
    network = perceptron(1, 64, size=0.5)
    model, without = (NetworkModel(vehicle, network, 0.1) for vehicle in (hull, HULL))
    force = np.zeros(3)
    most, more = highest(model, force), highest(without, force)
    assert 0.01 < most < 0.98 * more
    assert bound_power(model, BOX, 1.02 * most, force).proved
    found = bound_power(model, BOX, 0.98 * most, force)
    assert not found.proved
    assert found.against is not None
    assert not bound_power(without, BOX, 1.02 * most, force).proved


@EVERY_ACTIVATION
def test_a_violation_in_the_weights_is_met(activation: int) -> None:
    """A push ahead in a slot of 0.1 m/s of surge speed about 1.5 m/s, of units that cancel everywhere else."""
    network = perceptron(activation)
    layers = dict(network.named_parameters())
    steep = np.array([20.0, 20.0, 20.0]) / (1.0 if activation == 1 else 0.5)
    rows = (1.45, 1.5, 1.55) if activation == 1 else (1.45, 1.55)
    heights = (1.0, -2.0, 1.0) if activation == 1 else (0.5, -0.5)
    quiet = bound_power(NetworkModel(HULL, network, 0.1), BOX, 0.3)
    with torch.no_grad():
        for k, (at, height) in enumerate(zip(rows, heights, strict=True)):
            layers["body.0.weight"][k] = 0.0
            layers["body.0.weight"][k, 0] = steep[k] * network.scaling.inputs.scale[0]
            layers["body.0.bias"][k] = -steep[k] * at
            layers["head.weight"][0, k] = 2.0 * height / network.scaling.output[0]
    model = NetworkModel(HULL, network, 0.1)
    found = bound_power(model, BOX, 0.3)
    assert quiet.proved
    assert not found.proved
    assert found.against is not None
    assert abs(found.against[0] - 1.5) < 0.1
