"""Where models fail in simulated worlds: places, times, links that are computed, and silence where all is noise."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from undertow.comparison.failing import failures as attribution
from undertow.comparison.failing.failures import Along, Structure, contributions, judged_rows, where_they_fail
from undertow.comparison.failing.rows import scene
from undertow.discovery.findings import FailingPlace
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.forces import modelled_acceleration
from undertow.physics.thrusters import TableCurve
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.series import SeriesTable, series
from undertow.workflows.inputs import read_inputs

HULL = load_vehicle("blueboat")
TWO = {"munk_moment": -20.0, "surge_quadratic_damping": -10.0}


def world(folder: Path, effects: dict[str, Any], seed: int, noise: str = "field", programme: str = "rich") -> Inputs:
    log = simulate_world(HULL, effects, duration=240.0, seed=seed, noise=noise, programme=programme)
    return read_inputs(log.write(folder / f"{seed}.csv"), HULL)


Found = tuple[tuple[FailingPlace, ...], tuple[Structure, ...]]
"""What `where_they_fail` finds: the places, and the structure of the errors."""


def told(inputs: Inputs, after: Vehicle, judge: str = "test") -> tuple[Found, SeriesTable]:
    """Where the nominal and another vehicle fail, and the series of both."""
    models = VehicleModel(inputs.vehicle, "nominal"), VehicleModel(after, "corrected", "symbolic")
    table = series(*models, inputs.parts, inputs.channels)
    return where_they_fail(table, *models, parts(inputs), judge), table


def parts(inputs: Inputs):
    return [inputs.parts.data(part) for part in ("train", "validation", "test")]


def own(found: Found, model: str) -> list[FailingPlace]:
    return [place for place in found[0] if place.model == model]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("worlds")


@pytest.fixture(scope="module")
def two(folder: Path) -> Inputs:
    return world(folder, TWO, 21)


@pytest.fixture(scope="module")
def told_of_two(two: Inputs) -> tuple[Found, SeriesTable]:
    return told(two, apply_effects(HULL, TWO))


@pytest.mark.parametrize("programme", ["rich", "gentle", "zigzag"])
@pytest.mark.parametrize("noise", ["field", "rough"])
def test_no_failure_of_a_perfect_model_is_told_from_noise(folder: Path, programme: str, noise: str):
    inputs = world(folder, {}, 40 + len(programme) + len(noise), noise, programme)
    found, _ = told(inputs, HULL)
    assert found[0] == ()
    assert found[1][0].segments == ()
    assert {one.verdict for one in found[1][0].lag.values()} <= {"in step", "this log cannot tell"}
    for look, verdicts in (("heading", {"depends on heading"}), ("drift", {"drifts", "grows", "shrinks"})):
        assert {one.verdict for one in getattr(found[1][0], look).values()}.isdisjoint(verdicts)
    assert all(not one.suspects for one in found[1][0].lag.values())
    assert {one.verdict for one in found[1][0].frequency.values()} <= {"like noise", "negligible"}


def test_a_model_that_only_shares_the_vehicle_fails_where_it_fails_itself(two: Inputs, told_of_two):
    """A network and a function bear the nominal vehicle, and are not that model."""
    true = VehicleModel(apply_effects(HULL, TWO), "true", "symbolic")
    other = VehicleModel(true.vehicle, "function", "hybrid")
    other.vehicle = HULL
    table = series(VehicleModel(HULL, "nominal"), true, two.parts, two.channels)
    places, structure = where_they_fail(table, VehicleModel(HULL, "nominal"), other, parts(two), "test", link=False)
    assert not own((places, structure), "function")
    assert structure[1].frequency == told_of_two[0][1][1].frequency
    assert structure[1].frequency != structure[0].frequency


def test_each_failure_is_linked_to_the_effect_that_is_hidden_on_its_axis(told_of_two):
    found, _ = told_of_two
    places = own(found, "nominal")
    assert {place.axis for place in places} >= {"surge", "yaw"}
    for place in places:
        wanted = {"surge": "surge_quadratic_damping", "yaw": "munk_moment"}.get(place.axis)
        if wanted is not None and place.removed_by:
            assert [one.effect for one in place.removed_by] == [wanted]
            assert place.removed_by[0].share_removed > 0.9
            assert place.rmse is not None
            assert place.rmse_after is not None
            assert place.rmse_after < 0.4 * place.rmse
    assert any(place.removed_by for place in places)
    assert own(found, "corrected") == []


def test_a_link_says_what_changes_and_by_how_much(told_of_two):
    links = [one for place in told_of_two[0][0] for one in place.removed_by]
    sentence = next(one.sentence for one in links if one.effect == "munk_moment")
    assert sentence.startswith("Munk moment (N_uv from 0 to -20.0 N s²/m) removes ")


def test_what_the_effects_remove_adds_up_to_what_all_remove(two: Inputs, told_of_two):
    stage = scene(told_of_two[1])
    models = VehicleModel(HULL, "nominal"), VehicleModel(apply_effects(HULL, TWO), "corrected")
    shares = contributions(*models, Along(parts(two)), stage)
    assert shares is not None
    assert set(shares.effects) == set(TWO)
    before, after = np.square(stage.error), np.square(scene(told_of_two[1], "after").error)
    told_rows = np.isfinite(before).all(axis=1)
    assert told_rows.sum() > 2300
    np.testing.assert_allclose(shares.removed.sum(axis=0)[told_rows], (before - after)[told_rows], atol=1e-5)


def test_an_effect_that_makes_the_error_worse_is_never_named(two: Inputs):
    found, _ = told(two, apply_effects(HULL, {**TWO, "yaw_linear_damping": -6.0}))
    named = {one.effect for place in found[0] for one in place.removed_by}
    assert "yaw_linear_damping" not in named


def test_no_effect_is_named_for_a_place_without_held_out_rows(two: Inputs, told_of_two):
    known = told_of_two[1].columns
    table = SeriesTable({**known, "part": np.where(known["part"] == "test", "validation", known["part"])})
    models = VehicleModel(HULL, "nominal"), VehicleModel(apply_effects(HULL, TWO), "corrected")
    found = where_they_fail(table, *models, parts(two), "all")
    assert own(found, "nominal")
    assert all(not place.removed_by for place in found[0])


def test_no_effect_is_named_where_nobody_added_one(two: Inputs, told_of_two):
    models = VehicleModel(HULL, "nominal"), VehicleModel(apply_effects(HULL, TWO), "calibrated")
    found = where_they_fail(told_of_two[1], *models, parts(two), "test", link=False)
    assert own(found, "nominal")
    assert all(not place.removed_by for place in found[0])


def test_a_vehicle_with_another_thrust_curve_is_not_explained_by_parameters(two: Inputs, told_of_two):
    other = apply_effects(HULL, TWO)
    old = other.thrusters[0].curve
    assert isinstance(old, TableCurve)
    curve = old.model_copy(update={"force": tuple(0.8 * f for f in old.force)})
    changed = other.model_copy(update={"thrusters": [t.model_copy(update={"curve": curve}) for t in other.thrusters]})
    models = VehicleModel(HULL, "nominal"), VehicleModel(changed, "another")
    assert contributions(*models, Along(parts(two)), scene(told_of_two[1])) is None


def test_the_worst_seconds_are_told_with_what_the_boat_was_doing(told_of_two):
    found, table = told_of_two
    segments = found[1][0].segments
    assert 1 <= len(segments) <= 5
    for one in segments:
        rows = table.rows((table["time"] >= one.begin) & (table["time"] <= one.end))
        error = rows[{"surge": "u_dot", "sway": "v_dot", "yaw": "r_dot"}[one.axis] + "_before"]
        error = error - rows[{"surge": "u_dot", "sway": "v_dot", "yaw": "r_dot"}[one.axis]]
        assert one.rmse == pytest.approx(float(np.sqrt((error**2).mean())), rel=0.05)
        assert one.rmse_after is not None
        assert one.rmse_after < one.rmse
        assert ("turning" in one.doing) == (abs(np.median(rows["r"])) > 0.1)


def test_a_missing_force_is_slow_and_what_is_left_of_it_is_noise(told_of_two):
    before, after = (one.frequency for one in told_of_two[0][1])
    assert before["yaw"].verdict == "slow force"
    assert before["yaw"].below_hz < 0.4
    assert "a slow force is missing, not noise" in before["yaw"].sentence
    assert after["yaw"].verdict == "like noise"
    assert len(before["yaw"].hz) == len(before["yaw"].error) == len(before["yaw"].coherence)


def test_a_current_is_seen_to_turn_with_the_heading_and_where_it_sets(folder: Path):
    found, _ = told(world(folder, {"steady_current": [0.2, 0.15]}, 4), HULL)
    heading = found[1][0].heading
    for axis in ("surge", "sway"):
        assert heading[axis].verdict == "depends on heading"
        assert heading[axis].suspects == ("steady_current", "mean_wind")
        harmonic = heading[axis].harmonic
        assert harmonic is not None
        assert harmonic.direction == pytest.approx(np.degrees(np.arctan2(0.15, 0.2)), abs=15.0)
        low, high = harmonic.ci95
        assert low <= harmonic.amplitude <= high


@pytest.mark.parametrize("effect", ["thruster_lag", "input_delay"])
def test_a_late_boat_is_timed(folder: Path, effect: str):
    found, _ = told(world(folder, {effect: 0.4}, 5), HULL)
    for axis in ("surge", "yaw"):
        lag = found[1][0].lag[axis]
        assert lag.verdict == "early"
        assert lag.seconds == pytest.approx(0.4, abs=0.06)
        assert lag.seconds is not None
        assert lag.ci95 is not None
        assert lag.ci95[0] <= lag.seconds <= lag.ci95[1]
        assert lag.suspects == ("thruster_lag", "input_delay")


def test_a_missing_drag_is_no_lag_and_no_heading(told_of_two):
    first = told_of_two[0][1][0]
    assert [one.verdict for one in first.lag.values() if one.seconds is not None].count("early") == 0
    assert {one.verdict for one in first.heading.values()} == {"does not"}


def test_each_model_between_two_is_asked_once_along_the_log(two: Inputs, told_of_two, monkeypatch: pytest.MonkeyPatch):
    models = VehicleModel(HULL, "nominal"), VehicleModel(apply_effects(HULL, TWO), "corrected")
    asked = []
    monkeypatch.setattr(
        attribution, "modelled_acceleration", lambda *words: asked.append(1) or modelled_acceleration(*words)
    )
    where_they_fail(told_of_two[1], *models, parts(two), "test")
    between = 2 ** len(TWO)
    assert len(asked) == (between + 2) * len(parts(two)), "two more to see that the effects make the last model"


def test_rows_that_judge_are_the_part_unless_it_is_too_short(told_of_two):
    table = told_of_two[1]
    assert judged_rows(table, "test")[1] == "all"  # 36 s
    rows, name = judged_rows(table, "train")
    assert name == "train"
    assert (table["part"][rows] == "train").all()
    assert judged_rows(table, "all")[0].all()
