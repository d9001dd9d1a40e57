"""Dynamic mode decomposition with control, and a Koopman operator on lifted velocities."""

from functools import partial
from itertools import combinations_with_replacement

import numpy as np

from undertow.measurements.preparation.prepare import DataSet
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model

from .cases import Data
from .stepped import Lift, Linear, Stepped, best_of, transitions

_RIDGE = 1e-8
"""Share of the mean square of the lifted states by which normal equations are held regular."""
DEGREES, CENTRES = (2, 3), (20, 100)
"""Dictionaries that validation chooses among: monomials up to a degree, or so many thin-plate splines."""


def dmdc(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """DMDc (Proctor, Brunton and Kutz 2016, doi:10.1137/15M1013857, section 3.3), without truncation.

    Five rows of states and inputs have nothing to truncate. It has no setting.
    """
    del seed
    before, after, pushed = transitions(vehicle, data.whole)
    left, sizes, right = np.linalg.svd(np.column_stack([before, pushed]).T, full_matrices=False)
    operator = after.T @ right.T @ np.diag(1.0 / sizes) @ left.T
    system = Linear(operator[:, :3], operator[:, 3:], np.eye(3), lambda velocity: velocity)
    return Stepped(system, vehicle, data.whole.motions[0].time_step, name)


def koopman(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """EDMD with control (Korda and Mezic 2018, doi:10.1016/j.automatica.2018.03.046, equations 17 to 19).

    The lift is 1, the velocities, and monomials or thin-plate splines of them; thrusts enter linearly. The dictionary
    is chosen by rollouts of the validation part.
    """
    before, _, _ = transitions(vehicle, data.split.train)
    scale, rng = before.std(axis=0), np.random.default_rng([seed, 31])
    lifts: list[Lift] = [partial(_monomials, scale, degree) for degree in DEGREES]
    low, high = before.min(axis=0) / scale, before.max(axis=0) / scale
    lifts += [partial(_splines, scale, rng.uniform(low, high, (count, 3))) for count in CENTRES]
    made = [partial(_lifted, vehicle, name, lift) for lift in lifts]
    return best_of(made, *data.parts)


def _lifted(vehicle: Vehicle, name: str, lift: Lift, data: DataSet) -> Model:
    before, after, pushed = transitions(vehicle, data)
    known = np.column_stack([lift(before), pushed])
    size = np.sqrt((known**2).mean(axis=0))
    table = known / size
    normal = table.T @ table / len(table) + _RIDGE * np.eye(table.shape[1])
    operator = np.linalg.solve(normal, table.T @ lift(after) / len(table)).T / size
    states = operator.shape[0]
    picked = np.eye(states)[1:4]  # behind the constant
    system = Linear(operator[:, :states], operator[:, states:], picked, lift)
    return Stepped(system, vehicle, data.motions[0].time_step, name)


def _monomials(scale: Array, degree: int, velocity: Array) -> Array:
    columns = [np.ones(len(velocity)), *velocity.T]
    for order in range(2, degree + 1):
        for axes in combinations_with_replacement(range(3), order):
            columns.append(np.prod([velocity[:, k] / scale[k] for k in axes], axis=0))
    return np.column_stack(columns)


def _splines(scale: Array, centres: Array, velocity: Array) -> Array:
    apart = np.linalg.norm(velocity[:, None] / scale - centres, axis=-1)
    return np.column_stack([np.ones(len(velocity)), velocity, apart**2 * np.log(np.maximum(apart, 1e-12))])
