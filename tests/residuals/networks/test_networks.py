"""What holds for every network: causality, memory, a quiet start, its options, and energy where it is promised."""

from typing import ClassVar, final

import numpy as np
import pytest
import torch
from networks import weights_of
from places import ROOT
from torch import Tensor, nn

from undertow.measurements.preparation.resampling import Standardisation
from undertow.physics.errors import RequestError
from undertow.physics.momentum_balance import mass_matrix, thruster_matrix
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import scaling_of
from undertow.residuals.networks.base import Memory, Network, Scaling, quiet_head
from undertow.residuals.networks.registry import NETWORKS, build, default_options
from undertow.residuals.networks.trust import Trust

HULL = load_vehicle("otter")
ROWS = 90
EVERY_NETWORK = pytest.mark.parametrize("name", NETWORKS)
WITH_MEMORY = pytest.mark.parametrize("name", ["lstm", "tcn", "transformer", "port_hamiltonian", "ridge"])
LAWFUL = ("dissipative", "port_hamiltonian")


def scaling(heading: bool = False) -> Scaling:
    names = input_names(HULL, heading)
    mean = np.array([0.5, 0.05, -0.02, 20.0, 25.0, *([0.1, -0.2] * heading)])
    scale = np.array([0.6, 0.2, 0.3, 30.0, 28.0, *([0.7, 0.7] * heading)])
    return scaling_of(HULL, Standardisation(names, mean, scale), np.array([0.05, 0.02, 0.08]))


def randomised(network: Network, seed: int = 0, spread: float = 0.3) -> Network:
    """The network with random numbers in every weight, the quiet head included."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for parameter in weights_of(network):
            parameter.copy_(spread * torch.randn(parameter.shape, generator=generator))
    return network.eval()


def inputs(heading: bool = False, batch: int = 2, rows: int = ROWS, seed: int = 1) -> Tensor:
    constants = scaling(heading).inputs
    drawn = np.random.default_rng(seed).normal(size=(batch, rows, len(constants.names)))
    return torch.as_tensor(constants.undo(drawn))


def made(name: str, heading: bool = False) -> Network:
    options = {"filters": 3} if name == "ridge" else None
    return randomised(build(name, scaling(heading), options).double())


@EVERY_NETWORK
def test_the_future_changes_nothing_before_it(name: str):
    network, seen = made(name), inputs()
    changed = seen.clone()
    changed[:, 40:] += 10.0
    with torch.no_grad():
        (before, _), (after, _) = network(seen), network(changed)
    assert torch.equal(before[:, :40], after[:, :40])
    assert (before[:, 40:] != after[:, 40:]).any(dim=-1).all()


@pytest.mark.parametrize("pieces", [[1] * ROWS, [7] * 12 + [6], [61, 29]], ids=["rows", "sevens", "two"])
@EVERY_NETWORK
def test_piece_by_piece_is_the_whole(name: str, pieces: list[int]):
    network, seen = made(name), inputs()
    with torch.no_grad():
        whole, remembered = network(seen)
        said, memory, shapes = [], None, set()
        for piece in seen.split(pieces, dim=1):
            part, memory = network(piece, memory)
            said.append(part)
            shapes.add(tuple(m.shape for m in memory))
    assert torch.cat(said, dim=1).numpy() == pytest.approx(whole.numpy(), abs=1e-12)
    assert len(shapes) == 1, "memories of different age must fit into one batch"
    assert memory is not None
    for one, other in zip(memory, remembered, strict=True):
        assert one.numpy() == pytest.approx(other.numpy(), abs=1e-12)


@WITH_MEMORY
def test_the_past_counts(name: str):
    network, seen = made(name), inputs()
    with torch.no_grad():
        (whole, _), (late, _) = network(seen), network(seen[:, 50:])
    assert (whole[:, 50:52] - late[:, :2]).abs().min() > 1e-6


@pytest.mark.parametrize("name", [name for name, kind in NETWORKS.items() if kind.starts_settled])
def test_before_the_first_row_is_the_first_row(name: str):
    network, seen = made(name), inputs()
    longer = torch.cat((seen[:, :1].expand(-1, 70, -1), seen), dim=1)
    with torch.no_grad():
        (whole, _), (late, _) = network(longer), network(seen)
    assert late.numpy() == pytest.approx(whole[:, 70:].numpy(), abs=1e-12)


@pytest.mark.parametrize("name", [n for n in NETWORKS if n not in LAWFUL])
def test_training_starts_from_the_physics_alone(name: str):
    with torch.no_grad():
        assert not build(name, scaling())(inputs().float())[0].any()


@pytest.mark.parametrize("name", LAWFUL)
def test_the_lawful_ones_start_small_and_nothing_moves_a_boat_at_rest(name: str):
    network = build(name, scaling()).double()
    scale, output = torch.as_tensor(scaling().inputs.scale), torch.as_tensor(scaling().output)
    moving = torch.zeros(3, 1, 5, dtype=torch.float64)
    moving[:, 0, :3] = torch.diag(scale[:3])
    with torch.no_grad():
        said, _ = network(moving)
        rest, _ = network(torch.zeros(1, 1, 5, dtype=torch.float64))
    assert 0.0 < (said.abs() / output).max() < {"dissipative": 0.05, "port_hamiltonian": 0.15}[name]
    assert not rest.any()


@pytest.mark.parametrize("name", [n for n in NETWORKS if not n.startswith("symmetric")])
def test_the_heading_is_seen_where_it_is_asked_for(name: str):
    network, seen = made(name, heading=True), inputs(heading=True)
    turned = seen.clone()
    turned[..., 5:] *= -1.0
    with torch.no_grad():
        assert (network(seen)[0] != network(turned)[0]).any(dim=-1).all()


@EVERY_NETWORK
def test_batches_do_not_mix(name: str):
    network, seen = made(name), inputs(batch=3)
    with torch.no_grad():
        together, _ = network(seen)
        alone, _ = network(seen[1:2])
    assert together[1].numpy() == pytest.approx(alone[0].numpy(), abs=1e-12)


@EVERY_NETWORK
def test_equal_seeds_give_equal_weights(name: str):
    drawn = []
    for _ in range(2):
        torch.manual_seed(5)
        drawn.append(build(name, scaling()).state_dict())
    assert all(torch.equal(drawn[0][key], drawn[1][key]) for key in drawn[0])


@EVERY_NETWORK
def test_the_options_it_was_built_with_are_kept(name: str):
    usual, given = ({"filters": 4}, {"filters": 2}) if name == "ridge" else ({}, {"units": 16})
    network, larger = build(name, scaling(), given), build(name, scaling(), usual)
    assert network.options == default_options(name) | given
    assert sum(p.numel() for p in network.parameters()) < sum(p.numel() for p in larger.parameters())


@pytest.mark.parametrize(
    ("name", "options", "match"),
    [
        ("lstn", {}, r"unknown network 'lstn': did you mean 'lstm'\? There are: dissipative, gp, lstm, mlp, "),
        ("lstm", {"unit": 8}, r"network lstm: unknown option 'unit': did you mean 'units'\? There are: units, layers"),
        ("ridge", {"filters": 7}, r"expected a whole number in \[0, 6\] for filters, got 7"),
        ("mlp", {"units": 0}, r"expected a whole number in \(0, 4096\] for units, got 0"),
        ("mlp", {"activation": 3}, r"expected a whole number in \(0, 2\] for activation, got 3"),
        ("mlp", {"units": 5000}, r"expected a whole number in \(0, 4096\] for units, got 5000"),
        ("tcn", {"kernel": 2.5}, r"network tcn: expected a whole number in \(0, 64\] for kernel, got 2.5"),
        ("tcn", {"layers": True}, r"expected a whole number in \(0, 16\] for layers, got True"),
        ("dissipative", {"gain": float("nan")}, r"expected a number in \(0, 10\] for gain, got nan"),
        ("port_hamiltonian", {"stores": 65}, r"expected a whole number in \(0, 64\] for stores, got 65"),
        ("gp", {"unit": 50}, r"network gp: unknown option 'unit': did you mean 'units'\? There are: units"),
        ("transformer", {"heads": 5}, r"expected units that the heads divide, got 32 units, 5 heads"),
    ],
)
def test_options_are_checked(name: str, options: dict, match: str):
    with pytest.raises(RequestError, match=match):
        build(name, scaling(), options)


@pytest.mark.parametrize("name", ["tcn", "transformer"])
def test_the_shortest_reach_works(name: str):
    shortest = {"tcn": {"kernel": 1}, "transformer": {"window": 1}}[name]
    network = randomised(build(name, scaling(), shortest).double())
    seen = inputs(rows=5)
    with torch.no_grad():
        whole, memory = network(seen)
        again, _ = network(seen[:, 4:], network(seen[:, :4])[1])
    assert all(m.shape[1] == 0 for m in memory)
    assert again.numpy() == pytest.approx(whole[:, 4:].numpy(), abs=1e-12)


def test_the_documents_example_is_a_network():
    page = (ROOT / "docs" / "extending.md").read_text("utf-8")
    names = {"final": final, "ClassVar": ClassVar, "nn": nn, "quiet_head": quiet_head, "Network": Network}
    names |= {"Scaling": Scaling, "Tensor": Tensor, "Memory": Memory}
    exec(page[page.index("@final\nclass GRU") :].split("```")[0], names)
    network, seen = randomised(names["GRU"](scaling()).double()), inputs()
    with torch.no_grad():
        whole, _ = network(seen)
        late, _ = network(seen[:, 40:], network(seen[:, :40])[1])
    assert late.numpy() == pytest.approx(whole[:, 40:].numpy(), abs=1e-12)


# The network that cannot create energy


@pytest.mark.parametrize("seed", range(4))
def test_its_correction_takes_energy_out_at_every_state(seed: int):
    network = randomised(
        build("dissipative", scaling(), {"units": 32}).double(), seed, spread=(0.1, 0.5, 1.0, 3.0)[seed]
    )
    rng = np.random.default_rng(seed)
    velocity = 10.0 ** rng.uniform(-3.0, 1.5, (250_000, 1)) * rng.normal(size=(250_000, 3))
    seen = torch.zeros(250_000, 1, 5, dtype=torch.float64)
    seen[:, 0, :3] = torch.as_tensor(velocity)
    with torch.no_grad():
        said = network(seen)[0][:, 0].numpy()
    force = said @ mass_matrix(HULL)
    power = (velocity * force).sum(axis=1)
    size = (np.abs(velocity) * np.abs(force)).sum(axis=1)
    assert np.abs(force).max() > 1.0, "a network that says nothing proves nothing"
    assert (power > 1e-12 * size).sum() == 0
    assert (power < -1e-6 * size).mean() > 0.9


def test_where_it_has_no_damping_no_energy_is_made_either():
    network = randomised(build("dissipative", scaling(), {"units": 32}).double(), spread=1.0)
    assert isinstance(network.factor, nn.Linear)
    velocity = np.random.default_rng(1).normal(size=(10_000, 3))
    seen = torch.zeros(10_000, 1, 5, dtype=torch.float64)
    seen[:, 0, :3] = torch.as_tensor(velocity)
    with torch.no_grad():
        network.factor.weight.zero_()
        network.factor.bias.zero_()
        force = network(seen)[0][:, 0].numpy() @ mass_matrix(HULL)
    size = (np.abs(velocity) * np.abs(force)).sum(axis=1)
    assert size.min() > 1e-3
    assert (np.abs((velocity * force).sum(axis=1)) < 1e-12 * size).all()


def test_the_dissipative_network_as_it_is_shipped_creates_no_energy_in_a_million_states():
    network = randomised(build("dissipative", scaling(), {"units": 32}), spread=1.0)
    velocity = np.random.default_rng(2).normal(size=(1_000_000, 3)).astype(np.float32)
    seen = torch.zeros(1_000_000, 1, 5)
    seen[:, 0, :3] = torch.as_tensor(velocity)
    with torch.no_grad():
        said = network(seen)[0][:, 0].double().numpy()
    assert int((((velocity.astype(float) @ mass_matrix(HULL)) * said).sum(axis=1) > 0).sum()) == 0


def test_its_drive_is_bounded_and_reaches_the_bound():
    gain = 0.3
    network = build("dissipative", scaling(), {"gain": gain, "units": 8}).double()
    assert isinstance(network.drive, nn.Linear)
    most = np.maximum(np.abs(thruster_matrix(HULL)).max(axis=1), (1.0, 0.1, 0.0))
    thrust = np.random.default_rng(3).uniform(-60.0, 60.0, (1000, 2))
    seen = torch.zeros(1000, 1, 5, dtype=torch.float64)
    seen[:, 0, 3:] = torch.as_tensor(thrust)
    for bias in (-50.0, 0.4, 50.0):
        with torch.no_grad():
            network.drive.bias.fill_(bias)
            force = network(seen)[0][:, 0].numpy() @ mass_matrix(HULL)
        expected = np.tanh(bias) * gain * most * thrust.sum(axis=1, keepdims=True)
        assert force == pytest.approx(expected, rel=1e-6)
    randomised(network, spread=5.0)
    with torch.no_grad():
        force = network(seen)[0][:, 0].numpy() @ mass_matrix(HULL)
    assert (np.abs(force) <= 1.000001 * gain * most * np.abs(thrust).sum(axis=1, keepdims=True)).all()


# The network whose stores give back at most what they took


@pytest.mark.parametrize("fades", [False, True], ids=["", "fading"])
@pytest.mark.parametrize("seed", range(3))
def test_hull_and_stores_together_only_lose_energy(seed: int, fades: bool):
    """At every row without thrust nu^T M a + V_k - V_(k-1) + |y_k|^2 <= 0, V = a |y|^2 / (2 (1 - a)) of each store."""
    network = randomised(build("port_hamiltonian", scaling(), {"units": 16}).double(), seed, spread=0.5)
    with torch.no_grad():  # no damping beside the stores, which would hide what they give back
        for parameter in network.get_submodule("factor").parameters():
            parameter.zero_()
        network.get_parameter("kept").copy_(torch.linspace(1.5, 4.0, 12))
    if fades:
        network.trust(Trust.within(np.random.default_rng(seed).normal(0.0, 0.5, (50, 5)), 2.0))
    seen = torch.zeros(3, ROWS, 5, dtype=torch.float64)
    phase = torch.as_tensor(np.random.default_rng(seed).uniform(0.0, 6.0, (3, 1, 3)))
    seen[..., :3] = torch.sin(0.2 * torch.arange(ROWS)[:, None] + phase) * torch.tensor([1.2, 0.4, 0.6])
    kept, memory = torch.sigmoid(network.get_parameter("kept")), None
    stored, forces = [], []
    with torch.no_grad():
        for row in seen.split(1, dim=1):
            said, memory = network(row, memory)
            forces.append(said[:, 0] @ torch.as_tensor(mass_matrix(HULL)))
            stored.append(memory[0])
        y, force = torch.stack(stored, dim=1), torch.stack(forces, dim=1)
        energy = (kept / (2.0 * (1.0 - kept)) * y.square()).sum(dim=-1)
        power = (seen[..., :3] * force).sum(dim=-1)
        lost = power[:, 1:] + energy.diff(dim=1) + y[:, 1:].square().sum(dim=-1)
        size = power[:, 1:].abs() + energy[:, 1:] + energy[:, :-1] + y[:, 1:].square().sum(dim=-1)
    assert (power > 1e-3 * size.max()).any(), "where stores give nothing back there is nothing to see"
    assert (lost <= 1e-12 * size).all()


def test_its_stores_give_back_what_they_took():
    network = build("port_hamiltonian", scaling(), {"units": 4, "stores": 3}).double()
    with torch.no_grad():
        for name, parameter in network.named_parameters():
            parameter.fill_(2.0 if name == "kept" else 0.0)
        network.get_parameter("ports.bias").copy_(torch.eye(3).flatten())
        moving, still = torch.zeros(1, 30, 5, dtype=torch.float64), torch.zeros(1, 30, 5, dtype=torch.float64)
        moving[..., 0] = 1.0
        braked, memory = network(moving, (torch.zeros(1, 3, dtype=torch.float64),))
        pushed, _ = network(still, memory)
    assert (braked[..., 0] < 0.0).all()
    assert braked[0, 0, 0] > braked[0, -1, 0]
    assert (pushed[..., 0] < 0.0).all()  # water that still runs back past the hull
    kept = torch.sigmoid(torch.tensor(2.0, dtype=torch.float64))
    assert pushed[0, 1, 0] / pushed[0, 0, 0] == pytest.approx(float(kept), rel=1e-6)


# The network that is the same on both sides


def image(seen: Tensor) -> Tensor:
    turned = seen * torch.tensor([1.0, -1.0, -1.0, 1.0, 1.0])
    return turned[..., [0, 1, 2, 4, 3]]


@pytest.mark.parametrize("name", ["symmetric", "symmetric_gp"])
@pytest.mark.parametrize("fades", [False, True], ids=["", "fading"])
def test_it_is_the_same_to_port_and_to_starboard(fades: bool, name: str):
    """So it is where it has seen turns to one side only."""
    rows = inputs(rows=400).flatten(0, 1).numpy()
    rows[:, 2] = np.abs(rows[:, 2])
    names = input_names(HULL, False)
    constants = Standardisation.of(names, NETWORKS[name].alike(rows, thruster_matrix(HULL)))
    network = randomised(build(name, scaling_of(HULL, constants, scaling().output)).double())
    if fades:
        network.trust(Trust.within(network.known(constants.apply(rows[:200])), 1.0))
    seen = torch.as_tensor(rows)[None]
    with torch.no_grad():
        said, other = network(seen)[0], network(image(seen))[0]
    assert (said.abs().mean(dim=(0, 1)) > 1e-3).all()
    assert other.numpy() == pytest.approx((said * torch.tensor([1.0, -1.0, -1.0])).numpy(), abs=1e-6)
    if fades:
        left = network.gain(torch.as_tensor(constants.apply(rows)))  # type: ignore[misc]
        assert 0.0 < float((left == 1.0).double().mean()) < 1.0


@pytest.mark.parametrize("name", ["symmetric", "symmetric_gp"])
def test_it_is_the_force_that_is_symmetric(name: str):
    ballast, seen = HULL.with_values({"y_g": 0.1}), inputs()
    rows = seen.flatten(0, 1).numpy()
    constants = Standardisation.of(input_names(HULL, False), NETWORKS[name].alike(rows, thruster_matrix(HULL)))
    own = Scaling(constants, scaling().output, mass_matrix(ballast), thruster_matrix(HULL))
    network = randomised(build(name, own).double())
    mass = torch.as_tensor(mass_matrix(ballast))
    with torch.no_grad():
        force, other = (network(x)[0] @ mass for x in (seen, image(seen)))
    assert other.numpy() == pytest.approx((force * torch.tensor([1.0, -1.0, -1.0])).numpy(), rel=1e-4, abs=1e-4)


def test_it_says_nothing_at_rest():
    with torch.no_grad():
        assert made("symmetric")(torch.zeros(1, 1, 5, dtype=torch.float64))[0].abs().max() < 1e-15


@pytest.mark.parametrize("layers", [1, 3])
def test_it_is_one_perceptron(layers: int):
    network = randomised(build("symmetric", scaling(), {"units": 8, "layers": layers}).double())
    network.trust(Trust.within(np.random.default_rng(0).normal(0.0, 0.5, (50, 5)), 2.0))
    with torch.no_grad():
        whole, plain = network(inputs())[0], network.plain()(inputs())[0]
    assert plain.numpy() == pytest.approx(whole.numpy(), abs=1e-12)


def test_making_it_plain_draws_no_numbers():
    network, before = made("symmetric"), torch.random.get_rng_state()
    network.plain()
    assert torch.equal(torch.random.get_rng_state(), before)


@pytest.mark.parametrize("name", ["symmetric", "symmetric_gp"])
def test_it_wants_no_heading_and_thrusters_in_pairs(name: str):
    with pytest.raises(RequestError, match=f"{name}: expected no heading"):
        build(name, scaling(heading=True))
    constants = scaling()
    lonely = Scaling(constants.inputs, constants.output, constants.mass, constants.reach * np.array([1.0, 0.5]))
    with pytest.raises(RequestError, match="expected each thruster to have a partner"):
        build(name, lonely)


def test_a_thruster_on_the_keel_that_pushes_aside_is_its_own_partner():
    ship = load_vehicle("cybership2")
    names = input_names(ship, False)
    own = scaling_of(ship, Standardisation(names, np.zeros(len(names)), np.ones(len(names))), scaling().output)
    rows = np.random.default_rng(4).normal(size=(20, len(names)))
    both = NETWORKS["symmetric"].alike(rows, own.reach)
    forces = own.reach @ both[:, 3:].T
    assert forces[:, 20:] == pytest.approx(forces[:, :20] * np.array([[1.0], [-1.0], [-1.0]]), abs=1e-9)
