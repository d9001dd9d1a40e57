"""CasADi's functions, and the C that CasADi makes of them, give undertow's own derivatives and rollouts."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, FEW, MANY, boat, compare_rollouts, compare_states, needed, program, run, written

from undertow.exports.program.functions import Function

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
