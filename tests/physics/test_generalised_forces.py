"""A vehicle driven by a force ahead and a moment: the same motion as by the thrusters that make them."""

import numpy as np
import pytest

from undertow.measurements.canonical import command_kind, is_canonical, unit_of
from undertow.measurements.log import Log
from undertow.measurements.preparation.needs import problems
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.files import yaml_text
from undertow.physics.forces import modelled_acceleration
from undertow.physics.laws.audit.symmetry import mirror_pairs
from undertow.physics.momentum_balance import thruster_matrix
from undertow.physics.motion import Motion
from undertow.physics.thrusters import push_and_turn
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.manoeuvres import programme
from undertow.workflows.export import export

BOAT = load_vehicle("blueboat")


def table(reach: float) -> dict:
    return {"kind": "table", "command": [-reach, reach], "force": [-reach, reach]}


def generalised(**changes) -> Vehicle:
    actuators = [
        {"name": "surge", "command": "tau", "curve": table(100.0)},
        {"name": "yaw", "command": "tau", "curve": table(50.0), **changes},
    ]
    return vehicle_from_dict({**BOAT.to_dict(), "thrusters": actuators}, "test")


def test_it_acts_as_the_thrusters_whose_sum_it_is():
    rng = np.random.default_rng(0)
    commands = rng.uniform(-30.0, 30.0, (200, 2)).repeat(5, axis=0)
    time = 0.1 * np.arange(1000.0, dtype=np.float64)
    motion = Motion(
        time=time,
        position=np.zeros((1000, 2)),
        heading=np.zeros(1000),
        velocity=rng.normal(size=(1000, 3)) * 0.1,
        commands=commands,
        thrusters=tuple(t.name for t in BOAT.thrusters),
        source="test",
    )
    forces = commands @ thruster_matrix(BOAT).T
    whole = Motion(
        time=time,
        position=motion.position,
        heading=motion.heading,
        velocity=motion.velocity,
        commands=forces[:, [0, 2]],
        thrusters=("surge", "yaw"),
        source="test",
    )
    np.testing.assert_allclose(
        modelled_acceleration(generalised(), whole), modelled_acceleration(BOAT, motion), atol=1e-9
    )


def test_its_columns_are_unit_vectors_and_its_names_are_channels():
    vehicle = generalised()
    np.testing.assert_array_equal(thruster_matrix(vehicle), [[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    assert [t.channel for t in vehicle.thrusters] == ["tau_surge", "tau_yaw"]
    assert [push_and_turn(t) for t in vehicle.thrusters] == [(1, 0), (0, 1)]
    assert (unit_of("tau_surge"), unit_of("tau_yaw")) == ("N", "N m")
    assert command_kind("tau_yaw") == ("tau", "yaw")
    assert not is_canonical("tau_roll")
    assert mirror_pairs(vehicle) is None


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"name": "roll"}, "name it surge, sway or yaw"),
        ({"y": 0.3}, "has no place"),
        ({"curve": {"kind": "propeller", "scale": 1, "k_t": 1, "rho": 1, "diameter": 1}}, "give a table curve"),
    ],
)
def test_a_place_or_a_propeller_is_refused(change, told):
    with pytest.raises(VehicleError, match=told):
        generalised(**change)


def test_programmes_turn_it():
    found = programme(generalised(), "zigzag", 60.0)
    assert np.ptp(found[:, 1]) > 10.0
    assert not np.array_equal(found[:, 0] / 100.0, found[:, 1] / 50.0)


def test_a_vehicle_with_thrusters_is_told_what_the_log_has():
    time = np.arange(0.0, 60.0, 0.1)
    log = Log.from_arrays(time, {name: np.sin(time) for name in ("x", "y", "psi", "tau_surge", "tau_yaw")})
    (told,) = problems(log, BOAT)
    assert "tau_surge and tau_yaw, force and moment of the whole vessel" in told
    assert problems(log, generalised()) == []


def test_what_cannot_express_it_says_so(tmp_path):
    model = tmp_path / "boat.yaml"
    model.write_text(yaml_text(generalised().to_dict()))
    for to in ("sdf", "ardupilot"):
        with pytest.raises(RequestError, match=f"--to {to}"):
            export(model, to, tmp_path / "model")
    export(model, "python", tmp_path / "model.py")
    assert "tau_yaw" in (tmp_path / "model.py").read_text()
