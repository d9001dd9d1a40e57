"""The verb `plan`: from a run to the files of a mission, and what it refuses."""

import json
from pathlib import Path

import pytest
from verbs import call, done

import undertow
from undertow.discovery.experiment import optimal_manoeuvre
from undertow.physics.vehicle import load_vehicle
from undertow.workflows.plan import _read_as, own_mission

PAIR = ("surge_quadratic_damping", "surge_linear_damping")
FILES = {"mission.csv", "mission.json", "mission.lua", "mission.waypoints", "mission_node.py"}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plan")
    log, run = folder / "calm.csv", folder / "run"
    hidden = ("--effect", "surge_quadratic_damping=-12", "--programme", "gentle", "--duration", "40")
    done("simulate", "--vehicle", "blueboat_paper", *hidden, "--out", log)
    done("discover", log, "--vehicle", "blueboat_paper", "--out", run, "--no-report")
    return run


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optimal_manoeuvre, "_GENERATIONS", 4)


def test_a_mission_is_written_told_and_replaced(run: Path, tmp_path: Path):
    out = tmp_path / "mission"
    asked = (
        "plan",
        run,
        *PAIR,
        "--thrust",
        "60",
        "--space",
        "20",
        "--at",
        "54.3233,10.1394",
        "--heading",
        "90",
        "--speed",
        "2.5",
    )
    told = " ".join(done(*asked, "--out", out).split())
    assert {path.name for path in out.iterdir()} == FILES
    record = json.loads((out / "mission.json").read_text())
    assert record["schema"] == "undertow.mission/1"
    assert record["effects"] == list(PAIR)
    assert record["heading"] == pytest.approx(90.0)
    assert record["best"]["seconds"] < record["fixed"]["seconds"]
    assert record["best"]["reach"] <= 18.0
    assert f"drive from rest: {record['best']['words']}." in told
    assert "To tell surge quadratic damping from surge linear damping" in told
    assert f"{record['minutes']:.1f} minutes on the water" in told
    assert "probability of" in told
    script = (out / "mission.lua").read_text()
    assert "local FENCE = 20 " in script
    assert "local SPEED = 2.5 " in script
    assert own_mission(out) == FILES
    (out / "note.txt").write_text("mine")
    again = json.loads(done(*asked, "--out", out, "--json"))
    assert again["best"] == record["best"]
    assert (out / "note.txt").read_text() == "mine"
    (out / "mission.csv").write_text("edited")
    refused = call(*asked, "--out", out)
    assert refused.exit_code == 2
    assert "mission.csv, which undertow did not write" in " ".join(refused.stderr.split())
    done(*asked, "--out", out, "--force")
    assert (out / "mission.csv").read_text().startswith("time,pwm_port,pwm_stbd\n")


def test_without_a_place_there_is_no_waypoint_file(run: Path, tmp_path: Path):
    told = done("plan", run, *PAIR, "--out", tmp_path / "mission")
    assert {path.name for path in (tmp_path / "mission").iterdir()} == FILES - {"mission.waypoints"}
    assert "--at LAT,LON" in told


def test_what_would_not_tell_is_not_written(run: Path, tmp_path: Path):
    told = " ".join(done("plan", run, *PAIR, "--space", "0.01", "--out", tmp_path / "mission").split())
    assert "Within the limits no manoeuvre that was tried would tell" in told
    assert "the limit of space (0.01 m)" in told
    assert "Nothing is written: it would not tell." in told
    assert not (tmp_path / "mission").exists()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("munk_momentum",), "did you mean 'munk_moment'"),
        (("--at", "Kiel"), "expected LAT,LON in degrees"),
        (("--thrust", "140"), "expected a thrust of 5 to 100 %, got 140 %"),
        (("--space", "-3"), "expected a limit of space above 0, got -3"),
        (("--seconds", "5"), "expected a time of 12 s or more, got 5 s"),
        (("--seconds", "inf"), "expected a time of 12 s or more, got inf s"),
        (("--heading", "nan"), "expected a heading in degrees from north, got nan"),
    ],
)
def test_what_cannot_be_is_refused(run: Path, words: tuple[str, ...], why: str):
    result = call("plan", run, *words)
    assert result.exit_code == 2
    assert why in " ".join(result.stderr.split())


def test_a_place_from_python_is_checked(run: Path):
    with pytest.raises(undertow.RequestError, match="expected a place as latitude and longitude in degrees"):
        undertow.plan(run, place=(float("nan"), 10.0), progress=None)


def test_a_folder_that_is_no_run_is_refused(tmp_path: Path):
    result = call("plan", tmp_path)
    assert result.exit_code == 2
    assert "is not a run folder" in " ".join(result.stderr.split())


@pytest.mark.parametrize(
    ("line", "sent"),
    [
        ("{from: pwm_1, scale: -1, offset: 3020}", {"pwm_port": (-1.0, 3020.0)}),
        ("{from: throttle_port, scale: 500, offset: 1500}", {}),
        ("{from: throttle_port, scale: 0, offset: 1500}", {}),
    ],
)
def test_a_share_that_became_a_pulse_is_not_sent_to_a_servo(
    line: str, sent: dict[str, tuple[float, float]], tmp_path: Path
):
    (tmp_path / "map.yaml").write_text(f"pwm_port: {line}\n")
    assert _read_as(tmp_path / "map.yaml", load_vehicle("blueboat_paper"))[0] == sent
