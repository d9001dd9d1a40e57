"""A slice of the study of hidden effects: it draws, judges, keeps, goes on, and writes its table honestly."""

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from places import ROOT

BENCHMARKS = ROOT / "benchmarks"
SLICE = ("singles", "triples", "nothing")


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    """The script as a module, its logs half as long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        script = importlib.import_module("hidden_effects")
        patch.setattr(sys.modules["study.worlds"], "DURATION", 150.0)
        yield script


@pytest.fixture(scope="module")
def slice_of_it(study: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six logs of tuning seeds, run by the script itself."""
    folder = tmp_path_factory.mktemp("study")
    assert study.main(options(folder)) == 0
    return folder


def options(folder: Path, parts: tuple[str, ...] = SLICE, logs: int = 2) -> list[str]:
    words = [word for part in parts for word in ("--part", part)]
    where = ["--folder", str(folder), "--table", str(folder / "table.md")]
    return ["--seeds", "tuning", "--size", "small", "--logs", str(logs), "--jobs", "1", *words, *where]


def records(folder: Path, parts: tuple[str, ...] = SLICE) -> list[dict[str, Any]]:
    kept = [json.loads((folder / "tuning-small" / f"{part}.json").read_text(encoding="utf-8")) for part in parts]
    return [record for part in kept for record in part["records"]]


def test_discovery_names_what_is_hidden_in_a_slice(study: ModuleType, slice_of_it: Path):
    found = records(slice_of_it)
    assert [len(r["hidden"]) for r in found] == [1, 1, 3, 3, 0, 0]
    assert all(study.exact(r) for r in found)
    terms = [term for r in found for term in r["terms"]]
    assert len(terms) >= 8
    assert max(term["error"] for term in terms) < 0.15
    assert all(r["rollout"] < 1.1 for r in found if r["hidden"])
    assert all(share > 0.01 for r in found for share in r["matters"].values())


def test_a_study_goes_on_where_it_was(study: ModuleType, slice_of_it: Path, monkeypatch: pytest.MonkeyPatch):
    page = (slice_of_it / "table.md").read_bytes()

    def refuse(part: str, first: int, number: int) -> dict[str, Any]:
        raise AssertionError(f"seed {first + number} was judged again")

    monkeypatch.setattr(study, "judge", refuse)
    study.main(options(slice_of_it))
    assert (slice_of_it / "table.md").read_bytes() == page
    monkeypatch.setattr(sys.modules["study.resumed"], "fingerprint", lambda packages: "another source")
    with pytest.raises(AssertionError, match="seed 0 was judged again"):
        study.main(options(slice_of_it))


def test_seeds_of_parts_and_purposes_are_apart(study: ModuleType):
    (tuning, block), (reporting, other) = study.SEEDS["tuning"], study.SEEDS["reporting"]
    assert tuning + len(study.PARTS) * block <= min(1_000, reporting)
    assert max(part.full for part in study.PARTS.values()) <= min(block, other)


def test_the_table_says_what_does_not_hold(study: ModuleType, tmp_path: Path):
    assert study.main(options(tmp_path, SLICE[:1], 1)) == 0
    (good,) = records(tmp_path, SLICE[:1])
    name = next(iter(good["hidden"]))
    rival = {"of": name, "by": ["sway_trim", "mean_wind"], "worse": 3.2}
    bad = {
        **good,
        "missing": ["yaw_trim"],
        "first": "yaw_trim",
        "standing": {name: "possible"},
        "possible": [name],
        "terms": [],
        "scores": {"truth": 12.0, "selected": 10.0, "nothing": 90.0, "worth": {}, "rival": rival},
    }
    page = study.table({"singles": [good, bad]}, "tuning")
    assert "Written by `benchmarks/hidden_effects.py` (tuning seeds, 2 logs of the full study's" in page
    assert "| one effect, rich, field | 2 | 50.0% | 50.0% | 50.0% | 50.0% | 0.50 | 50.0% | 100.0% |" in page
    assert "| one effect, field: exact set | at least 97% | 50.0% | **no** |" in page
    assert "| three effects: exact set | at least 97% | not run |  |" in page
    assert f"| {name} | yaw_trim | {name} | +2.0 | sway_trim and mean_wind in place of {name}: +3.2 |" in page
    told = "Three effects: a judge who knows what is hidden could name it exactly in 1 of 2 (50.0%)"
    assert told in study.table({"triples": [good, bad]}, "tuning")
    assert study.table({"singles": [good]}, "tuning").endswith("None.\n")
