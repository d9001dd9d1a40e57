"""Whether a model loses against the one before it, on errors that are made up."""

import numpy as np
import pytest

from undertow.comparison.what_decides import loses, what_decides
from undertow.residuals.scores import Errors, RolloutErrors

RNG = np.random.default_rng(5)
LONG = RNG.uniform(0.5, 1.5, (400, 4))


def errors(times: float = 1.0, starts: int = 400, diverged: int = 0) -> Errors:
    """Rollouts every second over 10 s, so many times as wrong, of a boat whose acceleration is off by as much."""
    rolled = RolloutErrors((times**2 * LONG[:starts],), (1.0,), diverged)
    off = times * LONG[:starts, :3]
    return Errors((off,), (off,), (0.1,), {"10": rolled}, 0.0)


def test_long_rollouts_decide_where_they_are_enough():
    assert what_decides([errors(), errors(2.0)]).what == "the speeds predicted over 10 s"
    assert what_decides([errors(starts=35), errors(2.0, starts=35)]).what == "the speeds predicted over 10 s"
    assert what_decides([errors(starts=15), errors(2.0, starts=15)]).what == ""


def test_twice_the_error_loses_and_half_of_it_does_not():
    assert loses(errors(2.0), errors(), "now") == "errs 100 % more in the speeds predicted over 10 s than now"
    assert loses(errors(0.5), errors(), "now") == ""
    assert loses(errors(), errors(), "now") == ""


def test_a_model_that_runs_away_loses_whatever_its_errors():
    told = loses(errors(0.5, diverged=1), errors(), "as it is")
    assert told == "runs away within 10 s, which it does not as it is"
    assert loses(errors(0.5, diverged=1), errors(diverged=2), "as it is") == ""


@pytest.mark.parametrize(("times", "lost"), [(1.2, True), (1.009, False), (0.9, False)])
def test_few_rollouts_tell_of_a_calibration_without_being_sure(times: float, lost: bool):
    told = loses(errors(times, starts=3), errors(starts=3), "now", by_chance_too=True)
    assert told == ("errs 20 % more in the speeds predicted over 10 s than now" if lost else "")
