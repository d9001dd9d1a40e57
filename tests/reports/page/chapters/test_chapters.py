"""The chapters of the page: equations, models side by side, laws of each, what the log can tell, how it was made."""

import copy
import html
import json
import re
import shutil
from pathlib import Path

import pytest
from sample_run import LAWS, RIVALS, compare_many, edit, write_sample

from undertow.reports.run_contents import rivals
from undertow.workflows.run_folder.read import read_run
from undertow.workflows.run_folder.write import write_page


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    folder = write_sample(tmp_path_factory.mktemp("chapters") / "run", seconds=120.0)
    compare_many(folder)
    return folder


@pytest.fixture
def run(sample, tmp_path):
    """A copy of the sample that a test may spoil."""
    return Path(shutil.copytree(sample, tmp_path / "run", ignore=shutil.ignore_patterns("report.html")))


@pytest.fixture(scope="module")
def text(sample):
    return write_page(sample).read_text()


def chapter(text: str, title: str) -> str:
    return text[text.rindex(f"<h2>{title}") :].split("<h2>")[1]


def plain(markup: str) -> str:
    return html.unescape(re.sub(r"<[^>]*>", "", markup))


def test_chapters_stand_in_the_order_of_the_story(text):
    titles = re.findall("<h2>(.*?)</h2>", text)
    assert titles == [
        "What is missing",  # on paper
        "The force that is missing",
        "The error, step by step",
        "What to record next",  # on paper
        "What is missing",
        "What to record next",
        "Try it",
        "Which model to trust",
        "Measured against predicted",
        "Where it fails",
        "The corrected model in equations",
        "Corrected parameters",
        "Laws of a hull: the corrected model keeps them",
        "The log",
        "How this was made",
    ]


def test_equations_have_the_numbers_of_the_corrected_model(text):
    equations = chapter(text, "The corrected model in equations")
    spoken = re.findall('aria-label="(.*?)"', equations)
    assert spoken == [
        "33.5 u_dot = 1 T_port + 1 T_stbd + 48.5 v r − 15 u − 7.8 u |u|",
        "48.5 v_dot = −33.5 u r − 40 v − 74 v |v|",
        "8.5 r_dot = 0.295 T_port − 0.295 T_stbd − 15 u v − 6 r − 8.3 r |r|",
    ]


def test_new_terms_are_marked_and_carry_unit_and_interval(text):
    equations = chapter(text, "The corrected model in equations")
    terms = re.findall(r'<span class="term( new)?">(.*?)</span>', equations)
    new = [plain(term) for mark, term in terms if mark]
    assert new == [
        "+Tstbd",
        "−7.8u|u|Xuu [N s²/m²]−8.11 to −7.49",
        "−74v|v|Yvv [N s²/m²]−77.0 to −71.0",
        "−0.295Tstbd",
        "−8.3r|r|Nrr [N m s²/rad²]−8.63 to −7.97",
    ]
    assert "−15uXu [N s/m]" in [plain(term) for mark, term in terms if not mark]
    assert "stbd_scale0.8060.774 to 0.838was 1" in plain(equations)


def test_a_shape_that_is_gone_is_told(run):
    nominal = (run / "nominal.yaml").read_text().replace("N_r: -6.0", "N_r: -6.0\n  N_ur: -2.0")
    (run / "nominal.yaml").write_text(nominal)
    assert "No longer there: N_ur." in plain(chapter(write_page(run).read_text(), "The corrected model in equations"))


def test_the_picture_has_every_model_the_best_first(sample):
    order = [rival.model.name for rival in rivals(read_run(sample).comparison)]
    assert order == ["tcn", "corrected", "lstm", "hold velocity", "zero acceleration", "nominal", "boats.mine:drag"]


def test_the_picture_tells_paired_intervals_and_broken_laws(sample, text):
    told = {rival.model.name: rival for rival in rivals(read_run(sample).comparison)}
    base = told["corrected"].score.position
    assert told["lstm"].interval == pytest.approx((0.97 * base, 1.06 * base))
    assert told["nominal"].interval is None
    broken = {name: list(rival.laws.values()).count("fail") for name, rival in told.items()}
    assert {name: count for name, count in broken.items() if count} == {"tcn": 2, "boats.mine:drag": 1}
    drawing = chapter(text, "Which model to trust").split("</svg>")[0]
    for word in (*RIVALS, *LAWS, "diverged", "not asked", "9\N{NO-BREAK SPACE}870 fitted"):
        assert f">{word}" in drawing or word in plain(drawing)


def test_verdict_and_picture_say_which_model_to_trust(text):
    sentence = "Trust the corrected model: the tcn breaks two laws."
    assert sentence in text.split("<h2>")[0]
    assert sentence in chapter(text, "Which model to trust")


def test_marks_are_signs_and_not_colours_alone(text):
    rows = {
        plain(row.split("</td>")[0]): row for row in re.findall("<tr>(.*?)</tr>", chapter(text, "Which model to trust"))
    }
    marks = {name: re.findall(r'title="([^"]*)">(.)<', row) for name, row in rows.items()}
    cells = re.findall(r'<tr><td class="text">(lstm|tcn)</td>(.*?)</tr>', chapter(text, "Which model to trust"))
    first = {name: re.findall(r'title="([^"]*)">(.)<', row) for name, row in reversed(cells)}
    assert first == {"lstm": [("no difference", "=")], "tcn": [("better", "↓")]}
    assert marks["nominal"] == []


def test_counterexamples_stand_above_all_laws_of_every_model(text):
    told = chapter(text, "Laws of a hull")
    broken = re.findall(r'<tr><td class="text">([^<]*)</td><td class="text">([^<]*)</td><td>13 W</td>(.*?)</tr>', told)
    assert [pair[:2] for pair in broken] == [
        ("tcn", "dissipation"),
        ("tcn", "bounded speed"),
        ("boats.mine:drag", "rest stays at rest"),
    ]
    assert "The &lt;dissipation&gt; is broken.<small>at u 1.9 m/s, v 0.20 m/s, r −0.80 rad/s</small>" in broken[0][2]
    models = ("nominal", "corrected", "lstm", "tcn", "boats.mine:drag")
    assert re.findall("<summary>all laws, (.*?) model</summary>", told) == list(models)


def test_domain_baselines_and_notes_are_explained(text):
    told = plain(chapter(text, "Which model to trust"))
    assert "0.0100 / 0.0100" in told
    assert "none / 0.0100" in told
    assert "zero acceleration: body velocities stay as they are." in told
    assert "Nothing was calibrated: the log tells none" in told


def test_what_the_log_cannot_tell_is_said(run):
    def add(findings):
        findings["identifiability"] = {
            "groups": [["munk_moment", "sway_added_mass"]],
            "dormant": ["thrust_dead_zone"],
            "noise_limited": ["cg_offset", "yaw_trim"],
            "absorbed": [],
            "quiet_axes": ["sway"],
            "condition": 17.2,
            "excitation": {
                "munk_moment": {"share": 0.004},
                "yaw_trim": {"share": None},
                "thrust_scale": {"share": 0.9},
            },
        }

    edit(run / "findings.json", add)
    told = plain(chapter(write_page(run).read_text(), "What this log can tell"))
    assert "Munk moment and sway added mass move alike in this log" in told
    assert "neither found nor excluded: thrust dead zone." in told
    assert "Hardly more than sensor noise: cg offset and yaw trim." in told
    assert "Hardly moves beyond sensor noise: sway." in told
    assert re.search(r"Munk moment\s*<\s1\s%\s*thrust scale\s*90\s%\s*yaw trim\s*n/a", told)


def test_how_the_run_was_made_is_told(run):
    record = {
        "schema": "undertow.run/1",
        "seed": 7,
        "command": "undertow discover 'my log.csv' --vehicle nominal.yaml --seed 7",
        "versions": {"python": "3.11.2", "undertow": "0.1.0"},
        "log_sha256": [{"path": "my log.csv", "sha256": "ab" * 32}, {"path": "gone.csv", "sha256": None}],
    }
    (run / "run.json").write_text(json.dumps(record))
    told = plain(chapter(write_page(run).read_text(), "How this was made"))
    for words in (record["command"], "python 3.11.2, undertow 0.1.0", "ab" * 32, "not there any more", "run.json"):
        assert words in told


def test_a_run_of_an_earlier_version_still_has_a_page(run, text):
    def strip(comparison):
        for key in ("differences", "best", "notes"):
            del comparison[key]
        comparison["models"] = [
            {"name": model["name"], "rollout": copy.deepcopy(model["rollout"])} for model in comparison["models"][:2]
        ]

    edit(run / "comparison.json", strip)
    earlier = write_page(run).read_text()
    assert "Which model to trust" in earlier
    assert "Laws of a hull" not in earlier
    assert len(earlier) < len(text)


def test_models_keep_their_names_and_unknown_times_have_no_column(run):
    def rename(comparison):
        for item in (*comparison["models"], *comparison["differences"]):
            for key in ("name", "model", "against"):
                item |= {key: "mon_lstm"} if item.get(key) == "lstm" else {}
        for model in comparison["models"]:
            model |= {"seconds_to_fit": None, "seconds_to_evaluate": 1.5}

    edit(run / "comparison.json", rename)
    page = write_page(run).read_text()
    told = chapter(page, "Which model to trust")
    assert "mon_lstm" in told
    assert "mon lstm" not in page
    assert "time to evaluate [s]" in told
    assert "time to fit" not in told


def test_columns_of_what_an_interval_holds_are_told_in_words(run):
    def held(comparison):
        share = {"surge": 0.9, "sway": 0.95, "yaw": 1.0}
        comparison["models"][0]["interval"] = {"level": 0.95, "inside": {"rows": 9, "share": share, "margin": share}}

    edit(run / "comparison.json", held)
    told = chapter(write_page(run).read_text(), "Which model to trust")
    assert "<th>interval holds, within</th>" in told
    assert "<th>interval holds, beyond</th>" in told
