"""The flattened force equation is the force equation, whatever the vehicle holds; what cancels, cancels to the bit."""

import numpy as np
import pytest

from undertow.physics.batch_rates import Flattened, Terms
from undertow.physics.effects import EFFECTS
from undertow.physics.forces import ForceEquation, relative_velocity
from undertow.physics.motion import body_to_earth
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import with_hull

CURRENT = {"current_north": 0.3, "current_east": -0.2}


def with_everything(name: str) -> Vehicle:
    """A shipped vehicle with some of every kind of effect."""
    own = with_hull(load_vehicle(name), np.random.default_rng(1))
    symbols = {p.symbol: p.step for effect in EFFECTS for p in effect.parameters if "{" not in p.symbol}
    known = {symbol: own.value(symbol) + step for symbol, step in symbols.items() if symbol in own.values}
    return own.with_values(known | CURRENT)


@pytest.mark.parametrize("name", ["blueboat", "otter", "cybership2"])
@pytest.mark.parametrize("windy", [False, True])
def test_it_gives_what_the_force_equation_gives(name: str, windy: bool) -> None:
    vehicle = with_everything(name)
    rng = np.random.default_rng(5)
    x = rng.normal(size=(8, 20))
    thrust, load = (rng.normal(size=(len(vehicle.thrusters), 1, 20)) for _ in range(2))
    wind = rng.normal(size=(2, 20)) if windy else None
    terms = Terms(vehicle)
    flat = Flattened([(terms, 20)])
    minutes = rng.uniform(0.0, 8.0, 20)
    found = flat(x, (terms.accelerations(thrust)[:, 0], terms.accelerations(load)[:, 0], wind, minutes))
    equation, velocity = ForceEquation(vehicle), (x[3], x[4], x[5])
    relative = relative_velocity(vehicle, x[2], velocity, minutes)
    air = None if wind is None else (wind[0], wind[1])
    force = equation.force(relative, x[2], thrust[:, 0], load[:, 0], (x[6], x[7]), air, minutes)
    expected = equation.acceleration(force, relative, velocity, x[2])
    np.testing.assert_allclose(found[3:6], expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found[:2], body_to_earth(x[2], x[3], x[4]), rtol=1e-12)
    constant = vehicle.values["memory_time"]
    np.testing.assert_allclose(found[6:8], [(relative[1] - x[6]) / constant, (x[5] - x[7]) / constant], rtol=1e-12)


def test_two_thrusters_that_push_alike_turn_nobody() -> None:
    vehicle = load_vehicle("blueboat")
    rng = np.random.default_rng(6)
    push = np.repeat(rng.normal(size=(1, 1, 9)), 2, axis=0)
    terms = Terms(vehicle)
    flat = Flattened([(terms, 9)])
    x = np.zeros((8, 9))
    x[3] = rng.normal(size=9)
    assert not flat(x, (terms.accelerations(push)[:, 0], None, None, 0.0))[4:6].any()
