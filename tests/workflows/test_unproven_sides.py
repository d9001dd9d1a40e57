"""What the logs do not show of the thrusters' places is said before anything else."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from undertow.measurements.inspection import Inspection, inspect_log
from undertow.measurements.log import read_log
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.workflows.compare import _driven_alike
from undertow.workflows.inputs import UNPROVEN, likely_misplaced, refuse_broken_logs, still_unproven

HULL = load_vehicle("blueboat")
PLACES = ("direction", "sides")


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Inspection:
    """A log in which each thruster works for itself."""
    path = tmp_path_factory.mktemp("log") / "log.csv"
    return inspect_log(read_log(simulate_world(HULL, {}, duration=60.0, seed=2).write(path)), HULL)


def test_places_that_show_are_not_doubted(shown: Inspection):
    assert {f.check for f in shown.quality if f.verdict == "ok"} >= set(PLACES)
    assert refuse_broken_logs([shown], (), HULL, as_is=False) == ()


def test_places_that_do_not_show_are_the_files_word(shown: Inspection):
    hidden = [f.but(verdict="cannot tell", parts={}) if f.check in PLACES else f for f in shown.quality]
    (told,) = refuse_broken_logs([shown.but(quality=tuple(hidden))], (), HULL, as_is=False)
    assert told.startswith("Nothing in the log shows on which side its thrusters are")


def test_logs_that_show_it_together_are_believed(shown: Inspection):
    hidden = tuple(f.but(verdict="cannot tell", parts={}) if f.check in PLACES else f for f in shown.quality)
    together = [f for f in shown.quality if f.check in PLACES]
    assert refuse_broken_logs([shown.but(quality=hidden)] * 2, together, HULL, as_is=False) == ()


def test_two_faults_of_one_cure_are_told_with_it_once(shown: Inspection):
    kept = next(f for f in shown.quality if f.check == "sides")
    turned, moved = (
        kept.but(check=check, verdict="warning", sentence=short, short=short, remedy="try it: 'pwm_port: b'")
        for check, short in (("direction", "pwm_port is likely reversed"), ("sides", "port and starboard are swapped"))
    )
    (told,) = likely_misplaced([turned, moved])
    assert told == "pwm_port is likely reversed. Port and starboard are swapped, too. Try it: 'pwm_port: b'."
    assert len(likely_misplaced([turned, moved.but(remedy="look")])) == 2


def judged(surge: float, yaw: float) -> Any:
    """Errors of speeds in predictions of 2 s, as a judged model holds them."""
    return SimpleNamespace(
        errors=SimpleNamespace(rollout_scores={"2": SimpleNamespace(velocity=np.array([surge, 9.0, yaw]))})
    )


def test_a_model_that_drives_and_turns_as_the_boat_does_answers_for_the_places():
    guess, warnings = judged(1.0, 1.0), (UNPROVEN, "another")
    assert still_unproven(warnings, [judged(0.4, 0.4)], [guess]) == ("another",)
    assert still_unproven(warnings, [judged(0.4, 0.6)], [guess]) == warnings
    assert still_unproven(warnings, [], [guess]) == still_unproven(warnings, [judged(0.1, 0.1)], []) == warnings


def test_models_of_other_thrusters_answer_for_none_of_a_file():
    port, starboard = HULL.thrusters
    moved = HULL.model_copy(update={"thrusters": (port.model_copy(update={"y": 2.0 * port.y}), starboard)})
    assert _driven_alike(VehicleModel(HULL.with_values({"X_u": -3.0}), "corrected"), HULL)
    assert not _driven_alike(VehicleModel(moved, "other"), HULL)
