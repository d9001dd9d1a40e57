"""Newtons become the commands that give them, whatever the curves are."""

import numpy as np
import pytest
from exported import BOATS, boat

from undertow.physics.forces import ForceEquation, held_acceleration
from undertow.physics.vehicle import load_vehicle
from undertow.steering.known_model import in_newtons, thrust_inverse


@pytest.mark.parametrize("name", BOATS)
def test_commands_give_the_forces_asked_for(name: str):
    inverse = thrust_inverse(boat(name))
    rng = np.random.default_rng(2)
    full = np.maximum(-inverse.lower, inverse.upper)
    for _ in range(50):
        asked = rng.uniform(inverse.lower, inverse.upper)
        given = inverse.at_rest(inverse.command(asked, 2.0), 2.0)
        reachable = inverse.at_rest(inverse.command(1e3 * np.sign(asked), 2.0), 2.0)
        wanted = np.where(np.abs(asked) > np.abs(reachable), reachable, asked)
        # Within the step of the table; a dead zone makes a jump, which is met at its nearer side or in between.
        jump = 0.15 if boat(name).thrusters[0].dead_zone else 0.01
        assert (np.abs(given - wanted) <= jump * full).all()


def test_no_force_is_the_middle_of_the_dead_zone():
    dead = load_vehicle("blueboat").with_values({"dead_zone": 0.2})
    np.testing.assert_allclose(thrust_inverse(dead).command(np.zeros(2)), 0.0, atol=1e-9)


def test_what_is_lost_under_way_is_added():
    boat_with_loss = load_vehicle("blueboat").with_values({"advance_loss": 4.0})
    inverse = thrust_inverse(boat_with_loss)
    command = inverse.command(np.array([10.0, 10.0]), advance=1.0)
    # T - 4 (T / 35) 1 = 10
    np.testing.assert_allclose(command, 10.0 / (1.0 - 4.0 / 35.0), rtol=1e-3)


def test_a_vehicle_in_newtons_moves_as_its_own_curves_make_it_move():
    own = load_vehicle("otter").with_values({"thrust_exponent": 1.4, "dead_zone": 0.1, "thrust_scale": 0.8})
    straight, inverse = in_newtons(own), thrust_inverse(own)
    velocity, heading = np.array([[0.5, 0.1, -0.1]]), np.zeros(1)
    commands = np.array([[60.0, -40.0]])
    forces = inverse.at_rest(commands[0])[None]
    expected = held_acceleration(own, velocity, heading, commands)
    np.testing.assert_allclose(held_acceleration(straight, velocity, heading, forces), expected, rtol=1e-9)
    assert ForceEquation(straight).vehicle.values["thrust_exponent"] == 1.0
