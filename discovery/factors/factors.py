"""The rows of a regression as the triangular factors of their QR: exact for whatever least squares is asked of them.

|Theta x - y| is |R [x, -1]| for the R of [Theta y] = Q R (Golub and Van Loan 2013, section 5.3.3), so that a few rows
stand for all. A factor of many rows is made of those of their parts (TSQR; Demmel et al. 2012, section 3), which is why
factors of logs add; and each block of time has its own, for whatever draws or leaves out blocks.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import cast

import numpy as np

from ...measurements.statistics.single_threaded import single_threaded
from ...physics.errors import RequestError
from ...physics.file_records import Record
from ...physics.frames import Array

_CHUNK = 1 << 16
"""Numbers of the rows that are reduced at a time: half a megabyte stays in the cache of any core."""


class Column(Record):
    """What a column or a target is, and its unit."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True, eq=False)
class Factors:
    """Blocks of rows [columns, targets], each as its triangular factor.

    Attributes
    ----------
    columns, targets : what is regressed on what
    r : (blocks, k, k) upper triangular with a diagonal that is not negative, k the columns and targets together
    rows : (blocks,) rows that each stands for
    log : (blocks,) index of the log that each comes from
    logs : SHA-256 of each log
    settings : how the rows were made; what is made otherwise does not add
    """

    columns: tuple[Column, ...]
    targets: tuple[Column, ...]
    r: Array
    rows: np.ndarray
    log: np.ndarray
    logs: tuple[str, ...]
    settings: Mapping[str, float | str]

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return self.rows.size

    @property
    def whole(self) -> Array:
        """The factor (k, k) of all rows."""
        return self.drawn(np.ones(self.blocks))

    def drawn(self, counts: Array) -> Array:
        """The factor (k, k) of all rows with each block counted so many times, (blocks,), as a bootstrap draws them."""
        used = np.flatnonzero(counts)
        size = self.r.shape[-1]
        return triangular((np.sqrt(counts[used])[:, None, None] * self.r[used]).reshape(-1, size))

    def only(self, columns: Sequence[int]) -> "Factors":
        """The same with some of the columns, in the order given."""
        chosen = [*columns, *range(len(self.columns), self.r.shape[-1])]
        r = np.stack([triangular(block[:, chosen]) for block in self.r])
        return replace(self, columns=tuple(self.columns[k] for k in columns), r=r)

    def __add__(self, other: "Factors") -> "Factors":
        """The factors of both, logs in the order of their digests: the sum does not depend on who comes first.

        Raises
        ------
        RequestError
            when rows were made in another way, or a log is in both.
        """
        for what in ("columns", "targets", "settings"):
            mine, theirs = getattr(self, what), getattr(other, what)
            if mine != theirs:
                raise RequestError(
                    f"factors: expected the same {what} in both, got {_difference(mine, theirs)}; make both with one "
                    "vehicle and one version of undertow"
                )
        twice = set(self.logs) & set(other.logs)
        if twice:
            raise RequestError(
                f"factors: expected each log once, got the one with SHA-256 {min(twice)} in both; leave one out"
            )
        logs = tuple(sorted((*self.logs, *other.logs)))
        place = np.array([logs.index(digest) for digest in (*self.logs, *other.logs)])
        log = place[np.concatenate([self.log, other.log + len(self.logs)])]
        order = np.argsort(log, kind="stable")
        r, rows = np.concatenate([self.r, other.r]), np.concatenate([self.rows, other.rows])
        return replace(self, r=r[order], rows=rows[order], log=log[order], logs=logs)


def triangular(rows: Array) -> Array:
    """The factor (k, k) of rows (n, k): upper triangular, its diagonal not negative.

    Large parts are reduced one after the other with the factor of those before, so that no copy of all is made.
    """
    count, size = rows.shape
    step = max(_CHUNK // max(size, 1), 4 * size)
    factor = np.zeros((0, size))
    for start in range(0, count, step):
        factor = _reduced(np.concatenate([factor, rows[start : start + step]]))
    whole = np.zeros((size, size))
    whole[: factor.shape[0]] = factor
    return whole * np.where(np.diag(whole) < 0.0, -1.0, 1.0)[:, None]


@single_threaded
def compress(parts: Iterable[Array]) -> tuple[Array, int]:
    """The factor (k, k) of rows that come in parts (n, k), and how many rows there were.

    Raises
    ------
    RequestError
        when there is no part.
    """
    factor, count = None, 0
    for rows in parts:
        count += rows.shape[0]
        factor = triangular(rows if factor is None else np.concatenate([factor, rows]))
    if factor is None:
        raise RequestError("factors: expected rows, got none; give at least one part")
    return factor, count


def _reduced(rows: Array) -> Array:
    """The upper triangle of the QR of rows (n, k), (min(n, k), k)."""
    found, _, _, _ = _qr()(np.asfortranarray(rows), overwrite_a=1)
    return np.triu(found[: rows.shape[1]])


@cache
def _qr() -> Callable[..., tuple[Array, Array, Array, int]]:
    """LAPACK's QR of a matrix that it may write over; SciPy is loaded by who compresses rows."""
    from scipy.linalg import get_lapack_funcs

    return cast("Callable[..., tuple[Array, Array, Array, int]]", get_lapack_funcs(("geqrf",))[0])


def _difference(mine: object, theirs: object) -> str:
    """The first of two collections in which they differ."""
    if isinstance(mine, Mapping) and isinstance(theirs, Mapping):
        for key in sorted({*mine, *theirs}):
            if mine.get(key) != theirs.get(key):
                return f"{key} {mine.get(key)} and {theirs.get(key)}"
    if isinstance(mine, tuple) and isinstance(theirs, tuple):
        if len(mine) != len(theirs):
            return f"{len(mine)} and {len(theirs)} of them"
        one, other = next(pair for pair in zip(mine, theirs, strict=True) if pair[0] != pair[1])
        return f"{one.name} in {one.unit} and {other.name} in {other.unit}"
    return "others"
