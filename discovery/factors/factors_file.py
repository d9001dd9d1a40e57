"""Factors as a file: plain arrays in an `.npz`, nothing pickled, and what they are as JSON beside them.

The arrays are `r` (blocks, k, k), `rows` and `log` (blocks,), and `about`, the bytes of a JSON text with columns,
targets, units, digests of the logs and settings. Equal factors give equal bytes.
"""

import io
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...physics.errors import RequestError
from ...physics.file_records import Record
from ...physics.files import strict_json, write_bytes
from ...physics.reading import parse_json, read_bytes, reason
from .factors import Column, Factors

_MOST = 2**29
"""Bytes of a file [B]: some 10,000 logs of an hour with sixty columns."""
_REMEDY = "write it again with undertow.write_factors"
_KINDS = {"r": "f", "rows": "i", "log": "i", "about": "u"}
"""What numbers each array holds, as numpy names their kinds."""


class _About(Record):
    """What the arrays are."""

    SCHEMA: ClassVar[str] = "undertow.factors/1"
    columns: tuple[Column, ...]
    targets: tuple[Column, ...]
    logs: tuple[str, ...]
    settings: Mapping[str, float | str]


def write_factors(factors: Factors, path: str | os.PathLike[str]) -> Path:
    """Write factors to an `.npz` file, whole or not at all; equal factors give equal bytes."""
    about = _About(columns=factors.columns, targets=factors.targets, logs=factors.logs, settings=dict(factors.settings))
    told = np.frombuffer(strict_json(about.to_dict()).encode("utf-8"), dtype=np.uint8)
    content = io.BytesIO()
    np.savez(content, r=factors.r, rows=factors.rows.astype(np.int64), log=factors.log.astype(np.int64), about=told)
    return write_bytes(path, content.getvalue())


def read_factors(path: str | os.PathLike[str]) -> Factors:
    """Read factors that `write_factors` wrote.

    Raises
    ------
    RequestError
        when the file is none of these, broken, of another version, or does not hold what it says.
    OSError
        when there is no file, or it cannot be opened.
    """
    try:
        found = plain_arrays(read_bytes(path, _MOST), _KINDS)
        content = parse_json(found["about"].tobytes())
    except (ValueError, KeyError, zipfile.BadZipFile, RuntimeError, EOFError) as error:
        raise RequestError(f"{path}: not readable as factors ({reason(error)}); {_REMEDY}") from None
    about = _About.read(content, path, _REMEDY)
    factors = Factors(about.columns, about.targets, found["r"], found["rows"], found["log"], about.logs, about.settings)
    wrong = _wrong(factors)
    if wrong:
        raise RequestError(f"{path}: {wrong}; {_REMEDY}")
    return factors


def plain_arrays(content: bytes, kinds: Mapping[str, str]) -> dict[str, np.ndarray]:
    """The arrays of an `.npz` file; each is looked at before room is made for it.

    Parameters
    ----------
    kinds : what numbers each array holds, as numpy names their kinds

    Raises
    ------
    ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile
        when the file does not hold them, or not as they are.
    """
    found = {}
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        for name, kind in kinds.items():
            member = archive.getinfo(f"{name}.npy")
            if member.compress_type != zipfile.ZIP_STORED or member.file_size > len(content):
                raise ValueError(f"expected {name} as it is, got it packed")
            stream = io.BytesIO(archive.read(member))
            np.lib.format.read_magic(stream)
            shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
            if dtype.kind != kind or dtype.hasobject or fortran:
                raise ValueError(f"expected numbers of kind {kind!r} under {name}, got {dtype}")
            found[name] = np.frombuffer(stream.read(), dtype=dtype).reshape(shape)
    return found


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
