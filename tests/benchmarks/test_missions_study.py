"""The missions' study: its page says what it leaves out, and what it reports was not looked at before."""

import importlib
import json
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from places import ROOT

HIDDEN = "munk_moment"


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    """The script as a module."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("missions")


def test_a_log_is_left_out_for_a_reason(study: ModuleType):
    left = study.Left
    assert study.left_out(HIDDEN, ()) is study.left_out(HIDDEN, (HIDDEN,)) is left.CLEAR
    assert study.left_out(HIDDEN, (HIDDEN, "a", "b", "c", "d")) is left.CROWD
    assert study.left_out(HIDDEN, ("a", "b")) is left.ABSENT
    assert study.left_out(HIDDEN, ("a", HIDDEN, "b", "c")) is None


def test_the_page_says_what_is_left_out_and_other_sources_count_for_nothing(study: ModuleType, tmp_path: Path):
    driven = {"name": "zigzag 20", "words": "", "seconds": 8.0, "probability": 0.9, "told": [True, True]}
    record = {"hidden": HIDDEN, "others": ["sway_added_mass"], "best": driven, "planned_in": 4.0}
    record |= {"fixed": {**driven, "seconds": 40.0}}
    logs = [record, *({"left_out": name} for name in ("FAMILY", "FAMILY", "CROWD", "ABSENT"))]
    kept, table = tmp_path / "reporting-2.json", tmp_path / "page.md"
    words = ["--tell", "--repeats", "2", "--folder", str(tmp_path), "--table", str(table)]
    kept.write_text(json.dumps({"source": study.fingerprint(study.PACKAGES), "logs": logs}))
    assert study.main(words) == 0
    page = table.read_text()
    assert "1 questions in 5 logs" in page
    assert (
        "Of 5 logs 4 are left out: in 2 the effect is of another family, in 1 more than 3 effects look like the one in "
        "question, in 1 the hidden effect is not in question."
    ) in page
    kept.write_text(json.dumps({"source": "another", "logs": logs}))
    study.main(words)
    assert "0 questions in 0 logs" in table.read_text()
