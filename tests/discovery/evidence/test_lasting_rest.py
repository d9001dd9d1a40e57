"""Force that lasts and that nothing takes: beside it a name is less sure; noise and waves leave none."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery import discover
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.shooting import Shooting, ShootingSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.free_forms import changes_in_time, free_forms, is_sideways
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.lasting_rest import beside_rests, lasting_rests, left_by_all
from undertow.discovery.evidence.other_forms import OtherForms
from undertow.discovery.findings import Findings, LastingRest, OtherForm
from undertow.discovery.found_effects import Claim, FoundEffect
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import SearchSettings
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
DRAG = "surge_quadratic_damping"


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


def drag_in(findings: Findings) -> tuple[FoundEffect, Claim]:
    """What is found of the drag, which is a claim."""
    (effect,) = [c for c in findings.candidates if c.effect == DRAG]
    assert effect.claim is not None
    return effect, effect.claim


def test_what_lasts_where_a_name_acts_is_a_doubt_as_large_as_its_share(monkeypatch: pytest.MonkeyPatch):
    motion, rests = world("field", hidden=-30.0), [LastingRest(axis="yaw", force=4.2, share=0.31, unit="N m")]
    monkeypatch.setattr(discover, "lasting_rests", lambda *_: tuple(rests))
    elsewhere = find_missing([motion], HULL).findings
    assert (elsewhere.missing, elsewhere.rests) == ((DRAG,), tuple(rests))
    assert elsewhere.headline == "The model is missing surge quadratic damping."
    assert elsewhere.reasons[0].startswith("4.2 N m of the yaw force at work, 31 % of it, last for seconds")
    assert elsewhere.reasons[0].endswith("explained by nothing that was looked for.")
    rests.append(LastingRest(axis="surge", force=5.1, share=0.2, unit="N"))
    findings = find_missing([motion], HULL).findings
    (before, plain), (effect, claim) = drag_in(elsewhere), drag_in(findings)
    assert "lasting_rest" not in plain.tests
    own = 0.2 / claim.tests["lasting_rest"]
    assert 0.3 < own <= 1.5, "the share of the force at work that the drag alone explains"
    assert effect.confidence <= before.confidence
    assert findings.verdict != "nothing missing"
    assert [reason.partition(" of the ")[0] for reason in findings.reasons[:2]] == ["4.2 N m", "5.1 N"]


def test_a_log_that_leaves_a_part_of_its_force_is_not_said_to_miss_nothing(monkeypatch: pytest.MonkeyPatch):
    rest = LastingRest(axis="yaw", force=4.2, share=0.31, unit="N m")
    monkeypatch.setattr(discover, "lasting_rests", lambda *_: (rest,))
    findings = find_missing([world()], HULL).findings
    assert (findings.verdict, findings.missing) == ("undecided", ())
    assert findings.headline == "Undecided: part of the force in yaw has no name."


@pytest.mark.parametrize(("axis", "reached"), [("surge", True), ("yaw", False)])
def test_a_form_that_is_left_is_beside_the_names_on_its_axis(axis: str, reached: bool):
    form = OtherForm(axis=axis, follows="v|v|", force=0.1, share=0.021, unit="N")
    left = beside_rests(candidates(HULL), [DRAG], left_by_all((), [form]))
    assert bool(left) == reached
    if reached:
        share, told = left[DRAG]
        assert share == 0.021
        assert "that follows v|v| stays unexplained" in told


def test_of_several_rests_the_largest_is_told():
    rest = LastingRest(axis="surge", force=5.1, share=0.2, unit="N")
    form = OtherForm(axis="surge", follows="v|v|", force=0.1, share=0.021, unit="N")
    assert beside_rests(candidates(HULL), [DRAG], left_by_all([rest], [form])) == {DRAG: (0.2, rest.in_words)}
    assert beside_rests(candidates(HULL), [], left_by_all([rest], [form])) == {}


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
    assert sorted(beside_rests(candidates(HULL), names, left_by_all((), [form]))) == sorted(doubted)


def test_every_form_in_time_is_known_as_one():
    forms = free_forms(WeakForm([world()], WeakSettings()), HULL).names
    in_time = {name for name in forms if "minute" in name or "the time" in name}
    assert {name for name in forms if changes_in_time(name)} == in_time
    assert len(in_time) > 20
    sideways = {name for name in forms if is_sideways(name)}
    assert {"v", "r|r|", "u^2v", "uvr"} <= sideways
    assert not any("thrust" in name or "heading" in name or name.startswith("u ") for name in sideways)
    assert any(" beyond " in name for name in sideways)


def test_a_form_that_is_left_is_told_and_doubts_what_acts_there(monkeypatch: pytest.MonkeyPatch):
    form = OtherForm(axis="surge", follows="u beyond 1.1 m/s", force=0.2, share=0.05, unit="N")
    monkeypatch.setattr(discover, "other_forms", lambda *_: OtherForms((form,)))
    found = find_missing([world("field", hidden=-30.0)], HULL)
    assert not found.basis.rolls
    _, claim = drag_in(found.findings)
    assert 0.0 < claim.tests["lasting_rest"] < 0.2
    assert any("u beyond 1.1 m/s stays unexplained, 5 % of the force at work" in r for r in found.findings.reasons)
