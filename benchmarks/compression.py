"""Factors against pysindy on the same rows, and against LAPACK and BLAS: times, memory and coefficients.

    python benchmarks/compression.py [--rows 10000 100000 1000000] [--draws 100]

`speed.py --compression` puts the same figures into docs/performance.md. Each contender runs in a process of its own, in
which the rows are drawn block by block; pysindy has to hold them all, factors hold a block. Times are without drawing
and without imports, memory is what is held beyond the imports.
"""

import argparse
import json
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from measured import Figures
from scipy.linalg import get_blas_funcs, get_lapack_funcs

from undertow.discovery.factors import Column, Factors, compress, ensemble, triangular
from undertow.measurements.statistics.processors import single_threaded

COLUMNS, BLOCKS = 20, 100
COEFFICIENTS = np.where(np.arange(COLUMNS) % 4 == 0, 1.0 + 0.1 * np.arange(COLUMNS), 0.0)
THRESHOLD, DRAWS = 0.05, 100


def blocks_of(rows: int) -> Iterator[np.ndarray]:
    """Blocks (rows / 100, columns and target) of columns that are alike."""
    for block in range(BLOCKS):
        rng = np.random.default_rng([7, block])
        theta = rng.standard_normal((rows // BLOCKS, COLUMNS)) + 0.5 * rng.standard_normal((rows // BLOCKS, 1))
        yield np.column_stack([theta, theta @ COEFFICIENTS + 0.5 * rng.standard_normal(theta.shape[0])])


def peak() -> float:
    """The largest memory that this process held [MB]."""
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024.0 if sys.platform != "darwin" else 1024.0**2)


@single_threaded
def factored(rows: int, draws: int) -> dict[str, Any]:
    """Compress block by block, one sparse model, and an ensemble of many."""
    import pysindy  # noqa: F401  # loaded before the clock runs, as for the other

    before, seconds, found = peak(), 0.0, []
    for block in blocks_of(rows):
        begun = time.perf_counter()
        found.append(triangular(block))
        seconds += time.perf_counter() - begun
    columns = tuple(Column(name=f"x{k}", unit="") for k in range(COLUMNS))
    about = (np.full(BLOCKS, rows // BLOCKS), np.zeros(BLOCKS, dtype=int), ("",), {})
    factors = Factors(columns, (Column(name="y", unit=""),), np.stack(found), *about)
    begun = time.perf_counter()
    models = ensemble(factors, THRESHOLD, draws=draws)
    seconds += time.perf_counter() - begun
    return {"seconds": seconds, "memory": peak() - before, "coefficients": _one(factors).tolist(), "draws": draws,
            "inclusion": models.inclusion[0].tolist()}  # fmt: skip


def _one(factors: Factors) -> np.ndarray:
    """The model of all rows, as pysindy fits it to them: no column scaled."""
    import pysindy

    whole = factors.whole
    optimizer = pysindy.STLSQ(threshold=THRESHOLD, alpha=0.0)
    optimizer.fit(whole[:, :COLUMNS], whole[:, COLUMNS])
    return np.asarray(optimizer.coef_[0])


def on_rows(rows: int, draws: int) -> dict[str, Any]:
    """One sparse model of pysindy, and its ensemble, on all rows."""
    import pysindy

    before = peak()
    every = np.empty((rows, COLUMNS + 1))
    for k, block in enumerate(blocks_of(rows)):
        every[k * (rows // BLOCKS) : (k + 1) * (rows // BLOCKS)] = block
    one = pysindy.STLSQ(threshold=THRESHOLD, alpha=0.0)
    one.fit(every[:, :COLUMNS], every[:, COLUMNS])
    begun = time.perf_counter()
    many = pysindy.EnsembleOptimizer(pysindy.STLSQ(threshold=THRESHOLD, alpha=0.0), bagging=True, n_models=draws)
    many.fit(every[:, :COLUMNS], every[:, COLUMNS : COLUMNS + 1])
    seconds = time.perf_counter() - begun
    kept = np.mean([np.ravel(c) != 0.0 for c in many.coef_list], axis=0)
    return {"seconds": seconds, "memory": peak() - before, "coefficients": np.ravel(one.coef_).tolist(), "draws": draws,
            "inclusion": kept.tolist()}  # fmt: skip


CONTENDERS = {"factors": factored, "pysindy": on_rows}


def child(name: str, rows: int, draws: int) -> dict[str, Any]:
    """What one contender does in a process of its own."""
    words = [sys.executable, __file__, "--child", name, "--rows", str(rows), "--draws", str(draws)]
    return json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


def against_pysindy(figures: Figures, sizes: list[int], draws: int) -> None:
    """The same regression on more and more rows."""
    for rows in sizes:
        ours, theirs = child("factors", rows, draws), child("pysindy", rows, draws)
        large = rows >= 1_000_000
        name = f"ensemble of {draws} sparse models, {rows:,} rows of {COLUMNS} columns"
        figures.tell(f"{name}, factors with the compression", ours["seconds"], None, "s")
        figures.tell(f"{name}, pysindy", theirs["seconds"], None, "s")
        times = theirs["seconds"] / ours["seconds"]
        figures.tell("pysindy's time over that of factors", times, 20.0 if large else None, "", least=True)
        apart = np.abs(np.subtract(ours["coefficients"], theirs["coefficients"])).max()
        figures.tell("largest difference of a coefficient, all rows at once", float(apart), 1e-8, "")
        if large:  # fewer rows take less than the imports do
            figures.tell("the same, memory of pysindy", theirs["memory"], None, "MB")
            figures.tell("memory of factors, as a share of that", ours["memory"] / theirs["memory"], 0.1, "")


@single_threaded
def against_lapack(figures: Figures, rows: int = 1_000_000) -> None:
    """The compression pass against LAPACK's QR of the whole matrix, and against BLAS' product, on one core."""
    x = np.random.default_rng(0).standard_normal((rows, COLUMNS + 4))
    name = f"{rows:,} rows of {COLUMNS + 4} columns"
    parts = [x[start : start + 10_000] for start in range(0, rows, 10_000)]
    seconds = {what: min(_timed(do) for _ in range(3)) for what, do in {
        "qr": lambda: get_lapack_funcs(("geqrf",))[0](np.asfortranarray(x)),
        "syrk": lambda: get_blas_funcs(("syrk",), (x,))[0](1.0, x.T),
        "factors": lambda: compress(parts),
    }.items()}  # fmt: skip
    figures.tell(f"compression of {name}, one core", seconds["factors"], None, "s")
    qr, syrk = (seconds[what] / seconds["factors"] for what in ("qr", "syrk"))
    figures.tell("its rate over that of LAPACK's dgeqrf, copy included", qr, 0.5, "", least=True)
    figures.tell("its rate over that of BLAS' dsyrk, which squares the rows", syrk, None, "")


def _timed(do: Callable[[], object]) -> float:
    begun = time.perf_counter()
    do()
    return time.perf_counter() - begun


def main() -> int:
    """Measure, print, and say by the exit code whether the limits hold."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, nargs="+", default=[10_000, 100_000, 1_000_000])
    parser.add_argument("--draws", type=int, default=DRAWS)
    parser.add_argument("--child", choices=CONTENDERS, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.child:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            print(json.dumps(CONTENDERS[chosen.child](chosen.rows[0], chosen.draws)))
        return 0
    figures = Figures()
    against_lapack(figures)
    against_pysindy(figures, chosen.rows, chosen.draws)
    return int(figures.broken)


if __name__ == "__main__":
    sys.exit(main())
