"""The verb `adapt` as a user meets it."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
from typer.testing import CliRunner
from verbs import call, done, refused

import undertow
from undertow.__main__ import app
from undertow.discovery.calibration.following import Update
from undertow.measurements.preparation.resampling import Standardisation
from undertow.physics.worlds.world import NOISE, World
from undertow.reports.hull_diary import far_from_start
from undertow.residuals.models.model_files import load_network, save_network
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import NetworkModel, scaling_of
from undertow.residuals.networks.registry import build

HULL = undertow.load_vehicle("blueboat")
QUICK = ("--run-in", "20", "--alarm-hours", "1")
EFFECTS = ("-e", "surge_quadratic_damping", "-e", "thruster_asymmetry")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    weaker = HULL.with_values({"port_scale": 0.6})
    world = World(HULL, "rich", 54.0, 3, becomes=weaker, changes_at=34.0)
    return world.run(NOISE["field"]).write(tmp_path_factory.mktemp("logs") / "boat.csv")


def test_a_log_is_followed_and_its_change_rings(log: Path, tmp_path: Path):
    files = ("--out", tmp_path / "now.yaml", "--values", tmp_path / "values.csv")
    result = call("adapt", log, "--vehicle", "blueboat", *QUICK, *EFFECTS, "--every", "10", *files)
    assert (result.exit_code, result.exception) == (0, None), result.stderr
    lines = result.stdout.splitlines()
    assert lines[0].split() == ["t", "X_uu", "port_scale", "stbd_scale"]
    rows = [line for line in lines if line.count("±") == 3]
    assert [float(row.split()[0]) // 10 for row in rows] == [0, 1, 2, 3, 4, 5]
    assert max(len(row) for row in rows) <= 120
    told = " ".join(result.stdout.split())
    assert "ALARM thrust of port (port_scale) went from" in told
    assert "1 alarm." in told
    assert "noise and size of the forces from" in result.stderr
    assert "(1 times" not in result.stderr  # nothing is told of a variance that is as it is
    now = undertow.load_vehicle(tmp_path / "now.yaml")
    assert now.value("port_scale") == pytest.approx(0.6, abs=0.1)
    assert now.value("Y_v") == HULL.value("Y_v")
    assert "of it: followed by undertow adapt" in str(now.sources)
    text = (tmp_path / "values.csv").read_text().splitlines()
    assert text[0].startswith("# written by undertow adapt --values, sha256 ")
    assert (
        text[1]
        == "t,X_uu,X_uu_low,X_uu_high,"
        + ",".join(f"{s}_scale,{s}_scale_low,{s}_scale_high" for s in ("port", "stbd"))
        + ",excited"
    )
    assert len(text) == 2 + len(rows)


def test_standard_input_gives_the_same_for_machines(log: Path):
    words = ["adapt", "-", "--vehicle", "blueboat", *QUICK, *EFFECTS, "--json"]
    result = CliRunner().invoke(app, words, input=log.read_bytes() + b"half a l")
    assert result.exit_code == 0, result.stderr
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert {line["schema"] for line in lines} == {"undertow.following/1"}
    assert set(lines[-1]["values"]) == {"X_uu", "port_scale", "stbd_scale"}
    (alarm,) = [line["alarm"] for line in lines if line["alarm"]]
    assert alarm["parameter"] == "port_scale"
    assert "expected 4 values, got 1; the row is skipped" in result.stderr


def test_a_growing_file_is_followed_until_it_is_idle_and_an_earlier_log_saves_the_run_in(log: Path, tmp_path: Path):
    growing = tmp_path / "boat.csv"
    lines = log.read_text().splitlines(keepends=True)
    growing.write_text("".join(lines[: len(lines) // 2]) + "47.1,odom")
    words = ("--follow", "--idle", "0.3", "--like", log, "--every", "5", *EFFECTS)
    said = done("adapt", growing, "--vehicle", "blueboat", "--alarm-hours", "1", *words)
    assert "no alarm." in said
    assert float([line for line in said.splitlines() if "±" in line][-1].split()[0]) >= 20.0


def test_what_was_followed_is_kept_when_it_is_interrupted(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def interrupted(*_: object) -> Iterator[list[str]]:
        yield log.read_text().splitlines()
        raise KeyboardInterrupt

    monkeypatch.setattr("undertow.workflows.follow_live.growing_lines", interrupted)
    result = call("adapt", log, "--vehicle", "blueboat", *QUICK, *EFFECTS, "--follow", "--out", tmp_path / "now.yaml")
    assert result.exit_code == 130
    assert "Vehicle as it was followed" in result.stdout
    assert undertow.load_vehicle(tmp_path / "now.yaml").value("port_scale") == pytest.approx(0.6, abs=0.1)


def test_what_was_followed_is_kept_when_the_log_breaks(log: Path, tmp_path: Path):
    broken = tmp_path / "broken.csv"
    lines = log.read_text().splitlines()
    broken.write_text("\n".join([*lines, lines[len(lines) // 2], ""]))  # time runs back
    result = call("adapt", broken, "--vehicle", "blueboat", *QUICK, *EFFECTS, "--out", tmp_path / "now.yaml")
    assert result.exit_code == 2
    assert "time runs backwards" in result.stderr
    assert "Vehicle as it was followed" in result.stdout
    assert undertow.load_vehicle(tmp_path / "now.yaml").value("port_scale") == pytest.approx(0.6, abs=0.1)


def test_what_cannot_be_followed_is_refused(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    boat = ("adapt", log, "--vehicle", "blueboat")
    refused(*boat, "--idle", "3", match="--idle says when to end with --follow")
    refused(*boat, "--run-in", "5", match="expected a run-in of at least 20 s, got 5 s")
    refused(*boat, "--every", "0", match="expected --every above 0 s, got 0 s")
    refused(*boat, "--alarm-hours", "0", match="expected hours of the alarm above 0, got 0")
    refused(*boat, "-e", "thruster_lag", match="linear in its parameters, but it is not in lag")
    refused(*boat, "-e", "surge_drag", match="unknown effect 'surge_drag'")
    refused(*boat, "-e", "port_scale", match="unknown effect 'port_scale': did you mean 'thruster_asymmetry'")
    refused(*boat, "--out", log, match="is read by this call")
    refused("adapt", "none.csv", "--vehicle", "blueboat", match="no such file; expected a CSV log, or - for")
    refused("adapt", ".", "--vehicle", "blueboat", match="expected a CSV log, got a folder")
    refused("adapt", log, "--vehicle", "cybership2", match="wrong command kind: the vehicle wants rad_s_port")
    short = tmp_path / "short.csv"
    short.write_text("".join(log.read_text().splitlines(keepends=True)[:3000]))
    refused("adapt", short, "--vehicle", "blueboat", match=r"expected at least 60 s of log under way .* got \d+\.\d s")
    refused("adapt", log, "--vehicle", "blueboat", match=r"expected at least 60 s of log under way .* got 5\d\.\d s")


# A network beside it


def coupled(value: float) -> undertow.Vehicle:
    """The boat with surge turn drag, which its file lacks."""
    return HULL.with_values({"X_vr": value})


@pytest.fixture(scope="module")
def network(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The network that knows that drag: a polynomial with one weight."""
    names = input_names(HULL, heading=False)
    constants = Standardisation(names, np.zeros(5), np.array([1.0, 0.3, 0.5, 20.0, 20.0]))
    made = build("ridge", scaling_of(HULL, constants, np.ones(3)))
    product = made.get_buffer("factors").tolist().index([2, 3, 0])  # of 1, u, v, r: v r
    force = 60.0 / (HULL.value("mass") - HULL.value("X_udot"))
    with torch.no_grad():
        made.get_parameter("head.weight")[0, product] = force * 0.3 * 0.5
        made.get_parameter("lower").fill_(-100.0)
        made.get_parameter("upper").fill_(100.0)
    return save_network(NetworkModel(HULL, made, 0.1), tmp_path_factory.mktemp("networks") / "net", {"by": "hand"})


def test_the_last_layer_of_a_network_is_followed_rings_and_is_written(
    network: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    world = World(coupled(60.0), "rich", 80.0, 3, becomes=coupled(120.0), changes_at=40.0)
    log = world.run(NOISE["field"]).write(tmp_path / "boat.csv")
    words = ("adapt", log, "--vehicle", "blueboat", "--run-in", "30", "--alarm-hours", "1", "--every", "10")
    result = call(*words, "-e", "thruster_asymmetry", "--network", network, "--out", tmp_path / "now")
    assert (result.exit_code, result.exception) == (0, None), result.stderr
    assert result.stdout.split()[:4] == ["t", "port_scale", "stbd_scale", "net_surge"]
    assert "ALARM the network's force in surge (net_surge) went from" in " ".join(result.stdout.split())
    motion = World(coupled(120.0), "rich", 30.0, 5).run(NOISE["field"]).motion(0.1)
    before, now = (load_network(place).correction(motion)[:, 0] for place in (network, tmp_path / "now"))
    assert (before @ now) / (before @ before) == pytest.approx(2.0, abs=0.15)
    refused("adapt", log, "--vehicle", "otter", "--network", network, match="expected the vehicle that this network")
    refused("adapt", log, "--vehicle", "blueboat", "--network", tmp_path, match=r"expected a folder with model.yaml")


def test_what_is_far_from_the_file_is_said_in_the_end():
    update = Update(1.0, np.array([1.6, 1.2, 1.6]), np.array([0.05, 0.01, 0.4]), True, np.zeros(3), np.zeros(3))
    start = {"port_scale": 1.0, "stbd_scale": 1.0, "net_yaw": 1.0}
    assert far_from_start(update, start) == "port_scale 1.60 (file: 1.00)"
