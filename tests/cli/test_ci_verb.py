"""The verb `ci`: who is still the boat passes, who was changed breaks a limit, and wrong use says why."""

import os
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import ROOT
from verbs import call, done, refused, strict

import undertow
from undertow.physics.reading import parse_yaml
from undertow.physics.vehicle import load_vehicle


@pytest.fixture(scope="module", autouse=True)
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A log of a boat, its vehicle file, one that was changed since, and limits from the first."""
    folder, before = tmp_path_factory.mktemp("ci"), Path.cwd()
    os.chdir(folder)
    done("simulate", "-v", "blueboat", "--duration", "60", "--out", "log.csv")
    boat = load_vehicle("blueboat")
    boat.save("boat.yaml")
    boat.with_values({"X_u": 3.0 * boat.value("X_u") - 10.0}).save("changed.yaml")
    done("ci", "log.csv", "-v", "boat.yaml", "--write-limits", "limits.yaml")
    yield folder
    os.chdir(before)


def test_the_boat_holds_its_limits() -> None:
    told = done("ci", "log.csv", "-v", "boat.yaml", "--limits", "limits.yaml")
    assert "holds all 8 limits." in told
    assert "NO" not in told.split()


def test_a_changed_boat_breaks_them_and_is_told_by_how_much() -> None:
    result = call("ci", "log.csv", "-v", "changed.yaml", "--limits", "limits.yaml")
    assert result.exit_code == 1
    assert "NO" in result.stdout.split()
    printed = call("ci", "log.csv", "-v", "changed.yaml", "--limits", "limits.yaml", "--json")
    assert printed.exit_code == 1
    found = strict(printed.stdout)
    assert (found["schema"], found["verdict"], found["logs"]) == ("undertow.ci/1", "broken", ["log.csv"])
    (surge,) = [r for r in found["limits"] if (r["quantity"], r["axis"]) == ("prediction", "surge")]
    assert surge["measured"] > 2.0 * surge["limit"]
    assert not surge["holds"]


def test_the_errors_are_those_of_compare() -> None:
    found = undertow.ci(undertow.read_inputs("log.csv", "boat.yaml", judge="all"), "limits.yaml")
    told = strict(done("compare", "log.csv", "-v", "boat.yaml", "--split", "all", "--json"))["models"][0]
    rows = {(row.quantity, row.axis): row.measured for row in found.limits}
    for axis in ("position", "surge", "sway", "yaw"):
        assert rows["prediction", axis] == pytest.approx(told["rollout"]["10"][axis], rel=1e-8)
    assert rows["acceleration", "yaw"] == pytest.approx(told["acceleration"]["rmse"]["yaw"], rel=1e-8)


def test_any_horizon_may_have_a_limit_and_accelerations_none() -> None:
    Path("short.yaml").write_text("predictions: {1: {yaw: 5}, 15: {position: 50}}\n", "utf-8")
    assert "holds all 2 limits" in done("ci", "log.csv", "-v", "boat.yaml", "-l", "short.yaml")
    Path("one.yaml").write_text("acceleration: {surge: 5}\n", "utf-8")
    assert "holds its limit" in done("ci", "log.csv", "-v", "boat.yaml", "-l", "one.yaml")


def test_a_vehicle_that_drives_itself_breaks_the_laws() -> None:
    content = load_vehicle("boat.yaml").to_dict()
    undertow.Vehicle.model_validate(content | {"damping": {**content["damping"], "N_r": 3.0}, "insist": ["N_r"]}).save(
        "driven.yaml"
    )
    Path("laws.yaml").write_text("laws: pass\n", "utf-8")
    result = call("ci", "log.csv", "-v", "driven.yaml", "-l", "laws.yaml")
    assert result.exit_code == 1
    assert "the laws of a hull" in " ".join(result.stdout.split())


def test_another_model_may_stand_in_the_vehicles_place() -> None:
    result = call("ci", "log.csv", "-v", "boat.yaml", "--model", "changed.yaml", "-l", "limits.yaml", "--json")
    assert (result.exit_code, strict(result.stdout)["model"]) == (1, "changed")


def test_limits_are_written_with_a_margin_and_over_nothing_of_the_users() -> None:
    words = ("ci", "log.csv", "-v", "boat.yaml", "--write-limits")
    done(*words, "tight.yaml", "--margin", "0")
    assert undertow.load_limits("tight.yaml").predictions[10.0].position
    assert call("ci", "log.csv", "-v", "boat.yaml", "-l", "tight.yaml").exit_code == 0
    assert "replaced the earlier tight.yaml" in call(*words, "tight.yaml").stderr
    Path("tight.yaml").write_text(Path("tight.yaml").read_text("utf-8").replace("pass", "pass "), "utf-8")
    refused(*words, "tight.yaml", match="tight.yaml is there, and 'undertow ci --write-limits' did not write it, or it")
    refused(*words, "boat.yaml", "--force", match="is read by this call")
    refused(*words, "none/limits.yaml", match="the folder none does not exist")


@pytest.mark.parametrize(
    ("words", "match"),
    [
        ("log.csv -v boat.yaml", "expected either --limits FILE to judge by, or --write-limits FILE"),
        ("log.csv -v boat.yaml -l limits.yaml --write-limits new.yaml", "expected either --limits"),
        ("log.csv -v boat.yaml -l limits.yaml --margin 0.1", "--margin belongs to --write-limits"),
        ("log.csv -v boat.yaml --write-limits new.yaml --margin -1", "margin: expected a share of 0 or more"),
        ("log.csv -v boat.yaml --write-limits new.yaml --json", "judges nothing that --json could print"),
        ("log.csv -v boat.yaml -l none.yaml", "expected a limits file at none.yaml, but there is none"),
        ("log.csv -v boat.yaml -l bad.yaml", "unknown key 'positon' in predictions.10: did you mean 'position'"),
        ("log.csv -v boat.yaml -l long.yaml", "no stretch of the logs is longer than 300 s"),
        ("log.csv -v otter -l limits.yaml", "log.csv.*(command|channel)"),
        ("log.csv -v boat.yaml --model otter -l limits.yaml", "model otter: expected the commands of the nominal"),
        ("none.csv -v boat.yaml -l limits.yaml", "none.csv"),
    ],
)
def test_wrong_use_is_told(words: str, match: str) -> None:
    Path("bad.yaml").write_text("predictions: {10: {positon: 1}}\n", "utf-8")
    Path("long.yaml").write_text("predictions: {300: {yaw: 1}}\n", "utf-8")
    refused("ci", *words.split(), match=match)


def test_the_example_for_a_repository_runs() -> None:
    """The command of the workflow is one that the command line takes, and the limits beside it are held."""
    workflow = parse_yaml((ROOT / "examples" / "ci" / "undertow.yml").read_text("utf-8"))
    (command,) = [s["run"] for s in workflow["jobs"]["boat"]["steps"] if "undertow ci" in s.get("run", "")]
    limits = (ROOT / "examples" / "ci" / "limits.yaml").read_text("utf-8").partition("\n")[2]
    assert limits in (ROOT / "docs" / "continuous_integration.md").read_text("utf-8")
    there = {"boat/log.csv.gz": "data/gazebo_blueboat.csv.gz", "boat/vehicle.yaml": "data/demo.yaml"}
    there["boat/limits.yaml"] = "examples/ci/limits.yaml"
    words = [str(ROOT / there[word]) if word in there else word for word in shlex.split(command)[1:]]
    assert "holds all 8 limits" in done(*words)
