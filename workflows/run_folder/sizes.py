"""What is asked of the JSON files of a run folder beyond their records: numbers, texts and lists of sensible size."""

import math
from typing import Any

from ...physics.printable import shown

LARGEST = 1e15
"""No quantity of a boat or its log is larger, in SI units; drawings end in overflow far above."""
_LONGEST = 20_000
"""Letters of one text: a page has 3,000 a screen."""
_MOST = 20_000
"""Entries of one list: a year of logs has fewer."""


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
        if isinstance(value, str) and len(value) > _LONGEST:
            raise ValueError(_told(where, f"a text of at most {_LONGEST} letters", value))
        if isinstance(value, int | float) and not (math.isfinite(value) and abs(value) <= LARGEST):
            raise ValueError(_told(where, f"a number of at most {LARGEST:g}", value))
        if isinstance(value, list | dict) and len(value) > _MOST:
            raise ValueError(f"expected at most {_MOST} entries in {where or 'the file'}, got {len(value)}")
        if isinstance(value, list):
            rest += [(f"{where}[{index}]", part) for index, part in enumerate(value)]
        elif isinstance(value, dict):
            rest += [(f"{where}.{shown(key, 60)[1:-1]}".lstrip("."), part) for key, part in value.items()]


def _told(where: str, expected: str, value: object) -> str:
    return f"expected {expected} in {where or 'the file'}, got {shown(value)}"
