"""The picture of the house shows the imports as they are, and the page beside it leads to files of every floor."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def architecture(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module("architecture")


def test_the_picture_is_that_of_the_imports(architecture):
    assert architecture.PICTURE.read_text("utf-8") == architecture.draw(), "run python docs/architecture.py"


def test_a_station_that_no_import_reaches_is_told(architecture, monkeypatch):
    monkeypatch.setitem(architecture.WAY, "cli/console", "the terminal")
    with pytest.raises(SystemExit, match="no import leads a log to cli/console"):
        architecture.draw()


def test_the_floors_are_ordered_by_their_imports(architecture):
    floors = architecture.between_floors(architecture.imports())
    order = architecture.levels(floors)
    assert order[0] == "physics"
    assert order[-1] == "cli"
    with pytest.raises(SystemExit, match="circle: \\['a', 'b'\\]"):
        architecture.levels({"a": {"b"}, "b": {"a"}})


def test_five_files_of_every_floor_are_told(architecture):
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    told = {chapter.split("\n", 1)[0]: re.findall(r"^\| `(\S+)`", chapter, re.M) for chapter in page.split("\n## ")[1:]}
    assert list(told) == architecture.levels(architecture.between_floors(architecture.imports()))
    for floor, files in told.items():
        there = [path for path in (ROOT / floor).rglob("*.py") if path.name != "__init__.py"]
        assert len(files) == min(5, len(there)), floor
        assert all((ROOT / file).is_file() for file in files), floor
