"""Models that know the rows on which they are judged are named, and so are those of which nobody can know."""

import io
import shutil
from pathlib import Path

import pytest
from rich.console import Console

from undertow.comparison.models_by_name import load_model
from undertow.comparison.overlap import fitted_notes
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.sources import with_sources
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.reports.terminal.comparison_screen import notes_list
from undertow.residuals.models.base import VehicleModel
from undertow.workflows.compare import compare
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.write import write_run

HULL = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log with a run and a network of it, the same log under another name, and another log under the same name."""
    folder = tmp_path_factory.mktemp("place")
    for seed, name in ((2, "mon.csv"), (3, "other/mon.csv")):
        (folder / name).parent.mkdir(exist_ok=True)
        simulate_world(HULL, {"surge_quadratic_damping": -12.0}, duration=100.0, seed=seed).write(folder / name)
    shutil.copy(folder / "mon.csv", folder / "copy.csv")
    write_run(discover(read_inputs(folder / "mon.csv", HULL, judge="test")), folder / "mon", report=False)
    write_run(discover(read_inputs(folder / "mon.csv", HULL)), folder / "all", report=False)
    HULL.save(folder / "hand.yaml")
    with_sources(HULL, HULL.with_values({"X_u": -5.0}), "fitted by undertow to mon.csv (weak form)").save(
        folder / "fitted.yaml"
    )
    return folder


def notes(place: Path, log: str, judge: str, *models: str) -> list[str]:
    inputs = read_inputs(place / log, HULL, judge=judge)
    return told(inputs, *(place / name for name in models))


def told(inputs: Inputs, *paths: Path) -> list[str]:
    return fitted_notes([(str(path), load_model(path, HULL)) for path in paths], inputs)


@pytest.mark.parametrize("judge", ["train", "validation", "all"])
def test_a_run_that_was_fitted_to_the_judged_rows_is_named(place: Path, judge: str):
    (note,) = notes(place, "mon.csv", judge, "mon")
    assert note == "mon was fitted to rows that are judged here, of mon.csv: errors there are too small"


def test_a_log_is_known_by_its_content_under_any_name(place: Path):
    assert "of copy.csv" in notes(place, "copy.csv", "all", "mon")[0]
    assert notes(place, "other/mon.csv", "all", "mon") == []


@pytest.mark.parametrize("model", ["all", "all/model.yaml"])
def test_a_run_that_folds_judged_was_fitted_to_the_test_part_too(place: Path, model: str):
    (note,) = notes(place, "mon.csv", "test", model)
    assert "fitted to rows that are judged here" in note or "may have been fitted to rows that are judged" in note


def test_other_words_of_a_source_do_not_say_that_a_whole_log_was_fitted(place: Path):
    """That they were all used is said of many things."""
    towed = HULL.model_copy(update={"sources": {"mass": "the mean of all of the weighings"}})
    fitted = with_sources(towed, towed.with_values({"X_u": -5.0}), "fitted by undertow to mon.csv (weak form)")
    inputs = read_inputs(place / "mon.csv", HULL)
    (note,) = fitted_notes([("", VehicleModel(fitted, "fitted", "physics"))], inputs)
    assert "but not to the test part" in note


def test_the_test_part_of_the_same_log_was_not_fitted_and_that_is_said(place: Path):
    (note,) = notes(place, "mon.csv", "test", "mon")
    assert "fitted to the earlier parts of mon.csv, but not to the test part" in note


def test_a_vehicle_file_that_was_fitted_is_known_by_its_sources(place: Path):
    (note,) = notes(place, "other/mon.csv", "all", "fitted.yaml")
    assert note.startswith("fitted may have been fitted to rows that are judged here, of a log of the same name (mon")
    nominal = load_vehicle(place / "fitted.yaml")
    inputs = read_inputs(place / "mon.csv", nominal, judge="all")
    assert fitted_notes([("", VehicleModel(nominal, "nominal", "physics"))], inputs)[0].startswith("nominal may have")


def test_of_other_models_nobody_can_know(place: Path):
    (note,) = notes(place, "mon.csv", "test", "hand.yaml")
    assert note == ("whether hand was fitted to the judged rows cannot be known: no file of it says to which logs")


def test_compare_has_the_notes_and_names_the_model_of_a_run_by_its_folder(place: Path):
    found = compare(
        read_inputs(place / "mon.csv", HULL, judge="all"), [place / "mon" / "model.yaml", place / "hand.yaml"]
    )
    assert [model.name for model in found.models][-2:] == ["mon", "hand"]
    assert any(note.startswith("mon was fitted to rows that are judged here") for note in found.notes)
    assert any(note.startswith("whether hand was fitted") for note in found.notes)
    assert any(note.startswith("calibrated was fitted to rows") for note in found.notes)
    printed = io.StringIO()
    Console(file=printed, width=200).print(notes_list(found))
    assert "- mon was fitted to rows" in printed.getvalue()
    assert "- Whether hand was fitted" in printed.getvalue()


def test_a_network_is_known_by_the_logs_it_was_trained_on(place: Path):
    pytest.importorskip("torch")
    from undertow.workflows.train import Choice, train
    from undertow.workflows.training_options import settings_with

    inputs = read_inputs(place / "mon.csv", HULL)
    train(inputs, Choice("mlp", {"units": 4}), settings=settings_with(epochs=1, decline=0), out=place / "net")
    assert told(read_inputs(place / "copy.csv", HULL, judge="all"), place / "net")[0].startswith("net was fitted to")
    assert told(read_inputs(place / "other/mon.csv", HULL, judge="all"), place / "net") == []
