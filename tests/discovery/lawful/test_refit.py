"""The lawful refit: no violation, its price, what it does where the law cannot hold, and discovery under it."""

from dataclasses import replace

import numpy as np
import pytest
from envelopes import encloses

from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.linearisation import Option
from undertow.discovery.candidates.unnamed_terms import term_candidate
from undertow.discovery.discover import find_missing
from undertow.discovery.lawful import convex_program, refit
from undertow.discovery.lawful import refit as lawful
from undertow.discovery.lawful.convex_program import Shape
from undertow.discovery.lawful.laws_over import certify
from undertow.discovery.lawful.refit import passive_refit
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.discovery.search.gram import GramScores
from undertow.physics.errors import RequestError
from undertow.physics.laws.damping_power import Envelope, envelope_of, mass_margin, worst_dissipation
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
SHIP = load_vehicle("cybership2")
BARE = HULL.with_values(dict.fromkeys(("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr"), 0.0))


def hull(**values: float) -> Vehicle:
    return BARE.with_values(values)


def refit_problem(motion: Motion, nominal: Vehicle, keys: list[str]):
    weak = WeakForm([motion], WeakSettings())
    pool = [c for c in candidates(nominal) if c.key in keys] + [term_candidate(k, nominal) for k in keys if ":" in k]
    linear, scores = Search(weak, nominal, pool, SearchSettings()).linearise(nominal, ())
    chosen = [next(o for o in linear.options[c.key] if o.present) for c in pool]
    return scores, chosen


def log_of(vehicle: Vehicle, seed: int, hidden: dict[str, float] | None = None, seconds: float = 60.0) -> Motion:
    return simulate_world(vehicle, hidden or {}, duration=seconds, noise="field", seed=seed).motion(0.05)


# The refit


@pytest.mark.parametrize("seed", range(6))
def test_no_refit_breaks_the_law(seed: int):
    rng = np.random.default_rng(seed)
    base = load_vehicle(("blueboat", "otter")[seed % 2])
    damping = ("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr", "X_udot", "Y_vdot", "N_rdot")
    nominal = base.with_values({s: base.value(s) * rng.uniform(0.67, 1.33) for s in damping})
    motion = log_of(nominal, seed)
    u, v, r = motion.velocity.T
    wrong = np.stack([u, v + rng.normal() * u * r, r * rng.uniform(0.7, 1.5)], axis=-1)  # no hull moves like that
    motion = replace(motion, velocity=wrong)
    keys = ["sway_yaw_coupling", "munk_moment", "sway_lift", "surge_turn_drag", "sway_linear_damping", "cg_offset"]
    keys += ["sway:u^3", "surge:v^2"] if seed % 3 == 0 else []
    scores, chosen = refit_problem(motion, nominal, keys)
    box = envelope_of([motion], nominal)
    found = passive_refit(scores, chosen, nominal, box)
    vehicle = nominal.with_values(found.values)
    assert found.kept
    assert certify(vehicle, box).holds
    assert worst_dissipation(vehicle, box, samples=100_000, seed=seed).power == 0.0
    assert mass_margin(vehicle) > 0.0
    assert found.misfit >= found.misfit_free * (1.0 - 1e-9)


def test_a_parameter_that_the_log_does_not_show_is_refused_in_words():
    motion, nominal = driven()
    scores, chosen = refit_problem(motion, nominal, ["yaw_added_mass"])
    weak = WeakForm([motion], WeakSettings())
    pool = [c for c in candidates(nominal) if c.key == "yaw_added_mass"]
    linear, _ = Search(weak, nominal, pool, SearchSettings()).linearise(nominal, ())
    assert linear.noise is not None
    # The angular acceleration of the log is nothing but noise, and so all of its column.
    empty = GramScores(linear.columns * 0.0, linear.noise, weak.block, scores.weight)
    with pytest.raises(RequestError, match=r"the log says nothing about N_rdot.*undertow inspect"):
        passive_refit(empty, chosen, nominal, envelope_of([motion], nominal))


def driven() -> tuple[Motion, Vehicle]:
    """A log whose sway and yaw drive each other, and the plain hull that is to explain it."""
    nominal = HULL.with_values({"Y_v": -12.0, "Y_vv": 0.0, "N_rr": 0.0})
    return log_of(nominal.with_values({"Y_r": 10.0, "N_v": 12.0}), 5, seconds=90.0), nominal


def test_the_price_is_reported_with_its_corner_and_in_words():
    motion, nominal = driven()
    scores, chosen = refit_problem(motion, nominal, ["sway_yaw_coupling"])
    box = envelope_of([motion], nominal)
    found = passive_refit(scores, chosen, nominal, box)
    assert found.kept
    assert found.price > 0.0
    assert worst_dissipation(nominal.with_values(found.free), box).power > 0.0
    assert found.values["Y_r"] + found.values["N_v"] <= 2.0 * np.sqrt(12.0 * 6.0)
    assert found.binding is not None
    assert encloses(box, np.array(found.binding.state))
    assert found.binding.symbol in ("Y_r", "N_v")
    assert found.binding.multiplier > 0.0
    assert "Passivity costs" in found.sentence
    assert f"{found.binding.symbol} wants" in found.sentence


def test_the_law_eases_as_the_nominal_damping_grows():
    motion, nominal = driven()
    scores, chosen = refit_problem(motion, nominal, ["sway_yaw_coupling"])
    box = envelope_of([motion], nominal)
    limits = []
    for more in (0.0, 1.0, 2.0):
        values = passive_refit(scores, chosen, nominal.with_values({"Y_v": -12.0 - more}), box).values
        limits.append(values["Y_r"] + values["N_v"])
        assert limits[-1] == pytest.approx(2.0 * np.sqrt((12.0 + more) * 6.0), rel=1e-3)
    assert limits == sorted(limits)


def test_a_nominal_model_that_breaks_the_law_is_said_to():
    motion = log_of(SHIP, 2)
    scores, chosen = refit_problem(motion, SHIP, ["surge_quadratic_damping", "sway:|u|r"])
    box = envelope_of([motion], SHIP)
    with pytest.raises(RequestError, match=r"no values of .* make the damping of CyberShip II dissipative"):
        passive_refit(scores, chosen, SHIP, box, strict=True)
    found = passive_refit(scores, chosen, SHIP, box)
    assert not found.kept
    assert "creates energy in a part of the envelope" in found.sentence
    before, after = (worst_dissipation(v, box).power for v in (SHIP, SHIP.with_values(found.values)))
    assert after <= 1.25 * before  # no worse at the control points; between them the pocket may shift


def test_free_damping_mends_a_nominal_model_that_breaks_the_law():
    motion = log_of(SHIP, 2)
    scores, chosen = refit_problem(motion, SHIP, ["sway_yaw_coupling", "sway_linear_damping", "yaw_linear_damping"])
    box = envelope_of([motion], SHIP)
    found = passive_refit(scores, chosen, SHIP, box, strict=True)
    assert found.kept
    assert worst_dissipation(SHIP.with_values(found.values), box).power == 0.0


def test_a_solution_that_breaks_the_law_is_an_error(monkeypatch: pytest.MonkeyPatch):
    motion, nominal = driven()
    scores, chosen = refit_problem(motion, nominal, ["sway_yaw_coupling"])
    solve = convex_program.solve_refit

    def careless(shape: Shape, factor, target, limits, law=None):
        found = solve(shape, factor, target, limits, law)
        assert found is not None
        return found if law is None else replace(found, values=found.values + 0.5)

    monkeypatch.setattr(refit, "solve_refit", careless)
    with pytest.raises(RequestError, match="breaks dissipation"):
        passive_refit(scores, chosen, nominal, envelope_of([motion], nominal))


def test_mass_stays_positive_definite(monkeypatch: pytest.MonkeyPatch):
    motion = log_of(HULL, 4)
    scores, chosen = refit_problem(motion, HULL, ["cg_offset", "yaw_added_mass"])
    monkeypatch.setattr(lawful, "lawful_refit", lambda *_: {"x_g": 2.0, "N_rdot": 0.0})  # M of a boat that cannot be
    found = passive_refit(scores, chosen, HULL, envelope_of([motion], HULL))
    assert found.kept
    assert mass_margin(HULL.with_values({"x_g": 2.0, "N_rdot": 0.0})) < 0.0
    assert mass_margin(HULL.with_values(found.values)) > 0.0


def test_a_second_refit_of_the_same_shape_is_not_formulated_again():
    motion, nominal = driven()
    scores, chosen = refit_problem(motion, nominal, ["sway_yaw_coupling", "surge_turn_drag", "munk_moment"])
    box = envelope_of([motion], nominal)
    convex_program._refit.cache_clear()
    passive_refit(scores, chosen, nominal, box)
    formulated = convex_program._refit.cache_info().misses
    passive_refit(scores, chosen, nominal, box)
    assert convex_program._refit.cache_info().misses == formulated
    assert convex_program._refit.cache_info().hits >= formulated


def test_a_refit_of_nothing_is_the_nominal_model():
    motion = log_of(HULL, 4)
    scores, _ = refit_problem(motion, HULL, ["yaw_trim"])
    nothing: list[Option] = []
    found = passive_refit(scores, nothing, HULL, envelope_of([motion], HULL))
    assert (found.values, found.kept, found.price) == ({}, True, 0.0)


# Discovery


def test_discovery_writes_a_lawful_model_and_says_so():
    motion = log_of(HULL, 11, {"surge_quadratic_damping": -6.0}, 150.0)
    found = find_missing([motion], HULL)
    passivity = found.findings.to_dict()["passivity"]
    assert (passivity["verdict"], passivity["proof"], passivity["price"]) == ("pass", "vertex LMI", 0.0)
    assert passivity["worst"]["value"] == 0.0
    assert "Passivity costs nothing" in passivity["sentence"]
    low, high = zip(*passivity["envelope"].values(), strict=True)
    assert worst_dissipation(found.corrected, Envelope(low, high), seed=7).power == 0.0


def test_a_world_that_creates_energy_is_called_so():
    motion = log_of(HULL, 2, {"surge:u^2": -14.0}, 200.0)
    found = find_missing([motion], HULL, DiscoverySettings()).findings
    assert [(t.axis, t.form) for t in found.unnamed] == [("surge", "u^2")]
    assert found.unnamed[0].value == pytest.approx(-14.0, rel=0.03)
    assert found.passivity is not None
    assert found.passivity.verdict == "fail"
    assert found.passivity.price > 1.0
    assert found.passivity.worst.value > 0.0
    assert "asks for a force that creates energy (surge:u^2)" in found.passivity.sentence


def test_a_ship_that_breaks_the_law_itself_is_still_corrected():
    motion = log_of(SHIP, 2, {"surge_quadratic_damping": -2.0}, 150.0)
    found = find_missing([motion], SHIP).findings
    (first, *_) = found.candidates
    assert first.effect == "surge_quadratic_damping"
    assert first.terms[0].in_model == pytest.approx(-2.0, rel=0.1)
    assert found.passivity is not None
    assert found.passivity.verdict == "fail"
    assert "The damping of CyberShip II creates energy" in found.passivity.sentence


def test_a_value_that_is_gone_in_a_moment_widens_no_envelope():
    motion = simulate_world(HULL, {}, duration=60.0, seed=4).truth
    velocity = motion.velocity.copy()
    velocity[300, 0], velocity[420, 2] = 9.0, -7.0
    box, spoilt = envelope_of([motion], HULL), envelope_of([replace(motion, velocity=velocity)], HULL)
    assert np.array(spoilt.upper) == pytest.approx(np.array(box.upper), abs=0.15)
    assert np.array(spoilt.lower) == pytest.approx(np.array(box.lower), abs=0.15)
    velocity[300:330, 0] = 9.0  # three seconds: it went that fast
    assert envelope_of([replace(motion, velocity=velocity)], HULL).upper[0] == 9.0
