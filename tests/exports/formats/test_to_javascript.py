"""The JavaScript module, run by node, gives undertow's own derivatives and rollouts."""

import json
from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, EXACT, FEW, MANY, compare_states, envelope, program, seconds, written
from node import run_script

from undertow.exports.program.functions import Function
from undertow.exports.program.vectors import driven, error


def groups(function: Function, row: np.ndarray, skipped: int = 0) -> list:
    parts = zip(function.inputs, function.split(row.tolist()), strict=True)
    return [part[0] if group.single else part for group, part in parts][skipped:]


@pytest.mark.parametrize("count", [FEW, MANY], ids=["few", "many"])
@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, count: int, tmp_path: Path):
    model = f"const model = require({json.dumps(str(written(name, 'javascript', tmp_path / 'model.js')))});"
    asked = program(name)

    def answer(function: Function, rows: np.ndarray) -> np.ndarray:
        given = json.dumps([groups(function, row) for row in rows])
        code = f"{model} console.log(JSON.stringify({given}.map((row) => model.{function.name}(...row))));"
        return np.array(run_script(code))

    compare_states(name, answer)
    for seed in range(count):
        rolled = driven(asked, envelope(name), seconds(count), seed)
        nothing = np.zeros(len(asked.state))
        steps = [groups(asked.step, np.concatenate([nothing, row]), 1) for row in rolled.steps]
        code = f"""{model}
            let state = model.start(...{json.dumps(groups(asked.start, rolled.start))});
            const found = [state.slice(0, 6)];
            for (const rest of {json.dumps(steps)}) {{
                state = model.step(state, ...rest);
                found.push(state.slice(0, 6));
            }}
            console.log(JSON.stringify(found));"""
        assert error(np.array(run_script(code)), rolled.expected) < EXACT


@pytest.mark.parametrize("stem", ["export", "step", "module", "my-boat", "7"])
def test_it_runs_whatever_its_file_is_called(stem: str, tmp_path: Path):
    path = written("as it is", "javascript", tmp_path / f"{stem}.js")
    assert run_script(f"console.log(Object.keys(require({json.dumps(str(path))})).length);") == 8
