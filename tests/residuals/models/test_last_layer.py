"""The last layer of a network: parameters that make its correction, in pieces as in one go, and a network of them."""

from dataclasses import replace

import numpy as np
import pytest
from networks import learnt

from undertow.physics.errors import RequestError
from undertow.physics.motion import Motion
from undertow.residuals.models.last_layer import LastLayer
from undertow.residuals.models.network_inputs import network_inputs
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.networks.base import through

KINDS = [
    ("mlp", {"units": 16}),
    ("lstm", {"units": 8}),
    ("tcn", {"units": 6, "layers": 2}),
    ("symmetric", {"units": 8}),
]
KINDS += [("ridge", {"filters": 2}), ("gp", {"units": 12})]
QUIET = np.zeros(3)


def motion_of(rows: int = 80) -> Motion:
    rng, time = np.random.default_rng(2), 0.1 * np.arange(rows)
    knots = np.linspace(0.0, time[-1], 9)
    velocity = np.column_stack([np.interp(time, knots, rng.normal(0.0, 0.4, 9)) for _ in range(3)])
    commands = np.column_stack([np.interp(time, knots, rng.uniform(-60.0, 60.0, 9)) for _ in range(2)])
    still = np.zeros((rows, 2)), np.zeros(rows)
    return Motion(time, *still, velocity, commands, ("port", "stbd"), air=np.zeros((rows, 2)))


def layer_of(kind: str, options: dict) -> tuple[NetworkModel, LastLayer]:
    model = learnt(kind, options, heading=False, pure=False, double=False)
    return model, LastLayer(model, [motion_of()], QUIET)


@pytest.mark.parametrize(("kind", "options"), KINDS)
def test_the_trained_layer_is_its_gains_and_rows_in_pieces_are_those_in_one_go(kind: str, options: dict):
    model, layer = layer_of(kind, options)
    motion = motion_of()
    whole, _ = layer.along(motion, 80, None)
    said = model.correction(motion)
    assert layer.symbols[: layer.gains] == ("net_surge", "net_sway", "net_yaw")
    assert len(layer.symbols) > layer.gains
    assert whole @ layer.start == pytest.approx(said, abs=1e-5 * np.abs(said).max())
    first, memory = layer.along(motion.slice(0, 50), 50, None)
    rest, _ = layer.along(motion.slice(30, 80), 30, memory)
    assert np.concatenate([first, rest]) == pytest.approx(whole, abs=1e-4 * np.abs(whole).max())


@pytest.mark.parametrize(("kind", "options"), KINDS)
def test_an_adapted_network_says_what_its_parameters_say(kind: str, options: dict):
    model, layer = layer_of(kind, options)
    motion, rng = motion_of(), np.random.default_rng(4)
    values = layer.start + 0.5 * rng.standard_normal(layer.start.size)
    wanted = layer.along(motion, 80, None)[0] @ values
    weaker = model.vehicle.with_values({"port_scale": 0.7, "stbd_scale": 1.2})
    found = layer.adapted(values, weaker if kind != "symmetric" else model.vehicle)
    assert found.correction(motion) == pytest.approx(wanted, abs=2e-3 * np.abs(wanted).max())
    assert model.correction(motion) != pytest.approx(wanted, abs=1e-2 * np.abs(wanted).max())


def test_each_direction_is_as_large_as_the_trained_layer_and_apart_from_it():
    _, layer = layer_of("mlp", {"units": 16})
    along = layer.along(motion_of(), 80, None)[0][:, 2]
    own = [k for k, symbol in enumerate(layer.symbols) if symbol.startswith("net_yaw")]
    products = along[:, own].T @ along[:, own]
    assert products / products[0, 0] == pytest.approx(np.eye(len(own)), abs=0.05)


def test_what_is_lost_in_noise_or_not_linear_is_refused():
    quiet = learnt("mlp", {"units": 16}, heading=False, pure=False, double=False)
    assert LastLayer(quiet, [motion_of()], np.array([0.0, 1e9, 1e9])).symbols[0] == "net_surge"
    with pytest.raises(RequestError, match="is lost in the noise of this log; follow without --network"):
        LastLayer(quiet, [motion_of()], np.full(3, 1e9))
    with pytest.raises(RequestError, match="linear in its last layer, but dissipative is not; mlp, symmetric"):
        LastLayer(learnt("dissipative", {"units": 12}, heading=True, pure=False, double=False), [motion_of()], QUIET)
    with pytest.raises(RequestError, match="stands in the place of its physics; train one without --pure"):
        LastLayer(learnt("mlp", {"units": 16}, heading=True, pure=True, double=False), [motion_of()], QUIET)


def test_a_memory_goes_by_the_steps_of_its_training_whatever_the_rate_of_the_log():
    model, layer = layer_of("lstm", {"units": 8})
    motion = motion_of()
    time = 0.05 * np.arange(159)
    velocity, commands = (
        np.column_stack([np.interp(time, motion.time, column) for column in table.T])
        for table in (motion.velocity, motion.commands)
    )
    still = np.zeros((159, 2)), np.zeros(159)
    finer = Motion(time, *still, velocity, commands, ("port", "stbd"), air=np.zeros((159, 2)))
    first, memory = layer.along(finer.slice(0, 61), 61, None)
    rest, _ = layer.along(finer.slice(30, 159), 98, memory)
    found = np.concatenate([first, rest])
    own = network_inputs(model.vehicle, finer, heading=False)[::2]
    wanted = through(model.network, model.tensor(own)[None])[0][0].detach().double().numpy()
    assert found[::2] @ layer.start == pytest.approx(wanted, abs=1e-4 * np.abs(wanted).max())
    with pytest.raises(RequestError, match=r"expected a log of 10 Hz or a multiple of it.* got 6\.667 Hz"):
        layer.along(replace(motion, time=1.5 * motion.time), 80, None)
