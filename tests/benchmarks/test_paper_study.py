"""The repeated paper: verdicts by intervals over the seeds, also against the paper, and tables that others can read."""

import csv
import importlib
import io
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from places import ROOT
from training_parts import HULL, parts_of

from undertow.residuals.models.base import VehicleModel
from undertow.residuals.scores import acceleration_score

MODELS = ("Fossen calibrated", *(f"{kind} {net}" for kind in ("pure", "hybrid") for net in ("MLP", "LSTM", "TCN")))


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    """The page of the study."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("study.paper_page")


@pytest.fixture(scope="module")
def results(study: ModuleType) -> dict[str, Any]:
    """Three seeds: hybrids err half as much as the physics, which explains little of an axis, pure ones twice."""
    cases = importlib.import_module("zoo.cases")
    setting = cases.Setting("Runs that were made up", "out", lambda seed: None)
    records = []
    for seed in range(3):
        for name in MODELS:
            size = (0.5 if "hybrid" in name else 2.0 if "pure" in name else 1.0) * (1.0 + 0.01 * seed)
            errors = {"surge": size, "sway": 10.0 * size**2, "yaw": 0.1}  # ratios: x, x^2, 1
            score = {"rmse": errors, "mae": errors, "r2": {"surge": 0.99, "sway": 0.2, "yaw": 0.9}}
            held = {"acceleration": score, "unfiltered": score, "rollout": {"2": errors, "10": errors}}
            away = 4.0 if "pure" in name else 1.0
            own = held | {"acceleration": score | {"rmse": {axis: x / away for axis, x in errors.items()}}}
            records.append({"name": name, "seed": seed, "held": held, "own": own})
    return {"made up": (setting, records)}


def test_hypotheses_hold_by_their_intervals(study: ModuleType, results: dict[str, Any]):
    rows = study.hypothesis_rows(results)
    assert {row[-1] for row in rows} == {"holds"}
    assert len(rows) == 1 + 3 + 6
    sentences = list(study.verdicts(results))
    assert [sentence.partition(". ")[0].rpartition(": ")[2] for sentence in sentences] == ["holds"] * 3
    setting, records = results["made up"]
    worse = [r | {"held": records[0]["held"]} if r["name"] == "hybrid TCN" else r for r in records]
    against = list(study.verdicts({"made up": (setting, worse)}))[2]
    assert "holds in part. 4 of 6 rows say so" in against
    one = {"made up": (setting, records[: len(MODELS)])}
    assert "open. 0 of 6 rows say so, 0 the contrary, 6 neither" in list(study.verdicts(one))[2]


def test_the_page_and_its_tables_have_every_model(study: ModuleType, results: dict[str, Any]):
    page = study.document_of(results, 3, 12.0)
    assert all(name in page for name in MODELS)
    files = study.csv_files(results)
    rows = list(csv.DictReader(io.StringIO(files["metrics.csv"])))
    assert len(rows) == 2 * len(MODELS) * 2 * 3 * 3
    (found,) = [
        r
        for r in rows
        if (r["case"], r["part"], r["model"], r["prediction"], r["metric"], r["axis"])
        == ("made up", "held", "hybrid MLP", "filtered", "rmse", "sway")
    ]
    assert float(found["mean"]) == pytest.approx(2.5 * (1.0 + 1.01**2 + 1.02**2) / 3.0)
    assert found["seeds"] == "3"
    told = study.markdown_of(results, 3)
    assert told.count("| hybrid TCN | −50 % (−50 to −50) |") == len(("one step", "10 s rollouts"))
    assert "- made up: Runs that were made up\n\n## What becomes" in told
    assert set(files) == {"metrics.csv", "rollouts.csv", "hypotheses.csv", "ablations.csv"}


def test_unfiltered_predictions_are_judged_as_they_are_said(study: ModuleType):
    scored = importlib.import_module("zoo.scored")
    data, model = parts_of({"surge_quadratic_damping": -10.0}, seconds=60.0).test, VehicleModel(HULL, "hull")
    said, filtered = scored.unfiltered_score(model, data), acceleration_score(model, data)
    assert said["rmse"]["surge"] != pytest.approx(filtered.rmse[0], rel=1e-3)
    assert said["rmse"]["surge"] == pytest.approx(filtered.rmse[0], rel=0.1)
    kept = scored.drawn(model, data)
    assert np.shape(kept["said"]) == np.shape(kept["measured"])
