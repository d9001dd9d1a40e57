"""The trials: their words say what their steps do, and every vehicle can rehearse them."""

import numpy as np
import pytest

from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.manoeuvres import TRIALS, Trial, drive, programme, thruster_commands

HULL = load_vehicle("blueboat")
EVERY_TRIAL = pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.name)


@EVERY_TRIAL
def test_the_words_of_a_trial_name_its_levels(trial: Trial):
    levels = {f"{100 * max(abs(common), abs(turn)):.0f}" for _, common, turn in trial.steps if common or turn}
    if trial.name == "one_side":  # half to both, half between the two, is all to one
        levels = {f"{100 * (abs(common) + abs(turn)):.0f}" for _, common, turn in trial.steps}
    said = trial.words.replace("full ahead", "100").replace("full astern", "100").replace("full to", "100 to")
    assert all(level in said for level in levels)
    assert trial.text.endswith(f"({trial.seconds:.0f} s in all)")
    assert 36.0 <= trial.seconds <= 60.0


def test_trial_names_differ():
    assert len({trial.name for trial in TRIALS}) == len({trial.text for trial in TRIALS}) == len(TRIALS)


@pytest.mark.parametrize("name", ["blueboat", "otter", "cybership2"])
def test_trials_run_on_every_vehicle_and_start_from_rest(name: str):
    vehicle = load_vehicle(name)
    for trial, runs in zip(TRIALS, drive(vehicle, heading=0.3), strict=True):
        assert [float(run.heading[0]) for run in runs] == pytest.approx([0.3 + turn for turn in trial.headings])
        assert sum(run.duration for run in runs) == pytest.approx(trial.seconds)
        assert all(not run.velocity[0].any() and run.velocity.any() for run in runs)


def test_trials_in_a_batch_move_as_each_alone():
    together = drive(HULL)
    for k in (0, 5):
        alone = drive(HULL, TRIALS[k : k + 1])[0][0]
        np.testing.assert_allclose(together[k][0].velocity, alone.velocity, atol=1e-6)


def test_a_run_that_diverges_is_left_out():
    driven = HULL.with_values({"X_u": 60.0, "X_uu": 0.0})
    assert drive(driven, TRIALS[:1]) == ((),)


def test_programmes_and_trials_mix_commands_alike():
    common, turn = np.array([0.5, 0.5]), np.array([0.2, 0.0])
    port, starboard = thruster_commands(HULL, common, turn).T
    assert port[0] > starboard[0]
    assert port[1] == starboard[1]
    assert programme(HULL, duration=10.0).shape == (101, 2)
