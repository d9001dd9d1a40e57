"""The JavaScript module, run by node, gives undertow's own derivatives and rollouts."""

import json
from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, compare_rollouts, compare_states, program, trips, written
from node import run_script

from undertow.exports.program.symbols import Function


def arguments(function: Function, row: str, skipped: int = 0) -> str:
    """The groups of a function from a row of numbers, in JavaScript; the first few may be there already."""
    found, at = [], 0
    for group in function.inputs[skipped:]:
        size = len(group.members)
        found.append(f"{row}[{at}]" if group.single else f"{row}.slice({at}, {at + size})")
        at += size
    return ", ".join(found)


def answered(model: Path, given: dict[str, np.ndarray], code: str) -> np.ndarray:
    """Numbers that a script collects in `found`, from arrays of rows; files have them, as JSON would take longer."""
    rows = []
    for name, values in given.items():
        np.ascontiguousarray(values, dtype=float).tofile(model.with_name(name))
        width = values.shape[-1]
        rows.append(f"const {name} = rows({json.dumps(str(model.with_name(name)))}, {width});")
    target = model.with_name("found")
    run_script(f"""
        const fs = require("fs"), model = require({json.dumps(str(model))}), found = [];
        function rows(path, width) {{
          const bytes = fs.readFileSync(path);
          const all = new Float64Array(bytes.buffer, bytes.byteOffset, bytes.length / 8), found = [];
          for (let k = 0; k < all.length; k += width) found.push(all.subarray(k, k + width));
          return found;
        }}
        {" ".join(rows)}
        {code}
        fs.writeFileSync({json.dumps(str(target))}, new Float64Array(found));
        console.log("{{}}");""")
    return np.fromfile(target)


@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, tmp_path: Path):
    path, asked, trip = written(name, "javascript", tmp_path / "model.js"), program(name), trips(name)

    def answer(function: Function, rows: np.ndarray) -> np.ndarray:
        code = f"for (const row of given) found.push(...model.{function.name}({arguments(function, 'row')}));"
        return answered(path, {"given": rows}, code).reshape(len(rows), -1)

    compare_states(name, answer)
    code = f"""
        for (const [k, row] of begun.entries()) {{
          let state = model.start({arguments(asked.start, "row")});
          found.push(...state.slice(0, 6));
          for (let n = 0; n < {len(trip.steps)}; n++) {{
            const row = given[n * begun.length + k];
            state = model.step(state, {arguments(asked.step, "row", 1)});
            found.push(...state.slice(0, 6));
          }}
        }}"""
    compare_rollouts(
        name, answered(path, {"begun": trip.start, "given": trip.steps}, code).reshape(trip.expected.shape)
    )


@pytest.mark.parametrize("stem", ["export", "step", "module", "my-boat", "7"])
def test_it_runs_whatever_its_file_is_called(stem: str, tmp_path: Path):
    path = written("as it is", "javascript", tmp_path / f"{stem}.js")
    assert run_script(f"console.log(Object.keys(require({json.dumps(str(path))})).length);") == 8
