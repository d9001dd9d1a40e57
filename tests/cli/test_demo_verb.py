"""The verb `demo` from the packaged log to its page, run once: what it tells, what it writes, and what it finds."""

from pathlib import Path
from typing import Any

import pytest
from verbs import done, files, strict

from undertow.physics.vehicle import load_vehicle


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("demo") / "run"


@pytest.fixture(scope="module")
def told(folder: Path) -> str:
    return done("demo", "--out", folder)


@pytest.fixture(scope="module")
def findings(told: str, folder: Path) -> dict[str, Any]:
    return strict((folder / "findings.json").read_text("utf-8"))


def test_the_story_is_told_from_the_log_to_the_page(told: str, folder: Path):
    assert told.startswith("A log of 4 minutes from a simulated BlueBoat, and a Fossen model with linear drag only.\n")
    for words in (f"Findings: {folder / 'findings.json'}", f"Corrected vehicle: {folder / 'model.yaml'}"):
        assert words in told
    assert f"Report: {folder / 'report.html'}" in told
    assert "surge quadratic damping" in told
    assert len(told.splitlines()) < 50, "one screen"


def test_a_whole_run_is_written(told: str, folder: Path):
    written = {
        "findings.json",
        "model.yaml",
        "nominal.yaml",
        "comparison.json",
        "audit.json",
        "run.json",
        "report.html",
    }
    assert written <= set(files(folder))


def test_the_quadratic_damping_of_the_simulator_is_named(findings: dict[str, Any], folder: Path):
    missing = {*findings["missing"], *findings["likely"]}
    assert {"surge_quadratic_damping", "sway_quadratic_damping"} <= missing
    (yaw,) = [c for c in findings["candidates"] if c["effect"] == "yaw_quadratic_damping"]
    assert yaw["confidence"] > 0.5, "it removes 3 % of the error, so that its name is only possible"
    assert yaw["terms"][0]["in_model"] == pytest.approx(-8.0, rel=0.1)
    assert not {"thruster_asymmetry", "steady_current"} & missing
    values = {term["symbol"]: term["value"] for one in findings["candidates"] for term in one["terms"]}
    assert values["X_uu"] == pytest.approx(-8.0, rel=0.05)
    nominal, corrected = (load_vehicle(folder / f"{name}.yaml").value("X_uu") for name in ("nominal", "model"))
    assert (nominal, corrected) == (0.0, pytest.approx(-8.0, rel=0.05))


def test_the_rollout_error_falls_to_a_third_or_less(findings: dict[str, Any]):
    before, after = (step["rollout_rmse"]["10"] for step in (findings["steps"][0], findings["steps"][-1]))
    shares = {name: after[name] / before[name] for name in ("surge", "sway", "yaw", "position")}
    assert max(shares.values()) <= 1 / 3, shares
