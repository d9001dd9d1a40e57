"""The command line as a user meets it: what each verb says and writes, and how it refuses."""

import gzip
import json
import os
import random
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO, StringIO, TextIOWrapper
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd
import pytest
import yaml
from verbs import call, done, files, inspected, process, refused, strict

import undertow
from undertow.__main__ import main
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.scores import rollout_scores

VERBS = ("demo", "inspect", "compare", "discover", "fit", "add", "simulate", "report")
HIDDEN = "surge_quadratic_damping"
REFERENCES = ("nominal", "calibrated", "zero acceleration", "hold velocity")
"""Models that every comparison has."""
AXES = {"surge", "sway", "yaw"}
TIME = np.arange(0.0, 40.0, 0.1)


SCRIPT = Path(sysconfig.get_path("scripts"), "undertow")


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
    assert said == "log.csv: 20 s, rich manoeuvres, field sensors, seed 3; hidden: X_uu -8 -> -20\n"
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
    own = ("name", "kind", "parameters", "seconds_to_fit", "seconds_to_evaluate")
    assert {k: v for k, v in run.items() if k not in own} == {k: v for k, v in file.items() if k not in own}
    assert same["rollout"] == nominal["rollout"]
    assert run["rollout"]["10"]["surge"] < nominal["rollout"]["10"]["surge"] / 3


def test_compare_judges_on_the_part_that_was_asked_for(place: Path) -> None:
    content = strict(done("compare", place / "log.csv", "-v", "blueboat", "--split", "train", "--json"))
    nominal = VehicleModel(load_vehicle("blueboat"), "nominal")
    starts = {}
    for part in ("test", "validation", "train", "all"):
        judged = undertow.read_inputs(place / "log.csv", "blueboat", judge=part).parts.judged
        starts[part] = rollout_scores(nominal, judged, (2.0,))["2"].starts
    assert (content["split"], content["models"][0]["rollout"]["2"]["starts"]) == ("train", starts["train"])
    assert starts["all"] == starts["test"] + starts["validation"] + starts["train"]


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
    words = ("is missing surge quadratic damping", "Where it fails", "X_uu = -1", "nominal model", "run/model.yaml")
    assert all(word in result.stdout for word in words)
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
    assert f"Added by name: {HIDDEN}." in shown
    assert "X_uu = -1" in shown
    assert "Corrected vehicle: from_run.yaml" in shown
    words = [HIDDEN, place / "log.csv", "--vehicle", "blueboat", "--out", "from_log.yaml"]
    content = strict(done("add", *words, "--json"))
    assert set(files(here)) == {"from_run.yaml", "from_log.yaml"}
    assert Path("from_run.yaml").read_bytes() == Path("from_log.yaml").read_bytes()
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
    assert findings["schema"] == "undertow.findings/1"
    assert findings["verdict"] in ("missing", "nothing missing", "undecided")
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
    assert findings["data"]["split"] == "chronological 70/15/15"
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
        name = "inspections" if path.stem == "inspection" else path.stem  # one for each log
        assert content["schema"] == f"undertow.{name}/1"
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
    assert load_vehicle(run / "model.yaml").sources["damping"].startswith("X_uu: identified by undertow from log.csv;")
    assert load_vehicle(run / "nominal.yaml").sources == load_vehicle("blueboat").sources
    assert load_vehicle(run / "nominal.yaml").values == load_vehicle("blueboat").values
    page = (run / "report.html").read_text("utf-8")
    assert page.startswith("<!doctype html>")
    assert not re.search(r"<script|src=\"http|href=\"http", page)


# Refusals: exit code 2, one message on stderr, nothing on stdout, nothing on the disk


def wide(**columns: Any) -> str:
    """A wide log of a boat that circles, 40 s at 10 Hz; columns are replaced, or left out with None."""
    table = {
        "t": TIME,
        "x": np.sin(0.2 * TIME),
        "y": 1.0 - np.cos(0.2 * TIME),
        "psi": (0.2 * TIME + np.pi) % (2.0 * np.pi) - np.pi,
        "u": 0.2 + 0.0 * TIME,
        "v": 0.0 * TIME,
        "r": 0.2 + 0.0 * TIME,
        "newton_port": 5.0 + 0.0 * TIME,
        "newton_stbd": 4.0 + 0.0 * TIME,
        **columns,
    }
    text = StringIO()
    pd.DataFrame({name: column for name, column in table.items() if column is not None}).to_csv(text, index=False)
    return text.getvalue()


RUBBISH = bytes([0, 255, 10, 13, *random.Random(1).randbytes(4000)])
EXPECTED = r"expected a CSV or Parquet table with the header 'time,topic,field,value'"

BAD_LOGS: dict[str, tuple[str, bytes | str, str]] = {
    "empty": ("log.csv", b"", rf"log\.csv: the file is empty; {EXPECTED}"),
    "header alone": ("log.csv", b"t,u,v,r\n", r"log\.csv: a header but no rows; the log is empty"),
    "rubbish": ("log.csv", RUBBISH, rf"log\.csv: got binary content; {EXPECTED}"),
    "rubbish as gzip": ("log.csv.gz", RUBBISH, rf"log\.csv\.gz: got binary content; {EXPECTED}"),
    "rubbish as Parquet": ("log.parquet", RUBBISH, rf"log\.parquet: got binary content; {EXPECTED}"),
    "broken gzip": (
        "log.csv.gz",
        gzip.compress(wide().encode())[:900],
        r"log\.csv\.gz: a broken gzip file .*Copy the log again",
    ),
    "broken Parquet": ("log.parquet", b"PAR1" + RUBBISH, r"log\.parquet: a broken Parquet file .*Copy the log again"),
    "no time": ("log.csv", wide(t=None), r"log\.csv: got the header 'x,y,psi,u,v,r,.*'; expected a CSV or Parquet"),
    "no heading": (
        "log.csv",
        wide(psi=None),
        r"log\.csv: expected a heading \(psi or a quaternion\), got only x y u v",
    ),
    "no command": (
        "log.csv",
        wide(newton_stbd=None),
        r"log\.csv: missing command channel newton_stbd of thruster 'stbd'; commands in the log: newton_port",
    ),
    "time runs back": (
        "log.csv",
        wide(t=np.where(TIME < 20.0, TIME, TIME - 5.0)),
        r"log\.csv: time runs backwards in x \(x\) at row 202: 15\.0+ s after 19\.9\d* s\. Sort the log",
    ),
    "only NaN": (
        "log.csv",
        wide(r=np.nan * TIME),
        r"log\.csv: r \(r\) holds no number in any of its 400 rows.*'r: null' in a channel map",
    ),
    "PWM": (
        "log.csv",
        wide(newton_port=None, pwm_port=np.where(TIME < 3.0, 1500.0, 2201.0)),
        r"pwm_port .* must lie within 800 to 2200 \[us\], got 2201 at t = 3\.000 s",
    ),
    "another kind of command": (
        "log.csv",
        wide(newton_port=None, pwm_port=1500.0 + 0.0 * TIME),
        r"log\.csv: wrong command kind: the vehicle wants newton_port \[N\] for thruster 'port', the log has pwm_port",
    ),
    "too short": (
        "log.csv",
        "\n".join(wide().splitlines()[:191]),
        r"log\.csv: expected at least 20 s of usable log, got 1\d\.\d s .*Record longer",
    ),
}


@pytest.mark.parametrize("case", BAD_LOGS)
def test_bad_logs(case: str, here: Path) -> None:
    name, content, match = BAD_LOGS[case]
    Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
    words = [name, "--vehicle", "blueboat"]
    message = refused("discover", *words, "--out", "run", match=match)
    assert refused("compare", *words, match=match) == message
    assert refused("add", HIDDEN, *words, "--out", "new.yaml", match=match) == message
    assert not Path("run").exists()


@pytest.mark.parametrize("verb", ["inspect", "compare", "discover", "add"])
def test_logs_that_are_no_files(verb: str, here: Path) -> None:
    words = {
        "inspect": [],
        "compare": ["-v", "blueboat"],
        "discover": ["-v", "blueboat", "--out", "run"],
        "add": ["-v", "blueboat"],
    }[verb]
    first = [verb, HIDDEN] if verb == "add" else [verb]
    Path("folder").mkdir()
    refused(*first, "none.csv", *words, match=r"none\.csv: no such file; expected a log .*Check the path")
    refused(*first, "folder", *words, match=r"folder: expected a folder of logs, got no file; expected a CSV")


def test_a_log_given_twice(place: Path, here: Path) -> None:
    Path("log.csv").write_bytes((place / "log.csv").read_bytes())
    again = r"log\.csv is given twice; held-out rows would also be training rows\. Give it once"
    refused("discover", "log.csv", "./log.csv", "-v", "blueboat", "--out", "run", match=again)
    refused("compare", "log.csv", here / "log.csv", "-v", "blueboat", match=again)


def test_a_real_process_refuses_alike(here: Path) -> None:
    ran = process(SCRIPT, "discover", "none.csv", "-v", "blueboat", "--out", "run", cwd=here)
    assert (ran.returncode, ran.stdout, files(here)) == (2, "", {})
    assert (
        ran.stderr
        == "undertow: none.csv: no such file; expected a log (CSV, CSV.gz, Parquet, a bag, ...). Check the path.\n"
    )
    ran = process(sys.executable, "-m", "undertow", "discover", cwd=here)
    assert (ran.returncode, ran.stdout) == (2, "")
    assert "Missing argument 'LOG...'" in ran.stderr


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="file names are text there")
def test_a_log_whose_name_is_no_text(place: Path, here: Path) -> None:
    name = os.fsdecode(b"l\xf6g.csv")
    Path(name).write_bytes((place / "log.csv").read_bytes())
    match = r"'l\\udcf6g\.csv': the file name is not UTF-8, so no report could name it; rename it"
    refused("compare", name, "-v", "blueboat", match=match)


def boat(path: str, value: Any) -> str:
    """The BlueBoat's file with the entry at a dotted path replaced."""
    data = load_vehicle("blueboat").model_dump(mode="json")
    *parents, last = path.split(".")
    part = data
    for key in parents:
        part = part[key]
    part[last] = value
    return yaml.safe_dump(data)


BAD_VEHICLES: dict[str, tuple[bytes | str, str]] = {
    "no mass": (boat("mass", 0.0), r"vehicle file boat\.yaml: mass: Input should be greater than 0, got 0\.0"),
    "negative mass": (boat("mass", -22.0), r"mass: Input should be greater than 0, got -22"),
    "negative inertia": (boat("inertia_z", -1.0), r"inertia_z: Input should be greater than 0, got -1"),
    "M": (
        boat("added_mass.X_udot", 31.0),
        r"the mass matrix M = M_RB \+ M_A is not positive definite: m11=-0\.5, .*X_udot = -2\.6 adds 2\.6 kg",
    ),
    "M off its diagonal": (boat("added_mass.Y_rdot", 40.0), r"M_A is not positive definite: .*m23=-41\.6952"),
    "unknown key": (boat("mas", 3.0), r"unknown key 'mas' in the vehicle file: did you mean 'mass'"),
    "unknown symbol": (boat("damping.X_uuu", -1.0), r"unknown key 'X_uuu' in damping: did you mean 'X_uu'"),
    "infinite": (boat("mass", float("inf")), r"mass: expected a finite number of at most 1e\+18, got inf"),
    "empty": (b"", r"vehicle file boat\.yaml: expected a mapping of vehicle keys \(mass, .*, got NoneType"),
    "rubbish": (RUBBISH, r"vehicle file boat\.yaml: not readable as YAML"),
    "no YAML": (b"mass: [1, 2", r"vehicle file boat\.yaml: not readable as YAML"),
}


@pytest.mark.parametrize("case", BAD_VEHICLES)
def test_bad_vehicles(case: str, place: Path, here: Path) -> None:
    content, match = BAD_VEHICLES[case]
    Path("boat.yaml").write_bytes(content.encode() if isinstance(content, str) else content)
    log = place / "log.csv"
    refused("discover", log, "-v", "boat.yaml", "--out", "run", match=match)
    refused("compare", log, "-v", "blueboat", "--model", "boat.yaml", match=match)
    refused("simulate", "-v", "boat.yaml", "--out", "new.csv", match=match)
    refused("inspect", log, "-v", "boat.yaml", match=match)


def test_a_vehicle_that_is_not_there(place: Path, here: Path) -> None:
    match = r"vehicle file boaty: no such file; give a YAML file or one of blueboat, blueboat_paper, cybership2, otter"
    refused("discover", place / "log.csv", "-v", "boaty", "--out", "run", match=match)
    refused("compare", place / "log.csv", "-v", "blueboat", "--model", "boaty", match=match)


NEAREST = r"unknown effect 'surge_quadratc': did you mean 'surge_quadratic_damping'\? The catalogue has: advance_loss"

BAD_REQUESTS: dict[str, tuple[str, str]] = {
    "frame": ("compare LOG -v blueboat --frame nwu", r"frame 'nwu': expected enu or ned"),
    "frame of inspect": ("inspect LOG --frame ENU", r"frame 'ENU': expected enu or ned"),
    "split": ("compare LOG -v blueboat --split dev", r"split 'dev': expected one of train, validation, test, all"),
    "map": (
        "discover LOG -v blueboat --out new --map none.yaml",
        r"none\.yaml: no such channel map; expected a YAML file of 'channel: topic:field' lines",
    ),
    "model with other thrusters": (
        "compare LOG -v blueboat --model otter",
        r"model otter: expected the commands of the nominal vehicle, newton_port newton_stbd, got rad_s_port",
    ),
    "model twice": ("compare LOG -v blueboat --model RUN --model RUN", r"model .*run is given twice; give it once"),
    "model without a file": (
        "compare LOG -v blueboat --model folder",
        r"folder holds no model\.yaml; give a run folder, a network or a vehicle file",
    ),
    "out in a missing folder": (
        "discover LOG -v blueboat --out none/run",
        r"cannot write none/run: .*none does not exist; make it",
    ),
    "out is a file": (
        "discover LOG -v blueboat --out file",
        r"cannot write file: it is a file; give a folder that may be made",
    ),
    "out holds other files": (
        "discover LOG -v blueboat --out folder",
        r"cannot write folder: the folder holds other files \(.*\) and nothing that this verb wrote; give a new one",
    ),
    "out of the demo": ("demo --out folder", r"cannot write folder: the folder holds other files"),
    "effect to add": ("add surge_quadratc --run RUN", NEAREST),
    "effect to add to a log": ("add surge_quadratc LOG -v blueboat", NEAREST),
    "thruster to add": (
        "add thruster_asymmetry[aft] --run RUN",
        r"unknown effect 'thruster_asymmetry\[aft\]' for BlueBoat.*: did you mean 'thruster_asymmetry\[stbd\]'",
    ),
    "term to add": ("add yaw:w --run RUN", r"term form 'w': expected a product of one to three of u, v, r"),
    "axis to add": ("add heave:u --run RUN", r"term 'heave:u': expected surge:, sway: or yaw: before the form"),
    "effect added twice": (f"add {HIDDEN} {HIDDEN} --run RUN", r"add: an effect is given twice in .*; give each once"),
    "add without a run or a log": (
        f"add {HIDDEN}",
        r"add: expected either --run RUN, or --vehicle V and a LOG after the effects",
    ),
    "add with both": (f"add {HIDDEN} LOG --run RUN -v blueboat", r"add: expected either --run RUN, or --vehicle V"),
    "add without a log": (
        f"add {HIDDEN} -v blueboat",
        rf"add: expected a LOG after the effects {HIDDEN}, got none",
    ),
    "add without an effect": ("add LOG -v blueboat", r"add: expected at least one effect by name, for example surge"),
    "add a log to a run": (
        f"add {HIDDEN} LOG --run RUN --frame ned",
        r"add: --run takes the logs, .*; leave out .*log\.csv --frame, or give --vehicle V in place of --run",
    ),
    "add to no run": (
        f"add {HIDDEN} --run folder",
        r"folder is not a run folder \(no readable run\.json in it\); write one with 'undertow discover LOG",
    ),
    "add to nothing": (f"add {HIDDEN} --run none", r"none is not a run folder"),
    "add into a missing folder": (
        f"add {HIDDEN} --run RUN --out none/new.yaml",
        r"cannot write none/new\.yaml: the folder none does not exist; create it first",
    ),
    "add into a folder": (
        f"add {HIDDEN} --run RUN --out folder",
        r"cannot write folder: it is a folder; give the name",
    ),
    "report of nothing": ("report none", r"expected a run folder at none, but there is none; run 'undertow discover"),
    "report of no run": ("report folder", r"run folder folder has no findings\.json; run 'undertow discover"),
    "noise": (
        "simulate -v blueboat --out new.csv --noise ruff",
        r"unknown noise 'ruff': did you mean 'rough'\? There are: clean, field, rough",
    ),
    "programme": (
        "simulate -v blueboat --out new.csv --programme zigzg",
        r"unknown programme 'zigzg': did you mean 'zigzag'\? There are: rich, zigzag, gentle",
    ),
    "hidden effect": ("simulate -v blueboat --out new.csv --effect surge_quadratc=-9", NEAREST),
    "hidden effect without a value": (
        f"simulate -v blueboat --out new.csv --effect {HIDDEN}",
        rf"effect '{HIDDEN}': expected name=value, for example surge_quadratic_damping=-9",
    ),
    "hidden effect of words": (
        f"simulate -v blueboat --out new.csv --effect {HIDDEN}=much",
        rf"effect '{HIDDEN}=much': expected a number after {HIDDEN}=, got 'much'",
    ),
    "hidden effect beyond its limits": (
        "simulate -v blueboat --out new.csv --effect thruster_lag=-1",
        r"lag would be -1 s \(the vehicle has 0\); expected at least 0",
    ),
    "hidden effect that breaks the vehicle": (
        "simulate -v blueboat --out new.csv --effect X_udot=40",
        r"X_udot would be 37 kg \(the vehicle has -3\); expected at most 0 kg",
    ),
    "hidden effect twice": (
        f"simulate -v blueboat --out new.csv --effect {HIDDEN}=-9 --effect {HIDDEN}=-4",
        rf"--effect {HIDDEN}=-4: {HIDDEN} is given twice; give each effect once, with all its values",
    ),
    "hidden thruster twice": (
        "simulate -v blueboat --out new.csv --effect thruster_asymmetry=port:0.9 --effect port_scale=0.8",
        r"--effect port_scale=0\.8: port_scale is given twice",
    ),
    "log in a missing folder": (
        "simulate -v blueboat --out none/new.csv",
        r"cannot write none/new\.csv: the folder none does not exist; create it first",
    ),
    "log in the place of a folder": ("simulate -v blueboat --out folder", r"cannot write folder: it is a folder; give"),
}


@pytest.mark.parametrize("case", BAD_REQUESTS)
def test_bad_requests(case: str, place: Path, here: Path) -> None:
    Path("file").write_text("mine")
    Path("folder").mkdir()
    Path("folder", "notes.txt").write_text("mine")
    command, match = BAD_REQUESTS[case]
    named = {"LOG": place / "log.csv", "RUN": place / "run"}
    before = files(place)
    refused(*(named.get(word, word) for word in command.split()), match=match)
    assert files(place) == before


@pytest.mark.parametrize(
    ("command", "option"),
    [
        ("discover LOG -v blueboat --out run --seed -1", "--seed"),
        ("discover LOG -v blueboat --out run --seed one", "--seed"),
        ("discover LOG --out run", "--vehicle"),
        ("discover LOG -v blueboat", "--out"),
        ("simulate -v blueboat --out new.csv --seed -1", "--seed"),
        ("simulate -v blueboat --out new.csv --duration 0", "--duration"),
        ("simulate -v blueboat --out new.csv --duration 1e12", "--duration"),
        ("simulate -v blueboat --out new.csv --duration nan", "--duration"),
        ("simulate -v blueboat --out new.csv --durations 3", "--duration"),
        ("add --run run", "EFFECT"),
        ("report", "RUN"),
        ("discovr", "discover"),
    ],
)
def test_wrong_usage(command: str, option: str, place: Path, here: Path) -> None:
    result = call(*(place / "log.csv" if word == "LOG" else word for word in command.split()))
    assert (result.exit_code, result.stdout, files(here)) == (2, "", {})
    assert isinstance(result.exception, SystemExit)
    assert option in result.stderr
    assert "Traceback" not in result.stderr


# Runs that are broken, or whose log is gone


@pytest.fixture
def copy(place: Path, here: Path) -> Path:
    """A copy of the run folder, to be spoilt."""
    folder = here / "run"
    folder.mkdir()
    for name, data in files(place / "run").items():
        (folder / name).write_bytes(data or b"")
    return folder


def spoil(path: Path, *keys: str | int, value: Any) -> None:
    """Replace one entry of a JSON file."""
    content = json.loads(path.read_text("utf-8"))
    part = content
    for key in keys[:-1]:
        part = part[key]
    part[keys[-1]] = value
    path.write_text(json.dumps(content), "utf-8")


@pytest.mark.parametrize(
    ("name", "keys", "value", "match"),
    [
        (
            "findings",
            ["schema"],
            "undertow.findings/9",
            r"expected schema 'undertow.findings/1', got 'undertow.findings/9",
        ),
        ("findings", ["candidates"], "all", r"expected a list under 'candidates', got 'all'"),
        (
            "findings",
            ["candidates", 0, "terms"],
            ["X_uu"],
            r"expected an object under 'candidates\[0\]\.terms\[0\]'",
        ),
        ("findings", ["candidates", 0], {}, r"candidates\[0\] lacks 'effect', 'verdict', 'confidence', 'error_drop'"),
        ("findings", ["unnamed"], 5, r"expected a list under 'unnamed', got 5"),
        ("findings", ["failures"], [1], r"expected an object under 'failures\[0\]', got 1"),
        ("findings", ["advice"], {}, r"expected a list under 'advice', got \{\}"),
        ("findings", ["steps"], [], r"expected at least one entry in 'steps'"),
        (
            "findings",
            ["steps", 1, "rollout_rmse"],
            None,
            r"expected an object under 'steps\[1\]\.rollout_rmse'",
        ),
        ("findings", ["steps", 1, "rollout_rmse", "soon"], {}, r"expected errors by axis, and by horizon in seconds"),
        ("findings", ["data"], "much", r"expected an object under 'data', got 'much'"),
        ("findings", ["criterion"], [1], r"expected an object under 'criterion', got \[1\]"),
        (
            "findings",
            ["candidates", 0, "confidence"],
            float("nan"),
            r"findings\.json is not valid JSON \(NaN is not JSON",
        ),
        ("comparison", ["models"], {}, r"expected a list under 'models', got \{\}"),
        ("comparison", ["models", 0, "acceleration"], 5, r"expected an object under 'models\[0\].acceleration', got 5"),
        ("comparison", ["models", 0, "rollout"], [5], r"expected an object under 'models\[0\].rollout', got \[5\]"),
        ("comparison", ["failures"], "many", r"expected a list under 'failures', got 'many'"),
        ("comparison", ["logs"], 3, r"expected a list under 'logs', got 3"),
    ],
)
def test_a_tampered_run_gets_no_page(name: str, keys: list[str | int], value: Any, match: str, copy: Path) -> None:
    spoil(copy / f"{name}.json", *keys, value=value)
    message = refused("report", "run", match=match)
    assert f"run/{name}.json" in message
    assert "run 'undertow discover LOG --vehicle V --out RUN' to write the folder anew" in message


def test_a_run_without_its_files_gets_no_page(copy: Path) -> None:
    (copy / "series.csv").unlink()
    refused("report", "run", match=r"run folder run has no series\.csv; run 'undertow discover")


@pytest.mark.parametrize(
    ("key", "value"), [("logs", "log.csv"), ("logs", []), ("logs", [1]), ("frame", 3), ("channel_map", ["a"])]
)
def test_a_tampered_record_of_a_run(key: str, value: Any, copy: Path) -> None:
    spoil(copy / "run.json", key, value=value)
    refused("add", HIDDEN, "--run", "run", match=r"run/run\.json: expected paths under 'logs', a text or null under")


def test_a_network_is_no_run_to_add_to(here: Path) -> None:
    Path("lstm").mkdir()
    Path("lstm", "model.yaml").write_text("schema: undertow.network/1\n", "utf-8")
    match = r"lstm is the folder of a trained network, not of a run: .* 'undertow discover' wrote, or --vehicle V and"
    refused("add", HIDDEN, "--run", "lstm", match=match)


def test_a_run_whose_log_is_gone(copy: Path) -> None:
    spoil(copy / "run.json", "logs", value=["gone.csv"])
    match = (
        r"run was made from gone\.csv, which is not there \(seen from .*\); run this where 'undertow discover' was run"
    )
    refused("add", HIDDEN, "--run", "run", match=match)


# Writing: whole or not at all


def failing(error: BaseException) -> Callable[..., NoReturn]:
    def fail(*_: Any, **__: Any) -> NoReturn:
        raise error

    return fail


def full_disk() -> OSError:
    return OSError(28, "No space left on device")


@pytest.fixture(params=["new", "earlier"])
def target(request: pytest.FixtureRequest, place: Path, here: Path) -> Iterator[Path]:
    """A run folder to be written, once where there is none and once over an earlier run; in the end it is as before."""
    folder = here / "run"
    if request.param == "earlier":
        shutil.copytree(place / "run", folder)
        (folder / "notes.txt").write_text("mine")
    before = files(here)
    yield folder
    assert files(here) == before


@pytest.mark.parametrize(
    "step", ["undertow.workflows.run_folder.write.write_json", "undertow.workflows.run_folder.write.write_page"]
)
@pytest.mark.parametrize("error", [full_disk(), KeyboardInterrupt()], ids=["full disk", "interrupted"])
def test_a_write_that_fails_leaves_nothing(
    step: str, error: BaseException, target: Path, found: undertow.Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(step, failing(error))
    match = r"cannot write the run to .*run: No space left on device" if isinstance(error, OSError) else None
    with pytest.raises((undertow.RequestError, KeyboardInterrupt), match=match):
        undertow.write_run(found, target)


def test_an_earlier_run_is_replaced_and_other_files_stay(place: Path, here: Path, found: undertow.Run) -> None:
    folder = here / "run"
    shutil.copytree(place / "run", folder)
    (folder / "notes.txt").write_text("mine")
    undertow.write_run(found, "run", report=False)
    new = {name: data for name, data in files(place / "run").items() if name != "report.html"}
    assert files(folder) == {**new, "notes.txt": b"mine"}


@pytest.mark.parametrize(
    "command",
    [
        "simulate -v blueboat --duration 20 --out FILE",
        "check blueboat --out FILE --json",
        "compare LOG -v blueboat --series FILE",
    ],
)
def test_a_file_that_is_replaced_is_named(command: str, place: Path, here: Path) -> None:
    words = command.replace("LOG", str(place / "log.csv")).replace("FILE", "file").split()
    first = call(*words)
    second = call(*words)
    assert (first.exit_code, second.exit_code) == (0, 0), second.stderr
    assert "replaced" not in first.stderr
    assert "  replaced the earlier file\n" in second.stderr
    assert "replaced" not in second.stdout


def test_bad_input_leaves_an_earlier_run_alone(copy: Path) -> None:
    refused("discover", "none.csv", "-v", "blueboat", "--out", "run", match="none.csv: no such file")


@pytest.mark.parametrize(
    "command",
    [
        "simulate -v blueboat --duration 20 --out new.csv",
        "simulate -v blueboat --duration 20 --out earlier.csv",
        f"add {HIDDEN} --run RUN --out boat.yaml",
        "discover LOG -v blueboat --out new",
        "report run",
    ],
)
def test_a_verb_that_cannot_write_leaves_what_was_there(
    command: str, place: Path, copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done("simulate", "-v", "blueboat", "--duration", "20", "--seed", "3", "--out", "earlier.csv")
    undertow.load_vehicle(place / "run" / "model.yaml").save("boat.yaml", by="add")
    monkeypatch.setattr(os, "replace", failing(full_disk()))
    named = {"LOG": place / "log.csv", "RUN": place / "run"}
    refused(*(named.get(word, word) for word in command.split()), match="No space left on device")
