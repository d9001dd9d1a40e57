"""Quantiles against SciPy's."""

import pytest
from scipy.special import betainc, fdtri, stdtrit

from undertow.measurements.statistics.blocks import fisher, incomplete_beta, student

PROBABILITIES = (0.001, 0.025, 0.3, 0.5, 0.6, 0.975, 0.999, 0.9999)


@pytest.mark.parametrize("freedom", [1, 2, 3, 4.5, 7, 15, 199, 1_000])
def test_student_is_that_of_scipy(freedom: float):
    for probability in PROBABILITIES:
        assert student(freedom, probability) == pytest.approx(float(stdtrit(freedom, probability)), rel=1e-11)


@pytest.mark.parametrize("above", [1, 2, 3, 40, 500])
@pytest.mark.parametrize("below", [1, 3, 15, 2_000])
def test_fisher_is_that_of_scipy(above: int, below: int):
    for probability in PROBABILITIES:
        assert fisher(above, below, probability) == pytest.approx(float(fdtri(above, below, probability)), rel=1e-10)


def test_many_degrees_of_freedom_are_a_normal_distribution():
    assert student(1_000_000, 0.975) == pytest.approx(1.959964, abs=3e-6)


@pytest.mark.parametrize("x", [1e-9, 0.2, 0.5, 0.9, 1.0 - 1e-9])
def test_the_incomplete_beta_function_is_that_of_scipy(x: float):
    assert incomplete_beta(3.5, 0.5, x) == pytest.approx(float(betainc(3.5, 0.5, x)), rel=1e-11)
