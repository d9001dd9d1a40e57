"""Missions: each file, read by what stands for its reader, commands the boat as the manoeuvre was rehearsed."""

import csv
import math
import re
import signal
import sys
import time
from dataclasses import replace
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fake_rover import AUTO, HOLD, MANUAL, FakeRover

from undertow.exports.missions import MISSION_FORMATS, Mission, Place
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.manoeuvres import REST, Step, Trial, drive
from undertow.physics.worlds.world import NOISE, Orders, World

STEPS: tuple[Step, ...] = ((4.0, 0.6, -0.25), (2.5, 0.0, 0.0), (3.0, -0.4, 0.3), (1.5, 0.0, 1.0))
VEHICLES = ("blueboat", "blueboat_paper", "otter", "cybership2")
FORMS = {form.name: form for form in MISSION_FORMATS}


def mission(vehicle: str | Vehicle = "blueboat_paper", place: Place | None = None) -> Mission:
    own = load_vehicle(vehicle) if isinstance(vehicle, str) else vehicle
    return Mission(own, STEPS, fence=30.0, speed=2.0, about=("A test.", ""), place=place)


def test_there_are_four_files():
    assert set(FORMS) == {"mission.csv", "mission.lua", "mission.waypoints", "mission_node.py"}


@pytest.mark.parametrize("name", VEHICLES)
def test_every_vehicle_gets_every_file(name: str):
    for form in MISSION_FORMATS:
        assert form.content(mission(name, Place(54.0, 10.0, 30.0)))


def test_pulses_stay_within_the_curve_and_begin_and_end_at_rest():
    made = mission("blueboat")
    _, commands = made.series()
    for k, thruster in enumerate(made.thrusters):
        assert commands[:, k].min() >= min(thruster.curve.command)  # type: ignore[union-attr]
        assert commands[:, k].max() <= max(thruster.curve.command)  # type: ignore[union-attr]
    still = round(REST / 0.1)
    assert (commands[:still] == made.rest).all()
    assert (commands[-still:] == made.rest).all()
    assert len(commands) * 0.1 == pytest.approx(made.seconds)


def test_pulses_that_a_map_turns_round_are_sent_as_the_boat_takes_them():
    plain = mission("blueboat_paper")
    name = plain.thrusters[1].channel
    turned = replace(plain, read_as={name: (-1.0, 3020.0)})
    tables = [FORMS["mission.csv"].content(one).splitlines()[1:] for one in (plain, turned)]
    rows, other = (np.loadtxt(table, delimiter=",") for table in tables)
    assert np.ptp(rows[:, 2]) > 50.0
    np.testing.assert_allclose(other, np.column_stack([rows[:, :2], 3020.0 - rows[:, 2]]))
    held = re.findall(r"commands = \{ (\S+), (\S+) \}", FORMS["mission.lua"].content(turned))
    sent = [(float(a), 3020.0 - float(b)) for a, b in held]
    np.testing.assert_allclose(sent, [row for _, row in plain.held])


@pytest.mark.parametrize("name", VEHICLES)
def test_the_table_drives_a_simulated_boat_as_the_rehearsal_did(name: str):
    vehicle = load_vehicle(name)
    rows = list(csv.reader(FORMS["mission.csv"].content(mission(name)).splitlines()))
    assert rows[0] == ["time", *(t.channel for t in vehicle.thrusters)]
    table = np.array(rows[1:], dtype=float)
    np.testing.assert_allclose(np.diff(table[:, 0]), 0.1)
    orders = Orders(table[:, 1:], heading=0.4)
    seconds = 0.1 * (len(table) - 1)
    truth = World(vehicle, duration=seconds, orders=orders).run(NOISE["clean"]).motion(0.05)
    (run,) = drive(vehicle, [Trial("test", "test", STEPS)], heading=0.4)[0]
    driven = truth.velocity[round(REST / 0.05) :: 2][: run.time.size]
    # A rehearsal is linear between its rows, so a command switches half a row before the one that has it.
    half_row = 0.05 * np.abs(np.diff(run.velocity, axis=0)).max(axis=0) / 0.1
    assert (np.abs(driven - run.velocity) < 1.2 * half_row + 0.01 * np.abs(run.velocity).max()).all()
    assert np.abs(run.velocity).max() > 0.1


def test_the_waypoints_lead_along_the_heading_to_the_start_and_back():
    place = Place(54.3233, 10.1394, 120.0)
    lines = FORMS["mission.waypoints"].content(mission(place=place)).splitlines()
    assert lines[0] == "QGC WPL 110"
    items = [line.split("\t") for line in lines[1:]]
    assert all(len(item) == 12 for item in items)
    assert [int(item[0]) for item in items] == list(range(len(items)))
    assert [int(item[3]) for item in items] == [16, 16, 16, 42702, 16]
    home, before, start, script, back = ([float(cell) for cell in item[4:10]] for item in items)
    assert home[4:] == start[4:] == back[4:] == pytest.approx([54.3233, 10.1394])
    north = (start[4] - before[4]) * 111_319.5
    east = (start[5] - before[5]) * 111_319.5 * math.cos(math.radians(54.3233))
    assert math.hypot(north, east) == pytest.approx(20.0, abs=0.01)
    assert math.degrees(math.atan2(east, north)) == pytest.approx(120.0, abs=0.01)
    assert script[0] == 71.0
    assert script[1] > mission().seconds


def test_waypoints_need_a_place():
    with pytest.raises(RequestError, match="--at LAT,LON"):
        FORMS["mission.waypoints"].content(mission())


def script(name: str | Vehicle = "blueboat_paper") -> str:
    return FORMS["mission.lua"].content(mission(name))


def test_the_script_sends_each_command_in_its_time_and_hands_back():
    rover, made = FakeRover(), mission()
    update = rover.load(script())
    rover.run(update, made.seconds + 1.0)
    for begin, row in made.held[:-1]:
        assert rover.at_time(begin + 0.3) == {0: row[0], 2: row[1]}
    assert rover.finished == [5]
    assert rover.in_mode == AUTO
    last = max(when for when, _, _ in rover.sent)
    assert last == pytest.approx(made.seconds, abs=0.15)
    assert rover.at_time(last) == {0: made.rest[0], 2: made.rest[1]}
    assert rover.told == ["undertow: driving for 21 s", "undertow: done"]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"at": 31.0}, "30 m from the start"),
        ({"speed": 2.1}, "faster than 2.0 m/s"),
        ({"is_armed": False}, "disarmed"),
        ({"position": 2}, "the switch breaks it off"),
    ],
)
def test_the_script_ends_in_hold_with_thrusters_at_rest(change: dict[str, Any], why: str):
    rover, made = FakeRover(), mission()

    def disturb(time: float) -> None:
        if time >= 7.0:
            for name, value in change.items():
                setattr(rover, name, value)

    rover.run(rover.load(script()), 10.0, disturb)
    assert rover.in_mode == HOLD
    assert rover.told[-1] == f"undertow: broken off, {why}"
    assert max(when for when, _, _ in rover.sent) == pytest.approx(7.0, abs=0.06)
    assert rover.at_time(20.0) == {0: made.rest[0], 2: made.rest[1]}
    assert not rover.finished


def test_a_mission_without_a_limit_of_speed_has_none_in_its_script():
    rover = FakeRover(speed=9.0)
    rover.run(rover.load(FORMS["mission.lua"].content(Mission(load_vehicle("blueboat"), STEPS, fence=30.0))), 7.0)
    assert rover.told == ["undertow: driving for 21 s"]


@pytest.mark.parametrize("locating", ["get_location", "get_position"])
def test_the_fence_stays_where_it_first_began(locating: str):
    rover = FakeRover(locating=locating)
    update = rover.load(script())

    def again(time: float) -> None:
        rover.at = min(time, 12.0)
        if time in (12.0, 13.0):
            rover.in_mode = HOLD if time == 12.0 else AUTO

    rover.run(update, 14.0, again)
    assert rover.in_mode == HOLD
    assert rover.told[-1] == "undertow: broken off, 12 m from the first start"
    rover.in_mode, rover.at = AUTO, 4.0
    rover.run(update, 1.0)
    assert rover.told[-1] == "undertow: driving for 21 s"
    rover.at = 31.0
    rover.run(update, 0.1)
    assert rover.told[-1] == "undertow: broken off, 30 m from the start"


def test_a_thruster_that_rests_throughout_is_held_at_rest_and_one_that_pushes_sideways_is_left():
    one_sided = Mission(load_vehicle("blueboat"), ((10.0, 0.5, -0.5), (8.0, -0.3, 0.3)), fence=30.0)
    rover = FakeRover()
    rover.run(rover.load(FORMS["mission.lua"].content(one_sided)), 8.0)
    port, starboard = rover.at_time(7.0)[0], rover.at_time(7.0)[2]
    assert port == 1500 < starboard
    assert script("cybership2").count("{ func =") == 2


def test_who_changes_the_mode_has_the_boat_at_once():
    rover = FakeRover()

    def take_over(time: float) -> None:
        if time >= 7.0:
            rover.in_mode = MANUAL

    rover.run(rover.load(script()), 10.0, take_over)
    assert rover.in_mode == MANUAL
    assert max(when for when, _, _ in rover.sent) < 7.0


def test_the_script_does_nothing_without_its_step_or_its_outputs():
    idle = FakeRover(item=None)
    idle.run(idle.load(script()), 3.0)
    assert not idle.sent
    assert not idle.told
    bare = FakeRover(parameters={})
    bare.run(bare.load(script()), 3.0)
    assert not bare.sent
    assert bare.in_mode == HOLD
    assert "no output has SERVOn_FUNCTION 73" in bare.told[0]


def test_commands_that_are_no_pulses_become_shares_of_the_output():
    rover, made = FakeRover(), mission("otter")
    rover.parameters |= {"SERVO1_MIN": 1100.0, "SERVO1_TRIM": 1500.0, "SERVO1_MAX": 1900.0}
    rover.parameters |= {"SERVO3_REVERSED": 1.0}
    rover.run(rover.load(script("otter")), 8.0)
    begin, row = made.held[1]
    port, starboard = made.shares(row)
    assert (port, starboard) == pytest.approx((0.35, 0.85), abs=0.01)
    assert rover.at_time(begin + 0.3) == {0: round(1500 + 400 * port), 2: round(1500 - 500 * starboard)}


def node_of(
    text: str, monkeypatch: pytest.MonkeyPatch, stop_at: float = math.inf, stop: int = signal.SIGINT
) -> list[tuple[float, str, float]]:
    """What the node publishes, run with a fake rclpy whose clock goes on by 50 ms a spin, and stopped by a signal."""
    sent: list[tuple[float, str, float]] = []
    clock = {"now": 100.0}

    class Node:
        def __init__(self, name: str) -> None:
            assert name == "undertow_mission"

        def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
            return SimpleNamespace(publish=lambda message: sent.append((clock["now"] - 100.0, topic, message.data)))

        def create_timer(self, period: float, tick: Any) -> None:
            self.timed = tick

        def get_clock(self) -> Any:
            return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=clock["now"] * 1e9))

        def get_logger(self) -> Any:
            return SimpleNamespace(info=lambda text: None)

        def destroy_node(self) -> None:
            pass

    def spin_once(node: Any, timeout_sec: float) -> None:
        if clock["now"] - 100.0 >= stop_at:
            signal.raise_signal(stop)
        node.timed()
        clock["now"] += timeout_sec

    modules = {name: ModuleType(name) for name in ("rclpy", "rclpy.node", "rclpy.signals", "std_msgs", "std_msgs.msg")}
    vars(modules["rclpy"]).update(init=lambda **how: None, ok=lambda: True, spin_once=spin_once, shutdown=lambda: None)
    vars(modules["rclpy.node"])["Node"] = Node
    vars(modules["rclpy.signals"])["SignalHandlerOptions"] = SimpleNamespace(NO=0)
    vars(modules["std_msgs.msg"])["Float64"] = SimpleNamespace
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(time, "sleep", lambda seconds: clock.update(now=clock["now"] + seconds))
    names: dict[str, Any] = {"__name__": "node"}
    exec(compile(text, "mission_node.py", "exec"), names)
    kept = {number: signal.getsignal(number) for number in names["ENDS"]}
    try:
        names["main"]()
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
    return sent


def test_the_node_publishes_each_command_and_ends_at_rest(monkeypatch: pytest.MonkeyPatch):
    made = mission("otter")
    sent = node_of(FORMS["mission_node.py"].content(made), monkeypatch)
    for begin, row in made.held[:-1]:
        now = {topic: value for time, topic, value in sent if time <= begin + 0.2}
        assert now == dict(zip(["rad_s_port", "rad_s_stbd"], row, strict=True))
    assert [value for _, _, value in sent[-2:]] == list(made.rest)
    assert sent[-1][0] == pytest.approx(made.seconds + 0.45, abs=0.11)


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_whatever_ends_the_node_it_sends_rest_for_half_a_second(monkeypatch: pytest.MonkeyPatch, stop: int):
    made = mission("otter")
    sent = node_of(FORMS["mission_node.py"].content(made), monkeypatch, 6.0, stop)
    last = 10 * len(made.rest)
    assert [value for _, _, value in sent[-last:]] == [*made.rest] * 10
    assert sent[-last - 1][2] != 0.0
    assert sent[-1][0] == pytest.approx(6.45, abs=0.11)
