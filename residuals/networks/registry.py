"""All networks by name: what `train --residual` offers and a model file may hold."""

import inspect
from collections.abc import Mapping
from difflib import get_close_matches

from ...physics.errors import RequestError
from ...physics.registry_members import classes_in
from .. import networks
from .base import Network, Scaling

NETWORKS: dict[str, type[Network]] = {cls.name: cls for cls in classes_in(networks, Network)}
"""Every `Network` that a file of this folder defines."""

LARGEST = {
    "units": 4096,
    "layers": 16,
    "heads": 64,
    "window": 4096,
    "kernel": 64,
    "gain": 10.0,
    "leaves": 256,
    "activation": 2,
    "stores": 64,
    "filters": 6,
}
"""Largest value of each option; a file that asks for more is damaged or hostile."""


_MANY = 4096
"""The same for an option that has no line above."""
_NONE = ("filters",)
"""Options of which there may be none."""


def default_options(name: str) -> dict[str, int | float]:
    """Options of a network and what they are when nothing is said.

    Raises
    ------
    RequestError
        for an unknown network, naming the nearest.
    """
    parameters = inspect.signature(network_named(name)).parameters.values()
    return {p.name: p.default for p in parameters if p.kind is inspect.Parameter.KEYWORD_ONLY}


def build(name: str, scaling: Scaling, options: Mapping[str, int | float] | None = None) -> Network:
    """Make a network by name, with fresh weights from torch's generator.

    Parameters
    ----------
    name : of the kind
    scaling : physical constants
    options : sizes of the kind, by name

    Raises
    ------
    RequestError
        for an unknown network or option, naming the nearest, or a value that it cannot take.
    """
    known = default_options(name)
    chosen = dict(options or {})
    for option, value in chosen.items():
        if option not in known:
            raise _unknown(f"network {name}: unknown option", option, known)
        whole = isinstance(known[option], int)
        most = LARGEST.get(option, _MANY)
        fits = isinstance(value, int if whole else int | float) and not isinstance(value, bool)
        if not fits or not 0 <= value <= most or (value == 0 and option not in _NONE):
            kind, least = "a whole number" if whole else "a number", "[" if option in _NONE else "("
            raise RequestError(f"network {name}: expected {kind} in {least}0, {most:g}] for {option}, got {value!r}")
    return network_named(name)(scaling, **known | chosen)  # type: ignore[arg-type]


def network_named(name: str) -> type[Network]:
    """A network by its name.

    Raises
    ------
    RequestError
        for an unknown one, naming the nearest.
    """
    name = str(name).lower()
    if name not in NETWORKS:
        raise _unknown("unknown network", name, NETWORKS)
    return NETWORKS[name]


def _unknown(what: str, name: str, known: Mapping[str, object]) -> RequestError:
    near = get_close_matches(str(name), known, n=1, cutoff=0.0)
    return RequestError(f"{what} {name!r}: did you mean {near[0]!r}? There are: {', '.join(known)}")
