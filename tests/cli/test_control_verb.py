"""The verb `control`: a table, a figure and strict JSON; what cannot be steered is refused with a cure."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from verbs import done, refused, strict

import undertow
from undertow.reports.page.figures.model_figures import _draw as draw

pytest.importorskip("casadi", reason="what controllers plan with: pip install '.[export]'")
EFFECT = ("--effect", "surge_linear_damping=-12", "--effect", "thruster_asymmetry=port:0.75")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_newcomers_call_prints_a_table_and_draws_the_tracks(here: Path):
    shown = done("control", "blueboat", *EFFECT, "--track", "square", "--track", "station", "--out", "square.svg")
    assert "beside its file it has: X_u=-27, port_scale=0.75" in shown
    against = re.search(r"^perfect +\S+ +-(\d+) %", shown, re.MULTILINE)
    assert against is not None
    assert int(against[1]) > 30
    drawn = (here / "square.svg").read_text("utf-8")
    assert all(word in drawn for word in ("blueboat: ", "perfect: ", "wanted", "half a minute at one place"))
    done("control", "blueboat", "--track", "transients", "--out", "square.svg")
    assert "half a minute" not in (here / "square.svg").read_text("utf-8")
    (here / "square.svg").write_text("<svg/>", "utf-8")
    refused("control", "blueboat", "--out", "square.svg", match="square.svg is there, and 'undertow control' did not")


def test_json_holds_every_figure(here: Path):
    found = strict(done("control", "otter", "--calm", "--track", "transients", "--json"))
    assert found["schema"] == "undertow.control/1"
    assert [row["model"] for row in found["results"]] == ["otter", "perfect"]
    first, last = (row["merit"] for row in found["results"])
    assert first["rmse"] == last["rmse"] < 0.1
    assert not first["lost"]


def test_python_gives_the_passages():
    trial = undertow.Trial(tracks=("transients", "transients"), seed=2)
    run = undertow.control(["blueboat"], None, {"thrust_scale": 0.8}, trial, progress=None)
    assert set(run.passages) == {("transients", "blueboat"), ("transients", "perfect")}
    assert "perfect on transients" in repr(run)
    assert [row.model for row in run.record.results] == ["blueboat", "perfect"]
    assert run.record.results[1].against_first < 0.0
    said: list[str] = []
    with pytest.raises(undertow.RequestError, match="did you mean 'square'"):
        undertow.control(["blueboat"], trial=undertow.Trial(tracks=("station", "sqare")), progress=said.append)
    assert not said


def test_every_model_lies_within_the_frame_of_its_figure():
    run = undertow.control(
        ["blueboat"], None, {"thrust_scale": 0.8}, undertow.Trial(tracks=("transients",)), progress=None
    )
    record = run.record.but(results=tuple(reversed(run.record.results)))
    axes = Figure().add_subplot()
    draw(axes, record, "transients", run.passages)
    best, worst = (np.asarray(line.get_ydata()).max() for line in axes.get_lines())
    assert best < worst <= axes.get_ylim()[1]


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (("control", "blueboat", "--track", "sqare"), r"unknown track 'sqare': did you mean 'square'\?"),
        (("control", "blueboat", "--controller", "mpc"), r"unknown controller 'mpc': did you mean 'nmpc'\?"),
        (("control", "blueboat", "--out", "a.png"), r"--out a.png: expected a name that ends in .svg"),
        (("control", "blueboat", "--true", "otter"), r"expected the true boat's thrusters, rad_s_port rad_s_stbd"),
        (("control", "blueboat", "--effect", "lag=0.3", "--effect", "lag=0.4"), r"lag is given twice"),
    ],
)
def test_what_cannot_be_done_is_refused(here: Path, words: tuple[str, ...], match: str):
    refused(*words, match=match)
