"""Split without leak, filter after the cut, derivatives, features and their standardisation."""

import json
from pathlib import Path

import numpy as np
import pytest

from undertow.measurements.canonical import Channel
from undertow.measurements.log import Log
from undertow.measurements.preparation.prepare import PAPER, WEAK, DataSet, Recipe, prepare
from undertow.measurements.preparation.resampling import Standardisation, accelerations, feature_names, features, smooth
from undertow.measurements.preparation.split import split
from undertow.physics.errors import RequestError
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle

TWIN = load_vehicle("blueboat")
PORT = TWIN.model_copy(update={"thrusters": TWIN.thrusters[:1]})
NAMES = ("x", "y", "psi", "u", "v", "r", "newton_port")


def log(path="a.csv", seconds=100.0, seed=0, holes=(), change=None):
    generator = np.random.default_rng(seed)
    time = 0.1 * np.arange(round(10 * seconds) + 1, dtype=float)
    keep = np.all([(time < low) | (time > high) for low, high in holes], axis=0) if holes else np.ones(time.size, bool)
    values = 0.1 * np.cumsum(generator.normal(size=(time.size, len(NAMES))), axis=0)
    if change is not None:
        values[time > change] += 7.0
    return Log(
        Path(path),
        {name: Channel(name, time[keep], value[keep], name) for name, value in zip(NAMES, values.T, strict=True)},
    )


def motion(velocity, step=0.1):
    n = velocity.shape[0]
    time = step * np.arange(n)
    return Motion(time, np.zeros((n, 2)), 0.1 * time, velocity, np.ones((n, 1)), ("port",))


def parts(found):
    return found.train, found.validation, found.test


def test_shares_and_guard():
    train, validation, test = (part.motions[0] for part in parts(split(prepare(log(), PORT, WEAK))))
    assert (train.time[0], train.time[-1]) == pytest.approx((0.0, 69.4))
    assert (validation.time[0], validation.time[-1]) == pytest.approx((70.5, 84.4))
    assert (test.time[0], test.time[-1]) == pytest.approx((85.5, 100.0))


def test_every_log_is_in_every_part():
    found = split(prepare([log("a.csv"), log("b.csv", 60.0, 1)], PORT))
    for part in parts(found):
        assert [one.source for one in part.motions] == ["a.csv", "b.csv"]
    assert any("chronological 70/15/15 of each log, guard 1 s" in note for note in found.train.notes)


def test_gaps_do_not_shift_the_shares():
    holes = [(10.0, 30.0), (80.0, 95.0)]
    data = prepare(log(seconds=135.0, holes=holes), PORT, WEAK)
    assert len(data.motions) == 3
    found = split(data)
    assert [part.seconds / data.seconds for part in parts(found)] == pytest.approx([0.7, 0.15, 0.15], abs=0.015)
    assert len(found.train.motions) == 3
    stamps = np.concatenate([one.time for part in parts(found) for one in part.motions])
    assert (np.diff(stamps) > 0.05).all()


@pytest.mark.parametrize("recipe", [PAPER, WEAK])
def test_what_happens_later_cannot_reach_an_earlier_part(recipe):
    before, after = (split(prepare(log(change=change), PORT, recipe)) for change in (None, 85.2))
    for one, other in ((before.train, after.train), (before.validation, after.validation)):
        for name in ("velocity", "position", "commands", "heading"):
            np.testing.assert_array_equal(getattr(one.motions[0], name), getattr(other.motions[0], name))
    rows = min(part.test.motions[0].time.size for part in (before, after))  # the log is cut where it jumps
    assert np.abs(before.test.motions[0].velocity[-rows:] - after.test.motions[0].velocity[-rows:]).min() > 1.0
    early = split(prepare(log(change=70.2), PORT, recipe))
    np.testing.assert_array_equal(before.train.motions[0].velocity, early.train.motions[0].velocity)


def test_the_paper_filters_each_part_after_the_cut():
    found = split(prepare(log(), PORT))
    for part in parts(found):
        expected = smooth(part.raw[0], 1.2, 4)
        np.testing.assert_array_equal(part.motions[0].velocity, expected.velocity)
    whole = prepare(log(), PORT).motions[0]
    rows = found.train.motions[0].time.size
    assert np.abs(whole.velocity[:rows] - found.train.motions[0].velocity).max() > 1e-6


def test_a_part_that_stays_empty_is_refused_and_a_share_of_zero_is_not():
    data = prepare(log(seconds=20.0), PORT, Recipe(guard=6.0))
    with pytest.raises(ValueError, match=r"expected motion for the validation part \(15% of each log\), got none"):
        split(data)
    two = split(prepare(log(), PORT, Recipe(shares=(0.8, 0.0, 0.2))))
    assert two.validation.motions == ()
    assert two.train.seconds > 3 * two.test.seconds


def test_smoothing_keeps_slow_motion_and_phase_and_removes_fast_motion():
    time = 0.1 * np.arange(600)
    slow, fast = np.sin(2 * np.pi * 0.1 * time), np.sin(2 * np.pi * 4.0 * time)
    smoothed = smooth(motion(np.column_stack((slow, fast, slow + fast))), 1.2, 4).velocity
    inner = slice(30, -30)
    np.testing.assert_allclose(smoothed[inner, 0], slow[inner], atol=1e-3)
    assert np.abs(smoothed[inner, 1]).max() < 1e-3
    with pytest.raises(ValueError, match="a low-pass at 6 Hz needs a rate above 12 Hz, got 10 Hz"):
        smooth(motion(np.zeros((50, 3))), 6.0)


def test_accelerations_are_exact_for_a_parabola_and_need_two_rows():
    time = 0.1 * np.arange(50)
    velocity = np.column_stack((time**2, 3 * time, 1 + 0 * time))
    expected = np.column_stack((2 * time, 3 + 0 * time, 0 * time))
    np.testing.assert_allclose(accelerations(motion(velocity)), expected, atol=1e-12)
    assert accelerations(motion(velocity[:2])).shape == (2, 3)


def test_features_and_their_names():
    one = motion(np.ones((20, 3)))
    assert feature_names(one) == ("u", "v", "r", "cos_psi", "sin_psi", "command_port")
    values = features(one)
    np.testing.assert_allclose(values[:, 3] ** 2 + values[:, 4] ** 2, 1.0)
    assert values.shape == (20, 6)


def test_standardisation_is_fitted_on_what_it_is_given_and_written_as_json(tmp_path):
    found = split(prepare(log(), PORT))
    scaling = Standardisation.fit(found.train.motions)
    values = np.concatenate([features(one) for one in found.train.motions])
    scaled = scaling.apply(values)
    np.testing.assert_allclose(scaled.mean(axis=0), 0.0, atol=1e-10)
    np.testing.assert_allclose(scaled.std(axis=0), 1.0)
    np.testing.assert_allclose(scaling.undo(scaled), values)
    path = tmp_path / "standardisation.json"
    scaling.write(path)
    assert json.loads(path.read_text())["schema"] == "undertow.standardisation/1"
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    rows = json.loads(path.read_text())["features"]
    assert tuple(row["name"] for row in rows) == scaling.names
    np.testing.assert_array_equal([row["mean"] for row in rows], scaling.mean)
    np.testing.assert_array_equal([row["scale"] for row in rows], scaling.scale)


def test_a_constant_feature_is_only_shifted():
    scaling = Standardisation.fit([motion(np.full((30, 3), 2.0))])
    assert scaling.scale[0] == 1.0
    assert scaling.mean[0] == 2.0


def test_standardisation_needs_motions_of_one_kind():
    with pytest.raises(ValueError, match="at least one training motion"):
        Standardisation.fit([])
    one = motion(np.ones((20, 3)))
    other = Motion(one.time, one.position, one.heading, one.velocity, one.commands, ("stbd",))
    with pytest.raises(ValueError, match="differ in their features"):
        Standardisation.fit([one, other])


def test_a_data_set_made_by_hand_is_taken_as_unfiltered():
    one = motion(np.random.default_rng(0).normal(size=(600, 3)))
    found = split(DataSet((one,), (), PAPER))
    assert found.train.motions[0].velocity.std() < 0.6 * one.velocity.std()


def test_standardisation_of_columns_is_by_mean_and_deviation_and_checks_them():
    found = Standardisation.of(["a", "b"], np.array([[1.0, 5.0], [3.0, 5.0]]))
    assert (found.names, found.mean.tolist(), found.scale.tolist()) == (("a", "b"), [2.0, 5.0], [1.0, 1.0])
    with pytest.raises(RequestError, match=r"expected rows of 3 features, got shape \(2, 2\)"):
        Standardisation.of(["a", "b", "c"], np.zeros((2, 2)))
    with pytest.raises(RequestError, match=r"expected rows of 2 features, got shape \(0, 2\)"):
        Standardisation.of(["a", "b"], np.zeros((0, 2)))
    with pytest.raises(RequestError, match=r"expected finite numbers, got others in b"):
        Standardisation.of(["a", "b"], np.array([[1.0, np.nan], [2.0, 1.0]]))
