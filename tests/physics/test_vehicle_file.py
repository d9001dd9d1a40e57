"""What a vehicle file may not say: twice the same, or a curve that does not fit the command."""

from pathlib import Path

import numpy as np
import pytest

from undertow.physics.errors import VehicleError
from undertow.physics.motion import Motion
from undertow.physics.thrusters import PropellerCurve
from undertow.physics.vehicle import load_vehicle, vehicle_from_dict

PROPELLER = {"kind": "propeller", "scale": 70.0, "k_t": 0.02, "rho": 1025.0, "diameter": 0.112}


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "vehicle.yaml"
    path.write_text(text)
    return path


HULL = """
mass: 20.0
inertia_z: 4.0
damping: {X_u: -15.0}
thrusters:
  - {name: port, x: 0.0, y: -0.3, command: newton, curve: {kind: table, command: [-9, 9], force: [-9, 9]}}
"""


def test_a_key_that_stands_twice_is_refused(tmp_path: Path):
    twice = HULL.replace("{X_u: -15.0}", "{X_u: -15.0, X_u: 0.0}")
    with pytest.raises(VehicleError, match="key 'X_u' stands twice in one mapping, line 4; keep one"):
        load_vehicle(written(tmp_path, twice))
    assert load_vehicle(written(tmp_path, HULL)).value("X_u") == -15.0


def test_a_term_that_stands_twice_is_refused(tmp_path: Path):
    terms = "terms: [{axis: yaw, form: 'v|r|', value: 1.0}, {axis: yaw, form: 'v|r|', value: 2.0}]\n"
    with pytest.raises(VehicleError, match=r"terms: yaw:v\|r\| stands twice; keep one"):
        load_vehicle(written(tmp_path, HULL + terms))


def test_a_rad_s_command_is_the_speed_that_the_propeller_law_squares():
    curve = PropellerCurve.model_validate(PROPELLER)
    assert curve.thrust(np.array([70.0]), "rad_s") == pytest.approx(curve.thrust(np.array([2000.0]), "pwm"))
    assert curve.normalised(np.array([70.0]), "rad_s") == pytest.approx(1.0)


def test_a_newton_command_takes_no_propeller():
    thruster = {"name": "port", "x": 0.0, "y": -0.3, "command": "newton", "curve": PROPELLER}
    with pytest.raises(VehicleError, match="a newton command is a force already; give a table curve"):
        vehicle_from_dict({"mass": 20.0, "inertia_z": 4.0, "thrusters": [thruster]}, "here")


def test_a_slice_remembers_the_commands_before_it():
    n = 1000
    commands = np.arange(2.0 * n).reshape(n, 2)
    pair = np.zeros((n, 2))
    motion = Motion(0.05 * np.arange(n, dtype=float), pair, np.zeros(n), np.zeros((n, 3)), commands, ("port", "stbd"))
    later = motion.slice(600, 900).slice(100, 200)
    assert motion.run_up is None
    assert later.run_up is not None
    np.testing.assert_array_equal(later.run_up, commands[300:700])
