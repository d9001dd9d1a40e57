"""A vehicle file from a log alone: thrusters as the boat has them, and every number with its source."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from dataflash_files import SERVOS, dataflash_of
from places import ROOT, shared
from round_trip import world

from undertow.measurements.channels.channel_map import map_text
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError, RequestError
from undertow.physics.thrusters import TableCurve
from undertow.physics.vehicle import load_vehicle, vehicle_from_dict
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.first_vehicle import Hull
from undertow.workflows.inputs import read_inputs
from undertow.workflows.inspect_and_init import Doubt, Draft, init

PULSES = {"kind": "table", "command": [1110.0, 1510.0, 1910.0], "force": [-35.0, 0.0, 35.0]}


@pytest.fixture(scope="module")
def boat():
    """A BlueBoat whose speed controllers rest at 1510 us."""
    content = load_vehicle("blueboat").to_dict()
    content["thrusters"] = [{**thruster, "command": "pwm", "curve": PULSES} for thruster in content["thrusters"]]
    return vehicle_from_dict(content, "boat")


@pytest.fixture(scope="module")
def path(boat, tmp_path_factory) -> Path:
    return resting_first(
        simulate_world(boat, {}, duration=120.0, seed=5).write(tmp_path_factory.mktemp("l") / "log.csv")
    )


def resting_first(path: Path) -> Path:
    """Lets the boat of a long table lie at rest for 15 s before its log begins."""
    table = pd.read_csv(path)
    first = table.groupby(["topic", "field"], sort=False).first().reset_index()
    rest = pd.concat([first.assign(time=time) for time in np.arange(0.0, 15.0, 0.1)])
    moving = rest.topic == "odometry"
    rest.loc[rest.field.isin(["u", "v", "r"]), "value"] = 0.0
    rest.loc[moving, "value"] += np.random.default_rng(1).normal(0.0, 0.005, int(moving.sum()))
    rest.loc[rest.topic == "command", "value"] = 1510.0
    pd.concat([rest, table.assign(time=table.time + 15.0)])[table.columns].to_csv(path, index=False)
    return path


def respelt(path: Path, to: Path, names: dict[str, str], turned: str = "") -> Path:
    """The log with its commands called otherwise, one of them turned round about 1510 us."""
    table = pd.read_csv(path)
    table.loc[table.field == turned, "value"] = 3020.0 - table.value[table.field == turned]
    table["field"] = table.field.replace(names)
    table.to_csv(to, index=False)
    return to


def named(draft: Draft) -> dict[str, tuple]:
    found = {t.channel: t for t in draft.thrusters}
    return {name: (t.side, t.turned, t.output.astern, t.output.neutral, t.output.ahead) for name, t in found.items()}


def test_the_boat_is_called_after_the_whole_name_of_its_log(path, tmp_path):
    other = tmp_path / "my.own.boat.csv"
    other.write_bytes(path.read_bytes())
    assert init(other, Hull(mass=30.5, length=1.2)).vehicle.name == "boat of my.own.boat"


def test_thrusters_are_as_the_log_shows_them(path):
    draft = init(path, Hull(mass=30.5, length=1.2))
    assert named(draft) == {
        "pwm_port": ("port", False, 1100.0, 1510.0, 1910.0),
        "pwm_stbd": ("starboard", False, 1100.0, 1510.0, 1910.0),
    }
    assert all(thruster.by_log for thruster in draft.thrusters)
    assert [(t.channel, np.sign(t.y)) for t in draft.vehicle.thrusters] == [("pwm_port", -1.0), ("pwm_stbd", 1.0)]
    assert draft.doubts == ()


def test_swapped_sides_and_a_reversed_output_are_mapped_and_the_map_reads_the_log_right(path, tmp_path):
    swap = {"pwm_port": "pwm_stbd", "pwm_stbd": "pwm_port"}
    log = respelt(path, tmp_path / "log.csv", swap, turned="pwm_stbd")
    draft = init(log, Hull(mass=30.5))
    assert named(draft)["pwm_stbd"] == ("starboard", True, 1120.0, 1510.0, 1920.0)
    assert named(draft)["pwm_port"][:2] == ("port", False)
    draft.write(tmp_path / "vehicle.yaml", tmp_path / "channels.yaml")
    read = read_inputs(log, tmp_path / "vehicle.yaml", Reading(channel_map=tmp_path / "channels.yaml"))
    right = read_inputs(path, draft.vehicle)
    for one, other in zip(read.fitting, right.fitting, strict=True):
        assert np.allclose(one.commands, other.commands, atol=1e-6)


def test_commands_without_sides_get_them_from_the_log(path, tmp_path):
    names = {"pwm_port": "pwm_motor2", "pwm_stbd": "pwm_motor1"}
    draft = init(respelt(path, tmp_path / "log.csv", names))
    assert {t.channel: t.read_as for t in draft.thrusters} == {"pwm_port": "pwm_motor2", "pwm_stbd": "pwm_motor1"}
    assert "pwm_port: {from: 'command:pwm_motor2'}" in map_text(draft.entries)
    assert draft.doubts == (Doubt.LENGTH, Doubt.MASS)


@pytest.mark.parametrize(("called", "names"), [("motor", ["motor1", "motor2"]), ("", ["thruster1", "thruster2"])])
def test_a_log_that_tells_no_side_says_so(called, names, boat, tmp_path):
    straight = simulate_world(boat, {}, duration=60.0, seed=5).write(tmp_path / "log.csv")
    table = pd.read_csv(straight)
    table.loc[table.field == "pwm_stbd", "value"] = table.value[table.field == "pwm_port"].to_numpy()
    table["field"] = table.field.replace({"pwm_port": f"pwm_{called}1", "pwm_stbd": f"pwm_{called}2"})
    table.to_csv(straight, index=False)
    draft = init(straight)
    assert [doubt for doubt in draft.doubts if doubt is not Doubt.ASTERN] == [
        Doubt.SIDES,
        Doubt.NEUTRAL,
        Doubt.LENGTH,
        Doubt.MASS,
    ]
    assert [t.name for t in draft.vehicle.thrusters] == names


def test_the_autopilots_parameters_are_believed_over_what_is_usual(tmp_path):
    servos = SERVOS | {"SERVO1_TRIM": 1520, "SERVO1_MIN": 1150, "SERVO1_MAX": 1850, "SERVO1_REVERSED": 1}
    servos |= {"MOT_THST_EXPO": 0.6, "MOT_THST_ASYM": 2.0, "MOT_THR_MIN": 10.0}
    path = tmp_path / "12.bin"
    path.write_bytes(bytes(dataflash_of(world(), servos=servos).content))
    draft = init(path, Hull(mass=22.0, spacing=0.5, thrust=40.0))
    assert named(draft)["pwm_stbd"] == ("starboard", False, 1190.0, 1520.0, 1890.0)
    thruster = {t.name: t for t in draft.vehicle.thrusters}["stbd"]
    assert thruster.y == 0.25
    thrust = thruster.curve.thrust(np.array([1190.0, 1520.0, 1520.0 + 37.0, 1520.0 + 0.55 * 370.0, 1890.0]), "pwm")
    half = 40.0 * (0.4 * 0.5 + 0.6 * 0.25)
    assert thrust == pytest.approx([-20.0, 0.0, 0.0, half, 40.0], abs=0.2)
    assert "SERVO1_TRIM 1520" in str(draft.vehicle.sources["thrusters"])
    assert "MOT_THST_EXPO 0.6" in str(draft.vehicle.sources["thrusters"])


def test_thrust_and_drag_are_such_that_the_boat_moves_as_in_the_log(boat, tmp_path):
    """The boat's own thrust is linear in the command; the square that is assumed meets it where the log is fastest."""
    bent = boat.to_dict()
    curve = {"kind": "table", "command": [1110.0, *np.linspace(1160, 1860, 15), 1910.0]}
    share = (np.array(curve["command"]) - 1510.0) / 400.0
    curve["force"] = (35.0 * share * np.abs(share)).tolist()
    bent["thrusters"] = [{**t, "curve": curve} for t in bent["thrusters"]]
    world = simulate_world(vehicle_from_dict(bent, "bent"), {}, duration=120.0, seed=5)
    draft = init(resting_first(world.write(tmp_path / "log.csv")), Hull(mass=30.5, length=1.2))
    full = draft.vehicle.thrusters[0].curve.thrust(np.array([1910.0]), "pwm")[0]
    assert full == pytest.approx(35.0, rel=0.15)
    assert draft.vehicle.value("X_u") == pytest.approx(-15.0 - 8.0 * 1.7, rel=0.4)


def test_thrusters_that_cancel_where_the_log_is_fastest_tell_nothing_of_drag():
    """At 3 m/s the commands of this log stand at 1900 and 1100 us, and which way the thrusters push is not sure."""
    vehicle = init(shared("blueboat") / "log_218.csv", Hull(mass=15.0)).vehicle
    assert vehicle.value("X_u") < -1.0
    assert "typical" in str(vehicle.sources["damping"]["X_u"])


@pytest.mark.parametrize("lag", [0.0, 0.4])
def test_thrust_astern_is_what_the_boat_answers_and_a_lag_hides_no_thrust(lag, tmp_path):
    otter = load_vehicle("otter")
    world = simulate_world(otter, {"thruster_lag": lag}, duration=120.0, seed=4)
    draft = init(world.write(tmp_path / "log.csv"), Hull(mass=80.0, length=2.0, spacing=0.79))
    thruster = draft.vehicle.thrusters[0]
    astern, ahead = thruster.curve.thrust(np.array([-101.7367, 103.9309]), thruster.command)
    moved = (80.0 - draft.vehicle.value("X_udot")) / (80.0 - otter.value("X_udot"))
    assert ahead == pytest.approx(119.7 * moved, rel=0.2)
    assert ahead / -astern == pytest.approx(119.7 / 66.7, rel=0.25)
    assert Doubt.ASTERN not in draft.doubts


def test_the_hull_keeps_its_course_at_the_speeds_of_the_log(path):
    vehicle = init(path, Hull(mass=30.5)).vehicle
    u, value = 1.7, vehicle.value
    m11, m22 = vehicle.mass - value("X_udot"), vehicle.mass - value("Y_vdot")
    assert value("Y_v") * value("N_r") > m11 * (m22 - m11) * u**2 or value("Y_v") <= -m22 / 0.31


def test_every_number_has_a_source(path):
    vehicle = init(path).vehicle
    for section in ("added_mass", "damping"):
        assert set(vehicle.sources[section]) == set(getattr(vehicle, section))
    assert set(vehicle.sources["thrusters"]) == {t.name for t in vehicle.thrusters}
    assert all("to be replaced" in str(vehicle.sources[symbol]) for symbol in ("mass", "inertia_z"))


def test_a_command_in_newtons_is_its_force(tmp_path):
    log = simulate_world(load_vehicle("blueboat"), {}, duration=60.0, seed=1).write(tmp_path / "log.csv")
    curve = init(log).vehicle.thrusters[0].curve
    assert isinstance(curve, TableCurve)
    assert curve.command == curve.force
    assert len(curve.command) == 3


def test_like_another_boat(path):
    draft = init(path, like="otter")
    otter = load_vehicle("otter")
    assert draft.vehicle.damping == otter.damping
    assert otter.about
    assert draft.vehicle.about == ""  # it is another boat
    assert [(t.channel, t.y) for t in draft.vehicle.thrusters] == [("pwm_port", -0.395), ("pwm_stbd", 0.395)]
    full = draft.vehicle.thrusters[1].curve.thrust(np.array([1910.0]), "pwm")[0]
    assert full == pytest.approx(119.7, abs=0.1)
    assert init(path, Hull(mass=99.0), like="otter").vehicle.mass == 99.0


def test_a_log_without_commands_says_what_to_do(path, tmp_path):
    table = pd.read_csv(path)
    table[~table.field.str.startswith("pwm")].to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(LogError, match="no thruster command is recognised"):
        init(tmp_path / "log.csv")


def test_throttle_and_steering_are_offered_to_be_mixed(path, tmp_path):
    named = {"pwm_port": "throttle", "pwm_stbd": "steering"}
    with pytest.raises(LogError, match="'normalized_port: {from: 'command:throttle', mix: skid, steering: {from: 'c"):
        init([respelt(path, tmp_path / "log.csv", named)], Hull(mass=22.0))


def test_an_impossible_number_is_refused_before_anything_is_read():
    with pytest.raises(RequestError, match="length must be above 0 and at most 500 m, got -1 m"):
        Hull(length=-1.0)


def test_the_raw_logs_of_a_real_boat(tmp_path):
    """C3 is port, C1 is starboard and reversed, neutral is 1510 us, the ends are 1100 and 1900 us."""
    draft = init(shared("blueboat") / "raw", Hull(mass=15.0))
    assert named(draft) == {
        "pwm_port": ("port", False, 1100.0, 1510.0, 1900.0),
        "pwm_stbd": ("starboard", True, 1120.0, 1510.0, 1920.0),
    }
    port, stbd = draft.entries["pwm_port"], draft.entries["pwm_stbd"]
    assert port is not None
    assert port.source == "RCOU.C3"
    assert stbd is not None
    assert (stbd.source, stbd.scale) == ("RCOU.C1", -1.0)


def test_each_log_of_a_boat_gives_it_much_the_same_thrust():
    """What one log alone says is 22 to 88 766 N: two of them are fits of drag, not of thrust."""
    raw = shared("blueboat") / "raw"
    drafts = [init(path, Hull(mass=15.0), progress=None) for path in sorted(raw.glob("rcou_2[23]*.csv"))]
    thrust = [draft.vehicle.thrusters[0].curve.thrust(np.array([1900.0]), "pwm")[0] for draft in drafts]
    assert max(thrust) < 1.6 * min(thrust)
    told = [str(draft.vehicle.sources["thrusters"]["port"]) for draft in drafts]
    assert all("sure to a factor of" in text for text in told)
    assert sum("too far from that to be believed" in text for text in told) == 1
    assert sum("weighed with what is typical" in text for text in told) == 2


def test_a_length_beside_another_boat_is_refused_rather_than_lost(path):
    with pytest.raises(
        RequestError, match=r"a length of 3 m says nothing beside like=... Otter.*leave Hull\(length=...\) out"
    ):
        init(path, Hull(length=3.0), "otter")


def test_a_length_in_millimetres_is_refused():
    with pytest.raises(RequestError, match="at most 500 m, got 1200 m; give metres"):
        Hull(length=1200.0)


def test_a_log_with_forces_beside_pulses_has_each_thruster_once():
    draft = init(ROOT / "data" / "gazebo_blueboat.csv.gz", Hull(mass=20.0))
    assert [one.channel for one in draft.thrusters] == ["newton_port", "newton_stbd"]
    assert [one.side for one in draft.thrusters] == ["port", "starboard"]


def test_a_stream_that_is_no_command_is_no_example_of_one(tmp_path):
    columns = {
        "t": "0.1 * k",
        "x": "k",
        "y": "0",
        "psi": "0",
        "u": "1",
        "v": "0",
        "r": "0",
        "odom_z": "0",
        "prop_demand": "0",
    }
    rows = [",".join(str(eval(text, {"k": k})) for text in columns.values()) for k in range(200)]
    (tmp_path / "log.csv").write_text("\n".join([",".join(columns), *rows]) + "\n")
    with pytest.raises(LogError, match="for example 'pwm_port: prop_demand'"):
        init(tmp_path / "log.csv")
