"""The command line as a user meets it: help, and what each verb says and writes."""

import gzip
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from io import BytesIO, TextIOWrapper
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from added_run import HIDDEN
from verbs import SCRIPT, call, done, files, inspected, nearly, process, refused, strict

import undertow
from undertow.__main__ import main
from undertow.cli import console
from undertow.cli.options import telling
from undertow.physics import presentation as in_words
from undertow.physics.stage import Stage
from undertow.physics.vehicle import load_vehicle
from undertow.reports.terminal import progress
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.scores import rollout_scores

VERBS = ("demo", "init", "inspect", "compare", "discover", "fit", "add", "simulate", "report")
REFERENCES = ("nominal", "calibrated", "zero acceleration", "hold velocity")
"""Models that every comparison has."""
AXES = {"surge", "sway", "yaw"}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a short simulated log and the run that `discover` made of it; tests leave both as they are."""
    folder = tmp_path_factory.mktemp("place")
    done("simulate", "-v", "blueboat", "--effect", f"{HIDDEN}=-12", "--duration", "90", "--out", folder / "log.csv")
    done("discover", folder / "log.csv", "-v", "blueboat", "--out", folder / "run")
    return folder


@pytest.fixture(scope="module")
def found(place: Path) -> undertow.Run:
    """The same run as the Python functions give it."""
    return undertow.discover(undertow.read_inputs(place / "log.csv", "blueboat"))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Help


def test_help_of_every_verb() -> None:
    for verb in VERBS:
        assert f"{verb} [OPTIONS]" in done(verb, "--help")
    assert done("plan", "-h") == done("plan", "--help")


@pytest.mark.parametrize("command", [[SCRIPT], [sys.executable, "-m", "undertow"]], ids=["script", "module"])
def test_help_in_a_process_of_its_own(command: Sequence[str | Path], tmp_path: Path) -> None:
    ran = process(*command, "--help", cwd=tmp_path)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert "Find the physics your boat model is missing." in ran.stdout
    assert all(verb in ran.stdout for verb in VERBS)


def test_help_loads_no_heavy_package(tmp_path: Path) -> None:
    code = f"""
import sys
from undertow.__main__ import app
for verb in {VERBS}:
    try:
        app([verb, "--help"])
    except SystemExit as end:
        assert end.code == 0, verb
heavy = {{"numpy", "scipy", "pandas", "matplotlib", "cvxpy", "pysindy", "sklearn", "joblib", "yaml", "torch"}}
print(sorted(heavy & set(sys.modules)), file=sys.stderr)
"""
    ran = process(sys.executable, "-c", code, cwd=tmp_path)
    assert (ran.returncode, ran.stderr.strip()) == (0, "[]")


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_can_be_quiet(verb: str) -> None:
    assert "--quiet" in done(verb, "--help")


def test_progress_tells_the_time_so_far_and_quiet_tells_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter([100.0, 101.0, 107.4, 200.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))

    def verb(words: str) -> None:
        console.progress(words)
        console.progress(words)
        console.tell_replaced([Path("old.html")])

    telling(verb)("looking")
    assert capsys.readouterr().err == "  looking\n  looking [7 s]\n  replaced the earlier old.html\n"
    telling(verb)("looking", quiet=True)
    assert capsys.readouterr().err == "  replaced the earlier old.html\n"


def test_a_stage_tells_what_is_usually_left(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter([100.0, 101.0, 106.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))

    def verb(words: str) -> None:
        console.progress(Stage(words, 0.6))
        console.progress(Stage(words, 0.6))

    telling(verb)("weighing")
    assert capsys.readouterr().err == "  weighing\n  weighing [6 s, about 4 s left]\n"


def test_version_and_the_names_of_the_effects() -> None:
    assert re.fullmatch(r"undertow \d+\.\d+\.\d+\n", done("--version"))
    shown = done("add", "--help")
    assert all(effect.name in shown for effect in undertow.EFFECTS)


# The public functions


@pytest.mark.parametrize("name", undertow.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(undertow, name) is not None
    assert name in dir(undertow)


def test_another_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'undertow' has no attribute 'discovr'"):
        undertow.discovr  # type: ignore[attr-defined]  # noqa: B018


def test_the_functions_give_what_the_verbs_write(place: Path, found: undertow.Run, tmp_path: Path) -> None:
    undertow.write_run(found, tmp_path / "run")
    assert files(tmp_path / "run") == files(place / "run")


# The verbs, one after the other


def test_simulate_says_what_it_hid_and_equal_seeds_give_equal_files(here: Path) -> None:
    words = ["simulate", "-v", "blueboat", "--effect", "X_uu=-12", "--duration", "20", "--seed", "3", "--out"]
    said = done(*words, "log.csv")
    told, *left_out = said.splitlines()
    assert told == "log.csv: 20 s, rich manoeuvres, field sensors, seed 3; hidden: X_uu -8 -> -20"
    assert left_out[-1] == (
        "The boat turned to port only: a trim is hard to tell from yaw damping. A longer --duration, or another "
        "--seed, has more manoeuvres in it."
    )
    done(*words, "log.csv.gz")
    done(*words, "log.parquet")
    assert gzip.decompress(Path("log.csv.gz").read_bytes()) == Path("log.csv").read_bytes()
    assert len(pd.read_parquet("log.parquet")) == len(pd.read_csv("log.csv"))
    first = files(here)
    for name in first:
        done(*words, name)
    assert files(here) == first


def test_simulate_says_whether_values_are_added_or_absolute(here: Path) -> None:
    told = " ".join(done("simulate", "--help").split())
    added, absolute = told.split("Put in the place of the vehicle's own number")
    for effect in undertow.EFFECTS:
        assert re.search(rf"\b{effect.name}\b", added if effect.added else absolute)
    words = ["simulate", "-v", "blueboat", "--duration", "20", "--out", "log.csv"]
    assert "hidden: lag 0 -> 0.3, memory_sway 0 -> 10," in done(
        *words, "--effect", "lag=0.3", "--effect", "wake_memory=10"
    )
    assert "hidden: X_uu -8 -> -20\n" in done(*words, "--effect", f"{HIDDEN}=-12")


def test_inspect_as_a_table_and_as_json(place: Path) -> None:
    table = inspected("inspect", place / "log.csv", "-v", "blueboat")
    assert all(word in table for word in ("Channels", "newton_port", "rad/s", "What the boat did"))
    content = strict(inspected("inspect", place / "log.csv", "-v", "blueboat", "--json"))
    assert content["schema"] == "undertow.inspection/1"
    assert [c["name"] for c in content["channels"]] == [*"xy", "psi", *"uvr", "newton_port", "newton_stbd"]
    written = strict((place / "run" / "inspection.json").read_text())
    assert written == {"schema": "undertow.inspections/1", "logs": [content]}


def test_compare_takes_run_folders_and_vehicle_files(place: Path, here: Path) -> None:
    models = ["--model", place / "run", "--model", place / "run" / "model.yaml", "--model", "blueboat"]
    words = ["compare", place / "log.csv", "-v", "blueboat", *models]
    table = done(*words)
    assert all(word in table for word in ("nominal", "run", "model.yaml", "Predictions on", "10 s", "Where it fails"))
    content = strict(done(*words, "--json", "--out", here / "comparison.json"))
    assert strict((here / "comparison.json").read_text()) == content
    check_comparison(content)
    nominal, _, _, _, run, file, same = content["models"]
    assert [m["name"] for m in content["models"]] == [*REFERENCES, "run", str(place / "run" / "model.yaml"), "blueboat"]
    kinds = ["physics", "physics", "baseline", "baseline", "symbolic", "symbolic", "physics"]
    assert [m["kind"] for m in content["models"]] == kinds
    own = ("name", "kind", "parameters", "seconds_to_fit", "seconds_to_evaluate", "band")
    assert {k: v for k, v in run.items() if k not in own} == {k: v for k, v in file.items() if k not in own}
    assert same["rollout"] == nominal["rollout"]
    assert run["rollout"]["10"]["surge"] < nominal["rollout"]["10"]["surge"] / 3


def test_compare_judges_on_the_part_that_was_asked_for(place: Path) -> None:
    content = strict(done("compare", place / "log.csv", "-v", "blueboat", "--split", "train", "--json"))
    nominal = VehicleModel(load_vehicle("blueboat"), "nominal")
    starts = {}
    for part in ("test", "validation", "train"):
        judged = undertow.read_inputs(place / "log.csv", "blueboat", judge=part).parts.judged
        starts[part] = rollout_scores(nominal, judged, (2.0,))["2"].starts
    assert (content["split"], content["models"][0]["rollout"]["2"]["starts"]) == ("train", starts["train"])
    assert starts["train"] > max(starts["test"], starts["validation"])


def test_models_of_one_name_are_told_apart(place: Path, here: Path) -> None:
    Path("model.yaml").write_bytes((place / "run" / "model.yaml").read_bytes())
    Path("other").mkdir()
    other = Path("other/model.yaml")
    other.write_bytes(Path("model.yaml").read_bytes())
    models = ["--model", "model.yaml", "--model", other, "--model", place / "run" / "model.yaml"]
    words = ["compare", place / "log.csv", "-v", "blueboat", *models, "--json"]
    # The model of a run bears the run's name, so that those of two runs are told apart.
    assert [m["name"] for m in strict(done(*words))["models"]] == [*REFERENCES, "model", "other/model.yaml", "run"]


@pytest.fixture
def searched(found: undertow.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """The search has been made."""
    monkeypatch.setattr("undertow.workflows.discover_and_add.discover", lambda *_, **__: found)


@pytest.mark.usefixtures("searched")
def test_discover_prints_the_story(place: Path, here: Path) -> None:
    result = call("discover", place / "log.csv", "-v", "blueboat", "--out", "run", "--no-report")
    assert result.exit_code == 0
    words = ("The file's X_uu (about", "Where it fails", "X_uu = -19.999", "nominal model", "run/model.yaml")
    assert not [word for word in words if word not in result.stdout], result.stdout[:1500]
    assert "report.html" not in result.stdout
    assert all(line.startswith("  ") for line in result.stderr.splitlines())
    assert set(files(here / "run")) == set(files(place / "run")) - {"report.html"}
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert "\N{HORIZONTAL ELLIPSIS}" not in result.stdout


def test_discover_says_what_could_not_be_judged(here: Path) -> None:
    done("simulate", "-v", "blueboat", "--programme", "gentle", "--duration", "120", "--out", "log.csv")
    said = done("discover", "log.csv", "-v", "blueboat", "--out", "run", "--no-report")
    assert "Nothing material is missing" in said
    assert re.search(r"reverse thrust loss +cannot tell *\n", said)
    assert "Could not be judged in this log: reverse thrust loss" in said
    advice = " ".join(said.partition("What to record next")[2].split())
    assert re.search(
        r"astern\b[^;]*would show a plausible .*reverse thrust loss as \d+ % of the (surge|yaw) force", advice
    )
    assert "Corrected vehicle" not in said


@pytest.mark.usefixtures("searched")
def test_discover_prints_only_json_when_asked(place: Path, here: Path) -> None:
    result = call("discover", place / "log.csv", "-v", "blueboat", "--out", "run", "--no-report", "--json")
    assert result.exit_code == 0
    check_findings(strict(result.stdout))
    assert result.stdout == Path("run/findings.json").read_text() == (place / "run" / "findings.json").read_text()


def test_the_same_inputs_and_seed_give_the_same_bytes(place: Path, here: Path) -> None:
    words = ["discover", place / "log.csv", "-v", "blueboat", "--out", "again", "--seed", "0"]
    ran = process(SCRIPT, *words, cwd=here, PYTHONHASHSEED="7", OMP_NUM_THREADS="1")
    assert ran.returncode == 0, ran.stderr
    assert files(here) == {"again": None, **{f"again/{name}": data for name, data in files(place / "run").items()}}


def test_add_to_a_run_and_to_a_log_gives_the_same(place: Path, here: Path) -> None:
    shown = done("add", HIDDEN, "--run", place / "run", "--out", "from_run.yaml")
    assert f"Added by name: {in_words.words(HIDDEN)}." in shown
    assert "X_uu = -1" in shown
    assert "Corrected vehicle: from_run.yaml" in shown
    words = [HIDDEN, place / "log.csv", "--vehicle", "blueboat", "--out", "from_log.yaml"]
    content = strict(done("add", *words, "--json"))
    assert set(files(here)) == {"from_run.yaml", "from_log.yaml"}
    one, other = (load_vehicle(f"from_{what}.yaml").to_dict() for what in ("run", "log"))
    told = [vehicle.pop("sources")["damping"] for vehicle in (one, other)]
    assert nearly(one, other)
    assert all(
        re.match(r"X_uu missing \((> )?99 %\): identified by undertow from all of log.csv", text) for text in told
    )
    assert load_vehicle("from_run.yaml").value("X_uu") == pytest.approx(-20.0, abs=0.3)
    assert content["schema"] == "undertow.added/1"
    check_steps(content["steps"])
    assert [step["added"] for step in content["steps"]] == [None, HIDDEN]
    before, after = (step["rollout_rmse"]["10"]["surge"] for step in content["steps"])
    assert after < before / 3


def test_add_keeps_the_order_of_several_effects(place: Path) -> None:
    content = strict(done("add", "yaw_speed_damping", HIDDEN, "yaw:u|r|", "--run", place / "run", "--json"))
    assert [step["added"] for step in content["steps"]] == [None, "yaw_speed_damping", HIDDEN, "yaw:u|r|"]


def test_add_says_which_thruster_and_prints_terms_without_a_name(place: Path) -> None:
    shown = done("add", "thruster_asymmetry[port]", "yaw:u|r|", "--run", place / "run")
    assert "thruster asymmetry (port)" in shown
    assert "port_scale = " in shown
    assert re.search(r"yaw +u\|r\| +-?\d", shown)


def test_report_writes_the_same_page_again(place: Path, here: Path) -> None:
    for name, data in files(place / "run").items():
        Path(name).write_bytes(data or b"")
    Path("report.html").write_text("spoilt")
    refused("report", ".", match=r"report\.html, which undertow did not write, or which was changed since")
    assert done("report", ".", "--force") == "report.html\n"
    assert files(here) == files(place / "run")


def test_several_logs_are_one_data_set(place: Path, here: Path) -> None:
    done("simulate", "-v", "blueboat", "--duration", "40", "--seed", "5", "--out", "other.csv")
    content = strict(done("compare", place / "log.csv", "other.csv", "-v", "blueboat", "--json"))
    assert content["logs"] == [str(place / "log.csv"), "other.csv"]
    inputs = undertow.read_inputs([place / "log.csv", "other.csv"], "blueboat")
    undertow.write_run(undertow.add([HIDDEN], inputs), "run")
    inspected = strict(Path("run/inspection.json").read_text())
    assert [log["path"] for log in inspected["logs"]] == content["logs"]
    page = Path("run/report.html").read_text()
    assert all(f"inspection of {path}" in page for path in content["logs"])


def test_the_frame_and_the_map_reach_the_reader(place: Path, here: Path) -> None:
    table = pd.read_csv(place / "log.csv")
    table["field"] = table["field"].replace("u", "speed")
    table.to_csv("log.csv", index=False)
    Path("map.yaml").write_text("u: speed\n")
    words = ["log.csv", "-v", "blueboat", "--map", "map.yaml", "--frame", "ned"]
    done("discover", *words, "--out", "run", "--no-report")
    record = strict(Path("run/run.json").read_text())
    assert (record["frame"], record["channel_map"], record["logs"]) == ("ned", "map.yaml", ["log.csv"])
    assert any("speed" in note for note in strict(Path("run/findings.json").read_text())["data"]["notes"])
    assert Path("run/model.yaml").read_bytes() == (place / "run" / "model.yaml").read_bytes()
    assert "surge quadratic" in done("add", HIDDEN, "--run", "run")


def test_a_reader_that_leaves_ends_without_a_word(place: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    words = [str(SCRIPT), "inspect", str(place / "log.csv"), "--json"]
    ran = subprocess.run(words, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert ran.stderr == ""


def test_a_terminal_that_knows_only_ascii(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["undertow", "compare", str(place / "log.csv"), "-v", "blueboat"])
    monkeypatch.setattr(sys, "stdout", TextIOWrapper(BytesIO(), encoding="ascii"))
    with pytest.raises(SystemExit) as end:
        main()
    sys.stdout.seek(0)
    assert (end.value.code, "m/s?" in sys.stdout.read()) == (0, True)


# What the files hold, DESIGN section 4; more keys are allowed


def check_keys(record: dict[str, Any], *keys: str) -> None:
    assert set(keys) <= set(record), f"{set(keys) - set(record)} not in {record}"


def check_units(errors: dict[str, float], units: dict[str, str]) -> None:
    assert set(errors) - {"diverged", "starts"} == set(units)
    assert all(isinstance(unit, str) and unit for unit in units.values())


def check_steps(steps: list[dict[str, Any]]) -> None:
    for step in steps:
        check_keys(step, "added", "acceleration_rmse", "rollout_rmse")
        check_units(step["acceleration_rmse"], step["units"]["acceleration_rmse"])
        assert list(step["rollout_rmse"]) == ["2", "10"]
        for errors in step["rollout_rmse"].values():
            check_units(errors, step["units"]["rollout_rmse"])


def check_interval(term: dict[str, Any]) -> None:
    if term["ci95"] is not None:
        low, high = term["ci95"]
        assert low <= high


def check_findings(findings: dict[str, Any]) -> None:
    keys = ("verdict", "missing", "candidates", "unnamed", "steps", "failures", "advice", "data")
    check_keys(findings, "schema", *keys)
    assert findings["schema"] == "undertow.findings/2"
    assert findings["verdict"] in ("missing", "likely", "nothing missing", "undecided")
    assert set(findings["missing"]) <= set(undertow.EFFECTS and {effect.name for effect in undertow.EFFECTS})
    for candidate in findings["candidates"]:
        check_keys(candidate, "effect", "sentence", "family", "verdict", "confidence", "error_drop")
        check_keys(candidate, "indistinguishable_from", "terms")
        assert candidate["verdict"] in ("missing", "possible", "no evidence")
        assert 0.0 <= candidate["confidence"] <= 1.0
        assert 0.0 <= candidate["error_drop"] <= 1.0
        for term in candidate["terms"]:
            check_keys(term, "symbol", "axis", "form", "value", "unit", "ci95")
            check_interval(term)
    for term in findings["unnamed"]:
        check_keys(term, "axis", "form", "value", "ci95")
        check_interval(term)
    assert findings["steps"][0]["added"] is None
    check_steps(findings["steps"])
    for failure in findings["failures"]:
        check_keys(failure, "where", "share_of_error", "axis", "unit", "rows_of")
        assert failure["rows_of"] in ("test", "all")
    for line in findings["advice"]:
        check_keys(line, "manoeuvre", "why")
    check_keys(findings["data"], "rows", "seconds", "split", "notes")
    assert findings["data"]["split"] == "4 folds, each judged by models that were searched and fitted without it"
    assert isinstance(findings["data"]["rows"], int)


def check_comparison(comparison: dict[str, Any]) -> None:
    check_keys(comparison, "schema", "split", "logs", "best", "models", "differences", "failures", "notes")
    assert comparison["schema"] == "undertow.comparison/1"
    assert comparison["best"]["model"] in {model["name"] for model in comparison["models"]}
    for model in comparison["models"]:
        keys = ("name", "kind", "acceleration", "rollout", "audit", "parameters", "seconds_to_fit")
        check_keys(model, *keys)
        assert model["kind"] in ("physics", "symbolic", "hybrid", "network", "baseline")
        assert model["audit"] in ("pass", "fail", "not run")
        assert isinstance(model["parameters"], int)
        check_keys(model["acceleration"], "rmse", "mae", "r2")
        assert set(model["acceleration"]["r2"]) == AXES
        for name in ("rmse", "mae"):
            check_units(model["acceleration"][name], model["units"]["acceleration"])
        for errors in model["rollout"].values():
            check_keys(errors, *AXES, "position", "diverged", "starts")
            check_units(errors, model["units"]["rollout"])
            assert isinstance(errors["diverged"], int)
            assert errors["starts"] > 0
    for failure in comparison["failures"]:
        check_keys(failure, "model", "where", "axis", "share_of_error", "rows", "unit")
        assert failure["axis"] in AXES


def test_the_run_folder_holds_what_was_promised(place: Path) -> None:
    run = place / "run"
    assert {"findings.json", "model.yaml", "comparison.json", "audit.json", "report.html"} <= set(files(run))
    for path in run.glob("*.json"):
        content = strict(path.read_text("utf-8"))
        if path.name == "series.foxglove.json":
            continue  # whose schema is Foxglove's
        name = "inspections" if path.stem == "inspection" else path.stem  # one for each log
        assert content["schema"] == f"undertow.{name}/{2 if name == 'findings' else 1}"
        assert "\r" not in path.read_text("utf-8")
    findings, comparison = (strict((run / f"{name}.json").read_text()) for name in ("findings", "comparison"))
    check_findings(findings)
    check_comparison(comparison)
    assert (findings["verdict"], findings["missing"]) == ("missing", [HIDDEN])
    assert findings["candidates"][0]["effect"] == HIDDEN
    term = findings["candidates"][0]["terms"][0]
    assert (term["symbol"], term["axis"], term["unit"]) == ("X_uu", "surge", "N s^2/m^2")
    assert term["value"] == pytest.approx(-12.0, abs=0.3)
    assert findings["failures"]
    assert comparison["failures"]
    assert {model["name"] for model in comparison["models"]} == {*REFERENCES, "corrected"}
    series = pd.read_csv(run / "series.csv")
    columns = ("time", "u", "u_dot", "u_before", "u_after", "u_dot_before", "u_dot_after", "X_residual", "N_residual")
    assert set(columns) <= set(series.columns)
    assert load_vehicle(run / "model.yaml").value("X_uu") == pytest.approx(-20.0, abs=0.3)
    assert load_vehicle(run / "model.yaml").sources["damping"].startswith(("X_uu missing (9", "X_uu missing (> 99"))
    assert load_vehicle(run / "nominal.yaml").sources == load_vehicle("blueboat").sources
    assert load_vehicle(run / "nominal.yaml").values == load_vehicle("blueboat").values
    page = (run / "report.html").read_text("utf-8")
    assert page.startswith("<!doctype html>")
    assert not re.search(r"src=\"|href=\"http", page)
