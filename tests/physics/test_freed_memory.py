"""What a stage has freed is the system's again."""

import gc
from pathlib import Path

import numpy as np
import pytest

from undertow.physics import stage as freed_memory
from undertow.physics.stage import trim_memory


def resident() -> int:
    """Memory of this program [bytes]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return 1024 * int(line.split()[1])
    pytest.skip("no VmRSS in /proc/self/status; this needs Linux")


def test_what_lies_between_blocks_in_use_is_handed_back():
    size = 64_000  # too small for a mapping of its own
    blocks = [np.ones(size // 8) for _ in range(2000)]
    kept = blocks[::40]
    full = resident()
    del blocks
    gc.collect()
    trim_memory()
    assert resident() < full - 0.9 * size * (2000 - len(kept))


def test_another_c_library_is_left_alone(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(freed_memory.ctypes, "CDLL", lambda name: object())
    trim_memory()
