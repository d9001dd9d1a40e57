"""What a format lacks is told in the newtons that it is worth."""

import re

import numpy as np
import pytest
from exported import facts

from undertow.exports.approximation import missing_forces, total_thrust
from undertow.exports.formats.base import Given, format_named
from undertow.physics.laws.damping_power import Envelope
from undertow.physics.momentum_balance import stated
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.residuals.models.base import VehicleModel
from undertow.workflows.export import known_facts

BOAT = load_vehicle("blueboat")
BOX = Envelope((-2.0, -0.5, -1.0), (2.0, 0.5, 1.0))


def sizes(sentence: str) -> dict[str, tuple[float, float]]:
    """Root mean square and largest force by axis."""
    found = re.findall(r"(surge|sway|yaw) ([\d.e+-]+) N(?: m)? \(up to ([\d.e+-]+)\)", sentence)
    return {axis: (float(mean), float(most)) for axis, mean, most in found}


def test_a_drag_is_worth_what_it_is_over_the_box():
    (sentence,) = missing_forces(BOAT, BOX, {"X_uu": 0.0})
    assert sentence.startswith("surge_quadratic_damping (X_uu = -8): the missing force, root mean square")
    ((mean, most),) = [sizes(sentence)["surge"]]
    assert list(sizes(sentence)) == ["surge"]
    assert mean == pytest.approx(8.0 * 4.0 / np.sqrt(5.0), rel=0.05)  # of u|u| where u is even over -2 to 2
    assert most == pytest.approx(32.0, rel=0.01)


def test_what_comes_with_wind_and_time_says_how_much_of_them():
    boat = BOAT.with_values({"wind_x": 0.2, "current_rate_north": 0.02, "thrust_rate": -0.05, "yaw_trim": 1.5})
    asked = {"wind_x": 0.0, "current_rate_north": 0.0, "thrust_rate": 0.0, "yaw_trim": 0.0}
    sentences = {s.partition(" ")[0]: s for s in missing_forces(boat, BOX, asked)}
    assert "in 5 m/s of wind" in sentences["apparent_wind"]
    assert "after 10 minutes" in sentences["turning_current"]
    assert "after 10 minutes" in sentences["battery_sag"]
    assert sizes(sentences["yaw_trim"]) == {"yaw": (1.5, 1.5)}
    assert sizes(sentences["battery_sag"])["surge"][1] == pytest.approx(0.5 * 70.0, rel=0.05)
    assert set(sizes(sentences["turning_current"])) == {"surge", "sway", "yaw"}


def test_forces_are_told_in_the_envelope_of_speeds_through_the_water_that_has_turned():
    turned = BOAT.with_values({"current_north": 1.0, "current_rate_north": -0.1})  # none is left after ten minutes
    (here,), (there,) = (missing_forces(boat, BOX, {"X_uu": 0.0}) for boat in (BOAT, turned))
    assert sizes(here) == sizes(there)


def test_lag_and_delay_are_worth_a_step_of_full_thrust():
    late = BOAT.with_values({"lag": 0.3, "delay": 0.2})
    assert total_thrust(late.thrusters) == pytest.approx(70.0)
    lines = missing_forces(late, BOX, {"lag": 0.0, "delay": 0.0})
    assert [line.partition(":")[0] for line in lines] == ["thruster_lag (lag = 0.3)", "input_delay (delay = 0.2)"]
    assert all("by up to 70 N" in line for line in lines)


def one_late() -> Vehicle:
    """A boat whose starboard thruster alone answers late."""
    port, starboard = BOAT.thrusters
    return BOAT.model_copy(update={"thrusters": (port, starboard.model_copy(update={"lag": 0.4}))})


def test_what_one_thruster_has_alone_is_told():
    (sentence,) = missing_forces(one_late(), BOX, {"lag": 0.0})
    assert sentence.startswith("thruster_lag (lag = 0 (port), 0.4 (stbd)): thrust is early, by up to 35 N")
    assert stated(BOAT.with_values({"lag": 0.3}), "lag", 4, "s") == "lag = 0.3 s"


@pytest.mark.parametrize("to", ["sdf", "ardupilot"])
def test_a_format_without_lag_says_whose_it_leaves_out(to: str):
    assert "0.4 s (stbd)" in " ".join(known_facts(VehicleModel(one_late(), "late"), None).lines())
    sentences = format_named(to).left_out(Given(one_late(), facts("as it is")))
    (sentence,) = [each for each in sentences if "lag" in each]
    assert "(stbd)" in sentence
    assert "35 N" in sentence


def test_what_is_the_same_is_not_told():
    assert missing_forces(BOAT, BOX, {"X_uu": -8.0, "lag": 0.0}) == []
