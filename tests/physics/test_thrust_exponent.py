"""The thrust exponent: closed form, and that logs whose thrust follows another power say so, and nothing else."""

import numpy as np
import pytest

from undertow.discovery.discover import find_missing
from undertow.physics.thrusters import PropellerCurve, TableCurve, Thruster
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
LINEAR = TableCurve(kind="table", command=(-30.0, 0.0, 30.0), force=(-18.0, 0.0, 30.0))
SQUARE = PropellerCurve(kind="propeller", scale=70.0, k_t=0.05, rho=1000.0, diameter=0.112)


def force(curve: TableCurve | PropellerCurve, command: np.ndarray, **faults: float) -> np.ndarray:
    kind = "newton" if curve is LINEAR else "normalized"
    one = Thruster.model_validate({"name": "one", "x": 0.0, "y": 0.0, "command": kind, "curve": curve, **faults})
    return one.response(command, 0.1)[0]


def test_the_force_at_full_command_stays_and_a_root_makes_a_line_of_a_square_law() -> None:
    command = np.linspace(-1.0, 1.0, 21)
    full = force(SQUARE, np.array([1.0]))[0]
    np.testing.assert_allclose(force(SQUARE, command, thrust_exponent=0.5), full * command, atol=1e-12)
    np.testing.assert_allclose(force(SQUARE, command, thrust_exponent=1.0), force(SQUARE, command), atol=1e-12)
    ends = force(LINEAR, np.array([-30.0, 0.0, 30.0]), thrust_exponent=1.7)
    np.testing.assert_allclose(ends, force(LINEAR, np.array([-30.0, 0.0, 30.0])))


def test_both_sides_follow_the_power_from_their_own_end() -> None:
    middle = force(LINEAR, np.array([-15.0, 15.0]), thrust_exponent=2.0)
    below, above = force(LINEAR, np.array([-15.0, 15.0]))
    low, high = force(LINEAR, np.array([-30.0, 30.0]))
    np.testing.assert_allclose(middle, [-(below**2) / abs(low), above**2 / high])


def test_gains_and_scales_act_on_the_powered_curve() -> None:
    command = np.linspace(-1.0, 1.0, 41)
    plain = force(SQUARE, command, thrust_exponent=0.7)
    gains = {f"gain_{side}_{end}": 0.6 for side in ("ahead", "astern") for end in (33, 67, 100)}
    np.testing.assert_allclose(force(SQUARE, command, thrust_exponent=0.7, **gains), 0.6 * plain, atol=1e-12)
    np.testing.assert_allclose(force(SQUARE, command, thrust_exponent=0.7, thrust_scale=0.6), 0.6 * plain, atol=1e-12)


def test_a_side_without_thrust_and_a_reversed_thruster_are_borne() -> None:
    ahead_only = TableCurve(kind="table", command=(-1.0, 0.0, 1.0), force=(0.0, 0.0, 20.0))
    found = force(ahead_only, np.array([-1.0, -0.5, 0.0, 0.5, 1.0]), thrust_exponent=2.0)
    np.testing.assert_allclose(found, [0.0, 0.0, 0.0, 5.0, 20.0])
    turned = TableCurve(kind="table", command=(-1.0, 1.0), force=(20.0, -20.0))
    np.testing.assert_allclose(force(turned, np.array([-0.5, 0.5]), thrust_exponent=2.0), [5.0, -5.0])


@pytest.mark.parametrize("exponent", [0.65, 1.5])
def test_an_exponent_is_named_with_its_value(exponent: float) -> None:
    log = simulate_world(HULL, {"thrust_exponent": exponent}, duration=200.0, noise="field", seed=3)
    found = find_missing((log.motion(0.05),), HULL)
    assert found.findings.missing == ("thrust_exponent",)
    assert found.corrected.value("thrust_exponent") == pytest.approx(exponent, rel=0.05)
