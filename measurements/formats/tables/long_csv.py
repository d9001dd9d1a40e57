"""Long CSV: a bag flattened to time, topic, field, value."""

from ..base import Format, Head
from .tables import is_long
from .text_tables import read_text


def _matches(head: Head) -> bool:
    return is_long(head.text.columns, head.clock)


LONG_CSV = Format("long CSV", _matches, read_text, (".csv", ".gz"), marked=False, table=True)
