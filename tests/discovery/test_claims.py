"""Claims: the size of each test of a name, relative to the claim, and intervals as wide as what is not known."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.candidates.candidate import Kind, candidates
from undertow.discovery.claims import Tests as Asked
from undertow.discovery.claims import gather_claims, null_distance, widen_intervals
from undertow.discovery.effect_findings import Reason
from undertow.discovery.evidence.invariance import Invariance
from undertow.discovery.evidence.record_errors import Misalignment
from undertow.discovery.evidence.unmodelled_forces import FreeFormRefit, UnmodelledForces
from undertow.discovery.evidence.weighing import Evidence
from undertow.discovery.findings import OtherForm
from undertow.discovery.judgement import REASONS, features
from undertow.discovery.search.estimation import Interval
from undertow.discovery.search.surrogates import Chance
from undertow.physics.effects import EFFECTS
from undertow.physics.vehicle import Vehicle, load_vehicle

HULL = load_vehicle("blueboat")
POOL = candidates(HULL)
DRAG, TRIM, LIFT = "surge_quadratic_damping", "surge_trim", "sway_lift"
FILE = HULL.value("X_uu")
FORM = OtherForm(axis="surge", follows="u^3", force=1.5, share=0.03, unit="N")
NAMED = Evidence(
    DRAG,
    Kind.EFFECT,
    True,
    80.0,
    np.array([0.2, 0.0, 0.0]),
    0.5,
    1.0,
    (),
    chance=Chance(better=0, of=999),
    identity=40.0,
    rival="hull_fouling",
    worth=0.4,
    remains=0.0,
)
"""A drag of which nothing is wrong."""


def test_what_no_test_concerns_has_no_size():
    assert Asked().sizes(NAMED, timed=False) == {}
    assert Asked().explanations(NAMED)[Reason.LOOK_ALIKES] == "hull fouling"


@pytest.mark.parametrize(
    ("tests", "name", "size"),
    [
        (Asked(limits={DRAG: "it stands at a limit"}), "at_limit", 1.0),
        (Asked(accused={DRAG: (0.7, "gyro latency")}), "accused", 0.7),
        (Asked(forms=UnmodelledForces((), {DRAG: FreeFormRefit(margin=7.0)})), "substitute", 7.0),
        (Asked(forms=UnmodelledForces((), {DRAG: FreeFormRefit(margin=-30.0)})), "substitute", -30.0),
        (Asked(rolls=True), "rolls", 1.0),
        (Asked(out_of_step=Misalignment(0.02, 0.4)), "out_of_step", 0.4),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_each_test_has_a_size_of_its_own(tests: Asked, name: str, size: float):
    assert tests.sizes(NAMED, timed=True) == pytest.approx({name: size})
    everyones = {"rolls", "out_of_step"}  # which model of the odds is asked, and the clocks of the log
    assert name in {*REASONS, *everyones}
    other = replace(NAMED, key=LIFT)
    assert set(tests.sizes(other, timed=True)) == {name} & everyones, "what is asked of a name is said of no other"


def test_clocks_are_no_doubt_on_a_force_of_this_instant():
    """It is orthogonal to its derivative; inertia, a lag and memory are not."""
    late = Asked(out_of_step=Misalignment(0.02, 0.4))
    assert late.sizes(NAMED, timed=False) == {}
    timed = {"surge_added_mass", "mass_offset", "cg_offset", "thruster_lag", "input_delay", "wake_memory"}
    assert timed <= {effect.name for effect in EFFECTS if effect.timed}
    prompt = {"surge_linear_damping", "thrust_scale", "thrust_dead_zone", "mean_wind", "hull_fouling", "yaw_trim"}
    assert not prompt & {effect.name for effect in EFFECTS if effect.timed}


@pytest.mark.parametrize(
    ("evidence", "name", "size"),
    [
        (replace(NAMED, at_limit=True), "at_limit", 1.0),
        (replace(NAMED, remains=0.2), "remains", 0.2),
        (replace(NAMED, unexplained=0.4), "unexplained", 0.4),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_the_evidence_says_against_a_name_has_a_size(evidence: Evidence, name: str, size: float):
    assert Asked().sizes(evidence, timed=False) == pytest.approx({name: size})


def test_no_size_is_without_end_or_no_number():
    """What explains next to nothing on its axis is divided by little, and a fit may end in no number."""
    assert Asked().sizes(replace(NAMED, remains=np.nan, unexplained=np.inf), timed=False) == {"unexplained": 1e3}
    assert Asked().sizes(replace(NAMED, unexplained=1e-9), timed=False) == {}, (
        "nor is any so small that a file would say 0"
    )


def test_every_test_that_has_a_size_tells_what_it_found():
    """The sentence of a doubt is never without what it speaks of."""
    every = Asked(
        limits={DRAG: "at a limit"},
        accused={DRAG: (1.0, "gyro scale")},
        out_of_step=Misalignment(0.2, 0.7),
        forms=UnmodelledForces((FORM,), {DRAG: FreeFormRefit(0.6, {"X_uu": 3.0}, 7.0, FORM)}),
    )
    told = every.explanations(replace(NAMED, unexplained=0.3))
    speaking = {reason for reason in REASONS.values() if "{told}" in reason.sentence} - {Reason.FILE_VALUE}
    assert speaking <= set(told)
    assert (
        told[Reason.LASTING_REST]
        == "the model leaves 30 % of the force that the file's leaves, and 0 % of the error of rollouts without it"
    )
    assert told[Reason.OUT_OF_STEP] == "0.2"


def claimed(evidence: Evidence, interval: Interval | None, tests: Asked | None = None, kept: tuple[str, ...] = (DRAG,)):
    intervals = {} if interval is None else {"X_uu": interval}
    return gather_claims([evidence], POOL, HULL, intervals, tests or Asked(), kept)


def test_a_claim_holds_the_numbers_of_its_evidence():
    (claim,) = claimed(NAMED, Interval(FILE - 12.0, FILE - 8.0)).values()
    assert (claim.gain, claim.identity, claim.rival) == (80.0, 40.0, "hull_fouling")
    assert (claim.worth.force, claim.worth.rollout) == (0.4, None)
    assert claim.null_excluded
    assert claim.tests == {"file_value": pytest.approx(2.0 / 10.0)}
    assert features(claim)["clear"] == pytest.approx(np.log(5.0))


@pytest.mark.parametrize(
    ("interval", "excluded", "size"),
    [
        (Interval(FILE - 12.0, FILE - 8.0), True, 0.2),
        (Interval(FILE - 4.0, FILE + 1.0), False, 2.5 / 1.5),
        (Interval(FILE - 4.0, FILE), False, 1.0),
        (None, False, 1.0),
    ],
    ids=["far", "inside", "at its end", "unknown"],
)
def test_a_value_of_the_file_that_an_interval_holds_is_not_excluded(interval, excluded: bool, size: float):
    claim = claimed(NAMED, interval)[DRAG]
    assert claim.null_excluded is excluded
    assert claim.tests["file_value"] == pytest.approx(size, rel=1e-5)


def test_what_is_left_takes_a_verdict_and_counts_once_in_the_odds():
    wide, narrow = ({"X_uu": Interval(FILE - 10.0 - half, FILE - 10.0 + half)} for half in (12.0, 2.0))
    claim = gather_claims([NAMED], POOL, HULL, wide, Asked(), (DRAG,), narrow)[DRAG]
    assert not claim.null_excluded, "of the interval that is told"
    assert claim.tests["file_value"] == pytest.approx(0.2), "of the one without what is left"


def test_only_what_was_selected_or_joins_the_model_is_a_claim():
    left_out = replace(NAMED, selected=False)
    assert claimed(left_out, None, kept=()) == {}
    assert set(claimed(left_out, None)) == {DRAG}
    assert claimed(replace(NAMED, key="surge:u^2", kind=Kind.TERM), None) == {}


def test_of_several_numbers_the_one_that_is_farthest_out_counts():
    coupling = next(c for c in POOL if c.key == "sway_yaw_coupling")
    near, far = (HULL.value(symbol) for symbol in coupling.symbols)
    ends = (Interval(near - 1.0, near + 1.0), Interval(far + 4.0, far + 6.0))
    intervals = dict(zip(coupling.symbols, ends, strict=True))
    assert null_distance(coupling, HULL, intervals) == pytest.approx(5.0)
    assert null_distance(coupling, HULL, {coupling.symbols[0]: ends[0]}) == pytest.approx(0.0)
    assert null_distance(coupling, HULL, {}) is None


MIDDLE, HALF = FILE - 10.0, 2.0


def wide(tests: Asked | None = None, apart=(), left: float = 0.0) -> Interval:
    """The interval of a drag of 10 +- 2 N s^2/m^2 beyond the file's, widened."""
    own = {"X_uu": Interval(MIDDLE - HALF, MIDDLE + HALF)}
    return widen_intervals(own, POOL, HULL, tests or Asked(), apart, {DRAG: left})["X_uu"]


def half(interval: Interval) -> float:
    assert 0.5 * (interval.lower + interval.upper) == pytest.approx(MIDDLE)
    return 0.5 * (interval.upper - interval.lower)


def test_an_interval_of_which_nothing_is_unknown_stays():
    assert half(wide()) == pytest.approx(HALF)


def test_what_is_left_and_what_parts_differ_by_are_added_in_squares():
    parts = {DRAG: Invariance((), 0.4, {"X_uu": 4.0})}
    assert half(wide(Asked(invariant=parts))) == pytest.approx(np.hypot(HALF, 4.0))
    assert half(wide(left=0.3)) == pytest.approx(np.hypot(HALF, 0.3 * (FILE - MIDDLE))), "of what it adds to the file"


@pytest.mark.parametrize("by", [-3.0, 3.0])
def test_an_interval_reaches_to_the_estimate_beside_other_forces_and_no_further_on_the_other_side(by: float):
    form = UnmodelledForces((FORM,), {DRAG: FreeFormRefit(0.2, {"X_uu": by})})
    found = wide(Asked(forms=form))
    near, far = (found.upper, found.lower) if by < 0.0 else (found.lower, found.upper)
    assert abs(near - MIDDLE) == pytest.approx(HALF)
    assert abs(far - MIDDLE) == pytest.approx(np.hypot(HALF, 3.0))


def without(*values: float) -> list[Vehicle]:
    """The model without each of some folds, by its drag."""
    return [HULL.with_values({"X_uu": value}) for value in values]


@pytest.mark.parametrize("scatter", [1.5, 2.0])
def test_folds_that_scatter_widen_an_interval_by_the_jackknife(scatter: float):
    """Of four values that lie so far from their mean, (3/4 of the sum of squares)^(1/2), 1.96 times to either side."""
    apart = [MIDDLE + sign * scatter for sign in (-1.0, 1.0, -1.0, 1.0)]
    assert half(wide(apart=without(*apart))) == pytest.approx(1.96 * np.sqrt(3.0) * scatter)
    assert half(wide(apart=without(*apart, FILE))) == pytest.approx(1.96 * np.sqrt(3.0) * scatter), "FILE is silence"


def test_folds_that_agree_or_are_too_few_widen_nothing():
    assert half(wide(apart=without(MIDDLE, MIDDLE, MIDDLE, MIDDLE))) == pytest.approx(HALF)
    assert half(wide(apart=without(MIDDLE - 1.0, MIDDLE + 1.0, FILE, FILE))) == pytest.approx(HALF)


def test_an_interval_ends_at_the_limits_of_the_number():
    """Damping never drives: what widens an interval does not carry it beyond nothing at all."""
    form = UnmodelledForces((FORM,), {DRAG: FreeFormRefit(0.9, {"X_uu": 1e4})})
    found = wide(Asked(forms=form))
    limits = next(p for c in POOL if c.key == DRAG for p in c.parameters)
    assert found.lower >= limits.lower
    assert found.upper <= limits.upper
    assert found.upper > MIDDLE + HALF


def test_a_wide_interval_takes_the_verdict_of_a_name():
    form = UnmodelledForces((FORM,), {DRAG: FreeFormRefit(0.9, {"X_uu": 15.0})})
    tests = Asked(forms=form)
    narrow, broad = Interval(MIDDLE - HALF, MIDDLE + HALF), wide(tests)
    assert claimed(NAMED, narrow)[DRAG].null_excluded
    assert not claimed(NAMED, broad, tests)[DRAG].null_excluded


def test_where_several_logs_are_judged_sizes_of_one_log_are_not_asked():
    asked = Asked(accused={DRAG: (1.0, "gyro scale")}, rolls=True, limits={DRAG: "at its limit"})
    assert {"accused", "rolls", "at_limit"} == set(asked.sizes(NAMED, timed=False))
    assert {"at_limit"} == set(replace(asked, several=True).sizes(NAMED, timed=False))
