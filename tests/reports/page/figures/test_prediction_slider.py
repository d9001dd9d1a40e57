"""The slider of a notebook: its error is the run's own at both ends, and without ipywidgets it is a card."""

import json
import sys
from pathlib import Path

import pytest
from added_run import HIDDEN, write_added

import undertow
from undertow.physics.errors import RequestError
from undertow.physics.registry_members import how_to_install
from undertow.reports.page.figures.plots import PredictionSlider


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("slider")
    write_added(folder, report=False)
    return folder / "run"


@pytest.fixture
def slider(folder: Path) -> PredictionSlider:
    return undertow.load_run(folder).plot.slider("X_uu")


def test_both_ends_have_the_errors_of_the_run(folder: Path, slider: PredictionSlider) -> None:
    findings = json.loads((folder / "findings.json").read_text())
    assert [step["added"] for step in findings["steps"]] == [None, HIDDEN]
    before, after = (step["rollout_rmse"]["10"]["position"] for step in findings["steps"])
    assert slider.error == pytest.approx(after, rel=1e-4)
    assert slider.at(slider.knob.before).error == pytest.approx(before, rel=1e-4)
    assert slider.at(0.5 * (slider.knob.before + slider.knob.after)).error < 0.9 * before


def test_without_ipywidgets_it_is_a_card(slider: PredictionSlider, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    monkeypatch.setattr("undertow.reports.page.figures.plots.find_spec", lambda name: None)
    shown = slider._repr_mimebundle_(include=None, exclude=None)
    assert set(shown) == {"text/plain", "text/html"}
    assert "X_uu = " in str(shown["text/plain"])
    assert how_to_install("notebook") in str(shown["text/plain"])
    assert "<svg" in str(shown["text/html"])


def test_the_widget_predicts_anew_where_it_is_put(slider: PredictionSlider) -> None:
    pytest.importorskip("ipywidgets", reason="a slider in a notebook: pip install '.[notebook]'")
    assert "application/vnd.jupyter.widget-view+json" in slider._repr_mimebundle_()
    moves, shown = slider.widget().children
    first = shown.value
    assert moves.description == "X_uu"
    assert moves.min < slider.knob.after < slider.knob.before < moves.max
    moves.value = slider.knob.before
    assert shown.value != first
    assert shown.value == slider.at(slider.knob.before)._repr_html_()
    moves.value = slider.knob.after
    assert shown.value == first


def test_a_number_that_the_run_did_not_change_is_refused(folder: Path) -> None:
    with pytest.raises(RequestError, match="got 'N_rr'; there are X_uu"):
        undertow.load_run(folder).plot.slider("N_rr")
