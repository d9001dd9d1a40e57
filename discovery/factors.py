"""Triangular factors that stand for the rows of a regression, their file, and sparse regression on them.

|Theta x - y| is |R [x, -1]| for the R of [Theta y] = Q R (Golub and Van Loan 2013, section 5.3.3), exactly. Factors of
parts combine (TSQR; Demmel et al. 2012, section 3), so those of logs add; each block of time keeps its own, for
bootstrap and folds. Ensembles draw whole blocks (Fasel et al. 2022, doi:10.1098/rspa.2021.0904).
"""

import io
import os
import warnings
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import ClassVar, TypeVar, cast

import numpy as np

from ..measurements.statistics.blocks import block_draws
from ..measurements.statistics.processors import single_threaded
from ..physics.errors import RequestError
from ..physics.file_records import Record
from ..physics.files import strict_json, write_bytes
from ..physics.motion import Array
from ..physics.reading import parse_json, read_bytes, reason

_CHUNK = 1 << 16
"""Numbers of the rows that are reduced at a time: half a megabyte stays in the cache of any core."""


class Column(Record):
    """Name and unit of a column or a target."""

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


_MOST = 2**29
"""Bytes of a file [B]: some 10,000 logs of an hour with sixty columns."""
_REMEDY = "write it again with undertow.write_factors"
_KINDS = {"r": "f", "rows": "i", "log": "i"}
"""What numbers each array holds, as numpy names their kinds."""
About = TypeVar("About", bound=Record)


class _About(Record):
    """What the arrays are."""

    SCHEMA: ClassVar[str] = "undertow.factors/1"
    columns: tuple[Column, ...]
    targets: tuple[Column, ...]
    logs: tuple[str, ...]
    settings: Mapping[str, float | str]


def write_factors(factors: Factors, path: str | os.PathLike[str]) -> Path:
    """Write factors to an `.npz` file, whole or not at all; equal factors give equal bytes.

    The arrays are `r` (blocks, k, k), `rows` and `log` (blocks,), and `about`, the bytes of a JSON text with columns,
    targets, units, digests of the logs and settings; nothing is pickled.
    """
    about = _About(columns=factors.columns, targets=factors.targets, logs=factors.logs, settings=dict(factors.settings))
    return write_bytes(path, packed({"r": factors.r, "rows": factors.rows, "log": factors.log, "about": about}))


def read_factors(path: str | os.PathLike[str]) -> Factors:
    """Read factors that `write_factors` wrote.

    Raises
    ------
    RequestError
        when the file is none of these, broken, of another version, or does not hold what it says.
    OSError
        when there is no file, or it cannot be opened.
    """
    about, found = unpacked(read_bytes(path, _MOST), _About, _KINDS, (path, "factors", _REMEDY))
    factors = Factors(about.columns, about.targets, logs=about.logs, settings=about.settings, **found)
    wrong = _wrong(factors)
    if wrong:
        raise RequestError(f"{path}: {wrong}; {_REMEDY}")
    return factors


def packed(arrays: Mapping[str, np.ndarray | Record]) -> bytes:
    """The content of an `.npz` file of arrays of numbers, and of a record as the bytes of its JSON text."""
    content, plain = io.BytesIO(), {}
    for name, array in arrays.items():
        if isinstance(array, Record):
            plain[name] = np.frombuffer(strict_json(array.to_dict()).encode("utf-8"), dtype=np.uint8)
        else:
            plain[name] = np.ascontiguousarray(array, dtype=np.int64 if array.dtype.kind == "i" else np.float64)
    np.savez(content, allow_pickle=False, **plain)
    return content.getvalue()


def unpacked(
    content: bytes, about: type[About], kinds: Mapping[str, str], place: tuple[object, str, str]
) -> tuple[About, dict[str, np.ndarray]]:
    """The record `about` and the arrays of a file that `packed` made; each is looked at before room is made for it.

    Parameters
    ----------
    content : of the file
    about : what the record is
    kinds : what numbers each array holds, as numpy names their kinds
    place : where the file is, what it should be, and what to do where it is not

    Raises
    ------
    RequestError
        when the file does not hold them, or not as they are.
    """
    source, what, remedy = place
    try:
        found = {}
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for name, kind in {**kinds, "about": "u"}.items():
                found[name] = _plain_array(archive, name, kind, len(content))
        told = parse_json(found.pop("about").tobytes())
    except (ValueError, KeyError, zipfile.BadZipFile, RuntimeError, EOFError) as error:
        raise RequestError(f"{source}: not readable as {what} ({reason(error)}); {remedy}") from None
    return about.read(told, source, remedy), found


def _plain_array(archive: zipfile.ZipFile, name: str, kind: str, most: int) -> np.ndarray:
    """An array of an archive of at most so many bytes."""
    member = archive.getinfo(f"{name}.npy")
    if member.compress_type != zipfile.ZIP_STORED or member.file_size > most:
        raise ValueError(f"expected {name} as it is, got it packed")
    stream = io.BytesIO(archive.read(member))
    np.lib.format.read_magic(stream)
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    if dtype.kind != kind or dtype.hasobject or fortran:
        raise ValueError(f"expected numbers of kind {kind!r} under {name}, got {dtype}")
    return np.frombuffer(stream.read(), dtype=dtype).reshape(shape)


def _wrong(factors: Factors) -> str:
    """What does not fit together, or nothing."""
    size = len(factors.columns) + len(factors.targets)
    if factors.r.ndim != 3 or factors.r.shape[1:] != (size, size):
        return f"expected factors of {size} by {size} numbers, got {factors.r.shape}"
    for what, numbers in (("rows", factors.rows), ("log", factors.log)):
        if numbers.shape != factors.r.shape[:1]:
            return f"expected a number of {what} for each of {factors.r.shape[0]} blocks, got {numbers.shape}"
    with np.errstate(over="ignore"):
        finite = np.isfinite((factors.r**2).sum())
    if not finite or np.tril(factors.r, -1).any():
        return "expected upper triangular factors of finite numbers, got others"
    if len(set(factors.logs)) < len(factors.logs):
        return "expected each log once, got one twice"
    if (factors.rows <= 0).any() or (factors.log < 0).any() or (factors.log >= len(factors.logs)).any():
        return "expected blocks with rows, of logs that are listed, got others"
    return ""


_LEAST_BLOCKS = 4
"""Blocks below which draws of them say nothing of chance."""


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """Sparse models of many draws.

    Attributes
    ----------
    columns, targets : what was regressed on what
    coefficients : (draws, targets, columns), each in its target's unit over its column's
    """

    columns: tuple[Column, ...]
    targets: tuple[Column, ...]
    coefficients: Array

    @property
    def inclusion(self) -> Array:
        """Share of the draws that keep each column, (targets, columns)."""
        return (self.coefficients != 0.0).mean(axis=0)

    @property
    def median(self) -> Array:
        """Median coefficient of the draws, (targets, columns); zero where fewer than half keep a column."""
        return np.asarray(np.median(self.coefficients, axis=0))


def forward(factors: Factors, target: int, most: int) -> list[int]:
    """Columns that forward orthogonal regression takes for a target (Billings 2013, chapter 3), in their order here.

    Parameters
    ----------
    factors : of the rows of [columns, targets]
    target : number of the target
    most : columns to take
    """
    import pysindy  # here, because it takes a third of a second and few logs ask for terms

    size = _sizes(factors)
    rows, y = _parted(factors.whole, size)
    optimizer = pysindy.FROLS(max_iter=min(most, size.size - 1), alpha=0.0, unbias=False)
    optimizer.fit(rows, y[:, target])
    return np.flatnonzero(optimizer.history_[-1][0]).tolist()


@single_threaded
def ensemble(factors: Factors, threshold: float, *, ridge: float = 0.0, draws: int = 100, seed: int = 0) -> Ensemble:
    """Sequentially thresholded least squares (Brunton, Proctor and Kutz 2016) on many draws of the blocks.

    Parameters
    ----------
    threshold : share of a target's root mean square; a column whose part of the target is smaller is left out
    ridge : penalty of the squared parts of the columns, as a share of the squared rows
    draws : models
    seed : of the draws

    Raises
    ------
    RequestError
        when there are fewer than four blocks.
    """
    if factors.blocks < _LEAST_BLOCKS:
        raise RequestError(
            f"ensemble: expected at least {_LEAST_BLOCKS} blocks to draw from, got {factors.blocks}; give a longer log"
        )
    size = _sizes(factors)
    found = np.zeros((draws, len(factors.targets), len(factors.columns)))
    for models, counts in zip(found, block_draws(factors.blocks, draws, seed), strict=True):
        count = float(counts @ factors.rows)
        rows, y = _parted(factors.drawn(counts), size)
        level = np.sqrt((y**2).sum(axis=0) / count)
        for target in np.flatnonzero(level):
            told = _thresholded(rows, y[:, target] / level[target], threshold, ridge * count)
            models[target] = told * level[target] / size
    return Ensemble(factors.columns, factors.targets, found)


def _sizes(factors: Factors) -> Array:
    """Root mean square of each column over all blocks, (p,); one for a column of zeros."""
    whole = factors.whole[:, : len(factors.columns)]
    size = np.sqrt((whole**2).sum(axis=0) / float(factors.rows.sum()))
    return np.where(size > 0.0, size, 1.0)


def _parted(whole: Array, size: Array) -> tuple[Array, Array]:
    """Columns, divided by their sizes, and targets of a factor: (k, p) and (k, targets)."""
    return whole[:, : size.size] / size, whole[:, size.size :]


def _thresholded(rows: Array, y: Array, threshold: float, ridge: float) -> Array:
    """Coefficients (p,) of rows (k, p)."""
    import pysindy

    optimizer = pysindy.STLSQ(threshold=threshold, alpha=ridge, max_iter=rows.shape[1] + 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no column is an answer, too
        optimizer.fit(rows, y)
    return np.asarray(optimizer.coef_[0], dtype=float)
