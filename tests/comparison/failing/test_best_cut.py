"""The cuts of the tree of failing places: those that a search of all thresholds finds."""

import numpy as np
import pytest

from undertow.comparison.failing.places import best_cut


def left_over(column: np.ndarray, target: np.ndarray, threshold: float) -> float:
    """Squared error about the means of both sides."""
    sides = (target[column <= threshold], target[column > threshold])
    return sum(float(((side - side.mean()) ** 2).sum()) for side in sides)


@pytest.mark.parametrize("seed", range(5))
def test_no_other_threshold_leaves_less(seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns, least = rng.normal(size=(120, 4)), 10
    columns[:, 3] = rng.random(120) > 0.5
    target = np.where(columns[:, 1] > 0.4, 3.0, 1.0) + rng.normal(size=120)
    cut = best_cut(columns, target, least)
    assert cut is not None
    tried = {
        (k, between): left_over(columns[:, k], target, between)
        for k in range(4)
        for between in (np.sort(columns[:, k])[least - 1 : -least] + np.sort(columns[:, k])[least : 1 - least]) / 2.0
        if least <= (columns[:, k] <= between).sum() <= 120 - least
    }
    assert tried[cut] == pytest.approx(min(tried.values()), rel=1e-9)
    assert cut[0] == 1


def test_a_quantity_goes_before_its_modulus() -> None:
    rng = np.random.default_rng(1)
    speed = rng.uniform(0.0, 2.0, 300)
    for columns in ((speed, np.abs(speed)), (-speed, speed)):
        cut = best_cut(np.column_stack(columns), np.where(speed > 1.2, 5.0, 1.0) + 0.1 * rng.normal(size=300), 5)
        assert cut is not None
        assert cut[0] == 0


@pytest.mark.parametrize(
    ("columns", "target", "least"),
    [
        ([[0.0], [1.0], [2.0]], [1.0, 1.0, 1.0], 1),
        ([[1.0], [1.0], [1.0]], [1.0, 2.0, 3.0], 1),
        ([[0.0], [1.0], [2.0]], [1.0, 2.0, 3.0], 2),
    ],
)
def test_there_is_no_cut_where_nothing_is_to_be_parted(
    columns: list[list[float]], target: list[float], least: int
) -> None:
    assert best_cut(np.array(columns), np.array(target), least) is None
