"""Speed and course over ground of a receiver become surge and sway where the log has none of its own."""

from pathlib import Path

import numpy as np
import pytest

from undertow.measurements.log import read_log

ROWS = 200
TIME = 0.1 * np.arange(ROWS)
HEADING = 0.02 * np.arange(ROWS)
SPEED = 1.0 + 0.2 * np.sin(TIME)
DRIFT = 0.1
"""Angle of the course off the heading [rad]."""


def written(path: Path, **columns: np.ndarray) -> Path:
    """A table of a boat that turns and drifts a little."""
    table = {"t": TIME, "psi": HEADING, "pwm_port": np.full(ROWS, 1600.0), "pwm_stbd": np.full(ROWS, 1600.0), **columns}
    rows = np.column_stack(list(table.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(table), comments="", fmt="%.9f")
    return path


@pytest.mark.parametrize(
    ("names", "speed", "angle"),
    [
        (("sog", "cog"), 1.0, 1.0),
        (("sog", "cog"), 1.0, 180.0 / np.pi),
        (("sog_mps", "cog_deg"), 1.0, 180.0 / np.pi),
        (("speed_over_ground_knots", "course_over_ground_rad"), 3600.0 / 1852.0, 1.0),
    ],
    ids=["as channels", "in degrees", "with units", "knots"],
)
def test_they_become_surge_and_sway(tmp_path: Path, names: tuple[str, str], speed: float, angle: float):
    course = (HEADING + DRIFT) % (2.0 * np.pi)
    path = written(tmp_path / "log.csv", **{names[0]: SPEED * speed, names[1]: course * angle})
    log = read_log(path)
    assert log.channels["u"].value == pytest.approx(SPEED * np.cos(DRIFT), abs=1e-6)
    assert log.channels["v"].value == pytest.approx(SPEED * np.sin(DRIFT), abs=1e-6)
    assert "sog" not in log.channels


def test_a_course_that_says_its_unit_may_go_on_beyond_a_full_turn(tmp_path: Path):
    course = np.linspace(0.0, 9.0, ROWS)
    turned = {"psi": course, "sog_mps": SPEED, "cog_rad": course}
    log = read_log(written(tmp_path / "log.csv", **turned))
    assert log.channels["u"].value == pytest.approx(SPEED, abs=1e-6)


def test_what_the_log_says_of_surge_and_sway_goes_first(tmp_path: Path):
    own = {"u": np.full(ROWS, 2.0), "v": np.zeros(ROWS)}
    log = read_log(written(tmp_path / "log.csv", **own, sog=SPEED, cog=HEADING))
    assert log.channels["u"].value == pytest.approx(2.0)
    assert any("speed and course are not used" in note for note in log.notes)


def test_speed_without_a_course_is_no_velocity_and_is_told(tmp_path: Path):
    place = {"x": np.cumsum(0.1 * SPEED), "y": np.zeros(ROWS)}
    log = read_log(written(tmp_path / "log.csv", **place, sog=SPEED))
    assert "u" not in log.channels
    assert any("sog alone" in note for note in log.notes)
