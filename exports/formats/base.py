"""The interface of an export format: files made of a vehicle and of what is known about it.

Each file `to_NAME.py` of this folder is a format, and is loaded when it is asked for.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import TYPE_CHECKING

from ...physics.errors import RequestError, shown
from ...physics.registry_members import how_to_install

if TYPE_CHECKING:
    from ...physics.vehicle import Vehicle
    from ...residuals.models.network_model import NetworkModel
    from ..known_facts import KnownFacts


@dataclass(frozen=True, slots=True)
class Choices:
    """What may be chosen.

    Attributes
    ----------
    time_step : of the step function [s], where the format has one
    gz : whose names Gazebo's plugin elements have: those of garden and later, or of fortress
    added_mass : in Gazebo: of the plugin, or inertial, of the link's inertia, which SDF 1.10 has

    Raises
    ------
    RequestError
        for a word that is none of these.
    """

    time_step: float = 0.05
    gz: str = "garden"
    added_mass: str = "plugin"

    def __post_init__(self) -> None:
        words = (("--gz", self.gz, ("garden", "fortress")), ("--added-mass", self.added_mass, ("plugin", "inertial")))
        for option, word, known in words:
            if word not in known:
                raise RequestError(f"{option}: expected {' or '.join(known)}, got {shown(word)}")


def required(package: str) -> ModuleType:
    """A package that a format is made with.

    Raises
    ------
    RequestError
        when it is not installed.
    """
    try:
        return import_module(package)
    except ImportError as error:
        raise RequestError(f"{package} is not installed ({error}): {how_to_install('export')}") from None


@dataclass(frozen=True, slots=True)
class Given:
    """What is exported: a vehicle, what is known about it, what was chosen, and a network that corrects it."""

    vehicle: "Vehicle"
    facts: "KnownFacts"
    choices: Choices = field(default_factory=Choices)
    network: "NetworkModel | None" = None


@dataclass(frozen=True, slots=True)
class Export:
    """A format.

    Attributes
    ----------
    about : what is written, in a sentence
    suffix : of the file's name
    files : content of each file, by path; the first is the one asked for
    remark : how a remark begins and ends; empty where a file has no place for one
    left_out : what of a vehicle it does not express, in newtons; nothing of a format that expresses everything
    networks : it takes a network beside the physics or in its place, too
    """

    about: str
    suffix: str
    files: Callable[[Given, Path], Mapping[Path, bytes]]
    remark: tuple[str, str] = ("# ", "")
    left_out: Callable[[Given], Sequence[str]] = lambda given: ()
    networks: bool = False


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


def format_named(name: str) -> Export:
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
