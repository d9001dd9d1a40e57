"""The report page of a made-up run."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sample_run import edit, write_sample

from undertow.physics.vehicle import load_vehicle
from undertow.reports.page.chapters import play
from undertow.reports.page.chapters.play import script
from undertow.reports.page.judged_pieces import liveliest_stretch, rollouts
from undertow.reports.sureness import coefficient_rows
from undertow.reports.wording import typeset
from undertow.workflows.run_folder.read import read_run
from undertow.workflows.run_folder.write import write_page


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    return write_sample(tmp_path_factory.mktemp("reports") / "run", seconds=120.0)


@pytest.fixture
def run(sample, tmp_path):
    """A copy of the sample that a test may spoil."""
    return Path(shutil.copytree(sample, tmp_path / "run", ignore=shutil.ignore_patterns("report.html")))


@pytest.fixture(scope="module")
def text(sample):
    return write_page(sample).read_text()


def test_page_tells_the_whole_story(text):
    for title in (
        "The model lacks quadratic drag",
        "The error, step by step",
        "Measured against predicted",
        "Where it fails",
        "What is missing",
        "Terms without a name",
        "Corrected parameters",
        "The log",
        "What to record next",
        "How this was made",
    ):
        assert title in text
    assert "X += X_uu u_r |u_r|" in text
    assert "This log cannot tell it from input delay." in text
    assert text.count("<svg") == 1 + 3 + 7 + 2 + 6 + 2 + 4 + 6 + 2 + 1


def test_page_shows_the_quality_of_every_log(text):
    rows = re.findall(r'<tr><td class="text">(lake/\w+\.csv)</td>(.*?)</tr>', text)
    cells = {path: re.findall("<td>(.*?)</td>", rest) for path, rest in rows}
    assert cells == {
        "lake/one.csv": ["1", "0", "300", "20.0", "", "0.110", "0.0152", "", ""],
        "lake/two.csv": ["1", "3", "", "20.0", "1.25", "", "0.0152", "", ""],
    }
    assert text.count("<summary>inspection of lake/") == 2


def test_page_leads_with_the_rollout_error_before_and_after(sample, text):
    steps = json.loads((sample / "findings.json").read_text())["steps"]
    for step in (steps[0], steps[-1]):
        assert f"<b>{typeset(step['rollout_rmse']['10']['position'], 2)} m</b>" in text


def test_page_is_self_contained(text):
    assert re.findall(r"<script[^>]*>", text) == ['<script type="application/json" id="play-data">', "<script>"]
    assert f"<script>{script()}</script>" in text
    assert "http" not in text.replace("http-equiv", "")
    assert "@import" not in text
    assert all(target.startswith("#") for target in re.findall(r'(?:href|src)="([^"]*)"', text))
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", text))


def test_page_takes_its_colours_from_the_style_sheet(text):
    assert not re.search(r"#0([1-9])0\1", text.split("</style>")[1])
    assert "prefers-color-scheme: dark" in text


def test_page_is_the_same_for_the_same_files_wherever_they_lie(run, text):
    path = write_page(run)
    assert path == run / "report.html"
    assert path.read_text() == text
    assert list(run.glob(".*")) == []


def test_page_escapes_what_the_files_say(run):
    def spoil(findings):
        findings["headline"] = "<script>alert(1)</script> & more"
        findings["data"]["notes"] = ["<img src=x>"]
        findings["steps"][1]["added"] = "<b>bold</b> $x_1$"
        findings["candidates"][0]["sentence"] = "<i>sly</i>"
        findings["candidates"][0]["effect"] = "<u>odd</u>"

    edit(run / "findings.json", spoil)
    text = write_page(run).read_text()
    for sly in ("<script>alert", "<img", "<b>bold", "<i>sly", "<u>odd"):
        assert sly not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; more" in text


def test_page_of_a_sound_model(run):
    def clear(findings):
        findings |= {
            "verdict": "nothing missing",
            "missing": [],
            "steps": findings["steps"][:1],
            "failures": [],
            "advice": [],
        }
        findings |= {"candidates": [], "unnamed": [], "headline": ""}

    edit(run / "findings.json", clear)
    shutil.copy(run / "nominal.yaml", run / "model.yaml")
    (run / "inspection.json").unlink()
    text = write_page(run).read_text()
    assert "Nothing is missing that this log can show" in text
    assert "the same parameters as the nominal one" in text


def test_page_shows_a_diverged_rollout(run):
    def diverge(findings):
        for errors in findings["steps"][0]["rollout_rmse"].values():
            errors.update(position=None, yaw=None)

    edit(run / "findings.json", diverge)
    series = pd.read_csv(run / "series.csv")
    series.loc[series.index % 100 > 50, ["u_before", "north_before", "east_before"]] = np.nan
    series.to_csv(run / "series.csv", index=False)
    assert "diverged" in write_page(run).read_text()


def test_intervals_of_added_amounts_stand_on_the_nominal_value(run):
    findings = read_run(run).findings
    nominal = load_vehicle(run / "nominal.yaml").with_values({"X_uu": -2.0})
    corrected = load_vehicle(run / "model.yaml").with_values({"X_uu": -9.8})
    rows = {row.symbol: row for row in coefficient_rows(findings.candidates, findings.missing, nominal, corrected)}
    assert rows["X_uu"].interval == pytest.approx((-2.0 - 7.8 * 1.04, -2.0 - 7.8 * 0.96))
    assert rows["stbd_scale"].interval == pytest.approx((0.806 * 0.96, 0.806 * 1.04))
    assert (rows["stbd_scale"].before, rows["stbd_scale"].after) == (1.0, 0.806)


def test_lines_break_where_a_prediction_starts_again(run):
    series = pd.read_csv(run / "series.csv").query("log == 0")
    drawn = rollouts(series)
    assert drawn["restart"].sum() == 12
    breaks = drawn[drawn["u_before"].isna()]
    assert sorted(breaks["time"]) == sorted(drawn.loc[drawn["restart"], "time"])
    assert len(drawn) < 700 + 12


def test_the_picture_opens_on_the_stretch_with_the_most_motion(run):
    series = pd.read_csv(run / "series.csv").assign(part="test")
    more = pd.concat([series.assign(time=series["time"] + 120.0 * k) for k in range(3)], ignore_index=True)
    quiet = more["time"] < 200.0
    for ending in ("", "_before", "_after"):
        names = [f"{name}{ending}" for name in ("u", "v", "r")]
        more.loc[quiet, names] = 0.1 * more.loc[quiet, names]
    stretch = liveliest_stretch(more)
    assert stretch["time"].iloc[0] >= 200.0
    assert stretch["time"].iloc[0] % 10.0 == pytest.approx(0.0)  # where predictions start
    assert stretch["time"].iloc[-1] - stretch["time"].iloc[0] == pytest.approx(120.0, abs=0.11)


def test_a_gap_of_the_record_is_left_as_a_gap(run):
    series = pd.read_csv(run / "series.csv").query("log == 0")
    holed = series[(series["time"] < 43.0) | (series["time"] >= 50.0)]
    drawn = rollouts(holed)
    columns = ["u", "north", "u_before", "east_after"]
    (empty,) = np.flatnonzero(drawn["u"].isna()).tolist()
    assert drawn[columns].iloc[empty].isna().all()
    assert drawn["time"].iloc[[empty - 1, empty + 1]].tolist() == pytest.approx([42.9, 50.0])
    assert not rollouts(series)["u"].isna().any()


def test_the_band_is_drawn_and_told_where_a_run_has_one(run, text):
    assert "band of the corrected model" not in text  # of an earlier version
    seconds = [0.5, *map(float, range(1, 11))]
    by_name = {name: [0.1 * s for s in seconds] for name in ("position", "surge", "sway", "yaw")}
    band = {"level": 0.95, "predictions": 110, "independent": 40.0, "seconds": seconds, "shift": [0.01] * 4}
    band |= dict.fromkeys(("floor", "factor", "half_width"), by_name)
    edit(run / "comparison.json", lambda found: found["models"][-1].update(band=band))
    assert "made to hold" not in write_page(run).read_text()  # nothing is drawn
    series = pd.read_csv(run / "series.csv")
    series[["position_band", "u_band", "v_band", "r_band"]] = 0.2
    series.to_csv(run / "series.csv", index=False)
    page = write_page(run).read_text()
    assert "band of the corrected model" in page
    assert re.search(r"made to hold 95.% of predictions: after 10 s the position within 1\.0 m", page)
    assert "It comes from 110 predictions" in page
    assert page.count("fill-opacity: 0.2") == 4


def test_the_laws_stand_on_the_page_what_is_broken_first(run):
    law = {
        "verdict": "pass",
        "margin": {"value": 0.5, "unit": "W"},
        "proof": "search",
        "sentence": "It loses <energy>.",
    }
    broken = {**law, "law": "bounded speed", "verdict": "fail", "margin": {"value": -2.0, "unit": "times the envelope"}}
    noted = {**law, "law": "mirror symmetry", "verdict": "fail", "counts": False, "proof": "none", "margin": None}
    audit = {
        "schema": "undertow.audit/1",
        "model": "corrected",
        "verdict": "fail",
        "envelope": {"u": [-1.0, 2.0]},
        "units": {"u": "m/s"},
        "envelope_from": "the speeds of the log",
        "laws": [{**law, "law": "dissipation"}, broken, noted],
    }
    (run / "audit.json").write_text(json.dumps(audit))
    page = write_page(run).read_text()
    assert "Laws of a hull: the corrected model breaks one" in page
    assert "<energy>" not in page
    assert "u from -1.00 to 2.00 m/s: the speeds of the log" in page
    told = page[page.index("all laws, corrected model") :]
    assert told.index(">bounded speed<") < told.index(">mirror symmetry<") < told.index(">dissipation<")
    assert " noted<" in told
    (run / "audit.json").unlink()
    assert "Laws of a hull" not in write_page(run).read_text()


def test_sliders_for_which_there_is_no_room_are_folded_and_none_is_left_out(sample, monkeypatch):
    monkeypatch.setattr(play, "_AT_ONCE", 2)
    run = read_run(sample)
    values = {"X_u": -3.0, "Y_v": -9.0, "N_r": -2.0, "X_uu": -7.0, "N_rr": -1.0, "lag": 0.2}
    run = replace(run, corrected=run.corrected.with_values(values))
    section = play.play(run)
    assert section is not None
    moved = [knob.symbol for knob in play.knobs_of(run.nominal, run.corrected)]
    assert set(values) <= set(moved)
    seen, _, folded = str(section.body).partition("</details>")[0].partition("<details>")
    assert (seen.count('knob"'), folded.count('knob"')) == (2, len(moved) - 2)
    assert f"<summary>{len(moved) - 2} more: {', '.join(moved[2:])}</summary>" in folded
