"""A log as it was recorded with faults, repaired without a vehicle, and sound: the runs hold the same numbers."""

import importlib
from pathlib import Path

import pytest
from places import ROOT

from undertow.reports.page.fleet import Relation, shared_numbers


def test_versions_of_one_log_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    study = importlib.import_module("two_runs")
    runs = study.versions(0, tmp_path, seconds=120.0)
    assert list(runs) == ["raw", "fixed", "sound"]
    numbers = {one.symbol: one for one in shared_numbers(list(runs.values()), list(runs))}
    assert {symbol for symbol, one in numbers.items() if one.relation in study.APART} == set()
    found = [one.number.value for one in numbers["stbd_scale"].held if one is not None]
    assert found == pytest.approx([found[0]] * 3, abs=0.02)
    assert numbers["stbd_scale"].relation is Relation.SAME
