"""What decides between models on the same rows, and how much of the error is left, on errors that are made up."""

from collections.abc import Sequence

import numpy as np
import pytest

from undertow.comparison.recommendation import share_of_error, what_decides
from undertow.residuals.scores import Errors, RolloutErrors

RNG = np.random.default_rng(5)
LONG = RNG.uniform(0.5, 1.5, (400, 4))
EVEN = np.ones(3)


def errors(
    times: float | Sequence[float] = 1.0,
    starts: int = 400,
    diverged: int = 0,
    horizons: Sequence[str] = ("10",),
    noise: float = 0.0,
) -> Errors:
    """Rollouts every second, so many times as wrong, on each axis, of a boat whose acceleration is off by as much.

    To their squares the sensors add their noise.
    """
    by = np.append(np.broadcast_to(times, 3), 1.0)
    rolled = RolloutErrors((by**2 * LONG[:starts] + noise,), (1.0,), diverged)
    off = by[:3] * LONG[:starts, :3]
    return Errors((off,), (off,), (0.1,), dict.fromkeys(horizons, rolled), 0.0, np.full(3, noise))


@pytest.mark.parametrize("horizon", ["10", "2"])
def test_the_noise_of_the_sensors_is_no_models_error(horizon: str):
    quiet, noisy = (
        what_decides([errors(horizons=(horizon,), noise=n), errors(0.2, horizons=(horizon,), noise=n)]).squares
        for n in (0.0, 0.1)
    )
    assert np.allclose(quiet, noisy)


def test_an_error_that_may_all_be_noise_is_told_as_no_smaller_than_what_is_known_of_the_noise():
    less = what_decides([errors(noise=0.5), errors(0.0, noise=0.5)]).squares[1].mean(axis=0)
    assert less == pytest.approx(0.1 * 0.5)


def test_long_rollouts_decide_where_they_are_enough():
    assert what_decides([errors(), errors(2.0)]).what == "the speeds predicted over 10 s"
    assert what_decides([errors(starts=35), errors(2.0, starts=35)]).what == "the speeds predicted over 10 s"
    assert what_decides([errors(starts=15), errors(2.0, starts=15)]).what == ""


@pytest.mark.parametrize("times", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("horizons", [("10", "2"), ("2",), ()], ids=["10 s", "2 s", "acceleration"])
def test_the_share_of_the_error_is_that_of_the_squares(times: float, horizons: tuple[str, ...]):
    """So many times the error is its square of the squared error, whatever units the axes have."""
    one, nominal = errors(times, horizons=horizons), errors(horizons=horizons)
    for motion in (EVEN, np.array([4.0, 0.01, 0.09])):
        assert share_of_error(one, nominal, motion) == pytest.approx(times**2)


def test_each_speed_counts_by_how_much_it_varies():
    """Twice the error in surge alone: of four units more there, and as much as before on the other two."""
    surge, nominal = errors((2.0, 1.0, 1.0)), errors()
    motion = np.array([4.0, 1.0, 0.25])
    before = LONG[:, :3].mean(axis=0) / motion
    wanted = (4.0 * before[0] + before[1] + before[2]) / before.sum()
    assert share_of_error(surge, nominal, motion) == pytest.approx(wanted)
    assert share_of_error(surge, nominal, np.array([400.0, 1.0, 0.25])) < wanted


def test_the_position_follows_from_the_speeds_and_is_not_asked():
    far = errors()
    moved = RolloutErrors((LONG * (1.0, 1.0, 1.0, 100.0),), (1.0,), 0)
    other = Errors(far.measured, far.acceleration, far.step, {"10": moved}, 0.0, far.noise)
    assert share_of_error(other, far, EVEN) == pytest.approx(1.0)


def test_a_model_that_runs_away_alone_has_no_end_of_an_error():
    assert share_of_error(errors(0.5, diverged=1), errors(), EVEN) == np.inf
    assert share_of_error(errors(0.5, diverged=1), errors(diverged=2), EVEN) == pytest.approx(0.25)


def test_an_axis_on_which_nothing_moves_and_a_nominal_model_without_error_have_a_number():
    assert np.isfinite(share_of_error(errors(2.0), errors(), np.array([1.0, 0.0, 1.0])))
    assert share_of_error(errors(), errors(0.0), EVEN) > 1e6
    assert share_of_error(errors(0.0), errors(0.0), EVEN) == 0.0
