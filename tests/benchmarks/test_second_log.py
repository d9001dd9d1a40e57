"""`compare` tells of a second log what equations that are written down apart from it compute from `model.yaml`."""

import importlib
import json
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
import yaml
from places import ROOT, shared

from undertow.physics.motion import AXES
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.compare import compare
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.write import write_run

HULL = load_vehicle("blueboat")
HIDDEN = {"surge_quadratic_damping": -12.0}


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    """The script as a module."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("second_log")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two logs of a boat, and a run of the first."""
    folder = tmp_path_factory.mktemp("place")
    for seed, name in ((2, "first.csv"), (3, "second.csv")):
        simulate_world(HULL, HIDDEN, duration=120.0, seed=seed).write(folder / name)
    write_run(discover(read_inputs(folder / "first.csv", HULL)), folder / "run", report=False)
    return folder


def table(log: Path) -> dict[str, np.ndarray]:
    """A simulated log as a wide table of 10 Hz, with the commands that were in force half way to the next row."""
    long = pd.read_csv(log)
    fields = dict(iter(long.groupby("field")))
    stamps = fields["u"]["time"].to_numpy()
    time = np.arange(stamps[0], stamps[-1], 0.1)
    found = {"t": time}
    for name, group in fields.items():
        if str(name).startswith("newton"):
            last = np.searchsorted(group["time"].to_numpy(), time + 0.05) - 1
            found[str(name)] = group["value"].to_numpy()[np.clip(last, 0, None)]
        else:
            found[str(name)] = np.interp(time, group["time"], group["value"])
    return found


def plain(vehicle: Vehicle, folder: Path) -> dict[str, object]:
    """A vehicle as its file has it, without what the script does not know and does not need."""
    vehicle.save(folder / "plain.yaml")
    return {k: v for k, v in yaml.safe_load((folder / "plain.yaml").read_text()).items() if k != "about"}


def test_the_verdict_is_that_of_the_errors_over_the_whole_log(study: ModuleType, place: Path, tmp_path: Path):
    found = compare(read_inputs(place / "second.csv", HULL), [place / "run"])
    corrected = plain(load_vehicle(place / "run" / "model.yaml"), tmp_path)
    second = table(place / "second.csv")
    track, noise = study.smooth(second), study.noise(second)
    before, after = (study.beyond(study.squares(one, track), noise) for one in (plain(HULL, tmp_path), corrected))
    own = study.saved(before, after)
    assert study.told(found, "run") == pytest.approx(own, abs=study.POINTS)
    assert found.noise is not None
    assert [found.noise.of(axis) ** 2 for axis in AXES] == pytest.approx(noise.tolist(), rel=0.05)
    assert own > 0.2
    assert found.best.sentence.startswith("Trust run: in the speeds predicted over 10 s it errs")


def test_what_the_script_cannot_compute_is_refused(study: ModuleType, tmp_path: Path):
    with pytest.raises(study.BeyondError, match="lag"):
        study.check(plain(HULL.with_values({"lag": 0.3}), tmp_path))


@pytest.mark.parametrize("effects", [{"yaw_trim": 1.0, "delay": 0.25}, {"N_uv": 15.0, "reverse_scale": 0.7}])
def test_the_true_vehicle_predicts_the_true_track(study: ModuleType, tmp_path: Path, effects: dict[str, float]):
    world = simulate_world(HULL, effects, duration=60.0, seed=5)
    track = study.true_track(world)
    wrong, right = (study.squares(plain(one, tmp_path), track, track) for one in (HULL, world.vehicle))
    assert study.saved(wrong, right) > 0.97
    assert (right < 0.01**2).all()


def test_pairs_that_are_kept_are_not_made_again(
    study: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    kept = tmp_path / "kept.jsonl"
    pair = {"number": 0, "hidden": ["yaw_trim"], "told": 0.5, "true": 0.54}
    kept.write_text(json.dumps(pair) + "\n", encoding="utf-8")
    worse = {"told": 0.5, "true": -1.0, "hidden": ["munk_moment"]}
    monkeypatch.setattr(study, "simulated_pair", lambda number, folder: worse | {"number": number})
    assert not study.simulated(2, kept)
    assert len(kept.read_text("utf-8").splitlines()) == 2
    assert capsys.readouterr().out.splitlines() == [
        "0 yaw_trim: compare 50.0 %, true 54.0 %",
        "1 munk_moment: compare 50.0 %, true -100.0 % DISAGREE",
        "1 of 2 pairs agree in sign and within 5 points.",
    ]


@pytest.mark.parametrize("raw", [False, True])
def test_two_field_logs_of_a_real_boat(raw: bool, study: ModuleType, capsys: pytest.CaptureFixture[str]):
    """Cleaned logs with a vehicle file, and raw ones with what init makes of the first."""
    logs = shared("blueboat")
    assert study.main(logs, ("235",), ("220", "223"), raw=raw)
    assert capsys.readouterr().out.count("compare on all") == 2
