"""The MATLAB functions, run by Octave, give undertow's own derivatives and rollouts."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, STATES, compare_rollouts, compare_states, envelope, needed, program, run, trips, written

from undertow.exports.program.symbols import Function
from undertow.exports.program.vectors import drawn
from undertow.physics.errors import RequestError


def octave(code: str, folder: Path) -> None:
    (folder / "main.m").write_text(code, "utf-8")
    run([needed("octave", shutil.which("octave"), "package octave"), "--quiet", "--no-gui", "main.m"], folder)


def arguments(function: Function, rows: str, skipped: int = 0) -> str:
    """The groups of a function from columns of numbers, in Octave; the first few may be there already."""
    found, at = [], 0
    for group in function.inputs[skipped:]:
        size = len(group.members)
        found.append(f"{rows}({at + 1}:{at + size}, :)")
        at += size
    return ", ".join(found)


def numbers(name: str, values: np.ndarray) -> str:
    """A line of Octave that reads columns of numbers from a file."""
    np.ascontiguousarray(values, dtype=float).tofile(name)
    return f"{Path(name).name} = fread(fopen('{Path(name).name}'), [{values.shape[-1]} Inf], 'double');\n"


@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, tmp_path: Path):
    """All states, and all rollouts, side by side in one call of Octave."""
    written(name, "matlab", tmp_path / "model.m")
    asked, trip = program(name), trips(name)
    states = drawn(asked, envelope(name), STATES)
    read = {"drawn": states.inputs, "begun": trip.start, "given": trip.steps}
    octave(
        "".join(numbers(str(tmp_path / part), values) for part, values in read.items())
        + f"""model = model();
state = model.start({arguments(asked.start, "begun")});
rates = model.derivatives({arguments(asked.derivatives, "drawn")});
count = columns(begun);
found = zeros(6, count, {len(trip.steps)} + 1);
found(:, :, 1) = state(1:6, :);
for k = 1:{len(trip.steps)}
  rows = given(:, (k - 1) * count + 1:k * count);
  state = model.step(state, {arguments(asked.step, "rows", 1)});
  found(:, :, k + 1) = state(1:6, :);
end
fwrite(fopen('rates', 'w'), rates, 'double');
fwrite(fopen('found', 'w'), found, 'double');
""",
        tmp_path,
    )
    compare_states(name, lambda function, rows: np.fromfile(tmp_path / "rates").reshape(states.expected.shape))
    motions = np.fromfile(tmp_path / "found").reshape(len(trip.steps) + 1, len(trip.start), 6)
    compare_rollouts(name, motions.swapaxes(0, 1))


def test_one_boat_is_a_column(tmp_path: Path):
    written("as it is", "matlab", tmp_path / "model.m")
    octave(
        "model = model(); state = model.start([0; 0; 0.1; 1; 0; 0], [1600; 1700]);\n"
        "state = model.step(state, [1650; 1700]); assert(size(state), [numel(model.state), 1]);\n"
        "assert(model.time_step, 0.05);\n",
        tmp_path,
    )


@pytest.mark.parametrize("stem", ["My-Boat", "2boats", "step", "end", "max", "a" * 64])
def test_a_file_that_matlab_cannot_call_is_refused(stem: str, tmp_path: Path):
    with pytest.raises(RequestError, match=r"expected a file name that is the name of a function.*my_boat\.m"):
        written("as it is", "matlab", tmp_path / f"{stem}.m")


def test_the_function_has_the_name_of_its_file(tmp_path: Path):
    text = written("as it is", "matlab", tmp_path / "MyBoat.m").read_text("utf-8")
    assert text.startswith("function model = MyBoat()\n")
