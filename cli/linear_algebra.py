"""On how many threads NumPy's linear algebra runs while a verb does."""

import os


def one_thread() -> None:
    """On one, unless the user says otherwise; NumPy is told before it is loaded.

    Matrices here are small: threads wait for each other, and do so at full speed, on the processor that a second
    process needs. PyTorch has threads of its own.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
