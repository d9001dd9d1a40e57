"""Columns about a model near by: little else than those about the model, and none where rounding would change more."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.base import Balance, WeakSettings
from undertow.discovery.balance.shooting import Shooting, ShootingSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.linearisation import Linearisation
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate_world(HULL, {}, duration=60.0, noise="field", seed=3).motion()


def columns(form: Balance, vehicle: Vehicle, roughly: bool) -> dict[str, np.ndarray]:
    """Every free column of what is not in a model, by symbol."""
    found = Linearisation(form, vehicle, HULL, candidates(HULL), (), roughly=roughly)
    options = [option for choice in found.options.values() for option in choice if option.present]
    return {
        f"{option.key} {option.start} {symbol}": found.columns[:, :, index]
        for option in options
        for symbol, index in zip(option.symbols, option.free, strict=True)
        if index >= 0
    }


@pytest.mark.parametrize("kind", ["forces", "rollouts"])
def test_columns_about_a_model_near_by(motion: Motion, kind: str):
    values = {"port_scale": 0.955, "current_north": 0.113, "advance_loss": 5.011, "reverse_scale": 0.749}
    vehicle = HULL.with_values(values)
    forms = [
        WeakForm([motion], WeakSettings()) if kind == "forces" else Shooting([motion], vehicle, ShootingSettings())
        for _ in range(2)
    ]
    rough, exact = (columns(form, vehicle, roughly) for form, roughly in zip(forms, (True, False), strict=True))
    assert rough.keys() == exact.keys()
    for name, column in exact.items():
        size = np.sqrt((column**2).mean())
        assert np.sqrt(((rough[name] - column) ** 2).mean()) <= 0.15 * size + 1e-9, name


def test_thrusters_of_their_own_stay_as_they_are(motion: Motion):
    port, stbd = HULL.thrusters
    odd = HULL.model_copy(update={"thrusters": (port, stbd.model_copy(update={"lag": 0.61, "dead_zone": 0.1}))})
    form = WeakForm([motion], WeakSettings())
    rough = columns(form, odd, True)
    exact = columns(form, odd, False)
    fresh = columns(WeakForm([replace(motion)], WeakSettings()), odd, False)
    for name, column in fresh.items():
        assert np.array_equal(rough[name], column), name
        assert np.array_equal(exact[name], column), name
