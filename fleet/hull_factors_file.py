"""Factors of hulls as bytes: plain arrays in an `.npz`, nothing pickled, and what they are as JSON beside them.

Equal factors give equal bytes.
"""

import io
import zipfile
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ..discovery.factors.factors import Column
from ..discovery.factors.factors_file import plain_arrays
from ..physics.errors import RequestError
from ..physics.file_records import Record
from ..physics.files import strict_json
from ..physics.reading import parse_json, reason
from .hull_factors import HullFactors

_KINDS = {
    **dict.fromkeys(("nominal", "gram", "begin", "end", "noise", "start", "hours"), "f"),
    **dict.fromkeys(("tests", "log"), "i"),
    "about": "u",
}
"""What numbers each array holds, as numpy names their kinds."""
_REMEDY = "take the file away, and run 'undertow fleet' again"


class HullFactorsAbout(Record):
    """What the arrays are."""

    SCHEMA: ClassVar[str] = "undertow.hull_factors/1"
    parameters: tuple[Column, ...]
    nuisances: tuple[Column, ...]
    logs: tuple[str, ...]
    settings: Mapping[str, float | str]


def to_bytes(factors: HullFactors) -> bytes:
    """Factors as the content of a file."""
    about = HullFactorsAbout(
        parameters=factors.parameters, nuisances=factors.nuisances, logs=factors.logs, settings=dict(factors.settings)
    )
    told = np.frombuffer(strict_json(about.to_dict()).encode("utf-8"), dtype=np.uint8)
    arrays = {name: getattr(factors, name) for name in _KINDS if name != "about"}
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, about=told, **{name: _plain(array) for name, array in arrays.items()})
    return content.getvalue()


def from_bytes(content: bytes, source: object) -> HullFactors:
    """Factors that `to_bytes` made.

    Parameters
    ----------
    source : where they were, for messages

    Raises
    ------
    RequestError
        when the bytes are none of these, broken, of another version, or do not hold what they say.
    """
    try:
        found = plain_arrays(content, _KINDS)
        about = HullFactorsAbout.read(parse_json(found.pop("about").tobytes()), source, _REMEDY)
    except RequestError:
        raise
    except (ValueError, KeyError, zipfile.BadZipFile, RuntimeError, EOFError) as error:
        raise RequestError(f"{source}: not readable as factors of a hull ({reason(error)}); {_REMEDY}") from None
    factors = HullFactors(
        parameters=about.parameters, nuisances=about.nuisances, logs=about.logs, settings=about.settings, **found
    )
    blocks, logs, p = factors.tests.size, len(factors.logs), len(factors.parameters)
    size = p + len(factors.nuisances) + 1
    wanted = {
        "nominal": (p,),
        "gram": (blocks, 3, size, size),
        "noise": (logs, 3, size, size),
        **dict.fromkeys(("tests", "begin", "end", "log"), (blocks,)),
        **dict.fromkeys(("start", "hours"), (logs,)),
    }
    for name, shape in wanted.items():
        array = getattr(factors, name)
        if array.shape != shape or not (name == "start" or np.isfinite(array).all()):
            raise RequestError(f"{source}: expected {name} of shape {shape} in finite numbers, got others; {_REMEDY}")
    if not blocks or (factors.log < 0).any() or (factors.log >= logs).any():
        raise RequestError(f"{source}: expected blocks of logs that are listed, got others; {_REMEDY}")
    return factors


def _plain(array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array, dtype=np.int64 if array.dtype.kind == "i" else np.float64)
