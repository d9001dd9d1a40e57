"""Numbers that are a limit's and not the log's, what they cost a name, and shares that are of the right axis."""

import numpy as np
import pytest

from undertow.discovery import verdicts as words
from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.candidates.candidate import Candidate, candidates
from undertow.discovery.claims import at_limits
from undertow.discovery.discover import find_missing
from undertow.discovery.effect_findings import Reason
from undertow.discovery.identifiability.rehearsal import Identifiability
from undertow.discovery.lawful.refit import lawful_refit
from undertow.discovery.search.estimation import Interval
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.reports.page.chapters.verdict import _facts

HULL = load_vehicle("blueboat")
SCALES = ("thrust_scale", "thruster_asymmetry[port]", "thruster_asymmetry[stbd]")
POOL = candidates(load_vehicle("blueboat_paper"))
PAPER = load_vehicle("blueboat_paper")


def one(key: str) -> Candidate:
    return next(c for c in POOL if c.key == key)


def test_an_estimate_at_its_physical_limit_is_the_limits():
    most = PAPER.with_values({"port_scale": 3.0})
    found = at_limits(POOL, PAPER, most, SCALES[1:2], {})
    assert list(found) == [SCALES[1]]
    assert "port_scale stands at its physical limit, 3" in found[SCALES[1]]
    assert at_limits(POOL, PAPER, PAPER.with_values({"port_scale": 2.0}), SCALES[1:2], {}) == {}


def test_damping_of_the_file_that_vanishes_is_at_no_limit():
    """The file has a number for what is not there: nothing is left of it, and that is what the log asks for."""
    none_left = PAPER.with_values({"X_u": -2.9e-6})
    assert PAPER.value("X_u") < 0.0
    assert at_limits(POOL, PAPER, none_left, ("surge_linear_damping",), {"X_u": Interval(-2.4, 0.0)}) == {}


def test_an_estimate_outside_its_own_interval_is_told():
    estimate = PAPER.with_values({"thrust_scale": 2.2})
    assert "outside its own interval" in str(
        at_limits(POOL, PAPER, estimate, SCALES[:1], {"thrust_scale": Interval(2.6, 3.0)})
    )
    assert at_limits(POOL, PAPER, estimate, SCALES[:1], {"thrust_scale": Interval(2.1, 2.4)}) == {}


def test_a_centre_of_gravity_that_no_such_hull_has_is_no_number_of_the_log():
    far = PAPER.with_values({"x_g": -0.9})
    found = at_limits(POOL, PAPER, far, ("cg_offset",), {"x_g": Interval(-0.91, -0.89)})
    assert "17.82 kg m^2 of inertia about it at least" in found["cg_offset"]
    near = PAPER.with_values({"x_g": -0.1})
    assert at_limits(POOL, PAPER, near, ("cg_offset",), {"x_g": Interval(-0.11, -0.09)}) == {}


def test_a_common_scale_beside_all_thrusters_own_is_one_too_many():
    estimate = PAPER.with_values({"thrust_scale": 1.2, "port_scale": 1.1, "stbd_scale": 0.9})
    assert set(at_limits(POOL, PAPER, estimate, SCALES, {})) == set(SCALES)
    assert at_limits(POOL, PAPER, estimate, SCALES[:2], {}) == {}
    assert at_limits(POOL, PAPER, estimate, SCALES[1:], {}) == {}


def test_a_direction_that_no_data_show_does_not_move_the_refit():
    """Three scales of two thrusters: an interior-point solver would carry them to the middle between their limits."""
    true = {"port_scale": 1.5, "stbd_scale": 1.2}
    motion = simulate_world(HULL, true, duration=90.0, noise="field", seed=4).motion(0.05)
    pool = [c for c in candidates(HULL) if c.key in SCALES]
    search = Search(WeakForm([motion], WeakSettings()), HULL, pool, SearchSettings())
    about = HULL.with_values({"thrust_scale": 2.9, "port_scale": 1.5 / 2.9, "stbd_scale": 1.2 / 2.9})
    linear, scores = search.linearise(about, SCALES)
    found = lawful_refit(scores, [linear.options[key][0] for key in SCALES])
    for name, scale in true.items():
        assert found["thrust_scale"] * found[name] == pytest.approx(scale, rel=0.01)


def test_a_share_is_of_the_axis_on_which_the_force_acts():
    told = words._alone(one("yaw_speed_damping"), np.array([0.93, 0.0, 0.38]), "motion")
    assert told == "It alone accounts for 38 % of the yaw motion in this log."
    told = words._alone(one("thrust_scale"), np.array([0.13, 0.0, 0.08]), "motion")
    assert told == "It alone accounts for 13 % of the surge motion in this log."


def test_a_share_beyond_the_whole_is_told_in_words():
    told = words._alone(one("surge_quadratic_damping"), np.array([230.7, 0.0, 1254.2]), "motion")
    assert told == "Without it, the model errs by more than all of the surge motion in this log."


def test_a_number_that_is_a_limits_stays_in_the_model_and_is_less_sure(monkeypatch: pytest.MonkeyPatch):
    motion = simulate_world(HULL, {"surge_quadratic_damping": -6.0}, duration=90.0, seed=31).motion(0.05)
    name = "surge_quadratic_damping"
    told = {name: "X_uu stands at its limit"}
    plain, found = find_missing([motion], HULL), None
    with monkeypatch.context() as patch:
        patch.setattr("undertow.discovery.discover.at_limits", lambda *_: told)
        found = find_missing([motion], HULL)
    before, drag = (next(c for c in f.findings.candidates if c.effect == name) for f in (plain, found))
    assert before.claim is not None
    assert drag.claim is not None
    assert "at_limit" not in before.claim.tests
    assert drag.claim.tests["at_limit"] == 1.0
    assert drag.confidence <= before.confidence
    assert before.verdict == "missing"
    if drag.verdict != "missing":
        assert drag.reason is Reason.AT_LIMIT
    assert drag.terms[0].in_model == pytest.approx(-6.0, rel=0.1)
    assert found.corrected.value("X_uu") - HULL.value("X_uu") == pytest.approx(-6.0, rel=0.1)


def test_what_moves_alike_and_was_told_apart_all_the_same_is_said_to_be():
    told = Identifiability(groups=(("surge_linear_damping", "surge_quadratic_damping"), ("sway:ur|u|", "sway_lift")))
    text = str(_facts(told, ["surge_quadratic_damping"]))
    assert "surge quadratic damping fits held-out data clearly better than any of the others alone" in text
    assert text.count("a mixture of them may fit as well as one") == 1
    assert str(_facts(told)).count("a mixture of them may fit as well as one") == 2
