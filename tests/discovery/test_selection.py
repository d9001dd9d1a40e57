"""What decides which effects stay: noise cleared from the fit, materiality, second searches, plain descriptions."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery import selection
from undertow.discovery.balance.shooting import Shooting, rollout_difference
from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.candidates.candidate import Kind, candidates
from undertow.discovery.candidates.linearisation import Option
from undertow.discovery.candidates.unnamed_terms import term_candidate
from undertow.discovery.discover import find_missing, unsure_terms
from undertow.discovery.effect_findings import FittedTerm
from undertow.discovery.evidence.unexplained import inclusion, residual_of_few_forces
from undertow.discovery.search.estimation import Interval, profile_interval
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.discovery.search.gram import GramScores
from undertow.discovery.search.rival_explanations import as_common_scale, is_equivalent
from undertow.measurements.statistics.signals import sensor_noise
from undertow.physics.effects import PARAMETERS
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull, typical_effect
from undertow.physics.worlds.world import NOISE, World, simulate_world

HULL = load_vehicle("blueboat")


def world(hidden: dict[str, float], duration: float = 120.0, noise: str = "field", seed: int = 3) -> Motion:
    values = {name: (value,) for name, value in hidden.items()}
    return simulate_world(HULL, values, duration=duration, noise=noise, seed=seed).motion(0.05)


def searched(motion: Motion, nominal: Vehicle = HULL, terms: tuple[str, ...] = ()) -> Search:
    pool = (*candidates(nominal), *(term_candidate(term, nominal) for term in terms))
    return Search(WeakForm([motion], WeakSettings()), nominal, pool, SearchSettings())


def test_noise_as_large_as_the_motion_is_no_effect():
    """Of a boat that turns gently, noise in the modulus of its yaw rate passed for a centre of gravity elsewhere."""
    otter = random_hull(load_vehicle("otter"), np.random.default_rng([700006, 5]))
    motion = World(otter, "gentle", 250.0, 700006).run(NOISE["rough"]).motion(0.05)
    assert sensor_noise([motion]) == pytest.approx([0.04, 0.04, 0.015], rel=0.05)
    assert find_missing([motion], otter).findings.missing == ()


def test_noise_on_a_column_does_not_pull_its_coefficient_towards_zero():
    rng = np.random.default_rng(1)
    rows, truth, level = 4000, 3.0, 0.5
    clean = rng.normal(size=rows)
    seen = clean + level * rng.normal(size=rows)
    columns = np.zeros((rows, 3, 2))
    columns[:, 0] = np.column_stack([seen, truth * clean])
    noise = np.zeros((4, rows, 3, 2))
    noise[:, :, 0, 0] = level * rng.normal(size=(4, rows))
    free = Option("x", Kind.EFFECT, True, ("x",), (0.0,), (0,), -1, (-np.inf,), (np.inf,))
    block = np.arange(rows) * 8 // rows
    blind = GramScores(columns, noise[:0], block, np.ones(3)).fit([free]).change[0]
    cleared = GramScores(columns, noise, block, np.ones(3)).fit([free]).change[0]
    assert blind == pytest.approx(truth / (1.0 + level**2), rel=0.05)
    assert cleared == pytest.approx(truth, rel=0.05)


def test_clearing_never_makes_normal_equations_indefinite():
    rng = np.random.default_rng(2)
    columns = np.zeros((400, 3, 2))
    columns[:, 0] = rng.normal(size=(400, 2))
    noise = np.zeros((2, 400, 3, 2))
    noise[:, :, 0, 0] = 3.0 * rng.normal(size=(2, 400))
    free = Option("x", Kind.EFFECT, True, ("x",), (0.0,), (0,), -1, (-np.inf,), (np.inf,))
    scores = GramScores(columns, noise, np.arange(400) * 8 // 400, np.ones(3))
    _, left, _ = scores.block_normal([free])
    assert left.sum(axis=0)[0, 0] > 0.0


def test_an_effect_under_the_material_share_must_change_rollouts():
    motion = world({"surge_quadratic_damping": -6.0})
    search = searched(motion)
    nothing = search.evaluate(HULL, ())
    found = search.run()
    assert found.active == ("surge_quadratic_damping",)
    assert search.is_material(nothing, found)
    small = replace(search.settings, materiality=10.0, least=10.0)
    assert not Search(search.balance, HULL, search.pool, small).is_material(nothing, found)
    between = replace(search.settings, materiality=10.0)
    assert Search(search.balance, HULL, search.pool, between).is_material(nothing, found)
    assert not Search(search.balance, HULL, search.pool, replace(between, weight=10.0)).is_material(nothing, found)


def test_two_models_part_by_what_lies_between_them():
    motion = world({}, duration=60.0)
    assert rollout_difference([motion], HULL, HULL) == pytest.approx(0.0)
    draggy = HULL.with_values({"X_uu": -20.0})
    assert rollout_difference([motion], HULL, draggy)[0] > 0.1
    assert rollout_difference([motion.slice(0, 50)], HULL, draggy) == pytest.approx(0.0)


def test_both_thrusters_scales_are_told_as_a_common_one_and_the_weaker_one():
    motion = world({"port_scale": 0.7, "stbd_scale": 0.9})
    search = searched(motion)
    twice = ("thruster_asymmetry[port]", "thruster_asymmetry[stbd]")
    state = search.evaluate(HULL.with_values({"port_scale": 0.7, "stbd_scale": 0.9}), twice)
    plain = as_common_scale(search, state)
    assert set(plain.active) == {"thrust_scale", "thruster_asymmetry[port]"}
    assert plain.vehicle.value("thrust_scale") == pytest.approx(0.9, rel=0.02)
    assert plain.vehicle.value("port_scale") == pytest.approx(0.7 / 0.9, rel=0.02)
    assert plain.vehicle.value("stbd_scale") == pytest.approx(1.0)
    assert plain.score == pytest.approx(state.score, abs=0.5)


def test_of_three_scales_of_two_thrusters_one_is_too_many():
    motion = world({"port_scale": 0.7, "stbd_scale": 0.9})
    search = searched(motion)
    thrice = ("thrust_scale", "thruster_asymmetry[port]", "thruster_asymmetry[stbd]")
    values = {"thrust_scale": 1.5, "port_scale": 0.7 / 1.5, "stbd_scale": 0.9 / 1.5}
    plain = as_common_scale(search, search.evaluate(HULL.with_values(values), thrice))
    assert set(plain.active) == {"thrust_scale", "thruster_asymmetry[port]"}
    assert plain.vehicle.value("thrust_scale") == pytest.approx(0.9, rel=0.02)
    assert plain.vehicle.value("port_scale") == pytest.approx(0.7 / 0.9, rel=0.02)


def test_two_scales_stay_as_they_are_where_the_common_one_is_no_candidate():
    """Beside a calibration, as `--refit` makes one, the common scale is part of the calibration."""
    motion = world({"port_scale": 0.7, "stbd_scale": 0.9}, duration=60.0)
    pool = [candidate for candidate in candidates(HULL) if candidate.key != "thrust_scale"]
    search = Search(WeakForm([motion], WeakSettings()), HULL, pool, SearchSettings())
    twice = ("thruster_asymmetry[port]", "thruster_asymmetry[stbd]")
    state = search.evaluate(HULL.with_values({"port_scale": 0.7, "stbd_scale": 0.9}), twice)
    assert as_common_scale(search, state) is state


def test_two_of_three_scales_are_no_rivals_of_the_third():
    active = ("thrust_scale", "thruster_asymmetry[port]")
    assert is_equivalent(HULL, active, "thruster_asymmetry[port]", "thruster_asymmetry[stbd]")
    assert not is_equivalent(HULL, active, "thruster_asymmetry[port]", "munk_moment")
    assert not is_equivalent(HULL, ("thrust_scale",), "thrust_scale", "thruster_asymmetry[stbd]")
    third = HULL.thrusters[0].model_copy(update={"name": "bow"})
    three = HULL.model_copy(update={"thrusters": (*HULL.thrusters, third)})
    assert not is_equivalent(three, active, "thruster_asymmetry[port]", "thruster_asymmetry[stbd]")


def test_a_dead_zone_has_an_interval_by_profile():
    motion = world({"dead_zone": 0.17}, duration=300.0)
    weak = WeakForm([motion], WeakSettings())
    interval = profile_interval(weak, HULL.with_values({"dead_zone": 0.16}), PARAMETERS["dead_zone"], np.ones(3), 0)
    assert interval.lower <= 0.17 <= interval.upper
    assert 0.0 < interval.upper - interval.lower < 0.05


def test_the_interval_of_a_dead_zone_holds_every_value_between_two_commands():
    full = 35.0  # N
    shares = (-0.5, 0.0, 0.1, 0.5, 0.8)
    rng = np.random.default_rng(0)
    held = np.repeat(rng.choice(shares, size=(60, 2)) * full, 40, axis=0)
    time = 0.05 * np.arange(held.shape[0])
    nothing = np.zeros((time.size, 2)), np.zeros(time.size), np.zeros((time.size, 3))
    motion = simulate_motion(HULL.with_values({"dead_zone": 0.4}), Motion(time, *nothing, held, ("port", "stbd")))
    weak = WeakForm([motion], WeakSettings())
    interval = profile_interval(weak, HULL.with_values({"dead_zone": 0.15}), PARAMETERS["dead_zone"], np.ones(3), 0)
    assert interval.lower <= 0.1
    assert interval.upper >= 0.5
    assert interval.lower > 0.05


def test_block_ensembles_select_the_term_that_acts():
    motion = world({"yaw:r^2": 3.0})
    search = searched(motion, terms=("yaw:r^2", "yaw:u^2v", "surge:v^2"))
    state = search.run()
    assert "yaw:r^2" in state.active
    found = inclusion(search, state, seed=0, draws=20)
    assert found["yaw:r^2"] > 0.9
    assert all(share < 0.5 for key, share in found.items() if key != "yaw:r^2")


def test_findings_tell_what_the_log_asks_for_and_what_the_law_allows():
    nominal = load_vehicle("blueboat_paper")
    motion = simulate_world(nominal, {"surge_turn_drag": (50.0,)}, duration=200.0, seed=5).motion(0.05)
    found = find_missing([motion], nominal, DiscoverySettings())
    assert found.findings.missing == ("surge_turn_drag",)
    (term,) = found.findings.candidates[0].terms
    assert term.value == pytest.approx(50.0, rel=0.05)
    assert term.in_model == pytest.approx(found.corrected.value("X_vr"))
    assert term.in_model is not None
    assert term.in_model < 0.95 * term.value
    assert "holds X_vr at" in found.findings.candidates[0].sentence


@pytest.mark.parametrize("base", ["blueboat", "otter", "blueboat_paper"])
def test_drawn_couplings_leave_linear_damping_dissipative(base: str):
    nominal = load_vehicle(base)
    for seed in range(4):
        values = typical_effect("sway_yaw_coupling", nominal, np.random.default_rng(seed))
        total = sum(nominal.value(s) + values[s] for s in ("Y_r", "N_v"))
        assert abs(total) <= 2.0 * np.sqrt(nominal.value("Y_v") * nominal.value("N_r"))


def test_stand_ins_that_leave_structure_are_searched_past():
    """A dead zone beside a trim looks like an exponent and a scale; before terms, names are searched again."""
    hidden = {"thrust_dead_zone": (0.17,), "surge_trim": (8.0,)}
    motion = simulate_world(HULL, hidden, programme="gentle", duration=160.0, noise="clean", seed=6).motion(0.05)
    assert set(find_missing([motion], HULL).findings.missing) == set(hidden)


def test_a_search_on_rollouts_begins_at_the_nominal_model_too(monkeypatch: pytest.MonkeyPatch):
    """From a model with many effects a search may end where several stand for one."""
    monkeypatch.setattr(selection, "_starts", lambda *_: iter(()))
    form = Shooting([world({"surge_quadratic_damping": -15.0})], HULL)
    pool = [c for c in candidates(HULL) if c.key in ("surge_quadratic_damping", "yaw_linear_damping")]
    _, state, _ = selection._search_rollouts(form, HULL, pool, DiscoverySettings(), lambda _: None)
    assert state.active == ("surge_quadratic_damping",)


def test_scores_that_matter_are_those_within_the_limits():
    """Models that are not below what is asked for without their limits are not fitted again; none is missed here."""
    search = searched(world({"surge_linear_damping": 3.0, "yaw_trim": -1.0}, duration=60.0))
    linear, scores = search.linearise(HULL, ())
    changes = [{key: option} for key, options in linear.options.items() for option in options]
    changes += [one | other for one in changes[1:6] for other in changes[6:]]
    right = np.array(search.score_all_linearised(scores, changes))
    free = np.array(search.score_all_linearised(scores, changes, below=-1e300))
    below = float(np.median(right))
    found = np.array(search.score_all_linearised(scores, changes, below))
    assert (free < right - 1.0).any()  # limits matter here
    np.testing.assert_array_equal(found[right < below], right[right < below])
    assert (found[right >= below] >= below).all()


def test_few_forces_explain_what_one_effect_makes():
    search = choose_balance([world({"surge_quadratic_damping": -20.0})], HULL, DiscoverySettings()).force_search
    assert isinstance(search.balance, WeakForm)
    none, one, six = (residual_of_few_forces(search.balance, search, most) for most in (0, 1, 6))
    assert none[0] > 4.0 * one[0] >= 4.0 * six[0]
    assert not search.has_residual_structure(six)
    rest = search.balance.residual(HULL)
    assert (none <= (rest**2).mean(axis=0) * (1.0 + 1e-12)).all()  # less what is calibrated in every model


def test_what_is_slight_beside_the_force_at_work_is_left_to_the_force_balance():
    """Structure of 4 % is no white noise, and calls for no rollouts; of 6 % it does, unless noise explains it."""
    search = choose_balance([world({"surge_quadratic_damping": -20.0})], HULL, DiscoverySettings()).force_search
    four, six = (np.square(share * search.force_scale * [1.0, 0.0, 0.0]) for share in (0.04, 0.06))
    assert search.has_residual_structure(four)
    assert not search.leaves_more_than_slight(four)
    assert search.leaves_more_than_slight(six)
    assert not search.leaves_more_than_slight(np.square(search.noise_error))


def test_a_step_that_gains_next_to_nothing_is_the_last(monkeypatch: pytest.MonkeyPatch):
    """Where the fit is, columns are taken once; far from it as often as it takes, and the value is the optimum's."""
    search, taken = searched(world({"surge_quadratic_damping": -20.0, "thruster_lag": 0.4})), []
    linearise = search.linearise
    monkeypatch.setattr(search, "linearise", lambda *args, **more: (taken.append(1), linearise(*args, **more))[1])
    found = search.evaluate(HULL.with_values({"lag": 0.2}), ("surge_quadratic_damping", "thruster_lag"))
    assert len(taken) > 1
    found = search.evaluate(found.vehicle, found.active)
    far, value = len(taken), found.vehicle.value("X_uu")
    again = search.evaluate(found.vehicle, found.active)
    assert len(taken) - far == 1
    assert again.vehicle.value("X_uu") == pytest.approx(value, rel=1e-3)
    assert again.score == pytest.approx(found.score, abs=0.05)


@pytest.mark.parametrize("rolls", [True, False])
def test_no_few_terms_are_searched_for_where_all_of_them_leave_structure(monkeypatch: pytest.MonkeyPatch, rolls: bool):
    basis = choose_balance([world({"surge_quadratic_damping": -20.0}, duration=60.0)], HULL, DiscoverySettings())
    asked: list[int] = []
    searched_again = selection._with_terms
    monkeypatch.setattr(selection, "has_residual_structure", lambda *_: True)
    monkeypatch.setattr(Search, "leaves_more_than_slight", lambda *_: True)
    monkeypatch.setattr(selection, "_rolling", lambda *_: basis if rolls else None)
    monkeypatch.setattr(selection, "_with_terms", lambda *args: (asked.append(1), searched_again(*args))[1])
    fit = selection.search_forces(basis, lambda _: None)
    assert (bool(asked), fit.beyond_terms, fit.rolling is basis) == (not rolls, rolls, rolls)
    if rolls:
        assert not fit.search.of_kind(fit.names, Kind.TERM)


def test_where_a_log_shows_a_sum_of_two_numbers_both_are_told():
    headline = find_missing([world({"yaw_added_mass": -0.8 * HULL.inertia_z})], HULL).findings.headline
    assert headline.startswith("The file's N_rdot (about ")
    assert headline.endswith("; or inertia_z, for a log shows inertia_z - N_rdot alone) is off.")


def test_terms_whose_interval_holds_nothing_may_go_and_the_surest_drag_stays():
    forms = {"u^3": (-280.0, -10.0), "r^2|u|": (-28e3, 67e3), "u|u||r|": (-10.3e3, 4.8e3)}
    terms = [FittedTerm(axis="surge", form=f, value=0.5 * sum(i), ci95=Interval(*i)) for f, i in forms.items()]
    assert unsure_terms(terms) == ["surge:r^2|u|", "surge:u|u||r|"]
    twins = [
        FittedTerm(axis="surge", form=f, value=1.0, ci95=Interval(-w, w + 2.0))
        for f, w in (("u^3", 9.0), ("u^2|u|", 5.0))
    ]
    assert unsure_terms(twins) == ["surge:u^2|u|"]


def test_a_term_that_adds_nothing_to_another_goes_and_one_that_does_stays():
    motion = world({"surge_quadratic_damping": -14.0}, duration=200.0)
    search = searched(motion, terms=("surge:u^3", "surge:r^2|r|"))
    both = search.evaluate(HULL, ("surge_quadratic_damping", "surge:u^3", "surge:r^2|r|"))
    basis = choose_balance([motion], HULL, DiscoverySettings())
    looked = replace(selection.select(basis, lambda text: None), search=search, state=both, rehearsal=None)
    fewer = selection.without_terms(looked, ["surge:r^2|r|", "surge:u^3"], lambda text: None)
    assert fewer is not None
    assert fewer.state.active == ("surge_quadratic_damping",)
    assert selection.without_terms(fewer, ["surge_quadratic_damping"], lambda text: None) is None
