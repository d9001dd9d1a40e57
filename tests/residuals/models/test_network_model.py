"""A network as a model: against the vehicle's own rollouts, closed forms of linear maps, and its own memory."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from networks import weights_of
from torch import Tensor

from undertow.measurements.preparation.prepare import PAPER, WEAK, DataSet
from undertow.measurements.preparation.resampling import Standardisation
from undertow.physics.errors import RequestError
from undertow.physics.integration import Driven, integrate
from undertow.physics.motion import Array, Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.network_inputs import input_names, network_inputs
from undertow.residuals.models.network_model import NetworkModel, scaling_of
from undertow.residuals.networks.base import Memory, Network
from undertow.residuals.networks.registry import NETWORKS, build
from undertow.residuals.scores import acceleration_score, rollout_scores

HULL = load_vehicle("blueboat")
STEP = 0.1


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate_world(HULL, {}, duration=90.0, noise="clean", seed=4).motion(STEP)


def standardised(vehicle: Vehicle, heading: bool = False) -> Standardisation:
    names = input_names(vehicle, heading)
    return Standardisation(names, np.linspace(0.1, 0.4, len(names)), np.linspace(0.5, 2.0, len(names)))


def network_model(name: str, vehicle: Vehicle = HULL, spread: float | None = None, **settings) -> NetworkModel:
    """A model in double precision with random weights, small enough not to diverge; `spread` 0 for none at all."""
    usual = {"tcn": 0.15, "dissipative": 0.05, "port_hamiltonian": 0.05, "ridge": 0.001}.get(name, 0.3)
    size = usual if spread is None else spread
    heading = settings.pop("heading", False)
    network = build(name, scaling_of(vehicle, standardised(vehicle, heading), np.array([0.2, 0.1, 0.2])))
    generator = torch.Generator().manual_seed(7)
    with torch.no_grad():
        for parameter in weights_of(network):
            parameter.copy_(torch.randn(parameter.shape, generator=generator) * size)
    return NetworkModel(vehicle, network.double(), STEP, **settings)


class Linear(Network):
    """The correction is `gains` (3, inputs) times the inputs plus `offset` (3,), in SI units."""

    name = "linear"

    def __init__(self, vehicle: Vehicle, gains: Array, offset: Array | float = 0.0, heading: bool = False) -> None:
        super().__init__(scaling_of(vehicle, standardised(vehicle, heading), np.array([0.2, 0.1, 0.2])), {})
        self.double()
        constants = self.scaling.inputs
        self.input_mean, self.input_scale = torch.as_tensor(constants.mean), torch.as_tensor(constants.scale)
        self.output_scale = torch.as_tensor(self.scaling.output)
        size = self.scaling.output[:, None]
        self.gains = torch.as_tensor(gains * constants.scale / size)
        self.offset = torch.as_tensor((gains @ constants.mean + offset) / size[:, 0])

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        return standardised @ self.gains.T + self.offset, ()


def still(rows: int, step: float = STEP, heading: float = 0.0, vehicle: Vehicle = HULL) -> Motion:
    """A measured motion at rest, without commands."""
    n, thrusters = rows, tuple(t.name for t in vehicle.thrusters)
    return Motion(
        step * np.arange(n, dtype=float),
        np.zeros((n, 2)),
        np.full(n, heading),
        np.zeros((n, 3)),
        np.zeros((n, len(thrusters))),
        thrusters,
    )


def moving(rows: int, velocity: tuple[float, float, float], step: float = STEP, heading: float = 0.0) -> Motion:
    return replace(still(rows, step, heading), velocity=np.tile(np.asarray(velocity), (rows, 1)))


def decay(rate: float) -> Array:
    gains = np.zeros((3, 5))
    gains[0, 0] = -rate
    return gains


# The scheme


@pytest.mark.parametrize("name", [n for n in NETWORKS if n != "dissipative"])
def test_a_network_that_says_nothing_rolls_out_as_its_vehicle(name: str, motion: Motion):
    vehicle = HULL.with_values({"memory_sway": 5.0, "memory_time": 2.0, "current_north": 0.2, "advance_loss": 4.0})
    starts = np.array([0, 3, 250, 100, 600])
    ours = network_model(name, vehicle, spread=0.0).rollout(motion, starts, 100)
    theirs = VehicleModel(vehicle, "physics").rollout(motion, starts, 100)
    assert ours.states == pytest.approx(theirs.states, abs=1e-12)
    assert not ours.diverged.any()


def test_a_pure_network_that_says_nothing_keeps_its_speed():
    rolled = network_model("mlp", spread=0.0, pure=True).rollout(moving(60, (1.5, 0.2, 0.0)), np.array([0, 5]), 50)
    assert rolled.states[..., 3:] == pytest.approx(np.broadcast_to((1.5, 0.2, 0.0), (2, 51, 3)), abs=1e-12)
    assert rolled.states[:, -1, 0] == pytest.approx(5.0 * 1.5)


def test_a_pure_linear_map_follows_adams_and_bashforth_exactly():
    model = NetworkModel(HULL, Linear(HULL, decay(0.8), np.array([0.3, 0.0, 0.0])), STEP, pure=True)
    speeds, before = [1.2], None
    for _ in range(100):
        now = 0.3 - 0.8 * speeds[-1]
        speeds.append(speeds[-1] + STEP * (now if before is None else 1.5 * now - 0.5 * before))
        before = now
    rolled = model.rollout(moving(101, (1.2, 0.0, 0.0)), np.array([0]), 100).states[0]
    assert rolled[:, 3] == pytest.approx(np.array(speeds), abs=1e-12)


def errors_by_step(vehicle: Vehicle | None, steps: tuple[float, ...], rate: float = 0.8) -> list[float]:
    """Largest error of speed over 6 s against the exact solution, by time step."""
    found = []
    for step in steps:
        rows = round(6.0 / step) + 1
        motion = moving(rows, (1.2, 0.0, 0.0), step)
        model = NetworkModel(vehicle or HULL, Linear(HULL, decay(rate)), step, pure=vehicle is None)
        speeds = model.rollout(motion, np.array([0]), rows - 1).states[0, :, 3]
        if vehicle is None:
            exact = 1.2 * np.exp(-rate * motion.time)
        else:  # u' = -d u |u| - rate u, a Bernoulli equation
            d = 8.0 / 33.5
            exact = rate / ((rate / 1.2 + d) * np.exp(rate * motion.time) - d)
        found.append(float(np.abs(speeds - exact).max()))
    return found


@pytest.mark.parametrize("physics", [False, True], ids=["pure", "hybrid"])
def test_the_correction_is_of_second_order_beside_the_closed_form(physics: bool):
    vehicle = HULL.with_values({"X_u": 0.0}) if physics else None
    coarse, middle, fine = errors_by_step(vehicle, (0.1, 0.05, 0.025))
    assert coarse < 5e-3
    assert coarse / middle == pytest.approx(4.0, rel=0.2)
    assert middle / fine == pytest.approx(4.0, rel=0.1)


def test_the_network_sees_the_thrust_of_each_row():
    rows = 51
    gains = np.zeros((3, 5))
    gains[0, 3], gains[1, 4] = 0.05, 0.02
    commands = np.column_stack([np.linspace(0.0, 20.0, rows), np.full(rows, -10.0)])
    model = NetworkModel(HULL, Linear(HULL, gains), STEP, pure=True)
    rolled = model.rollout(replace(still(rows), commands=commands), np.array([0]), rows - 1).states[0]
    time_ = STEP * np.arange(rows)
    # Adams-Bashforth integrates a ramp exactly but for its first step, which is held at its beginning.
    lost = 0.5 * STEP * 0.05 * (commands[1, 0] - commands[0, 0])
    assert rolled[1:, 3] == pytest.approx(0.05 * 2.0 * time_[1:] ** 2 - lost, abs=1e-12)
    assert rolled[:, 4] == pytest.approx(-0.2 * time_, abs=1e-12)


def test_the_network_sees_the_simulated_heading():
    rows, rate = 401, 0.5
    gains = np.zeros((3, 7))
    gains[0, 5], gains[1, 6] = 0.3, 0.3
    motion = replace(moving(rows, (0.0, 0.0, rate), 0.02, heading=0.4), time=0.02 * np.arange(rows))
    model = NetworkModel(HULL, Linear(HULL, gains, heading=True), 0.02, pure=True)
    rolled = model.rollout(motion, np.array([0]), rows - 1).states[0]
    psi = 0.4 + rate * motion.time  # the measured heading stays at 0.4
    assert rolled[:, 2] == pytest.approx(psi, abs=1e-9)
    assert rolled[:, 3] == pytest.approx(0.3 * (np.sin(psi) - np.sin(0.4)) / rate, abs=2e-3)
    assert rolled[:, 4] == pytest.approx(0.3 * (np.cos(0.4) - np.cos(psi)) / rate, abs=2e-3)


def test_the_network_sees_the_speed_through_the_water():
    vehicle = HULL.with_values({"current_north": 0.4})
    model = NetworkModel(vehicle, Linear(vehicle, decay(1.0)), STEP, pure=True)
    rolled = model.rollout(still(301), np.array([0]), 300).states[0]
    assert rolled[-1, 3] == pytest.approx(0.4, abs=1e-6)


def test_inputs_are_the_state_and_the_thrust(motion: Motion):
    seen = network_inputs(HULL, motion, heading=True)
    names = input_names(HULL, heading=True)
    assert names == ("u", "v", "r", "thrust_port", "thrust_stbd", "cos_psi", "sin_psi")
    assert seen[:, :3] == pytest.approx(motion.velocity)
    assert seen[:, 3:5] == pytest.approx(motion.commands, abs=0.2)  # newtons, at rest
    assert seen[:, 5:] == pytest.approx(np.column_stack([np.cos(motion.heading), np.sin(motion.heading)]))


# Memory


@pytest.mark.parametrize(
    ("name", "heading"), [(n, h) for n in NETWORKS for h in (False, True) if not (h and n.startswith("symmetric"))]
)
def test_a_rollout_begins_with_what_the_network_says_there(name: str, heading: bool, motion: Motion):
    model = network_model(name, pure=True, heading=heading)
    starts = np.array([430, 0, 1, 29, 430, 600])
    rolled = model.rollout(motion, starts, 1).states
    said = (rolled[:, 1, 3:] - rolled[:, 0, 3:]) / STEP
    assert said == pytest.approx(model.acceleration(motion)[starts], abs=1e-11)


@pytest.mark.parametrize("name", NETWORKS)
def test_a_rollout_goes_on_as_the_network_would_along_its_own_path(name: str, motion: Motion):
    model = network_model(name)
    start, steps = 200, 120
    states = model.rollout(motion, np.array([7, start, 333]), steps).states[1]
    path = np.column_stack([motion.position, motion.heading, motion.velocity])
    path[start : start + steps + 1] = states
    walked = replace(motion, position=path[:, :2], heading=path[:, 2], velocity=path[:, 3:])
    said = model.correction(walked)[start : start + steps]
    held = np.concatenate([said[:1], 1.5 * said[1:] - 0.5 * said[:-1]])

    def replayed(k: int, state: Array) -> Array:
        return held[k][:, None]

    act = np.stack([walked.commands.T[:, start : start + steps + 1]], axis=-1)
    again = integrate(Driven(HULL, states[:1], act, np.zeros_like(act)), STEP, replayed).states[0]
    assert again == pytest.approx(states, abs=1e-9)


def test_the_measured_history_counts(motion: Motion):
    for name, counts in (("lstm", True), ("tcn", True), ("transformer", True), ("mlp", False)):
        model = network_model(name)
        warm = model.rollout(motion, np.array([300]), 50).states[0, :, 3:]
        cold = model.rollout(motion.slice(300, motion.time.size), np.array([0]), 50).states[0, :, 3:]
        assert (np.abs(warm - cold).max() > 1e-6) == counts, name


@pytest.mark.parametrize("name", NETWORKS)
def test_a_start_does_not_depend_on_the_others(name: str, motion: Motion):
    model = network_model(name)
    together = model.rollout(motion, np.array([500, 20, 0, 20]), 30).states
    assert together[0] == pytest.approx(model.rollout(motion, np.array([500]), 30).states[0], abs=1e-10)
    assert together[3] == pytest.approx(together[1], abs=0.0)
    assert together[2] == pytest.approx(model.rollout(motion, np.array([0]), 30).states[0], abs=1e-10)


@pytest.mark.parametrize("name", NETWORKS)
def test_a_long_motion_goes_through_in_blocks(name: str, motion: Motion):
    model = network_model(name)
    seen = model.tensor(network_inputs(HULL, motion, heading=False))[None]
    assert seen.shape[1] > 3 * 256
    with torch.no_grad():
        whole = model.network(seen)[0][0].numpy()
    assert model.correction(motion) == pytest.approx(whole, abs=1e-12)


# As a model


def test_hybrid_and_pure_are_told_apart(motion: Motion):
    hybrid, pure = network_model("mlp"), network_model("mlp", pure=True)
    assert (hybrid.kind, hybrid.name) == ("hybrid", "hybrid mlp")
    assert (pure.kind, pure.name) == ("network", "pure mlp")
    assert hybrid.parameters == 5 * 128 + 128 + 128 * 3 + 3
    assert pure.acceleration(motion) == pytest.approx(hybrid.correction(motion), abs=0.0)
    physics = VehicleModel(HULL, "physics").acceleration(motion)
    assert hybrid.acceleration(motion) - physics == pytest.approx(hybrid.correction(motion), abs=1e-12)


def test_another_rate_is_refused(motion: Motion):
    fast = still(100, 0.05)
    match = r"hybrid lstm: expected rows 0\.1 s apart, .* got 0\.05 s; prepare the log at 10 Hz, or train .* at 20 Hz"
    model = network_model("lstm")
    for ask in (model.acceleration, model.correction, lambda m: model.rollout(m, np.array([0]), 5)):
        with pytest.raises(RequestError, match=match):
            ask(fast)
    assert model.correction(still(20, 0.1005)).shape == (20, 3)
    with pytest.raises(RequestError, match="expected rows"):
        model.correction(still(20, 0.102))


def test_starts_without_room_are_refused(motion: Motion):
    with pytest.raises(RequestError, match="rollout of 50 steps: starts must lie in"):
        network_model("lstm").rollout(motion, np.array([motion.time.size - 10]), 50)
    with pytest.raises(RequestError, match="starts must lie in"):
        network_model("lstm").rollout(motion, np.array([-1]), 5)


def test_it_is_scored_as_every_model(motion: Motion):
    data = DataSet((motion,), (), WEAK)
    silent, physics = network_model("lstm", spread=0.0), VehicleModel(HULL, "physics")
    assert acceleration_score(silent, data).record == acceleration_score(physics, data).record
    ours, theirs = rollout_scores(silent, data), rollout_scores(physics, data)
    assert {h: s.starts for h, s in ours.items()} == {h: s.starts for h, s in theirs.items()}
    assert PAPER.rate == 1.0 / STEP


@pytest.mark.parametrize("rate", [-8.0, -4000.0])
def test_a_runaway_is_counted_and_held(rate: float):
    model = NetworkModel(HULL, Linear(HULL, decay(rate)), STEP, pure=True)
    rolled = model.rollout(moving(200, (1.0, 0.0, 0.0)), np.array([0, 10]), 150)
    assert rolled.diverged.all()
    assert np.isfinite(rolled.states).all()
    assert np.abs(rolled.states[..., 3:]).max() <= 50.0


@pytest.mark.parametrize("name", ["lstm", "tcn", "transformer"])
def test_a_batch_of_rollouts_asks_the_network_for_all_starts_at_once(
    name: str, motion: Motion, monkeypatch: pytest.MonkeyPatch
):
    network = build(name, scaling_of(HULL, standardised(HULL), np.array([0.2, 0.1, 0.2])))
    correct, asked = network.correct, []
    monkeypatch.setattr(network, "correct", lambda *words: asked.append(1) or correct(*words))
    NetworkModel(HULL, network, STEP).rollout(motion, np.arange(100), 30)
    assert 30 < len(asked) <= 2 * (100 + 30), "at most twice a row, measured or simulated"
