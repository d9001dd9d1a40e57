"""The C header, compiled with all warnings as errors, gives undertow's own derivatives and rollouts."""

import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest
from exported import (
    BOATS,
    EXACT,
    FEW,
    MANY,
    SINGLE,
    boat,
    compare_rollouts,
    compare_states,
    needed,
    program,
    run,
    written,
)

from undertow.exports.program.functions import Function

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
COMPILERS = {"gcc": "package gcc", "clang": "package clang"}


def compiler(name: str) -> str:
    return needed(name, shutil.which(name), COMPILERS[name])


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
        (folder / "flat.c").write_text("\n".join(lines) + "\n", "utf-8")
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


@pytest.fixture(params=[("gcc",), ("gcc", "-DMODEL_FLOAT"), ("clang",)], ids=["gcc", "float", "clang"])
def how(request: pytest.FixtureRequest) -> tuple[str, tuple[str, ...], float]:
    """Compiler, flags, and the largest error."""
    name, *flags = request.param
    return compiler(name), tuple(flags), SINGLE if flags else EXACT


@pytest.mark.parametrize("count", [FEW, MANY], ids=["few", "many"])
@pytest.mark.parametrize("name", BOATS)
def test_it_is_undertows_own_simulation(name: str, count: int, how: tuple, tmp_path: Path):
    cc, flags, most = how
    header = written(name, "c", tmp_path / "model.h")
    library = Library(tmp_path, header, program(name).functions, cc, *flags)
    compare_states(name, library.rows, most)
    compare_rollouts(name, library, count, most)


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
    """Under 20 kB of code, and under a microsecond a step; ten times that is left to a machine that others use."""
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
    for (k = 0; k < 200000; k++) {{
        model_step({given}, after);
        for (j = 0; j < {len(asked.state)}; j++) state[j] = after[j];
        sum += state[0];
        if (k % 100 == 0) state[3] = 1.0;
    }}
    printf("%.9g %g\\n", (double)(clock() - begun) / CLOCKS_PER_SEC / 200000.0, sum);
    return 0;
}}
""",
        "utf-8",
    )
    cc = compiler("gcc")
    run([cc, "-O2", "step.c", "-o", "step", "-lm"], tmp_path)
    seconds = min(float(run([tmp_path / "step"], tmp_path).split()[0]) for _ in range(3))
    print(f"{name}: {seconds * 1e6:.3f} us a step")
    assert seconds < 10e-6
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
