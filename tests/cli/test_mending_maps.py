"""`inspect` mends a map where one reading of the log is surely right: time, commands, speeds, and dead records."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from verbs import call, inspected

from undertow.measurements.log import read_log
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    world = simulate_world(load_vehicle("blueboat"), {}, programme="rich", duration=90.0, noise="field", seed=5)
    frame = pd.DataFrame(world.odometry, columns=["x", "y", "psi", "u", "v", "r"])
    frame.insert(0, "time", world.odometry_time)
    return frame


def test_stamps_in_milliseconds_are_mended_by_the_map_and_by_fix(table: pd.DataFrame, tmp_path: Path):
    path, lines, fixed = tmp_path / "log.csv", tmp_path / "map.yaml", tmp_path / "fixed.csv"
    table.assign(time=(1000.0 * table["time"]).round(0)).to_csv(path, index=False)
    told = inspected("inspect", path, "--map-out", lines, "--fix", fixed)
    assert "The stamps are in ms" in told
    assert yaml.safe_load(lines.read_text())["time"] == {"from": "time", "scale": 0.001}
    assert "are in ms" not in inspected("inspect", path, "--map", lines)
    seconds = read_log(fixed).channels["u"].time
    assert seconds[-1] - seconds[0] == pytest.approx(float(np.ptp(table["time"])), abs=2e-3)


def test_a_sound_time_is_not_accused(table: pd.DataFrame, tmp_path: Path):
    path = tmp_path / "log.csv"
    for factor in (1.0, 1.3, 0.7, 60.0):
        table.assign(time=factor * table["time"]).to_csv(path, index=False)
        assert "are in ms" not in inspected("inspect", path)


def test_a_refused_table_leaves_the_line_that_mends_it(table: pd.DataFrame, tmp_path: Path):
    path, lines = tmp_path / "log.csv", tmp_path / "map.yaml"
    table.rename(columns={"time": "clk"}).to_csv(path, index=False)
    result = call("inspect", path, "--map-out", lines)
    assert result.exit_code == 2
    assert "begins with that line" in result.stderr
    assert yaml.safe_load(lines.read_text()) == {"time": "clk"}
    inspected("inspect", path, "--map", lines)


@pytest.fixture(scope="module")
def driven() -> pd.DataFrame:
    """A log with the commands of the shipped BlueBoat, held in the rows of the motion."""
    world = simulate_world(load_vehicle("blueboat"), {}, programme="rich", duration=120.0, noise="field", seed=5)
    frame = pd.DataFrame(world.odometry, columns=["x", "y", "psi", "u", "v", "r"])
    held = np.clip(np.searchsorted(world.command_time, world.odometry_time, "right") - 1, 0, None)
    frame[["newton_port", "newton_stbd"]] = world.commands[held]
    frame.insert(0, "time", world.odometry_time)
    return frame


def _mixed(frame: pd.DataFrame) -> pd.DataFrame:
    throttle, steering = (0.5 * (frame["newton_port"] + sign * frame["newton_stbd"]) for sign in (1.0, -1.0))
    return frame.assign(newton_port=throttle, newton_stbd=steering)


def _percent(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(**{name: frame[name] / 0.35 for name in ("newton_port", "newton_stbd")})


SPOILT = {
    "throttle and steering": (_mixed, "look like throttle and steering"),
    "percent": (_percent, "beyond the end of its curve"),
    "u and v exchanged": (lambda f: f.assign(u=f["v"], v=f["u"]), "u and v look exchanged"),
    "heading in degrees": (lambda f: f.assign(psi=np.degrees(f["psi"])), "in degrees"),
    "a speed that was never measured": (lambda f: f.assign(u=0.0, v=0.0), "never change"),
}


@pytest.mark.parametrize("name", SPOILT)
def test_the_map_that_is_written_mends_the_log(name: str, driven: pd.DataFrame, tmp_path: Path):
    spoil, said = SPOILT[name]
    path, lines = tmp_path / "log.csv", tmp_path / "map.yaml"
    spoil(driven).to_csv(path, index=False)
    told = inspected("inspect", path, "--vehicle", "blueboat", "--map-out", lines)
    assert said in " ".join(told.split())
    again = " ".join(inspected("inspect", path, "--vehicle", "blueboat", "--map", lines).split())
    assert "Usable; no defect was found" in again
