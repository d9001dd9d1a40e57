"""pysindy as its documentation uses it for systems with control inputs."""

import warnings
from functools import partial

import numpy as np
import pysindy

from undertow.measurements.preparation.prepare import DataSet
from undertow.physics.forces import held_thrust
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model
from undertow.residuals.models.foreign import FunctionModel

from .cases import Data
from .stepped import best_of, filtered_thrust

THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Of scaled columns: what validation chooses among."""


def sindy(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """SINDYc (Brunton, Proctor and Kutz 2016, doi:10.1016/j.ifacol.2016.10.249) by pysindy's defaults.

    `SINDy().fit(x, u=u, t=dt)`: polynomials of degree two in velocities and thrusts, finite differences, thresholds of
    0.1, whatever the units are. It has no setting that validation chooses.
    """
    del seed
    return _found(pysindy.SINDy(), vehicle, name, np.ones(3), np.ones(len(vehicle.thrusters)), data.whole)


def scaled_sindy(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """The same of velocities and thrusts in units of their spread, its threshold chosen by the validation part."""
    del seed
    motions = data.split.train.motions
    speeds = np.concatenate([motion.velocity for motion in motions]).std(axis=0)
    pushes = np.concatenate([filtered_thrust(vehicle, motion, data.split.train) for motion in motions]).std(axis=0)

    def made(threshold: float, part: DataSet) -> Model:
        model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=threshold))
        return _found(model, vehicle, name, speeds, pushes, part)

    return best_of([partial(made, threshold) for threshold in THRESHOLDS], *data.parts)


def _found(
    model: pysindy.SINDy, vehicle: Vehicle, name: str, speeds: Array, pushes: Array, part: DataSet
) -> FunctionModel:
    """A fitted model as a function of velocities and thrusts in these units, (3,) and (thrusters,)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a threshold that leaves nothing; validation sees that, too
        model.fit(
            [motion.velocity / speeds for motion in part.motions],
            t=part.motions[0].time_step,
            u=[filtered_thrust(vehicle, motion, part) / pushes for motion in part.motions],
        )

    def answer(velocity: Array, heading: Array, commands: Array) -> Array:
        del heading
        return model.predict(velocity / speeds, u=held_thrust(vehicle, commands)[0].T / pushes) * speeds

    found = FunctionModel(answer, vehicle, name, "symbolic")
    found.parameters = int((model.coefficients() != 0.0).sum())
    return found
