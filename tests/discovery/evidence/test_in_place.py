"""One form in the place of an effect: stand-ins are beaten by what acts, effects that act by nothing."""

import numpy as np
import pytest
from dragged_world import Push, Pushed

from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.unnamed_terms import free_forms
from undertow.discovery.evidence.unmodelled_forces import FormColumns, ResidualSelection, Substitute, substitute_forces
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import TELL_APART, SearchSettings
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import NOISE, simulate_world

HULL = load_vehicle("blueboat")
SEEN = np.ones(3, dtype=bool)


def substitutes(motion: Motion, *names: str) -> dict[str, Substitute]:
    """The best form in the place of effects that are fitted on the force balance, by their names."""
    pool = [c for c in candidates(HULL) if c.key in names]
    weak = WeakForm([motion], WeakSettings())
    search = Search(weak, HULL, pool, SearchSettings())
    state = search.evaluate(HULL, names)
    columns = FormColumns(search, state, SEEN, free_forms(weak, state.vehicle))
    found = {c.key: substitute_forces(columns, ResidualSelection(columns), c) for c in pool}
    return {key: one for key, one in found.items() if one is not None}


def told(motion: Motion, *names: str) -> dict[str, str]:
    """Which form explains more in the place of effects, by their names; those in whose place none does, not."""
    found = substitutes(motion, *names)
    return {key: one.form.in_words for key, one in found.items() if one.margin > TELL_APART}


def log_of(push: Push, noise: str = "field", programme: str = "rich") -> Motion:
    return Pushed(HULL, programme, 240.0, 4, push=push).run(NOISE[noise]).motion()


def disturbed(t: float, x: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Two propellers that take each other's water."""
    return np.array([-20.0 * c.prod(), 0.0, 0.0])


def skin_friction(t: float, x: np.ndarray, c: np.ndarray) -> np.ndarray:
    return np.array([0.0, 0.0, -12.0]) * x[4] * abs(x[4]) ** 0.5


@pytest.mark.parametrize("noise", ["clean", "field", "rough"])
def test_one_form_that_acts_beats_a_stand_in(noise: str):
    said = told(log_of(disturbed, noise, "gentle"), "surge_quadratic_damping")
    assert "the thrust of port times the thrust of stbd" in said["surge_quadratic_damping"]


def test_what_explains_more_in_the_place_of_a_stand_in_explains_less_in_that_of_a_cause():
    """The margin is the log-likelihood by which a form is better: above what tells two apart, and below it."""
    name = "surge_quadratic_damping"
    stand_in = substitutes(log_of(disturbed, programme="gentle"), name)[name]
    true = simulate_world(HULL, {name: -20.0}, duration=240.0, noise="field", seed=5).motion()
    cause = substitutes(true, name)[name]
    assert stand_in.margin > TELL_APART > 0.0 > cause.margin


def test_a_power_between_two_laws_beats_either():
    assert "v|v|^0.5" in told(log_of(skin_friction, "clean"), "sway_yaw_coupling")["sway_yaw_coupling"]


@pytest.mark.parametrize("noise", ["field", "rough"])
@pytest.mark.parametrize(
    "hidden",
    [
        {"surge_quadratic_damping": -20.0, "thrust_scale": 0.8},
        {"surge_turn_drag": 20.0, "surge_trim": 4.0},
        {"sway_quadratic_damping": -60.0, "sway_yaw_coupling": -6.0},
        {"thruster_arm": 1.2, "yaw_linear_damping": -3.0},
        {"mean_wind": 3.0, "sway_lift": -8.0},
    ],
    ids=lambda hidden: " and ".join(hidden),
)
def test_nothing_does_in_the_place_of_what_acts(hidden: dict[str, float], noise: str):
    motion = simulate_world(HULL, hidden, duration=240.0, noise=noise, seed=5).motion()
    assert told(motion, *hidden) == {}


def test_a_loss_by_the_command_beside_drag_is_what_it_is():
    world = simulate_world(
        HULL, {"advance_loss": 6.0, "X_u": HULL.value("X_u") - 4.0}, duration=240.0, noise="field", seed=4
    )
    assert told(world.motion(), "advance_loss", "surge_linear_damping") == {}
