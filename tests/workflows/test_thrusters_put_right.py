"""Thrusters put right by a person: a channel map that turns and swaps commands, and places in the vehicle."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from verbs import done

from undertow.measurements.channels.channel_map import Entry
from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.workflows.first_vehicle import check_wires, placed, rewired, wires_of, with_corrections, write_rewired
from undertow.workflows.workbench_facts import Place, Wire

OTTER = load_vehicle("otter")
HULL = load_vehicle("blueboat")


def entries(vehicle: Vehicle) -> dict[str, Entry]:
    return {t.channel: Entry(f"/out:{k}", 2.0, 5.0) for k, t in enumerate(vehicle.thrusters)} | {"u": Entry("/odom:u")}


@pytest.mark.parametrize("vehicle", [HULL, OTTER], ids=lambda vehicle: vehicle.name)
def test_a_command_that_is_turned_round_pushes_the_other_way(vehicle: Vehicle):
    first = vehicle.thrusters[0]
    turned = rewired(entries(vehicle), vehicle, [Wire(first.channel, first.channel, turned=True)])[first.channel]
    neutral = next(float(c) for c in (1500.0, 0.0) if abs(first.curve.thrust(np.array([c]), first.command)[0]) < 1e-9)
    recorded = (neutral + 0.1 * np.array([-1.0, 0.0, 1.0]) - 5.0) / 2.0
    assert turned is not None
    read = turned.scale * recorded + turned.offset
    np.testing.assert_allclose(read, neutral + 0.1 * np.array([1.0, 0.0, -1.0]))


def test_swapped_commands_keep_every_other_channel():
    one, other = (t.channel for t in HULL.thrusters)
    known = entries(HULL)
    assert rewired(known, HULL, [Wire(one, other), Wire(other, one)]) == {**known, one: known[other], other: known[one]}
    assert rewired(known, HULL, []) == known


def test_what_cannot_be_wired_is_refused():
    one, other = (t.channel for t in HULL.thrusters)
    with pytest.raises(RequestError, match=f"{other} drives two thrusters: expected one command for each"):
        check_wires(HULL, [Wire(one, other)])
    with pytest.raises(RequestError, match=f"no stream of the log is {other}: expected one of"):
        rewired({one: Entry("a")}, HULL, [])
    assert wires_of(HULL, ()) == (Wire(one, one), Wire(other, other))


@pytest.fixture
def logs(tmp_path: Path) -> tuple[Path, Path]:
    """Two short logs of one boat that record alike."""
    found = tmp_path / "one.csv", tmp_path / "two.csv"
    for seed, path in enumerate(found):
        done("simulate", "-v", "blueboat", "--duration", "40", "--seed", str(seed), "--out", str(path))
    return found


def renamed(path: Path, names: dict[str, str]) -> None:
    """Give streams of a log other topics."""
    table = pd.read_csv(path, comment="#")
    for field, topic in names.items():
        table.loc[table["field"] == field, "topic"] = topic
    table.to_csv(path, index=False)


def test_thrusters_of_several_logs_are_exchanged_whatever_else_each_calls_its_streams(logs: tuple[Path, Path]):
    one, other = (t.channel for t in HULL.thrusters)
    renamed(logs[1], {"r": "/another/gyro"})
    given = Reading(channel_map=logs[0].parent / "given.yaml")
    (logs[0].parent / "given.yaml").write_text(f"{one}: '{one}'\npsi: null\n")
    names, wires = [str(log.parent) + "/*.csv" for log in logs[:1]], (Wire(one, other, turned=True), Wire(other, one))
    mapped = write_rewired(logs[0].parent / "wired.yaml", names, given, HULL, wires)
    for log in logs:
        before, after = read_log(log), read_log(log, Reading(channel_map=mapped))
        np.testing.assert_array_equal(after.channels[one].value, -before.channels[other].value)
        np.testing.assert_array_equal(after.channels[other].value, before.channels[one].value)
        np.testing.assert_array_equal(after.channels["r"].value, before.channels["r"].value)
        assert "psi" not in after.channels  # as the map of the user has it


def test_thrusters_of_logs_that_record_them_in_two_ways_are_not_exchanged(logs: tuple[Path, Path]):
    one = HULL.thrusters[0].channel
    renamed(logs[1], {one: "/to_the_left"})
    told = rf"expected logs that record .* alike, got .* in one.csv and /to_the_left:{one} in two.csv; open them one by"
    with pytest.raises(RequestError, match=told):
        write_rewired(
            logs[0].parent / "w.yaml", [str(p) for p in logs], Reading(), HULL, (Wire(one, one, turned=True),)
        )


def test_a_thruster_is_moved_and_no_other():
    moved = placed(HULL, [Place(HULL.thrusters[0].name, -0.5, -0.2, 0.1)])
    first = moved.thrusters[0]
    assert (first.x, first.y, first.angle) == (-0.5, -0.2, 0.1)
    assert first.curve == HULL.thrusters[0].curve
    assert moved.thrusters[1] == HULL.thrusters[1]
    with pytest.raises(VehicleError, match="is on the other side"):
        with_corrections(HULL, {}, [Place("port", -0.5, 0.2, 0.0)])
    with pytest.raises(VehicleError, match="X_u"):
        with_corrections(HULL, {"X_u": 4.0}, [])
    assert with_corrections(HULL, {"mass": 24.0}, []).mass == 24.0
    with pytest.raises(RequestError, match="has no thruster 'bow': expected"):
        placed(HULL, [Place("bow", 0.0, 0.0, 0.0)])
