"""The verb `report`: pages of one run and of several, models on demand, PDF, and what a run says of its making."""

import hashlib
import json
import os
import re
import shlex
import shutil
import stat
from pathlib import Path

import pytest
from sample_run import edit, write_sample
from verbs import call, done, refused

from undertow.measurements.formats.registry import log_digests
from undertow.measurements.log_options import Reading
from undertow.physics.errors import RequestError
from undertow.physics.files import remark
from undertow.reports.page.fleet import Relation, SharedNumber, shared_numbers
from undertow.reports.page.page import fleet_page
from undertow.workflows.report import find_browser, print_pdf
from undertow.workflows.run_folder.moved_files import command, versions
from undertow.workflows.run_folder.read import read_run


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    """Two runs: of the second boat both thrusters are sound, and its drag in yaw is another."""
    folder = tmp_path_factory.mktemp("fleet")
    one = write_sample(folder / "one", seconds=60.0)
    two = Path(shutil.copytree(one, folder / "two"))

    def change(findings):
        findings["missing"].remove("thruster_asymmetry")
        for item in findings["candidates"]:
            if item["effect"] == "thruster_asymmetry":
                item |= {"verdict": "no evidence", "terms": []}
            if item["effect"] == "yaw_quadratic_damping":
                item["terms"][0] |= {"value": -4.0, "ci95": [-4.2, -3.8]}

    edit(two / "findings.json", change)
    model = (two / "model.yaml").read_text().replace("N_rr: -8.3", "N_rr: -4.0").replace("scale: 0.806", "scale: 1.0")
    (two / "model.yaml").write_text(model)
    return folder


@pytest.fixture
def fleet(samples, tmp_path, monkeypatch):
    shutil.copytree(samples, tmp_path / "fleet")
    monkeypatch.chdir(tmp_path / "fleet")
    return tmp_path / "fleet"


def fake_browser(folder: Path, script: str) -> Path:
    path = folder / "browser"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


# One run, several runs


def test_one_run_gets_its_page(fleet):
    assert done("report", "one") == "one/report.html\n"
    assert not Path("report.html").exists()
    assert done("report", "one", "--out", "copy.html").split() == ["one/report.html", "copy.html"]
    assert Path("copy.html").read_bytes() == Path("one/report.html").read_bytes()


def test_several_runs_get_a_page_each_and_one_for_all(fleet):
    assert done("report", "one", "two").split() == ["one/report.html", "two/report.html", "report.html"]
    page = Path("report.html").read_text()
    assert page.count("<h1>") == 1
    assert "Both runs lack" in page
    for target in re.findall(r'href="([^"]*)"', page):
        if target.startswith("#"):
            assert page.count(f'id="{target[1:]}"') == 1
        else:
            assert Path(target).is_file()
    assert "<script" not in page
    assert "http" not in page.replace("http-equiv", "")


def test_the_page_for_all_links_to_each_run_from_where_it_lies(fleet, monkeypatch):
    monkeypatch.setattr("undertow.workflows.report.page_of", lambda run: "<!doctype html><title>no figures</title>")
    Path("elsewhere").mkdir()
    done("report", "one", "two", "--out", "elsewhere/all.html")
    links = [link for link in re.findall(r'href="([^"]*)"', Path("elsewhere/all.html").read_text()) if link[0] != "#"]
    assert links == ["../one/report.html", "../two/report.html"]


def test_equal_runs_give_equal_pages_for_all(fleet):
    first, again = (fleet_page([read_run(Path("one")), read_run(Path("two"))], Path.cwd()) for _ in range(2))
    assert first == again


NAMES = ("one", "two")


def numbers() -> dict[str, SharedNumber]:
    return {one.symbol: one for one in shared_numbers([read_run(Path(name)) for name in NAMES], NAMES)}


def change(run: str, effect: str, **terms: object) -> None:
    """Give the number of an effect of a run another value or interval, or the effect another verdict."""

    def edited(findings):
        item = next(c for c in findings["candidates"] if c["effect"] == effect)
        for key, value in terms.items():
            (item["terms"][0] if key in ("value", "ci95") else item)[key] = value

    edit(Path(run) / "findings.json", edited)


def test_numbers_are_the_same_or_differ_by_so_much_or_are_of_one_run(fleet):
    found = numbers()
    assert [one.relation for one in found.values()] == sorted(
        (one.relation for one in found.values()), key=list(Relation).index
    )
    assert (found["X_uu"].relation, found["X_uu"].told(NAMES)) == (Relation.SAME, "same")
    assert found["N_rr"].relation is Relation.DIFFERS
    assert re.fullmatch(
        r"differs by 4\.30 N m s²/rad² \(95 %: [34].* to 4.*\); by chance: < 0\.1 %", found["N_rr"].told(NAMES)
    )
    assert found["stbd_scale"].relation is Relation.ONLY_HERE
    assert found["stbd_scale"].told(NAMES) == "only in one"
    assert found["stbd_scale"].elsewhere == ("", "no evidence")


def test_the_difference_is_held_against_the_interval_of_the_difference_and_not_against_each_interval(fleet):
    change("one", "surge_quadratic_damping", value=-5.8, ci95=[-6.4, -5.1], verdict="likely")
    change("two", "surge_quadratic_damping", value=-5.3, ci95=[-6.4, -4.1], verdict="possible")
    assert numbers()["X_uu"].relation is Relation.SAME
    half, one, edge = 1.0, -8.0, 2.0**0.5  # of two intervals that are +- 1, that of the difference is +- 1.414
    for apart, relation in ((edge - 1e-3, Relation.SAME), (edge + 1e-3, Relation.DIFFERS)):
        change("one", "surge_quadratic_damping", value=one, ci95=[one - half, one + half])
        change("two", "surge_quadratic_damping", value=one - apart, ci95=[one - apart - half, one - apart + half])
        assert numbers()["X_uu"].relation is relation, "though the two intervals overlap"
        difference = numbers()["X_uu"].difference
        assert difference is not None
        assert difference.value == pytest.approx(apart)


@pytest.mark.parametrize(
    ("doubt", "why"),
    [
        ({"reason": "not_excited", "verdict": "possible"}, "the log of two cannot show it"),
        ({"verdict": "possible"}, "it may be in two, too"),
    ],
)
def test_what_the_other_log_does_not_rule_out_is_not_of_one_run_only(fleet, doubt, why):
    change("two", "thruster_asymmetry", **doubt)
    assert numbers()["stbd_scale"].told(NAMES) == f"cannot tell: {why}"


def test_a_log_that_hardly_shows_an_effect_says_nothing_by_not_finding_it(fleet):
    shown = {"groups": [], "excitation": {"thruster_asymmetry[stbd]": {"share": 0.2}}}
    for share, relation in ((0.2, Relation.ONLY_HERE), (0.002, Relation.CANNOT_TELL)):
        seen = {**shown, "excitation": {"thruster_asymmetry[stbd]": {"share": share}}}
        edit(Path("one/findings.json"), lambda findings: findings.update(identifiability=shown))
        edit(Path("two/findings.json"), lambda findings, seen=seen: findings.update(identifiability=seen))
        assert numbers()["stbd_scale"].relation is relation


def test_a_look_alike_stands_in_the_place_of_an_effect(fleet):
    alike = {"groups": [["surge_quadratic_damping", "thruster_asymmetry[stbd]"]]}
    edit(Path("two/findings.json"), lambda findings: findings.update(identifiability=alike))
    assert numbers()["stbd_scale"].relation is Relation.ONLY_HERE, "the first run holds both, and told them apart"
    change("one", "surge_quadratic_damping", verdict="no evidence", terms=[])
    assert numbers()["stbd_scale"].told(NAMES) == "cannot tell: two has surge quadratic damping in its place"


def test_what_two_of_three_runs_share_is_of_these_two_only(fleet):
    shutil.copytree("one", "three")
    found = shared_numbers([read_run(Path(name)) for name in ("one", "two", "three")], ("one", "two", "three"))
    assert next(one.told(("one", "two", "three")) for one in found if one.symbol == "stbd_scale") == (
        "only in one and three, the same there"
    )


def test_the_page_for_all_draws_each_number_of_each_run(fleet):
    page = fleet_page([read_run(Path(name)) for name in NAMES], Path.cwd())
    assert "The two runs differ in yaw quadratic damping and thruster asymmetry (stbd)." in page
    for symbol in ("X_uu", "N_rr", "Y_vv", "stbd_scale"):
        assert f'aria-label="{symbol} in each run: ' in page


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (("one", "nowhere"), "expected a run folder at nowhere"),
        (("one", "one"), "one is given twice"),
        (("one", "two", "--out", "notes.html"), "notes.html is there, and .undertow report. did not write it"),
        (("one", "two", "--out", "all.pdf"), "expected a name that ends in .html"),
        (("one", "two", "--out", "nowhere/all.html"), "nowhere does not exist"),
    ],
)
def test_nothing_is_written_when_something_is_wrong(fleet, words, match):
    Path("notes.html").write_text("<!doctype html><title>my notes</title>")
    refused("report", *words, match=match)


# More models


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    """A run of a simulated boat, as `discover` writes it."""
    folder = tmp_path_factory.mktemp("real")
    log = folder / "log.csv"
    done("simulate", "--vehicle", "otter", "--effect", "surge_quadratic_damping=-20", "--duration", "120", "--out", log)
    done("discover", log, "--vehicle", "otter", "--out", folder / "run", "--no-report")
    return folder


def test_a_model_is_compared_on_the_logs_of_the_run(real, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(real / "run", "run")
    before = json.loads(Path("run/comparison.json").read_text())["models"]
    written = done("report", "run", "--model", real / "run" / "nominal.yaml").split()
    assert written[-1] == "run/report.html"
    after = json.loads(Path("run/comparison.json").read_text())["models"]
    assert [model["name"] for model in after] == [
        *(model["name"] for model in before),
        str(real / "run" / "nominal.yaml"),
    ]
    assert after[-1]["rollout"] == before[0]["rollout"]
    picture = Path("run/report.html").read_text().split("<h2>Which model to trust</h2>")[1].split("</svg>")[0]
    assert picture.count("physics") == 3  # nominal, calibrated, and the one that was given


def test_a_model_that_cannot_be_compared_leaves_the_run_as_it_was(real, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(real / "run", "run")
    refused("report", "run", "--model", "nowhere.yaml", match="nowhere.yaml")


def test_discover_records_how_the_run_was_made(real):
    record = json.loads((real / "run" / "run.json").read_text())
    log = str(real / "log.csv")
    assert shlex.split(record["command"]) == [
        "undertow", "discover", log, "--vehicle", "nominal.yaml", "--seed", "0", "--out", "again"
    ]  # fmt: skip
    digest = hashlib.sha256((real / "log.csv").read_bytes()).hexdigest()
    assert record["log_sha256"] == [{"path": log, "sha256": digest}]
    assert record["versions"]["numpy"]


# PDF


def test_without_a_browser_the_hint_says_how_to_get_one(fleet, monkeypatch):
    monkeypatch.setenv("CHROME", "no-such-browser")
    refused("report", "one", "--pdf", match="CHROME=no-such-browser: expected a browser.*install Chromium")
    monkeypatch.delenv("CHROME")
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr("undertow.workflows.report.PLACES", ())
    monkeypatch.setattr("undertow.workflows.report._of_playwright", lambda: None)
    refused("report", "one", "--pdf", match="needs a browser and found none; install Chromium.*CHROME")


@pytest.mark.skipif(os.name == "nt", reason="the stand-in for a browser is a shell script")
def test_a_browser_is_asked_for_every_page(fleet, monkeypatch):
    script = 'for word in "$@"; do case $word in --print-to-pdf=*) printf %s-pretend "%PDF" > "${word#*=}";; esac; done'
    monkeypatch.setenv("CHROME", str(fake_browser(fleet, script.replace('"%PDF"', "'%PDF'"))))
    written = done("report", "one", "two", "--pdf").split()
    assert written[3:] == ["one/report.pdf", "two/report.pdf", "report.pdf"]
    assert (
        Path("report.pdf").read_bytes()
        == b"%PDF-pretend\n% " + remark("report --pdf", b"%PDF-pretend\n").encode() + b"\n"
    )


@pytest.mark.skipif(os.name == "nt", reason="the stand-in for a browser is a shell script")
@pytest.mark.parametrize(
    ("script", "match"),
    [("echo no display >&2; exit 3", r"wrote no PDF of .* \(exit code 3: no display\)"), ("sleep 5", "within 1 s")],
)
def test_a_browser_that_fails_is_told(tmp_path, monkeypatch, script, match):
    monkeypatch.setattr("undertow.workflows.report.SECONDS", 0.5 if "sleep" in script else 9.0)
    (tmp_path / "old.pdf").write_bytes(b"%PDF old")
    with pytest.raises(RequestError, match=match.replace("within 1 s", "within 0 s")):
        print_pdf(tmp_path / "page.html", tmp_path / "old.pdf", fake_browser(tmp_path, script))
    assert (tmp_path / "old.pdf").read_bytes() == b"%PDF old"


def test_what_is_no_pdf_is_not_replaced(fleet, monkeypatch):
    monkeypatch.setenv("CHROME", str(fake_browser(fleet, "exit 1")))
    Path("one/report.pdf").write_text("a letter")
    refused("report", "one", "--pdf", match="holds report.pdf, which undertow did not write")


def test_the_variable_comes_before_the_path(tmp_path, monkeypatch):
    named = fake_browser(tmp_path, "exit 0")
    monkeypatch.setenv("CHROME", str(named))
    assert find_browser() == named


# How a run was made


def test_digests_are_of_the_logs_on_disk(tmp_path):
    log = tmp_path / "log.csv"
    log.write_bytes(b"time,u\n")
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "a.db").write_bytes(b"1")
    gone = tmp_path / "gone.csv"
    one, two, three = log_digests([str(log), str(bag), str(gone)])
    assert one == {"path": str(log), "sha256": hashlib.sha256(b"time,u\n").hexdigest()}
    assert three["sha256"] is None
    (bag / "a.db").rename(bag / "b.db")
    assert log_digests([str(bag)])[0]["sha256"] != two["sha256"]


def test_versions_are_those_that_are_installed():
    found = versions()
    assert re.fullmatch(r"3\.\d+\.\d+", found["python"])
    assert {"numpy", "scipy", "pandas", "pysindy", "cvxpy"} <= set(found)


@pytest.mark.parametrize("verb", [["discover"], ["add", "munk_moment", "yaw:u|r|"]])
def test_the_command_of_a_run_is_one_that_the_command_line_takes(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refit = verb[0] == "discover"
    text = command(verb, ["no such.csv"], seed=3, refit=refit, reading=Reading(frame="enu", channel_map="my map.yaml"))
    words = shlex.split(text)
    assert words[: 1 + len(verb)] == ["undertow", *verb]
    out = ["--out", "run"] if refit else []
    result = call(*words[1:], *out)
    assert result.exit_code == 2
    assert "No such option" not in result.stderr
    assert "Missing" not in result.stderr


def test_the_record_of_a_made_up_run_reads_back(fleet):
    Path("one/run.json").write_text(json.dumps({"schema": "undertow.run/1", "versions": 3}))
    refused("report", "one", match="expected an object under 'versions', got 3")


def test_the_recorded_command_makes_the_run_again(tmp_path, monkeypatch):
    """Also with paths that were relative to another folder than that of the run."""
    (tmp_path / "logs").mkdir()
    (tmp_path / "runs").mkdir()
    monkeypatch.chdir(tmp_path)
    log = Path("logs/my log.csv")
    done("simulate", "--vehicle", "otter", "--duration", "60", "--out", log)
    done("discover", log, "--vehicle", "otter", "--out", "runs/one", "--no-report")
    record = json.loads(Path("runs/one/run.json").read_text())
    monkeypatch.chdir("runs/one")
    done(*shlex.split(record["command"])[1:], "--no-report")
    assert Path("again/findings.json").read_bytes() == Path("findings.json").read_bytes()


def test_a_network_is_no_run_and_what_to_do_is_said(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("lstm").mkdir()
    Path("lstm/model.yaml").write_text("schema: undertow.network/1\n")
    refused("report", "lstm", match="lstm is the folder of a trained network, not of a run.*with --model lstm")
