"""Headings that lines drew through their wrap: their rows are left out, and turns that were sailed stay."""

import numpy as np
import pytest

from undertow.measurements.log import Log
from undertow.physics.errors import LogError

TIME = np.arange(0.0, 120.0, 0.05)
TURNING = 0.25 * TIME + 0.6 * np.sin(0.3 * TIME)


def read(psi: np.ndarray) -> Log:
    return Log.from_arrays(TIME, {"x": np.zeros(TIME.size), "y": TIME, "psi": psi})


def drawn(full: float, low: float, every: int) -> np.ndarray:
    """The heading within one turn from `low` on, at every so many stamps, drawn to all of them by straight lines."""
    psi = (TURNING * full / (2.0 * np.pi) - low) % full + low
    return np.interp(TIME, TIME[::every], psi[::every])


@pytest.mark.parametrize("every", [3, 5, 10])
@pytest.mark.parametrize(("full", "low"), [(2.0 * np.pi, -np.pi), (2.0 * np.pi, 0.0), (360.0, 0.0)])
def test_rows_between_the_ends_are_left_out(full, low, every):
    log = read(drawn(full, low, every))
    kept, known = log.channels["psi"], TIME[::every][-1]
    error = np.abs(np.exp(2j * np.pi * kept.value / full) - np.exp(1j * np.interp(kept.time, TIME, TURNING)))
    assert error[kept.time <= known].max() < 0.02
    assert kept.time.size > 0.95 * TIME.size
    assert any("through the wrap of the heading" in note for note in log.notes)


@pytest.mark.parametrize("low", [-np.pi, 0.0, -0.5 * np.pi])
def test_rows_between_the_ends_are_left_out_where_a_quaternion_holds_the_heading(low):
    half = 0.5 * drawn(2.0 * np.pi, low, 5)
    table = {"qx": 0.0 * TIME, "qy": 0.0 * TIME, "qz": np.sin(half), "qw": np.cos(half)}
    log = Log.from_arrays(TIME, {"x": np.zeros(TIME.size), "y": TIME, **table})
    kept, known = log.channels["psi"], TIME[::5][-1]
    error = np.abs(np.exp(1j * kept.value) - np.exp(1j * np.interp(kept.time, TIME, TURNING)))
    assert error[kept.time <= known].max() < 0.02
    assert TIME.size > kept.time.size > 0.95 * TIME.size


def test_a_heading_that_wraps_as_it_should_keeps_every_row():
    log = read(np.angle(np.exp(1j * TURNING)))
    assert log.channels["psi"].value.size == TIME.size
    assert not any("wrap" in note for note in log.notes)


def test_a_boat_that_spins_quickly_keeps_every_row():
    log = read(np.angle(np.exp(1j * 3.0 * TIME)))
    assert log.channels["psi"].value.size == TIME.size


def test_percent_for_a_share_is_told_with_the_line_that_mends_it():
    table = {"psi": TURNING, "normalized_port": 40.0 * np.sin(TIME)}
    with pytest.raises(LogError, match="'normalized_port: {from: normalized_port, unit: percent}'"):
        Log.from_arrays(TIME, table)
