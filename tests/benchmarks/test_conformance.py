"""Our readers against the programs that own the formats, over the files that these write: three families."""

import importlib

import pytest
from places import ROOT


@pytest.fixture
def conformance(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return importlib.import_module("conformance")


def test_what_the_programs_write_is_read_as_they_read_it(conformance, tmp_path):
    found = {}
    for family in conformance.FAMILIES:
        folder = tmp_path / family.name
        folder.mkdir()
        told = [conformance.compared(family, path) for path in family.write(folder)]
        assert not any(told), family.name
        found[family.name] = len(told)
    print(found)
    assert found["mcap"] == 84
    assert sum(count > 0 for count in found.values()) >= 3


def test_a_lost_message_is_a_difference(conformance, tmp_path, monkeypatch):
    taken = conformance.Taken.message
    monkeypatch.setattr(conformance.Taken, "message", lambda self, n, t, raw: t != 1000 and taken(self, n, t, raw))
    (family, *_) = conformance.FAMILIES
    path = next(family.write(tmp_path))
    assert conformance.compared(family, path) == "1 of 40 messages missing, 0 too many"


def test_a_pointer_is_no_recorded_file(conformance, tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(conformance.LFS + b".github.com/spec/v1\n")
    assert conformance.compared(conformance.FAMILIES[0], path) == "pointer"
