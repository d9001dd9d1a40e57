"""MCAP files with JSON messages: whatever numbers they hold, and `series.mcap` read back."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bags import EPOCH, nanoseconds
from json_files import STATE, Text, numbers, texts_of, write_json
from logged import assert_same_motion, note, without_a_file
from verbs import done, strict
from verbs import inspected as inspect

import undertow
from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading
from undertow.measurements.preparation.prepare import WEAK, prepare
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.series import stretches

BOAT = undertow.load_vehicle("blueboat")
TIME = np.arange(0.0, 30.0, 0.1)
PSI = 0.3 + 0.05 * TIME


@pytest.fixture(scope="module")
def world():
    return simulate_world(BOAT, {}, duration=60.0, noise="field", seed=4)


def stream(topic, kind="", **columns):
    """A message for every stamp; a column is an array, or a function of the row."""
    return [
        Text(
            topic,
            {name: column(k) if callable(column) else float(column[k]) for name, column in columns.items()},
            nanoseconds(time),
            kind,
        )
        for k, time in enumerate(TIME)
    ]


def read(tmp_path: Path, *topics, schemas=None, lines="", namespace=None) -> Log:
    messages = sorted((m for topic in topics for m in topic), key=lambda m: m.received)
    path = write_json(tmp_path / "log.mcap", messages, schemas)
    (tmp_path / "map.yaml").write_text(lines)
    return read_log(path, Reading(channel_map=tmp_path / "map.yaml" if lines else None, namespace=namespace))


SCHEMAS = {"boat.State": numbers(STATE), "boat.Thrusters": numbers(t.channel for t in BOAT.thrusters)}


@pytest.mark.parametrize("schemas", [SCHEMAS, {}])
def test_canonical_names_give_the_motion_with_and_without_a_schema(tmp_path, world, schemas):
    log = read_log(write_json(tmp_path / "log.mcap", texts_of(world), schemas))
    assert list(log.channels) == [*STATE, "newton_port", "newton_stbd"]
    assert log.channels["u"].origin == "/state:u"
    np.testing.assert_array_equal(log.channels["u"].value, world.odometry[:, 3])
    assert_same_motion(log, without_a_file(world), world)


def test_nested_numbers_and_lists_have_the_names_that_a_map_uses(tmp_path):
    dvl = stream("/dvl", velocity=lambda k: {"ahead": 1.0 + 0.01 * k, "beams": [{"range": 4.0}]}, on=lambda k: True)
    esc = stream("/esc", outputs=lambda k: [1500.0, 1600 + k % 3], thrusters=lambda k: [{"name": "port", "force": 2}])
    lines = 'u: "/dvl:velocity.ahead"\npwm_stbd: "outputs[1]"\nnewton_port: "/esc:thrusters[0].force"\n'
    log = read(tmp_path, dvl, esc, stream("/compass", psi=PSI), lines=lines)
    np.testing.assert_allclose(log.channels["u"].value, 1.0 + 0.01 * np.arange(TIME.size))
    np.testing.assert_array_equal(log.channels["pwm_stbd"].value, 1600 + np.arange(TIME.size) % 3)
    np.testing.assert_array_equal(log.channels["newton_port"].value, 2.0)
    assert {"/dvl:velocity.beams[0].range", "/dvl:on", "/esc:outputs[0]"} <= set(log.unused)


def test_messages_of_ros_in_json_are_known_by_their_type_and_header(tmp_path):
    def odometry(k):
        yaw = np.pi / 2 - PSI[k]
        return {
            "header": {"stamp": {"sec": EPOCH // 10**9, "nanosec": round(1e8 * k)}, "frame_id": "odom"},
            "child_frame_id": "base_link",
            "pose": {
                "pose": {
                    "position": {"x": 2.0, "y": 0.5 * k, "z": 0},
                    "orientation": {"x": 0, "y": 0, "z": np.sin(yaw / 2), "w": np.cos(yaw / 2)},
                },
                "covariance": [0.0] * 36,
            },
            "twist": {"twist": {"linear": {"x": 1.0, "y": 0.2}, "angular": {"z": -0.05}}},
        }

    texts = [Text("/odom", odometry(k), EPOCH + round(1e8 * k) + 70_000_000, "nav_msgs/Odometry") for k in range(9)]
    log = read(tmp_path, texts)
    np.testing.assert_allclose(log.channels["x"].value, 0.5 * np.arange(9))
    np.testing.assert_allclose(log.channels["v"].value, -0.2)
    np.testing.assert_allclose(log.channels["psi"].value, PSI[:9])
    np.testing.assert_allclose(log.start_ns + 1e9 * log.channels["x"].time, EPOCH + 1e8 * np.arange(9), rtol=1e-15)
    note(log, "/odom: received 0.070 s (median)", "after its header stamps, which are used")


def test_of_topics_with_one_name_the_measured_and_fullest_one_is_taken(tmp_path):
    motion = {"psi": PSI, "u": np.ones(TIME.size), "v": np.zeros(TIME.size)}
    wanted = stream("/a_setpoint", psi=PSI + 1, u=motion["u"] + 1, v=motion["v"] + 1, r=motion["v"], x=TIME, y=TIME)
    aside = stream("/b_dvl", u=motion["u"] + 2, newton_port=motion["u"])
    predicted = stream("/a_predicted/model", **motion, newton_port=motion["u"] + 5)
    log = read(tmp_path, wanted, aside, predicted, stream("/state", **motion))
    np.testing.assert_array_equal(log.channels["u"].value, 1.0)
    np.testing.assert_array_equal(log.channels["psi"].value, PSI)
    np.testing.assert_array_equal(log.channels["newton_port"].value, 1.0)
    note(log, "psi v: taken from /state, not from /a_predicted/model, /a_setpoint")
    note(log, "u: taken from /state, not from /a_predicted/model, /a_setpoint, /b_dvl")


def test_boats_in_json_are_told_apart_by_their_namespaces(tmp_path, world):
    both = sorted([*texts_of(world, "/a"), *texts_of(world, "/b")], key=lambda m: m.received)
    with pytest.raises(ValueError, match="expected the log of one vehicle, got 2: /a, /b"):
        read(tmp_path, both, schemas=SCHEMAS)
    assert read(tmp_path, both, namespace="b").channels["u"].origin == "/b/state:u"


def test_what_is_no_number_and_no_json_is_left_out_with_a_note(tmp_path):
    good = stream("/state", psi=PSI, u=TIME)
    odd = [b'{"u": 1e999, "psi": 1}', b'{"u": null, "psi": 2}', b'{"u": NaN, "psi": 3}', b'{"u": "1", "psi": 4}']
    bad = [b'{"u": ', b"\xff\xfe", b"[" * 200_000, b'{"u": 1' + b"0" * 400 + b"}", b'{"u": 9' + b"9" * 5000 + b"}"]
    bare = [b"3.5", b"[1, 2]", b'"text"', b'{"\\ud800": 1, "u": 5, "psi": 5, "": 2, "a": {"": [[[[[[[[[1]]]]]]]]]}}']
    late = [Text("/state", raw, nanoseconds(30.0 + 0.1 * k)) for k, raw in enumerate([*odd, *bad, *bare])]
    log = read(tmp_path, good, late)
    np.testing.assert_array_equal(log.channels["u"].value, [*TIME, 5.0])
    assert log.channels["psi"].value.size == TIME.size + 5
    note(log, "/state: 5 broken messages left out")
    note(log, "u: 3 rows without a number dropped")
    assert {"/state:value", "/state:value[1]", "/state:?"} <= set(log.unused)
    with pytest.raises(ValueError, match=r"log\.mcap: no message could be unpacked \(/state: 5 broken messages"):
        read(tmp_path, [Text("/state", raw, EPOCH) for raw in bad])


def test_a_topic_whose_schema_has_nothing_of_use_is_not_unpacked(tmp_path):
    camera = [Text("/camera", b"{broken", nanoseconds(t), "Image") for t in TIME]
    image = {"type": "object", "properties": {"width": {"type": "integer"}, "data": {"type": "string"}}}
    path = {"type": "array", "items": numbers(["pose"])}
    image["properties"] |= {"poses": path, "timestamp": numbers(["sec", "nsec"])}
    log = read(tmp_path, camera, stream("/state", psi=PSI), schemas={"Image": image})
    assert not any("broken" in text for text in log.notes)
    assert log.unused == ("/camera:width", "/camera:poses[].pose")
    for opened in ({"$ref": "#/x"}, {"type": "object", "properties": {"width": {"type": ["number", {}]}}}):
        log = read(tmp_path, camera, stream("/state", psi=PSI), schemas={"Image": opened})
        note(log, "/camera: 300 broken messages left out")


def test_a_topic_of_endless_names_is_cut_off_and_says_so(tmp_path):
    names = stream("/many", "", **{f"n{k}": TIME for k in range(390)})
    endless = [Text("/many", {f"m{k}": 1.0}, nanoseconds(30.0 + k)) for k in range(50)]
    log = read(tmp_path, names, endless, stream("/state", psi=PSI))
    assert "/many:(more fields)" in log.unused
    assert len(log.unused) == 401


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    simulate_world(BOAT, {"X_uu": -12.0}, duration=120.0, seed=0).write(folder / "log.csv")
    done("discover", folder / "log.csv", "-v", "blueboat", "--no-report", "--split", "test", "--out", folder / "run")
    return folder / "run"


def test_series_mcap_is_read_as_the_log_that_it_was_made_of(run):
    log, table = read_log(run / "series.mcap"), pd.read_csv(run / "series.csv")
    assert list(log.channels) == [*STATE, "newton_port", "newton_stbd"]
    for name, channel in log.channels.items():
        assert channel.origin == f"/measured:{name}"
        np.testing.assert_array_equal(channel.value, table[{"x": "north", "y": "east"}.get(name, name)])
        np.testing.assert_allclose(channel.time + log.start_ns / 1e9, table["time"], rtol=0, atol=1e-7)
    note(log, "psi u v r: taken from /measured, not from /predicted/after, /predicted/before")
    inputs = undertow.read_inputs(run.parent / "log.csv", BOAT)
    made = sorted((s.motion for s in stretches(inputs.parts)), key=lambda motion: motion.time[0])
    again = prepare(log, BOAT, WEAK).motions
    assert len(again) == len(made) == 3
    for found, measured in zip(again, made, strict=True):
        np.testing.assert_allclose(found.time + log.start_ns / 1e9, measured.time, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.position, measured.position, rtol=0, atol=1e-7)
        np.testing.assert_allclose(np.exp(1j * (found.heading - measured.heading)), 1.0, atol=1e-7)
        np.testing.assert_allclose(found.velocity, measured.velocity, rtol=0, atol=1e-7)


def test_discover_finds_in_series_mcap_what_it_found_in_the_log(run, tmp_path):
    inspected = strict(inspect("inspect", run / "series.mcap", "-v", "blueboat", "--json"))
    assert inspected["map"]["newton_port"] == {"from": "/measured:newton_port"}
    assert not inspected["plan"]["missing"]
    assert not [f for f in inspected["quality"] if f["verdict"] in ("defect", "warning")]
    done("discover", run / "series.mcap", "-v", "blueboat", "--no-report", "--out", tmp_path / "again")
    first, again = (strict((folder / "findings.json").read_text()) for folder in (run, tmp_path / "again"))
    assert first["missing"] == again["missing"] == ["surge_quadratic_damping"]
    terms = [findings["candidates"][0]["terms"][0]["value"] for findings in (first, again)]
    assert terms[0] == pytest.approx(terms[1], rel=0.03)
