"""The law of dissipation: proofs on the knife edge, refits that keep it, their price, and the pysindy optimizer."""

import time
from dataclasses import replace

import numpy as np
import pysindy
import pytest

from undertow.discovery import lawful, programme
from undertow.discovery.certify import certify
from undertow.discovery.discover import DiscoverySettings, find_missing
from undertow.discovery.lawful import passive_refit
from undertow.discovery.library import TermLibrary, term_candidate
from undertow.discovery.optimizer import LawfulOptimizer
from undertow.discovery.options import Option, candidates
from undertow.discovery.search import Search, SearchSettings
from undertow.discovery.weak import WeakForm, WeakSettings
from undertow.physics.certificate import basis, control_matrices, vehicle_degree, vehicle_power
from undertow.physics.errors import RequestError
from undertow.physics.laws import (
    Envelope,
    damping_power,
    dissipation_vertices,
    envelope_of,
    mass_margin,
    worst_dissipation,
)
from undertow.physics.motion import Motion
from undertow.physics.terms import monomials
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds import simulate_world

HULL = load_vehicle("blueboat")
SHIP = load_vehicle("cybership2")
BOX = Envelope((-1.0, -0.5, -0.8), (2.0, 0.6, 0.8))
BARE = HULL.with_values(dict.fromkeys(("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr"), 0.0))
EDGE = 1e-6


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


# The envelope


def test_an_envelope_reaches_from_rest_to_the_extremes_and_a_little_to_the_other_side():
    motion = log_of(HULL, 3)
    ahead = replace(motion, velocity=np.abs(motion.velocity))
    box = envelope_of([ahead], HULL)
    assert box.contains(ahead.velocity).all()
    assert box.upper == pytest.approx(ahead.velocity.max(axis=0), abs=1e-3)
    assert box.lower == pytest.approx(-0.05 * ahead.velocity.max(axis=0), abs=1e-3)
    assert len(box.orthants) == 8
    assert envelope_of([ahead], HULL, share=0.5).upper == pytest.approx(0.5 * np.array(box.upper), abs=1e-3)
    assert box.to_dict()["u"] == [box.lower[0], box.upper[0]]


def test_an_envelope_is_about_the_water():
    motion = log_of(HULL, 3)
    drifting = HULL.with_values({"current_north": 3.0})
    assert envelope_of([motion], drifting) != envelope_of([motion], HULL)


@pytest.mark.parametrize(
    ("low", "high"), [((0.1, -1, -1), (2, 1, 1)), ((0, -1, -1), (0, 1, 1)), ((-1, -1, -1), (1, 1, float("nan")))]
)
def test_an_envelope_without_rest_is_refused(low: tuple[float, float, float], high: tuple[float, float, float]):
    with pytest.raises(RequestError, match="expected lower <= 0 <= upper"):
        Envelope(low, high)


def test_no_motion_has_no_envelope():
    with pytest.raises(RequestError, match="at least one motion"):
        envelope_of([], HULL)


# The proof


@pytest.mark.parametrize("extra", [{}, {"surge:u^3": -2.0, "yaw:v^2r": -3.0, "sway:|u||v|": 1.0, "yaw:uv|r|": 0.7}])
def test_the_proof_is_about_the_power_of_the_force_equation(extra: dict[str, float]):
    vehicle = SHIP.with_values({"Y_ur": 3.0, "N_uv": -1.0, **extra})
    degree = vehicle_degree(vehicle)
    b, power = basis(degree), vehicle_power(vehicle, BOX, degree)
    rng = np.random.default_rng(0)
    p = rng.random((50, 3))
    for orthant, far in enumerate(BOX.orthants):
        value = sum(c * np.prod(p ** np.array(e), axis=1) for c, e in zip(power[orthant], b.monomials, strict=True))
        np.testing.assert_allclose(value, damping_power(vehicle, p * np.array(far)), atol=1e-9)
    slack = rng.normal(size=(8, b.slack.shape[-1]))
    corners = np.flatnonzero(np.isin(b.points, (0.0, 1.0)).all(axis=1))
    at = b.points[corners]
    for matrices in (control_matrices(power, None, degree), control_matrices(power, slack, degree)):
        found = -np.einsum("ki,okij,kj->ok", at, matrices[:, corners], at)
        wanted = np.array([damping_power(vehicle, at * np.array(far)) for far in BOX.orthants])
        np.testing.assert_allclose(found, wanted, atol=1e-9)


@pytest.mark.parametrize("axis", ["surge", "sway", "yaw"])
def test_every_monomial_has_its_place_in_the_proof(axis: str):
    rng = np.random.default_rng(1)
    p = rng.random((20, 3))
    for form in monomials(3):
        vehicle = BARE.with_values({f"{axis}:{form.text}": 1.7})
        degree = vehicle_degree(vehicle)
        power = vehicle_power(vehicle, BOX, degree)
        for orthant, far in enumerate(BOX.orthants):
            terms = zip(power[orthant], basis(degree).monomials, strict=True)
            value = sum(c * np.prod(p ** np.array(e), axis=1) for c, e in terms)
            np.testing.assert_allclose(value, damping_power(vehicle, p * np.array(far)), atol=1e-12)


@pytest.mark.parametrize(
    ("vehicle", "symbol", "edge", "drives"),
    [
        (hull(Y_v=-4.0, N_r=-9.0), "X_u", 0.0, 1.0),
        (hull(X_u=-2.0, Y_v=-4.0, N_r=-9.0), "X_uu", 1.0, 1.0),  # at u = 2: -2 + 2 X_uu
        (hull(X_u=-1.0, Y_v=-4.0, N_r=-9.0), "N_v", 12.0, 1.0),  # (N_v + Y_r)^2 = 4 Y_v N_r
        (hull(X_u=-1.0, Y_v=-4.0, N_r=-9.0, Y_r=5.0), "N_v", -17.0, -1.0),
        (hull(X_u=-1.0, Y_v=-4.0, N_r=-9.0), "Y_ur", 18.0, 1.0),  # u v r at (1, 1/2, 1/3), 1 W on each axis
    ],
)
def test_a_proof_stands_on_the_knife_edge(vehicle: Vehicle, symbol: str, edge: float, drives: float):
    box = (
        Envelope((-1.0, -0.5, -1 / 3), (1.0, 0.5, 1 / 3))
        if symbol == "Y_ur"
        else Envelope((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))
    )
    inside, outside = (vehicle.with_values({symbol: edge + side * drives * EDGE}) for side in (-1.0, 1.0))
    assert certify(inside, box).holds
    assert not certify(outside, box).holds
    assert certify(outside, box).short > 0.0
    assert worst_dissipation(inside, box).power == 0.0
    assert worst_dissipation(outside.with_values({symbol: edge + 1e-2 * drives}), box).power > 0.0


def test_couplings_that_do_no_work_are_never_rejected():
    vehicle = HULL.with_values({"Y_ur": 900.0, "N_uv": -700.0, "X_vr": -200.0})
    assert dissipation_vertices(vehicle, BOX).least < -100.0  # as D stands, the vertices would reject it
    assert certify(vehicle, BOX).holds
    assert worst_dissipation(vehicle, BOX).power == 0.0


def test_honest_cross_flow_is_proved_and_a_drive_is_not():
    assert certify(HULL.with_values({"yaw:u^2r": -5.0, "sway:v^3": -9.0, "surge:u|v|": -4.0}), BOX).holds
    assert not certify(HULL.with_values({"sway:v^3": 900.0}), BOX).holds


def test_plain_damping_passes_at_the_vertices_alone():
    vertices = dissipation_vertices(HULL, BOX)
    assert vertices.states.shape == (8, 8, 3)
    assert vertices.matrices.shape == (8, 8, 3, 3)
    assert vertices.least == pytest.approx(2.0 * 6.0)  # N_r at rest


def test_the_search_finds_a_small_pocket():
    vehicle = HULL.with_values({"Y_r": 40.0})
    worst = worst_dissipation(vehicle, BOX)
    assert worst.power > 0.0
    assert damping_power(vehicle, np.array(worst.state)) == pytest.approx(worst.power)
    assert worst == worst_dissipation(vehicle, BOX)
    assert worst_dissipation(vehicle, BOX, seed=1).power == pytest.approx(worst.power, rel=1e-2)


def test_the_towing_tank_ship_is_not_dissipative():
    found = certify(SHIP, BOX)
    assert not found.holds
    assert worst_dissipation(SHIP, BOX).power > 0.01
    assert mass_margin(SHIP) > 0.9


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
    assert box.contains(np.array(found.binding.state))
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
    solve = lawful.solve_refit

    def careless(shape: programme.Shape, factor, target, limits, law=None):
        found = solve(shape, factor, target, limits, law)
        assert found is not None
        return found if law is None else replace(found, values=found.values + 0.5)

    monkeypatch.setattr(lawful, "solve_refit", careless)
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


def test_a_second_refit_of_the_same_shape_is_faster():
    motion, nominal = driven()
    scores, chosen = refit_problem(motion, nominal, ["sway_yaw_coupling", "surge_turn_drag", "munk_moment"])
    box = envelope_of([motion], nominal)
    programme._refit.cache_clear()
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        passive_refit(scores, chosen, nominal, box)
        seconds.append(time.perf_counter() - start)
    assert min(seconds[1:]) < 0.5 * seconds[0]
    assert programme._refit.cache_info().hits >= 2


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
    assert found.passivity["verdict"] == "fail"
    assert found.passivity["price"] > 1.0
    assert found.passivity["worst"]["value"] > 0.0
    assert "asks for a force that creates energy (surge:u^2)" in found.passivity["sentence"]


def test_a_ship_that_breaks_the_law_itself_is_still_corrected():
    motion = log_of(SHIP, 2, {"surge_quadratic_damping": -2.0}, 150.0)
    found = find_missing([motion], SHIP).findings
    assert found.missing == ("surge_quadratic_damping",)
    assert found.passivity["verdict"] == "fail"
    assert "The damping of CyberShip II creates energy" in found.passivity["sentence"]


# The optimizer


def forces(drive: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    state = rng.uniform(BOX.lower, BOX.upper, (500, 3))
    u, v, r = state.T
    force = [-9 * u - 3 * u * abs(u) + 2 * v * r, -28 * v + 5 * u * r, -7 * r - 7 * u * v + drive * v]
    return state, np.column_stack(force) + rng.normal(size=(500, 3)) * 0.1


def fitted(optimizer: pysindy.BaseOptimizer, drive: float = 0.0, degree: int = 2) -> dict[tuple[int, str], float]:
    state, force = forces(drive)
    model = pysindy.SINDy(feature_library=TermLibrary(degree), optimizer=optimizer)
    model.fit(state, t=0.1, x_dot=force, feature_names=["u", "v", "r"])
    names = model.get_feature_names()
    return {(a, n): c for a, row in enumerate(model.coefficients()) for n, c in zip(names, row, strict=True) if c}


def as_vehicle(found: dict[tuple[int, str], float]) -> Vehicle:
    return BARE.with_values({f"{('surge', 'sway', 'yaw')[axis]}:{form}": c for (axis, form), c in found.items()})


def test_the_optimizer_finds_honest_forces_in_pysindy_alone():
    optimizer = LawfulOptimizer(BOX)
    found = fitted(optimizer)
    assert {key: round(c) for key, c in found.items()} == {
        (0, "u"): -9,
        (0, "u|u|"): -3,
        (1, "v"): -28,
        (1, "ur"): 5,
        (2, "r"): -7,
        (2, "uv"): -7,
    } or found[(0, "vr")] == pytest.approx(2.0, rel=0.1)
    assert optimizer.price_ == 0.0


@pytest.mark.parametrize("degree", [2, 3])
def test_the_optimizer_keeps_the_law_where_the_data_break_it(degree: int):
    optimizer = LawfulOptimizer(BOX)
    lawless = as_vehicle(fitted(pysindy.STLSQ(threshold=0.3), drive=60.0, degree=2))
    assert worst_dissipation(lawless, BOX).power > 0.0
    vehicle = as_vehicle(fitted(optimizer, drive=60.0, degree=degree))
    assert worst_dissipation(vehicle, BOX).power == 0.0
    assert certify(vehicle, BOX).holds
    assert optimizer.price_ > 0.0


def test_the_optimizer_holds_drag_to_its_sign():
    state, _ = forces()
    force = state * [3.0, -5.0, -5.0] - [12.0, 0.0, 0.0] * state * np.abs(state)
    model = pysindy.SINDy(feature_library=TermLibrary(2), optimizer=LawfulOptimizer(BOX))
    model.fit(state, t=0.1, x_dot=force, feature_names=["u", "v", "r"])
    assert model.coefficients()[0, model.get_feature_names().index("u")] == 0.0
    free = pysindy.SINDy(feature_library=TermLibrary(2), optimizer=LawfulOptimizer(BOX, signs=False))
    free.fit(state, t=0.1, x_dot=force, feature_names=["u", "v", "r"])
    assert worst_dissipation(as_vehicle({(0, "u"): float(free.coefficients()[0, 0])}), BOX).power >= 0.0


def test_the_optimizer_drops_everything_below_its_threshold():
    assert fitted(LawfulOptimizer(BOX, threshold=2.0)) == {}


def test_the_optimizer_refuses_what_it_cannot_constrain():
    state, force = forces()
    with pytest.raises(RequestError, match="expected the features of a TermLibrary"):
        LawfulOptimizer(BOX).fit(state[:, :2], force)
    with pytest.raises(RequestError, match="expected forces on surge, sway and yaw, got 2 targets"):
        LawfulOptimizer(BOX).fit(TermLibrary(1).fit(state).values(state), force[:, :2])
