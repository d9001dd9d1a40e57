"""Factors of logs: what a vehicle leaves unexplained, as a file that adds to others."""

import numpy as np
import pytest

import undertow
from undertow.physics.errors import RequestError
from undertow.physics.worlds.world import simulate_world


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    for seed in (1, 2):
        drag = {"surge_quadratic_damping": -6.0}
        world = simulate_world(undertow.load_vehicle("blueboat"), drag, duration=120.0, seed=seed, noise="clean")
        world.write(folder / f"{seed}.csv")
    return [folder / "1.csv", folder / "2.csv"]


def test_two_logs_are_the_sum_of_each(logs):
    both, one, other = (undertow.compress(paths, "blueboat") for paths in (logs, logs[0], logs[1]))
    total = one + other
    assert np.array_equal(both.r, total.r)
    assert both.logs == total.logs
    units = {column.name: column.unit for column in both.columns}
    assert (units["u|u|"], units["ur"], units["r^2"]) == ("(m/s)^2", "m/s rad/s", "(rad/s)^2")
    assert [target.unit for target in both.targets] == ["N", "N", "N m"]


def test_the_missing_drag_is_in_them(logs):
    factors = undertow.compress(logs, "blueboat", degree=2)
    names = [column.name for column in factors.columns]
    only = factors.only([names.index("u|u|")])
    assert only.whole[0, 1] / only.whole[0, 0] == pytest.approx(-6.0, rel=0.02)


def test_factors_of_another_vehicle_do_not_add(logs):
    heavy = undertow.load_vehicle("blueboat").with_values({"X_u": -12.0})
    with pytest.raises(RequestError, match="same settings in both, got vehicle"):
        undertow.compress(logs[0], "blueboat") + undertow.compress(logs[1], heavy)


def test_a_log_of_hours_is_worked_on_in_pieces(tmp_path, monkeypatch):
    from undertow.workflows import compress

    log = tmp_path / "long.csv"
    simulate_world(undertow.load_vehicle("blueboat"), {}, duration=400.0, seed=3, noise="clean").write(log)
    whole = undertow.compress(log, "blueboat")
    monkeypatch.setattr(compress, "_PIECE", 100.0)
    pieces = undertow.compress(log, "blueboat")
    assert 0 < whole.rows.sum() - pieces.rows.sum() < 0.05 * whole.rows.sum()
    np.testing.assert_allclose(np.diag(pieces.whole)[:5] ** 2, np.diag(whole.whole)[:5] ** 2, rtol=0.1)
