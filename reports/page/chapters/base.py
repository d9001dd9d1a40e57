"""The interface of a chapter of the report page: its place, and a function from a run's files to a section."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from ...run_contents import RunFolder
from ..markup import Html


class Section(NamedTuple):
    """What a chapter has to say: its title, empty for the opening of the page, its content, and a class of style."""

    title: str
    body: Html
    cls: str = ""


@dataclass(frozen=True, slots=True)
class Chapter:
    """A chapter.

    Attributes
    ----------
    place : where it stands, low numbers first; those of the page are tens, so that there is room between two
    write : its section, from the files of a run folder alone; None where it has nothing to say
    folded : details that a reader opens
    """

    place: int
    write: Callable[[RunFolder], Section | None]
    folded: bool = False
