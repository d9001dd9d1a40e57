"""Numbers of a vehicle that nobody measured or gave: its sources say so, in the words by which `init` marks them."""

import re
from collections.abc import Iterator

from .sources import EARLIER
from .vehicle import Vehicle

TO_REPLACE = "to be replaced"
"""In the source of a number that is typical of such a boat, guessed, or another boat's."""
SURE = "sure to a factor of"
"""In the source of a number that is typical in part, before the factor within which it is right in 95 of 100 cases."""
_SURE = re.compile(rf"{SURE} [\d.]*\d")


def assumed(vehicle: Vehicle) -> dict[str, str]:
    """Which numbers of a vehicle are assumed, each with how sure its source says that it is, if it does.

    Keys are symbols; "force" and "y" for thrust and places of the thrusters, "all" for all numbers without a source of
    their own. What was identified or given since is not assumed any more.

    >>> from undertow.physics.vehicle import load_vehicle
    >>> port = {"port": "force: full 33 N, sure to a factor of 2.5; x: given"}
    >>> sources = {"mass": "typical, to be replaced: 14 kg", "thrusters": port}
    >>> assumed(load_vehicle("otter").model_copy(update={"sources": sources}))
    {'mass': '', 'force': 'sure to a factor of 2.5'}
    """
    found: dict[str, str] = {}
    for key, text in _sources(vehicle):
        sure = _SURE.search(text)
        if sure or TO_REPLACE in text:
            found[key] = sure[0] if sure else found.get(key, "")
    return found


def _sources(vehicle: Vehicle) -> Iterator[tuple[str, str]]:
    """Every source as it is now, by symbol, and those of the thrusters by what they are about."""
    for key, entry in vehicle.sources.items():
        for symbol, text in entry.items() if isinstance(entry, dict) else ((key, entry),):
            now = str(text).partition(EARLIER)[0]
            if key == "thrusters":
                yield from ((what, told) for what, _, told in (part.partition(": ") for part in now.split("; ")))
            else:
                yield symbol, now
