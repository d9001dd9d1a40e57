"""Filters in the frequency domain give what the recursions of scipy give, to what both leave open at the ends."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from undertow.measurements.statistics.signals import band_pass, low_pass

STEP, PADDING = 0.05, 60


def walk(rows: int, seed: int = 0) -> np.ndarray:
    """Speeds as sensors give them: slow motion and white noise."""
    rng = np.random.default_rng(seed)
    return np.cumsum(0.02 * rng.standard_normal((rows, 3)), axis=0) + 0.02 * rng.standard_normal((rows, 3))


@pytest.mark.parametrize("rows", [400, 2003, 16411])
def test_the_same_as_forward_and_backward(rows: int):
    values = walk(rows)
    sections = butter(4, 2.0, fs=1.0 / STEP, output="sos")
    wanted = sosfiltfilt(sections, values, axis=0, padlen=PADDING)
    found = low_pass(values, STEP, 2.0, 4, PADDING)
    assert np.abs(found - wanted)[100:-100].max() < 1e-12
    assert np.abs(found - wanted).max() < 1e-3 * values.std()
    values = values - values.mean(axis=0)
    sections = butter(2, (0.15, 2.0), "bandpass", fs=1.0 / STEP, output="sos")
    wanted = sosfiltfilt(sections, values, axis=0, padlen=2 * PADDING)
    found = band_pass(values, STEP, (0.15, 2.0), 2, 2 * PADDING)
    assert np.abs(found - wanted)[150:-150].max() < 1e-3 * wanted.std()
    assert np.abs(found - wanted).max() < 0.2 * wanted.std()


def test_nothing_moves_in_time_and_one_series_is_filtered_as_a_column_is():
    time = STEP * np.arange(1200)
    values = np.sin(2.0 * np.pi * 0.4 * time)
    found = band_pass(values, STEP, (0.15, 2.0), 2, PADDING)
    assert found == pytest.approx(band_pass(values[:, None], STEP, (0.15, 2.0), 2, PADDING)[:, 0], abs=1e-14)
    assert found[200:-200] == pytest.approx(0.99 * values[200:-200], abs=0.03)


def test_what_is_left_of_stands_beside_their_lines_is_the_same():
    """A band whose longest period is far longer than what both know of the ends."""
    values = walk(600)
    sections = butter(2, (0.01, 2.0), "bandpass", fs=10.0, output="sos")
    line = np.linalg.qr(np.vander(np.arange(20.0), 2))[0]
    pieces = [
        passed.reshape(-1, 20, 3) - line @ (line.T @ passed.reshape(-1, 20, 3))
        for passed in (
            sosfiltfilt(sections, values, axis=0, padlen=50),
            band_pass(values, 0.1, (0.01, 2.0), 2, 50),
        )
    ]
    assert np.abs(pieces[0] - pieces[1])[1:-1].max() < 0.05 * pieces[0].std()


def test_a_high_order_overflows_without_a_word():
    assert np.isfinite(low_pass(walk(400), 0.005, 0.5, 12, 100)).all()


def test_a_record_as_short_as_its_padding():
    ramp = np.arange(5.0)[:, None] * np.ones(2)
    assert low_pass(ramp, STEP, 2.0, 4, 4) == pytest.approx(ramp, abs=0.4)
    assert low_pass(np.ones((5, 2)), STEP, 2.0, 4, 4) == pytest.approx(np.ones((5, 2)))
    assert low_pass(np.ones((1, 2)), STEP, 2.0, 4, 0) == pytest.approx(np.ones((1, 2)))
