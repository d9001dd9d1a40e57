"""The formats: each file `to_NAME.py` of this folder is one, and is loaded when it is asked for."""

from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from ...physics.errors import RequestError

if TYPE_CHECKING:
    from .base import Export

_FILE = "to_"


def format_names() -> tuple[str, ...]:
    """Names of all formats, in the order of the alphabet."""
    package = import_module(__package__ or "undertow.exports.formats")
    return tuple(m.name.removeprefix(_FILE) for m in iter_modules(package.__path__) if m.name.startswith(_FILE))


def format_named(name: str) -> "Export":
    """A format by its name.

    Raises
    ------
    RequestError
        when there is none of that name.
    """
    names = format_names()
    if name not in names:
        near = get_close_matches(name, names, n=1)
        told = f"did you mean {near[0]!r}? " if near else ""
        raise RequestError(f"export: unknown format {name!r}: {told}There are: {', '.join(names)}")
    return import_module(f".{_FILE}{name}", __package__).EXPORT
