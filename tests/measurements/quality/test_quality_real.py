"""Quality of real logs: what the notes beside them say is wrong, the checks must find by themselves."""

import re
from pathlib import Path
from typing import Any

import pytest
from places import ROOT, shared
from verbs import inspected, refused, strict

from undertow.measurements.channels.channel_map import map_text
from undertow.measurements.kinematics import compass_shown
from undertow.measurements.log_options import Reading
from undertow.workflows.first_vehicle import Hull
from undertow.workflows.inputs import read_inputs
from undertow.workflows.inspect_and_init import init

MAPS = ROOT / "examples" / "maps"


@pytest.fixture(scope="module")
def pooled() -> dict[str, Any]:
    raw = shared("blueboat") / "raw"
    return strict(inspected("inspect", raw, "--json"))


def found(content: dict[str, Any], check: str, channel: str = "") -> dict[str, Any]:
    (finding,) = [f for f in content["quality"] if f["check"] == check and (not channel or channel in f["channels"])]
    return finding


def one(pooled: dict[str, Any], number: int) -> dict[str, Any]:
    (log,) = [log for log in pooled["logs"] if log["path"].endswith(f"rcou_{number}.csv")]
    return log


def test_the_sides_and_the_reversed_output_of_the_field_logs(pooled: dict[str, Any]):
    sides = found(pooled, "sides")
    assert sides["verdict"] == "defect"
    assert sides["parts"] == {"pwm_port": "starboard", "pwm_stbd": "port"}
    assert "RCOU.C3 (read as pwm_stbd) is on the port side" in sides["sentence"]
    assert "'pwm_port: RCOU.C3'" in sides["remedy"]
    assert "'pwm_stbd: {from: RCOU.C1, scale: -1, offset: 3020}'" in sides["remedy"]
    assert "ENU" not in sides["remedy"]  # latitude and longitude fix the axes
    direction = found(pooled, "direction")
    assert (direction["verdict"], direction["channels"]) == ("defect", ["pwm_port"])
    assert direction["ci95"][1] < 0.0 < direction["parts"]["pwm_stbd"]
    assert "1100 us is the most ahead" in direction["sentence"]
    for log in pooled["logs"]:  # a log alone may not tell, but none tells the contrary
        assert found(log, "sides")["verdict"] in ("defect", "warning", "cannot tell")
        assert set(found(log, "direction")["channels"]) in ({"pwm_port"}, {"pwm_port", "pwm_stbd"})
        assert found(log, "direction")["verdict"] in ("defect", "warning", "cannot tell")


def test_what_init_makes_of_a_folder_accuses_no_log_in_it(tmp_path: Path):
    """The file of guesses errs by a hundred times the motion of short straight runs, in which both sides push alike."""
    raw = shared("blueboat") / "raw"
    draft = init(raw, Hull(mass=15.0), progress=None)
    (tmp_path / "channels.yaml").write_text(map_text(draft.entries), encoding="utf-8")
    logs = [raw / f"rcou_{number}.csv" for number in (218, 221, 222)]
    assert read_inputs(logs, draft.vehicle, Reading(channel_map=tmp_path / "channels.yaml"), progress=None).starts


def test_a_cleaned_log_with_one_reversed_output_is_told_alike_with_and_without_a_vehicle(tmp_path: Path):
    """Its starboard output is reversed, which the log alone shows as likely; no record of it stands still."""
    log = shared("blueboat") / "log_231.csv"
    vehicle = tmp_path / "vehicle.yaml"
    init(log, Hull(mass=15.0), progress=None).vehicle.save(vehicle)
    for options in ((), ("-v", vehicle)):
        told = strict(inspected("inspect", log, "--json", *options))
        direction = found(told, "direction")
        assert (direction["verdict"], direction["channels"]) == ("warning", ["pwm_stbd"])
        assert "likely reversed (99 % sure" in direction["sentence"]
        assert all(f["verdict"] == "ok" for f in told["quality"] if f["check"] == "drive")
    assert "likely reversed" in read_inputs(log, vehicle).warnings[0]


def test_the_neutral_of_the_field_logs(pooled: dict[str, Any]):
    neutral = found(pooled, "neutral")
    assert (neutral["verdict"], neutral["value"]) == ("warning", 1510.0)
    assert neutral["parts"] == {"pwm_port": 1510.0, "pwm_stbd": 1510.0, "lowest": 1100.0, "highest": 1900.0}


def test_the_late_fixes_of_the_field_logs(pooled: dict[str, Any]):
    held = found(pooled, "held fixes")
    assert (held["verdict"], held["value"]) == ("warning", pytest.approx(5.0, rel=1e-3))
    shares = {number: found(one(pooled, number), "late fixes") for number in (216, 223, 234, 235)}
    assert all(finding["verdict"] == "defect" for finding in shares.values())
    assert [shares[number]["value"] for number in shares] == pytest.approx([0.33, 0.37, 0.31, 0.085], abs=0.01)
    assert shares[235]["parts"]["late"] == pytest.approx(0.1, abs=1e-3)
    for number in (218, 220, 222, 224, 226, 231, 232, 233):
        assert found(one(pooled, number), "late fixes")["verdict"] == "ok"


def test_the_clocks_of_the_field_logs(pooled: dict[str, Any]):
    gyro, accelerometer, commands = (found(pooled, "clocks", name) for name in ("r", "ax", "pwm_port"))
    assert 0.05 < gyro["value"] < 0.11
    assert 0.05 < accelerometer["value"] < 0.3
    assert -0.15 < commands["value"] < -0.07
    assert [f["verdict"] for f in (gyro, accelerometer, commands)] == ["warning", "note", "warning"]
    each = [found(log, "clocks", "r") for log in pooled["logs"]]
    assert all(f["value"] > 0.0 for f in each if f["verdict"] == "warning")
    assert sum(f["verdict"] == "warning" for f in each) >= 5


def test_the_compass_of_the_field_logs(pooled: dict[str, Any]):
    compass = found(pooled, "compass")
    assert compass["verdict"] == "defect"
    assert [compass["parts"][name] for name in ("constant", "sin", "cos")] == pytest.approx([1.2, 2.2, 7.4], abs=1.0)


def test_gravity_in_the_accelerometer_of_the_field_logs(pooled: dict[str, Any]):
    assert 2.0 < found(pooled, "tilt")["value"] < 2.7


def test_the_screen_of_the_field_logs_begins_with_the_worst():
    raw = shared("blueboat") / "raw"
    screen = " ".join(inspected("inspect", raw).split())
    assert "14 logs together" in screen
    assert "port and starboard look swapped" in screen.split("Quality")[0]


def test_the_shipped_map_puts_the_sides_right():
    raw = shared("blueboat") / "raw"
    content = strict(inspected("inspect", raw, "--map", MAPS / "blueboat_raw.yaml", "--json"))
    assert found(content, "sides")["verdict"] == "ok"
    assert found(content, "direction")["verdict"] == "ok"
    assert found(content, "neutral")["value"] == 1510.0


def test_a_repaired_field_log_has_none_of_its_safe_defects(tmp_path: Path):
    raw = shared("blueboat") / "raw"
    out = tmp_path / "235.csv"
    inspected("inspect", raw / "rcou_235.csv", "--map", MAPS / "blueboat_raw.yaml", "--fix", out)
    content = strict(inspected("inspect", out, "--json"))
    left = {f["check"] for f in content["quality"] if f["verdict"] in ("warning", "defect")}
    assert left == {"compass", "tilt", "neutral"}  # it is told, and not moved
    assert found(content, "compass")["parts"]["cos"] == pytest.approx(7.4, abs=1.5)
    assert content["excitation"]["u"][1] < 4.0  # 6.1 m/s by the late fixes of the raw log


@pytest.mark.parametrize(("name", "seconds"), [("esso", 5000.0), ("kvlcc2", 1400.0)])
def test_tankers_are_read_and_told_to_be_out_of_reach(name: str, seconds: float):
    content = strict(inspected("inspect", shared(name), "--map", MAPS / f"{name}.yaml", "--json"))
    assert sum(log["excitation"]["seconds"] for log in content["logs"]) > seconds
    assert found(content, "commands")["sentence"].startswith("the log has a rudder or its like (rudder_angle)")
    assert all(f["verdict"] != "defect" for f in content["quality"])


def test_a_basin_file_with_title_lines_is_refused_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    path = shared("odd_formats") / "rounded_timestamps.dat.gz"
    refused("inspect", path, match=r"rounded_timestamps\.dat\.gz: got the header 'MARIN.*; expected")


def test_no_gazebo_log_is_accused():
    content = strict(inspected("inspect", shared("gazebo"), "--json"))
    for log in content["logs"]:
        assert [f["sentence"] for f in log["quality"] if f["verdict"] in ("warning", "defect")] == []


@pytest.mark.parametrize("number", [223, 235])
def test_inspection_and_discovery_say_the_same_of_the_compass(number: int):
    log = shared("blueboat") / f"log_{number}.csv"
    told = found(strict(inspected("inspect", log, "--json")), "compass")["sentence"]
    boat = init(log, Hull(mass=15.0), progress=None).vehicle
    motions = read_inputs(log, boat, Reading(as_is=True), progress=None).whole().fitting
    told = re.sub(r"\d+ %", "# %", told)  # of the motion as it is, and of what is slow in it
    said = re.sub(r"\d+ %", "# %", compass_shown(motions).sentence)
    shape = re.compile(r"[-+]?\d+\.\d+")
    assert shape.sub("#", said) == shape.sub("#", told)
    numbers = [[float(x) for x in shape.findall(text)] for text in (said, told)]
    assert numbers[0] == pytest.approx(numbers[1], abs=0.5)
