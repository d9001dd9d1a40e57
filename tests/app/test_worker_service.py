"""What a worker answers: a network beside the model of the present step, and readings that one goes back to."""

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from verbs import done

from undertow.app.steps import FileNames
from undertow.app.views.side_by_side import _beside
from undertow.app.worker_service import WorkerService
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.workflows.run_folder.run_files import own_run
from undertow.workflows.workbench_facts import ModelChoice, Source, Wire

DRAG = "surge_quadratic_damping"
NAMES = FileNames(Path("/nowhere"))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "log.csv"
    done("simulate", "-v", "blueboat", "--duration", "120", "--out", str(path))
    table = pd.read_csv(path, comment="#")
    table.loc[table["field"] == "r", "value"] *= 0.95
    table.to_csv(path, index=False)
    return path


def test_a_network_learns_beside_the_model_of_the_present_step(log: Path, tmp_path: Path):
    pytest.importorskip("torch", reason="networks need torch")
    desk = WorkerService()
    desk.open(Source((str(log),), "blueboat"), str(tmp_path))
    stands = ModelChoice(), ModelChoice(moved=(("X_uu", -40.0),)), ModelChoice(left=("gyro_scale",))
    first, moved, left = (desk.train("mlp", stand, 1) for stand in stands)
    assert [trained.stand for trained in (first, moved, left)] == list(stands)
    plain, by_hand, recorded = (trained.rivals[0] for trained in (first, moved, left))
    assert plain.name == "the model it learnt beside"
    assert by_hand.acceleration["surge"] > 1.5 * plain.acceleration["surge"]
    assert by_hand.acceleration["yaw"] == pytest.approx(plain.acceleration["yaw"], rel=0.2)
    assert recorded.acceleration["yaw"] != plain.acceleration["yaw"]
    assert list(plain.error) == ["position", "surge", "sway", "yaw"]  # as the headline has them


def test_the_page_says_beside_what_a_network_was_trained():
    learnt = ModelChoice((DRAG,), (("X_uu", -3.0),), ("gyro_scale",))
    told = "Trained beside the model with surge quadratic damping and X_uu = -3 by hand, read without the correction of"
    assert _beside(learnt, learnt) == f"{told} gyro scale."
    assert _beside(learnt, ModelChoice()).endswith("train again to see a network beside it.")
    assert _beside(ModelChoice(), ModelChoice()) == "Trained beside the model as its file has it."


def test_a_reading_is_there_as_it_was_left(log: Path, tmp_path: Path):
    desk, source = WorkerService(), Source((str(log),), "blueboat")
    form = desk.open(source, str(tmp_path)) and desk.form()
    fit = desk.fit(ModelChoice((DRAG,)))
    one, other = (wire.channel for wire in form.wires)
    turned = Source(source.logs, "blueboat", wires=(Wire(one, one, True), Wire(other, other, True)), as_is=True)
    desk.turn_to(turned, str(tmp_path))
    assert desk.fit(ModelChoice((DRAG,))).error["position"] > fit.error["position"]
    desk.turn_to(source, str(tmp_path))
    assert desk.fit(ModelChoice((DRAG,))) is fit
    desk.open(source, str(tmp_path))
    assert desk.fit(ModelChoice((DRAG,))) is not fit


def test_the_run_of_a_search_is_made_again_where_its_reading_is_no_longer_kept(log: Path, tmp_path: Path):
    desk, source = WorkerService(), Source((str(log),), "blueboat")
    desk.open(source, str(tmp_path))
    searched = desk.search()
    stand = ModelChoice(searched.found)
    first = json.loads(Path(desk.take("findings", stand, str(tmp_path), NAMES)).read_text("utf-8"))
    for mass in (23.0, 24.0, 25.0):
        desk.turn_to(replace(source, changed=(("mass", mass),)), str(tmp_path))
    desk.turn_to(source, str(tmp_path), searched)
    assert desk.fit(stand).names == stand.names
    again = json.loads(Path(desk.take("findings", stand, str(tmp_path), NAMES)).read_text("utf-8"))
    assert again == first


def test_an_export_is_the_model_alone_where_no_run_holds_it(log: Path, tmp_path: Path):
    desk = WorkerService()
    desk.open(Source((str(log),), "blueboat"), str(tmp_path))
    run, alone = (
        Path(desk.take("python", stand, str(tmp_path), NAMES)).read_text("utf-8")
        for stand in (ModelChoice((DRAG,)), ModelChoice((DRAG,), (("X_uu", -40.0),)))
    )
    assert "from run (" in run
    assert "from run (" not in alone
    with pytest.raises(RequestError, match="surge_quadratic_dampin"):
        desk.take("python", ModelChoice(("surge_quadratic_dampin",)), str(tmp_path), NAMES)


def test_what_is_wrong_with_a_vehicle_is_told_in_the_words_of_the_page(log: Path, tmp_path: Path, monkeypatch):
    desk = WorkerService()
    desk.open(Source((str(log),), "blueboat"), str(tmp_path))

    def refuse(*_: object) -> None:
        raise RequestError("say --as-is")

    monkeypatch.setattr("undertow.app.worker_service.with_corrections", refuse)
    assert desk.try_form({}, (), ()) == "say --as-is"


def test_a_thruster_that_is_read_turned_round_is_told_and_its_map_taken_along(log: Path, tmp_path: Path):
    """Else who takes the model away drives that side astern."""
    table = pd.read_csv(log, comment="#")
    stbd = table["field"] == "newton_stbd"
    assert stbd.any()
    table.loc[stbd, "value"] *= -1.0
    table.to_csv(tmp_path / "turned.csv", index=False)
    desk, hull = WorkerService(), (("mass", 15.0), ("length", 1.2), ("spacing", 0.59))
    opened = desk.open(Source((str(tmp_path / "turned.csv"),), hull=hull), str(tmp_path))
    assert any("newton_stbd is read turned round" in note for note in opened.notes)
    names = FileNames(tmp_path)
    names.call(tmp_path / "turned.csv", "Harbour 'A'.csv")
    desk.take("page", ModelChoice((DRAG,)), str(tmp_path), names)
    for file in (tmp_path / "run").iterdir():
        told = file.read_bytes()
        assert b"turned.csv" not in told, file
        assert str(tmp_path).encode() not in told, file
    assert "Harbour_A_.csv" in (tmp_path / "run" / "report.html").read_text("utf-8")
    assert load_vehicle(tmp_path / "run" / "nominal.yaml").name == "boat of Harbour_A"
    assert {"run.json", "findings.json", "model.yaml", "report.html"} <= own_run(tmp_path / "run")
    assert "newton_stbd: {from: " in (tmp_path / "run" / "channels.yaml").read_text()
    assert "scale: -1" in (tmp_path / "run" / "channels.yaml").read_text()


def test_nothing_is_asked_before_a_log_is_open():
    with pytest.raises(RequestError, match="no log is open; open one first"):
        WorkerService().form()
