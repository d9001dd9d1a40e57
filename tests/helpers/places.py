"""Where the repository lies, whatever folder a test stands in, and the logs that may lie beside it."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def crowding() -> float:
    """How many programs want each processor, at least one: what takes a second alone takes so many times as long."""
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def shared(name: str) -> Path:
    """A folder of logs beside the repository; a test that asks for one that is not there is skipped, and says so."""
    folder = ROOT.parent / "shared" / "data" / name
    if not folder.is_dir():
        pytest.skip(f"these logs are not beside the repository (../shared/data/{name})")
    return folder
