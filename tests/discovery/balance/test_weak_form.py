"""The weak form, the columns, and the compressed scores, each against a direct computation."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from undertow.discovery.balance.weak_form import WeakForm, WeakSettings
from undertow.discovery.candidates.candidate import candidates
from undertow.discovery.candidates.linearisation import Linearisation, Option
from undertow.discovery.search.floating import Search, SearchSettings
from undertow.discovery.search.gram import GramScores, bounded_solve
from undertow.measurements.statistics.signals import drawn_noise, sensor_noise
from undertow.physics.errors import RequestError
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def motion() -> Motion:
    """Two minutes of a world without a secret, noise-free."""
    return simulate_world(HULL, {}, duration=120.0, noise="clean", seed=3).motion(0.05)


@pytest.fixture(scope="module")
def weak(motion: Motion) -> WeakForm:
    return WeakForm([motion], WeakSettings())


def polynomial_motion(step: float = 0.02) -> Motion:
    time = np.arange(0.0, 40.0, step)
    velocity = np.column_stack([0.1 * time, 0.02 * time**2 / 10.0, np.sin(time)])
    zero = np.zeros(time.size)
    return Motion(time, np.zeros((time.size, 2)), zero, velocity, np.zeros((time.size, 2)), ("port", "stbd"))


def test_the_weak_derivative_is_the_average_of_the_derivative():
    motion = polynomial_motion()
    weak = WeakForm([motion], WeakSettings(blocks=4))
    exact = np.column_stack([np.full(motion.time.size, 0.1), 0.004 * motion.time, np.cos(motion.time)])
    np.testing.assert_allclose(weak.derivative([motion.velocity]), weak.average([exact]), atol=2e-6)


def test_the_average_of_a_constant_is_the_constant():
    motion = polynomial_motion()
    weak = WeakForm([motion], WeakSettings(blocks=4))
    np.testing.assert_allclose(weak.average([np.full((motion.time.size, 1), 7.0)]), 7.0, rtol=1e-12)


def test_no_test_function_reaches_across_two_motions(motion: Motion):
    first, second = motion.slice(0, 1100), motion.slice(1200, 2300)
    both = WeakForm([first, second], WeakSettings())
    each = [WeakForm([part], WeakSettings(blocks=8)) for part in (first, second)]
    np.testing.assert_array_equal(both.residual(HULL), np.concatenate([form.residual(HULL) for form in each]))


def test_a_perfect_model_leaves_only_the_error_of_sampling(weak: WeakForm):
    left = np.sqrt((weak.residual(HULL) ** 2).mean(axis=0)) / weak.force_scale(HULL)
    assert (left < 2e-3).all(), left


def test_a_log_too_short_for_the_blocks_is_refused(motion: Motion):
    with pytest.raises(RequestError, match="at least 32 are needed; give a longer log"):
        WeakForm([motion.slice(0, 120)], WeakSettings())
    with pytest.raises(RequestError, match="expected at least one motion, got none"):
        WeakForm([], WeakSettings())


@pytest.mark.parametrize(
    "symbol", ["X_uu", "N_uv", "Y_ur", "Y_vdot", "x_g", "stbd_scale", "yaw_trim", "wind_force_east"]
)
def test_a_column_is_the_force_that_a_unit_of_the_parameter_adds(weak: WeakForm, symbol: str):
    pool = [c for c in candidates(HULL) if symbol in c.symbols]
    linear = Linearisation(weak, HULL, HULL, pool, ())
    present = linear.options[pool[0].key][1]
    column = linear.columns[:, :, present.free[present.symbols.index(symbol)]]
    moved = weak.residual(HULL.with_values({symbol: HULL.value(symbol) + 0.5}))
    np.testing.assert_allclose(weak.residual(HULL) - moved, 0.5 * column, atol=1e-9)


def test_a_column_of_an_unnamed_term_is_its_monomial(weak: WeakForm, motion: Motion):
    moved = weak.residual(HULL.with_values({"yaw:v|r|": 1.0}))
    u, v, r = motion.velocity.T
    del u
    np.testing.assert_allclose(
        (weak.residual(HULL) - moved)[:, 2], weak.average([(v * np.abs(r))[:, None]])[:, 0], atol=1e-9
    )


@pytest.fixture(scope="module")
def compressed(weak: WeakForm) -> tuple[Linearisation, GramScores, list, np.ndarray]:
    linear = Linearisation(weak, HULL, HULL, candidates(HULL), ())
    rng = np.random.default_rng(0)
    weight = 1.0 / np.array([2.0, 1.0, 0.5]) ** 2
    columns = linear.columns.copy()
    columns[:, :, -1] += rng.normal(0.0, 0.5, columns.shape[:2])
    scores = GramScores(columns, linear.noise, weak.block, weight)
    chosen = [
        without_limits(linear.options[key][1]) for key in ("munk_moment", "mean_wind", "thruster_lag", "yaw_trim")
    ]
    return linear, scores, chosen, columns


def without_limits(option: Option) -> Option:
    free = tuple(np.inf for _ in option.symbols)
    return replace(option, lower=tuple(-x for x in free), upper=free)


def direct(columns, chosen, rows, weight):
    """Weighted least squares on some rows, without any compression."""
    index = [k for option in chosen for k in option.free]
    y = columns[:, :, -1] - sum(columns[:, :, option.offset] for option in chosen if option.offset >= 0)
    a = (columns[:, :, index] * np.sqrt(weight)[:, None])[rows].reshape(-1, len(index))
    b = (y * np.sqrt(weight))[rows].reshape(-1)
    return index, y, np.linalg.lstsq(a, b, rcond=None)[0]


def test_gram_matrices_give_the_least_squares_answer(compressed, weak: WeakForm):
    _, scores, chosen, columns = compressed
    everything = np.ones(weak.time.size, dtype=bool)
    index, _, expected = direct(columns, chosen, everything, scores.weight)
    fit = scores.fit(chosen)
    assert not fit.held.any()
    np.testing.assert_array_equal(fit.columns, index)
    np.testing.assert_allclose(fit.change, expected, rtol=1e-5, atol=1e-7)


def test_held_out_errors_are_those_of_fits_without_the_block(compressed, weak: WeakForm):
    _, scores, chosen, columns = compressed
    fit = scores.fit(chosen)
    for block in (0, 7, 15):
        inside = weak.block == block
        index, y, solution = direct(columns, chosen, ~inside, scores.weight)
        error = (y - columns[:, :, index] @ solution)[inside]
        np.testing.assert_allclose(fit.held_out_blocks[block], (error**2).sum(axis=0), rtol=1e-5)


def test_the_screen_promises_what_the_fit_keeps(compressed):
    linear, scores, chosen, _ = compressed
    kept = chosen[:2]
    names = ("sway_lift", "thruster_lag", "sway_yaw_coupling")
    others = [without_limits(linear.options[key][1]) for key in names]
    promised = scores.screen(kept, others)

    def loss(options):
        return float(scores.fit(options).in_sample @ scores.weight) * scores.tests

    for gain, option in zip(promised, others, strict=True):
        fit = scores.fit([*kept, option])
        assert not fit.held.any()
        assert gain == pytest.approx(loss(kept) - loss([*kept, option]), rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("seed", range(20))
def test_the_bounded_solver_agrees_with_scipy(seed: int):
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(30, 5)), rng.normal(size=30) * 3.0
    lower, upper = -rng.uniform(0.0, 0.4, 5), rng.uniform(0.0, 0.4, 5)
    expected = lsq_linear(a, b, (lower, upper), tol=1e-12).x
    found, held = bounded_solve(a.T @ a, a.T @ b, lower, upper)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert held.any()
    assert (found >= lower - 1e-12).all()
    assert (found <= upper + 1e-12).all()


def test_errors_are_compared_as_accelerations_when_the_mass_changes(weak: WeakForm):
    pool = [c for c in candidates(HULL) if c.key == "surge_added_mass"]
    search = Search(weak, HULL, pool, SearchSettings())
    linear, scores = search.linearise(HULL, ())
    present = linear.options["surge_added_mass"][1]
    raw, compared = scores.fit([present]), search.fit(scores, [present])
    mass = mass_matrix(HULL)[0, 0]
    ratio = mass / (mass - raw.change[0])
    np.testing.assert_allclose(compared.held_out, raw.held_out * [ratio**2, 1.0, 1.0])


def test_a_long_log_is_tested_piece_by_piece() -> None:
    rows, columns = 40_000, 20
    rng = np.random.default_rng(5)
    time, zero = 0.05 * np.arange(rows, dtype=float), np.zeros((rows, 2))
    long = Motion(time, zero, zero[:, 0], rng.normal(0.0, 1.0, (rows, 3)), zero, ("port", "stbd"))
    weak = WeakForm([long], WeakSettings(copies=0))
    values = rng.normal(0.0, 1.0, (rows, columns))
    tracemalloc.start()
    found = weak.average([values])
    needed = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    width = 33
    assert found.shape == (weak.time.size, columns)
    assert needed < 0.3 * 8 * weak.time.size * columns * width, "less than all windows side by side"
    k = weak.time.size // 2
    grid = np.linspace(-1.0, 1.0, width)
    phi = (1.0 - grid**2) ** 3
    centre = round(weak.time[k] / 0.05)
    assert found[k] == pytest.approx(phi @ values[centre - 16 : centre + 17] / phi.sum(), rel=1e-12)


def test_noise_of_a_column_is_what_noisier_copies_change_in_it() -> None:
    weak = WeakForm([simulate_world(HULL, {}, duration=60.0).motion()], WeakSettings())
    linear = Linearisation(weak, HULL, HULL, candidates(HULL), ())
    balances = weak.noisy_residuals(HULL)
    assert np.array_equal(linear.columns[..., -1], balances[0])
    assert np.array_equal(linear.noise[..., -1], balances[1:] - balances[0])
    assert np.abs(linear.noise[..., -1]).max() > 0.1


def test_the_noise_of_derived_speeds_is_that_of_differences():
    rng, step, size = np.random.default_rng(4), 0.05, 0.03
    motion = simulate_world(HULL, {}, duration=200.0, noise="clean", seed=3).motion(step)
    place = size * rng.standard_normal(motion.time.size)
    velocity = motion.velocity.copy()
    velocity[:, 0] += np.gradient(place, step)
    noisy = replace(motion, velocity=velocity, derived=(True, True, False))
    level = sensor_noise([noisy])
    drawn = drawn_noise(noisy, level, rng)[:, 0]
    assert drawn.std() == pytest.approx(np.gradient(place, step).std(), rel=0.1)
    assert np.cumsum(step * drawn).std() < 2.0 * size  # white noise would have wandered thirty times as far
    # What passes the test functions is as much as of the noise in the log itself, and less than of white noise.
    white, colored = (
        Search(WeakForm([m], WeakSettings()), HULL, candidates(HULL), SearchSettings()).noise_error[0]
        for m in (replace(noisy, derived=(False, False, False)), noisy)
    )
    clean = WeakForm([motion], WeakSettings()).residual(HULL)[:, 0]
    left = np.sqrt(((WeakForm([noisy], WeakSettings()).residual(HULL)[:, 0] - clean) ** 2).mean())
    assert white > 2.0 * left
    assert colored == pytest.approx(left, rel=0.3)
