"""An effect that sets in during a log is found to change, one that is there all the time is not."""

import numpy as np
import pytest
from dragged_world import Pushed

from undertow.discovery import discover
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.evidence.invariance import find_changing_forces
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import SearchSettings
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import NOISE, World

HULL = load_vehicle("blueboat")
HIDDEN = {
    "surge_quadratic_damping": {"X_uu": -20.0},
    "yaw_linear_damping": {"N_r": -12.0},
    "thruster_asymmetry[port]": {"port_scale": 0.85},
    "sway_trim": {"sway_trim": 6.0},
}


def log_of(name: str, noise: str, sets_in: float | None, programme: str = "rich") -> Motion:
    """A log of 200 s of a boat with an effect, all the time or from an instant on."""
    other = apply_effects(HULL, HIDDEN[name])
    begun = World(HULL, programme, 200.0, 3, becomes=other, changes_at=sets_in or 0.0)
    return (begun if sets_in else World(other, programme, 200.0, 3)).run(NOISE[noise]).motion()


def changes(motions: list[Motion], *names: str) -> dict[str, str]:
    """Where each effect differs in a part of the logs, and by how much."""
    pool = [c for c in candidates(HULL) if c.key in names]
    search = Search(WeakForm(motions, WeakSettings()), HULL, pool, SearchSettings())
    return find_changing_forces(search, search.evaluate(HULL, names), names, 0)


def percent(told: str) -> float:
    """By how much an effect is said to differ."""
    return float(told.partition(" %")[0].split()[-1])


@pytest.mark.parametrize("noise", ["clean", "field", "rough"])
@pytest.mark.parametrize("name", HIDDEN)
def test_what_is_there_all_the_time_has_one_size(name: str, noise: str):
    assert changes([log_of(name, noise, None)], name) == {}


@pytest.mark.parametrize("noise", ["clean", "field", "rough"])
@pytest.mark.parametrize(("sets_in", "told"), [(60.0, "From minute 1.0 on it is "), (140.0, "From minute 2.")])
@pytest.mark.parametrize("name", HIDDEN)
def test_what_sets_in_changes(name: str, sets_in: float, told: str, noise: str):
    said = changes([log_of(name, noise, sets_in)], name)
    assert set(said) == {name}
    assert said[name].startswith(told)
    assert said[name].endswith(" % more than elsewhere.")
    assert percent(said[name]) >= 90.0, "what sets in is, on the mean, less than it is then"


def test_what_acts_on_one_side_of_the_water_changes_there():
    shallow = Pushed(
        HULL, "rich", 240.0, 4, push=lambda t, x, c: np.array([-12.0 * x[3] * abs(x[3]), 0.0, 0.0]) * (x[0] > 5.0)
    )
    said = changes([shallow.run(NOISE["field"]).motion()], "surge_quadratic_damping")
    assert said["surge_quadratic_damping"].startswith("North of ")


def test_a_tether_is_no_wind():
    """What pulls to a post grows with the way from there: a force that is fixed in the earth, but not everywhere."""

    def pull(t: float, x: np.ndarray, c: np.ndarray) -> np.ndarray:
        north, east = 0.3 * (np.array([10.0, -10.0]) - x[:2])
        cos, sin = np.cos(x[2]), np.sin(x[2])
        return np.array([cos * north + sin * east, cos * east - sin * north, 0.0])

    tied = Pushed(HULL, "rich", 240.0, 6, push=pull).run(NOISE["field"]).motion()
    assert " m it is " in changes([tied], "mean_wind")["mean_wind"]


@pytest.mark.parametrize("programme", ["zigzag", "gentle"])
def test_what_repeats_itself_is_no_noise(programme: str):
    """Thrust that comes and goes in a zigzag leaves a rest of its own colour where it changes."""
    port = "thruster_asymmetry[port]"
    assert set(changes([log_of(port, "field", 120.0, programme)], port)) == {port}


def test_beside_what_changes_another_keeps_its_size():
    names = ("surge_quadratic_damping", "thruster_asymmetry[port]")
    both = apply_effects(HULL, HIDDEN[names[0]])
    world = World(both, "rich", 200.0, 3, becomes=apply_effects(both, HIDDEN[names[1]]), changes_at=90.0)
    said = changes([world.run(NOISE["field"]).motion()], *names)
    assert percent(said[names[1]]) > 100.0
    assert percent(said.get(names[0], "0 %")) < 30.0, "what the other's change is not all of"


def test_of_several_logs_the_part_is_told():
    port = "thruster_asymmetry[port]"
    logs = [World(HULL, "rich", 200.0, 4).run(NOISE["field"]).motion(), log_of(port, "field", None)]
    assert changes(logs, port)[port].startswith("From part 13 of 24 of the logs on")


def test_what_is_too_small_all_over_and_cannot_move_does_not_change():
    """A dead zone moves the thrust in steps: no column says how much of it is missing."""
    hidden = apply_effects(HULL, {"dead_zone": 0.22})
    log = World(hidden, "rich", 200.0, 3).run(NOISE["field"]).motion()
    assert changes([log], "thrust_dead_zone") == {}


def test_a_change_is_told_of_a_name_that_is_said(monkeypatch: pytest.MonkeyPatch):
    port, motion = "thruster_asymmetry[port]", log_of("thruster_asymmetry[port]", "field", None)
    monkeypatch.setattr(
        discover, "find_changing_forces", lambda *_: {port: "From minute 1.0 on it is 90 % more than elsewhere."}
    )
    found = next(c for c in discover.find_missing([motion], HULL).findings.candidates if c.key == port)
    assert found.verdict == "missing"
    assert "From minute 1.0 on it is 90 % more than elsewhere." in found.sentence
