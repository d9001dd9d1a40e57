"""Bags on the command line: namespaces, channel maps, progress, and runs that remember how a log was read."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bags import recorded, write_mcap, write_ros2
from mcap.reader import make_reader
from verbs import done, inspected, nearly, refused, strict

from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.reports.terminal import progress as pace
from undertow.reports.terminal.progress import Progress
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.read import read_run_inputs

BOAT = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def world():
    return simulate_world(BOAT, {}, duration=60.0, noise="field", seed=4)


def test_the_verbs_read_a_bag_and_give_its_map_back(tmp_path, world, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_ros2(tmp_path / "bag", [*recorded(world, "/alpha"), *recorded(world, "/beta")], "mcap")
    refused("inspect", "bag", match=r"expected the log of one vehicle, got 2: /alpha, /beta\. Choose one with --namesp")
    shown = inspected("inspect", "bag", "--namespace", "alpha", "--map-out", "channels.yaml")
    assert "newton_port: {from: '/alpha/thrusters/port/thrust:data'}" in shown
    found = strict(inspected("inspect", "bag", "--namespace", "alpha", "--map", "channels.yaml", "--json"))
    assert found["map"]["x"] == {"from": "/alpha/odometry:pose.pose.position.x", "frame": "enu"}
    again, first = (
        read_log("bag", Reading(namespace="/alpha", channel_map="channels.yaml")),
        read_log("bag", Reading(namespace="alpha")),
    )
    assert again.entries == first.entries
    for name, channel in first.channels.items():
        np.testing.assert_array_equal(again.channels[name].value, channel.value)
        np.testing.assert_array_equal(again.channels[name].time, channel.time)


def test_a_run_remembers_the_namespace_and_add_reads_the_same(tmp_path, world, monkeypatch):
    monkeypatch.chdir(tmp_path)
    other = simulate_world(BOAT, {"surge_quadratic_damping": (-12.0,)}, duration=60.0, noise="field", seed=5)
    both = sorted([*recorded(world, "/alpha"), *recorded(other, "/beta")], key=lambda message: message.received)
    write_mcap(Path("log.mcap"), both)
    verb = ("discover", "log.mcap", "--vehicle", "blueboat", "--no-report", "--out", "run")
    refused(*verb, match="Choose one with --namespace /alpha")
    done(*verb, "--namespace", "beta")
    assert strict(Path("run/run.json").read_text())["namespace"] == "beta"
    assert read_run_inputs("run").reading.namespace == "beta"
    added = strict(done("add", "surge_quadratic_damping", "--run", "run", "--json"))
    alone = read_inputs("log.mcap", BOAT, Reading(namespace="beta"))
    again = strict(
        done("add", "surge_quadratic_damping", "log.mcap", "--vehicle", "blueboat", "--namespace", "beta", "--json")
    )
    assert nearly(added["steps"], again["steps"])
    read = read_log("log.mcap", alone.reading)
    np.testing.assert_array_equal(read.channels["u"].value, other.odometry[:, 3])
    refused("add", "munk_moment", "--run", "run", "--namespace", "alpha", match="leave out --namespace")


def test_the_series_of_a_bag_lies_over_the_bag(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # Stamps from 1970, with nanoseconds that no double holds.
    even = simulate_world(BOAT, {}, duration=60.0, noise="clean", seed=4)
    assert np.ptp(np.diff(even.odometry_time)) < 1e-9
    bag = [replace(m, header=(m.header or 0) + 123_456_789, received=m.received + 130_000_000) for m in recorded(even)]
    write_ros2(Path("bag"), bag)
    log = read_log("bag")
    stamps = {m.header for m in bag if m.topic == "/odometry"}
    assert {log.start_ns + round(1e9 * t) for t in log.channels["u"].time} == stamps
    done("compare", "bag", "-v", "blueboat", "--series", "a.mcap")
    with Path("a.mcap").open("rb") as file:
        found = [m.log_time for _, _, m in make_reader(file).iter_messages(topics=["/measured"])]
    assert len(found) > 500
    assert set(found) <= stamps


def test_a_run_of_an_earlier_version_has_no_namespace(tmp_path):
    (tmp_path / "log.csv").write_text("t,u\n")
    BOAT.save(tmp_path / "nominal.yaml")
    record = {"logs": [str(tmp_path / "log.csv")], "frame": None, "channel_map": None}
    (tmp_path / "run.json").write_text(json.dumps(record))
    assert read_run_inputs(tmp_path).reading.namespace is None
    (tmp_path / "run.json").write_text(json.dumps(record | {"namespace": 3}))
    with pytest.raises(ValueError, match="a text or null under 'frame', 'channel_map' and 'namespace'"):
        read_run_inputs(tmp_path)


def test_reading_a_large_log_is_told_in_lines_or_in_a_bar(monkeypatch, capsys):
    said = []
    monkeypatch.setattr(pace, "FIRST", 0.0)
    monkeypatch.setattr(pace, "SECONDS_A_LINE", 0.0)
    told = pace.megabytes(said.append)
    for done_bytes in (10, 60_000_000, 120_000_000):
        told(done_bytes, 120_000_000)
    told(10, 1000)
    begun = [line.partition(",")[0] for line in said]
    assert begun == ["reading: 0 of 120 MB", "reading: 60 of 120 MB", "reading: 0 of 0 MB"]
    assert said[1].endswith("about 0 s left")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    pace.megabytes(Progress())(60_000_000, 120_000_000)
    assert "reading: 60 of 120 MB" in capsys.readouterr().err
