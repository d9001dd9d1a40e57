"""What moves a quiet axis: told as a group of effects that would explain it as well, none of them missing."""

from collections.abc import Mapping

from undertow.discovery.discover import find_missing
from undertow.discovery.findings import Findings
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat_paper")
SWAY = ("sway_linear_damping", "sway_quadratic_damping", "wake_memory", "sway_lift", "sway_yaw_coupling")


def found(hidden: Mapping[str, float]) -> Findings:
    """What discovery says of gentle turns, in which this hull hardly drifts."""
    world = simulate_world(HULL, hidden, programme="gentle", duration=200.0, noise="field", seed=4)
    findings = find_missing([world.motion(0.05)], HULL).findings
    assert findings.identifiability is not None
    assert findings.identifiability.quiet_axes == ("sway",)
    return findings


def test_effects_that_explain_a_quiet_axis_as_well_name_each_other():
    findings = found({"Y_v": HULL.value("Y_v") - 20.0})
    assert (findings.verdict, findings.missing) == ("undecided", ())
    assert findings.headline.startswith("Undecided: ")
    assert findings.headline.endswith(" or sway quadratic damping is missing, and this log cannot tell which.")
    by_name = {candidate.effect: candidate for candidate in findings.candidates}
    first = by_name["sway_linear_damping"]
    group = {first.effect, *first.indistinguishable_from}
    assert len(group) > 1
    assert group <= set(SWAY)
    assert {candidate.effect for candidate in findings.candidates[: len(group)]} == group
    for name in group:
        assert {name, *by_name[name].indistinguishable_from} == group
        assert by_name[name].verdict == "possible"
        assert by_name[name].confidence <= 1.0 / len(group)
        assert by_name[name].sentence.startswith("This log cannot tell it from ")
        assert "what moves sway for certain" in by_name[name].sentence
    assert any("sway linear damping" in item.why for item in findings.advice)


def test_noise_on_a_quiet_axis_moves_nothing():
    findings = found({})
    assert findings.verdict == "nothing missing"
    assert not any(candidate.indistinguishable_from for candidate in findings.candidates)


def test_an_effect_that_explains_a_quiet_axis_best_is_possible_and_not_missing():
    findings = found({"Y_ur": 13.0})
    assert (findings.verdict, findings.missing) == ("undecided", ())
    first = findings.candidates[0]
    assert (first.effect, first.verdict) == ("sway_lift", "possible")
    assert set(first.indistinguishable_from) <= set(SWAY)
    assert "it would explain what moves sway for certain" in first.sentence
