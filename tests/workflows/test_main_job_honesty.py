"""What the main job says when it should hold back: wrong axes, effects that are not there, force left over."""

from pathlib import Path

import pytest

from undertow.measurements.prepared_logs import Inputs
from undertow.physics.errors import LogError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.compare import compare
from undertow.workflows.discover_and_add import add, discover
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.write import write_run

HULL = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of 120 s with hidden quadratic surge drag."""
    log = simulate_world(HULL, {"surge_quadratic_damping": -6.0}, duration=120.0, seed=31)
    return log.write(tmp_path_factory.mktemp("log") / "log.csv")


@pytest.fixture(scope="module")
def inputs(path: Path) -> Inputs:
    return read_inputs(path, HULL)


def turned(path: Path, field: str) -> Path:
    """The log with one odometry channel of the wrong sign."""
    lines = [line.split(",") for line in path.read_text().splitlines()]
    text = "\n".join(",".join([*x[:3], str(-float(x[3]))] if x[2] == field else x) for x in lines)
    target = path.with_name(f"{field}.csv")
    target.write_text(text)
    return target


@pytest.mark.parametrize("field", ["v", "r"])
def test_a_channel_of_the_wrong_sign_is_refused_before_anything_is_named(path: Path, field: str):
    with pytest.raises(
        LogError, match=r"opposite sign.*Say Reading\(frame=\"enu\"\) if the log is ENU/FLU, or turn the channel"
    ):
        read_inputs(turned(path, field), HULL)


def test_adding_what_is_not_there_does_not_call_it_missing(inputs: Inputs):
    findings = add(["yaw_trim", "surge_quadratic_damping"], inputs).findings
    verdicts = {c.effect: c.verdict for c in findings.candidates}
    assert verdicts == {"surge_quadratic_damping": "missing", "yaw_trim": "possible"}
    assert findings.missing == ("surge_quadratic_damping",)
    assert findings.headline == "Added by name: yaw trim and surge quadratic damping; not certain: yaw trim."
    assert {c.effect for c in findings.added} == set(verdicts), "both stand in the model, certain or not"


def test_what_stays_unexplained_is_said(inputs: Inputs):
    explained = discover(inputs).findings.data
    assert not any("unexplained" in note for note in explained.notes)
    assert explained.unexplained["surge"].force < 2.0 * explained.unexplained["surge"].noise
    alone = add(["yaw_trim"], inputs).findings
    assert (alone.headline, alone.reasons) == ("Added by name: yaw trim; not certain: yaw trim.", ())
    left = alone.data
    assert any(note.startswith("surge: ") and "stay unexplained" in note for note in left.notes)


def test_a_run_is_compared_with_the_numbers_it_fitted(inputs: Inputs, tmp_path: Path):
    run = discover(inputs)
    write_run(run, tmp_path / "run", report=False)
    models = {model.name: model for model in compare(inputs, [tmp_path / "run"]).models}
    assert (models["nominal"].parameters, models["run"].parameters) == (0, 1)
