"""NumPy's `.npy` files: a structured array is a table, and a matrix is one whose columns have numbers for names."""

import numpy as np

from ....physics.errors import LogError
from ..base import Format, Head, Recording, Request, begins_with, find_time, in_file
from . import tables

_MAGIC = b"\x93NUMPY"


def _read_array(head: Head, request: Request) -> Recording:
    import pandas as pd

    with in_file(head.path):
        # Mapped, an array cannot be larger than its file; objects would be programs.
        array = np.load(head.path, mmap_mode="r", allow_pickle=False)
        names = array.dtype.names
        if names is None and (array.ndim != 2 or array.dtype.kind not in "biuf" or array.shape[0] < 2):
            raise LogError(
                f"expected a matrix of numbers, a row a time stamp, got {array.dtype} of shape {array.shape}"
            )
        if names is None:
            tables.check_columns(("",) * array.shape[1], head.path)
            columns = {f"column {k + 1}": np.asarray(array[:, k], dtype=float) for k in range(array.shape[1])}
        else:
            flat = [name for name in names if array.dtype[name].shape == () and array.dtype[name].kind in "biufMm"]
            columns = {name: np.ravel(array[name]) for name in flat}
        clock = find_time(tuple(columns), head.time)
        if clock is None and names is None:
            raise tables.without_names("a matrix", columns)
        if clock is None or not tables.is_wide(tuple(columns), clock) or tables.is_long(tuple(columns), clock):
            raise LogError(f"expected a column of the time, such as t, got {', '.join(columns) or 'no numbers'}")
    return tables.wide_recording([pd.DataFrame(columns)], head.path, clock)


NUMPY = Format("NumPy array", begins_with(_MAGIC), _read_array, (".npy",), library="numpy", table=True)
