"""The shortlist of terms, the lawful refit, intervals, the second judge, and what happens when a log cannot tell."""

import cvxpy
import numpy as np
import pytest

from undertow.discovery.add_effects import add_effects
from undertow.discovery.balance.shooting import rollout_squares, rollouts_contradict
from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.linearisation import Option
from undertow.discovery.candidates.unnamed_terms import shortlist
from undertow.discovery.discover import find_missing
from undertow.discovery.effect_findings import EffectFinding, Reason
from undertow.discovery.findings import Findings
from undertow.discovery.lawful import refit as lawful
from undertow.discovery.lawful.refit import lawful_refit
from undertow.discovery.search import estimation as bootstrap
from undertow.discovery.search.estimation import block_bootstrap
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.discovery.search.gram import GramScores
from undertow.physics.errors import RequestError
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import NOISE, Orders, World, simulate_world

HULL = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def draggy() -> Motion:
    """A world with hidden quadratic surge drag and a hidden yaw trim, with field noise."""
    hidden = {"surge_quadratic_damping": -6.0, "yaw_trim": 1.0}
    return simulate_world(HULL, hidden, duration=150.0, noise="field", seed=11).motion(0.05)


def test_the_shortlist_holds_a_term_that_nobody_has_named():
    motion = simulate_world(HULL, {"surge:u^2": -9.0}, duration=120.0, noise="clean", seed=2).motion(0.05)
    found = shortlist(WeakForm([motion], WeakSettings()), HULL)
    assert "surge:u^2" in found
    assert "surge:u|u|" not in found


def driven(effect: dict[str, float], *, both_ways: bool) -> WeakForm:
    """A log of circles ahead at changing thrust, to one side or to either."""
    rng = np.random.default_rng(3)
    shares = np.repeat(rng.uniform(0.2, 0.9, (24, 2)), 50, axis=0)
    ahead = np.sort(shares, axis=1)
    turns = np.where(np.arange(len(ahead))[:, None] // 150 % 2 == 0, ahead, ahead[:, ::-1]) if both_ways else ahead
    true = apply_effects(HULL, effect)
    orders = Orders(turns, heading=0.3)
    motion = World(true, duration=120.0, seed=3, orders=orders).run(NOISE["clean"]).motion(0.05)
    return WeakForm([motion], WeakSettings())


def test_a_log_that_turns_one_way_lists_no_force_that_would_push_a_hull_aside_the_other_way():
    one_way, either = (shortlist(driven({"sway:r^2": -20.0}, both_ways=both), HULL) for both in (False, True))
    assert "sway:r|r|" in one_way
    assert "sway:r^2" not in one_way
    assert "sway:r^2" in either


def test_a_term_that_nobody_has_named_is_found_and_no_effect_is_blamed():
    motion = simulate_world(HULL, {"surge:u^2": -9.0}, duration=200.0, noise="field", seed=2).motion(0.05)
    found = find_missing([motion], HULL).findings
    assert found.missing == ()
    assert [(term.axis, term.form) for term in found.unnamed] == [("surge", "u^2")]
    assert found.unnamed[0].value == pytest.approx(-9.0, rel=0.05)
    assert found.verdict == "undecided"


def refit_of(motion: Motion, key: str):
    weak = WeakForm([motion], WeakSettings())
    search = Search(weak, HULL, [c for c in candidates(HULL) if c.key == key], SearchSettings())
    linear, scores = search.linearise(HULL, ())
    return scores, [linear.options[key][1]]


def test_the_lawful_refit_is_least_squares_where_no_limit_binds(draggy: Motion):
    scores, chosen = refit_of(draggy, "surge_quadratic_damping")
    free = HULL.value("X_uu") + scores.fit(chosen).change[0]
    assert lawful_refit(scores, chosen)["X_uu"] == pytest.approx(free, rel=1e-6)


def driving_drag() -> tuple[GramScores, list[Option]]:
    """A refit of drag along a boat that drag drives: a limit binds."""
    lighter = HULL.with_values({"X_uu": 0.0})
    driven = simulate_motion(lighter.with_values({"X_uu": 1.5}), simulate_world(HULL, {}, duration=90.0, seed=5).truth)
    weak = WeakForm([driven], WeakSettings())
    search = Search(
        weak, lighter, [c for c in candidates(HULL) if c.key == "surge_quadratic_damping"], SearchSettings()
    )
    linear, scores = search.linearise(lighter, ())
    return scores, [linear.options["surge_quadratic_damping"][1]]


def test_the_lawful_refit_never_lets_damping_drive():
    assert lawful_refit(*driving_drag())["X_uu"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("status", ["infeasible", "optimal_inaccurate", "user_limit"])
def test_any_status_but_optimal_is_an_error(monkeypatch: pytest.MonkeyPatch, status: str):
    scores, chosen = driving_drag()
    monkeypatch.setattr(lawful, "_FLAT", 2.0)  # as with columns that are one: then the programme decides
    monkeypatch.setattr(cvxpy.Problem, "solve", lambda self, **_: None)
    monkeypatch.setattr(cvxpy.Problem, "status", property(lambda self: status))
    with pytest.raises(RequestError, match=f"expected an optimal solution, the solver says '{status}'"):
        lawful_refit(scores, chosen)


def test_a_solution_that_breaks_a_limit_is_an_error(draggy: Motion, monkeypatch: pytest.MonkeyPatch):
    scores, chosen = refit_of(draggy, "surge_quadratic_damping")
    monkeypatch.setattr(lawful, "_TOLERANCE", -1e9)
    with pytest.raises(RequestError, match="breaks the limits"):
        lawful_refit(scores, chosen)


def test_intervals_cover_the_truth_and_shrink_with_time(draggy: Motion):
    widths, truth = [], HULL.value("X_uu") - 6.0
    for stop in (1500, draggy.time.size):
        found = add_effects([draggy.slice(0, stop)], HULL, ["surge_quadratic_damping", "yaw_trim"], DiscoverySettings())
        term = next(c for c in found.findings.candidates if c.effect == "surge_quadratic_damping").terms[0]
        assert term.ci95 is not None
        assert term.ci95.lower < truth - HULL.value("X_uu") < term.ci95.upper
        widths.append(term.ci95.upper - term.ci95.lower)
    assert widths[1] < widths[0]


def test_the_seed_decides_the_interval(draggy: Motion):
    scores, chosen = refit_of(draggy, "surge_quadratic_damping")
    first, again, other = (block_bootstrap(scores, chosen, seed) for seed in (0, 0, 1))
    assert first == again
    assert first != other


def test_no_interval_is_narrower_than_steps_of_integrators_leave():
    hidden = {"surge_quadratic_damping": -6.0, "port_scale": 0.8}
    found = find_missing([simulate_world(HULL, hidden, duration=120.0, noise="clean", seed=3).motion()], HULL).findings
    ends = {t.symbol: t.ci95 for c in found.candidates for t in c.terms}
    for symbol, truth in (("X_uu", -6.0), ("port_scale", 0.8)):
        end = ends[symbol]
        assert end is not None
        assert end.lower < truth < end.upper
        assert end.upper - end.lower >= 1.9 * bootstrap.RESOLVED * abs(truth)


def test_each_parameter_takes_a_degree_of_freedom_from_an_interval(draggy: Motion, monkeypatch: pytest.MonkeyPatch):
    scores, chosen = refit_of(draggy, "surge_quadratic_damping")
    asked = []
    monkeypatch.setattr(bootstrap, "student", lambda freedom, _: asked.append(freedom) or 2.0)
    block_bootstrap(scores, chosen, 0)
    assert asked == [scores.blocks - sum(len(set(o.free) - {-1}) for o in chosen)]


def test_rollouts_object_to_a_wrong_force_and_not_to_the_right_one(draggy: Motion):
    right = HULL.with_values({"X_uu": HULL.value("X_uu") - 6.0, "yaw_trim": 1.0})
    wrong = right.with_values({"yaw_trim": 4.0})
    good, bad = rollout_squares([draggy], right), rollout_squares([draggy], wrong)
    assert rollouts_contradict(good, bad, overlap=2)
    assert not rollouts_contradict(bad, good, overlap=2)
    assert not rollouts_contradict(good, good, overlap=2)


def test_rollouts_that_overlap_are_no_independent_witnesses():
    rng, objections = np.random.default_rng(3), 0
    for _ in range(300):
        draws = rng.exponential(size=(2, 30, 3))
        one, other = np.stack([draws[:, k : k + 27] for k in range(4)]).mean(axis=0)
        objections += rollouts_contradict(one, other, overlap=4)
    assert objections <= 15  # 2.5 % on this side, and what chance scatters; starts taken as independent: 14 %


def steady_log(hidden: dict[str, float]) -> Motion:
    """Straight ahead at one command and one speed, where drag of any kind and weak thrust all look alike.

    The hull is not stable on a straight course, and the last bit of a sum would decide where it turns; it is steered by
    a yaw damping that makes no force as long as it goes straight.
    """
    start = simulate_world(HULL, {}, duration=150.0, noise="clean", seed=1).motion(0.05)
    rng = np.random.default_rng(0)
    commands = np.full_like(start.commands, 18.0)
    still = Motion(start.time, 0 * start.position, 0 * start.heading, 0 * start.velocity, commands, start.thrusters)
    moved = simulate_motion(HULL.with_values({**hidden, "N_r": -200.0}), still)
    noisy = moved.velocity + rng.normal(size=moved.velocity.shape) * [0.01, 0.01, 0.004]
    log = Motion(moved.time, moved.position, moved.heading, noisy, commands, moved.thrusters)
    return log.slice(600, log.time.size)


def test_a_log_that_cannot_tell_says_so():
    found = find_missing([steady_log({"X_uu": HULL.value("X_uu") - 6.0})], HULL).findings
    assert found.verdict == "undecided"
    assert found.missing == ()
    doubtful = [c for c in found.candidates if c.verdict == "possible" and c.indistinguishable_from]
    names = {c.effect for c in doubtful} | {name for c in doubtful for name in c.indistinguishable_from}
    assert {"surge_linear_damping", "surge_quadratic_damping", "thrust_scale"} <= names
    assert any("cannot tell it from" in c.sentence for c in doubtful)
    assert found.advice


def test_a_log_without_an_astern_run_cannot_tell_reverse_thrust():
    log = simulate_world(HULL, {"reverse_thrust_loss": 0.5}, programme="gentle", duration=150.0, seed=4).motion(0.05)
    found = find_missing([log], HULL).findings
    reverse = next(c for c in found.candidates if c.effect == "reverse_thrust_loss")
    assert reverse.verdict == "possible"
    assert "This log cannot tell" in reverse.sentence
    assert any("astern" in item.manoeuvre for item in found.advice)


def test_nothing_hidden_gives_nothing_missing():
    log = simulate_world(HULL, {}, duration=150.0, noise="rough", seed=9).motion(0.05)
    found = find_missing([log], HULL).findings
    assert (found.verdict, found.missing, found.unnamed) == ("nothing missing", (), ())
    assert "Nothing material is missing" in found.headline


def test_adding_by_name_fits_what_is_asked_and_nothing_else(draggy: Motion):
    unsure = EffectFinding(effect="yaw_trim", verdict="possible", confidence=0.8, error_drop=0.1)
    sure = unsure.but(effect="surge_quadratic_damping", verdict="missing", confidence=0.98)
    searched = Findings(verdict="missing", missing=(sure.effect,), candidates=(sure, unsure))
    names = [sure.effect, unsure.effect]
    found = add_effects([draggy], HULL, names, DiscoverySettings(), searched=searched)
    told = {c.effect: c for c in found.findings.candidates}
    assert [(told[name].verdict, told[name].in_model) for name in names] == [("missing", True), ("possible", True)]
    assert told["yaw_trim"].reason is Reason.UNFOUND
    assert "not certain: the search of this log calls it no more than possible" in told["yaw_trim"].sentence
    assert found.findings.headline.endswith("; not certain: yaw trim.")
    assert found.corrected.value("X_uu") == pytest.approx(HULL.value("X_uu") - 6.0, rel=0.05)
    assert found.corrected.value("yaw_trim") == pytest.approx(1.0, rel=0.1)
    assert [label for label, _ in found.steps] == [None, "surge_quadratic_damping", "yaw_trim"]
    same = {s: v for s, v in found.corrected.values.items() if s not in ("X_uu", "yaw_trim")}
    assert same == {s: v for s, v in HULL.values.items() if s not in ("X_uu", "yaw_trim")}


def test_adding_finds_the_shape_of_a_lag():
    log = simulate_world(HULL, {"thruster_lag": 0.43}, duration=120.0, noise="clean", seed=6).motion(0.05)
    found = add_effects([log], HULL, ["thruster_lag"], DiscoverySettings())
    assert found.corrected.value("lag") == pytest.approx(0.43, abs=0.01)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ([], "at least one effect by name"),
        (["surge_quadratic_dampin"], "did you mean 'surge_quadratic_damping'"),
        (["yaw_trim", "yaw_trim"], "given twice"),
        (["thruster_asymmetry[middle]"], r"did you mean 'thruster_asymmetry\["),
        (["heave:u"], "expected surge:, sway: or yaw:"),
    ],
)
def test_adding_refuses_what_it_cannot_add(draggy: Motion, names: list[str], message: str):
    with pytest.raises(RequestError, match=message):
        add_effects([draggy], HULL, names, DiscoverySettings())


def test_a_boat_that_hardly_moves_tells_nothing():
    log = simulate_world(HULL, {}, duration=90.0, noise="clean", seed=1).motion(0.05)
    rng = np.random.default_rng(3)
    noise = rng.normal(size=log.velocity.shape) * [0.015, 0.015, 0.006]
    for velocity in (0.0 * noise, noise):
        still = Motion(log.time, 0 * log.position, 0 * log.heading, velocity, 0 * log.commands, log.thrusters)
        found = find_missing([still], HULL).findings
        assert (found.verdict, found.missing) == ("undecided", ())
        assert "hardly more than what sensor noise makes" in found.headline


def test_damping_that_the_log_would_have_drive_ends_at_nothing_and_that_is_a_number():
    draggier = HULL.with_values({"X_u": -2.0, "X_uu": -2.0})
    log = simulate_world(HULL.with_values({"X_u": 0.5, "X_uu": -2.0}), {}, duration=150.0, seed=7).motion(0.05)
    found = find_missing([log], draggier)
    (drag,) = [c for c in found.findings.candidates if c.effect == "surge_linear_damping"]
    assert drag.claim is not None
    assert "at_limit" not in drag.claim.tests
    assert found.corrected.value("X_u") == pytest.approx(0.0, abs=0.01)
    (term,) = drag.terms
    assert term.value == pytest.approx(2.0, abs=0.01), "all of the file's own is too much, and no more can be"


def test_a_propeller_that_switches_within_a_row_bends_no_coefficient():
    """The force of a row's mean command is not the mean of its forces: X_uu came out beside the truth, by 0.3 %."""
    boat = load_vehicle("otter")
    log = simulate_world(boat, {"X_uu": boat.value("X_uu") - 15.0}, duration=240.0, noise="clean", seed=3)
    found = find_missing([log.motion(0.05)], boat)
    assert found.findings.missing == ("surge_quadratic_damping",)
    assert found.corrected.value("X_uu") - boat.value("X_uu") == pytest.approx(-15.0, rel=5e-4)
