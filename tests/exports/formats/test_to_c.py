"""The C header, compiled with all warnings as errors, gives undertow's own derivatives and rollouts."""

import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest
from exported import (
    BOATS,
    EXACT,
    SINGLE,
    boat,
    compare_rollouts,
    compare_states,
    needed,
    program,
    run,
    trips,
    written,
)
from places import slowness

from undertow.exports.program.symbols import Function

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
COMPILERS = {"gcc": "package gcc", "clang": "package clang"}


def compiler(name: str) -> str:
    return needed(name, shutil.which(name), COMPILERS[name])


_ROLLOUTS = """
void rollouts(const REAL *start, const REAL *steps, REAL *found, int count, int begun, int rows, int given);
void rollouts(const REAL *start, const REAL *steps, REAL *found, int count, int begun, int rows, int given)
{
    int i, k, j;
    for (i = 0; i < count; i++) {
        REAL state[STATES + 10], after[STATES];
        flat_start(start + i * begun, state);
        for (j = 0; j < 6; j++) *found++ = state[j];
        for (k = 0; k < rows; k++) {
            for (j = 0; j < given; j++) state[STATES + j] = *steps++;
            flat_step(state, after);
            for (j = 0; j < STATES; j++) state[j] = after[j];
            for (j = 0; j < 6; j++) *found++ = after[j];
        }
    }
}
"""


class Library:
    """The functions of a header, with one flat row of numbers in and out."""

    def __init__(self, folder: Path, header: Path, functions: tuple[Function, ...], cc: str, *flags: str) -> None:
        self.kind = ctypes.c_float if flags else ctypes.c_double
        lines = [f'#include "{header.name}"']
        for function in functions:
            places, at = [], 0
            for group in function.inputs:
                places.append(f"in[{at}]" if group.single else f"in + {at}")
                at += len(group.members)
            at = 0
            for group, _ in function.outputs:
                places.append(f"out + {at}")
                at += len(group.members)
            real = f"{header.stem}_real"
            lines.append(f"void flat_{function.name}(const {real} *in, {real} *out);")
            lines.append(f"void flat_{function.name}(const {real} *in, {real} *out)")
            lines.append(f"{{ {header.stem}_{function.name}({', '.join(places)}); }}")
        step = next(function for function in functions if function.name == "step")
        lines.append(_ROLLOUTS.replace("REAL", f"{header.stem}_real").replace("STATES", str(len(step.results))))
        (folder / "flat.c").write_text("\n".join(lines), "utf-8")
        run([cc, *STRICT, *flags, "-shared", "-fPIC", "flat.c", "-o", "flat.so", "-lm"], folder)
        self.library = ctypes.CDLL(str(folder / "flat.so"))

    def __call__(self, function: Function, row: np.ndarray) -> np.ndarray:
        given = np.ascontiguousarray(row, dtype=self.kind)
        found = np.empty(len(function.results), dtype=self.kind)
        pointer = ctypes.POINTER(self.kind)
        getattr(self.library, f"flat_{function.name}")(given.ctypes.data_as(pointer), found.ctypes.data_as(pointer))
        return found.astype(float)

    def rows(self, function: Function, rows: np.ndarray) -> np.ndarray:
        return np.array([self(function, row) for row in rows])

    def rollouts(self, start: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Motions (rollouts, steps + 1, 6), all in one call."""
        pointer = ctypes.POINTER(self.kind)
        given = [np.ascontiguousarray(part, dtype=self.kind) for part in (start, steps.swapaxes(0, 1))]
        found = np.empty((len(start), len(steps) + 1, 6), dtype=self.kind)
        sizes = (len(start), start.shape[1], len(steps), steps.shape[2])
        self.library.rollouts(*(each.ctypes.data_as(pointer) for each in (*given, found)), *sizes)
        return found.astype(float)


HOW = {"gcc": ("gcc", (), EXACT), "float": ("gcc", ("-DMODEL_FLOAT",), SINGLE), "clang": ("clang", (), EXACT)}
"""Compiler, flags, and the largest error."""
CASES = [(name, how) for how in HOW for name in BOATS if how != "clang" or "everything" in name]
"""A second compiler sees what has all that is ever printed."""


@pytest.mark.parametrize(("name", "how"), CASES)
def test_it_is_undertows_own_simulation(name: str, how: str, tmp_path: Path):
    named, flags, most = HOW[how]
    header = written(name, "c", tmp_path / "model.h")
    library = Library(tmp_path, header, program(name).functions, compiler(named), *flags)
    compare_states(name, library.rows, most)
    compare_rollouts(name, library.rollouts(trips(name).start, trips(name).steps), most)


def test_its_own_test_passes_and_notices_a_wrong_number(tmp_path: Path):
    written("table, everything", "c", tmp_path / "model.h")
    words = [compiler("gcc"), *STRICT, "model_test.c", "-o", "check", "-lm"]
    run(words, tmp_path)
    assert run([tmp_path / "check"], tmp_path).startswith("largest error: ")
    text = (tmp_path / "model.h").read_text("utf-8")
    drag = next(line for line in text.splitlines() if "const model_real X = " in line)
    (tmp_path / "model.h").write_text(text.replace(drag, drag.replace(" = ", " = UT_NUMBER(0.01) + ")), "utf-8")
    run(words, tmp_path)
    with pytest.raises(AssertionError, match="largest error"):
        run([tmp_path / "check"], tmp_path)


def test_it_is_cplusplus_too(tmp_path: Path):
    written("as it is", "c", tmp_path / "model.h")
    (tmp_path / "use.cpp").write_text('#include "model.h"\nint main() { return MODEL_TIME_STEP > 1.0; }\n', "utf-8")
    run([needed("g++", shutil.which("g++"), "package g++"), "-Wall", "-Werror", "use.cpp", "-o", "use"], tmp_path)
    run([tmp_path / "use"], tmp_path)


@pytest.mark.parametrize("name", ["as it is", "table, everything"])
def test_it_is_small_and_quick(name: str, tmp_path: Path):
    """Under 20 kB of code, and under a microsecond a step of a common machine: the best of several."""
    written(name, "c", tmp_path / "model.h")
    asked = program(name)
    groups = [(g.name, len(g.members), g.single) for g in asked.step.inputs]
    given = ", ".join("k * 1e-6" if single else group for group, _, single in groups)
    arrays = "".join(f"    double {group}[{size}] = {{0}};\n" for group, size, single in groups if not single)
    (tmp_path / "step.c").write_text(
        f"""#include "model.h"
#include <stdio.h>
#include <time.h>
int main(void)
{{
    double after[{len(asked.state)}], sum = 0.0;
{arrays}    clock_t begun;
    int k, j;
    state[3] = 1.0;
    begun = clock();
    for (k = 0; k < 50000; k++) {{
        model_step({given}, after);
        for (j = 0; j < {len(asked.state)}; j++) state[j] = after[j];
        sum += state[0];
        if (k % 100 == 0) state[3] = 1.0;
    }}
    printf("%.9g %g\\n", (double)(clock() - begun) / CLOCKS_PER_SEC / 50000.0, sum);
    return 0;
}}
""",
        "utf-8",
    )
    cc = compiler("gcc")
    run([cc, "-O2", "step.c", "-o", "step", "-lm"], tmp_path)
    seconds = min(float(run([tmp_path / "step"], tmp_path).split()[0]) for _ in range(5))
    print(f"{name}: {seconds * 1e6:.3f} us a step")
    assert seconds < 1e-6 * slowness()
    Library(tmp_path, tmp_path / "model.h", asked.functions, cc)
    run([cc, "-std=c99", "-Os", "-c", "flat.c"], tmp_path)
    code, data = map(int, run(["size", "flat.o"], tmp_path).splitlines()[1].split()[:2])
    print(f"{name}: {code + data} bytes")
    assert code + data < 20_000


def test_what_is_zero_leaves_no_code(tmp_path: Path):
    text = written("as it is", "c", tmp_path / "model.h").read_text("utf-8")
    for word in ("minutes", "air[", "load", "q_v", "lagged", "pow)"):
        assert f"{word}" not in text.partition("#ifndef")[2], word
    assert boat("as it is").value("lag") == 0.0
