"""The table of all log formats; a new format is one reader file and one entry here."""

from pathlib import Path

from ...physics.errors import LogError
from .base import EXPECTED, Format, Recording, read_head
from .long_csv import LONG_CSV
from .parquet import PARQUET
from .wide_csv import WIDE_CSV

FORMATS: tuple[Format, ...] = (PARQUET, LONG_CSV, WIDE_CSV)


def read_recording(path: Path) -> Recording:
    """Read `path` with the first format that recognises it.

    Raises
    ------
    LogError
        when the file is missing, empty, broken, or of no known format.
    """
    head = read_head(path)
    for form in FORMATS:
        if form.matches(head):
            return form.read(head)
    came = f"got the header '{head.separator.join(head.columns)[:120]}'" if head.columns else "got binary content"
    raise LogError(f"{path}: {came}; {EXPECTED}.")
