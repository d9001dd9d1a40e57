"""What is asked of the JSON files of a run folder beyond their records: sizes, and the shape of the inspections.

A shape is `str`, `float` (a number or null), `int` (a number), `bool`, a list of one shape, a tuple of alternatives, or
a mapping from key to shape. A key that ends in `!` must be there; every other one may be missing or null. The key `*`
stands for all keys that are not named. Keys that no shape names are let pass.
"""

import math
from collections.abc import Mapping
from typing import Any

from ...physics.printable import shown

LARGEST = 1e15
"""No quantity of a boat or its log is larger, in SI units; drawings end in overflow far above."""
_LONGEST = 20_000
"""Letters of one text: a page has 3,000 a screen."""
_MOST = 20_000
"""Entries of one list: a year of logs has fewer."""

_INTERVAL = [float]

INSPECTIONS = {
    "schema!": str,
    "logs!": [
        {
            "path!": str,
            "verdict": str,
            "unused": [str],
            "notes": [str],
            "quality": [
                {
                    **dict.fromkeys(("check", "verdict", "unit", "sentence", "consequence", "remedy"), str),
                    "value": float,
                    "ci95": _INTERVAL,
                    "channels": [str],
                    "parts": {"*": (float, str)},
                }
            ],
            "channels": [
                {
                    **dict.fromkeys(("name", "unit", "origin"), str),
                    **dict.fromkeys(("count", "start", "end", "rate", "gaps", "longest_gap"), float),
                    **dict.fromkeys(("minimum", "maximum", "noise"), float),
                }
            ],
            "alignment": [
                {"first": str, "second": str, "offset": float, "correlation": float, "sentence": str, "verdict": str}
            ],
            "excitation": {
                **dict.fromkeys(("seconds", "astern", "turning_to_starboard", "turning_to_port"), float),
                "u": _INTERVAL,
                "v": _INTERVAL,
                "r": _INTERVAL,
                "sentences": [str],
            },
            "plan": {
                "recipe": {
                    **dict.fromkeys(("rate", "cutoff", "order", "max_gap", "guard"), float),
                    "commands": str,
                    "shares": [float],
                },
                "rate": float,
                "segments": [{"start": float, "end": float, "rows": float}],
                "notes": [str],
                "missing": [str],
            },
            "map": {"*": {"from": str, "frame": str, "scale": float, "offset": float}},
        }
    ],
}


def check_bounds(content: Any) -> None:
    """Refuse a number, a text or a list of a size that no file of undertow has, wherever in a file it stands.

    Raises
    ------
    ValueError
        naming the place, what was expected there, and what came.
    """
    rest: list[tuple[str, Any]] = [("", content)]
    while rest:
        where, value = rest.pop()
        if isinstance(value, str) and not _is_kind(value, str):
            raise ValueError(_told(where, _name(str), value))
        if isinstance(value, int | float) and not isinstance(value, bool) and not _is_sensible(value):
            raise ValueError(_told(where, _name(float), value))
        if isinstance(value, list | dict) and len(value) > _MOST:
            raise ValueError(f"expected at most {_MOST} entries in {where or 'the file'}, got {len(value)}")
        if isinstance(value, list):
            rest += [(f"{where}[{index}]", part) for index, part in enumerate(value)]
        elif isinstance(value, dict):
            rest += [(f"{where}.{shown(key, 60)[1:-1]}".lstrip("."), part) for key, part in value.items()]


def check_shape(value: Any, shape: Any, where: str = "") -> None:
    """Refuse a value that has another shape.

    Parameters
    ----------
    where : the place of the value in the file, such as `steps[0].added`

    Raises
    ------
    ValueError
        naming the place, what was expected there, and what came.
    """
    if isinstance(shape, tuple):
        fitting = [one for one in shape if _is_kind(value, one)]
        if not fitting:
            raise ValueError(_told(where, " or ".join(map(_name, shape)), value))
        shape = fitting[0]
    if not _is_kind(value, shape):
        raise ValueError(_told(where, _name(shape), value))
    if isinstance(shape, list):
        if len(value) > _MOST:
            raise ValueError(f"expected at most {_MOST} entries in {where}, got {len(value)}")
        for index, part in enumerate(value):
            check_shape(part, shape[0], f"{where}[{index}]")
    elif isinstance(shape, Mapping):
        _check_keys(value, shape, where)


def _check_keys(value: Mapping[str, Any], shape: Mapping[str, Any], where: str) -> None:
    named = {key.removesuffix("!"): part for key, part in shape.items()}
    for key in shape:
        if key.endswith("!") and value.get(key[:-1]) is None:
            raise ValueError(f"{where or 'the file'} lacks '{key[:-1]}'")
    if "*" in named and len(value) > _MOST:
        raise ValueError(f"expected at most {_MOST} keys in {where}, got {len(value)}")
    for key, part in value.items():
        inner = named.get(key, named.get("*"))
        if part is not None and inner is not None:
            check_shape(part, inner, f"{where}.{shown(key, 60)[1:-1]}" if where else shown(key, 60)[1:-1])


def _is_kind(value: Any, shape: Any) -> bool:
    if shape in (float, int):
        null = value is None and shape is float
        return null or (isinstance(value, int | float) and not isinstance(value, bool) and _is_sensible(value))
    if shape is str:
        return isinstance(value, str) and len(value) <= _LONGEST
    kind = bool if shape is bool else list if isinstance(shape, list) else dict
    return isinstance(value, kind)


def _is_sensible(value: float) -> bool:
    return math.isfinite(value) and abs(value) <= LARGEST


def _name(shape: Any) -> str:
    if isinstance(shape, list):
        return "a list of objects" if isinstance(shape[0], Mapping) else "a list"
    if isinstance(shape, Mapping):
        return "an object"
    return {str: f"a text of at most {_LONGEST} letters", bool: "true or false"}.get(
        shape, f"a number of at most {LARGEST:g}"
    )


def _told(where: str, expected: str, value: Any) -> str:
    return f"expected {expected} in {where or 'the file'}, got {shown(value)}"
