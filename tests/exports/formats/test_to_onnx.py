"""The ONNX graphs, run by onnxruntime, give undertow's own derivatives and rollouts."""

from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, FEW, MANY, compare_rollouts, compare_states, facts, written

from undertow.exports.program.functions import Function

onnx = pytest.importorskip("onnx", reason="what exports to ONNX: pip install '.[export]'")
runtime = pytest.importorskip("onnxruntime", reason="what runs ONNX: pip install '.[export]'")


@pytest.mark.parametrize("count", [FEW, MANY], ids=["few", "many"])
@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, count: int, tmp_path: Path):
    path = written(name, "onnx", tmp_path / "model.onnx")
    files = {"step": path, **{part: tmp_path / f"model_{part}.onnx" for part in ("start", "derivatives")}}
    options = runtime.SessionOptions()
    options.intra_op_num_threads = 1
    sessions = {part: runtime.InferenceSession(str(file), options) for part, file in files.items()}

    def one(function: Function, row: np.ndarray) -> np.ndarray:
        groups = zip(function.inputs, function.split(row.tolist()), strict=True)
        return sessions[function.name].run(None, {group.name: np.array(part) for group, part in groups})[0]

    compare_states(name, lambda function, rows: np.array([one(function, row) for row in rows]))
    compare_rollouts(name, one, count)


def test_the_facts_stand_in_it(tmp_path: Path):
    model = onnx.load(written("as it is", "onnx", tmp_path / "model.onnx"))
    assert all(line in model.graph.doc_string for line in facts("as it is").lines())
    assert model.producer_name == "undertow export"
    assert {each.name for each in model.graph.input} == {"state", "command"}
