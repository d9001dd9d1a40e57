"""Force that lasts and that nothing takes: beside it no effect is named; noise and waves leave none."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery import discover
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.shooting import Shooting, ShootingSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import Kind, candidates
from undertow.discovery.candidates.free_forms import changes_in_time, free_forms, is_sideways
from undertow.discovery.candidates.unnamed_terms import term_candidate
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.lasting_rest import (
    beside_rests,
    beyond_limits,
    lasting_rests,
    left_by_all,
    many_terms,
    of_stand_ins,
)
from undertow.discovery.evidence.other_forms import OtherForms
from undertow.discovery.evidence.weighing import Evidence
from undertow.discovery.findings import LastingRest, OtherForm
from undertow.discovery.reason import Reason
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import SearchSettings
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


def world(noise: str = "clean", waves: float = 0.0, hidden: float = 0.0) -> Motion:
    effects = {"surge_quadratic_damping": hidden} if hidden else {}
    return simulate_world(HULL, effects, duration=150.0, noise=noise, waves=waves, seed=4).motion()


def cut(motion: Motion, share: float = 0.35) -> Motion:
    """The record of the commands cut at a share of the largest."""
    limit = share * np.abs(motion.commands).max()
    return replace(motion, commands=motion.commands.clip(-limit, limit))


def rest_of(motion: Motion, found: Vehicle = HULL) -> tuple[LastingRest, ...]:
    form = WeakForm([motion], WeakSettings())
    return lasting_rests(Search(form, HULL, (), SearchSettings()), form, found)


@pytest.mark.parametrize(("noise", "waves"), [("clean", 0.0), ("rough", 0.0), ("field", 0.2)])
def test_noise_and_waves_leave_nothing_that_lasts(noise: str, waves: float):
    assert rest_of(world(noise, waves)) == ()


def test_commands_cut_in_the_record_leave_what_no_model_takes():
    rests = rest_of(cut(world("field", 0.1)))
    assert {rest.axis for rest in rests} == {"surge", "yaw"}
    for rest in rests:
        assert 0.1 < rest.share < 1.0
        assert f"{100.0 * rest.share:.0f} % of it, last for seconds" in rest.in_words


def test_what_an_effect_takes_is_no_rest():
    missing = world(hidden=-30.0)
    assert [rest.axis for rest in rest_of(missing)] == ["surge"]
    assert rest_of(missing, HULL.with_values({"X_uu": HULL.value("X_uu") - 30.0})) == ()


def test_an_axis_that_the_judge_does_not_see_is_not_told_of():
    missing = world(hidden=-30.0)
    forces = Search(WeakForm([missing], WeakSettings()), HULL, (), SearchSettings())
    judge = Shooting([missing], HULL, ShootingSettings(), (True, False, False))
    assert lasting_rests(forces, judge, HULL) == ()


def test_what_acts_where_a_rest_lasts_is_not_called_missing(monkeypatch: pytest.MonkeyPatch):
    motion = world("field", hidden=-30.0)
    assert find_missing([motion], HULL).findings.missing == ("surge_quadratic_damping",)
    rests = [LastingRest(axis="yaw", force=4.2, share=0.31, unit="N m")]
    monkeypatch.setattr(discover, "lasting_rests", lambda *_: tuple(rests))
    findings = find_missing([motion], HULL).findings
    assert (findings.missing, findings.rests) == (("surge_quadratic_damping",), tuple(rests))
    assert findings.headline == "The model is missing surge quadratic damping."
    assert findings.reasons[0].endswith("explained by nothing that was looked for.")
    assert find_missing([world()], HULL).findings.verdict == "undecided"
    rests.append(LastingRest(axis="surge", force=5.1, share=0.2, unit="N"))
    findings = find_missing([motion], HULL).findings
    assert (findings.verdict, findings.missing) == ("undecided", ())
    assert findings.headline == "Undecided: part of the force in yaw and surge has no name."
    assert findings.reasons[0].startswith("4.2 N m of the yaw force at work, 31 % of it, last for seconds")
    assert "(perhaps surge quadratic damping)" in findings.reasons[2]
    (effect,) = [c for c in findings.candidates if c.effect == "surge_quadratic_damping"]
    assert (effect.verdict, effect.reason) == ("possible", Reason.LASTING_REST)
    assert rests[1].in_words in effect.sentence


@pytest.mark.parametrize(
    ("axis", "share", "doubted"), [("surge", 0.019, False), ("surge", 0.021, True), ("yaw", 0.9, False)]
)
def test_a_material_form_that_is_left_doubts_the_names_on_its_axis(axis: str, share: float, doubted: bool):
    form = OtherForm(axis=axis, follows="v|v|", force=0.1, share=share, unit="N")
    why = beside_rests(candidates(HULL), ["surge_quadratic_damping"], left_by_all((), [form], 0.02))
    assert bool(why) == doubted
    assert not why or "that follows v|v| stays unexplained" in why["surge_quadratic_damping"]


@pytest.mark.parametrize(
    ("follows", "doubted"),
    [
        ("v^3", ["sway_lift"]),
        ("r beyond 0.3 rad/s either way", ["sway_lift"]),
        ("u|u|", []),
        ("the thrust of port", []),
        ("v from minute 2.0 on", ["sway_lift", "sway_trim", "surge_quadratic_damping"]),
        ("the time", ["sway_lift", "sway_trim", "surge_quadratic_damping"]),
    ],
)
def test_a_form_reaches_as_far_as_its_cause(follows: str, doubted: list[str]):
    """Strips of a hull push in sway and yaw alike, and what changes in time makes another boat."""
    form = OtherForm(axis="yaw", follows=follows, force=0.1, share=0.05, unit="N m")
    names = ["sway_lift", "sway_trim", "surge_quadratic_damping"]
    assert sorted(beside_rests(candidates(HULL), names, left_by_all((), [form], 0.02))) == sorted(doubted)


def test_every_form_in_time_is_known_as_one():
    forms = free_forms(WeakForm([world()], WeakSettings()), HULL).names
    in_time = {name for name in forms if "minute" in name or "the time" in name}
    assert {name for name in forms if changes_in_time(name)} == in_time
    assert len(in_time) > 20
    sideways = {name for name in forms if is_sideways(name)}
    assert {"v", "r|r|", "u^2v", "uvr"} <= sideways
    assert not any("thrust" in name or "heading" in name or name.startswith("u ") for name in sideways)
    assert any(" beyond " in name for name in sideways)


def test_a_log_that_leaves_a_material_form_gets_no_name(monkeypatch: pytest.MonkeyPatch):
    form = OtherForm(axis="surge", follows="u beyond 1.1 m/s", force=0.2, share=0.05, unit="N")
    plain = find_missing([world("field", hidden=-30.0)], HULL)
    assert plain.findings.missing == ("surge_quadratic_damping",)
    assert not plain.basis.rolls
    told = OtherForms((form,))
    monkeypatch.setattr(discover, "other_forms", lambda *_: told)
    findings = find_missing([world("field", hidden=-30.0)], HULL).findings
    assert (findings.verdict, findings.missing) == ("undecided", ())
    assert "u beyond 1.1 m/s stays unexplained, 5 % of the force at work" in findings.candidates[0].sentence


@pytest.mark.parametrize(
    ("symbols", "doubted"),
    [
        (("sway:vr", "sway:ur^2", "yaw:vr"), []),
        (("sway:vr", "sway:ur^2", "sway:vr|v|"), ["sway_lift", "sway_yaw_coupling"]),
    ],
    ids=["two on an axis", "three on an axis"],
)
def test_names_beside_a_series_of_terms_are_not_certain(symbols: tuple[str, ...], doubted: list[str]):
    left = many_terms([term_candidate(symbol, HULL) for symbol in symbols])
    names = ["sway_lift", "sway_yaw_coupling", "surge_quadratic_damping"]
    assert sorted(beside_rests(candidates(HULL), names, left)) == doubted


def test_names_beside_a_physical_limit_are_not_certain():
    pool = candidates(HULL)
    left = beyond_limits(pool, ["sway_linear_damping"])
    assert [one.axis for one in left] == ["sway"]
    names = ["sway_lift", "sway_trim", "surge_quadratic_damping", "yaw_quadratic_damping", "steady_current"]
    doubted = beside_rests(pool, names, left)
    assert sorted(doubted) == ["steady_current", "sway_lift", "sway_trim"]
    assert "more sway linear damping is asked for than physics allows" in doubted["sway_trim"]
    assert beyond_limits(pool, []) == []


def test_names_beside_a_stand_in_are_not_certain_where_it_acts():
    loss = Evidence(
        "advance_loss", Kind.EFFECT, True, 90.0, np.array([0.02, 0.0, 0.006]), 0.3, 1.0, (), rollouts_object=False
    )
    left = of_stand_ins([loss], {"advance_loss"}, 0.007)
    assert [(one.axis, one.in_words) for one in left] == [
        ("surge", "advance loss is not quite what acts, as beside something else that has no name")
    ]
    names = ["surge_linear_damping", "yaw_linear_damping"]
    assert list(beside_rests(candidates(HULL), names, left)) == ["surge_linear_damping"]
    assert of_stand_ins([loss], (), 0.007) == []
