"""What the user calls the files of a tab, which are kept under names that no browser can choose."""

import re
from pathlib import Path

_OF_A_VERB = re.compile(r"^(init|discover|add|fit|train): ")
"""How messages of the command line begin: with the verb that nobody typed here."""


class FileNames:
    """The user's names of files in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, str] = {}

    def call(self, kept: Path, name: str) -> None:
        """Say what the user calls a file of the folder."""
        self._names[kept.name] = name

    def told(self, text: str) -> str:
        """A text with the user's names in the place of those under which files are kept.

        Examples
        --------
        >>> names = FileNames(Path("/tmp/x"))
        >>> names.call(Path("/tmp/x/upload-1.csv"), "harbour.csv")
        >>> names.told("discover: /tmp/x/upload-1.csv is empty")
        'harbour.csv is empty'
        """
        for kept, name in self._names.items():
            text = text.replace(f"{self._folder}/{kept}", name).replace(kept, name)
            text = text.replace(f"of {kept.split('.')[0]}", f"of {name.split('.')[0]}")
        return _OF_A_VERB.sub("", text)
