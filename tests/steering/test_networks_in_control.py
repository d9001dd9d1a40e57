"""A network beside the physics steers as the formula that says the same."""

import numpy as np
import pytest
import torch

from undertow.measurements.preparation.resampling import Standardisation
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import NetworkModel, scaling_of
from undertow.residuals.networks.registry import build
from undertow.steering.closed_loop import CONTROLLERS, Passage, Surroundings, drive
from undertow.steering.known_model import known_model
from undertow.steering.tracks import Leg, drawn, pace_of

pytest.importorskip("casadi", reason="what controllers plan with: pip install '.[export]'")
HULL = load_vehicle("blueboat")
DRAGGED = apply_effects(HULL, {"surge_trim": -6.0})
SAID = -6.0 / (HULL.mass + 3.0)
"""Acceleration ahead by that trim [m/s^2]; the added mass is 3 kg."""


def network(kind: str, time_step: float = 0.1, said: float = SAID, *, pure: bool = False) -> NetworkModel:
    """A network that says one acceleration ahead whatever it sees."""
    names = input_names(HULL, heading=False)
    constants = Standardisation(names, np.zeros(len(names)), np.ones(len(names)))
    built = build(kind, scaling_of(HULL, constants, np.ones(3)), {})
    with torch.no_grad():
        built.get_submodule("head").get_parameter("bias")[0] = said
    return NetworkModel(HULL, built, time_step, pure=pure)


def driven(model: Model, controller: str) -> Passage:
    track = drawn("square", [Leg(3.0), Leg(2.0), Leg(0.0, turn=60.0), Leg(8.0)], pace_of(HULL))
    return drive(known_model(model), controller, DRAGGED, Surroundings(), track, seed=1)


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize(("kind", "time_step"), [("mlp", 0.1), ("lstm", 0.1), ("tcn", 0.2)])
def test_it_steers_as_the_formula_that_says_the_same(kind: str, time_step: float, controller: str):
    formula, learnt = (driven(m, controller) for m in (VehicleModel(DRAGGED, "trim"), network(kind, time_step)))
    np.testing.assert_allclose(learnt.motion, formula.motion, atol=2e-3)
    nominal = driven(VehicleModel(HULL, "nominal"), controller)
    assert np.abs(nominal.motion - formula.motion).max() > 0.02


def test_rows_that_are_no_part_of_the_period_are_refused():
    with pytest.raises(RequestError, match=r"whose rows are 0.2 s or a whole part of it apart, got 0.15 s"):
        known_model(network("lstm", 0.15))


def test_a_network_without_physics_is_refused():
    with pytest.raises(RequestError, match=r"expected a vehicle file, a run folder or a network beside physics"):
        known_model(network("lstm", pure=True))
