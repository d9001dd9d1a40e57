"""What a log can show and tell apart, the manoeuvres advised where it cannot, and that following the advice helps."""

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.candidates.candidate import candidates, measurable
from undertow.discovery.candidates.unnamed_terms import term_candidate
from undertow.discovery.discover import find_missing
from undertow.discovery.experiment import advice
from undertow.discovery.experiment.separation import Separation, separate_effects
from undertow.discovery.findings import Advice, Findings
from undertow.discovery.identifiability.identifiable_effects import ALIAS, alias_groups, identify
from undertow.discovery.identifiability.rehearsal import PLAUSIBLE, Identifiability, plausible_amounts, rehearse
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.physics.files import strict_json
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.manoeuvres import TRIALS, drive
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


def noisy(motion: Motion, seed: int) -> Motion:
    noise = np.random.default_rng(seed).normal(size=motion.velocity.shape) * [0.01, 0.01, 0.004]
    return replace(motion, velocity=motion.velocity + noise)


def steady(vehicle: Vehicle, heading: float = 0.0) -> Motion:
    """Straight ahead at one command and one speed.

    The hull is not stable on a straight course, and the last bit of a sum would decide where it turns; it is steered by
    a yaw damping that makes no force as long as it goes straight.
    """
    n = 3600
    still = np.zeros((n, 3))
    start = Motion(
        0.05 * np.arange(n, dtype=float),
        still[:, :2],
        still[:, 0] + heading,
        still,
        np.full((n, 2), 18.0),
        ("port", "stbd"),
    )
    return noisy(simulate_motion(vehicle.with_values({"N_r": -200.0}), start), 0).slice(600, n)


def gentle(vehicle: Vehicle) -> Motion:
    """Never astern."""
    return simulate_world(vehicle, {}, programme="gentle", duration=150.0, noise="field", seed=4).motion(0.05)


def examined(motions: Sequence[Motion], *terms: str) -> tuple[Search, Identifiability]:
    pool = (*candidates(HULL, measurable(motions)), *(term_candidate(term, HULL) for term in terms))
    search = Search(WeakForm(motions, WeakSettings()), HULL, pool, SearchSettings())
    amounts = plausible_amounts(search, rehearse(search, HULL, ()))
    return search, identify(search, HULL, (), amounts)


def grouped(known: Identifiability, *keys: str) -> bool:
    return any(set(keys) <= set(group) for group in known.groups)


def followed(log: Motion, truth: Vehicle, findings: Findings, most: int) -> Findings:
    """The findings after the first advised trials were driven by the true vehicle, from rest, on the log's heading."""
    asked = [item.manoeuvre for item in findings.advice[:most]]
    trials = [trial for text in asked for trial in TRIALS if text.startswith(trial.text)]
    assert len(trials) == len(asked)
    runs = [run for several in drive(truth, trials, float(log.heading[0])) for run in several]
    return find_missing([log, *(noisy(run, 10 + k) for k, run in enumerate(runs))], HULL).findings


# What a log can show


def test_a_log_that_never_goes_astern_does_not_show_reverse_thrust():
    _, known = examined([gentle(HULL)])
    assert "reverse_thrust_loss" in known.dormant
    assert known.excitation["reverse_thrust_loss"].share == 0.0
    assert known.excitation["surge_linear_damping"].share > 0.1


def test_the_modulus_of_speed_is_an_alias_of_speed_until_the_boat_goes_astern():
    _, ahead = examined([gentle(HULL)], "yaw:ur")
    assert grouped(ahead, "yaw_speed_damping", "yaw:ur")
    trial = [t for t in TRIALS if t.name == "turns_astern"]
    _, both = examined([gentle(HULL), noisy(drive(HULL, trial)[0][0], 5)], "yaw:ur")
    assert not grouped(both, "yaw_speed_damping", "yaw:ur")


def test_a_steady_straight_log_groups_all_that_slows_the_boat():
    _, known = examined([steady(HULL)])
    assert grouped(known, "surge_linear_damping", "surge_quadratic_damping", "thrust_scale")
    assert grouped(known, "steady_current", "mean_wind")
    assert {"surge_added_mass", "sway_lift", "thruster_lag"} <= {*known.dormant, *known.noise_limited}


def test_a_rich_log_shows_everything():
    log = simulate_world(HULL, {}, duration=200.0, noise="field", seed=3).motion(0.05)
    _, known = examined([log])
    assert (known.dormant, known.noise_limited, known.quiet_axes) == ((), (), ())
    assert not grouped(known, "surge_linear_damping", "surge_quadratic_damping")
    assert known.condition is not None
    assert 1.0 < known.condition < 1e5


def test_axes_and_columns_that_are_only_noise_are_flagged():
    search, known = examined([steady(HULL)])
    assert known.quiet_axes == ("sway", "yaw")
    np.testing.assert_array_equal(search.quiet, [False, True, True])
    assert np.sqrt(search.floor[2]) > 3.0 * search.noise_error[2]
    weaving = steady(HULL)
    swing = 0.004 * np.sin(0.8 * weaving.time)
    log = replace(weaving, velocity=weaving.velocity + np.outer(swing, [0.0, 0.0, 1.0]))
    rough = replace(log, velocity=log.velocity + np.random.default_rng(1).normal(size=(log.time.size, 3)) * 0.02)
    _, drowned = examined([rough])
    blind = {*drowned.dormant, *drowned.noise_limited}
    assert {"yaw_linear_damping", "yaw_speed_damping", "yaw_added_mass"} <= blind


def test_noise_limited_columns_are_told_from_dormant_ones():
    log = simulate_world(HULL, {}, programme="gentle", duration=150.0, noise="clean", seed=4).motion(0.05)
    noise = np.random.default_rng(2).normal(size=log.velocity.shape) * [0.0, 1.0, 0.0]
    _, known = examined([replace(log, velocity=log.velocity + noise)])
    assert known.excitation["sway_quadratic_damping"].signal_to_noise < 2.0
    assert "sway_quadratic_damping" in (*known.noise_limited, *known.dormant)
    assert "surge_linear_damping" not in (*known.noise_limited, *known.dormant)


def test_noise_on_a_quiet_axis_names_no_effect():
    for hidden in ({"X_uu": HULL.value("X_uu") - 6.0}, {"thrust_scale": 0.75}, {"X_u": HULL.value("X_u") - 8.0}):
        found = find_missing([steady(HULL.with_values(hidden))], HULL).findings
        assert (found.verdict, found.missing) == ("undecided", ())


def test_alias_groups_are_connected_components_over_several_columns():
    rng = np.random.default_rng(0)
    x, y, z = rng.normal(size=(3, 500))
    table = np.column_stack([x, x + 0.05 * y, y, x + y, z])
    groups = alias_groups(table.T @ table, {"a": [0], "b": [1], "c": [0, 2], "d": [3], "e": [4]})
    assert groups == (("a", "b", "c", "d"),)
    angle = np.arccos(ALIAS)
    for turn, count in ((angle - 1e-3, 1), (angle + 1e-3, 0)):
        near = np.array([[1.0, np.cos(turn)], [np.cos(turn), 1.0]])
        assert len(alias_groups(near, {"a": [0], "b": [1]})) == count


def test_a_plausible_amount_makes_a_quarter_of_the_force_and_keeps_to_the_limits():
    search, _ = examined([steady(HULL)])
    amounts = plausible_amounts(search, rehearse(search, HULL, ()))
    assert 0.05 < amounts["steady_current"][0] < 1.0
    assert amounts["reverse_thrust_loss"][0] <= 1.0
    assert amounts["cg_offset"][0] <= 0.3
    assert amounts["thruster_lag"] == (1.0,)
    assert amounts["thrust_scale"][0] == pytest.approx(PLAUSIBLE, rel=0.5)


# Advice


def partings(log: Motion, questions: dict[str, tuple[str, ...]]) -> dict[str, float]:
    """Gain of each trial for one question about the nominal model."""
    search, _ = examined([log])
    rehearsal = rehearse(search, HULL, ())
    assert rehearsal is not None
    state = search.evaluate(HULL, ())
    (found,) = separate_effects(search, state, questions, plausible_amounts(search, rehearsal), rehearsal)
    return {trial.name: float(gain) for trial, gain in zip(rehearsal.trials, found.gain, strict=True)}


def test_reverse_thrust_asks_for_astern():
    found = find_missing([gentle(HULL)], HULL).findings
    (item,) = [item for item in found.advice if "reverse thrust loss" in item.why]
    assert "astern" in item.manoeuvre
    assert "% of the" in item.why
    assert "(in this log: 0.0 %)" in item.why
    gains = partings(gentle(HULL), {"reverse_thrust_loss": ()})
    assert max(gains, key=lambda name: gains[name]) in ("astern_run", "reversals", "turns_astern")
    assert gains["speed_steps"] == gains["zigzag_10"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("hidden", [{"wind_force_north": 6.0}, {"current_north": 0.35}], ids=["wind", "current"])
def test_current_and_wind_on_one_heading_ask_for_several(hidden: dict[str, float]):
    found = find_missing([steady(HULL.with_values(hidden))], HULL).findings
    item = next(item for item in found.advice if "steady current" in item.why and "mean wind" in item.why)
    (trial,) = [t for t in TRIALS if item.manoeuvre.startswith(t.text)]
    (runs,) = drive(HULL, [trial])
    assert max(np.ptp(run.heading) for run in runs) > np.pi or len(trial.headings) == 4


def test_a_trial_like_the_log_tells_nothing_that_the_log_does_not():
    gains = partings(steady(HULL), {"surge_linear_damping": ("surge_quadratic_damping",)})
    straight = ("acceleration_coast", "speed_steps", "astern_run", "reversals")
    assert max(gains[name] for name in straight) > 5.0
    assert gains["spin"] < 5.0


def test_steady_running_asks_for_other_speeds():
    found = find_missing([steady(HULL.with_values({"thrust_scale": 0.75}))], HULL).findings
    first = next(t for t in TRIALS if found.advice[0].manoeuvre.startswith(t.text))
    assert len({common for _, common, _ in first.steps}) > 1
    assert "apart" in found.advice[0].why


def test_look_alikes_name_each_other():
    found = find_missing([steady(HULL.with_values({"thrust_scale": 0.75}))], HULL).findings
    by_name = {c.effect: c for c in found.candidates}
    (first,) = [c for c in found.candidates if c.terms]
    assert {"surge_linear_damping", "surge_quadratic_damping"} <= {first.effect, *first.indistinguishable_from}
    for name in first.indistinguishable_from:
        assert by_name[name].indistinguishable_from == (first.effect,)
        assert by_name[name].verdict == "possible"
        assert "cannot tell it from" in by_name[name].sentence


def test_nothing_open_asks_for_nothing():
    log = simulate_world(HULL, {"X_uu": -9.0}, duration=200.0, noise="field", seed=3).motion(0.05)
    found = find_missing([log], HULL).findings
    assert found.missing == ("surge_quadratic_damping",)
    assert found.advice == ()


def test_no_more_than_six_manoeuvres_and_no_percentage_that_is_not_a_number():
    log = simulate_world(HULL, {}, duration=90.0, noise="clean", seed=1).motion(0.05)
    still = replace(log, velocity=0.0 * log.velocity, commands=0.0 * log.commands, position=0.0 * log.position)
    found = find_missing([noisy(still, 3)], HULL).findings
    assert 1 <= len(found.advice) <= advice.MOST_ITEMS
    assert "nan" not in str(found.advice)


def test_a_trial_in_which_hardly_any_of_an_effect_acts_settles_nothing():
    share = np.array([[0.5, 0.0, 0.0], [0.002, 0.02, 0.0]])
    one = Separation(("a",), True, np.full((2, 3), 20.0), share, np.zeros(3), np.ones(2))
    assert advice._where_visible(one).information.tolist() == [[20.0, 0.0, 0.0], [0.0, 20.0, 0.0]]


def test_a_question_that_no_manoeuvre_settles_is_said_to_be_one():
    parting = Separation(("a", "b"), True, np.zeros((14, 3)), np.zeros((14, 3)), np.zeros(3), np.zeros(14))
    assert advice.advise_otherwise([parting], 14) == Advice(
        manoeuvre="measure one of the look-alikes by other means, and give its value in the vehicle file",
        why="would tell a from b: none of the 14 manoeuvres that were rehearsed would do",
    )


def test_the_findings_say_what_the_log_can_tell():
    found = json.loads(strict_json(find_missing([steady(HULL)], HULL).findings.to_dict()))["identifiability"]
    assert set(found) == {"groups", "dormant", "absorbed", "noise_limited", "quiet_axes", "condition", "excitation"}
    assert found["excitation"]["thrust_scale"]["signal_to_noise"] is None
    assert found["quiet_axes"] == ["sway", "yaw"]


@pytest.mark.parametrize(
    ("hidden", "effect"),
    [
        ({"X_uu": HULL.value("X_uu") - 6.0}, "surge_quadratic_damping"),
        ({"thrust_scale": 0.75}, "thrust_scale"),
        ({"wind_force_north": 6.0}, "mean_wind"),
        ({"current_north": 0.35}, "steady_current"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_following_the_advice_names_the_right_look_alike(hidden: dict[str, float], effect: str):
    truth = HULL.with_values(hidden)
    log = steady(truth)
    before = find_missing([log], HULL).findings
    assert (before.verdict, before.missing) == ("undecided", ())
    assert followed(log, truth, before, 2).missing == (effect,)


def test_following_the_advice_shows_what_was_dormant():
    truth = HULL.with_values({"reverse_scale": 0.5})
    log = gentle(truth)
    before = find_missing([log], HULL).findings
    assert before.missing == ()
    assert followed(log, truth, before, 1).missing == ("reverse_thrust_loss",)
