"""Adaptation follows what changes, keeps what it knows, stays within limits, and looks at nothing that is to come."""

from dataclasses import replace

import numpy as np
import pytest

import undertow
from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.calibration.following import Adapted, AdaptSettings, adapt
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.linearisation import Linearisation
from undertow.discovery.identifiability.rehearsal import plausible_amounts, rehearse
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.physics.errors import RequestError
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import NOISE, World

HULL = load_vehicle("blueboat")
FOULED = HULL.with_values({"X_uu": -20.0})
DRAG = ("surge_quadratic_damping",)
CHANGE = 60.0


def world(duration: float = 120.0, noise: str = "field") -> Motion:
    """A log in which the drag grows from 8 to 20 N s^2/m^2 after a minute."""
    return World(HULL, "rich", duration, 3, becomes=FOULED, changes_at=CHANGE).run(NOISE[noise]).motion()


def held(pushes: list[tuple[float, float]]) -> Motion:
    """A straight run under (seconds, thrust of each side [N]) steps, with white noise on the speeds."""
    thrust = np.concatenate([np.full(round(seconds / 0.05), push) for seconds, push in pushes])
    time = np.asarray(0.05 * np.arange(thrust.size), dtype=float)
    nothing = np.zeros((time.size, 2)), np.zeros(time.size), np.zeros((time.size, 3))
    names = tuple(t.name for t in HULL.thrusters)
    rest = Motion(time, *nothing, np.column_stack([thrust] * len(names)), names)
    steady = HULL.with_values({"N_r": -200.0})
    moved = simulate_motion(steady, rest)
    rng = np.random.default_rng(0)
    return replace(moved, velocity=moved.velocity + 0.015 * rng.standard_normal(moved.velocity.shape) * [1, 1, 0.4])


@pytest.fixture(scope="module")
def followed() -> Adapted:
    return adapt(world(), HULL, DRAG)


def test_the_drag_is_followed_within_30_s_of_excitation(followed: Adapted):
    value, time = followed.values[:, 0], followed.time
    before = (time > 30.0) & (time < CHANGE)
    assert value[before] == pytest.approx(-8.0, rel=0.1)
    since = followed.excitation - followed.excitation[np.searchsorted(time, CHANGE)]
    late = (time > CHANGE) & (since > 30.0)
    assert late.sum() > 50
    assert value[late] == pytest.approx(-20.0, rel=0.1)
    assert (np.abs(value[late] + 20.0) <= 2.0 * followed.deviation[late, 0]).mean() > 0.9
    assert followed.error_after[0] < 0.5 * followed.error_before[0]
    assert followed.symbols == ("X_uu",)
    assert followed.units == ("N s^2/m^2",)


def test_nothing_is_known_before_it_happens(followed: Adapted):
    first = (followed.time > 15.0) & (followed.time < CHANGE)
    unchanged = adapt(World(HULL, "rich", 120.0, 3).run(NOISE["field"]).motion(), HULL, DRAG)
    # The noise and the forces at work are measured on the whole log; they differ a little, and so do the weights.
    assert followed.values[first] == pytest.approx(unchanged.values[first], abs=0.05)
    assert followed.values[-1] != pytest.approx(unchanged.values[-1], rel=0.5)
    assert followed.delay == 0.8
    assert followed.time[0] == pytest.approx(0.05 + 2 * followed.delay), "the log begins at 0.05 s"


def test_deviations_widen_when_the_model_no_longer_fits(followed: Adapted):
    soon = (followed.time > CHANGE + 1.0) & (followed.time < CHANGE + 10.0)
    calm = (followed.time > 40.0) & (followed.time < CHANGE)
    assert followed.deviation[soon].max() > 3.0 * np.median(followed.deviation[calm])


def test_without_forgetting_it_is_least_squares_over_all_rows():
    names = ("surge_linear_damping", "surge_quadratic_damping", "yaw_added_mass", "thrust_scale")
    motion = world(70.0)
    settings = AdaptSettings(forgetting=np.inf, excitation=0.0)
    found = adapt(motion, HULL, names, settings)
    pool = [c for name in names for c in candidates(HULL) if c.key == name]
    weak = WeakForm([motion], WeakSettings())
    search = Search(weak, HULL, pool, SearchSettings())
    amounts = plausible_amounts(search, rehearse(search, HULL, ()))
    linear = Linearisation(weak, HULL, HULL, pool, ())
    noise = np.sqrt(search.noise_error**2 + search.floor)
    columns = [index for c in pool for index in linear.options[c.key][1].free]
    rows = (linear.columns[:, :, columns] / noise[:, None]).reshape(-1, len(columns))
    target = (linear.columns[:, :, -1] / noise).reshape(-1)
    prior = np.array([a for c in pool for a in amounts[c.key]])
    share = 0.2 / 0.8
    normal = np.diag(prior**-2.0) + share * rows.T @ rows
    batch = np.array([HULL.value(s) for s in found.symbols]) + np.linalg.solve(normal, share * rows.T @ target)
    assert found.values[-1] == pytest.approx(batch, rel=1e-9)
    assert found.excited.all()
    free = np.sqrt(np.diag(np.linalg.inv(normal)))
    assert (found.deviation[-1] >= free * (1.0 - 1e-9)).all()


def test_a_boat_at_rest_forgets_nothing_and_learns_nothing():
    motion = held([(20.0, 25.0), (10.0, -10.0), (15.0, 0.0), (120.0, 0.0), (10.0, 25.0)])
    found = adapt(motion, HULL.with_values({"N_r": -200.0}), DRAG)
    still = (found.time > 46.0) & (found.time < 165.0)
    assert not found.excited[still].any()
    assert np.ptp(found.values[still]) == 0.0
    assert np.ptp(found.deviation[still]) == 0.0
    awake = found.time > 165.0
    assert found.excited[awake].any()
    assert found.values[awake] == pytest.approx(-8.0, rel=0.1), "no burst when it moves again"


def test_what_is_not_excited_is_kept_while_something_else_is():
    motion = held([(20.0, 25.0), (15.0, 10.0), (15.0, 25.0)])
    found = adapt(motion, HULL.with_values({"N_r": -200.0}), (*DRAG, "sway_quadratic_damping"))
    assert found.excited.any()
    assert np.ptp(found.values[:, 1]) == 0.0, "nothing pushes sideways on a straight run"
    prior = found.deviation[0, 1]
    assert found.deviation[:, 1] == pytest.approx(prior)
    assert found.deviation[-1, 0] < 0.3 * found.deviation[0, 0]


def test_no_deviation_exceeds_that_of_the_start_by_forgetting():
    found = adapt(world(), HULL, (*DRAG, "surge_linear_damping"), AdaptSettings(forgetting=0.5, hurry=1.0))
    calm = found.time < CHANGE
    assert (found.deviation[calm] <= 2.0 * found.deviation[0]).all()
    assert np.isfinite(found.values).all()


def test_limits_are_kept():
    smooth = load_vehicle("blueboat").with_values({"X_u": -40.0, "X_uu": -8.0})
    found = adapt(world(60.5), smooth, DRAG)  # less drag than the linear part alone makes
    assert found.values.max() <= 0.0
    assert (found.values == 0.0).any()


def test_two_parameters_are_told_apart():
    found = adapt(world(200.0), HULL, (*DRAG, "thrust_scale"))
    assert found.symbols == ("X_uu", "thrust_scale")
    assert found.values[-1] == pytest.approx([-20.0, 1.0], rel=0.1)


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        (("thruster_lag",), "linear in its parameters, but it is not in lag"),
        (("steady_current",), "current_north, current_east"),
        (("wake_memory",), "memory_time"),
        (("apparent_wind",), "expected the channels wind_u and wind_v"),
        (("cross_flow_drag",), "adapt: cross_flow_drag needs the size of the hull: give hull"),
        (("thruster_asymmetry[bow]",), r"has no such thruster; expected thruster_asymmetry\[port\]"),
        (("surge_drag",), "unknown effect 'surge_drag'"),
        ((), "expected effects by name, each once, got none"),
        ((*DRAG, *DRAG), "each once"),
    ],
)
def test_what_cannot_be_followed_is_refused(effects: tuple[str, ...], words: str):
    motion = held([(20.0, 25.0)])
    with pytest.raises(RequestError, match=words):
        undertow.adapt(motion, HULL, effects)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("forgetting", 0.0, "forgetting above 0, got 0"),
        ("prior", -1.0, "prior above 0"),
        ("excitation", -0.1, "excitation of at least 0"),
        ("hurry", 0.5, "hurry of at least 1, got 0.5"),
        ("surprise", float("nan"), "surprise above 0, got nan"),
    ],
)
def test_settings_out_of_range_are_refused(name: str, value: float, words: str):
    with pytest.raises(RequestError, match=words):
        replace(AdaptSettings(), **{name: value})


# The world that changes


def test_a_world_takes_its_motion_over_when_it_changes():
    plain, changed = (World(HULL, "rich", 30.0, 3, becomes=b, changes_at=10.0) for b in (None, FOULED))
    one, other = (w.run(NOISE["clean"]).truth for w in (plain, changed))
    same = one.time <= 10.0
    assert np.array_equal(one.velocity[same], other.velocity[same])
    assert not np.allclose(one.velocity[~same], other.velocity[~same])
    assert np.abs(np.diff(other.velocity, axis=0)).max() < 1.5 * np.abs(np.diff(one.velocity, axis=0)).max()
    after = simulate_motion(FOULED, other.slice(600, other.time.size))
    assert after.velocity == pytest.approx(other.velocity[600:], abs=1e-9)


@pytest.mark.parametrize(
    ("vehicle", "at", "words"),
    [
        (FOULED, 0.0, "a change within the 30 s of the world, got 0 s"),
        (FOULED, 30.0, "got 30 s"),
        (load_vehicle("cybership2"), 10.0, "expected a vehicle with the thrusters"),
    ],
)
def test_a_change_that_makes_no_sense_is_refused(vehicle: Vehicle, at: float, words: str):
    with pytest.raises(RequestError, match=words):
        World(HULL, "rich", 30.0, 3, becomes=vehicle, changes_at=at).run(NOISE["clean"])
