"""What decides between models on the same rows, and how much of the error is left, on errors that are made up."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from undertow.comparison.audit import Audit
from undertow.comparison.facts import Grounds
from undertow.comparison.recommendation import best, shares_of_error, what_decides
from undertow.physics.laws.audit.base import Ruling
from undertow.physics.laws.damping_power import Envelope
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.models.base import Model, VehicleModel, ZeroAcceleration
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


def test_where_errors_grow_shorter_rollouts_decide():
    """A hull that turns by itself: over 10 s its own model errs more than a damped one, by all that is not known.

    Where noise alone would turn it and did not, or where an error grows that is no start's, 10 s decide.
    """
    long, brief = (errors(times, horizons=("10", "2")).rollouts["10"] for times in (1.0, 0.2))
    known, damped = errors(horizons=("10", "2")), errors(1.5, horizons=("10", "2"))
    for started, error, horizon in ((20.0, brief, "2"), (1.2, brief, "10"), (20.0, long, "10")):
        noise = 1e-4 * LONG.mean(axis=0)
        rollouts = {"10": replace(long, started=started * noise), "2": replace(error, started=noise)}
        decided = what_decides([replace(known, rollouts=rollouts), damped])
        assert decided.horizon == horizon
        assert ("unstable" in decided.what) == (horizon == "2")
    share = shares_of_error(
        [replace(known, rollouts={"10": replace(long, started=20.0 * noise), "2": brief}), damped], EVEN
    )
    assert share[1] == pytest.approx((1.5 / 0.2) ** 2)


def test_no_model_errs_less_than_half_of_what_noise_of_the_starts_makes():
    started = 0.4 * LONG.mean(axis=0)
    by_noise = errors(0.7, horizons=("2",))
    by_noise = replace(by_noise, rollouts={"2": replace(by_noise.rollouts["2"], started=started)})
    left = [squares.mean(axis=0) for squares in what_decides([by_noise, errors(0.1, horizons=("2",))]).squares]
    assert left[0] == pytest.approx(np.maximum(0.49 - 0.4, 0.2) * LONG[:, :3].mean(axis=0))
    assert left[1] == pytest.approx(0.01 * LONG[:, :3].mean(axis=0))  # whose starts make nothing, and so much is sure


@pytest.mark.parametrize("times", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("horizons", [("10", "2"), ("2",), ()], ids=["10 s", "2 s", "acceleration"])
def test_the_share_of_the_error_is_that_of_the_squares(times: float, horizons: tuple[str, ...]):
    """So many times the error is its square of the squared error, whatever units the axes have."""
    one, nominal = errors(times, horizons=horizons), errors(horizons=horizons)
    for motion in (EVEN, np.array([4.0, 0.01, 0.09])):
        assert shares_of_error([nominal, one], motion)[1] == pytest.approx(times**2)


def test_each_speed_counts_by_how_much_it_varies():
    """Twice the error in surge alone: of four units more there, and as much as before on the other two."""
    surge, nominal = errors((2.0, 1.0, 1.0)), errors()
    motion = np.array([4.0, 1.0, 0.25])
    before = LONG[:, :3].mean(axis=0) / motion
    wanted = (4.0 * before[0] + before[1] + before[2]) / before.sum()
    assert shares_of_error([nominal, surge], motion)[1] == pytest.approx(wanted)
    assert shares_of_error([nominal, surge], np.array([400.0, 1.0, 0.25]))[1] < wanted


def test_the_position_follows_from_the_speeds_and_is_not_asked():
    far = errors()
    moved = RolloutErrors((LONG * (1.0, 1.0, 1.0, 100.0),), (1.0,), 0)
    other = Errors(far.measured, far.acceleration, far.step, {"10": moved}, 0.0, far.noise)
    assert shares_of_error([far, other], EVEN)[1] == pytest.approx(1.0)


def test_a_model_that_runs_away_alone_has_no_end_of_an_error():
    assert shares_of_error([errors(), errors(0.5, diverged=1)], EVEN)[1] == np.inf
    assert shares_of_error([errors(diverged=2), errors(0.5, diverged=1)], EVEN)[1] == pytest.approx(0.25)


def test_an_axis_on_which_nothing_moves_and_a_nominal_model_without_error_have_a_number():
    assert np.isfinite(shares_of_error([errors(), errors(2.0)], np.array([1.0, 0.0, 1.0]))[1])
    assert shares_of_error([errors(0.0), errors()], EVEN)[1] > 1e6
    assert shares_of_error([errors(0.0), errors(0.0)], EVEN)[1] == 0.0


HULL = load_vehicle("blueboat")
ENVELOPE = Envelope((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
LAWLESS = Audit("", "", ENVELOPE, "", (Ruling(law="dissipation", verdict="fail", proof="", sentence=""),))


def gusty(times: float, seed: int = 1) -> Errors:
    """So many times as wrong on average, and on some minutes much more or less: its difference to others is chance."""
    calm = errors(times)
    minutes = np.exp(2.5 * np.random.default_rng(seed).normal(size=7)).repeat(60)[:400, None]
    squares = calm.rollouts["10"].squares[0] * minutes
    squares *= calm.rollouts["10"].squares[0].mean(axis=0) / squares.mean(axis=0)
    return Errors(
        calm.measured, calm.acceleration, calm.step, {"10": RolloutErrors((squares,), (1.0,), 0)}, 0.0, calm.noise
    )


def model(name: str, parameters: int = 3) -> Model:
    return ZeroAcceleration(HULL) if name == "zero acceleration" else VehicleModel(HULL, name, parameters=parameters)


GUESS = "zero acceleration"
ABOUT = r" \((?:> )?\d+ (?:% (?:less|more) )?to (?:> )?\d+ %(?: more| less)?\)"
LESS = rf"% less than nominal{ABOUT}"
WHAT = " in the speeds predicted over 10 s"
KNOWS_NOTHING = "zero acceleration, a guess that knows nothing of the boat,"
NONE = "rust none of the models on these rows"
CASES = {
    "better": (
        {"nominal": errors(), "run": errors(0.2), GUESS: errors(3.0)},
        ("run", Grounds.BETTER),
        rf"Trust run:{WHAT} it errs 80 {LESS}, and it keeps the laws of a hull\.",
    ),
    "better, than a guess by chance": (
        {"nominal": errors(), "run": errors(0.2), GUESS: gusty(0.3)},
        ("run", Grounds.BETTER),
        rf"Trust run:{WHAT} it errs 80 {LESS}, and it keeps the laws of a hull\. "
        rf"run errs 33 % less than {KNOWS_NOTHING} which may be chance{ABOUT}\.",
    ),
    "better, and a guess better still": (
        {"nominal": errors(), "run": errors(0.5), GUESS: errors(0.4)},
        ("", Grounds.GUESS),
        rf"run errs 50 {LESS}{WHAT}, but {KNOWS_NOTHING} errs 20 % less than run{ABOUT}: t{NONE}\.",
    ),
    "a guess better": (
        {"nominal": errors(), "run": errors(), GUESS: errors(0.4)},
        ("", Grounds.GUESS),
        rf"T{NONE}: {KNOWS_NOTHING} errs 60 {LESS}{WHAT}\.",
    ),
    "a guess better by chance": (
        {"nominal": errors(), GUESS: gusty(0.8)},
        ("", Grounds.GUESS),
        rf"T{NONE}: {KNOWS_NOTHING} errs 20 {LESS}{WHAT}, which may be chance\.",
    ),
    "better, and breaks a law": (
        {"nominal": errors(), "wild": errors(0.2), GUESS: errors(3.0)},
        ("nominal", Grounds.LAWFUL),
        rf"wild errs 80 {LESS}{WHAT}, but breaks dissipation: trust nominal, which keeps the laws of a hull\.",
    ),
    "another breaks a law": (
        {"nominal": errors(), "run": errors(0.5), "wild": errors(0.2), GUESS: errors(3.0)},
        ("run", Grounds.LAWFUL),
        rf"wild errs 80 {LESS}{WHAT}, but breaks dissipation: trust run, which keeps the laws of a hull and errs 50 "
        rf"{LESS}\.",
    ),
    "breaks a law, and a guess better than the others": (
        {"nominal": errors(), "wild": errors(0.2), GUESS: errors(0.4)},
        ("", Grounds.GUESS),
        rf"wild errs 80 {LESS}{WHAT}, but breaks dissipation: t{NONE}\. Of models that keep the laws, nominal is the "
        rf"best, and {KNOWS_NOTHING} errs 60 {LESS}\.",
    ),
    "breaks a law, and no better": (
        {"nominal": errors(), "wild": gusty(0.9), GUESS: errors(3.0)},
        ("nominal", Grounds.NONE_BETTER),
        rf"Trust nominal: it keeps the laws of a hull, and{WHAT} none that does is better by more than chance\. "
        r"wild breaks dissipation and is no better by more than chance\.",
    ),
    "better by chance": (
        {"nominal": errors(), "run": gusty(0.65), GUESS: errors(3.0)},
        ("nominal", Grounds.CHANCE),
        rf"run errs 35 % less than nominal{WHAT}, which may be chance{ABOUT}: until more rows tell, trust nominal, "
        r"the simpler one\.",
    ),
    "better by chance, and than a guess for sure": (
        {"nominal": gusty(1.0), "run": errors(0.7), GUESS: errors(0.8)},
        ("run", Grounds.NONE_BETTER),
        rf"Trust run:{WHAT} it errs 30 {LESS}, which may be chance, and it keeps the laws of a hull\.",
    ),
    "worse": (
        {"nominal": errors(), "run": errors(1.5), GUESS: errors(3.0)},
        ("nominal", Grounds.NONE_BETTER),
        rf"Trust nominal: it keeps the laws of a hull, and{WHAT} none that does is better by more than chance\.",
    ),
    "worse by chance": (
        {"nominal": errors(), "run": gusty(1.2), GUESS: errors(3.0)},
        ("nominal", Grounds.NONE_BETTER),
        rf"Trust nominal: it keeps the laws of a hull, and{WHAT} none that does is better by more than chance\. "
        rf"run errs 20 % more than nominal, which may be chance{ABOUT}\.",
    ),
    "too few": (
        {"nominal": errors(starts=15), "run": errors(0.5, starts=15), GUESS: errors(3.0, starts=15)},
        ("", Grounds.TOO_FEW),
        r"The judged rows are too few to tell models apart: run has the smallest errors, and that may be chance\.",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_the_verdict_never_tells_the_opposite_of_the_errors(case: str):
    """Whichever model errs less is said to, with the interval and what speaks against it; then which one to trust."""
    models, (trusted, grounds), sentence = CASES[case]
    told = best([(model(n, 3 * (n != "nominal")), e, LAWLESS if n == "wild" else None) for n, e in models.items()])
    assert (told.model, told.grounds) == (trusted, grounds)
    assert re.fullmatch(sentence, told.sentence.replace("\N{NO-BREAK SPACE}", " ")), told.sentence
    nominal = models["nominal"].rollout_scores.get("10")
    for margin in told.margins:
        assert nominal is not None
        own = models[margin.model].rollout_scores["10"]
        assert 1.0 + margin.relative == pytest.approx(np.exp(np.log(own.velocity / nominal.velocity).mean()))
    assert told.saved == next((-m.relative for m in told.margins if m.model == trusted), None)


def test_of_models_with_as_many_numbers_the_one_with_smaller_errors_is_trusted():
    told = best([(model("nominal", 0), errors(), None), (model("other", 0), gusty(0.65), None)])
    assert told.model == "other"
    assert "35 % less than nominal" in told.sentence.replace("\N{NO-BREAK SPACE}", " ")
    assert "which may be chance" in told.sentence


def test_of_models_that_differ_by_chance_the_one_that_adds_what_is_surely_missing_is_trusted():
    nominal, less, more = (model("nominal", 0), errors(), None), *((model("run"), gusty(by), None) for by in (0.8, 1.2))
    assert best([nominal, less]).model == "nominal"
    known = best([nominal, less], ["run"])
    assert (known.model, known.grounds) == ("run", Grounds.NONE_BETTER)
    assert re.match(rf"Trust run:{WHAT} it errs 20 {LESS}, which may be chance", known.sentence.replace("\xa0", " "))
    fitted = (model("calibrated", 6), gusty(0.5, seed=2), None)
    assert (
        best([nominal, fitted, (model("run", 9), less[1], None)], ["run"])
        .sentence.partition(". ")[0]
        .endswith("until more rows tell, trust run, which adds what is surely missing")
    )
    assert best([nominal, (model("calibrated", 6), errors(0.2), None), less], ["run"]).model == "calibrated"
    assert best([nominal, more], ["run"]).model == "nominal", "what is missing hardly matters on these rows"
