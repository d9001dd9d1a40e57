"""A vehicle in JavaScript: its numbers as data, and the force equation that reads them, without any library."""

from importlib import resources

import numpy as np

from ..physics.effects import PARAMETERS
from ..physics.momentum_balance import AROUND, DENSITY, FORCES, STRIPS, terms_by_symbol
from ..physics.reading import Plain
from ..physics.thrusters import GAINS, Thruster
from ..physics.vehicle import SHARED_THRUSTER_KEYS, Vehicle

FUNCTION = "undertowVehicle"
"""Name of the JavaScript function that makes a vehicle of `vehicle_data`."""


def force_equation() -> str:
    """The source of the force equation and its rollouts: a function `undertowVehicle(data)`."""
    return (resources.files(__package__ or "undertow.exports") / "force_equation.js").read_text("utf-8")


def vehicle_data(vehicle: Vehicle) -> Plain:
    """All that the JavaScript function needs of a vehicle, as JSON has it [SI units].

    Parameters and the catalogue's products of speeds come along, so that the function builds the momentum balance anew
    for any values.
    """
    return {
        "name": vehicle.name,
        "values": dict(vehicle.values),
        "thrusters": [_thruster(thruster) for thruster in vehicle.thrusters],
        "hydrodynamic": [
            [symbol, axis, list(form.factors), symbol in PARAMETERS and PARAMETERS[symbol].section == "damping"]
            for symbol, (_, axis, form) in terms_by_symbol(vehicle).items()
        ],
        "hull": None if vehicle.hull is None else vehicle.hull.model_dump(),
        "cross_flow": {"forces": [[axis, name] for axis, name in FORCES], "strips": STRIPS, "density": DENSITY},
        "around": [[axis, sign, list(factors), symbol] for axis, sign, factors, symbol in AROUND],
        "shared": list(SHARED_THRUSTER_KEYS),
        "gains": list(GAINS),
    }


def _thruster(thruster: Thruster) -> Plain:
    """A thruster's fields, and the commands in its own unit whose normalised values are zero and one."""
    at = np.array([0.0, 1.0])
    low, high = (float(thruster.curve.normalised(np.array(c), thruster.command)) for c in at)
    zero, one = ((share - low) / (high - low) for share in at)
    return {**thruster.model_dump(mode="json"), "at_zero": float(zero), "at_one": float(one)}
