"""What stands in the corrected model: what is named, and what predicts better beside it, where rollouts judge."""

import pytest

from undertow.discovery import run_models
from undertow.discovery.balance.shooting import Shooting, ShootingSettings
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.run_models import add_subthreshold
from undertow.discovery.search.floating import Search, SearchSettings, State
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
DRAG, EXPONENT, LIFT = "surge_quadratic_damping", "thrust_exponent", "sway_lift"
HIDDEN = {"X_uu": (HULL.value("X_uu") - 12.0,), "thrust_exponent": (0.8,)}


@pytest.fixture(scope="module")
def search() -> Search:
    motion = simulate_world(HULL, HIDDEN, duration=120.0, noise="field", seed=4).motion(0.05)
    return Search(Shooting([motion], HULL), HULL, candidates(HULL), SearchSettings())


@pytest.fixture(scope="module")
def drag(search: Search) -> State:
    return search.evaluate(HULL, (DRAG,))


def test_what_predicts_better_joins_what_is_named(search: Search, drag: State):
    more = add_subthreshold(search, drag, (EXPONENT,), ShootingSettings())
    assert set(search.named(more.active)) == {DRAG, EXPONENT}
    assert more.score < drag.score
    assert more.vehicle.value("thrust_exponent") == pytest.approx(0.8, abs=0.03)


def test_what_earns_nothing_does_not(search: Search, drag: State):
    both = search.evaluate(drag.vehicle, (DRAG, EXPONENT))
    assert add_subthreshold(search, both, (LIFT,), ShootingSettings()) is both


def test_one_that_earns_nothing_does_not_keep_another_out(search: Search, drag: State):
    more = add_subthreshold(search, drag, (LIFT, EXPONENT), ShootingSettings())
    assert set(search.named(more.active)) == {DRAG, EXPONENT}


def test_what_ends_at_a_limit_does_not_join(search: Search, drag: State, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(run_models, "at_limit", lambda candidate, nominal, vehicle: candidate.key == EXPONENT)
    assert add_subthreshold(search, drag, (EXPONENT,), ShootingSettings()) is drag


def test_nothing_joins_a_model_in_which_nothing_is_named(search: Search):
    nothing = search.evaluate(HULL, ())
    assert add_subthreshold(search, nothing, (EXPONENT,), ShootingSettings()) is nothing
