"""Training: laws, windows, filter, losses, rollouts, recipe, determinism and resume."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from envelopes import encloses
from training_parts import HULL, fresh, parts_of

from undertow.comparison.audit import audit, witness_of
from undertow.measurements.preparation.prepare import PAPER, DataSet
from undertow.measurements.preparation.resampling import low_pass, smooth
from undertow.measurements.preparation.split import Split, split
from undertow.physics.errors import RequestError
from undertow.physics.forces import ForceEquation, modelled_acceleration
from undertow.physics.laws.audit.thrust import driven_power
from undertow.physics.laws.damping_power import Envelope, damping_power, envelope_of
from undertow.physics.laws.energy import (
    MARGIN,
    TOLERANCE,
    coasting_power,
    coasting_states,
    full_force,
    let_pass,
    surplus,
    thrust_power,
)
from undertow.physics.momentum_balance import coriolis_matrix, mass_matrix
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.models.neural import CHECKPOINT
from undertow.residuals.models.unforced_states import UnforcedStates
from undertow.residuals.networks.base import Network
from undertow.residuals.networks.registry import NETWORKS, default_options
from undertow.residuals.scores import acceleration_score, rollout_scores
from undertow.residuals.training import epochs, preparation
from undertow.residuals.training.checkpoint import Verdict
from undertow.residuals.training.epochs import Trained, train
from undertow.residuals.training.history import Epoch, best_epochs, stale
from undertow.residuals.training.training_settings import Augmentation, Choice, TrainingSettings
from undertow.residuals.training.windows import filter_taps, windows_of

BOX = Envelope((-1.0, -0.6, -1.1), (2.2, 0.6, 1.1))
QUICK = TrainingSettings(epochs=8, learning_rate=1e-2, trust=False)
"""Without the probes that tell how far a correction is trusted, which are as many trainings more."""


@pytest.fixture(scope="module")
def dragged() -> Split:
    """A world with quadratic drag and lift that the nominal model lacks."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0})


@pytest.fixture(scope="module")
def brief() -> Split:
    """A minute of it, for what is asked of how a training goes and not of what it learns."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0}, seconds=60.0)


def weights(found: Trained) -> bytes:
    return b"".join(value.numpy().tobytes() for value in found.model.network.state_dict().values())


# The laws


def test_the_surplus_is_that_of_its_definition_for_arrays_and_tensors() -> None:
    power, driven = np.array([-3.0, 2.0, 2.0, 5.0, 1.0]), np.array([0.0, 0.0, 2.0, 2.0, -4.0])
    expected = [0.0, 2.0, 0.0, 5.0 - 2.0 * MARGIN, 1.0]
    assert surplus(power, driven).tolist() == expected
    assert surplus(torch.tensor(power), torch.tensor(driven)).tolist() == expected


@pytest.mark.parametrize(("beyond", "verdict"), [(1e-6, True), (-1e-6, False)])
def test_the_verdict_turns_on_the_knife_edge(beyond: float, verdict: bool) -> None:
    scale, driven = 7.0, 3.0
    edge = MARGIN * driven + TOLERANCE * scale
    assert bool(surplus(np.array(edge + beyond), driven) > TOLERANCE * scale) is verdict
    assert bool(surplus(np.array(TOLERANCE * scale + beyond)) > TOLERANCE * scale) is verdict


def test_coasting_power_is_what_damping_takes_out() -> None:
    states = coasting_states(Envelope((-1.0, -0.6, -1.1), (2.2, 0.6, 1.1)), 400)
    equation = ForceEquation(HULL)
    triple = tuple(states.T)
    force = equation.force(triple, np.zeros(400), np.zeros((2, 400)))
    acceleration = np.stack(equation.acceleration(force, triple, triple, np.zeros(400)), axis=-1)
    mass = mass_matrix(HULL)
    power = coasting_power(mass, states, acceleration)
    np.testing.assert_allclose(power, damping_power(HULL, states), atol=1e-12 * np.abs(power).max())
    turned = (coriolis_matrix(HULL, states) @ states[..., None])[..., 0]
    assert np.abs((turned * states).sum(-1)).max() < 1e-9
    tensors = coasting_power(*(torch.as_tensor(x) for x in (mass, states, acceleration)))
    np.testing.assert_allclose(tensors.numpy(), power)
    assert not (surplus(power) > 1.0).any()


def test_states_cover_the_box_rays_and_single_axes() -> None:
    box = Envelope((-1.0, -0.6, -1.1), (2.2, 0.6, 1.1))
    states = coasting_states(box, 4000)
    assert encloses(box, states)
    assert ((states != 0).sum(axis=1) == 1).sum() == 1000
    for axis in range(3):
        alone = states[(states != 0).sum(axis=1) == 1][:, axis]
        assert (alone > 0).any()
        assert (alone < 0).any()
    assert (np.abs(states).max(axis=1) < 0.05).sum() > 50
    assert (coasting_states(box, 50, seed=1) != coasting_states(box, 50, seed=2)).any()


def test_the_power_of_thrusters_balances_a_simulated_motion(dragged: Split) -> None:
    motion = dragged.train.motions[0]
    total = coasting_power(mass_matrix(HULL), motion.velocity, modelled_acceleration(HULL, motion))
    np.testing.assert_allclose(total, thrust_power(HULL, motion) + damping_power(HULL, motion.velocity), atol=1e-9)
    assert surplus(total, thrust_power(HULL, motion)).max() < 1e-9


def engine(split_: Split, push: float) -> tuple[UnforcedStates, Network]:
    """A network that pushes ahead with this acceleration for each m/s ahead, and states to ask it."""
    network = fresh("mlp", split_).float()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.zero_()
        mean, scale = network.get_buffer("input_mean")[0], network.get_buffer("input_scale")[0]
        first = network.body[0]  # type: ignore[index]
        first.weight[0, 0], first.bias[0] = scale, mean  # type: ignore[index, union-attr]
        network.head.weight[0, 0] = push / 0.1  # type: ignore[union-attr, index]
    states = np.tile([1.0, 0.0, 0.0], (4, 1))
    like = next(network.parameters())
    settings = {"pure": False, "heading": False, "time_step": 0.1, "settles": False}
    return UnforcedStates(HULL, states, **settings, like=like), network  # type: ignore[arg-type]


@pytest.mark.parametrize(("beyond", "share"), [(1e-4, 1.0), (-1e-4, 0.0)])
def test_a_network_that_pushes_more_than_the_drag_creates_energy(dragged: Split, beyond: float, share: float) -> None:
    mass = mass_matrix(HULL)[0, 0]
    drag = -float(damping_power(HULL, np.array([1.0, 0.0, 0.0])))
    allowed = float(let_pass(full_force(HULL), np.array([1.0, 0.0, 0.0])))
    coasting, network = engine(dragged, (drag + allowed + beyond) / mass)
    assert coasting.violating_share(network) == pytest.approx(0.8 * share), "four states, and rest"


@pytest.mark.parametrize(("beyond", "share"), [(1e-3, True), (-1e-3, False)])
def test_a_push_at_rest_counts_in_training_as_in_the_audit(dragged: Split, beyond: float, share: bool) -> None:
    coasting, network = engine(dragged, 0.0)
    limit = TOLERANCE * float(full_force(HULL)[0] / mass_matrix(HULL)[0, 0])
    with torch.no_grad():
        network.head.bias[0] = limit * (1.0 + beyond) / 0.1  # type: ignore[union-attr, index]
    assert float(coasting.push(network)[0, 0].detach()) == pytest.approx(TOLERANCE * (1.0 + beyond), rel=1e-5)
    assert (coasting.violating_share(network) > 0.0) is share
    found = audit(NetworkModel(HULL, network, 0.1), BOX)
    assert (found.ruling("rest stays at rest").verdict == "fail") is share


@pytest.mark.parametrize("pure", [False, True])
def test_training_asks_for_the_power_that_the_audit_asks_for(dragged: Split, pure: bool) -> None:
    boat = HULL.with_values(
        {"current_north": 0.3, "wind_force_east": 4.0, "yaw_trim": 1.0, "advance_loss": 6.0, "memory_sway": 20.0}
    )
    network = fresh("mlp", dragged, boat)
    rng = np.random.default_rng(3)
    states, commands = coasting_states(BOX, 60), rng.uniform(-35.0, 35.0, (60, 2))
    ask = {"pure": pure, "heading": False, "time_step": 0.1, "settles": False}
    coasting = UnforcedStates(boat, states, commands, **ask, like=next(network.parameters()))  # type: ignore[arg-type]
    witness = witness_of(NetworkModel(boat, network, 0.1, pure=pure), BOX)
    heading = np.random.default_rng(7).uniform(-np.pi, np.pi, 60)  # as `UnforcedStates` draws it
    placed = np.column_stack([states, heading, commands])
    power = coasting_power(witness.mass, states, witness.relative(placed[:, :4], commands))
    np.testing.assert_allclose(coasting.power(network).detach().numpy(), power, rtol=1e-6, atol=1e-6)
    allowed = np.maximum(driven_power(witness, placed), witness.allowed(placed))
    np.testing.assert_allclose(coasting.allowed.numpy(), allowed, rtol=1e-6)
    at_rest = witness.relative(np.column_stack([0.0 * states, heading]))
    pushed = coasting.push(network).detach().numpy() * np.ones((60, 1))
    np.testing.assert_allclose(pushed, at_rest / witness.full_force * np.diag(witness.mass), rtol=1e-5, atol=1e-7)


# Windows and the filter


def test_the_taps_are_the_filter_away_from_the_ends(dragged: Split) -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(size=(300, 3))
    taps = filter_taps(PAPER, 0.1)
    reach = taps.size // 2
    ours = np.stack([np.convolve(column, taps, mode="valid") for column in values.T], axis=1)
    exact = low_pass(values, 0.1, 1.2)[reach:-reach]
    inside = slice(60, -60)
    assert np.abs(ours - exact)[inside].max() < 5e-3 * np.abs(exact).max()
    assert taps.sum() == pytest.approx(1.0)
    assert taps == pytest.approx(taps[::-1])
    assert filter_taps(replace(PAPER, cutoff=None), 0.1).tolist() == [1.0]


def test_the_filter_matrix_is_the_taps_row_by_row(dragged: Split) -> None:
    windows = windows_of(dragged.train, HULL, pure=True, heading=False, seconds=10.0, warm_up=2.0)
    taps = filter_taps(PAPER, 0.1)
    values = np.random.default_rng(1).normal(size=(100, 3))
    whole = np.stack([np.convolve(column, taps, mode="valid") for column in values.T], axis=1)
    np.testing.assert_allclose(windows.filter_matrix(taps) @ values, whole[windows.first :], atol=1e-12)


@pytest.mark.parametrize("warm_up", [0.0, 2.0])
def test_every_row_that_can_be_compared_is_in_some_window(dragged: Split, warm_up: float) -> None:
    motion = dragged.train.motions[0]
    marked = replace(dragged.train, motions=(replace(motion, heading=np.arange(motion.time.size, dtype=float)),))
    windows = windows_of(marked, HULL, pure=True, heading=False, seconds=10.0, warm_up=warm_up)
    rows = np.unique(windows.states[:, windows.compared, 0])
    first = windows.first + windows.reach
    assert rows.tolist() == list(range(first, motion.time.size - windows.reach))


def test_windows_say_what_is_too_short(dragged: Split) -> None:
    ask = {"pure": True, "heading": False, "warm_up": 2.0}
    with pytest.raises(RequestError, match="all warm-up and filter edges; expected at least 5.9 s"):
        windows_of(dragged.train, HULL, **ask, seconds=5.0)  # type: ignore[arg-type]
    with pytest.raises(RequestError, match="a stretch of at least 500 s without gaps, got 83"):
        windows_of(dragged.train, HULL, **ask, seconds=500.0)  # type: ignore[arg-type]
    mixed = replace(
        dragged.train, motions=(*dragged.train.motions, simulate_world(HULL, {}, duration=5.0).motion(0.05))
    )
    with pytest.raises(RequestError, match="motions of one time step, got \\[0.05, 0.1\\]"):
        windows_of(mixed, HULL, **ask, seconds=10.0)  # type: ignore[arg-type]


# The recipe


def test_what_the_nominal_model_lacks_is_learnt(dragged: Split) -> None:
    settings = TrainingSettings(epochs=60, learning_rate=1e-2, trust=False)
    found = train(dragged, HULL, Choice("mlp"), settings=settings)
    before = acceleration_score(VehicleModel(HULL, "nominal"), dragged.test).rmse
    after = acceleration_score(found.model, dragged.test).rmse
    assert (after[:2] < 0.5 * before[:2]).all()
    assert found.lawful is None, "nobody asked an auditor"
    assert found.best_epoch in best_epochs(list(found.epochs))


def test_no_gain_is_invented_where_nothing_is_missing() -> None:
    parts = parts_of({})
    found = train(parts, HULL, Choice("lstm"), settings=replace(QUICK, trust=True))
    before = acceleration_score(VehicleModel(HULL, "nominal"), parts.test).rmse
    after = acceleration_score(found.model, parts.test).rmse
    assert (np.abs(after / before - 1.0) < 0.1).all()


@pytest.mark.parametrize("name", ["lstm", "tcn", "port_hamiltonian", "mlp"])
def test_rows_that_warm_a_memory_up_count_and_teach_nothing(name: str, dragged: Split) -> None:
    made = preparation.prepare_training(dragged, HULL, Choice(name), QUICK)
    objective, network = made.objective, made.network
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(0.1 * torch.randn(parameter.shape, generator=torch.Generator().manual_seed(1)))
    seen = objective.inputs[:3].clone().requires_grad_()
    said, warm = objective._said(network, seen), objective.warm_rows
    assert said.detach().numpy() == pytest.approx(network(seen)[0][:, warm:].detach().numpy(), abs=1e-5)
    (slope,) = torch.autograd.grad(said.square().sum(), seen)
    assert warm == (0 if name == "mlp" else 20)
    assert not slope[:, :warm].any()
    assert slope[:, warm:].any()


def test_a_network_with_memory_learns_the_boat_and_not_the_noise_of_its_sensors() -> None:
    """Who sees the noise of past velocities predicts the noise of the acceleration made from them, and rolls out worse.

    The nominal model is the true boat here, so that every gain on it is imaginary. Of four seeds of the training, the
    rollouts of the honest one err 0.50, 0.52, 0.76 and 0.77 times as much as the other's.
    """
    otter = load_vehicle("otter")
    worlds = [simulate_world(otter, {}, duration=240.0, seed=k).motion(0.1) for k in range(2)]
    raw = tuple(replace(world, source=str(k)) for k, world in enumerate(worlds))
    parts = split(DataSet(tuple(smooth(motion, 1.2) for motion in raw), (), PAPER, raw))
    settings = TrainingSettings(epochs=100, learning_rate=5e-3, seed=2, trust=False)  # nothing of either holds
    blind, seeing = (
        train(
            parts, otter, Choice("tcn", {"units": 16, "layers": 2}), settings=replace(settings, sensor_noise=share)
        ).model
        for share in (1.0, 0.0)
    )
    true = VehicleModel(otter, "true")
    sway, leaked, honest = (acceleration_score(m, parts.test).rmse[1] for m in (true, seeing, blind))
    assert leaked < 0.5 * sway
    assert honest > 1.5 * leaked
    leaked, honest = (rollout_scores(m, parts.test, (10.0,))["10"].velocity[1] for m in (seeing, blind))
    assert honest < 0.7 * leaked


def test_equal_seeds_give_equal_weights_and_torch_is_left_alone(brief: Split) -> None:
    state, threads = torch.random.get_rng_state(), torch.get_num_threads()
    shaken = replace(QUICK, epochs=2, augmentation=Augmentation(0.02, 0.01, 0.1, 0.2))
    choice = Choice("lstm", {"units": 8})
    first = train(brief, HULL, choice, settings=shaken)
    assert torch.equal(torch.random.get_rng_state(), state)
    assert torch.get_num_threads() == threads
    torch.rand(3)
    assert weights(train(brief, HULL, choice, settings=shaken)) == weights(first)
    assert weights(train(brief, HULL, choice, settings=replace(shaken, seed=1))) != weights(first)


class HaltError(Exception):
    pass


def stop_at(number: int):
    def told(epoch: Epoch) -> None:
        if epoch.number == number:
            raise HaltError

    return told


@pytest.mark.parametrize("network", ["lstm", "mlp"])
def test_a_resumed_training_ends_like_one_that_was_never_interrupted(
    brief: Split, tmp_path: Path, network: str
) -> None:
    choice = Choice(network, {"units": 8})
    settings = replace(QUICK, epochs=5, schedule="cosine", augmentation=Augmentation(speed_noise=0.02))
    whole = train(brief, HULL, choice, settings=settings)
    for number in (2, 3):
        with pytest.raises(HaltError):
            train(brief, HULL, choice, settings=settings, folder=tmp_path, resume=True, progress=stop_at(number))
    assert [path.name for path in tmp_path.iterdir()] == [CHECKPOINT]
    told: list[int] = []
    resumed = train(
        brief,
        HULL,
        choice,
        settings=settings,
        folder=tmp_path,
        resume=True,
        progress=lambda epoch: told.append(epoch.number),
    )
    assert told == [4, 5]
    assert weights(resumed) == weights(whole)
    assert resumed.epochs == whole.epochs
    assert [path.name for path in tmp_path.iterdir()] == [CHECKPOINT]  # until the model is saved


@pytest.mark.parametrize(
    ("name", "averaging"), [("mlp", 0.0), ("trees", 0.95), ("gp", 0.95)], ids=["not averaged", "trees", "gp"]
)
def test_a_checkpoint_is_written_where_nothing_is_averaged(
    brief: Split, tmp_path: Path, name: str, averaging: float
) -> None:
    settings, choice = replace(QUICK, epochs=2, averaging=averaging), Choice(name, {"units": 8})
    whole = train(brief, HULL, choice, settings=settings)
    with pytest.raises(HaltError):
        train(brief, HULL, choice, settings=settings, folder=tmp_path, progress=stop_at(1))
    assert weights(train(brief, HULL, choice, settings=settings, folder=tmp_path, resume=True)) == weights(whole)


def test_a_checkpoint_goes_on_only_with_its_own_settings_and_data(brief: Split, tmp_path: Path) -> None:
    settings = replace(QUICK, epochs=3)

    def again(data: Split = brief, resume: bool = True, **changes: object) -> Trained:
        return train(data, HULL, Choice("mlp"), settings=replace(settings, **changes), folder=tmp_path, resume=resume)

    with pytest.raises(HaltError):
        train(brief, HULL, Choice("mlp"), settings=settings, folder=tmp_path, progress=stop_at(1))
    begun = (tmp_path / CHECKPOINT).read_bytes()
    with pytest.raises(RequestError, match="holds an interrupted training; resume it"):
        again(resume=False)
    with pytest.raises(RequestError, match="another training: seed was 0, is 4"):
        again(seed=4)
    assert again(learning_rate=1e-3).settings.learning_rate == 1e-3
    (tmp_path / CHECKPOINT).write_bytes(begun)
    with pytest.raises(RequestError, match="the logs, or how they are prepared, are others"):
        again(parts_of({}))
    whole = (tmp_path / CHECKPOINT).read_bytes()
    for damaged in (whole[:-100], b"", b"{}" * 40):
        (tmp_path / CHECKPOINT).write_bytes(damaged)
        with pytest.raises(RequestError, match="no checkpoint that training can go on from"):
            again()
    (tmp_path / CHECKPOINT).write_bytes(whole)
    assert again().epochs[-1].number == 3
    with pytest.raises(RequestError, match="resume needs the folder"):
        train(brief, HULL, Choice("mlp"), settings=settings, resume=True)


def test_a_loss_that_is_not_finite_stops_and_keeps_the_last_good_state(brief: Split, tmp_path: Path) -> None:
    settings = replace(QUICK, epochs=4)
    wild = replace(settings, learning_rate=1e30)
    with pytest.raises(RequestError, match="in epoch 1; try a smaller learning rate than 1e\\+30"):
        train(brief, HULL, Choice("mlp"), settings=wild)

    poisoned: list[int] = []

    def poison(epoch: Epoch) -> None:
        poisoned.append(epoch.number)
        if epoch.number == 2:
            with torch.no_grad():
                held.network.head.bias[0] = float("inf")  # type: ignore[union-attr, index]

    held = None
    original = preparation.prepare_training

    def spied(*args: object, **keywords: object):
        nonlocal held
        held = original(*args, **keywords)  # type: ignore[arg-type]
        return held

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("undertow.residuals.training.epochs.prepare_training", spied)
        with pytest.raises(RequestError, match="loss is (nan|inf) in epoch 3.*state after epoch 2 is kept in"):
            train(brief, HULL, Choice("mlp"), settings=settings, folder=tmp_path, progress=poison)
    resumed = train(brief, HULL, Choice("mlp"), settings=settings, folder=tmp_path, resume=True)
    assert weights(resumed) == weights(train(brief, HULL, Choice("mlp"), settings=settings))


def epochs_of(*rows: tuple[float, float]) -> list[Epoch]:
    return [Epoch(k, 1.0, rmse, violating) for k, (rmse, violating) in enumerate(rows)]


def test_the_best_epochs_are_kept_those_that_break_laws_last() -> None:
    assert best_epochs(epochs_of((1.0, 0.0), (0.5, 0.0), (0.3, 0.01), (0.6, 0.0))) == [1, 3, 0, 2]
    assert best_epochs(epochs_of((1.0, 0.2), (0.5, 0.1), (0.7, 0.1)), 1) == [1]
    assert best_epochs(epochs_of((1.0, 0.0), (0.5, 0.1), (0.3, 0.1)), lawful=False) == [2, 1, 0]
    assert stale(epochs_of((1.0, 0.0), (0.5, 0.0), (0.3, 0.01), (0.6, 0.0))) == 1
    assert stale(epochs_of((1.0, 0.1), (0.5, 0.1), (0.8, 0.0), (0.79999, 0.0))) == 1
    assert stale([]) == 0


def test_training_stops_early(brief: Split) -> None:
    settings = replace(QUICK, epochs=200, patience=2, learning_rate=3e-2)
    found = train(brief, HULL, Choice("mlp"), settings=settings)
    assert found.stopped == "no better validation error for 2 epochs"
    assert found.epochs[-1].number < 200


def test_the_penalty_of_the_laws_lowers_violations(dragged: Split) -> None:
    def share(weight: float) -> float:
        settings = replace(QUICK, epochs=15, batch=4, learning_rate=3e-3, lambda_phys=weight)
        return train(dragged, HULL, Choice("mlp", pure=True), settings=settings).epochs[-1].violating

    without = share(0.0)
    assert without > 0.02
    assert share(1000.0) < 0.5 * without


def test_smoothness_calms_the_correction(dragged: Split) -> None:
    def change(weight: float) -> float:
        found = train(dragged, HULL, Choice("mlp"), settings=replace(QUICK, epochs=25, lambda_smooth=weight))
        return float(np.abs(np.diff(found.model.correction(dragged.test.motions[0]), axis=0)).mean())

    assert change(300.0) < 0.7 * change(0.0)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"epochs": 0}, "at least 1 for epochs, got 0"),
        ({"batch": 2.5}, "whole number of at least 1 for batch"),
        ({"learning_rate": float("nan")}, "a positive learning_rate, got nan"),
        ({"lambda_phys": -1.0}, "lambda_phys of 0 or more"),
        ({"schedule": "linear"}, "schedule fixed or cosine, got 'linear'"),
        ({"device": "tpu"}, "device auto or cpu or cuda"),
    ],
)
def test_settings_that_cannot_be_used(changes: dict[str, object], text: str) -> None:
    with pytest.raises(RequestError, match=text):
        TrainingSettings(**changes)  # type: ignore[arg-type]


def test_requests_that_cannot_be_met(dragged: Split) -> None:
    with pytest.raises(RequestError, match="rollouts of at most 99 rows in windows of 10 s, got 100"):
        train(dragged, HULL, Choice("mlp"), settings=replace(QUICK, rollout_rows=100))
    wanted = Augmentation(hull_spread=0.1)
    with pytest.raises(RequestError, match="a pure network has none"):
        train(dragged, HULL, Choice("mlp", pure=True), settings=replace(QUICK, augmentation=wanted))
    with pytest.raises(RequestError, match="expected thrust_spread of 0 or more, a spread below 1, got 1.0"):
        Augmentation(thrust_spread=1.0)
    if not torch.cuda.is_available():
        with pytest.raises(RequestError, match="no GPU that torch can use"):
            train(dragged, HULL, Choice("mlp"), settings=replace(QUICK, device="cuda"))


# Augmentation


def test_augmentation_varies_what_it_says(dragged: Split) -> None:
    def batch(wanted: Augmentation) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
        settings = replace(QUICK, augmentation=wanted)
        made = preparation.prepare_training(dragged, HULL, Choice("mlp", heading=True), settings).objective
        index, draw = torch.arange(made.count), torch.Generator().manual_seed(0)
        return made.inputs, made.target, *made.augmenter(made.inputs, made.target, index, draw)

    plain, target, inputs, same = batch(Augmentation(speed_noise=0.1, yaw_rate_noise=0.02))
    noise = (inputs - plain).flatten(0, 1).std(dim=0)
    assert noise[:3].tolist() == pytest.approx([0.1, 0.1, 0.02], rel=0.15)
    assert (noise[3:] == 0).all()
    assert torch.equal(same, target)
    plain, target, inputs, same = batch(Augmentation(thrust_spread=0.2))
    gain = (inputs / plain)[..., 3:5]
    assert torch.equal(inputs[..., [0, 1, 2, 5, 6]], plain[..., [0, 1, 2, 5, 6]])
    known = gain[:, 50][torch.isfinite(gain[:, 50])]
    assert known.min() >= 0.8
    assert known.max() <= 1.2
    assert known.std() > 0.05
    plain, target, inputs, moved = batch(Augmentation(hull_spread=0.2))
    assert torch.equal(inputs, plain)
    assert 0.01 < (moved - target).abs().mean() / target.abs().mean() < 2.0


@pytest.mark.parametrize("name", list(NETWORKS))
def test_each_network_trains_to_equal_weights_from_equal_seeds(dragged: Split, name: str) -> None:
    settings, small = replace(QUICK, epochs=1), {"units": 8} if "units" in default_options(name) else {}
    first, second = (train(dragged, HULL, Choice(name, small), settings=settings) for _ in range(2))
    assert weights(first) == weights(second)


def test_the_envelope_of_the_penalty_is_that_of_training(dragged: Split) -> None:
    made = preparation.prepare_training(dragged, HULL, Choice("lstm"), QUICK)
    box = envelope_of(dragged.train.motions, HULL)
    asked = made.objective.coasting.inputs[:, :3].numpy().astype(float)
    assert encloses(box, asked, slack=1e-5)
    thrust = made.objective.coasting.inputs[:, 3:]
    assert (thrust[::2] == 0).all()
    assert (thrust[1::2] != 0).any()
    assert made.objective.coasting.rows == 20
    assert made.judge.coasting.count >= 2 * (512 + 64)


@pytest.mark.parametrize("name", ["mlp", "lstm"])
def test_a_hybrid_is_trusted_by_its_log_and_a_pure_network_wholly(brief: Split, name: str) -> None:
    few = TrainingSettings(epochs=3)
    model = train(brief, HULL, Choice(name, {"units": 8}), settings=few).model
    (motion,) = brief.train.motions
    assert model.fades
    assert model.beyond(motion) == pytest.approx(0.0, abs=0.0)
    fast = replace(motion, velocity=30.0 * motion.velocity)
    far = model.beyond(fast) > model.far
    assert far.mean() > 0.5
    gain, said = model.weight(motion), model.correction(motion)
    assert (gain == gain[0]).all()
    left = model.weight(fast)[far]  # the share that does not fade as far as was tried
    assert (left == left[0]).all()
    assert (left[0] <= gain[0]).all()
    model.trust(None)
    np.testing.assert_allclose(said, gain * model.correction(motion), rtol=1e-4, atol=1e-9)
    assert not train(brief, HULL, Choice(name, {"units": 8}), settings=replace(few, trust=False)).model.fades
    assert not train(brief, HULL, Choice(name, {"units": 8}, pure=True), settings=few).model.fades


def test_what_is_fitted_at_once_learns_what_told_its_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = parts_of({"surge_quadratic_damping": -10.0}, seconds=60.0)
    asked: list[NetworkModel] = []

    def audited(model: NetworkModel) -> Verdict:
        asked.append(deepcopy(model))
        return Verdict(True, np.zeros((0, 6)))

    settings = TrainingSettings(device="cpu")
    found = train(parts, HULL, Choice("ridge"), settings=settings, auditor=audited)
    assert found.seconds == pytest.approx(parts.train.seconds + parts.validation.seconds)
    assert not any(found.model.beyond(motion).any() for motion in parts.validation.motions)
    weights = found.model.network.state_dict()["head.weight"]
    assert torch.equal(asked[-1].network.state_dict()["head.weight"], weights), "what is written is audited"
    monkeypatch.setattr(epochs, "_refit", lambda *given: None)
    before = train(parts, HULL, Choice("ridge"), settings=settings)
    assert not torch.equal(before.model.network.state_dict()["head.weight"], weights)
    gains = [one.model.network.gain for one in (before, found)]
    assert gains[0] is not None
    assert gains[1] is not None
    assert np.array_equal(gains[0].trust.weights, gains[1].trust.weights), "rows that it did not know have told them"
    assert (before.model.interval, before.model.band) == (found.model.interval, found.model.band)


def test_what_is_trained_keeps_to_its_training_part() -> None:
    parts = parts_of({"surge_quadratic_damping": -10.0}, seconds=60.0)
    found = train(parts, HULL, Choice("mlp", {"units": 4}), settings=TrainingSettings(epochs=1, device="cpu"))
    assert found.seconds == parts.train.seconds
