"""Force that lasts and that nothing takes: beside it no effect is named; noise and waves leave none."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery import discover
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.discover import find_missing
from undertow.discovery.evidence.lasting_rest import LastingRest, lasting_rest
from undertow.discovery.search.floating import Search
from undertow.discovery.search.scoring import SearchSettings
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
SEEING = (False, False, False)


def world(noise: str = "clean", waves: float = 0.0, hidden: float = 0.0) -> Motion:
    effects = {"surge_quadratic_damping": hidden} if hidden else {}
    return simulate_world(HULL, effects, duration=150.0, noise=noise, waves=waves, seed=4).motion()


def cut(motion: Motion, share: float = 0.35) -> Motion:
    """The record of the commands cut at a share of the largest."""
    limit = share * np.abs(motion.commands).max()
    return replace(motion, commands=motion.commands.clip(-limit, limit))


def rest_of(motion: Motion, found: Vehicle = HULL, blind: tuple[bool, ...] = SEEING) -> LastingRest | None:
    return lasting_rest(Search(WeakForm([motion], WeakSettings()), HULL, (), SearchSettings()), found, blind)


@pytest.mark.parametrize(("noise", "waves"), [("clean", 0.0), ("rough", 0.0), ("field", 0.2)])
def test_noise_and_waves_leave_nothing_that_lasts(noise: str, waves: float):
    assert rest_of(world(noise, waves)) is None


def test_commands_cut_in_the_record_leave_what_no_model_takes():
    rest = rest_of(cut(world("field", 0.1)))
    assert rest is not None
    assert rest.axis in {"surge", "yaw"}
    assert 0.1 < rest.share < 1.0
    assert f"{100.0 * rest.share:.0f} % of it, last for seconds" in rest.sentence


def test_what_an_effect_takes_is_no_rest():
    missing = world(hidden=-30.0)
    assert rest_of(missing) is not None
    assert rest_of(missing, HULL.with_values({"X_uu": HULL.value("X_uu") - 30.0})) is None


def test_an_axis_that_the_log_does_not_show_is_not_judged():
    assert rest_of(world(hidden=-30.0), blind=(True, False, False)) is None


def test_beside_a_rest_nothing_is_called_missing(monkeypatch: pytest.MonkeyPatch):
    motion = world("field", hidden=-30.0)
    assert find_missing([motion], HULL).findings.missing == ("surge_quadratic_damping",)
    rest = LastingRest("yaw", 4.2, 0.31, "N m")
    monkeypatch.setattr(discover, "lasting_rest", lambda *_: rest)
    findings = find_missing([motion], HULL).findings
    assert (findings.verdict, findings.missing) == ("undecided", ())
    assert findings.headline.startswith("Undecided: 4.2 N m of the yaw force at work, 31 % of it, last for seconds")
    assert "(perhaps surge quadratic damping)" in findings.headline
    (effect,) = [c for c in findings.candidates if c.effect == "surge_quadratic_damping"]
    assert (effect.verdict, rest.sentence in effect.sentence) == ("possible", True)
    assert find_missing([world()], HULL).findings.verdict == "undecided"
