"""Numbers of a vehicle that are not those which their sources state: changed by hand, and the source was not."""

import math
import re
from collections.abc import Iterator

from .sources import EARLIER
from .vehicle import Vehicle

_NUMBER = r"\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_SUM = rf"(?<![\w.*/^(+])(?<![*/^(+-] )-?{_NUMBER}(?: *[-+*/] *{_NUMBER})*"
"""A number, or a calculation without brackets, that is no part of another."""
_ALONE = r"(?![\w^/*])(?! (?:m|s|rad|kg|N)\b)"
"""After a unit: no more of it."""
_SAME = 0.006
"""Share by which a number may differ from the one that its source states: sources round to three digits."""


def stale_sources(vehicle: Vehicle) -> list[str]:
    """Say which numbers differ from the one that their source states.

    A source that stands under one symbol is read, and only where one number, or one calculation without brackets, has
    just the symbol's unit in it: several may be steps of a calculation, or other things.

    >>> from undertow.physics.vehicle import load_vehicle
    >>> print(*stale_sources(load_vehicle("otter").with_values({"mass": 100.0})))
    mass is 100 kg, but its source says 55 + 25 kg = 80 kg. Correct the source, or the number.
    """
    found = []
    for symbol, source in _of_one_number(vehicle):
        unit = vehicle.parameter(symbol).unit
        stated = re.findall(rf"({_SUM}) ?{re.escape(unit)}{_ALONE}", source.partition(EARLIER)[0])
        value = vehicle.value(symbol)
        if len(stated) == 1 and not math.isclose(number := _worth(stated[0]), value, rel_tol=_SAME):
            equals = "" if re.fullmatch(rf"-?{_NUMBER}", stated[0]) else f" = {number:g} {unit}"
            found.append(
                f"{symbol} is {value:g} {unit}, but its source says {stated[0]} {unit}{equals}. Correct the source, or "
                "the number."
            )
    return found


def _of_one_number(vehicle: Vehicle) -> Iterator[tuple[str, str]]:
    """The symbols that have a source of their own, and these."""
    within = [entry for entry in vehicle.sources.values() if isinstance(entry, dict)]
    for entries in (vehicle.sources, *within):
        yield from ((key, text) for key, text in entries.items() if key in vehicle.values and isinstance(text, str))


def _worth(calculation: str) -> float:
    """What a calculation without brackets comes to.

    >>> _worth("55 * 0.2 / 80"), _worth("30.5 - 0.5"), _worth("-2 + 1")
    (0.1375, 30.0, -1.0)
    """
    total = 0.0
    for sign, product in re.findall(rf"(^-?|[-+]) *({_NUMBER}(?: *[*/] *{_NUMBER})*)", calculation):
        first, *others = re.findall(rf"([*/]?) *({_NUMBER})", product)
        worth = float(first[1])
        for operator, factor in others:
            worth = worth * float(factor) if operator == "*" else worth / (float(factor) or math.inf)
        total += -worth if sign == "-" else worth
    return total
