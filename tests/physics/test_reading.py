"""YAML, JSON and text that others wrote: whatever they hold, they are read within bounds or refused in one line."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from verbs import call

from undertow.measurements.channels.channel_map import read_channel_map
from undertow.physics.errors import MOST_SHOWN, LogError, RequestError, VehicleError
from undertow.physics.reading import parse_json, parse_yaml, read_text
from undertow.physics.vehicle import load_vehicle, vehicle_from_dict
from undertow.residuals.models.neural import is_network_folder

LAUGHS = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{b}: &{b} [{','.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
SOUND = load_vehicle("blueboat").to_dict()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("mass: " + "[" * 200_000, "line 1: lists in lists, more than 64 deep"),
        ("mass: " + "[" * 1500 + "]" * 1500, "more than 64 deep"),
        ("? " * 500 + "a", "more than 64 deep"),
        (LAUGHS, "more than 500000 values"),
        ("sources: &a {x: *a}", "the alias .'a' stands for nothing, or for itself"),
        ("mass: !!int ''", "line 1: '' is not a whole number"),
        ("x: 1\nmass: !!float x", "line 2: 'x' is not a number"),
        ("mass: " + "1" * 5000, "1111 is not|characters left out.* is not a whole number"),
        ("a: !!bool maybe", "'maybe' is not true or false"),
        ("a: !!binary aGk=", "the tag '.*binary' is not read here"),
        ("a: !!set {x}", "the tag '.*set' is not read here"),
        ("a: !!map [1]", "the tag '.*map' is not read here"),
        ("a: 1\nb: 2\na: 3", "key 'a' stands twice in one mapping, line 1"),
        ("--- 1\n--- 2", "single document"),
        ("a: [", "line 1|line 2"),
        ("? [1]\n: 2", "unhashable"),
        ("a: \x1b[31m", "control characters are not allowed|unacceptable character"),
    ],
)
def test_hostile_yaml_is_refused_in_a_line(text, why):
    with pytest.raises(ValueError, match=why) as told:
        parse_yaml(text)
    assert "\n" not in str(told.value)
    assert len(str(told.value)) < 500


@pytest.mark.parametrize("text", ["u: " + "[" * 200_000, LAUGHS, "u: !!int ''", "u: !!float x", "u: " + "9" * 5000])
def test_a_hostile_channel_map_is_refused_in_a_line(tmp_path, text):
    (tmp_path / "map.yaml").write_text(text)
    with pytest.raises(LogError, match="the channel map is not YAML") as told:
        read_channel_map(tmp_path / "map.yaml")
    assert len(str(told.value)) < 700


def test_aliases_that_repeat_little_are_read_and_dates_are_texts():
    assert parse_yaml("a: &c {k: 1}\nb: *c\nd: 2024-05-01") == {"a": {"k": 1}, "b": {"k": 1}, "d": "2024-05-01"}


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[" * 100_000, "more than 64 deep"),
        ('{"a":' * 70 + "1" + "}" * 70, "more than 64 deep"),
        ("[[],[]," * 400_000, "more than 1000000 lists"),
        ('{"a": 1e999}', "is too large"),
        ('{"a": NaN}', "NaN is not JSON"),
        ("[" + "1" * 400 + "]", "400 digits"),
        ('{"a": 1', "delimiter"),
    ],
)
def test_hostile_json_is_refused(text, why):
    with pytest.raises(ValueError, match=why):
        parse_json(text)


def test_messages_of_a_log_may_hold_what_files_may_not():
    assert parse_json(b'{"a": [NaN, 1e999]}', lenient=True)["a"][1] == float("inf")
    assert parse_json("[" * 64 + "]" * 64) is not None


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"mass: \xe9", "the byte 0xe9 in line 1"),
        ("mass: 1".encode("utf-16"), "got UTF-16"),
        (b"a: 1\nb: \0", "a zero byte in line 2"),
        (b"x" * 50, "expected at most 0 MB"),
    ],
)
def test_what_is_no_text_is_named(tmp_path, content, why):
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(ValueError, match=why):
        read_text(tmp_path / "file", 40)


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path):
    (tmp_path / "file").write_bytes(b"\xef\xbb\xbfa: 1")
    assert read_text(tmp_path / "file") == "a: 1"


@pytest.mark.parametrize("kind", ["pipe", "folder", "device"])
def test_a_pipe_a_folder_or_a_device_is_no_file(tmp_path, kind):
    path = tmp_path / "model.yaml"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/zero")
    with pytest.raises(VehicleError, match="this is a folder|got a pipe or a device"):
        load_vehicle(path)
    with pytest.raises(LogError, match="expected a file, got"):
        read_channel_map(path)
    assert not is_network_folder(tmp_path)


@pytest.mark.parametrize(
    ("value", "why"),
    [
        (True, "mass: expected a number, got True"),
        (1e-308, "mass: expected a number above 0"),
        (1e-300, "mass: expected at least 1e-12, got 1e-300"),
        (5e-324, "mass: expected a number above 0"),
        (1e308, r"mass: expected a finite number of at most 1e\+18, got 1e\+308"),
        (float("nan"), "mass: expected a finite number"),
        (10**400, "mass: expected a finite number .*very many digits"),
        ("2001-99-99", "mass: .*expected a number.*, got '2001-99-99'"),
        ([[[]]], r"mass: .*expected a number, got \[\[\[\]\]\]"),
        ("x" * 10**6, "mass: .*expected a number.*characters left out"),
    ],
)
def test_what_is_no_number_of_a_vehicle_is_refused(value, why):
    with pytest.raises(VehicleError, match=why) as told:
        vehicle_from_dict({**SOUND, "mass": value}, "boat.yaml")
    assert len(str(told.value)) < 400


@pytest.mark.parametrize("section", ["damping", "added_mass", "environment"])
def test_true_is_no_number_anywhere_in_a_vehicle(section):
    symbol = {"damping": "X_u", "added_mass": "X_udot", "environment": "current_north"}[section]
    with pytest.raises(VehicleError, match=f"{section}.{symbol}: expected a number, got False"):
        vehicle_from_dict({**SOUND, section: {symbol: False}}, "boat.yaml")
    thrusters = [{**thruster.model_dump(), "x": True} for thruster in load_vehicle("blueboat").thrusters]
    with pytest.raises(VehicleError, match=r"thruster 'port': x: expected a number, got True"):
        vehicle_from_dict({**SOUND, "thrusters": thrusters}, "boat.yaml")


def test_messages_are_bounded_whatever_they_tell_of(tmp_path):
    keys = {f"{'k' * 5000}{index}": index for index in range(300)}
    with pytest.raises(VehicleError, match="and 29. more of the kind") as told:
        vehicle_from_dict({**SOUND, **keys}, "boat.yaml")
    assert len(str(told.value)) <= MOST_SHOWN
    long = RequestError("head " + "x" * 10**6 + " tail")
    assert len(str(long)) <= MOST_SHOWN
    assert str(long).startswith("head xx")
    assert str(long).endswith("xx tail")
    result = call("inspect", "x" * 30_000)
    assert result.exit_code == 2
    assert len(result.stderr) <= MOST_SHOWN


def test_deep_findings_do_not_end_report(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("run").mkdir()
    Path("run/findings.json").write_text("[" * 100_000)
    result = call("report", "run")
    assert result.exit_code == 2
    assert "more than 64 deep" in result.stderr


def test_a_deep_vehicle_does_not_end_the_process(tmp_path):
    path = tmp_path / "boat.yaml"
    path.write_text("mass: " + "[" * 200_000)
    told = subprocess.run(
        [sys.executable, "-c", f"from undertow.physics.vehicle import load_vehicle; load_vehicle({str(path)!r})"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 1  # and not -11
    assert "VehicleError" in told.stderr


def test_json_holds_every_letter_and_no_control_character():
    from undertow.physics.files import strict_json

    text = strict_json({"name": "Ü \x1b\x9b\u202e\udcff m/s²"})
    assert text.isascii() is False
    assert not re.search("[\x1b\x9b\u202e\udcff]", text)
    assert json.loads(text) == {"name": "Ü \x1b\x9b\u202e\udcff m/s²"}
