"""The page of times: each script writes its own section, and leaves the others as they are."""

import importlib
from pathlib import Path

import pytest
from places import ROOT


def test_a_section_is_written_anew_and_the_others_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    write = importlib.import_module("marked_section").write_section
    page = tmp_path / "page.md"
    write(page, "speed", r"one \1", "# Title")
    write(page, "fleets", "two")
    write(page, "speed", r"three \2")
    told = page.read_text("utf-8")
    assert told.startswith("# Title\n\n<!-- speed")
    assert "one" not in told
    assert told.index(r"three \2") < told.index("two")
    write(page, "fleets", "two")
    assert page.read_text("utf-8") == told
    for name in ("speed", "fleet"):
        assert "write_section(chosen.table" in (ROOT / "benchmarks" / f"{name}.py").read_text("utf-8")
    assert "<!-- speed: written by a script -->" in (ROOT / "docs" / "performance.md").read_text("utf-8")
