"""`series.mcap`: what a viewer finds in it, and that its numbers are those of the run."""

import json
import sys
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mcap.reader import make_reader
from verbs import call, done, refused, strict

import undertow
from undertow.discovery.candidates.linearisation import effect_forces, effects_between
from undertow.exports.mcap_series import Prediction, compared, write_series
from undertow.measurements.preparation.split import PARTS
from undertow.physics.forces import modelled_force
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.scores import same_filter
from undertow.residuals.series import SeriesTable, stretches
from undertow.workflows.run_folder.run_files import VIEWED

BOAT = undertow.load_vehicle("blueboat")
EFFECTS = ("surge_quadratic_damping", "thruster_asymmetry[port]", "sway_added_mass", "yaw:u|r|")
TOPICS = ("surge_quadratic_damping", "thruster_asymmetry_port", "sway_added_mass", "yaw_u_abs_r")


class Recording:
    """An MCAP file read whole: stamps and messages by topic, schemas, and what stands beside them."""

    def __init__(self, path: Path) -> None:
        self.stamps: dict[str, list[int]] = defaultdict(list)
        self.messages: dict[str, list[dict[str, Any]]] = defaultdict(list)
        self.schemas: dict[str, dict[str, Any]] = {}
        self.names: dict[str, str] = {}
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            summary = reader.get_summary()
            assert summary is not None
            self.chunks = summary.chunk_indexes
            self.about = {channel.topic: channel.metadata for channel in summary.channels.values()}
            for schema, channel, message in reader.iter_messages():
                assert schema is not None
                assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
                assert message.publish_time == message.log_time
                self.stamps[channel.topic].append(message.log_time)
                self.messages[channel.topic].append(json.loads(message.data))
                self.schemas[channel.topic] = json.loads(schema.data)
                self.names[channel.topic] = schema.name
            (self.metadata,) = [record.metadata for record in reader.iter_metadata()]

    def column(self, topic: str, name: str) -> np.ndarray:
        return np.array([message[name] for message in self.messages[topic]])

    def forces(self, topic: str) -> np.ndarray:
        return np.column_stack([self.column(topic, name) for name in "XYN"])


def check(value: Any, schema: Mapping[str, Any]) -> None:
    """That a value is as a JSON Schema has it, in the words that these schemas use; nothing unnamed may stand in it."""
    assert set(schema) <= {"title", "description", "type", "properties", "items", "minimum", "maximum"}
    kinds = {"object": dict, "array": list, "string": str, "number": float, "integer": int}
    assert isinstance(value, kinds[schema["type"]]), (value, schema)
    if schema["type"] == "object":
        assert set(value) <= set(schema["properties"])
        for name, part in value.items():
            check(part, schema["properties"][name])
    for part in value if schema["type"] == "array" else ():
        check(part, schema["items"])
    if schema["type"] == "integer":
        assert schema.get("minimum", value) <= value <= schema.get("maximum", value)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a log of a boat that lacks nothing but has a weak port thruster and more."""
    folder = tmp_path_factory.mktemp("viewer")
    hidden = {"surge_quadratic_damping": -8.0, "port_scale": 0.8, "sway_added_mass": -9.0, "yaw:u|r|": -4.0}
    simulate_world(BOAT, hidden, duration=100.0, seed=3).write(folder / "log.csv")
    return folder


@pytest.fixture(scope="module")
def run(place: Path) -> undertow.Run:
    return undertow.add(EFFECTS, undertow.read_inputs(place / "log.csv", BOAT, judge="test"))


@pytest.fixture(scope="module")
def written(place: Path, run: undertow.Run) -> Path:
    return undertow.write_run(run, place / "run", report=False)


@pytest.fixture(scope="module")
def found(written: Path) -> Recording:
    return Recording(written / "series.mcap")


def test_the_topics_are_measurement_predictions_residuals_and_effects(found: Recording) -> None:
    models = [f"/{what}/{which}" for which in ("before", "after") for what in ("predicted", "residual")]
    drawn = ["/measured/pose", "/measured/path", "/predicted/before/pose", "/predicted/after/pose", "/tf"]
    assert sorted(found.messages) == sorted(["/measured", *models, *drawn, *(f"/effects/{name}" for name in TOPICS)])
    assert found.names["/measured/pose"] == "foxglove.PoseInFrame"
    assert found.names["/measured/path"] == "foxglove.PosesInFrame"
    assert found.names["/tf"] == "foxglove.FrameTransform"
    assert found.about["/effects/surge_quadratic_damping"]["equation"] == "X += X_uu u_r |u_r|"


def test_every_message_is_as_its_embedded_schema_says(found: Recording) -> None:
    for topic, messages in found.messages.items():
        for message in messages:
            check(message, found.schemas[topic])
        names = set(found.schemas[topic]["properties"])
        assert set(messages[0]) == names


def test_every_own_number_says_what_it_is_and_its_unit(found: Recording) -> None:
    for topic in ("/measured", "/predicted/after", "/residual/after"):
        for name, told in found.schemas[topic]["properties"].items():
            assert "[" in told["description"] or name == "part"


def test_the_numbers_are_those_of_series_csv(written: Path, found: Recording) -> None:
    table = pd.read_csv(written / "series.csv")
    state = ("x", "y", "psi", "u", "v", "r", "u_dot", "v_dot", "r_dot")
    for name in (*state, "newton_port", "newton_stbd", "part"):
        column = {"x": "north", "y": "east"}.get(name, name)
        assert (found.column("/measured", name) == table[column]).all()
    for model in ("before", "after"):
        for name in state:
            column = {"x": "north", "y": "east"}.get(name, name)
            assert (found.column(f"/predicted/{model}", name) == table[f"{column}_{model}"]).all()
    for name in "XYN":
        assert (found.column("/residual/before", name) == table[f"{name}_residual"]).all()
    for topic in found.stamps:
        if topic != "/measured/path":
            assert found.stamps[topic] == [round(1e9 * t) for t in table["time"]]


def test_the_forces_of_the_effects_lead_from_one_residual_to_the_other(run: undertow.Run, found: Recording) -> None:
    each = [found.forces(f"/effects/{name}") for name in TOPICS]
    assert sum(each) == pytest.approx(found.forces("/residual/before") - found.forces("/residual/after"), abs=1e-5)
    moved = {name: np.abs(force).max(axis=0) for name, force in zip(TOPICS, each, strict=True)}
    assert (moved["surge_quadratic_damping"] > 1.0).tolist() == [True, False, False]
    assert (moved["thruster_asymmetry_port"] > 0.1).tolist() == [True, False, True]
    assert (moved["sway_added_mass"] > 0.1).tolist() == [True, True, True]  # with its Coriolis force and Munk moment


def test_the_force_of_a_linear_effect_is_its_coefficient_times_its_column(run: undertow.Run, found: Recording) -> None:
    added = run.discovery.corrected.value("X_uu") - run.discovery.nominal.value("X_uu")
    frames = []
    for part in PARTS:
        data = run.inputs.parts.data(part)
        for motion in data.motions:
            u = motion.velocity[:, 0]
            frames.append((motion.time, same_filter(added * u * np.abs(u), motion, data)))
    time, force = (np.concatenate(columns) for columns in zip(*frames, strict=True))
    assert found.forces("/effects/surge_quadratic_damping")[:, 0] == pytest.approx(force[np.argsort(time)], abs=1e-6)


def test_the_effects_add_up_to_the_difference_of_the_modelled_forces(run: undertow.Run) -> None:
    parts = run.inputs.parts
    other = BOAT.with_values({"lag": 0.4, "Y_vv": -50.0, "memory_yaw": 3.0, "yaw:u|r|": -2.0, "thrust_scale": 0.9})
    keys = effects_between(BOAT, other)
    assert keys == ["sway_quadratic_damping", "thrust_scale", "thruster_lag", "wake_memory", "yaw:u|r|"]
    forces = effect_forces(BOAT, other, parts, keys)
    assert list(forces) == keys
    total = sum(table[["X", "Y", "N"]] for table in forces.values())
    wanted = [
        (motion.time, same_filter(modelled_force(other, motion) - modelled_force(BOAT, motion), motion, data))
        for data in map(parts.data, PARTS)
        for motion in data.motions
    ]
    time, force = (np.concatenate(columns) for columns in zip(*wanted, strict=True))
    assert np.abs(force).max(axis=0).min() > 1.0
    assert total == pytest.approx(force[np.argsort(time)], abs=1e-5)


def test_what_is_no_effect_is_told_apart(run: undertow.Run) -> None:
    heavier = BOAT.with_values({"inertia_z": 9.0, "yaw_trim": 1.0})
    forces = effect_forces(BOAT, heavier, run.inputs.parts, effects_between(BOAT, heavier))
    assert list(forces) == ["yaw_trim", "other"]
    assert forces["yaw_trim"]["N"] == pytest.approx(1.0, abs=1e-6)
    assert np.abs(forces["other"]["N"]).max() > 1.0
    assert effect_forces(BOAT, BOAT, run.inputs.parts, []) == {}


def test_views_with_z_up_see_east_to_the_right_and_a_turn_to_starboard_clockwise(found: Recording) -> None:
    measured = found.messages["/measured"]
    for k, drawn in enumerate(found.messages["/measured/pose"]):
        place, turn = drawn["pose"]["position"], drawn["pose"]["orientation"]
        assert (place["x"], place["y"], place["z"]) == (measured[k]["y"], measured[k]["x"], 0.0)
        ahead = (turn["w"] ** 2 - turn["z"] ** 2, 2.0 * turn["w"] * turn["z"])  # the body's x axis, turned about z
        assert ahead == pytest.approx((np.sin(measured[k]["psi"]), np.cos(measured[k]["psi"])), abs=1e-6)
        moved = found.messages["/tf"][k]["transform"]
        assert (moved["translation"], moved["rotation"]) == (place, turn)
    (path,) = found.messages["/measured/path"]
    assert path["poses"] == [message["pose"] for message in found.messages["/measured/pose"]][::10]
    stamp = found.messages["/tf"][-1]["timestamp"]
    assert stamp["sec"] * 10**9 + stamp["nsec"] == found.stamps["/tf"][-1]


def test_the_file_is_small_and_can_be_entered_anywhere(written: Path, found: Recording) -> None:
    assert len(found.chunks) > 1
    assert {chunk.compression for chunk in found.chunks} == {"zstd"}
    seconds = len(found.messages["/measured"]) / 10.0
    assert (written / "series.mcap").stat().st_size < 3e6 * seconds / 240.0
    with (written / "series.mcap").open("rb") as stream:
        later = make_reader(stream).iter_messages(topics=["/measured"], starting_at=50 * 10**9)
        stamps = found.stamps["/measured"]
        assert next(later)[2].log_time == min(stamp for stamp in stamps if stamp >= 50 * 10**9)


def test_equal_runs_give_equal_bytes(run: undertow.Run, written: Path, tmp_path: Path) -> None:
    again = undertow.write_run(run, tmp_path / "again", report=False)
    assert (again / "series.mcap").read_bytes() == (written / "series.mcap").read_bytes()


def test_a_number_that_is_not_finite_is_left_out(run: undertow.Run, tmp_path: Path) -> None:
    table = run.series.copy()
    table.loc[3, "u_after"] = np.inf
    table.loc[4, ["north_after", "psi_after", "X_residual"]] = np.nan
    told = [Prediction(name, BOAT, SeriesTable.of(table), name) for name in ("before", "after")]
    found = Recording(write_series(tmp_path / "a.mcap", told, run.inputs.channels, run.inputs.parts, run.inputs.starts))
    assert set(found.messages["/predicted/after"][3]) == set(found.messages["/predicted/after"][2]) - {"u"}
    assert set(found.messages["/predicted/after"][4]) == set(found.messages["/predicted/after"][2]) - {"x", "psi"}
    assert set(found.messages["/residual/before"][4]) == {"Y", "N"}
    rows = len(table)
    assert [len(found.messages[f"/predicted/{name}/pose"]) for name in ("before", "after")] == [rows, rows - 1]


def nominal_series(inputs: undertow.Inputs, path: Path) -> Path:
    """The series of the nominal model, as `compare` writes it."""
    told = compared([VehicleModel(BOAT, "nominal")], inputs.parts, inputs.channels)
    return write_series(path, told, inputs.channels, inputs.parts, inputs.starts)


@pytest.mark.parametrize(("start", "moved"), [(7.5, 0), (1.7e9, 0), (-30.25, 31)])
def test_stamps_are_those_of_the_log(start: float, moved: int, place: Path, tmp_path: Path) -> None:
    log = pd.read_csv(place / "log.csv")
    log["time"] += start
    log.to_csv(tmp_path / "log.csv", index=False)
    inputs = undertow.read_inputs(tmp_path / "log.csv", BOAT)
    found = Recording(nominal_series(inputs, tmp_path / "a.mcap"))
    # The world's own stamps have a microsecond in a CSV, and a double that counts from 1970 a quarter of one.
    begun = min(motion.time[0] for motion in undertow.read_inputs(place / "log.csv", BOAT).parts.split.train.motions)
    assert found.stamps["/measured"][0] == pytest.approx((begun + start + moved) * 1e9, abs=600)
    assert found.metadata.get("log0_starts_at_ns", "0")[:6] == ("170000" if start > 1e9 else "0")
    assert found.metadata.get("log0_stamps_moved_by_s", "0") == str(moved)


def test_several_logs_have_topics_of_their_own(place: Path, tmp_path: Path) -> None:
    simulate_world(BOAT, {}, duration=60.0, seed=8).write(tmp_path / "other.csv")
    paths = [place / "log.csv", tmp_path / "other.csv"]
    inputs = undertow.read_inputs(paths, BOAT)
    found = Recording(nominal_series(inputs, tmp_path / "a.mcap"))
    assert [found.metadata[f"log{k}"] for k in range(2)] == [str(path) for path in paths]
    assert {topic.split("/")[1] for topic in found.messages} == {"log0", "log1"}
    rows = [sum(s.motion.time.size for s in stretches(inputs.parts) if s.log == k) for k in range(2)]
    assert [len(found.messages[f"/log{k}/measured"]) for k in range(2)] == rows
    assert found.messages["/log1/tf"][0]["child_frame_id"] == "log1/boat"


def test_compare_writes_every_model_under_its_name(
    place: Path, written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lent_boats.py").write_text(
        "def still(velocity, heading, commands):\n    return 0.0 * velocity\n", "utf-8"
    )
    models = ["--model", written, "--model", "lent_boats:still"]
    words = ["compare", place / "log.csv", "-v", "blueboat", "--series"]
    assert "Series for Foxglove and PlotJuggler: a.mcap" in done(*words, "a.mcap", *models)
    assert strict(done(*words, "b.mcap", "--json"))["schema"] == "undertow.comparison/1"
    found, fewer = Recording(tmp_path / "a.mcap"), Recording(tmp_path / "b.mcap")
    assert len(fewer.messages) < len(found.messages)
    for topic, messages in fewer.messages.items():
        assert (found.messages[topic], found.stamps[topic]) == (messages, fewer.stamps[topic])
    assert {"/residual/nominal", "/residual/run", "/residual/lent_boats_still"} <= set(found.messages)
    effects = [found.forces(f"/effects/run/{name}") for name in TOPICS]
    assert sum(effects) == pytest.approx(found.forces("/residual/nominal") - found.forces("/residual/run"), abs=1e-5)
    assert not found.column("/predicted/lent_boats_still", "u_dot").any()
    assert not [topic for topic in found.messages if topic.startswith("/effects/boats")]


def test_a_series_that_cannot_be_written_is_refused_before_the_work(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["compare", place / "log.csv", "-v", "blueboat", "--series"]
    refused(*words, "nowhere/a.mcap", match="nowhere does not exist; create it")
    refused(*words, tmp_path, match="it is a folder; give the name of a file")
    monkeypatch.setitem(sys.modules, "mcap.records", None)
    refused(*words, "a.mcap", match=r"needs the package mcap: .*pip install -e '\.\[logs\]' -c constraints\.txt")


def test_without_the_extra_a_run_is_whole_but_for_it(
    run: undertow.Run, written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = undertow.write_run(run, tmp_path / "run", report=False)
    monkeypatch.setitem(sys.modules, "mcap.records", None)
    told: list[str] = []
    undertow.write_run(run, target, report=False, progress=told.append)
    assert {p.name for p in target.iterdir()} == {p.name for p in written.iterdir()} - set(VIEWED)
    assert told == ["writing the run folder"]


def test_the_verb_tells_nothing_of_what_nobody_asked_for(
    place: Path, run: undertow.Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "mcap.records", None)
    monkeypatch.setattr("undertow.workflows.discover_and_add.discover", lambda *_, **__: run)
    result = call("discover", place / "log.csv", "-v", "blueboat", "--out", "run", "--no-report")
    assert result.exit_code == 0
    assert "logs" not in result.stderr
    assert "Foxglove" not in result.stdout
    assert not Path("run", "series.mcap").exists()
