"""CasADi's functions, and the C that CasADi makes of them, give undertow's own derivatives and rollouts."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from exported import BOATS, boat, compare_rollouts, compare_states, facts, needed, program, run, stepped, written
from networks import NETWORKS, compare_network, exported, learnt

from undertow.exports.formats import to_casadi
from undertow.exports.formats.base import Given
from undertow.exports.network_operations import Built, CorrectedProgram
from undertow.exports.program.symbols import Function
from undertow.physics.errors import RequestError

casadi = pytest.importorskip("casadi", reason="what exports to CasADi: pip install '.[export]'")


def functions(path: Path) -> dict:
    content = json.loads(path.read_text("utf-8"))
    return {name: casadi.Function.deserialize(text) for name, text in content["functions"].items()}


@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, tmp_path: Path):
    found = functions(written(name, "casadi", tmp_path / "model.json"))
    mapped: dict[tuple[str, int], Any] = {}

    def answer(function: Function, rows: np.ndarray) -> np.ndarray:
        key = function.name, len(rows)
        called = mapped.get(key) or mapped.setdefault(key, found[function.name].map(len(rows)))
        return called(*(np.array(part) for part in function.split(list(rows.T)))).full().T

    compare_states(name, answer)
    compare_rollouts(name, stepped(name, answer))


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


@pytest.mark.parametrize(("kind", "options", "heading", "pure"), NETWORKS[:2] + NETWORKS[-1:])
def test_a_network_rolls_out_as_its_own(kind: str, options: dict, heading: bool, pure: bool, tmp_path: Path):
    model = learnt(kind, options, heading, pure)
    found = functions(exported(model, "casadi", tmp_path / "model.json"))
    _, start, step = CorrectedProgram(model).built
    assert ("derivatives" in found) is not pure
    mapped = {each.name: found[each.name].map(100) for each in (start, step)}

    def answer(built: Built, rows: np.ndarray) -> np.ndarray:
        ends = np.cumsum([len(group.members) for group in built.inputs])[:-1]
        return mapped[built.name](*np.split(rows.T, ends)).full().T

    compare_network(model, (start, step), answer)


@pytest.mark.parametrize(("kind", "options", "heading", "pure"), NETWORKS)
def test_a_network_alone_says_and_remembers_the_same_row_by_row(
    kind: str, options: dict, heading: bool, pure: bool, tmp_path: Path
):
    model = learnt(kind, options, heading, pure)
    said = functions(exported(model, "casadi", tmp_path / "model.json"))["correction"]
    rows = model.tensor(np.random.default_rng(2).normal(0.0, 10.0, (40, 1, 1, model.network.width)))
    with torch.inference_mode():
        _, memory = model.network(rows[0])
        for row in rows[1:]:
            before = [np.concatenate([part.numpy().ravel() for part in memory])] if memory else []
            expected, memory = model.network(row, memory)
            found = said(row.numpy().ravel(), *before)
            told, *after = found if memory else (found,)
            np.testing.assert_allclose(told.full().ravel(), expected.numpy().ravel(), rtol=1e-12, atol=1e-14)
            for part in after:
                kept = np.concatenate([each.numpy().ravel() for each in memory])
                np.testing.assert_allclose(part.full().ravel(), kept, rtol=1e-12, atol=1e-14)


def test_what_a_network_says_is_differentiated(tmp_path: Path):
    """Exactly, by CasADi: compared with differences of what PyTorch says."""
    model = learnt("mlp", {"units": 16, "layers": 2}, True, False)
    said = functions(exported(model, "casadi", tmp_path / "model.json"))["correction"]
    seen = casadi.MX.sym("seen", model.network.width)
    slope = casadi.Function("slope", [seen], [casadi.jacobian(said(seen), seen)])
    at = torch.linspace(-1.0, 1.0, model.network.width, dtype=torch.float64)
    expected = torch.autograd.functional.jacobian(lambda x: model.network(x[None, None])[0][0, 0], at)
    np.testing.assert_allclose(slope(at.numpy()).full(), expected.numpy(), rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("kind", ["transformer", "gp"])
def test_a_network_of_another_kind_is_refused(kind: str):
    model = learnt(kind, {}, False, False)
    with pytest.raises(RequestError, match=f"expected a network of the kinds mlp, .*, got {kind}"):
        to_casadi.EXPORT.files(Given(model.vehicle, facts("as it is"), network=model), Path("a.json"))
