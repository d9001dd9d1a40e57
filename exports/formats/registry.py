"""The formats: each file `to_NAME.py` of this folder is one, and is loaded when it is asked for."""

from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from ...physics.errors import RequestError

if TYPE_CHECKING:
    from .base import Export

_FILE = "to_"
_ALSO = {
    "fmu": "fmi",
    "gazebo": "sdf",
    "js": "javascript",
    "mss": "matlab",
    "numpy": "python",
    "octave": "matlab",
    "ros2": "ros",
    "tex": "latex",
}
"""Other names that people type."""


def format_names() -> tuple[str, ...]:
    """Names of all formats, in the order of the alphabet."""
    package = import_module(__package__ or "undertow.exports.formats")
    return tuple(m.name.removeprefix(_FILE) for m in iter_modules(package.__path__) if m.name.startswith(_FILE))


def names_with_aliases() -> str:
    """Names of all formats, each with those that mean the same."""
    others = {name: [also for also, meant in _ALSO.items() if meant == name] for name in format_names()}
    return ", ".join(f"{name} (or {', '.join(also)})" if also else name for name, also in others.items())


def format_named(name: str) -> "Export":
    """A format by its name, or by another that means the same.

    Raises
    ------
    RequestError
        when there is none of that name.
    """
    names, meant = format_names(), _ALSO.get(name, name)
    if meant not in names:
        near = get_close_matches(name, (*names, *_ALSO), n=1)
        text = f": did you mean {near[0]!r}?" if near else "."
        raise RequestError(f"export: unknown format {name!r}{text} There are: {names_with_aliases()}")
    return import_module(f".{_FILE}{meant}", __package__).EXPORT
