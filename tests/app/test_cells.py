"""Rows sorted into the cells of the map of failure."""

import numpy as np

from undertow.app.plots.error_map import common_command, sort_rows

RNG = np.random.default_rng(4)
U, R = RNG.uniform(-1.0, 2.0, 5000), RNG.uniform(-0.5, 0.5, 5000)


def test_the_error_of_a_cell_is_that_of_its_rows():
    force = np.where(U > 1.0, 3.0, 1.0)
    found = sort_rows(U, R)
    error, count = found.error(force)
    assert error.shape == count.shape == found.shape
    middles = 0.5 * (found.edges[0][1:] + found.edges[0][:-1])
    np.testing.assert_allclose(error[middles > 1.3], 3.0)
    np.testing.assert_allclose(error[middles < 0.7], 1.0)
    assert 0.98 * U.size < count.sum() <= U.size


def test_a_cell_with_few_rows_has_no_error():
    found = sort_rows(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), np.zeros(7))
    error, count = found.error(np.ones(7))
    assert np.isnan(error[count < 5]).all()
    assert (error[count >= 5] == 1.0).all()


def test_rows_without_a_number_lie_in_no_cell():
    found = sort_rows(np.array([np.nan, 1.0, 2.0]), np.array([0.0, np.nan, 1.0]))
    assert (found.cell[:2] == -1).all()


def test_picked_cells_become_stretches_of_time():
    time = np.arange(0.0, 100.0, 0.1)
    across = np.where((time > 20.0) & (time < 30.0) | (time > 60.0) & (time < 61.0), 1.0, 0.0)
    found = sort_rows(across + 1e-6 * np.sin(time), np.zeros_like(time))
    high = [(found.shape[0] - 1, y) for y in range(found.shape[1])]
    stretches = found.stretches(time, high)
    assert len(stretches) == 2
    np.testing.assert_allclose(stretches, [(20.1, 29.9), (60.1, 60.9)], atol=0.11)
    assert found.stretches(time, []) == ()


def test_commands_count_from_their_neutral_in_shares_of_their_largest():
    table = {"pwm_port": np.array([1500.0, 1700.0, 1400.0]), "newton_stbd": np.array([0.0, 30.0, -60.0])}
    np.testing.assert_allclose(common_command(table, ["pwm_port", "newton_stbd"]), [0.0, 0.75, -0.75])
