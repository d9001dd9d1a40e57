"""Wide CSV: a row per time stamp, a column per channel."""

from ..base import Format, Head
from .tables import is_wide
from .text_tables import read_text


def _matches(head: Head) -> bool:
    return is_wide(head.text.columns, head.clock)


WIDE_CSV = Format("wide CSV", _matches, read_text, (".csv", ".gz"), marked=False, table=True)
