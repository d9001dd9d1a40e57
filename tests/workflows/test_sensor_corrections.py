"""Corrections of the sensors taken out and made again: the same effects are then fitted anew to the other log."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.candidates.candidate import Kind
from undertow.discovery.sensor_error_search import ARM, COMPASS, HiddenErrors
from undertow.measurements.log_options import Reading
from undertow.physics.effects import COMMAND_OFFSET
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import read_inputs
from undertow.workflows.log_view import LogView
from undertow.workflows.workbench import Workbench
from undertow.workflows.workbench_facts import OWN_NUMBERS, ModelChoice, Searched

HULL = load_vehicle("blueboat")
DRAG = "surge_quadratic_damping"
GYRO = "gyro_scale"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A boat with more drag than its file has, and a gyro that shows 0.95 of the turning."""
    path = tmp_path_factory.mktemp("log") / "log.csv"
    simulate_world(HULL, {DRAG: -8.0}, duration=200.0, noise="clean", seed=3).write(path)
    table = pd.read_csv(path, comment="#")
    table.loc[table["field"] == "r", "value"] *= 0.95
    table.to_csv(path, index=False)
    return path


@pytest.fixture(scope="module")
def bench(log: Path) -> Workbench:
    return Workbench(LogView(read_inputs(log, HULL, progress=None)))


@pytest.fixture(scope="module")
def searched(bench: Workbench) -> Searched:
    return bench.search()


@pytest.mark.parametrize("judge", [None, "test"])
def test_a_log_without_its_one_correction_is_the_log_as_it_was_recorded(log: Path, judge: str | None):
    corrected = read_inputs(log, HULL, judge=judge, progress=None)
    recorded = read_inputs(log, HULL, Reading(as_is=True), judge=judge, progress=None)
    left = corrected.leaving((GYRO,))
    for of in (lambda i: i.fitting, lambda i: i.parts.judged.motions, lambda i: i.whole().fitting):
        for one, other, before in zip(of(left), of(recorded), of(corrected), strict=True):
            np.testing.assert_array_equal(one.velocity, other.velocity)
            assert not np.allclose(before.velocity, other.velocity, atol=1e-3)
    assert corrected.leaving(()) is corrected


def test_of_several_logs_one_is_left_as_it_is(log: Path, tmp_path: Path):
    other = tmp_path / "other.csv"
    other.write_bytes(log.read_bytes())
    both = read_inputs([log, other], HULL, progress=None).whole()
    left = both.leaving(("gyro_scale[other.csv]",))
    same = [np.array_equal(a.velocity, b.velocity) for a, b in zip(both.fitting, left.fitting, strict=True)]
    assert same == [Path(motion.source).name == "log.csv" for motion in both.fitting]
    assert not all(same)


def test_effects_are_fitted_to_what_is_read(bench: Workbench, searched: Searched, log: Path):
    (card,) = (card for card in searched.sensors if card.name)
    assert (card.name, card.verdict) == (GYRO, "present")
    assert card.numbers[0].startswith("gyro_scale = 0.9500")
    assert "95 %" in card.numbers[0]
    with_it, without = (bench.fit(ModelChoice((DRAG,), left=left)) for left in ((), (GYRO,)))
    assert with_it.error["yaw"] < 0.3 * without.error["yaw"]
    recorded = Workbench(LogView(read_inputs(log, HULL, Reading(as_is=True), progress=None)))
    same = recorded.fit(ModelChoice((DRAG,)))
    assert without.error == pytest.approx(same.error, rel=1e-9)
    assert [value.after for value in without.values] == pytest.approx([value.after for value in same.values], rel=1e-9)
    np.testing.assert_allclose(bench.opened((GYRO,)).table["r"], recorded.opened().table["r"])
    assert "without the correction of gyro scale" in str(bench.vehicle(ModelChoice((DRAG,), left=(GYRO,))).sources)


def test_no_run_is_made_of_a_log_without_a_correction(bench: Workbench, searched: Searched):
    assert searched.found
    with pytest.raises(RequestError, match=r"no run is made .* \(gyro scale\); take model.yaml"):
        bench.run(ModelChoice(searched.found, left=(GYRO,)))
    assert bench.run(ModelChoice(searched.found)).findings.missing == (DRAG,)


def test_why_there_is_no_run_is_known_before_one_is_asked_for(bench: Workbench, searched: Searched, log: Path):
    for stand in (ModelChoice(searched.found), ModelChoice(), ModelChoice((DRAG, "yaw_quadratic_damping"))):
        assert bench.no_run(stand) == ""
    assert "moved by hand" in bench.no_run(ModelChoice(searched.found, (("X_uu", -3.0),)))
    assert "own numbers" in bench.no_run(ModelChoice((OWN_NUMBERS,)))
    run = bench.run(ModelChoice((OWN_NUMBERS, "sway_lift")))
    assert {step.added for step in run.findings.steps} == {None, "calibrated", "sway_lift"}
    fresh = Workbench(LogView(read_inputs(log, HULL, progress=None)))
    assert "search first, or add an effect" in fresh.no_run(ModelChoice())
    with pytest.raises(RequestError, match="search first, or add an effect"):
        fresh.run(ModelChoice())


def test_what_only_forces_show_is_left_by_its_name(bench: Workbench, log: Path):
    errors, motion = HiddenErrors(0.4, -0.3, 0.1), read_inputs(log, HULL, progress=None).fitting[0]
    for left, rest in (((ARM,), HiddenErrors(0.0, 0.0, 0.1)), ((COMPASS,), HiddenErrors(0.4, -0.3, 0.0))):
        np.testing.assert_array_equal(errors.keeping(left).corrected(motion).velocity, rest.corrected(motion).velocity)
    named = {finding.correction for finding in errors.findings}
    assert named == {ARM, COMPASS}
    assert errors.keeping(tuple(named)).findings == ()
    other = Workbench(LogView(read_inputs(log, HULL, progress=None)))
    before = other.opened()
    other.resume(Searched("undecided", "", (), (), (), hidden=(0.4, -0.3, 0.0)))
    resumed = other.opened()
    assert np.abs(resumed.table["north"] - before.table["north"]).max() == pytest.approx(0.5, abs=0.05)
    np.testing.assert_allclose(other.opened((ARM,)).table["north"], before.table["north"], atol=1e-9)


def test_the_timing_of_the_commands_is_fitted_until_it_is_left(log: Path):
    inputs = read_inputs(log, HULL, progress=None).whole()
    basis = choose_balance(inputs.fitting, HULL, DiscoverySettings())
    assert any(c.kind is Kind.SENSOR for c in basis.pool)
    left = basis.keeping_errors((COMMAND_OFFSET.symbol,))
    assert not any(c.kind is Kind.SENSOR for c in left.pool)
    assert len(left.pool) == len(basis.pool) - 1
