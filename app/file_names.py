"""Names of files: how the user calls those of a tab, stored as no browser can choose, and whether one is a fleet."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from shlex import quote

from ..physics.errors import RequestError
from ..workflows.workbench_facts import Source

_OF_A_VERB = re.compile(r"^(init|discover|add|fit|train): ")
"""How messages of the command line begin: with the verb that nobody typed here."""
SESSION = ".json"
"""How the name of a saved session ends."""
_UNSAFE = re.compile(r"[^\w.+-]+")
"""What a file that is taken away may give a meaning: quotes, brackets, colons, commas, spaces."""


class FileNames:
    """The user's names of files in a folder; they are told, and never become a path here."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, str] = {}

    def call(self, kept: Path, name: str) -> None:
        """Say what the user calls a file of the folder."""
        self._names[kept.name] = name

    def with_user_names(self, text: str) -> str:
        """A text for the page, with the user's names in the place of those under which files are kept.

        Examples
        --------
        >>> names = FileNames(Path("/tmp/x"))
        >>> names.call(Path("/tmp/x/upload-1.csv"), "harbour.csv")
        >>> names.with_user_names("discover: /tmp/x/upload-1.csv is empty")
        'harbour.csv is empty'
        """
        return _OF_A_VERB.sub("", self._put(text, str))

    def in_commands(self, text: str) -> str:
        """Command lines with the user's names, quoted where a shell needs it."""
        return self._put(text, quote)

    def in_file(self, text: str) -> str:
        """The text of a file that is taken away, with the user's names, in which nothing has a meaning for any format.

        Examples
        --------
        >>> names = FileNames(Path("/tmp/x"))
        >>> names.call(Path("/tmp/x/upload-1.csv"), "run: 'one'.csv")
        >>> names.in_file("name: boat of upload-1, from upload-1.csv")
        'name: boat of run_one, from run_one_.csv'
        """
        return self._put(text, _plain)

    def _put(self, text: str, spelt: Callable[[str], str]) -> str:
        """Every name in its place, in one go: a user's name may look like one under which another file is kept."""
        if not self._names:
            return text
        own = {end: name for kept, name in self._names.items() for end, name in ((kept, name), _stems(kept, name))}
        kept = "|".join(re.escape(one) for one in sorted(own, key=len, reverse=True))
        pattern = re.compile(rf"(?:{re.escape(str(self._folder))}/)?(?<![\w.-])({kept})(?![\w-])")
        return pattern.sub(lambda found: spelt(own[found[1]]), text)


def _stems(kept: str, name: str) -> tuple[str, str]:
    """Both names without their ends, as a vehicle is called that is made of a log."""
    return kept.partition(".")[0], name.partition(".")[0]


def _plain(name: str) -> str:
    return _UNSAFE.sub("_", name).strip("_").lstrip("_.+-") or "file"


def fleet_in(source: Source | None) -> str:
    """The folder of the fleet that is to be opened; empty where logs are.

    Raises
    ------
    RequestError
        when a vehicle or a map is given with it.
    """
    if source is None or len(source.logs) != 1 or not os.path.isdir(source.logs[0]):
        return ""
    from ..fleet.log_sources import INDEX  # here, because the first page is there before anybody asks for a fleet

    (folder,) = source.logs
    if not os.path.isfile(os.path.join(folder, INDEX)):
        return ""
    if source.vehicle or source.channel_map or source.frame:
        raise RequestError(f"{folder}: a fleet has been read for its vehicles already; leave vehicle, map and axes out")
    return folder
