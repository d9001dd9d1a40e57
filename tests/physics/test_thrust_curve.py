"""The free thrust curve: closed form, that it always rises, and that simpler effects are named where they suffice."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.discover import Discovery, find_missing
from undertow.discovery.lawful.refit import lawful_refit
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.physics.effects import BY_NAME
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.integration import simulate_motion
from undertow.physics.thrusters import GAINS, PropellerCurve, TableCurve, Thruster
from undertow.physics.vehicle import load_vehicle, vehicle_from_dict
from undertow.physics.worlds.hidden_effects import apply_effects, parse_effect
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
LINEAR = TableCurve(kind="table", command=(-30.0, 30.0), force=(-30.0, 30.0))
WEAKER_ASTERN = TableCurve(kind="table", command=(-30.0, -15.0, 0.0, 30.0), force=(-18.0, -6.0, 0.0, 30.0))
PROPELLER = PropellerCurve(kind="propeller", scale=70.0, offset=-0.5, k_t=0.02, rho=1025.0, diameter=0.112)
CURVES = {"linear": ("newton", LINEAR), "table": ("newton", WEAKER_ASTERN), "propeller": ("normalized", PROPELLER)}


def thruster(curve: str = "linear", **faults: float) -> Thruster:
    command, found = CURVES[curve]
    return Thruster.model_validate({"name": "one", "x": 0.0, "y": 0.0, "command": command, "curve": found, **faults})


def force(one: Thruster, command: Any) -> np.ndarray:
    return one.response(np.asarray(command, dtype=float), 0.1)[0]


def full(one: Thruster) -> np.ndarray:
    return np.linspace(-1.0, 1.0, 401) * (30.0 if one.command == "newton" else 1.0)


def test_each_third_of_the_command_has_its_slope() -> None:
    gains = dict(zip(GAINS, (0.5, 0.0, 2.0, 0.1, 1.0, 3.0), strict=True))
    ends = [-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0]
    np.testing.assert_allclose(force(thruster(**gains), ends), [-25.0, -20.0, -20.0, 0.0, 1.0, 11.0, 41.0])
    np.testing.assert_allclose(force(thruster(**gains), [-25.0, 5.0, 25.0]), [-22.5, 0.5, 26.0])


def test_the_curve_bends_before_it_is_scaled_and_cut() -> None:
    one = thruster(gain_ahead_33=0.5, gain_astern_33=2.0, thrust_scale=0.8, reverse_scale=0.5, dead_zone=0.2)
    np.testing.assert_allclose(force(one, [-9.0, -5.0, 5.0, 9.0]), [-9.0 * 2.0 * 0.8 * 0.5, 0.0, 0.0, 9.0 * 0.5 * 0.8])
    slow = thruster(gain_ahead_33=0.5, lag=0.4, delay=0.2)
    command = np.where(np.arange(60) > 10, 10.0, 0.0)
    np.testing.assert_allclose(force(slow, command), 0.5 * force(thruster(lag=0.4, delay=0.2), command), atol=1e-12)
    straight, bent = thruster(advance_loss=6.0), thruster(advance_loss=6.0, gain_ahead_33=0.1)
    loss = [one.response(np.array([15.0]), 0.1)[1] for one in (straight, bent)]
    np.testing.assert_array_equal(loss[0], loss[1])


@pytest.mark.parametrize("curve", CURVES)
def test_scales_are_special_cases(curve: str) -> None:
    plain = thruster(curve)
    rest = force(plain, [0.0])  # a propeller with an offset pushes a little at zero command
    wanted = rest + 0.7 * (force(plain, full(plain)) - rest)
    np.testing.assert_allclose(force(thruster(curve, **dict.fromkeys(GAINS, 0.7)), full(plain)), wanted, atol=1e-12)
    astern = force(thruster(curve, **dict.fromkeys(GAINS[:3], 0.7)), full(plain))
    np.testing.assert_allclose(astern, np.where(full(plain) < 0.0, wanted, force(plain, full(plain))), atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.0, 5.0), min_size=6, max_size=6), st.sampled_from(list(CURVES)), st.booleans())
def test_every_curve_rises_and_rests_at_zero_command(values: list[float], curve: str, turned: bool) -> None:
    one = thruster(curve, **dict(zip(GAINS, values, strict=True)))
    plain = thruster(curve)
    found, command = force(one, full(one)), full(one)
    assert (np.diff(found) >= -1e-12).all()
    assert force(one, [0.0]) == pytest.approx(force(plain, [0.0]), abs=1e-12)
    if turned and isinstance(one.curve, TableCurve):
        # Wired the other way round, the mirrored command gives the same force: ahead stays ahead.
        mirrored = {"command": tuple(-c for c in one.curve.command[::-1]), "force": one.curve.force[::-1]}
        over = one.model_copy(update={"curve": one.curve.model_copy(update=mirrored)})
        np.testing.assert_allclose(force(over, -np.asarray(command)), found, atol=1e-12)


def test_thrusters_of_any_size_bend_alike() -> None:
    large = LINEAR.model_copy(update={"force": (-120.0, 120.0)})
    gains = dict(zip(GAINS, (0.5, 0.2, 2.0, 0.1, 1.0, 3.0), strict=True))
    one = thruster(**gains)
    np.testing.assert_allclose(force(one.model_copy(update={"curve": large}), full(one)), 4.0 * force(one, full(one)))


def test_a_curve_that_falls_is_refused() -> None:
    data = HULL.model_dump(mode="json")
    data["thrusters"][0]["gain_ahead_67"] = -0.1
    with pytest.raises(VehicleError, match=r"thruster 'port': gain_ahead_67: expected at least 0"):
        vehicle_from_dict(data, "falling")
    with pytest.raises(VehicleError, match="gain_astern_33"):
        HULL.with_values({"gain_astern_33": -1e-6}).checked()
    HULL.with_values({"gain_astern_33": 0.0}).checked()
    with pytest.raises(RequestError, match=r"gain_ahead_33 would be -0\.2 .*expected at least 0 and at most 5"):
        apply_effects(HULL, {"gain_ahead_33": -0.2})


def test_the_command_line_reads_a_curve_from_full_astern_to_full_ahead() -> None:
    name, values = parse_effect("thrust_curve=0.5,0.6,0.7,0.8,0.9,1.1")
    bent = apply_effects(HULL, {name: values})
    assert [getattr(bent.thrusters[1], gain) for gain in GAINS] == [0.5, 0.6, 0.7, 0.8, 0.9, 1.1]
    assert BY_NAME["thrust_curve"].symbols == GAINS


def found_in(hidden: dict[str, float], programme: str = "rich", seed: int = 8) -> Discovery:
    world = simulate_world(HULL, hidden, programme=programme, duration=200.0, noise="field", seed=seed)
    return find_missing([world.motion(0.05)], HULL)


@pytest.mark.parametrize(
    ("hidden", "missing"),
    [
        ({"thrust_scale": 0.75, "dead_zone": 0.12}, {"thrust_scale", "thrust_dead_zone"}),
        ({"thrust_scale": 1.25, "reverse_scale": 0.5}, {"thrust_scale", "reverse_thrust_loss"}),
        (
            {"reverse_scale": 0.5, "dead_zone": 0.15, "lag": 0.4},
            {"reverse_thrust_loss", "thrust_dead_zone", "thruster_lag"},
        ),
    ],
)
def test_simple_effects_together_are_not_called_a_curve(hidden: dict[str, float], missing: set[str]) -> None:
    found = found_in(hidden).findings
    assert {*found.missing, *found.likely} == missing
    assert all(c.indistinguishable_from == () for c in found.candidates if c.effect in missing)


def test_a_thruster_that_saturates_is_a_curve_with_a_flat_end() -> None:
    found = found_in({"gain_ahead_100": 0.0, "gain_ahead_67": 0.5, "gain_astern_100": 0.0})
    assert found.findings.missing == ("thrust_curve",)
    for symbol, value in {
        "gain_ahead_100": 0.0,
        "gain_ahead_67": 0.5,
        "gain_astern_100": 0.0,
        "gain_ahead_33": 1.0,
    }.items():
        assert found.corrected.value(symbol) == pytest.approx(value, abs=0.06), symbol
    found.corrected.checked()


def test_a_curve_and_a_drag_are_told_apart() -> None:
    hidden = {"gain_ahead_33": 0.4, "gain_ahead_100": 1.6, "gain_astern_33": 1.5, "gain_astern_100": 0.5, "X_uu": -9.0}
    found = found_in(hidden)
    assert set(found.findings.missing) == {"thrust_curve", "surge_quadratic_damping"}
    assert found.corrected.value("gain_ahead_33") == pytest.approx(0.4, abs=0.08)
    assert found.corrected.value("X_uu") == pytest.approx(-17.0, rel=0.1)


def test_a_refit_never_lets_the_curve_fall() -> None:
    """A log whose thrust falls where the command rises: the refit stops at a flat stretch."""
    world = simulate_world(HULL, {}, duration=60.0, noise="clean", seed=1).motion(0.05)
    odd = np.where(world.commands > 35.0 / 3.0, 35.0 / 3.0 - 0.3 * (world.commands - 35.0 / 3.0), world.commands)
    falling = replace(simulate_motion(HULL, replace(world, commands=odd)), commands=world.commands)
    pool = [c for c in candidates(HULL) if c.key == "thrust_curve"]
    linear, scores = Search(WeakForm([falling], WeakSettings()), HULL, pool, SearchSettings()).linearise(HULL, ())
    chosen = [linear.options["thrust_curve"][1]]
    _, left, right = scores.block_normal(chosen)
    free = 1.0 + np.linalg.lstsq(left.sum(axis=0), right.sum(axis=0))[0]
    assert free.min() < -0.1
    values = lawful_refit(scores, chosen)
    assert 0.0 <= min(values.values()) < 1e-6
    bent = HULL.with_values(values).checked()
    assert (np.diff(force(bent.thrusters[0], np.linspace(-35.0, 35.0, 99))) >= 0.0).all()


def test_gains_of_commands_that_never_came_keep_their_values() -> None:
    """A gentle log never goes astern; with this propeller curve the columns astern are rounding, not zero."""
    paper = load_vehicle("blueboat_paper")
    world = simulate_world(
        paper, {"gain_ahead_33": 2.0, "gain_ahead_67": 0.5}, programme="gentle", duration=200.0, noise="field", seed=2
    )
    found = find_missing([world.motion(0.05)], paper)
    assert found.findings.missing == ("thrust_curve",)
    assert [found.corrected.value(gain) for gain in GAINS[:3]] == [1.0, 1.0, 1.0]
    intervals = {term.symbol: term.ci95 for term in found.findings.candidates[0].terms}
    assert [intervals[gain] for gain in GAINS[:3]] == [None, None, None]
    assert found.corrected.value("gain_ahead_67") == pytest.approx(0.5, abs=0.1)
    told = found.findings.identifiability
    assert told is not None
    assert "reverse_thrust_loss" in told.dormant


def test_a_curve_stands_in_no_alias_group_and_hides_no_manoeuvre() -> None:
    """Every scale is a special case of it, so that it would move with all of them, in every log and trial."""
    found = found_in({}, "zigzag").findings
    assert found.verdict == "nothing missing"
    told = found.identifiability
    assert told is not None
    assert all("thrust_curve" not in group for group in told.groups)
    assert "reverse_thrust_loss" in told.dormant
    assert any("reverse thrust loss" in item.why for item in found.advice)
