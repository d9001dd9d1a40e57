"""Quantiles against closed forms."""

from math import atan, pi, sqrt, tan

import pytest

from undertow.measurements.statistics.blocks import beyond_student, fisher, student

PROBABILITIES = (0.001, 0.025, 0.3, 0.5, 0.6, 0.975, 0.999, 0.9999)


@pytest.mark.parametrize("p", PROBABILITIES)
def test_student_with_one_degree_of_freedom_is_cauchy_and_with_two_a_root(p: float):
    assert student(1, p) == pytest.approx(tan(pi * (p - 0.5)), rel=1e-11, abs=1e-15)
    assert student(2, p) == pytest.approx((2.0 * p - 1.0) / sqrt(2.0 * p * (1.0 - p)), rel=1e-11, abs=1e-15)


@pytest.mark.parametrize("below", [1, 3, 15, 2_000])
@pytest.mark.parametrize("p", PROBABILITIES)
def test_fisher_with_two_degrees_of_freedom_above_is_a_power(below: int, p: float):
    assert fisher(2, below, p) == pytest.approx(0.5 * below * ((1.0 - p) ** (-2.0 / below) - 1.0), rel=1e-9)


@pytest.mark.parametrize("freedom", [1, 3, 15, 2_000])
@pytest.mark.parametrize("p", PROBABILITIES)
def test_fisher_with_one_is_the_square_of_student(freedom: int, p: float):
    assert fisher(1, freedom, p) == pytest.approx(student(freedom, 0.5 + 0.5 * p) ** 2, rel=1e-9)


def test_many_degrees_of_freedom_are_a_normal_distribution():
    assert student(1_000_000, 0.975) == pytest.approx(1.959964, abs=3e-6)


@pytest.mark.parametrize("value", [-30.0, -1.0, 0.0, 0.5, 40.0])
def test_the_chance_beyond_is_that_of_cauchy(value: float):
    assert beyond_student(1, value) == pytest.approx(0.5 - atan(value) / pi, rel=1e-9)
