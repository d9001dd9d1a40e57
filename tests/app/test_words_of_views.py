"""What views say of the model that is shown, of the log, and of what nobody measured; without a browser."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the workbench needs nicegui: pip install '.[app]'")

from undertow.app.shown import OnLog, Shown
from undertow.app.steps import FileNames, History, Step
from undertow.app.views.hero import worst
from undertow.app.views.words import headline, how_well, in_a_line, leans_on, search_sentence, stair_name
from undertow.app.worker_client import Observers, Work, WorkerClient
from undertow.physics.vehicle import load_vehicle, shipped_vehicles
from undertow.workflows.first_vehicle import with_corrections
from undertow.workflows.log_view import assumed_of, form_of
from undertow.workflows.workbench_facts import Assumed, Check, Fit, ModelChoice, Opened, Searched, Source, Value

DRAG, LIFT = "surge_quadratic_damping", "sway_lift"
NOMINAL = Fit((), {"position": 4.0, "surge": 0.8}, 0, {}, unseen=False)
ASSUMED = (Assumed("full thrust", ("thrust_scale",), "sure to a factor of 2.5"), Assumed("damping", ("X_u",)))
OPENED = Opened("a.csv", "boat", 60.0, (), (), (), {"time": np.zeros(1)}, (), 10.0, NOMINAL, assumed=ASSUMED)
SEARCHED = Searched("missing", "The model is missing drag and lift.", ("It betters much.",), (DRAG, LIFT), ())
AS_IT_WAS = ModelChoice()


def shown_with(stand: ModelChoice = AS_IT_WAS, fit: Fit = NOMINAL, *, searched: bool = True) -> Shown:
    audience, source = Observers(), Source()
    shown = Shown(WorkerClient(audience), audience, Path())
    shown.history, shown.fitted = History((Step(source, stand),)), OnLog(OPENED, fit)
    shown.searches = {source: SEARCHED} if searched else {}
    return shown


def fitted(*names: str, by_hand: bool = False, **error: float) -> Fit:
    return Fit(names, error, 0, {}, (Value("X_u", "drag", "", 0.0, 1.0, None, 0.0, 2.0),), unseen=not by_hand)


def test_the_headline_tells_of_the_model_that_is_shown():
    assert headline(shown_with(searched=False)).startswith("a.csv: measured")
    before = shown_with()
    assert (headline(before), search_sentence(before)) == (SEARCHED.headline, "")
    one = shown_with(ModelChoice((DRAG,)), fitted(DRAG, position=1.0))
    assert headline(one) == "With surge quadratic damping, 10 s predictions err by 1.0 m instead of 4.0 m"
    assert search_sentence(one) == f"The search: {SEARCHED.headline}"
    assert how_well(one).startswith("75")
    both = shown_with(ModelChoice((LIFT, DRAG), (("X_u", 1.0),)), fitted(LIFT, DRAG, by_hand=True, position=5.0))
    assert headline(both).startswith("With all that was found and numbers moved by hand, 10 s predictions err by 5.0 m")
    assert "on rows that a fit saw" in how_well(both)
    away = shown_with(ModelChoice((DRAG,)), replace(fitted(DRAG, position=9.0), lost=3))
    assert headline(away) == "With surge quadratic damping, 10 s predictions run away"


def test_the_step_by_hand_bears_its_own_name():
    steps = NOMINAL, fitted(DRAG, position=1.0), fitted(DRAG, by_hand=True, position=2.0)
    assert [stair_name(fit) for fit in steps] == ["as it was", "+ surge quadratic damping", "moved by hand"]


def test_what_the_result_leans_on_is_told_until_it_is_fitted():
    assert "full thrust (sure to a factor of 2.5) and damping" in leans_on(shown_with())
    after = leans_on(shown_with(ModelChoice((DRAG,)), fitted(DRAG, position=1.0)))
    assert "full thrust" in after
    assert "damping" not in after


def test_what_a_person_puts_in_is_assumed_no_more():
    vehicle = load_vehicle("otter").model_copy(
        update={"sources": {"mass": "typical, to be replaced", "damping": {"X_u": "a guess, to be replaced"}}}
    )
    assert [one.what for one in assumed_of(vehicle)] == ["mass", "damping"]
    assert [one.what for one in assumed_of(with_corrections(vehicle, {"mass": 90.0}, ()))] == ["damping"]
    port = "force: full 30 N, sure to a factor of 2.5; y: half of 0.5 m (typical, to be replaced)"
    guessed = vehicle.model_copy(update={"sources": {"thrusters": {"port": port}}})
    assert [(one.what, one.sure) for one in assumed_of(guessed)] == [
        ("full thrust", "sure to a factor of 2.5"),
        ("places of the thrusters", ""),
    ]
    assert "full 30 N" in next(field.source for field in form_of(guessed, ()).numbers if field.symbol == "thrust_scale")
    assert assumed_of(with_corrections(guessed, {"thrust_scale": 1.2}, ()), placed=True) == ()
    assert not any(assumed_of(load_vehicle(name)) for name in shipped_vehicles())


def test_the_worst_of_the_log_is_told_in_a_sentence():
    late, turned = Check("warning", "r is late by 0.4 s"), Check("defect", "newton_port is reversed", "all is wrong")
    assert worst(OPENED) == ""
    assert worst(replace(OPENED, checks=(turned, late))) == "Defect of the log: newton_port is reversed, and 1 more."
    assert worst(replace(OPENED, checks=(Check("note", "fine"),), warnings=("Both err. See.",))) == "Both err."
    assert worst(replace(OPENED, warnings=("Nothing shows.",), doubt="Nothing shows.")) == ""


@pytest.mark.parametrize("name", shipped_vehicles())
def test_a_shipped_vehicle_is_told_in_a_line(name):
    assert re.search(r": .*\d m.*, [\d.]+ kg$", in_a_line(load_vehicle(name))), name


def test_time_that_is_left_is_a_range_at_the_pace_of_the_work_itself():
    for slow in (1.0, 5.0):  # stages of the demo: idle, and on a machine that does five other things
        work = Work("", 0.0).at("searching", 0.3, 2.0 * slow).at("weighing", 0.6, 3.9 * slow)
        for end in (work, work := work.at("scoring", 0.75, 6.1 * slow), work.at("comparing", 0.82, 7.7 * slow)):
            least, most = end.left(now := end.stages[-1][1])
            assert least <= 10.0 * slow - now <= most
    assert work.at("searching again", 0.3, 40.0).left(41.0) is None


def test_names_of_uploads_are_safe_in_a_file_and_quoted_in_a_command():
    names = FileNames(Path("/tmp/x"))
    names.call(Path("/tmp/x/upload-1.csv"), "upload-2.csv")
    names.call(Path("/tmp/x/upload-2.csv"), 'a "b": <c>.csv')
    names.call(Path("/tmp/x/upload-12.csv"), "my log.csv")
    text = "/tmp/x/upload-1.csv upload-2.csv, upload-12.csv; boat of upload-12"
    assert names.with_user_names("upload-1.csv and upload-2.csv") == 'upload-2.csv and a "b": <c>.csv'
    assert names.in_file(text) == "upload-2.csv a_b_c_.csv, my_log.csv; boat of my_log"
    assert names.in_commands("undertow discover upload-2.csv") == "undertow discover 'a \"b\": <c>.csv'"
