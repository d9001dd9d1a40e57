"""CasADi's functions, and the C that CasADi makes of them, give undertow's own derivatives and rollouts."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from exported import (
    BOATS,
    EXACT,
    FEW,
    MANY,
    boat,
    compare_rollouts,
    compare_states,
    facts,
    needed,
    program,
    run,
    written,
)

from undertow.exports.formats import to_casadi
from undertow.exports.formats.base import Given
from undertow.exports.program.functions import Function
from undertow.exports.program.vectors import error
from undertow.measurements.preparation.standardisation import Standardisation
from undertow.physics.errors import RequestError
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import NetworkModel, scaling_of
from undertow.residuals.networks.registry import build

casadi = pytest.importorskip("casadi", reason="what exports to CasADi: pip install '.[export]'")


def functions(path: Path) -> dict:
    content = json.loads(path.read_text("utf-8"))
    return {name: casadi.Function.deserialize(text) for name, text in content["functions"].items()}


@pytest.mark.parametrize("count", [FEW, MANY], ids=["few", "many"])
@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, count: int, tmp_path: Path):
    found = functions(written(name, "casadi", tmp_path / "model.json"))

    def rows(function: Function, given: np.ndarray) -> np.ndarray:
        called = found[function.name].map(len(given))
        groups = [np.array(part) for part in function.split(list(given.T))]
        return np.array(called(*groups)).T

    def one(function: Function, row: np.ndarray) -> np.ndarray:
        return np.array(found[function.name](*function.split(row.tolist()))).ravel()

    compare_states(name, rows)
    compare_rollouts(name, one, count)


def test_its_c_compiles_and_agrees(tmp_path: Path):
    name = "table, everything"
    found = functions(written(name, "casadi", tmp_path / "model.json"))
    cc = needed("gcc", shutil.which("gcc"), "package gcc")
    run([cc, "-shared", "-fPIC", "model_casadi.c", "-o", "model.so", "-lm"], tmp_path)
    step = casadi.external("step", str(tmp_path / "model.so"))
    rng = np.random.default_rng(1)
    asked = program(name).step
    row = rng.uniform(-1.0, 1.0, sum(len(group.members) for group in asked.inputs))
    given = asked.split(row.tolist())
    np.testing.assert_allclose(np.array(step(*given)), np.array(found["step"](*given)), rtol=1e-12, atol=1e-12)


def test_its_derivatives_are_those_of_the_model(tmp_path: Path):
    found = functions(written("as it is", "casadi", tmp_path / "model.json"))["derivatives"]
    x, command = casadi.SX.sym("x", 6), casadi.SX.sym("c", 2)
    slope = casadi.Function("slope", [x, command], [casadi.jacobian(found(x, command), x)])
    vehicle = boat("as it is")
    drag = np.array(slope([0, 0, 0, 0.5, 0, 0], [0, 0]))[3, 3]
    mass = vehicle.value("mass") - vehicle.value("X_udot")
    assert drag == pytest.approx((vehicle.value("X_u") + 2.0 * 0.5 * vehicle.value("X_uu")) / mass, rel=1e-12)


def learnt(kind: str, options: dict, heading: bool) -> NetworkModel:
    """A network of random numbers, in double precision, beside a boat with lag, delay and wear."""
    hull = load_vehicle("otter").with_values({"lag": 0.3, "delay": 0.17, "thrust_rate": -0.02, "current_north": 0.1})
    names = input_names(hull, heading)
    rng = np.random.default_rng(5)
    constants = Standardisation(names, rng.normal(size=len(names)), rng.uniform(5.0, 20.0, len(names)))
    network = build(kind, scaling_of(hull, constants, np.array([0.05, 0.02, 0.08])), options).double()
    generator = torch.Generator().manual_seed(3)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.copy_(0.3 * torch.randn(parameter.shape, generator=generator))
    return NetworkModel(hull, network, 0.1)


@pytest.mark.parametrize(
    ("kind", "options", "heading"),
    [
        ("mlp", {"units": 16, "layers": 2}, True),
        ("lstm", {"units": 8, "layers": 2}, False),
        ("lstm", {"units": 8}, True),
    ],
)
def test_a_network_beside_the_physics_rolls_out_as_its_own(kind: str, options: dict, heading: bool, tmp_path: Path):
    model = learnt(kind, options, heading)
    given = Given(model.vehicle, facts("as it is"), network=model)
    for path, content in to_casadi.EXPORT.files(given, tmp_path / "model.json").items():
        path.write_bytes(content)
    found = functions(tmp_path / "model.json")
    time = 0.1 * np.arange(301, dtype=float)
    knots = np.random.default_rng(8).uniform(-90.0, 90.0, (32, 2))
    commands = np.column_stack([np.interp(time, np.arange(32.0), column) for column in knots.T])
    first = np.array([0.0, 0.0, 0.4, 0.6, 0.05, -0.1])
    still = np.tile(first, (301, 1))
    motion = Motion(time, still[:, :2], still[:, 2], still[:, 3:], commands, ("port", "stbd"))
    expected = model.rollout(motion, np.array([0]), 300).states[0]
    state = found["start_corrected"](first, commands[0], 0.0)
    rolled = [np.array(state).ravel()[:6]]
    for k in range(300):
        state = found["step_corrected"](state, commands[k + 1], time[k] / 60.0)
        rolled.append(np.array(state).ravel()[:6])
    assert error(np.array(rolled), expected) < EXACT
    alone = VehicleModel(model.vehicle, "alone").rollout(motion, np.array([0]), 300).states[0]
    assert error(alone, expected) > 1e-2


def test_a_network_of_another_kind_is_refused():
    model = learnt("tcn", {}, False)
    with pytest.raises(RequestError, match="expected a network of the kinds mlp or lstm, got tcn"):
        to_casadi.EXPORT.files(Given(model.vehicle, facts("as it is"), network=model), Path("a.json"))
