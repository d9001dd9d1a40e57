"""uSimMarine's map from thrust to speed is that of the model."""

import re
from pathlib import Path

import numpy as np
import pytest
from exported import facts

from undertow.exports.approximation import sides_of
from undertow.exports.formats import to_moos
from undertow.exports.formats.base import Given
from undertow.physics.vehicle import load_vehicle


@pytest.mark.parametrize("name", ["blueboat", "otter", "blueboat_paper"])
def test_the_map_is_that_of_the_model(name: str, tmp_path: Path):
    vehicle = load_vehicle(name).with_values({"current_east": 0.2})
    given = Given(vehicle, facts("as it is"))
    ((_, content),) = to_moos.EXPORT.files(given, tmp_path / "boat.moos").items()
    text = content.decode()
    pairs = re.search(r"^  thrust_map = (.*)$", text, re.M)
    assert pairs is not None
    percent, speed = np.array([[float(x) for x in pair.split(":")] for pair in pairs[1].split(", ")]).T
    assert (np.diff(percent) > 0).all()
    assert (np.diff(speed) > 0).all()
    assert speed[percent == 0.0].tolist() == [0.0]
    assert (percent[0], percent[-1]) == (-100.0, 100.0)
    asked = np.array([-100.0, -50.0, 30.0, 70.0, 100.0])
    expected = sides_of(vehicle, "moos").steady(asked / 100.0, asked / 100.0)[:, 0]
    np.testing.assert_allclose(np.interp(asked, percent, speed), expected, atol=0.05 * expected.max())
    assert np.interp([-100.0, 100.0], percent, speed) == pytest.approx(expected[[0, -1]], abs=1e-4)
    assert "  drift_x = 0.2\n" in text
    assert "drift_y" not in text
    assert re.search(r"half thrust from rest the model has [\d.]+ N", to_moos.EXPORT.left_out(given)[0])
