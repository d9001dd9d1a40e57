"""What a model leaves out widens its numbers: an effect too small to be told, and a file whose numbers are all off."""

import numpy as np
import pytest

from undertow.discovery import claims
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.linearisation import Linearisation
from undertow.discovery.evidence.omitted_variables import FileError, file_errors, omitted_variable_bias
from undertow.discovery.search.estimation import Interval
from undertow.discovery.search.floating import Search, State
from undertow.discovery.search.gram import GramScores
from undertow.discovery.search.scoring import SearchSettings
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")
FILED = ("X_uu", "Y_v", "Y_vv", "N_r", "N_rr", "X_udot", "Y_vdot", "N_rdot")


def about(motion: Motion, file: Vehicle, *names: str) -> tuple[Search, State, tuple[Linearisation, GramScores]]:
    search = Search(WeakForm([motion], WeakSettings()), file, candidates(file), SearchSettings())
    state = search.evaluate(file, names)
    return search, state, search.linearise(state.vehicle, state.active, state.fit.in_sample)


@pytest.mark.parametrize("added_mass", [0.0, -3.0])
def test_what_is_left_out_widens_a_number_to_the_side_where_the_truth_lies(added_mass: float):
    """Added mass in surge is no tenth of the hull's, and turns the boat as a Munk moment of the same size does."""
    hidden = {"munk_moment": 12.0} | ({"surge_added_mass": added_mass} if added_mass else {})
    motion = simulate_world(HULL, hidden, duration=240.0, noise="field", seed=7).motion(0.05)
    search, state, scores = about(motion, HULL, "munk_moment")
    down, up = omitted_variable_bias(search, state, scores)["N_uv"]
    off = state.vehicle.value("N_uv") - HULL.value("N_uv") - 12.0
    if added_mass:
        assert abs(off) > 1.0
        assert -up - 0.2 < off < down + 0.2
    else:
        assert max(down, up) < 0.1


def test_a_right_file_makes_nothing_of_a_number():
    motion = simulate_world(HULL, {"surge_linear_damping": -8.0}, duration=240.0, noise="field", seed=3).motion(0.05)
    found = file_errors(*about(motion, HULL, "surge_linear_damping"))
    assert abs(found["X_u"].shift) < 0.1
    assert found["X_u"].deviation < 0.1


@pytest.mark.parametrize("name", ["surge_linear_damping", "munk_moment"])
def test_of_a_straight_run_without_noise_nothing_is_made(name: str):
    time = 0.05 * np.arange(4800)
    thrust = np.repeat((15.0 + 10.0 * np.sin(0.1 * time))[:, None], 2, axis=1)
    nothing = np.zeros((time.size, 2)), np.zeros(time.size), np.zeros((time.size, 3))
    motion = simulate_motion(HULL, Motion(time, *nothing, thrust, ("port", "stbd")))
    (found,) = file_errors(*about(motion, HULL, name)).values()
    assert found == pytest.approx((0.0, 0.0), abs=1e-6)


def test_a_file_that_is_off_everywhere_widens_a_number_to_its_truth():
    """Beside one number that is fitted, eight of the file are off by a tenth to either side."""
    rng, covered, moved = np.random.default_rng(5), 0, 0
    for seed in range(4):
        off = {s: HULL.value(s) * (1.0 + 0.1 * rng.standard_normal()) for s in FILED}
        file = HULL.with_values(off)
        motion = simulate_world(HULL, {"munk_moment": 12.0}, duration=240.0, noise="field", seed=seed).motion(0.05)
        search, state, scores = about(motion, file, "munk_moment")
        found = file_errors(search, state, scores)["N_uv"]
        error = HULL.value("N_uv") + 12.0 - state.vehicle.value("N_uv")
        moved += abs(error) > 0.5
        covered += abs(error - found.shift) < 2.0 * found.deviation + 0.5 or 0.0 < error / found.shift < 1.0
    assert moved >= 3
    assert covered >= 3


def test_an_interval_reaches_to_what_the_file_may_make_of_it():
    pool = [c for c in candidates(HULL) if c.key == "munk_moment"]
    given = (pool, HULL, claims.Tests(), ())
    wide = claims.widen_intervals({"N_uv": Interval(10.0, 12.0)}, *given, filed={"N_uv": FileError(3.0, 1.0)})["N_uv"]
    assert wide.lower == 10.0
    assert wide.upper == pytest.approx(14.0 + np.hypot(1.0, 1.96), abs=0.01)
