"""Members of a room, found by a registry when somebody asks, and the command that installs a package of an extra."""

import sys
from collections.abc import Iterator
from importlib import import_module
from inspect import isabstract
from pathlib import Path
from pkgutil import walk_packages
from types import ModuleType
from typing import TypeVar

T = TypeVar("T")


def objects_in(room: ModuleType, kind: type[T]) -> tuple[T, ...]:
    """Every object of a kind that stands in a file of a room, in the order of the files' names.

    >>> from undertow.measurements import formats
    >>> from undertow.measurements.formats.base import Format
    >>> "MCAP" in [form.name for form in objects_in(formats, Format)]
    True
    """
    found = (value for module in _files(room) for value in vars(module).values() if isinstance(value, kind))
    return tuple({id(value): value for value in found}.values())


def classes_in(room: ModuleType, kind: type[T]) -> tuple[type[T], ...]:
    """Every class of a kind that a file of a room defines, abstract ones left out, in the order of the files' names."""
    return tuple(
        value
        for module in _files(room)
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, kind)
        and value.__module__ == module.__name__
        and not isabstract(value)
    )


def _files(room: ModuleType) -> Iterator[ModuleType]:
    """The modules of a package and of the packages in it."""
    for found in walk_packages(room.__path__, f"{room.__name__}."):
        yield import_module(found.name)


_HOME = Path(__file__).resolve().parents[1]


def how_to_install(extra: str, home: Path = _HOME) -> str:
    """The command that installs an extra: in a clone, with its versions, that of the clone; else that of the package.

    Parameters
    ----------
    extra : such as "logs"
    home : the package's folder; a clone is known by the pyproject.toml in it

    Examples
    --------
    >>> how_to_install("logs", Path("/usr/lib/python3/undertow"))
    "pip install 'undertow[logs]'"
    """
    if not (home / "pyproject.toml").is_file():
        return f"pip install 'undertow[{extra}]'"
    own = home / ".venv"
    pip = ".venv/bin/pip" if Path(sys.prefix).resolve() == own.resolve() and (own / "bin" / "pip").exists() else "pip"
    pinned = " -c constraints.txt" * (home / "constraints.txt").is_file()
    return f"{pip} install -e '.[{extra}]'{pinned} (in {home})"
