"""The ONNX graphs, run by onnxruntime, give undertow's own derivatives and rollouts."""

from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, SINGLE, compare_rollouts, compare_states, facts, stepped, written
from networks import NETWORKS, compare_network, exported, learnt

from undertow.exports.network_operations import Built, CorrectedProgram
from undertow.exports.program.symbols import Function

onnx = pytest.importorskip("onnx", reason="what exports to ONNX: pip install '.[export]'")
runtime = pytest.importorskip("onnxruntime", reason="what runs ONNX: pip install '.[export]'")


def session(path: Path):
    options = runtime.SessionOptions()
    options.intra_op_num_threads = 1
    return runtime.InferenceSession(str(path), options)


def fed(asked: Function | Built, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Inputs of a graph from all its groups side by side."""
    ends = np.cumsum([len(group.members) for group in asked.inputs])[:-1]
    return dict(zip([group.name for group in asked.inputs], np.split(rows, ends, axis=1), strict=True))


@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, tmp_path: Path):
    path = written(name, "onnx", tmp_path / "model.onnx")
    files = {"step": path, **{part: tmp_path / f"model_{part}.onnx" for part in ("start", "derivatives")}}
    sessions = {part: session(file) for part, file in files.items()}

    def answer(function: Function, rows: np.ndarray) -> np.ndarray:
        return sessions[function.name].run(None, fed(function, rows))[0]

    compare_states(name, answer)
    compare_rollouts(name, stepped(name, answer))


@pytest.mark.parametrize(("kind", "options", "heading", "pure"), NETWORKS)
def test_a_network_rolls_out_as_its_own(kind: str, options: dict, heading: bool, pure: bool, tmp_path: Path):
    model = learnt(kind, options, heading, pure)
    _, start, step = CorrectedProgram(model).built
    path = exported(model, "onnx", tmp_path / "model.onnx")
    whole, first = session(path), session(tmp_path / "model_start.onnx")
    assert [each.name for each in whole.get_inputs()] == [group.name for group in step.inputs]

    def answer(built: Built, rows: np.ndarray) -> np.ndarray:
        return (first if built is start else whole).run(None, fed(built, rows))[0]

    compare_network(model, (start, step), answer)


def test_a_trained_network_of_single_precision_is_the_same_to_its_rounding(tmp_path: Path):
    """The graph works in double precision with the very weights; the network itself rounds to seven digits."""
    model = learnt("lstm", {"units": 8}, True, False, double=False)
    _, start, step = CorrectedProgram(model).built
    whole, first = session(exported(model, "onnx", tmp_path / "model.onnx")), session(tmp_path / "model_start.onnx")

    def answer(built: Built, rows: np.ndarray) -> np.ndarray:
        return (first if built is start else whole).run(None, fed(built, rows))[0]

    compare_network(model, (start, step), answer, SINGLE)


def test_the_facts_stand_in_it(tmp_path: Path):
    model = onnx.load(written("as it is", "onnx", tmp_path / "model.onnx"))
    assert all(line in model.graph.doc_string for line in facts("as it is").lines())
    assert model.producer_name == "undertow export"
    assert {each.name for each in model.graph.input} == {"state", "command"}
