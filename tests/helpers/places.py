"""Where the repository lies, whatever folder a test stands in, and the logs that may lie beside it."""

import os
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


_LOOP = compile("total = 0\nfor step in range(1_000_000): total += step", "<loop>", "exec")
_COMMON = 0.075
"""Seconds that this loop takes a common machine of two cores that does nothing else."""


def slowness() -> float:
    """How many times as long as on a common machine that does nothing else a second's work takes here and now.

    The product of two: how many programs want each processor, and how long a bare loop takes, the quickest of five.
    A machine that is quicker counts as a common one, so no limit is below what is promised.
    """
    took = []
    for _ in range(5):
        begun = time.perf_counter()
        exec(_LOOP, {})
        took.append(time.perf_counter() - begun)
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1)) * max(1.0, min(took) / _COMMON)


def shared(name: str) -> Path:
    """A folder of logs beside the repository; a test that asks for one that is not there is skipped, and says so."""
    folder = ROOT.parent / "shared" / "data" / name
    if not folder.is_dir():
        pytest.skip(f"these logs are not beside the repository (../shared/data/{name})")
    return folder
