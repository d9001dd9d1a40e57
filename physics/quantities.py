"""What counts as a number in a file that a person writes, and what is said where something else stands."""

import sys
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from .printable import shortened, shown

LARGEST = 1e18
"""Largest amount of a number, in SI units: the largest ship has a moment of inertia of 1e13 kg m^2."""
_LEAST = 1e-12
"""Least amount of what must be positive: a propeller of 1 cm, counted in revolutions a minute, has some 1e-9."""
_MOST_TOLD = 8
"""Complaints about one file that are told: who mends these reads the others next."""
_TOLD = {
    "float_parsing": "expected a number",
    "float_type": "expected a number",
    "string_type": "expected a word",
    "dict_type": "expected lines of 'key: value'",
    "model_type": "expected lines of 'key: value'",
    "tuple_type": "expected a list",
    "too_short": "expected a list of at least {min_length}",
    "too_long": "expected at most {max_length} letters or entries",
    "literal_error": "expected {expected}",
    "greater_than_equal": "expected at least {ge:g}",
    "less_than": "expected less than {lt:g}",
    "union_tag_invalid": "expected {expected_tags}",
    "union_tag_not_found": "{discriminator} missing",
    "string_pattern_mismatch": "expected a letter, then letters, digits and _",
}
"""What pydantic complains about, in words that need no pydantic; anything else is told in its own."""
_NAME = 60
"""Letters of a key that are told, and compared with those that are known."""
_NEAR = 0.4
"""Likeness from which a key may be a misspelling of another: "weight" and "environment" have 0.35."""
_MEANT = {"weight": "mass", "izz": "inertia_z", "iz": "inertia_z", "inertia": "inertia_z", "thruster": "thrusters"}
"""Other people's names of keys."""


def _number(value: Any) -> Any:
    """Refuse true and false, which Python counts as 1 and 0, and what overflows; what vanishes is 0."""
    if isinstance(value, bool):
        raise ValueError("expected a number")
    try:
        amount = abs(float(value))
    except (TypeError, ValueError, OverflowError):
        amount = LARGEST * 10 if isinstance(value, int) else 0.0  # words are for pydantic to refuse
    if amount > LARGEST or amount != amount:
        raise ValueError(f"expected a finite number of at most {LARGEST:g}")
    return 0.0 if 0.0 < amount < sys.float_info.min else value


def positive(value: float) -> float:
    """Refuse what a calculation cannot divide by."""
    if value <= 0.0:
        raise ValueError("expected a number above 0")
    if value < _LEAST:
        raise ValueError(f"expected at least {_LEAST:g}")
    return value


Number = Annotated[float, BeforeValidator(_number)]
"""A finite number of an amount that a vehicle may have; true and false are none."""
Positive = Annotated[Number, AfterValidator(positive)]
"""A `Number` above zero, by which a calculation may divide."""


def complaints(items: Sequence[Any], tell: Callable[[Any], str]) -> str:
    """What pydantic complains about, in a sentence for each of the first few.

    Parameters
    ----------
    items : as `ValidationError.errors()` gives them
    tell : one of them as a sentence
    """
    more = len(items) - _MOST_TOLD
    return "; ".join([*map(tell, items[:_MOST_TOLD]), *([f"and {more} more of the kind"] if more > 0 else [])])


def complaint(item: Any, parts: Sequence[Any], meant: str = "") -> str:
    """One of pydantic's complaints as `key: what was expected, got what came`, or `key missing, what it is`.

    Parameters
    ----------
    item, parts : the complaint, and where in the file it is
    meant : what should stand there, in words
    """
    where, kind = location(parts), item["type"]
    if kind == "missing":
        return f"{where} missing{', ' * bool(meant)}{meant}"
    known = _TOLD.get(kind)
    message = item["msg"].removeprefix("Value error, ") if known is None else known.format(**item.get("ctx", {}))
    came = "" if isinstance(item["input"], dict) else f", got {shown(item['input'])}"
    return f"{where}: {message}{came}" if where else f"{message}"


def location(parts: Sequence[Any]) -> str:
    """Where in a file, with dots: `thrusters.0.curve`."""
    return ".".join(shortened(str(part), _NAME) for part in parts)


def unknown_key(key: Any, known: Iterable[str], where: str = "") -> str:
    """Say that a key is not known, and which known one is nearest."""
    names = sorted(k for k in known if "{" not in k)
    meant = _MEANT.get(str(key).lower(), str(key))
    near = [meant] if meant in names else get_close_matches(meant[:_NAME], names, n=1, cutoff=_NEAR)
    told = f"unknown key {shown(key, _NAME)}{where and ' in '}{where}"
    return f"{told}: did you mean {near[0]!r}?" if near else f"{told}; there are {shortened(', '.join(names))}"
