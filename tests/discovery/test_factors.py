"""Factors stand for their rows exactly, add in any order, and survive a file."""

from itertools import pairwise

import numpy as np
import pysindy
import pytest

from undertow.discovery.factors import (
    Column,
    Factors,
    compress,
    ensemble,
    forward,
    read_factors,
    triangular,
    write_factors,
)
from undertow.measurements.statistics.blocks import block_draws
from undertow.physics.errors import RequestError

P, BLOCKS, ROWS = 7, 12, 400
TRUE = np.array([1.5, 0.0, 0.0, -0.7, 0.0, 0.4, 0.0])


def rows_of(seed: int) -> np.ndarray:
    """(blocks, rows, columns and two targets): columns of very different sizes, the second target nothing but noise."""
    rng = np.random.default_rng(seed)
    theta = rng.standard_normal((BLOCKS, ROWS, P)) @ (np.eye(P) + 0.3 * rng.standard_normal((P, P)))
    y = theta @ TRUE + 0.1 * rng.standard_normal((BLOCKS, ROWS))
    columns = theta * 10.0 ** np.arange(-3, P - 3)
    return np.concatenate([columns, y[..., None], rng.standard_normal((BLOCKS, ROWS, 1))], axis=2)


def factors_of(rows: np.ndarray, log: str = "a") -> Factors:
    return Factors(
        tuple(Column(name=f"x{k}", unit="m") for k in range(P)),
        (Column(name="y", unit="N"), Column(name="z", unit="N m")),
        np.stack([triangular(block) for block in rows]),
        np.full(BLOCKS, ROWS),
        np.zeros(BLOCKS, dtype=int),
        (log,),
        {"stride": 0.2, "vehicle": "abc"},
    )


def test_least_squares_on_a_factor_is_that_on_all_rows():
    rows = rows_of(0)
    flat, whole = rows.reshape(-1, P + 2), factors_of(rows).whole
    expected = np.linalg.lstsq(flat[:, :P], flat[:, P:], rcond=None)[0]
    found = np.linalg.lstsq(whole[:, :P], whole[:, P:], rcond=None)[0]
    np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_a_factor_keeps_what_a_gram_matrix_loses():
    """Two columns that differ by 1e-9: squared, the difference is below rounding."""
    rng = np.random.default_rng(1)
    x = rng.standard_normal(100_000)
    rows = np.column_stack([x, x + 1e-9 * rng.standard_normal(x.size), x])
    factor = triangular(rows)
    assert factor[1, 1] == pytest.approx(1e-9 * np.sqrt(x.size), rel=0.01)
    assert np.linalg.matrix_rank(rows.T @ rows, tol=1e-9) == 1


def test_rows_in_parts_of_any_length_give_one_factor():
    flat = rows_of(2).reshape(-1, P + 2)
    edges = [0, 3, 5, 1000, 1001, flat.shape[0]]
    factor, count = compress(flat[a:b] for a, b in pairwise(edges))
    assert count == flat.shape[0]
    np.testing.assert_allclose(factor, triangular(flat), rtol=1e-9, atol=1e-9 * np.abs(factor).max())
    assert np.array_equal(factor, np.triu(factor))
    assert (np.diag(factor) >= 0.0).all()


def test_fewer_rows_than_columns_still_make_a_square():
    rows = rows_of(3)[0, :4]
    np.testing.assert_allclose(triangular(rows).T @ triangular(rows), rows.T @ rows, atol=1e-9)


def test_no_rows_are_refused():
    with pytest.raises(RequestError, match="expected rows, got none"):
        compress([])


def test_a_draw_of_blocks_is_the_factor_of_their_rows():
    rows, counts = rows_of(4), np.array([0, 2, 1, 0, 3, 1, 1, 0, 1, 1, 1, 1], dtype=float)
    drawn = np.concatenate([rows[k] for k in np.repeat(np.arange(BLOCKS), counts.astype(int))])
    np.testing.assert_allclose(factors_of(rows).drawn(counts), triangular(drawn), rtol=1e-9, atol=1e-6)


def test_some_columns_are_the_factors_of_these():
    rows = rows_of(5)
    some = factors_of(rows).only([4, 1])
    assert [column.name for column in some.columns] == ["x4", "x1"]
    np.testing.assert_allclose(some.whole, triangular(rows[..., [4, 1, P, P + 1]].reshape(-1, 4)), rtol=1e-9, atol=1e-6)


def test_factors_add_in_any_order_to_the_last_bit():
    a, b, c = factors_of(rows_of(6), "c"), factors_of(rows_of(7), "a"), factors_of(rows_of(8), "b")
    one, other = (a + b) + c, c + (b + a)
    assert one.logs == other.logs == ("a", "b", "c")
    assert np.array_equal(one.r, other.r)
    assert np.array_equal(one.log, np.repeat([0, 1, 2], BLOCKS))
    every = np.concatenate([rows_of(seed) for seed in (7, 8, 6)]).reshape(-1, P + 2)
    np.testing.assert_allclose(one.whole, triangular(every), rtol=1e-9, atol=1e-6)


def test_what_does_not_belong_together_does_not_add():
    one = factors_of(rows_of(9))
    with pytest.raises(RequestError, match="each log once, got the one with SHA-256 a in both"):
        one + factors_of(rows_of(9))
    other = factors_of(rows_of(9), "b")
    other.settings["vehicle"] = "xyz"  # type: ignore[index]
    with pytest.raises(RequestError, match="same settings in both, got vehicle abc and xyz"):
        one + other
    with pytest.raises(RequestError, match="same columns in both, got 7 and 2 of them"):
        one + factors_of(rows_of(9), "b").only([0, 1])


@pytest.mark.filterwarnings("ignore:Sparsity parameter is too big")
def test_an_ensemble_is_that_of_pysindy_on_the_drawn_rows():
    rows = rows_of(10)
    found = ensemble(factors_of(rows), 0.2, ridge=0.001, draws=5, seed=3)
    size = np.sqrt((rows[..., :P] ** 2).mean(axis=(0, 1)))
    for counts, models in zip(block_draws(BLOCKS, 5, 3), found.coefficients, strict=True):
        drawn = np.concatenate([rows[k] for k in np.repeat(np.arange(BLOCKS), counts.astype(int))])
        level = np.sqrt((drawn[:, P:] ** 2).mean(axis=0))
        for target, model in enumerate(models):
            optimizer = pysindy.STLSQ(threshold=0.2, alpha=0.001 * drawn.shape[0], max_iter=P + 1)
            optimizer.fit(drawn[:, :P] / size, drawn[:, P + target] / level[target])
            np.testing.assert_allclose(model, optimizer.coef_[0] * level[target] / size, rtol=1e-8)
    assert found.inclusion[0].tolist() == (TRUE != 0.0).tolist()
    assert not found.inclusion[1].any()
    np.testing.assert_allclose(found.median[0], TRUE / 10.0 ** np.arange(-3, P - 3), rtol=0.15, atol=0.0)


def test_few_blocks_are_no_ensemble():
    few = factors_of(rows_of(11))
    few = Factors(few.columns, few.targets, few.r[:3], few.rows[:3], few.log[:3], few.logs, few.settings)
    with pytest.raises(RequestError, match="at least 4 blocks to draw from, got 3"):
        ensemble(few, 0.1)


def test_forward_selection_takes_what_the_target_is_made_of():
    assert forward(factors_of(rows_of(12)), 0, 3) == np.flatnonzero(TRUE).tolist()


def test_a_file_holds_all_of_it_and_equal_factors_are_equal_files(tmp_path):
    factors = factors_of(rows_of(13)) + factors_of(rows_of(14), "b")
    first = write_factors(factors, tmp_path / "one.npz").read_bytes()
    again = read_factors(tmp_path / "one.npz")
    assert write_factors(again, tmp_path / "two.npz").read_bytes() == first
    assert np.array_equal(again.r, factors.r)
    for what in ("columns", "targets", "logs", "settings"):
        assert getattr(again, what) == getattr(factors, what)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"r": np.zeros((2 * BLOCKS, 3, 3))}, "expected factors of 9 by 9 numbers"),
        ({"rows": np.zeros(3, dtype=int)}, "a number of rows for each of 24 blocks"),
        ({"rows": np.zeros(2 * BLOCKS, dtype=int)}, "expected blocks with rows"),
        ({"r": np.full((2 * BLOCKS, 9, 9), np.triu(np.full((9, 9), 1e200)))}, "expected upper triangular factors"),
        ({"log": np.full(2 * BLOCKS, 2)}, "of logs that are listed"),
        ({"r": np.full((2 * BLOCKS, 9, 9), 1.0)}, "expected upper triangular factors"),
        ({"r": np.array(["x"])}, "not readable as factors"),
        ({"r": np.array([{"a": 1}], dtype=object)}, "not readable as factors"),
        ({"about": np.frombuffer(b'{"schema": "undertow.factors/9"}', dtype=np.uint8)}, "undertow.factors/1"),
        ({"about": np.frombuffer(b"no json", dtype=np.uint8)}, "not readable as factors"),
    ],
)
def test_a_file_that_does_not_hold_factors_is_refused(tmp_path, change, told):
    factors = factors_of(rows_of(13)) + factors_of(rows_of(14), "b")
    path = write_factors(factors, tmp_path / "one.npz")
    with np.load(path) as held:
        arrays = dict(held)
    np.savez(path, **(arrays | change), allow_pickle=True)
    with pytest.raises(RequestError, match=told):
        read_factors(path)


def test_a_packed_file_is_refused(tmp_path):
    path = write_factors(factors_of(rows_of(13)), tmp_path / "one.npz")
    with np.load(path) as held:
        np.savez_compressed(path, **dict(held))
    with pytest.raises(RequestError, match="got it packed"):
        read_factors(path)
