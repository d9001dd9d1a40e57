"""Models that know the rows on which they are judged are named, and so are those of which nobody can know."""

import io
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from rich.console import Console

from undertow.comparison.facts import Comparison
from undertow.comparison.models_by_name import fitted_notes, fitted_to, load_model
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.errors import RequestError
from undertow.physics.sources import with_sources
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.reports.terminal.comparison_screen import comparison_table, notes_list
from undertow.residuals.models.base import Model, VehicleModel
from undertow.workflows.compare import compare
from undertow.workflows.discover_and_add import add
from undertow.workflows.fit import fit
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.write import write_run
from undertow.workflows.train import Choice, train

HULL = load_vehicle("blueboat")
LACKS = ["surge_quadratic_damping"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log with a run and a network of it, the same log under another name, and another log under the same name."""
    folder = tmp_path_factory.mktemp("place")
    for seed, name in ((2, "mon.csv"), (3, "other/mon.csv")):
        (folder / name).parent.mkdir(exist_ok=True)
        simulate_world(HULL, {"surge_quadratic_damping": -12.0}, duration=100.0, seed=seed).write(folder / name)
    shutil.copy(folder / "mon.csv", folder / "copy.csv")
    write_run(add(LACKS, read_inputs(folder / "mon.csv", HULL, judge="test")), folder / "mon", report=False)
    write_run(add(LACKS, read_inputs(folder / "mon.csv", HULL)), folder / "all", report=False)
    HULL.save(folder / "hand.yaml")
    with_sources(HULL, HULL.with_values({"X_u": -5.0}), "fitted by undertow to mon.csv (weak form)").save(
        folder / "fitted.yaml"
    )
    return folder


def notes(place: Path, log: str, judge: str, *models: str) -> list[str]:
    inputs = read_inputs(place / log, HULL, judge=judge)
    return told(inputs, *(place / name for name in models))


def told(inputs: Inputs, *paths: Path) -> list[str]:
    return told_of(inputs, *((str(path), load_model(path, HULL)) for path in paths))


def told_of(inputs: Inputs, *models: tuple[str, Model]) -> list[str]:
    return fitted_notes(fitted_to(models, inputs.paths), inputs.parts.judge)


@pytest.mark.parametrize("judge", ["train", "validation", "all"])
def test_a_run_that_was_fitted_to_the_judged_rows_is_named(place: Path, judge: str):
    (note,) = notes(place, "mon.csv", judge, "mon")
    assert note == (
        "mon was fitted to rows that are judged here, of mon.csv: errors there are too small, and do not count"
    )


def test_a_log_is_known_by_its_content_under_any_name(place: Path):
    assert "of copy.csv" in notes(place, "copy.csv", "all", "mon")[0]
    assert notes(place, "other/mon.csv", "all", "mon") == []


@pytest.mark.parametrize("model", ["all", "all/model.yaml"])
def test_a_run_that_folds_judged_was_fitted_to_the_test_part_too(place: Path, model: str):
    (note,) = notes(place, "mon.csv", "test", model)
    assert note == "all was fitted to rows that are judged here, of mon.csv: errors there are too small"
    assert notes(place, "other/mon.csv", "all", model) == []


def test_other_words_of_a_source_do_not_say_that_a_whole_log_was_fitted(place: Path):
    """That they were all used is said of many things."""
    towed = HULL.model_copy(update={"sources": {"mass": "the mean of all of the weighings"}})
    fitted = with_sources(towed, towed.with_values({"X_u": -5.0}), "fitted by undertow to mon.csv (weak form)")
    inputs = read_inputs(place / "mon.csv", HULL)
    (note,) = told_of(inputs, ("", VehicleModel(fitted, "fitted", "physics")))
    assert "but not to the test part" in note


def test_the_test_part_of_the_same_log_was_not_fitted_and_that_is_said(place: Path):
    (note,) = notes(place, "mon.csv", "test", "mon")
    assert "fitted to the earlier parts of mon.csv, but not to the test part" in note


def test_a_vehicle_file_that_was_fitted_is_known_by_its_sources(place: Path):
    (note,) = notes(place, "other/mon.csv", "all", "fitted.yaml")
    assert note.startswith("fitted may have been fitted to rows that are judged here, of a log of the same name (mon")
    nominal = load_vehicle(place / "fitted.yaml")
    inputs = read_inputs(place / "mon.csv", nominal, judge="all")
    assert told_of(inputs, ("", VehicleModel(nominal, "nominal", "physics")))[0].startswith("nominal may have")


def test_of_other_models_nobody_can_know(place: Path):
    (note,) = notes(place, "mon.csv", "test", "hand.yaml")
    assert note == ("whether hand was fitted to the judged rows cannot be known: no file of it says to which logs")


def test_compare_has_the_notes_and_names_the_model_of_a_run_by_its_folder(place: Path):
    found = compare(
        read_inputs(place / "mon.csv", HULL, judge="all"),
        [place / "mon" / "model.yaml", place / "hand.yaml", place / "fitted.yaml"],
    )
    assert {m.name: m.fitted_here for m in found.models[-3:]} == {"mon": True, "hand": False, "fitted": True}
    assert found.best.model not in ("mon", "fitted"), "who saw the judged rows is not trusted by them"
    assert any(note.startswith("mon was fitted to rows that are judged here") for note in found.notes)
    assert any(note.startswith("whether hand was fitted") for note in found.notes)
    assert any(note.startswith("calibrated was fitted to rows") for note in found.notes)
    printed = io.StringIO()
    Console(file=printed, width=200).print(notes_list(found))
    assert "- mon was fitted to rows" in printed.getvalue()
    assert "- Whether hand was fitted" in printed.getvalue()


def test_on_the_test_part_a_vehicle_file_that_was_fitted_to_all_of_a_log_is_not_trusted(place: Path):
    whole = with_sources(HULL, load_vehicle(place / "all" / "model.yaml"), "identified by undertow from all of mon.csv")
    whole.save(place / "whole.yaml")
    found = compare(read_inputs(place / "mon.csv", HULL, judge="test"), [place / "whole.yaml"])
    assert found.models[-1].fitted_here
    assert found.best.model != "whole"


def test_a_network_is_known_by_the_logs_it_was_trained_on(place: Path):
    pytest.importorskip("torch")
    from undertow.cli.train_verb import settings_with

    inputs = read_inputs(place / "mon.csv", HULL)
    train(inputs, Choice("mlp", {"units": 4}), settings=settings_with(epochs=1, decline=0), out=place / "net")
    assert told(read_inputs(place / "copy.csv", HULL, judge="all"), place / "net")[0].startswith("net was fitted to")
    assert told(read_inputs(place / "other/mon.csv", HULL, judge="all"), place / "net") == []


@pytest.fixture(scope="module")
def judged(place: Path) -> Callable[..., Comparison]:
    """A function that compares a run, judged by a test part, on logs; each is asked for once."""

    @cache
    def of(*logs: str, judge: str | None = None, model: str = "mon") -> Comparison:
        return compare(read_inputs([place / log for log in logs], HULL, judge=judge), [place / model])

    return of


def test_a_log_outside_the_run_is_judged_whole(place: Path, judged: Callable[..., Comparison]):
    found = judged("other/mon.csv")
    assert found.split == "all"
    (whole,) = read_inputs(place / "other/mon.csv", HULL, judge="all").parts.judged.motions
    assert whole.duration == pytest.approx(100.0, abs=0.5)
    starts = {key: rolled.starts for key, rolled in found.models[0].rollout.items()}
    # One every half second wherever there is room: no boundary between parts is in the way.
    assert starts == {key: pytest.approx(2.0 * (whole.duration - float(key)), abs=2.0) for key in ("2", "10", "30")}
    assert found.best.model == "mon"


@pytest.mark.parametrize(
    ("logs", "rows"), [(("mon.csv",), "test"), (("copy.csv",), "test"), (("copy.csv", "other/mon.csv"), "test")]
)
def test_a_log_of_the_run_is_judged_as_before_under_any_name(judged: Callable[..., Comparison], logs: str, rows: str):
    assert judged(*logs).split == rows


def test_who_asks_for_rows_gets_them(judged: Callable[..., Comparison]):
    assert judged("other/mon.csv", judge="validation").split == "validation"


def test_of_a_vehicle_file_only_another_name_tells_that_it_is_of_another_log(judged: Callable[..., Comparison]):
    assert judged("other/mon.csv", model="fitted.yaml").split == "test"
    assert judged("copy.csv", model="fitted.yaml").split == "all"
    assert judged("copy.csv", model="hand.yaml").split == "test"


def test_models_that_were_fitted_to_the_judged_rows_are_marked_and_do_not_count(judged: Callable[..., Comparison]):
    outside, own = judged("other/mon.csv"), judged("mon.csv", judge="all")
    assert [model.name for model in outside.models if model.fitted_here] == ["calibrated"]
    assert [model.name for model in own.models if model.fitted_here] == ["calibrated", "mon"]
    assert own.best.model in ("", "nominal")
    assert own.structure[-1].model != "mon" or not any(place.removed_by for place in own.failures)
    printed = io.StringIO()
    Console(file=printed, width=200).print(comparison_table(outside.models, outside.split))
    assert "calibrated *" in printed.getvalue()
    assert "* beside a name: fitted to rows that are judged" in printed.getvalue()


def test_a_model_of_other_logs_is_judged_whole_beside_one_that_was_fitted_here(place: Path):
    run = place / "other-run"
    inputs = read_inputs(place / "other/mon.csv", HULL)
    write_run(add(LACKS, inputs), run, report=False)
    found = compare(inputs, [place / "mon", run])
    assert found.split == "all"
    assert [model.name for model in found.models if model.fitted_here] == ["calibrated", "other-run"]
    assert found.best.model == "mon"
    assert any(note.startswith("other-run was fitted to rows that are judged here") for note in found.notes)


@pytest.mark.parametrize("verb", [fit, train])
def test_all_rows_leave_none_to_fit_to(place: Path, verb: Callable[..., object]):
    with pytest.raises(RequestError, match=r"expected a part of the logs to judge on \(test\), got all"):
        verb(read_inputs(place / "mon.csv", HULL, judge="all"), *[Choice("mlp")] * (verb is train))
