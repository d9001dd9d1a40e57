"""Training through rollouts: they are those of the model, and their gradients are right."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from training_parts import HULL, fresh, parts_of

from undertow.measurements.preparation.prepare import PAPER, DataSet
from undertow.measurements.preparation.split import Split, split
from undertow.physics.forces import ForceEquation, relative_velocity
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.networks.base import Network
from undertow.residuals.scores import rollout_scores
from undertow.residuals.training.epochs import train
from undertow.residuals.training.losses import Forcing, Shooter
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.residuals.training.windows import windows_of


@pytest.fixture(scope="module")
def dragged() -> Split:
    """A world with quadratic drag and lift that the nominal model lacks."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0})


LIVELY = HULL.with_values(
    {"current_north": 0.2, "current_east": -0.1, "wind_force_north": 2.0, "memory_sway": 8.0, "memory_yaw": 2.0}
).with_values({"memory_time": 1.0, "wind_x": 0.1, "wind_y": 0.2, "wind_n": 0.05, "advance_loss": 2.0, "N_uv": 3.0})


def shot(network: Network, motion: Motion, vehicle: Vehicle, rows: int, pure: bool = False) -> torch.Tensor:
    """Velocities of one rollout over the last rows of the first `rows` of a motion, after 20 measured rows."""
    data = DataSet((motion,), (), replace(PAPER, cutoff=None))
    heading = network.width > 5
    windows = windows_of(data, vehicle, pure=pure, heading=heading, seconds=rows * motion.time_step, warm_up=0.0)
    cut = [torch.as_tensor(x[:1]) for x in (windows.inputs, windows.states, windows.thrust, windows.load, windows.air)]
    shooter = Shooter(vehicle, pure=pure, time_step=motion.time_step)
    return shooter.velocities(network, cut[0], cut[1], Forcing(*cut[2:]), 20)


@pytest.mark.parametrize(("name", "pure"), [("mlp", False), ("lstm", False), ("lstm", True), ("tcn", False)])
def test_the_rollouts_of_training_are_those_of_the_model(name: str, pure: bool) -> None:
    world = simulate_world(LIVELY, {}, duration=20.0, noise="clean", seed=2, wind=(3.0, -2.0)).motion(0.1)
    parts = split(DataSet((world,), (), replace(PAPER, cutoff=None)))
    network = fresh(name, parts, LIVELY, heading=True)
    rolled = NetworkModel(LIVELY, network, 0.1, pure=pure).rollout(world, np.array([20]), 19).states[0, 1:, 3:]
    with torch.no_grad():
        ours = shot(network, world, LIVELY, 40, pure)[0].numpy()
    np.testing.assert_allclose(ours, rolled, atol=1e-9)
    assert np.abs(rolled - world.velocity[21:40]).max() > 1e-3


def test_gradients_through_a_rollout_are_finite_differences(dragged: Split) -> None:
    world = simulate_world(LIVELY, {}, duration=20.0, noise="field", seed=2, wind=(3.0, -2.0)).motion(0.1)
    network = fresh("lstm", dragged, LIVELY)
    weight = network.head.weight  # type: ignore[union-attr]
    recurrent = network.body.weight_hh_l0  # type: ignore[union-attr]

    def loss() -> torch.Tensor:
        return shot(network, world, LIVELY, 32).square().sum()

    loss().backward()
    for parameter in (weight, recurrent):
        slope, step = parameter.grad[1, 2].item(), 1e-6  # type: ignore[union-attr, index]
        ends = []
        for sign in (1.0, -1.0):
            with torch.no_grad():
                parameter[1, 2] += sign * step  # type: ignore[index]
                ends.append(loss().item())
                parameter[1, 2] -= sign * step  # type: ignore[index]
        assert slope == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-5)
        assert abs(slope) > 1e-6


def test_the_force_equation_takes_tensors_and_arrays_alike() -> None:
    rng = np.random.default_rng(0)
    velocity, heading = tuple(rng.normal(size=(3, 7))), rng.normal(size=7)
    thrust, load, air = rng.normal(size=(2, 7)), rng.random((2, 7)), rng.normal(size=(2, 7))
    equation = ForceEquation(LIVELY)

    def both(kind: Any) -> np.ndarray:
        fast, psi = tuple(map(kind, velocity)), kind(heading)
        relative = relative_velocity(LIVELY, psi, fast)
        force = equation.force(relative, psi, kind(thrust), kind(load), fast[1:], (kind(air[0]), kind(air[1])))
        return np.stack([np.asarray(x) for x in (*force, *equation.acceleration(force, relative, fast, psi))])

    np.testing.assert_allclose(both(torch.as_tensor), both(np.asarray), rtol=1e-13)


def test_training_through_rollouts_helps_rollouts() -> None:
    parts = parts_of({"thruster_lag": 0.4})
    plain = {"schedule": "fixed", "overlap": 0.5, "averaging": 0.0}
    before = TrainingSettings(epochs=40, batch=4, learning_rate=5e-3, lambda_phys=0.0, **plain)  # type: ignore[arg-type]
    one, many = (
        rollout_scores(
            train(parts, HULL, Choice("mlp", {"units": 32}, pure=True), settings=s).model, parts.test, (2.0,)
        )
        for s in (before, replace(before, rollout_rows=10))
    )
    assert (many["2"].velocity < 0.95 * one["2"].velocity).all()
