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


_OF_THRUSTERS = {"force": "thrust_scale", "y": "arm_scale"}
"""The parts of a thruster's source that are about numbers, and the parameter by which all thrusters have another."""


def assumed(vehicle: Vehicle) -> dict[str, str]:
    """Which numbers of a vehicle are assumed, by symbol, each with what its source says of how sure it is.

    Thrust and places of the thrusters stand under `thrust_scale` and `arm_scale`, numbers without a source of their own
    under `all`. What was identified or given since is not assumed any more.

    >>> from undertow.physics.vehicle import load_vehicle
    >>> port = {"port": "force: full 33 N, typical, sure to a factor of 2.5; x: given"}
    >>> sources = {"mass": "typical, to be replaced: 14 kg", "thrusters": port}
    >>> assumed(load_vehicle("otter").model_copy(update={"sources": sources}))
    {'mass': 'typical, to be replaced: 14 kg', 'thrust_scale': 'full 33 N, typical, sure to a factor of 2.5'}
    """
    return {symbol: text for symbol, text in _sources(vehicle) if TO_REPLACE in text or SURE in text}


def how_sure(source: str) -> str:
    """The factor within which a source says that its number is; empty where it says none."""
    found = _SURE.search(source)
    return found[0] if found else ""


def _sources(vehicle: Vehicle) -> Iterator[tuple[str, str]]:
    """Every source as it is now, by symbol."""
    for key, entry in vehicle.sources.items():
        own = entry if isinstance(entry, dict) else {key: entry}
        for name, text in own.items():
            now = str(text).partition(EARLIER)[0]
            if key != "thrusters":
                yield name, now
                continue
            for part in now.split("; "):
                what, _, told = part.partition(": ")
                symbol = _OF_THRUSTERS.get(what)
                if symbol is not None and symbol not in own:
                    yield symbol, told
