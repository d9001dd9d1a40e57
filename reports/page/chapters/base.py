"""What a chapter of the report page is: a place on the page, and a function from a run's files to HTML."""

from collections.abc import Callable
from dataclasses import dataclass

from ...run_contents import RunFolder
from ..markup import Html


@dataclass(frozen=True, slots=True)
class Chapter:
    """A chapter.

    Attributes
    ----------
    place : where it stands, low numbers first; those of the page are tens, so that there is room between two
    write : its HTML, from the files of a run folder alone; empty where it has nothing to say
    """

    place: int
    write: Callable[[RunFolder], Html]
