"""The MATLAB functions, run by Octave, give undertow's own derivatives and rollouts."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, EXACT, FEW, MANY, compare_states, envelope, needed, program, run, seconds, written

from undertow.exports.program.functions import Function
from undertow.exports.program.vectors import driven, error
from undertow.physics.errors import RequestError


def octave(code: str, folder: Path) -> None:
    (folder / "main.m").write_text(code, "utf-8")
    run([needed("octave", shutil.which("octave"), "package octave"), "--quiet", "--no-gui", "main.m"], folder)


def arguments(function: Function, row: str) -> str:
    """The groups of a function from columns of a row, in Octave."""
    found, at = [], 0
    for group in function.inputs:
        size = len(group.members)
        found.append(f"{row}({at + 1})" if group.single else f"{row}({at + 1}:{at + size})")
        at += size
    return ", ".join(found)


def save(path: Path, values: np.ndarray) -> None:
    np.savetxt(path, np.atleast_2d(values), fmt="%.17g")


@pytest.mark.parametrize("count", [FEW, MANY], ids=["few", "many"])
@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, count: int, tmp_path: Path):
    written(name, "matlab", tmp_path / "model.m")
    asked = program(name)

    def answer(function: Function, rows: np.ndarray) -> np.ndarray:
        save(tmp_path / "rows.txt", rows)
        octave(
            f"model = model(); rows = load('rows.txt'); found = zeros(size(rows, 1), {len(function.results)});\n"
            f"for k = 1:size(rows, 1)\n row = rows(k, :)'; found(k, :) = model.derivatives("
            f"{arguments(function, 'row')})';\nend\ndlmwrite('found.txt', found, 'precision', '%.17g');\n",
            tmp_path,
        )
        return np.loadtxt(tmp_path / "found.txt", delimiter=",")

    compare_states(name, answer)
    for seed in range(count):
        rolled = driven(asked, envelope(name), seconds(count), seed)
        save(tmp_path / "start.txt", rolled.start)
        save(tmp_path / "steps.txt", rolled.steps)
        octave(
            f"""model = model(); row = load('start.txt')'; state = model.start({arguments(asked.start, "row")});
steps = load('steps.txt'); found = zeros(size(steps, 1) + 1, 6); found(1, :) = state(1:6)';
for k = 1:size(steps, 1)
  row = [state; steps(k, :)'];
  state = model.step({arguments(asked.step, "row")});
  found(k + 1, :) = state(1:6)';
end
dlmwrite('found.txt', found, 'precision', '%.17g');
""",
            tmp_path,
        )
        assert error(np.loadtxt(tmp_path / "found.txt", delimiter=","), rolled.expected) < EXACT


@pytest.mark.parametrize("stem", ["My-Boat", "2boats", "step", "end", "max", "a" * 64])
def test_a_file_that_matlab_cannot_call_is_refused(stem: str, tmp_path: Path):
    with pytest.raises(RequestError, match=r"expected a file name that is the name of a function.*my_boat\.m"):
        written("as it is", "matlab", tmp_path / f"{stem}.m")


def test_the_function_has_the_name_of_its_file(tmp_path: Path):
    text = written("as it is", "matlab", tmp_path / "MyBoat.m").read_text("utf-8")
    assert text.startswith("function model = MyBoat()\n")
