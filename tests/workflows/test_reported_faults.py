"""Inputs of people that were read wrongly, refused or accused though sound: each does what its report asks."""

import gzip
import re
import shutil
from pathlib import Path

import pytest
from places import shared
from verbs import call, inspected

from undertow.measurements.log import read_log
from undertow.physics.errors import LogError
from undertow.physics.vehicle import load_vehicle
from undertow.workflows.inputs import read_inputs

BOAT = ("--vehicle", "blueboat")
SOUND = "Usable; no defect was found"


@pytest.fixture
def fault(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A copy of a folder of faults, its tables unpacked as their reports name them."""
    (source,) = shared("faults").glob(f"{request.param}_*")
    folder = tmp_path / source.name
    shutil.copytree(source, folder, copy_function=shutil.copyfile)
    for path in folder.rglob("*.gz"):
        path.with_suffix("").write_bytes(gzip.decompress(path.read_bytes()))
        path.unlink()
    return folder


def plain(text: str) -> str:
    """A screen as one line."""
    return re.sub(r"\s+", " ", text)


@pytest.mark.parametrize("fault", ["01"], indirect=True)
@pytest.mark.parametrize("name", ["log", "log2"])
def test_throttle_and_steering_named_as_sides(fault: Path, name: str, tmp_path: Path):
    lines = tmp_path / "map.yaml"
    told = plain(inspected("inspect", fault / f"{name}.csv", *BOAT, "--map-out", lines))
    assert "newton_port and newton_stbd look like throttle and steering" in told
    refused = call("discover", fault / f"{name}.csv", *BOAT, "--refit", "--out", tmp_path / "run")
    assert refused.exit_code == 2
    assert "look like throttle and steering" in plain(refused.stderr)
    mixed = plain(inspected("inspect", fault / f"{name}.csv", *BOAT, "--map", lines))
    assert "look like" not in mixed
    assert "mix: skid" in mixed


@pytest.mark.parametrize("fault", ["01"], indirect=True)
def test_refit_beside_two_thrusters_ends_with_findings(fault: Path, tmp_path: Path):
    result = call("discover", fault / "log.csv", *BOAT, "--refit", "--as-is", "--out", tmp_path / "run")
    assert result.exit_code in (0, 1), result.output
    assert (tmp_path / "run" / "findings.json").exists()


@pytest.mark.parametrize("fault", ["04"], indirect=True)
@pytest.mark.parametrize(
    ("name", "jumps", "stretches"),
    [
        ("jump60", ["59.9 m at t = 99.95 s, in 0.05 s (1198 m/s)"], 2),
        ("jump6_and_9", ["5.89 m at t = 99.95 s", "8.94 m at t = 159.95 s"], 3),
        ("origin_reset", ["13.7 m at t = 119.95 s"], 2),
        ("jump_uvr", ["5.89 m at t = 99.95 s", "8.94 m at t = 159.95 s"], 3),
        ("out_and_back", ["29.9 m at t = 99.95 s, in 0.05 s (597.7 m/s), and back after 3.05 s"], 2),
    ],
)
def test_a_jump_is_named_and_cuts_the_log(fault: Path, name: str, jumps: list[str], stretches: int, tmp_path: Path):
    fixed = tmp_path / "fixed.csv"
    told = plain(inspected("inspect", fault / f"{name}.csv", *BOAT, "--fix", fixed))
    assert all(jump in told for jump in jumps)
    assert f"Take {stretches} stretches without gaps" in told
    assert "as if its thruster worked" not in told
    again = plain(inspected("inspect", fixed, *BOAT))
    assert "positions jump" not in again
    assert f"Take {stretches} stretches without gaps" in again
    read_inputs(fault / f"{name}.csv", load_vehicle("blueboat"), progress=None)


@pytest.mark.parametrize("fault", ["06"], indirect=True)
@pytest.mark.parametrize(("name", "topic"), [("aruco", "/aruco/pose"), ("buoy", "/buoy/pose")])
def test_a_pose_of_something_else_is_not_the_boats(fault: Path, name: str, topic: str):
    channels = read_log(fault / name).channels
    assert {"x", "y", "psi", "r"} <= set(channels)
    assert not any(topic in channel.origin or "/target" in channel.origin for channel in channels.values())
    assert f"{topic} not taken" in plain(inspected("inspect", fault / name, *BOAT))


@pytest.mark.parametrize("fault", ["07"], indirect=True)
def test_screws_that_turn_alike_beside_rudders_are_not_of_another_run(fault: Path):
    told = plain(inspected("inspect", fault / "log.csv", "--map", fault / "map.yaml"))
    assert "another run" not in told
    assert "Usable" in told


@pytest.mark.parametrize("fault", ["09"], indirect=True)
def test_directions_to_satellites_are_no_rudders(fault: Path):
    told = plain(inspected("inspect", fault / "log.csv", *BOAT))
    assert SOUND in told
    assert "has a rudder" not in told


@pytest.mark.parametrize("fault", ["11"], indirect=True)
def test_times_by_their_usual_names(fault: Path):
    for name in ("pj_time", "rostopic_pctime", "time_s_paren", "timestamp_s"):
        assert SOUND in plain(inspected("inspect", fault / f"{name}.csv", *BOAT)), name
    assert SOUND in plain(inspected("inspect", fault / "timestamp_s.csv", *BOAT, "--map", fault / "time.yaml"))
    fixed, lines = fault / "fixed.csv", fault / "seconds.yaml"
    told = plain(inspected("inspect", fault / "time_in_ms.csv", *BOAT, "--fix", fixed, "--map-out", lines))
    assert "The stamps are in ms" in told
    assert SOUND in plain(inspected("inspect", fixed, *BOAT))
    assert SOUND in plain(inspected("inspect", fault / "time_in_ms.csv", *BOAT, "--map", lines))


@pytest.mark.parametrize("fault", ["12"], indirect=True)
@pytest.mark.parametrize("name", ["date_time", "iso", "iso_tz", "semicolon_decimalcomma"])
def test_instants_in_words_and_decimal_commas(fault: Path, name: str):
    assert SOUND in plain(inspected("inspect", fault / f"{name}.csv", *BOAT))


@pytest.mark.parametrize("fault", ["13"], indirect=True)
def test_a_comma_in_a_quoted_header(fault: Path):
    assert SOUND in plain(inspected("inspect", fault / "log.csv", *BOAT, "--map", fault / "map.yaml"))


@pytest.mark.parametrize("fault", ["14"], indirect=True)
def test_a_pointer_of_git_lfs_and_utf_16(fault: Path):
    for ending in ("csv", "bag", "mcap", "db3"):
        path = fault / f"ahrs.{ending}"
        if not path.exists():
            shutil.copy(fault / "ahrs.csv", path)
        with pytest.raises(LogError, match=r"Git LFS pointer.*Run 'git lfs pull'"):
            read_log(path)
    assert {"psi", "newton_port"} <= set(read_log(fault / "utf16.csv").channels)


@pytest.mark.parametrize("fault", ["16"], indirect=True)
def test_a_matrix_without_names_is_told_and_named_by_a_map(fault: Path):
    for name in ("data.mat", "headerless.csv"):
        with pytest.raises(LogError, match="columns without names .* name the columns in a channel map") as refused:
            read_log(fault / name)
        assert refused.value.mends.startswith("time: ")
    assert {"x", "y", "psi"} <= set(read_log(fault / "blanks.txt").channels)


@pytest.mark.parametrize("fault", ["17"], indirect=True)
def test_the_right_effect_is_named(fault: Path, tmp_path: Path):
    run = tmp_path / "run"
    result = call("discover", fault / "log.csv", "--vehicle", fault / "vehicle.yaml", "--out", run)
    assert result.exit_code in (0, 1), result.output
    said = re.search(r"The file's X_u \(about -(\d+), not -100\) is off", plain(result.stdout))
    assert said is not None
    assert float(said[1]) == pytest.approx(151.57, rel=0.03)
    assert (run / "model.yaml").exists()


@pytest.mark.parametrize("fault", ["18"], indirect=True)
def test_a_copter_is_no_boat(fault: Path):
    refused = call("init", fault / "copter.log", "--mass", "1.5", "--length", "0.5", "--out", fault / "boat.yaml")
    assert refused.exit_code == 2
    assert "the log is of a copter, which is no surface vessel (MSG: ArduCopter" in plain(refused.stderr)
    assert not (fault / "boat.yaml").exists()
    assert "it is the log of a copter" in plain(inspected("inspect", fault / "copter.log"))


@pytest.mark.parametrize("fault", ["19", "20", "21"], indirect=True)
def test_a_sound_log_goes_on_and_names_nothing(fault: Path, tmp_path: Path):
    result = call("discover", fault / "log.csv", "--vehicle", fault / "vehicle.yaml", "--out", tmp_path / "run")
    assert result.exit_code in (0, 1), result.output
    assert "nothing missing" in (tmp_path / "run" / "findings.json").read_text()
