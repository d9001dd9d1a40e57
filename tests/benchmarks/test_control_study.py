"""The closed-loop study's page: intervals, what holds so far, which boats were steered, and by which source."""

import importlib
import json
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from places import ROOT

pytest.importorskip("casadi", reason="what controllers plan with: pip install '.[export]'")
BETTER = {0: 0.5, 1: 0.25, 2: 0.125}
"""Share of the nominal error that the corrected model has, by boat."""


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    """The script as a module."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("control")


def row(model: str, error: float, **more: Any) -> dict[str, Any]:
    figures = {"effort": 0.5, "off_lane": 0.0, "at_limit": 0.0, "step": 1.0, "slow_step": 2.0, "unsolved": 0, "lost": 0}
    return {"model": model, "controller": "los", "track": "square", "rmse": error, **figures, **more}


def keep(folder: Path, seed: int, source: str) -> None:
    rows = [row("nominal", 1.0), row("corrected", BETTER[seed]), row("perfect", BETTER[seed])]
    rows += [row("calibrated", 1.0, copied=True)] if seed == 0 else []
    rows += [row("hybrid lstm", 3.0)] if seed == 0 else []
    (folder / f"hidden-{seed}.json").write_text(json.dumps({"source": source, "rows": rows, "told": {}}))


def cells(page: str, first: str) -> list[str]:
    (line,) = [line for line in page.splitlines() if line.startswith(f"| {first}")]
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_a_part_of_the_boats_holds_so_far_and_one_boat_has_no_interval(study: ModuleType, tmp_path: Path):
    for seed in BETTER:
        keep(tmp_path, seed, "one" if seed else "other")
    table = tmp_path / "page.md"
    words = ["--kind", "hidden", "--tell", "--folder", str(tmp_path), "--table", str(table)]
    assert study.main([*words, "--boats", "4", "--networks", "lstm"]) == 0
    page = table.read_text()
    half = 4.303 * np.log(2.0) / np.sqrt(3.0)
    between = f"0.25 ({0.25 * np.exp(-half):.2f} to {0.25 * np.exp(half):.2f})"
    asked = cells(page, "los: corrected against nominal")
    assert asked[0].endswith(f"3 boats, {between}")
    assert asked[3] == "holds so far"
    assert cells(page, "corrected |")[1:5] == ["3", "0.250", "1.000", between]
    assert cells(page, "hybrid lstm |")[1:6] == ["1", "3.000", "1.000", "3.00", "6.00"]
    assert cells(page, "calibrated |")[1] == "1, 1 as nominal"
    assert "`python benchmarks/control.py --boats 4 --first 0 --kind hidden --networks lstm --tell`" in page
    assert "steered by different sources: 1 by other, 2 by one." in page
    assert study.main([*words, "--boats", "3"]) == 0
    assert cells(table.read_text(), "los: corrected against nominal")[3] == "holds"


def test_a_boat_of_another_source_is_steered_anew(study: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    keep(tmp_path, 0, "one")
    asked: list[int] = []

    def models(case: Any, seed: int, networks: Any, done: set[str]) -> Any:
        asked.append(len(done))
        return ()

    monkeypatch.setattr(study, "models", models)
    for source in ("one", "another"):
        study.steer("nothing", 0, ("lstm",), tmp_path / "hidden-0.json", source)
    assert asked == [0]
