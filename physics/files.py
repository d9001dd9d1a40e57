"""Files appear whole or not at all: written to a temporary name beside the target, then renamed."""

import json
import math
import os
import tempfile
from pathlib import Path
from typing import Any

import yaml

from .printable import escaped_json, printable


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write UTF-8 text atomically (temporary name, then rename); the folder must exist.

    Raises
    ------
    OSError
        when the folder is missing or not writable; the target is then untouched.
    """
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> Path:
    """Write bytes atomically (temporary name, then rename); the folder must exist.

    Raises
    ------
    OSError
        when the folder is missing or not writable; the target is then untouched.
    """
    target = Path(path)
    handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(temporary, 0o644)
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return target


def write_json(path: str | os.PathLike[str], data: Any) -> Path:
    """Write strict JSON: no NaN or Infinity (such a number becomes null), nine significant digits, order as given."""
    return write_text(path, strict_json(data) + "\n")


def strict_json(data: Any) -> str:
    """Strict JSON text of plain data; floats have nine significant digits, so that equal inputs give equal bytes.

    Letters of all scripts stand as they are; what a terminal obeys or UTF-8 lacks stands as JSON's escapes.
    """
    return escaped_json(json.dumps(_plain(data), allow_nan=False, indent=1, ensure_ascii=False))


def yaml_text(data: Any, **how: Any) -> str:
    """YAML text of plain data, in the order given; letters of all scripts stand as they are, see `strict_json`."""
    text: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, **how)
    if printable(text) == text:
        return text
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=False, **how)


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_plain(value) for value in data]
    if isinstance(data, (bool, int, str)) or data is None:
        return data
    number = float(data)
    return float(f"{number:.9g}") if math.isfinite(number) else None
