"""The BlueBoat before one law: as a formula, and as foreign code that something else pushes."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from undertow.comparison.audit import witness_of
from undertow.physics.laws.audit.base import Law, Ruling
from undertow.physics.laws.damping_power import Envelope
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Array, Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.models.foreign import FunctionModel

HULL = load_vehicle("blueboat")
BOX = Envelope((-1.0, -0.6, -1.1), (2.2, 0.6, 1.1))


@cache
def half_a_minute() -> Motion:
    """The hull under way."""
    return simulate_world(HULL, {}, duration=30.0, noise="clean", seed=2).motion(0.1)


def judged(law: Law, model: Model, **more: Any) -> Ruling:
    return law.judge(witness_of(model, BOX, **more))


def formula(**values: float) -> VehicleModel:
    return VehicleModel(HULL.with_values(values), "formula")


def pushed(force: Callable[[Array], Array]) -> FunctionModel:
    """The hull as foreign code, and beside it a force (n, 3) of the velocity."""
    inverse, honest = np.linalg.inv(mass_matrix(HULL)), VehicleModel(HULL, "hull")

    def answer(velocity: Array, heading: Array, commands: Array) -> Array:
        return honest.settled(velocity, heading, commands) + force(velocity) @ inverse.T

    return FunctionModel(answer, HULL, "foreign")
