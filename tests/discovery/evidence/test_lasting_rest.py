"""Force that lasts and that nothing takes: beside it a name is less sure; noise and waves leave none."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery import discover, verdicts
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.unexplained import find_persistent_residuals
from undertow.discovery.evidence.unmodelled_forces import UnmodelledForces
from undertow.discovery.findings import OtherForm, PersistentResidual
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


def rest_of(motion: Motion, found: Vehicle = HULL) -> tuple[PersistentResidual, ...]:
    form = WeakForm([motion], WeakSettings())
    return find_persistent_residuals(Search(form, HULL, (), SearchSettings()), form, found)


@pytest.mark.parametrize(("noise", "waves"), [("clean", 0.0), ("rough", 0.0), ("field", 0.2)])
def test_noise_and_waves_leave_nothing_that_lasts(noise: str, waves: float):
    assert rest_of(world(noise, waves)) == ()


def test_commands_cut_in_the_record_leave_what_no_model_takes():
    rests = rest_of(cut(world("field", 0.1)))
    assert "surge" in {rest.axis for rest in rests}
    for rest in rests:
        assert 0.1 < rest.share < 1.0
        assert f"{100.0 * rest.share:.0f} % of it, last for seconds" in rest.in_words


def test_what_an_effect_takes_is_no_rest():
    missing = world(hidden=-30.0)
    assert [rest.axis for rest in rest_of(missing)] == ["surge"]
    assert rest_of(missing, HULL.with_values({"X_uu": HULL.value("X_uu") - 30.0})) == ()


def test_what_pushes_a_turning_boat_to_one_side_of_the_world_lasts_there_and_on_no_axis():
    windy = simulate_world(HULL, {"mean_wind": (5.0, 0.0)}, duration=150.0, noise="field", seed=4).motion()
    assert [rest.axis for rest in rest_of(windy)] == ["north-south"]
    (rest,) = rest_of(windy)
    assert rest.force == pytest.approx(5.0, rel=0.1)
    assert rest_of(windy, HULL.with_values({"wind_force_north": 5.0})) == ()


def test_noise_of_the_speeds_that_lasts_is_no_force():
    """What noise that is remembered for a second makes of means over five is half of it over ten, but for its drag."""
    sound, rng = world("field"), np.random.default_rng(3)
    noise, kept = np.zeros_like(sound.velocity), np.exp(-sound.time_step / 1.0)
    for k in range(1, len(noise)):
        noise[k] = kept * noise[k - 1] + np.sqrt(1.0 - kept**2) * rng.standard_normal(3)
    assert rest_of(replace(sound, velocity=sound.velocity + noise * (0.015, 0.015, 0.0015))) == ()


def test_what_lasts_is_told_beside_the_names(monkeypatch: pytest.MonkeyPatch):
    motion, rests = world("field", hidden=-30.0), [PersistentResidual(axis="yaw", force=4.2, share=0.31, unit="N m")]
    monkeypatch.setattr(discover, "find_persistent_residuals", lambda *_: tuple(rests))
    elsewhere = find_missing([motion], HULL).findings
    assert (elsewhere.missing, elsewhere.rests) == ((DRAG,), tuple(rests))
    assert elsewhere.headline == "The file's X_uu (about -38, not -8) is off."
    assert elsewhere.reasons[0].startswith("4.2 N m of the yaw force at work, 31 % of it, last for seconds")
    assert elsewhere.reasons[0].endswith("explained by no effect that was looked for.")
    rests.append(PersistentResidual(axis="surge", force=5.1, share=0.2, unit="N"))
    findings = find_missing([motion], HULL).findings
    assert findings.verdict != "nothing missing"
    assert [reason.partition(" of the ")[0] for reason in findings.reasons[:2]] == ["4.2 N m", "5.1 N"]


def test_what_comes_and_goes_is_told_where_nothing_else_is_known(monkeypatch: pytest.MonkeyPatch):
    rest = PersistentResidual(axis="surge", force=4.2, share=0.13, unit="N")
    monkeypatch.setattr(discover, "find_persistent_residuals", lambda *_: (rest,))
    monkeypatch.setattr(discover, "find_passing_residuals", lambda *_: {"sway": 0.74, "surge": 0.16})
    headline = find_missing([world("field", waves=0.4)], HULL).findings.headline  # rollouts judge
    assert headline.startswith("Undecided: part of the force in surge has no name. 74")
    assert headline.endswith("% of the force at work in sway comes and goes within seconds, as in waves and gusts.")


def test_a_force_without_a_name_is_told_before_a_name_that_is_not_likely(monkeypatch: pytest.MonkeyPatch):
    motion, form = (
        world("field", hidden=-1.6),
        OtherForm(axis="surge", follows="u from minute 1.3 on", force=4.0, share=0.2, unit="N"),
    )
    monkeypatch.setattr(discover, "fit_unmodelled_forces", lambda *_: UnmodelledForces((form,)))
    for sure, told in (
        (0.13, "part of the surge force follows u from minute 1.3 on, and no name is likely"),
        (0.6, "something is missing; perhaps"),
    ):
        monkeypatch.setattr(verdicts, "probability", lambda _, sure=sure: sure)
        headline = find_missing([motion], HULL).findings.headline
        assert headline.startswith(f"Undecided: {told}")
        assert "surge quadratic damping" in headline


def test_a_force_that_keeps_to_a_side_of_the_world_is_told_as_one(monkeypatch: pytest.MonkeyPatch):
    rest = PersistentResidual(axis="east-west", force=4.2, share=0.31, unit="N")
    monkeypatch.setattr(discover, "find_persistent_residuals", lambda *_: (rest,))
    findings = find_missing([world()], HULL).findings
    assert findings.headline == (
        "Undecided: part of the force keeps to east-west, whichever way the hull points, and has no name."
    )


def test_a_force_without_a_name_is_told_of_a_log_in_which_no_name_is_found(monkeypatch: pytest.MonkeyPatch):
    slight, larger = (
        OtherForm(axis=axis, follows=follows, force=4.0, share=share, unit="N")
        for axis, follows, share in (("surge", "u from minute 2 on", 0.01), ("yaw", "the thrust of port", 0.12))
    )
    for forms, verdict in (((slight, larger), "undecided"), ((slight,), "nothing missing")):
        monkeypatch.setattr(discover, "fit_unmodelled_forces", lambda *_, forms=forms: UnmodelledForces(forms))
        findings = find_missing([world("field")], HULL).findings
        assert (findings.verdict, findings.missing) == (verdict, ())
        assert ("part of the yaw moment follows the thrust of port" in findings.headline) == (verdict == "undecided")
        assert any("stays unexplained, 12" in reason for reason in findings.reasons) == (verdict == "undecided")


def test_a_log_that_leaves_a_part_of_its_force_is_not_said_to_miss_nothing(monkeypatch: pytest.MonkeyPatch):
    rest = PersistentResidual(axis="yaw", force=4.2, share=0.31, unit="N m")
    monkeypatch.setattr(discover, "find_persistent_residuals", lambda *_: (rest,))
    findings = find_missing([world()], HULL).findings
    assert (findings.verdict, findings.missing) == ("undecided", ())
    assert findings.headline == "Undecided: part of the force in yaw has no name."
