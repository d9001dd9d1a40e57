"""What the logs do not show of the thrusters' places is said before anything else."""

import pytest

from undertow.measurements.inspection import Inspection, inspect_log
from undertow.measurements.log import read_log
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import likely_misplaced, refuse_broken_logs

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
