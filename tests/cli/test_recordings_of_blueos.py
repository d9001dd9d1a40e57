"""A recording of BlueOS and its torn half, from `inspect` over `init` to `discover`, without a channel map."""

import json
from pathlib import Path

import pytest
from blueos_files import messages_of, write_blueos
from verbs import done, inspected

from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.world import simulate_world


def _boat() -> Vehicle:
    """A BlueBoat whose thrusters take pulses, with the ends that the recording's parameters state."""
    content = load_vehicle("blueboat").to_dict()
    curve = {"kind": "table", "command": [1100.0, 1500.0, 1900.0], "force": [-35.0, 0.0, 35.0]}
    content["thrusters"] = [thruster | {"command": "pwm", "curve": curve} for thruster in content["thrusters"]]
    return vehicle_from_dict(content, "a BlueBoat driven by PWM")


@pytest.fixture(scope="module", params=["whole", "torn"])
def recording(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    world = simulate_world(_boat(), {}, programme="rich", duration=240.0, noise="field", seed=3)
    path = write_blueos(tmp_path_factory.mktemp("blueos") / "recorder_20250417.mcap", messages_of(world))
    if request.param == "torn":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return path


def test_it_is_inspected_and_a_vehicle_made_of_it(recording: Path, tmp_path: Path):
    told = " ".join(inspected("inspect", recording).split())
    assert "Usable; no defect was found" in told
    assert "SERVO3_FUNCTION ThrottleLeft" in told
    out = tmp_path / "boat.yaml"
    done("init", recording, "--mass", "22", "--length", "1.2", "--out", out, "--channels", tmp_path / "map.yaml")
    assert [thruster.channel for thruster in load_vehicle(out).thrusters] == ["pwm_port", "pwm_stbd"]
    assert "Usable; no defect was found" in " ".join(inspected("inspect", recording, "--vehicle", out).split())


def test_discover_goes_on_from_it_without_a_map(recording: Path, tmp_path: Path):
    out, run = tmp_path / "boat.yaml", tmp_path / "run"
    done("init", recording, "--mass", "22", "--length", "1.2", "--out", out, "--channels", tmp_path / "map.yaml")
    done("discover", recording, "--vehicle", out, "--out", run)
    findings = json.loads((run / "findings.json").read_text())
    # What init cannot know: thrust follows the command and not its square.
    (exponent,) = [one for one in findings["candidates"] if one["effect"] == "thrust_exponent"]
    assert exponent["terms"][0]["value"] == pytest.approx(0.5, abs=0.06)
