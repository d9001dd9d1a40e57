"""`discover --fix` and its like: the repairs of `inspect --fix`, made in memory and told wherever results are told."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from verbs import done, inspected, refused, strict

from undertow.measurements.log import Log, read_log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError, RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.follow_live import follow_live
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.read import read_run_inputs

HULL = load_vehicle("blueboat")
HIDDEN = {"surge_quadratic_damping": -6.0}
SORTED = "rows of x, y, psi, u, v, r, newton_port, newton_stbd sorted by time"


def damaged(table: pd.DataFrame) -> pd.DataFrame:
    """A long log whose rows are shuffled a little, some of them twice there, its heading in degrees."""
    turned = table["field"] == "psi"
    table = table.assign(value=np.where(turned, np.degrees(table["value"]), table["value"]))
    stamps = np.array(sorted(set(table["time"])))
    swapped = dict(zip(stamps[100:102], stamps[[101, 100]], strict=True))
    rank = np.argsort(table["time"].replace(swapped).to_numpy(), kind="stable")
    return pd.concat([table.iloc[rank], table.iloc[rank[-40:]]])


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a damaged log, `raw.csv`, and another of the same boat, `second.csv`."""
    folder = tmp_path_factory.mktemp("logs")
    for seed, name in ((31, "raw.csv"), (32, "second.csv")):
        simulate_world(HULL, HIDDEN, duration=120.0, seed=seed).write(folder / name)
        damaged(pd.read_csv(folder / name)).to_csv(folder / name, index=False)
    return folder


@pytest.fixture
def here(logs: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(logs)
    monkeypatch.setenv("COLUMNS", "120")
    return logs


def test_motions_are_those_of_the_log_that_inspect_writes(here: Path):
    with pytest.raises(LogError, match=r"time runs backwards .* Reading\(fix=True\) does so"):
        read_inputs("raw.csv", HULL)
    inspected("inspect", "raw.csv", "-v", "blueboat", "--fix", "clean.csv")
    memory, file = read_inputs("raw.csv", HULL, Reading(fix=True)), read_inputs("clean.csv", HULL)
    for one, other in zip(memory.fitting, file.fitting, strict=True):
        np.testing.assert_allclose(one.velocity, other.velocity, atol=1e-9)
        np.testing.assert_allclose(one.commands, other.commands, atol=1e-6)
    (told,) = memory.repairs
    assert told.startswith(f"repaired in memory, raw.csv: {SORTED}")
    assert "psi turned from degrees into radians" in told
    assert memory.notes[0] == told.replace(", raw.csv", "", 1)
    assert [f.verdict for i in memory.inspections for f in i.quality if f.check in ("stamps", "units")] == ["ok"] * 3
    Path("clean.csv").unlink()


def test_a_log_in_memory_is_repaired_too(here: Path):
    log = read_log("raw.csv", mend=True)
    columns = {name: np.interp(log.channels["u"].time, c.time, c.value) for name, c in log.channels.items()}
    table = Log.from_arrays(log.channels["u"].time, columns, name="monday")
    assert "psi turned from degrees" in read_inputs(table, HULL, Reading(fix=True)).repairs[0]


def test_nothing_to_repair_is_said(here: Path):
    inspected("inspect", "raw.csv", "-v", "blueboat", "--fix", "clean.csv")
    assert read_inputs("clean.csv", HULL, Reading(fix=True)).repairs == (
        "repaired in memory, clean.csv: nothing had to be put right",
    )
    Path("clean.csv").unlink()


def test_the_verbs_say_what_they_repaired_and_remember_it(here: Path):
    refused("discover", "raw.csv", "-v", "blueboat", "-o", "run", match="time runs backwards.*--fix does so")
    before = Path("raw.csv").read_bytes()
    screen = " ".join(done("discover", "raw.csv", "-v", "blueboat", "--fix", "-o", "run").split())
    assert f"Repaired in memory, raw.csv: {SORTED}" in screen
    assert Path("raw.csv").read_bytes() == before
    findings = strict(Path("run/findings.json").read_text())
    assert findings["missing"] == ["surge_quadratic_damping"]
    assert findings["data"]["notes"][0].startswith(f"repaired in memory: {SORTED}")
    assert "repaired in memory: " in Path("run/report.html").read_text("utf-8")
    record = strict(Path("run/run.json").read_text())
    assert record["fix"] is True
    assert " --fix " in record["command"]
    assert read_run_inputs("run").reading.fix
    added = done("add", "surge_quadratic_damping", "--run", "run")
    assert "Repaired in memory, raw.csv" in added
    refused("add", "surge_quadratic_damping", "--run", "run", "--fix", match="--run takes the logs.*leave out --fix")
    refused("compare", "second.csv", "-v", "blueboat", "--model", "run", match="time runs backwards")
    words = ("compare", "second.csv", "-v", "blueboat", "--model", "run", "--fix", "--page", "page")
    assert "Repaired in memory, second.csv" in done(*words)
    assert strict(Path("page/comparison.json").read_text())["notes"][0].startswith("repaired in memory, second.csv")
    assert "repaired in memory, second.csv" in Path("page/report.html").read_text("utf-8")


def test_what_cannot_be_repaired_is_refused_and_nothing_is_written(here: Path):
    text = pd.read_csv("raw.csv")
    text.loc[text["field"] == "newton_stbd", "value"] *= -1.0
    text.to_csv("reversed.csv", index=False)
    refused("discover", "reversed.csv", "-v", "blueboat", "--fix", "-o", "never", match="newton_stbd is reversed")
    with pytest.raises(RequestError, match="a log that grows cannot be repaired"):
        next(follow_live("raw.csv", HULL, reading=Reading(fix=True)))


def test_a_log_that_is_not_refused_has_its_repair_proposed(here: Path, tmp_path: Path):
    simulate_world(HULL, HIDDEN, duration=120.0, seed=33).write(tmp_path / "late.csv")
    table = pd.read_csv(tmp_path / "late.csv")
    table.loc[table["field"] == "r", "time"] += 0.2
    table.sort_values("time", kind="stable").to_csv(tmp_path / "late.csv", index=False)
    (told,) = read_inputs(tmp_path / "late.csv", HULL).warnings
    assert told.startswith("late.csv has what a repair would put right: the gyro is 0.2")
    assert told.endswith("(--fix does so in memory, inspect --fix in a new file).")
    repaired = read_inputs(tmp_path / "late.csv", HULL, Reading(fix=True))
    assert not repaired.warnings
    assert "stamps of r moved" in repaired.repairs[0]
