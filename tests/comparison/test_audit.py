"""The auditor: what it takes as stated, what it tells, how it searches, and foreign functions."""

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from envelopes import encloses
from judging import BOX, HULL, formula, half_a_minute, judged, pushed

from undertow.comparison.audit import LAWS, audit, witness_of
from undertow.physics.errors import RequestError
from undertow.physics.laws.audit.base import finite
from undertow.physics.laws.audit.bounded import BoundedSpeed, possible_commands, reachable, rolled
from undertow.physics.laws.audit.coriolis import CoriolisWork
from undertow.physics.laws.audit.dissipation import Dissipation, Outside
from undertow.physics.laws.audit.mass import PositiveMass
from undertow.physics.laws.audit.rest import Rest
from undertow.physics.laws.audit.search import Box, climb, spread
from undertow.physics.laws.audit.symmetry import mirror_pairs
from undertow.physics.laws.audit.thrust import PowerUnderThrust
from undertow.physics.laws.damping_power import Envelope
from undertow.physics.momentum_balance import coriolis_matrix, mass_matrix, thruster_matrix
from undertow.physics.motion import Array
from undertow.physics.thrusters import neutral_command
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.foreign import FunctionModel, load_function
from undertow.workflows.check_and_explain import check
from undertow.workflows.run_folder.read import check_bounds

# What laws take as stated


def test_stated_environment_is_taken_out_and_named():
    values = {"current_north": 0.5, "current_east": -0.3, "wind_force_north": 6.0, "wind_x": 0.7, "yaw_trim": 2.0}
    found = audit(formula(**values), BOX)
    assert found.verdict == "pass"
    assert "current east" in found.ruling("rest stays at rest").sentence
    assert "yaw trim" in found.notes[0]
    calm = audit(formula(), BOX)
    for law in ("dissipation", "positive damping"):
        assert found.ruling(law).value == pytest.approx(calm.ruling(law).value, rel=1e-4), law


def test_a_hidden_trim_is_a_push_at_rest():
    ruling = judged(Rest(), pushed(lambda nu: np.tile([0.0, 0.0, 5.0], (len(nu), 1))))
    assert ruling.verdict == "fail"
    assert "pushes itself in yaw" in ruling.sentence


def test_a_wake_gives_back_what_it_stored():
    wake = HULL.with_values({"memory_sway": 60.0, "memory_yaw": 8.0, "memory_time": 3.0})
    motion = simulate_world(wake, {}, duration=60.0, noise="clean", seed=4).motion(0.1)
    found = audit(VehicleModel(wake, "wake"), BOX, motions=[motion])
    assert found.verdict == "pass"
    assert audit(VehicleModel(wake.with_values({"memory_sway": -60.0}), "wake"), BOX).verdict == "fail"


def test_without_positive_mass_nothing_else_means_anything():
    found = audit(VehicleModel(HULL.with_values({"Y_vdot": HULL.mass + 1.0}), "void"), BOX)
    assert [r.law for r in found.violations] == ["positive mass"]
    assert {r.verdict for r in found.rulings[1:]} == {"not applicable"}


def test_worse_thrusters_make_a_boat_lopsided_and_no_liar():
    found = audit(formula(port_scale=0.5), BOX)
    assert found.ruling("mirror symmetry").verdict == "fail"
    assert found.verdict == "pass"
    assert mirror_pairs(HULL) == [1, 0]
    assert mirror_pairs(load_vehicle("cybership2")) is None


def test_a_boat_that_nothing_stops_is_found():
    none = dict.fromkeys(HULL.damping, 0.0)
    bounded = audit(formula(**none), BOX).ruling("bounded speed")
    assert bounded.verdict == "fail"
    for values, grows in (({"X_u": 60.0, "X_uu": 60.0}, True), ({"X_u": 0.0, "X_uu": 0.0}, False)):
        boat = HULL.with_values(values)
        envelope, source = reachable(boat, possible_commands(boat))
        assert ("3 s of full thrust, as the vehicle's speeds grow without bound" in source) is grows
        assert judged(BoundedSpeed(), VehicleModel(boat, "bare")).verdict == "fail"
        assert envelope.upper[0] > 2.2


@pytest.mark.parametrize("name", ["blueboat", "blueboat_paper", "otter", "cybership2"])
def test_a_neutral_command_does_not_push(name: str):
    boat = load_vehicle(name)
    for thruster in boat.thrusters:
        neutral = np.array([neutral_command(thruster)])
        assert thruster.response(neutral, 0.1)[0] == pytest.approx(0.0, abs=1e-12)


# One state, one verdict; what a sentence says


def biased(yaw: float) -> FunctionModel:
    """The hull as learnt code that turns itself by itself: a moment [N m]."""
    return pushed(lambda nu: np.tile([0.0, 0.0, yaw], (len(nu), 1)))


@pytest.mark.parametrize(("share", "verdict"), [(0.9, "pass"), (1.5, "fail")])
def test_the_same_push_is_judged_alike_in_any_envelope(share: float, verdict: str):
    model = biased(share * 0.01 * float(witness_of(formula(), BOX).full_force[2]))
    small, large = (Envelope(tuple(k * x for x in BOX.lower), tuple(k * x for x in BOX.upper)) for k in (0.2, 2.0))  # type: ignore[arg-type]
    one, other = (Dissipation().judge(witness_of(model, box)) for box in (small, large))
    assert (one.verdict, other.verdict) == (verdict, verdict)
    if verdict == "fail":
        assert one.value == pytest.approx(other.value, rel=0.02)
        assert one.limit == pytest.approx(other.limit, rel=0.05)


def test_a_gain_within_the_tolerance_is_told_with_both_numbers():
    ruling = judged(Dissipation(), biased(0.2))
    assert (ruling.verdict, ruling.proof) == ("pass", "search")
    assert ruling.value is not None
    assert ruling.limit is not None
    assert 0.0 < ruling.value < ruling.limit
    assert "loses energy" not in ruling.sentence
    assert f"it gains {ruling.value:.3g} W at" in ruling.sentence
    assert f"where {ruling.limit:.3g} W is let pass" in ruling.sentence
    at_rest = judged(Rest(), biased(0.2))
    assert at_rest.verdict == "pass"
    assert "pushes itself in yaw with" in at_rest.sentence


def test_a_violation_tells_what_is_let_pass():
    ruling = judged(Dissipation(), biased(0.6))
    assert ruling.verdict == "fail"
    assert f"gains {ruling.value:.3g} W at" in ruling.sentence
    assert f"where {ruling.limit:.3g} W is let pass" in ruling.sentence
    assert "is let pass" not in judged(Dissipation(), formula(X_u=30.0)).sentence, "a formula is let pass nothing"


def test_seeds_agree_on_a_gain_under_few_commands():
    inverse, honest = np.linalg.inv(mass_matrix(HULL)), VehicleModel(HULL, "hull")

    def answer(velocity: Array, heading: Array, commands: Array) -> Array:
        sway = -12.0 * np.prod(np.clip(commands / 35.0, 0.0, 1.0), axis=1) ** 4
        return honest.settled(velocity, heading, commands) + sway[:, None] * inverse[1]

    commands = np.random.default_rng(0).uniform(-35.0, 35.0, (300, 2))
    commands = np.concatenate([commands, [[35.0, 35.0]]])
    model = FunctionModel(answer, HULL, "learnt")
    found = [judged(PowerUnderThrust(), model, seed=seed, commands=commands) for seed in range(8)]
    assert len({r.verdict for r in found}) == 1
    margins = [r.margin for r in found if r.margin is not None]
    assert max(margins) - min(margins) < 0.03 * abs(float(np.mean(margins))), margins


def test_outside_is_searched_outside_only():
    inside = pushed(lambda nu: 40.0 * nu * (np.abs(nu[:, :1] - 1.0) < 0.3))
    assert judged(Dissipation(), inside).verdict == "fail"
    at = judged(Outside(), formula()).at
    slow = pushed(lambda nu: 40.0 * nu * (np.abs(nu / [2.2, 0.6, 1.1]).max(axis=1, keepdims=True) < 0.4))
    ruling = judged(Outside(), slow)
    assert ruling.verdict == "pass", ruling.sentence
    for place in (at, ruling.at):
        assert place is not None
        assert not encloses(BOX, np.array([place["u"], place["v"], place["r"]]), slack=0.0)


def test_a_function_shows_its_mass_when_it_is_pushed():
    ruling = judged(PositiveMass(), pushed(lambda nu: 0.0 * nu))
    assert (ruling.verdict, ruling.value) == ("pass", pytest.approx(-1.0))
    assert "It has no mass of its own; that of the vehicle" in ruling.sentence
    backwards = np.linalg.inv(mass_matrix(HULL)) * [[-1.0], [1.0], [1.0]]
    reach = thruster_matrix(HULL)
    found = judged(PositiveMass(), FunctionModel(lambda nu, psi, c: (c @ reach.T - nu) @ backwards.T, HULL, "foreign"))
    assert (found.verdict, found.value) == ("fail", pytest.approx(1.0, abs=0.3))
    assert "goes against the push" in found.sentence
    void = HULL.with_values({"Y_vdot": HULL.mass + 1.0})
    assert judged(PositiveMass(), FunctionModel(lambda nu, psi, c: -nu, void, "foreign")).verdict == "fail"


@pytest.mark.parametrize(("share", "verdict"), [(-1.0, "fail"), (0.0, "pass"), (0.9, "pass")])
def test_a_coriolis_force_that_does_work_is_seen_in_a_black_box(share: float, verdict: str):
    faint = HULL.with_values({"X_u": -2.0, "X_uu": 0.0, "Y_v": -4.0, "Y_vv": 0.0, "N_r": -1.0, "N_rr": 0.0})
    hull, inverse = VehicleModel(faint, "faint"), np.linalg.inv(mass_matrix(HULL))

    def answer(nu: Array, psi: Array, commands: Array) -> Array:
        turning = np.einsum("nij,nj->ni", coriolis_matrix(HULL, nu), nu)
        wrong = turning * ([0.0, 2.0, 0.0] if share < 0.0 else [share] * 3)  # one sign wrong, or all of it weaker
        return hull.settled(nu, psi, commands) + wrong @ inverse.T

    ruling = judged(CoriolisWork(), FunctionModel(answer, HULL, "foreign"))
    assert ruling.verdict == verdict
    assert "Turning does work" in ruling.sentence or verdict == "pass"


@pytest.mark.parametrize("rate", [12.0, 50.0, 1000.0])
def test_stiff_damping_is_no_unbounded_speed(rate: float):
    stiff = HULL.with_values({"X_u": -rate * mass_matrix(HULL)[0, 0], "N_r": -rate * mass_matrix(HULL)[2, 2]})
    hull = VehicleModel(stiff, "stiff")
    for model in (FunctionModel(hull.settled, HULL, "foreign"), hull):
        assert judged(BoundedSpeed(), model).verdict == "pass", model.name
    done = FunctionModel(hull.settled, HULL, "foreign").rollout(half_a_minute(), np.array([0, 50]), 100)
    assert not done.diverged.any()


def test_what_grows_is_not_damped_by_the_step():
    commands = np.zeros((1, 601, 1))
    for rate in (0.5, 30.0, 1000.0):
        found = rolled(lambda nu, psi, c, rate=rate: rate * nu + 1e-3, commands, 60.0)
        assert found.diverged.all(), rate
    turning = rolled(
        lambda nu, psi, c: nu @ np.array([[-1.0, -9, 0], [9.0, -1, 0], [0, 0, -1.0]]).T + 1.0, commands, 60.0
    )
    assert np.abs(turning.states[..., 3:]).max() < 2.0


@pytest.mark.parametrize(
    "inside",
    [
        lambda nu, psi, c: (c > 30.0).all(axis=1),
        lambda nu, psi, c: np.abs(c[:, 0] - 11.3) < 0.3,
        lambda nu, psi, c: (np.abs(c - [12.0, -21.0]) < 1.5).all(axis=1),
        lambda nu, psi, c: np.abs(psi - 1.234) < 0.01,
        lambda nu, psi, c: np.abs(nu[:, 0] - 1.234) < 0.006,
        lambda nu, psi, c: (nu > [2.0, 0.5, 1.0]).all(axis=1),
        lambda nu, psi, c: np.abs(nu @ [0.5, 1.0, 0.7] - 0.31) < 0.004,
        lambda nu, psi, c: (((nu - [0.9, 0.21, -0.4]) / [0.1, 0.04, 0.07]) ** 2).sum(axis=1) < 1.0,
    ],
    ids=["both full", "one command", "both within", "heading", "speed", "corner", "sheet", "ball"],
)
def test_a_violation_in_a_window_is_found_by_every_seed(inside: Callable[[Array, Array, Array], Array]):
    inverse, hull = np.linalg.inv(mass_matrix(HULL)), VehicleModel(HULL, "hull")
    full = witness_of(formula(), BOX).full_force

    def answer(nu: Array, psi: Array, c: Array) -> Array:
        away = -2.0 * (hull.settled(nu, psi, 0.0 * c) @ mass_matrix(HULL)) + np.sign(nu) * full
        return hull.settled(nu, psi, c) + inside(nu, psi, c)[:, None] * away @ inverse.T

    model = FunctionModel(answer, HULL, "window")
    for seed in (0, 1):
        witness = witness_of(model, BOX, seed=seed)
        assert "fail" in (Dissipation().judge(witness).verdict, PowerUnderThrust().judge(witness).verdict), seed


def test_a_slow_log_does_not_make_a_hull_too_fast():
    slow = Envelope((-0.05, -0.05, -0.05), (0.2, 0.05, 0.1))
    ruling = BoundedSpeed().judge(witness_of(formula(), slow))
    assert ruling.verdict == "pass"
    assert "its speeds settle" in ruling.sentence
    none = dict.fromkeys(HULL.damping, 0.0)
    assert BoundedSpeed().judge(witness_of(formula(**none), slow)).verdict == "fail"
    fast = FunctionModel(lambda nu, psi, commands: ([9.0, 0.0, 0.0] - nu) / 2.0, HULL, "fast")
    assert BoundedSpeed().judge(witness_of(fast, slow)).verdict == "fail", "far faster than its vehicle file"


# The search


def test_the_search_climbs_to_a_narrow_top():
    box = Box(np.array([-1.0, -1.0, -1.0, -np.pi]), np.array([2.0, 1.0, 1.0, np.pi]))
    top = np.array([1.3, 0.4, -0.2])

    def value(x: Array) -> Array:
        return np.exp(-(((x[:, :3] - top) / 0.2) ** 2).sum(axis=1))

    states = spread(box, 1024, seed=1)
    best = climb(value, states, value(states), box)
    assert value(best).max() == pytest.approx(1.0, abs=1e-4)
    assert (best >= box.low).all()
    assert (best <= box.high).all()


@pytest.mark.parametrize("size", [4, 6])
def test_states_lie_evenly_in_their_box(size: int):
    box = Box(np.full(size, -2.0), np.full(size, 6.0))
    states = (spread(box, 4000, seed=3) + 2.0) / 8.0
    assert states.shape == (4096, size)
    assert np.diff(np.sort(states, axis=0), axis=0) == pytest.approx(1.0 / 4096)
    for one, other in combinations(range(size), 2):
        cells = np.histogram2d(states[:, one], states[:, other], bins=16, range=[(0.0, 1.0)] * 2)[0]
        assert cells.min() >= 8, "16 in each cell on average, of which random states leave 4 in some"
    assert not np.array_equal(spread(box, 4096, seed=4), spread(box, 4096, seed=3))


def test_a_formula_is_asked_for_a_hundred_thousand_states_at_most(monkeypatch: pytest.MonkeyPatch):
    settled, asked = VehicleModel.settled, []
    monkeypatch.setattr(VehicleModel, "settled", lambda *words: asked.append(len(words[1])) or settled(*words))
    audit(formula(), BOX, motions=[half_a_minute()])
    assert 10_000 < sum(asked) < 100_000
    assert len(asked) < 50, "many states at once"


# The file


def test_the_file_says_all_and_equal_seeds_give_equal_files():
    first, again = (audit(formula(X_u=30.0), BOX, seed=5).to_dict() for _ in range(2))
    assert first == again
    assert first["schema"] == "undertow.audit/1"
    assert (first["verdict"], first["envelope"]) == ("fail", BOX.to_dict())
    assert [law["law"] for law in first["laws"]] == [law.name for law in LAWS]
    law = next(x for x in first["laws"] if x["law"] == "dissipation")
    assert set(law) == {"law", "verdict", "counts", "violating_share", "proof", "worst", "margin", "sentence"}
    assert law["worst"]["unit"] == law["margin"]["unit"] == "W"
    assert set(law["worst"]["at"]) == {"u", "v", "r"}
    assert law["margin"]["value"] < 0.0 < law["violating_share"]


# Foreign functions


def test_a_function_rolls_out_like_the_vehicle_it_copies():
    model, true = pushed(lambda nu: 0.0 * nu), VehicleModel(HULL, "hull")
    starts = np.array([0, 50, 100])
    one, other = (m.rollout(half_a_minute(), starts, 100).states for m in (model, true))
    assert one == pytest.approx(other, abs=6e-2), "it meets commands held over a step"
    assert model.acceleration(half_a_minute()) == pytest.approx(true.acceleration(half_a_minute()), abs=1e-9)
    assert audit(model, BOX).verdict == "pass"


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (lambda nu, psi, commands: nu[:, :2], r"expected accelerations of shape \(.*, 3\).*got \(.*, 2\)"),
        (lambda nu, psi, commands: nu / 0.0, "expected finite accelerations, got .* at u = "),
        (lambda nu, psi, commands: nu + missing, "failed on .* states: NameError"),  # type: ignore[name-defined] # noqa: F821
    ],
)
def test_a_function_that_does_not_answer_is_told_so(answer: Callable[..., Array], text: str):
    with np.errstate(all="ignore"), pytest.raises(RequestError, match=text):
        audit(FunctionModel(answer, HULL, "poor"), BOX)


@pytest.mark.parametrize(
    ("name", "text"),
    [("no_such_module:f", "cannot import no_such_module"), ("math:no_such", "math has no function no_such")],
)
def test_a_function_that_is_not_there(name: str, text: str):
    with pytest.raises(RequestError, match=text):
        load_function(name, HULL)


def test_a_function_with_other_arguments_is_told_the_signature():
    told = r"expected f\(velocity \(n, 3\), heading \(n,\), commands \(n, thrusters\)\) -> accelerations \(n, 3\)"
    with pytest.raises(RequestError, match=told + r", got add\(a, b, /\)"):
        load_function("operator:add", None)
    with pytest.raises(RequestError, match=told + ".*failed on .* takes 2 positional arguments but 3 were given"):
        audit(FunctionModel(lambda nu, psi: nu, HULL, "poor"), BOX)  # type: ignore[arg-type]


@pytest.mark.parametrize("worst", [float("inf"), float("nan"), 1e300])
def test_what_grows_without_bound_is_a_number_that_a_run_folder_holds(worst):
    check_bounds({"value": finite(worst), "margin": 1.5 - finite(worst)})


def test_what_is_bounded_is_told_as_it_is():
    assert finite(1.25) == 1.25


def test_what_is_looked_through_does_not_hang_on_the_seed_of_the_search():
    first, second = (check("otter", seed=seed) for seed in (0, 3))
    assert first.envelope == second.envelope
