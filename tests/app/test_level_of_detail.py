"""What a screen shows of a long series: no extreme is lost, no gap is closed, and it takes no time."""

import time as clock
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from places import slowness

from undertow.app.plots.level_of_detail import BLOCK, TORN, Levels, thinned
from undertow.physics.motion import Array

ROWS = 4000
TIME: Array = (0.1 * np.arange(ROWS)).astype(np.float64)
MOST = 0.1 * ROWS


def noise(seed: int, gaps: int = 0) -> Array:
    rng = np.random.default_rng(seed)
    column = rng.normal(size=ROWS)
    for begin in rng.integers(0, ROWS, gaps):
        column[begin : begin + rng.integers(1, 80)] = np.nan
    return column


WINDOWS = st.tuples(st.floats(-20.0, MOST + 20.0), st.floats(1.0, MOST), st.integers(3, 300), st.integers(0, 5))


@settings(deadline=None)
@given(WINDOWS)
def test_the_extremes_of_every_series_survive(drawn: tuple[float, float, int, int]):
    begin, span, width, gaps = drawn
    columns = {"one": noise(1, gaps), "other": noise(2)}
    inside = (begin <= TIME) & (begin + span >= TIME)
    for found in (
        thinned(TIME, columns, begin, begin + span, width),
        Levels(TIME, columns).window(begin, begin + span, width),
    ):
        times, thin = found
        assert np.all(np.diff(times) >= 0.0)
        assert len(times) <= 3 * width + 2
        for name, column in columns.items():
            assert len(thin[name]) == len(times)
            if np.isfinite(column[inside]).any():
                assert np.nanmax(thin[name]) >= np.nanmax(column[inside])
                assert np.nanmin(thin[name]) <= np.nanmin(column[inside])


@given(WINDOWS)
def test_every_column_of_pixels_has_its_own_extremes(drawn: tuple[float, float, int, int]):
    begin, span, width, _ = drawn
    column = noise(3)
    times, thin = thinned(TIME, {"one": column}, begin, begin + span, width)
    edges = np.linspace(begin, begin + span, width + 1)
    edges[-1] = np.nextafter(edges[-1], np.inf)  # the last column has the window's end
    for low, high in pairwise(edges):
        rows = column[(low <= TIME) & (high > TIME)]
        if rows.size:
            shown = thin["one"][(times >= low) & (times < high)]
            assert shown.max() >= rows.max()
            assert shown.min() <= rows.min()


def test_few_rows_come_back_as_they_are_with_one_beyond_each_end():
    column = noise(4)
    times, thin = thinned(TIME, {"one": column}, 100.05, 109.95, 500)
    np.testing.assert_array_equal(times, TIME[1000:1101])
    np.testing.assert_array_equal(thin["one"], column[1000:1101])


def test_two_points_a_column_share_their_times_among_all_series():
    times, thin = thinned(TIME, {"up": TIME, "down": -TIME}, 0.0, TIME[-1], 100)
    assert len(times) == 200
    np.testing.assert_array_equal(thin["up"], times)
    np.testing.assert_array_equal(thin["down"], -times)


def test_a_wide_gap_stays_as_wide():
    column = np.where((TIME > 100.0) & (TIME < 200.0), np.nan, 1.0)
    for found in (
        thinned(TIME, {"one": column}, 0.0, MOST, 400),
        thinned(TIME, {"one": column}, 0.0, MOST, 20),
        Levels(TIME, {"one": column}).window(0.0, MOST, 20),
    ):
        times, thin = found
        gone = times[np.isnan(thin["one"])]
        assert len(gone)
        assert 100.0 < gone.min() < 100.0 + 2 * MOST / 20
        assert 200.0 - 2 * MOST / 20 < gone.max() < 200.0


@pytest.mark.parametrize("first", [0, 1, 5, 9])
def test_the_gap_between_two_rollouts_is_seen_wherever_it_lies_in_a_pixel(first: int):
    column = (np.arange(ROWS) - first) % 100 / 100.0
    column[first::100] = np.nan
    times, thin = thinned(TIME, {"rollout": column, "measured": TIME}, 0.0, MOST, ROWS // 10)
    falls = np.diff(thin["rollout"]) < -0.5
    assert not falls.any(), "the end of one rollout is tied to the begin of the next"
    assert np.isnan(thin["rollout"]).sum() >= ROWS // 100 - 1
    assert np.isfinite(thin["measured"]).all()
    np.testing.assert_allclose(thin["measured"], times, atol=1.1)


def test_gaps_too_narrow_to_be_seen_do_not_break_the_line():
    column = np.where(np.arange(ROWS) % 10 == 0, np.nan, 1.0)
    _, thin = thinned(TIME, {"one": column}, 0.0, MOST, ROWS // TORN // 2)
    assert np.isfinite(thin["one"]).all()


def test_columns_are_replaced_and_others_stay():
    levels = Levels(TIME, {"one": noise(5), "other": noise(6)})
    before = levels.window(0.0, MOST, 10)[1]["one"]
    levels.replace({"other": TIME})
    after = levels.window(0.0, MOST, 10)[1]
    np.testing.assert_array_equal(after["one"], before)
    assert after["other"].max() == TIME[-1]


def test_a_column_of_another_length_is_refused():
    with pytest.raises(ValueError, match=r"column 'one' has the shape \(3,\), the time \(4000,\)"):
        Levels(TIME, {"one": np.zeros(3)})


@pytest.mark.parametrize("rows", [0, 1, 2, BLOCK, BLOCK + 1])
def test_short_series_are_no_trouble(rows: int):
    time = np.arange(float(rows))
    times, thin = Levels(time, {"one": time}).window(0.0, float(rows), 3)
    assert len(times) == len(thin["one"]) <= max(rows, 6)


@pytest.mark.parametrize("share", [1.0, 0.13, 0.1, 0.01])
def test_half_a_million_rows_take_about_a_millisecond(share: float):
    time: Array = (0.1 * np.arange(500_000)).astype(np.float64)
    rng = np.random.default_rng(7)
    levels = Levels(time, {name: rng.normal(size=len(time)) for name in "abc"})
    taken = []
    for begin in np.linspace(0.0, (1.0 - share) * time[-1], 9):
        started = clock.perf_counter()
        levels.window(begin, begin + share * time[-1], 1000)
        taken.append(clock.perf_counter() - started)
    assert min(taken) < 4e-3 * slowness(), "it takes 1 ms where nothing else runs"
