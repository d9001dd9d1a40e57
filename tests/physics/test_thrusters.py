"""Thrusters: curves, commands, and every fault against its closed form."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from undertow.physics.errors import VehicleError
from undertow.physics.forces import held_thrust
from undertow.physics.sampled_series import area_average, first_order_lag
from undertow.physics.thrusters import (
    CommandKind,
    PropellerCurve,
    TableCurve,
    Thruster,
    command_of,
    shift,
)
from undertow.physics.vehicle import load_vehicle, shipped_vehicles, vehicle_from_dict

STEP = 0.1
LINEAR = TableCurve(kind="table", command=(-40.0, 40.0), force=(-40.0, 40.0))


def newton(**faults: float) -> Thruster:
    """A thruster that gives the newtons asked for, up to 40, with faults."""
    return Thruster(name="one", x=0.0, y=0.0, command="newton", curve=LINEAR, **faults)


def force(thruster: Thruster, command: Any) -> np.ndarray:
    return thruster.response(np.asarray(command, dtype=float), STEP)[0]


def test_lag_of_a_ramp_is_exact() -> None:
    time = STEP * np.arange(100)
    expected = 3.0 * (time - 0.7 * (1.0 - np.exp(-time / 0.7)))
    np.testing.assert_allclose(force(newton(lag=0.7), 3.0 * time), expected, atol=1e-12)


def test_lag_of_a_step_is_exact() -> None:
    """A step between two samples is a ramp of one step's length: 1 - exp(-t/T) averaged over it."""
    lag, command = 0.7, np.where(np.arange(80) >= 10, 20.0, 0.0)
    late = STEP * (np.arange(80) - 10.0)
    expected = 20.0 * (1.0 - lag / STEP * (1.0 - np.exp(-STEP / lag)) * np.exp(-late / lag))
    np.testing.assert_allclose(force(newton(lag=lag), command)[10:], expected[10:], atol=1e-12)
    np.testing.assert_array_equal(force(newton(lag=lag), command)[:10], 0.0)


def test_lag_starts_at_rest_and_ends_at_the_command() -> None:
    np.testing.assert_allclose(force(newton(lag=0.5), np.full(50, 12.0)), 12.0)
    series = np.array([1.0, 5.0, -2.0])
    assert first_order_lag(series, 0.0, STEP) is series


def test_delay_of_whole_and_of_half_samples() -> None:
    command = np.concatenate([np.zeros(10), np.arange(1.0, 31.0)])
    np.testing.assert_allclose(force(newton(delay=0.3), command)[3:], command[:-3], atol=1e-12)
    np.testing.assert_allclose(shift(command, 0.05, STEP)[11:], command[11:] - 0.5)
    np.testing.assert_array_equal(force(newton(delay=0.3), np.full(10, 7.0)), 7.0)


def test_dead_zone_cuts_small_commands_only() -> None:
    command = np.array([-20.0, -4.1, -3.9, 0.0, 3.9, 4.1, 20.0])
    np.testing.assert_allclose(force(newton(dead_zone=0.1), command), [-20.0, -4.1, 0, 0, 0, 4.1, 20.0])


def test_dead_zone_edge_itself_is_dead() -> None:
    thruster = newton(dead_zone=0.25)
    np.testing.assert_array_equal(force(thruster, [10.0, -10.0]), 0.0)
    assert force(thruster, [10.0 * (1 + 1e-9)])[0] > 0


def test_scales_multiply_and_reverse_scale_acts_astern_only() -> None:
    thruster = newton(scale=0.8, thrust_scale=0.5, reverse_scale=0.6)
    np.testing.assert_allclose(force(thruster, [-10.0, 0.0, 10.0]), [-10.0 * 0.4 * 0.6, 0.0, 4.0])


def test_advance_loss_grows_with_the_command_both_ways() -> None:
    load = newton(advance_loss=6.0).response(np.array([-40.0, -20.0, 0.0, 10.0]), STEP)[1]
    np.testing.assert_allclose(load, [6.0, 3.0, 0.0, 1.5])
    dead = newton(advance_loss=6.0, dead_zone=0.3).response(np.array([10.0, 20.0]), STEP)[1]
    np.testing.assert_allclose(dead, [0.0, 3.0])


def test_propeller_curve_of_the_paper() -> None:
    curve = PropellerCurve(kind="propeller", scale=70.0, offset=-0.5, k_t=0.02, rho=1025.0, diameter=0.112)
    gain = 0.02 * 1025.0 * 0.112**4
    thrust = curve.thrust(np.array([1500.0, 1750.0, 2000.0, 1000.0]), "pwm")
    np.testing.assert_allclose(thrust, gain * np.array([-0.25, 34.5**2, 69.5**2, -(70.5**2)]))
    np.testing.assert_allclose(curve.thrust(np.array([0.5]), "normalized"), gain * 34.5**2)
    np.testing.assert_allclose(curve.thrust(np.array([-10.0]), "rad_s"), -gain * 100.0)


def test_table_is_linear_between_points_and_constant_beyond() -> None:
    curve = TableCurve(kind="table", command=(1000.0, 1500.0, 1900.0), force=(-30.0, 0.0, 40.0))
    np.testing.assert_allclose(
        curve.thrust(np.array([900.0, 1250.0, 1700.0, 2200.0]), "pwm"), [-30.0, -15.0, 20.0, 40.0]
    )
    np.testing.assert_allclose(curve.normalised(np.array([1000.0, 1500.0, 1900.0]), "pwm"), [-1.0, 0.0, 0.8])


def test_table_with_a_flat_dead_middle_is_neutral_in_its_middle() -> None:
    curve = TableCurve(kind="table", command=(1100.0, 1470.0, 1550.0, 1900.0), force=(-30.0, 0.0, 0.0, 40.0))
    assert float(curve.normalised(np.array(1510.0), "pwm")) == 0.0


CURVES: list[tuple[CommandKind, TableCurve | PropellerCurve]] = [
    ("newton", LINEAR),
    ("pwm", TableCurve(kind="table", command=(1100.0, 1500.0, 1900.0), force=(-30.0, 0.0, 50.0))),
    ("pwm", PropellerCurve(kind="propeller", scale=70.0, offset=-0.5, k_t=0.02, rho=1025.0, diameter=0.112)),
    ("normalized", PropellerCurve(kind="propeller", scale=70.0, k_t=0.02, rho=1025.0, diameter=0.112)),
    ("rad_s", PropellerCurve(kind="propeller", scale=90.0, k_t=0.02, rho=1025.0, diameter=0.112)),
]


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(st.sampled_from(CURVES), st.floats(-1.0, 1.0))
def test_command_of_inverts_normalised(case: tuple[CommandKind, TableCurve | PropellerCurve], fraction: float) -> None:
    kind, curve = case
    thruster = Thruster.model_validate({"name": "one", "x": 0.0, "y": 0.0, "command": kind, "curve": curve})
    command = command_of(thruster, np.array(fraction))
    assert float(curve.normalised(command, kind)) == pytest.approx(fraction, abs=1e-9)


@pytest.mark.parametrize("name", shipped_vehicles())
def test_shipped_thrusters_push_ahead_when_asked_ahead(name: str) -> None:
    for thruster in load_vehicle(name).thrusters:
        low, high = (command_of(thruster, np.array(c)) for c in (-1.0, 1.0))
        assert thruster.curve.thrust(low, thruster.command) < 0 < thruster.curve.thrust(high, thruster.command)


def with_curve(**curve: Any) -> dict[str, Any]:
    one = {"name": "one", "x": 0.0, "y": 0.0, "command": "newton", "curve": {"kind": "table"} | curve}
    return {"mass": 1.0, "inertia_z": 1.0, "thrusters": [one]}


@pytest.mark.parametrize(
    ("curve", "message"),
    [
        ({"command": [-1, 0, 1], "force": [-1, 1]}, "command has 3 points, force has 2"),
        ({"command": [0, 0], "force": [0, 1]}, "command points must increase"),
        ({"command": [0], "force": [0]}, "expected a list of at least 2"),
        ({"command": [-1, 1], "force": [-1, 1], "k_t": 0.1}, "unknown key 'k_t'"),
    ],
)
def test_wrong_table_is_refused(curve: dict[str, Any], message: str) -> None:
    with pytest.raises(VehicleError, match=message):
        vehicle_from_dict(with_curve(**curve), "hand")


def test_channel_is_command_and_name() -> None:
    assert [t.channel for t in load_vehicle("blueboat_paper").thrusters] == ["pwm_port", "pwm_stbd"]


def square_law(**faults: float) -> Thruster:
    return Thruster.model_validate(
        {
            "name": "one",
            "x": 0.0,
            "y": 0.0,
            "command": "rad_s",
            "curve": {"kind": "propeller", "scale": 100.0, "k_t": 0.01, "rho": 1000.0, "diameter": 0.1},
            "advance_loss": 2.0,
            **faults,
        }
    )


@pytest.mark.parametrize("switch", [0.5, 0.51, 0.5375, 0.58])
@pytest.mark.parametrize("faults", [{}, {"delay": 0.13}, {"dead_zone": 0.3}, {"thrust_exponent": 0.6}])
def test_a_switch_within_a_row_keeps_the_impulse_of_the_forces(switch: float, faults: dict[str, float]) -> None:
    step, thruster = 0.05, square_law(**faults)
    rows = step * np.arange(40, dtype=float)
    stamps = np.array([0.0, 0.1, 0.2, switch, switch + 0.1])
    command = area_average(stamps, np.array([-20.0, -20.0, -20.0, 90.0, 90.0]), rows, step)
    levels = thruster.model_copy(update={"delay": 0.0}).response(np.array([-20.0, 90.0]), step)
    for found, (before, after) in zip(thruster.response(command, step), levels, strict=True):
        begun = switch + thruster.delay
        ends = rows[0] - 0.5 * step, rows[-1] + 0.5 * step
        expected = before * (begun - ends[0]) + after * (ends[1] - begun)
        assert found.sum() * step == pytest.approx(expected, abs=1e-9)


def test_ramps_pulses_and_levels_keep_the_forces_of_their_commands() -> None:
    thruster, ramp = square_law(), np.linspace(-50.0, 80.0, 30)
    pulse = np.array([10.0, 10.0, 40.0, 10.0, 10.0, 70.0, 20.0, 20.0])
    for command in (ramp, pulse, np.full(9, 12.0), np.array([5.0]), np.array([5.0, 9.0, 9.0])):
        np.testing.assert_array_equal(force(thruster, command), thruster.curve.thrust(command, "rad_s"))


def test_lasting_commands_are_no_series() -> None:
    boat = load_vehicle("otter")
    commands = np.random.default_rng(5).choice([-60.0, 0.0, 40.0, 90.0], size=(400, 2))
    order = np.random.default_rng(6).permutation(400)
    for found, shuffled in zip(held_thrust(boat, commands), held_thrust(boat, commands[order]), strict=True):
        np.testing.assert_array_equal(found[:, order], shuffled)
