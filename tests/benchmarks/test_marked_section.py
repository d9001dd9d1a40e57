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
    page = (ROOT / "docs" / "performance.md").read_text("utf-8")
    for name, kind in (("speed", "speed, an answer"), ("fleet", "fleets, workers")):
        assert "measure_parts(asked, chosen.table" in (ROOT / "benchmarks" / f"{name}.py").read_text("utf-8")
        assert f"<!-- {kind}: written by a script -->" in page


def test_each_part_is_measured_into_a_section_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    measured = importlib.import_module("measured")
    page = tmp_path / "page.md"

    def told(value: float):
        return lambda figures: figures.tell("an answer", value, 2.0, "s")

    assert not measured.measure_parts({"one": told(1.0), "two": told(1.5)}, page, "Speed", "speed.py")
    assert measured.measure_parts({"two": told(3.0)}, page, "Speed", "speed.py", "Wall times.")
    text = page.read_text("utf-8")
    assert "| an answer | 1 s | 2 s | holds |" in text
    assert "| an answer | 3 s | 2 s | **broken** |" in text
    assert "1.5" not in text
    assert "just before. Wall times." in text
