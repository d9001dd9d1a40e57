"""An autopilot that uses the parameters as ArduPilot does goes and turns as it asks."""

from pathlib import Path

import numpy as np
import pytest
from exported import facts

from undertow.exports.formats import to_ardupilot
from undertow.exports.formats.base import Given
from undertow.exports.straight_running import sides_of
from undertow.physics.errors import RequestError
from undertow.physics.thrusters import PropellerCurve
from undertow.physics.vehicle import Vehicle, load_vehicle

BOATS = {
    "linear": load_vehicle("blueboat"),
    "square law, weak astern": load_vehicle("otter"),
    "propellers": load_vehicle("blueboat_paper"),
    "dead zone": load_vehicle("otter").with_values({"dead_zone": 0.12, "lag": 0.4}),
}


def read(vehicle: Vehicle, folder: Path) -> dict[str, float]:
    ((path, content),) = to_ardupilot.EXPORT.files(Given(vehicle, facts("as it is")), folder / "boat.param").items()
    path.write_bytes(content)
    lines = [line for line in path.read_text("utf-8").splitlines() if not line.startswith("#")]
    return {name: float(value) for name, value in (line.split(",") for line in lines)}


class Rover:
    """ArduPilot's skid steering: the mixer, the asymmetry, the thrust curve and the scaling to the outputs."""

    def __init__(self, parameters: dict[str, float]) -> None:
        self.p = parameters

    def outputs(self, steering: float, throttle: float) -> list[float]:
        """Shares of full output of the left and right motor, for steering and throttle of -1 to 1."""
        low = -1.0 / max(self.p["MOT_THST_ASYM"], 1.0)
        assert throttle + abs(steering) <= 1.0
        assert throttle - abs(steering) >= low
        found = []
        for motor in (throttle + steering, throttle - steering):
            asked = 100.0 * (motor * self.p["MOT_THST_ASYM"] if motor < 0.0 else motor)
            if asked:
                least = self.p["MOT_THR_MIN"]
                asked = np.sign(asked) * (least + abs(asked) * (100.0 - least) / 100.0)
            e = self.p["MOT_THST_EXPO"]
            if e:
                root = np.sqrt((1.0 - e) ** 2 + 4.0 * e * abs(asked) / 100.0)
                asked = 100.0 * np.sign(asked) * (e - 1.0 + root) / (2.0 * e)
            found.append(asked / 100.0)
        return found


@pytest.mark.parametrize("name", BOATS)
def test_the_boat_goes_and_turns_as_the_autopilot_asks(name: str, tmp_path: Path):
    vehicle = BOATS[name]
    p = read(vehicle, tmp_path)
    rover, sides = Rover(p), sides_of(vehicle, "ardupilot")
    throttle = p["CRUISE_THROTTLE"] / 100.0
    wanted = 0.1 / p["ATC_STR_RAT_FF"]
    pairs = [rover.outputs(0.0, throttle), rover.outputs(p["ATC_STR_RAT_FF"] * wanted, throttle)]
    straight, turning = sides.steady(*np.array(pairs).T)
    assert straight[0] == pytest.approx(p["CRUISE_SPEED"], abs=1e-3)
    assert turning[2] - straight[2] == pytest.approx(wanted, rel=5e-3)


@pytest.mark.parametrize("name", BOATS)
def test_thrust_is_as_linear_as_it_says(name: str, tmp_path: Path):
    vehicle = BOATS[name]
    rover, sides = Rover(read(vehicle, tmp_path)), sides_of(vehicle, "ardupilot")
    told = to_ardupilot.EXPORT.left_out(Given(vehicle, facts("as it is")))[0]
    most = float(told.split("within ")[1].split(" N")[0])
    full = np.mean([to_ardupilot.thrust(t, np.ones(1)) for t in sides.thrusters()])
    asked = np.linspace(-1.0, 1.0, 41) / 1.0
    asked = asked[asked >= -1.0 / rover.p["MOT_THST_ASYM"]]
    share = np.array([rover.outputs(0.0, float(t))[0] for t in asked])
    force = np.mean([to_ardupilot.thrust(t, share) for t in sides.thrusters()], axis=0)
    off = np.abs(force - asked * full).max()
    assert off <= most * 1.01 + 1e-9
    plain = np.mean([to_ardupilot.thrust(t, asked) for t in sides.thrusters()], axis=0)
    assert off <= np.abs(plain - asked * full).max() + 1e-9
    assert off < 0.16 * full


def test_trims_and_ends_are_those_of_the_pulses(tmp_path: Path):
    p = read(BOATS["propellers"], tmp_path)
    curve = BOATS["propellers"].thrusters[0].curve
    assert isinstance(curve, PropellerCurve)
    assert p["SERVO1_TRIM"] == p["SERVO3_TRIM"] == round(1500.0 - 500.0 * curve.offset / curve.scale)
    assert (p["SERVO1_MIN"], p["SERVO1_MAX"], p["SERVO1_REVERSED"]) == (1000.0, 2000.0, 0.0)
    assert "SERVO1_TRIM" not in read(BOATS["linear"], tmp_path)


def test_a_boat_that_steers_otherwise_is_refused():
    with pytest.raises(RequestError, match="expected one thruster at port and one at starboard.*got"):
        to_ardupilot.parameters(load_vehicle("cybership2"))
