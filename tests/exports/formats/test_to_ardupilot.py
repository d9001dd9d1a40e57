"""An autopilot that uses the parameters as ArduPilot does goes and turns as it asks."""

from pathlib import Path

import numpy as np
import pytest
from exported import facts

from undertow.exports.approximation import sides_of
from undertow.exports.formats import to_ardupilot
from undertow.exports.formats.base import Given, format_named
from undertow.physics.errors import RequestError
from undertow.physics.forces import calm
from undertow.physics.integration import Legs, rollouts
from undertow.physics.motion import Motion
from undertow.physics.thrusters import PropellerCurve, TableCurve, Thruster, command_of
from undertow.physics.vehicle import Vehicle, load_vehicle


def pulsed(command: list[float], force: list[float], **also: float) -> Vehicle:
    """A boat whose thrusters have a table of microseconds."""
    curve = TableCurve(kind="table", command=tuple(command), force=tuple(force))
    otter = load_vehicle("otter")
    thrusters = [t.model_copy(update={"command": "pwm", "curve": curve}) for t in otter.thrusters]
    return otter.model_copy(update={"thrusters": tuple(thrusters)}).with_values(also)


BOATS = {
    "not symmetric": pulsed([1000.0, 1600.0, 1900.0], [-60.0, 0.0, 120.0]),
    "not symmetric, dead zone": pulsed([1000.0, 1600.0, 1900.0], [-60.0, 0.0, 120.0], dead_zone=0.05),
    "reversed": pulsed([1100.0, 1400.0, 2000.0], [120.0, 0.0, -60.0]),
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

    def commands(self, channel: int, thruster: Thruster, share: np.ndarray) -> np.ndarray:
        """What the output sends: `SRV_Channel::pwm_from_angle`, and for other kinds shares of full command."""
        if thruster.command != "pwm":
            return command_of(thruster, share)
        least, trim, most, turned = (self.p[f"SERVO{channel}_{name}"] for name in ("MIN", "TRIM", "MAX", "REVERSED"))
        asked = -share if turned else share
        return np.array([trim + x * (most - trim) if x > 0.0 else trim + x * (trim - least) for x in asked])

    def forces(self, thrusters: tuple[Thruster, Thruster], share: np.ndarray) -> np.ndarray:
        """Forces [N] of the left and right motor for shares of full output of both."""
        pairs = zip((1, 3), thrusters, strict=True)
        return np.array([t.lasting(self.commands(channel, t, share))[0] for channel, t in pairs])

    def steady(self, vehicle: Vehicle, pairs: list[list[float]]) -> np.ndarray:
        """Velocities (n, 3) two minutes after outputs of the left and right motor (n, 2)."""
        boat, rows, still = calm(vehicle), 2401, np.zeros((2401, 3))
        sides, time = sides_of(vehicle, "ardupilot"), 0.05 * np.arange(2401.0)
        held = np.zeros((len(pairs), 2))
        for channel, k, share in zip((1, 3), (sides.port, sides.starboard), np.array(pairs).T, strict=True):
            held[:, k] = self.commands(channel, vehicle.thrusters[k], share)
        names = tuple(t.name for t in vehicle.thrusters)
        motions = [Motion(time, still[:, :2], still[:, 2], still, np.tile(each, (rows, 1)), names) for each in held]
        found = rollouts([(boat, Legs(motion, np.array([0]), rows - 1)) for motion in motions], placed=False)
        return np.array([each.states[0, -1, 1:] for each in found])


@pytest.mark.parametrize("name", BOATS)
def test_the_boat_goes_and_turns_as_the_autopilot_asks(name: str, tmp_path: Path):
    vehicle = BOATS[name]
    p = read(vehicle, tmp_path)
    rover = Rover(p)
    throttle = p["CRUISE_THROTTLE"] / 100.0
    wanted = 0.1 / p["ATC_STR_RAT_FF"]
    pairs = [rover.outputs(0.0, throttle), rover.outputs(p["ATC_STR_RAT_FF"] * wanted, throttle)]
    straight, turning = rover.steady(vehicle, pairs)
    assert straight[0] == pytest.approx(p["CRUISE_SPEED"], abs=1e-3)
    assert turning[2] - straight[2] == pytest.approx(wanted, rel=5e-3)


@pytest.mark.parametrize("name", BOATS)
def test_thrust_is_as_linear_as_it_says(name: str, tmp_path: Path):
    vehicle = BOATS[name]
    rover, sides = Rover(read(vehicle, tmp_path)), sides_of(vehicle, "ardupilot")
    told = to_ardupilot.EXPORT.left_out(Given(vehicle, facts("as it is")))[0]
    most = float(told.split("within ")[1].split(" N")[0])
    full = np.mean(rover.forces(sides.thrusters(), np.ones(1)))
    asked = np.linspace(-1.0, 1.0, 41) / 1.0
    asked = asked[asked >= -1.0 / rover.p["MOT_THST_ASYM"]]
    share = np.array([rover.outputs(0.0, float(t))[0] for t in asked])
    force = np.mean(rover.forces(sides.thrusters(), share), axis=0)
    off = np.abs(force - asked * full).max()
    assert off <= most * 1.01 + 1e-9
    plain = np.mean(rover.forces(sides.thrusters(), asked), axis=0)
    assert off <= np.abs(plain - asked * full).max() + 1e-9
    assert off < 0.16 * full


def test_trims_and_ends_are_those_of_the_pulses(tmp_path: Path):
    p = read(BOATS["propellers"], tmp_path)
    curve = BOATS["propellers"].thrusters[0].curve
    assert isinstance(curve, PropellerCurve)
    assert p["SERVO1_TRIM"] == p["SERVO3_TRIM"] == round(1500.0 - 500.0 * curve.offset / curve.scale)
    assert (p["SERVO1_MIN"], p["SERVO1_MAX"], p["SERVO1_REVERSED"]) == (1000.0, 2000.0, 0.0)
    assert "SERVO1_TRIM" not in read(BOATS["linear"], tmp_path)


def test_half_of_an_output_is_half_way_from_its_trim_to_its_end(tmp_path: Path):
    vehicle = BOATS["not symmetric"]
    assert read(vehicle, tmp_path)["SERVO1_TRIM"] == 1600.0
    assert to_ardupilot.commanded(vehicle.thrusters[0], np.array([-1.0, 0.0, 0.5, 1.0])).tolist() == [
        *(1000.0, 1600.0, 1750.0, 1900.0)
    ]
    turned = BOATS["reversed"]
    assert read(turned, tmp_path)["SERVO1_REVERSED"] == 1.0
    assert to_ardupilot.commanded(turned.thrusters[0], np.array([0.5, -0.5])).tolist() == [1250.0, 1700.0]


def test_a_feed_forward_beyond_what_there_is_is_told(tmp_path: Path):
    slow = BOATS["linear"].with_values({"N_r": -120.0})
    assert read(slow, tmp_path)["ATC_STR_RAT_FF"] == 3.0
    (line,) = [x for x in to_ardupilot.EXPORT.left_out(Given(slow, facts("as it is"))) if "ATC_STR_RAT_FF" in x]
    assert float(line.split("asks for ")[1].split(":")[0]) > 3.0
    assert not any("ATC_STR" in x for x in to_ardupilot.EXPORT.left_out(Given(BOATS["linear"], facts("as it is"))))


@pytest.mark.parametrize(("to", "current"), [("ardupilot", True), ("moos", False)])
def test_what_surrounds_the_boat_and_changes_is_told(to: str, current: bool):
    values = {"wind_x": 0.3, "thrust_rate": -0.05, "fouling_rate": 0.02, "current_rate_north": 0.02, "yaw_trim": 0.5}
    vehicle = BOATS["linear"].with_values(values | {"current_north": 0.2})
    sentences = format_named(to).left_out(Given(vehicle, facts("as it is")))
    for symbol in values:
        assert [x for x in sentences if f"{symbol} = " in x and " N" in x], symbol
    assert any("current_north = " in x for x in sentences) is current


def test_a_boat_that_steers_otherwise_is_refused():
    with pytest.raises(RequestError, match="expected one thruster at port and one at starboard.*got"):
        to_ardupilot.parameters(load_vehicle("cybership2"))
