"""The Python file needs NumPy alone, and gives undertow's own derivatives and rollouts."""

import subprocess
import sys
from pathlib import Path
from runpy import run_path
from typing import Any

import numpy as np
import pytest
from exported import BOATS, EXACT, compare_rollouts, compare_states, error, program, stepped, trips, written

from undertow.exports.program.symbols import Function


def grouped(function: Function, columns: np.ndarray) -> list[np.ndarray]:
    """All inputs (numbers, ...) by group."""
    parts = zip(function.inputs, function.split(list(columns)), strict=True)
    return [part[0] if group.single else np.array(part) for group, part in parts]


@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, tmp_path: Path):
    module = run_path(str(written(name, "python", tmp_path / "model.py")))

    def answer(function: Function, rows: np.ndarray) -> np.ndarray:
        return module[function.name](*grouped(function, rows.T)).T

    compare_states(name, answer)
    compare_rollouts(name, stepped(name, answer))


@pytest.mark.parametrize("name", ["as it is", "table, everything"])
def test_simulate_goes_through_the_steps(name: str, tmp_path: Path):
    module: dict[str, Any] = run_path(str(written(name, "python", tmp_path / "model.py")))
    asked, start, steps = program(name), trips(name).start[0], trips(name).steps[:, 0]
    motion, command, *rest = grouped(asked.start, start)
    later = grouped(asked.step, np.concatenate([np.zeros((len(asked.state), len(steps))), steps.T]))
    commands = np.column_stack([command, later[1]])
    beside = {}
    if rest:
        beside = {"air": np.column_stack([rest[0], later[2]]), "minutes": later[3][0]}
    assert error(module["simulate"](motion, commands, **beside).T, trips(name).expected[0]) < EXACT


def test_it_needs_no_undertow(tmp_path: Path):
    written("propeller, everything", "python", tmp_path / "model.py")
    code = "import sys; sys.modules['undertow'] = None; import model; print(model.start.__doc__)"
    done = subprocess.run([sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, '.'); {code}"], cwd=tmp_path)
    assert done.returncode == 0
    assert "undertow" not in (tmp_path / "model.py").read_text("utf-8").partition('"""')[2]
