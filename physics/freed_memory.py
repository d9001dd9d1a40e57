"""Memory that a stage has freed, handed back to the system before the next stage needs its own.

The C library of Linux keeps what lies between blocks that are still in use: after the search of a long log that is more
than all that the log takes.
"""

import ctypes


def hand_back() -> None:
    """Hand back all that is free; where the C library is another than GNU's, it does as it likes."""
    try:
        ctypes.CDLL(None).malloc_trim(0)
    except (OSError, TypeError, AttributeError):
        return
