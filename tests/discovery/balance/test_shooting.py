"""Multiple shooting: rollouts as a balance, their linearisation, the polish, and what coloured noise does to both."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.shooting import Shooting, ShootingSettings
from undertow.discovery.search.estimation import polish
from undertow.physics.errors import RequestError
from undertow.physics.integration import simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Hull, Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world

HIDDEN = {"X_uu": -20.0, "N_ur": -4.0, "reverse_scale": 0.6}


@pytest.fixture(scope="module")
def nominal() -> Vehicle:
    return load_vehicle("blueboat")


def driven(vehicle: Vehicle, seconds: float = 240.0, seed: int = 0, step: float = 0.1) -> Motion:
    """A noise-free motion under random steps of both thrusters, ahead and astern."""
    rng = np.random.default_rng(seed)
    rows = round(seconds / step)
    held = np.repeat(rng.uniform(-20.0, 25.0, size=(rows // 40 + 1, 2)), 40, axis=0)[:rows]
    time = step * np.arange(rows, dtype=float)
    still = Motion(time, np.zeros((rows, 2)), np.zeros(rows), np.zeros((rows, 3)), held, ("port", "stbd"))
    return simulate_motion(vehicle, still)


def disturbed(motion: Motion, sizes: tuple[float, float, float], memory: float, seed: int) -> Motion:
    """Velocities with coloured noise: a first-order process of a standard deviation and a memory [s]."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-motion.time_step / memory)
    noise = np.zeros_like(motion.velocity)
    for k in range(1, motion.time.size):
        noise[k] = keep * noise[k - 1] + np.sqrt(1.0 - keep**2) * rng.standard_normal(3)
    return replace(motion, velocity=motion.velocity + noise * np.array(sizes))


def test_the_true_model_leaves_nothing_of_a_clean_log(nominal: Vehicle) -> None:
    true = nominal.with_values(HIDDEN)
    motion = driven(true)
    form = Shooting([motion], nominal)
    # The starts are medians of half a second, so that false rows do no harm: a little of that is left.
    assert np.sqrt((form.residual(true) ** 2).mean(axis=0)).max() < 0.02
    assert np.sqrt((form.residual(nominal) ** 2).mean(axis=0)).max() > 0.05


@pytest.mark.parametrize(
    ("symbol", "change"),
    [
        ("X_u", 0.5),
        ("X_uu", 1.0),
        ("N_r", 0.3),
        ("X_udot", 0.3),
        ("N_rdot", 0.1),
        ("reverse_scale", 0.02),
        ("lag", 0.02),
    ],
)
def test_linearised_rollouts_are_those_of_a_model_nearby(nominal: Vehicle, symbol: str, change: float) -> None:
    near = nominal.with_values({symbol: nominal.value(symbol) - change if symbol != "lag" else change})
    form = Shooting([driven(nominal)], nominal)
    base = form.residual(nominal)
    exact = form.residual(near) - base
    linear = form.about(nominal).balances(near)[0] - base
    assert np.linalg.norm(linear - exact) < 0.06 * np.linalg.norm(exact)


def test_linearised_rollouts_know_cross_flow_drag(nominal: Vehicle) -> None:
    base = nominal.model_copy(update={"hull": Hull(length=1.4, draught=0.12)}).with_values({"cross_flow": 0.6})
    form = Shooting([driven(base)], base)
    start = form.residual(base)
    for change in ({"cross_flow": 0.63}, {"cross_flow": 0.0}, {"N_r": nominal.value("N_r") - 0.1}):
        near = base.with_values(change)
        exact, linear = form.residual(near) - start, form.about(base).balances(near)[0] - start
        assert np.linalg.norm(linear - exact) < (0.06 if all(change.values()) else 0.4) * np.linalg.norm(exact), change


def test_linearised_rollouts_know_the_wake_memory(nominal: Vehicle) -> None:
    base = nominal.with_values({"memory_yaw": 4.0, "memory_time": 1.5})
    form = Shooting([driven(base)], nominal)
    start = form.residual(base)
    for change in ({"memory_yaw": 4.2}, {"memory_time": 1.55}, {"N_r": nominal.value("N_r") - 0.1}):
        near = base.with_values(change)
        exact, linear = form.residual(near) - start, form.about(base).balances(near)[0] - start
        assert np.linalg.norm(linear - exact) < 0.06 * np.linalg.norm(exact), change


@pytest.mark.parametrize("stride", [1, 2])
def test_rollouts_and_their_linearisation_feel_the_wind(nominal: Vehicle, stride: int) -> None:
    true = nominal.with_values({"wind_x": 0.3, "wind_y": 0.6, "wind_n": -0.1})
    motion = simulate_world(true, {}, duration=120.0, noise="clean", seed=3, wind=(4.0, -5.0)).motion(0.05)
    form = Shooting([motion], true, ShootingSettings(step=0.05 * stride))
    calm = Shooting([replace(motion, air=None)], true, form.settings)
    start = form.residual(true)
    left, ignored = (np.sqrt((f.residual(true) ** 2).mean(axis=0)) for f in (form, calm))
    assert (left < 0.1 * ignored)[:2].all()
    assert left.max() < 0.01
    for change in ({"wind_x": 0.31}, {"wind_y": 0.62}, {"wind_n": -0.104}, {"Y_v": nominal.value("Y_v") - 0.5}):
        near = true.with_values(change)
        exact, linear = form.residual(near) - start, form.about(true).balances(near)[0] - start
        assert np.linalg.norm(linear - exact) < 0.06 * np.linalg.norm(exact), change


def test_linearised_rollouts_know_that_a_current_turns_with_the_heading(nominal: Vehicle) -> None:
    base = nominal.with_values({"current_north": 0.3, "current_east": -0.4})
    form = Shooting([driven(base, 120.0)], base)
    start = form.residual(base)
    for change in ({"N_r": nominal.value("N_r") - 0.1}, {"current_north": 0.31}):
        near = base.with_values(change)
        exact, linear = form.residual(near) - start, form.about(base).balances(near)[0] - start
        assert np.linalg.norm(linear - exact) < 0.06 * np.linalg.norm(exact), change


def test_the_polish_finds_hidden_values_under_coloured_noise(nominal: Vehicle) -> None:
    true = nominal.with_values(HIDDEN)
    motion = disturbed(driven(true, 400.0), (0.05, 0.05, 0.02), 1.5, seed=1)
    found = polish([motion], nominal, list(HIDDEN))
    for symbol, value in HIDDEN.items():
        interval = found.intervals[symbol]
        assert found.vehicle.value(symbol) == pytest.approx(value, rel=0.1)
        assert interval.lower < interval.upper
    form = Shooting([motion], found.vehicle)
    before, after = ((form.residual(vehicle) ** 2).mean(axis=0) for vehicle in (nominal, found.vehicle))
    assert (after < before)[[0, 2]].all()


def test_the_polish_keeps_physical_limits(nominal: Vehicle) -> None:
    driving = nominal.with_values({"X_u": 3.0})
    found = polish([driven(driving, 120.0)], nominal, ["X_u", "N_r"])
    assert found.vehicle.value("X_u") == 0.0
    assert set(found.intervals) == {"N_r"}, "a parameter at its limit has no interval"


def test_as_many_parameters_as_blocks_have_no_intervals(nominal: Vehicle) -> None:
    motion, symbols = disturbed(driven(nominal, 60.0), (0.02, 0.02, 0.01), 1.0, seed=1), ["X_u", "Y_v", "N_r"]
    blocks = (ShootingSettings(blocks=k) for k in (3, 4))
    few, enough = (polish([motion], nominal, symbols, settings, rounds=2) for settings in blocks)
    assert few.intervals == {}
    assert set(enough.intervals) == set(symbols)


def test_a_false_row_hardly_moves_the_polish(nominal: Vehicle) -> None:
    true = nominal.with_values(HIDDEN)
    motion = driven(true)
    velocity = motion.velocity.copy()
    velocity[50::30, 0] += 0.5
    spiked = polish([replace(motion, velocity=velocity)], nominal, list(HIDDEN)).vehicle
    for symbol, value in HIDDEN.items():
        assert spiked.value(symbol) == pytest.approx(value, rel=0.03)


def test_a_start_that_one_model_did_not_follow_counts_no_more_about_the_next(nominal: Vehicle) -> None:
    true = nominal.with_values(HIDDEN)
    motion = driven(true)
    before = Shooting([motion], nominal, ShootingSettings(whiten=False))
    after, fresh = before.refreshed(true).refreshed(true), Shooting([motion], true, before.settings)
    # Of the same errors no start tells more than about either model; a few tell less than about the last one alone.
    counted = after.squares(nominal)
    assert (counted <= (1.0 + 1e-12) * np.minimum(before.squares(nominal), fresh.squares(nominal))).all()
    assert (counted < 0.9 * fresh.squares(nominal)).any()


def test_rows_long_after_the_last_command_are_not_scored(nominal: Vehicle) -> None:
    motion = driven(nominal, 120.0)
    commands = motion.commands.copy()
    commands[600:] = 0.0
    form = Shooting([replace(motion, commands=commands)], nominal)
    assert form.time.max() < 60.0 + 8.0 + ShootingSettings().horizon
    assert form.independent < 30


@pytest.mark.parametrize("whiten", [True, False])
def test_the_noisier_copy_holds_as_much_noise_as_the_balance_of_the_true_model(nominal: Vehicle, whiten: bool) -> None:
    motion = driven(nominal, 400.0)
    noise = np.random.default_rng(0).standard_normal(motion.velocity.shape) * [0.03, 0.03, 0.012]
    form = Shooting([replace(motion, velocity=motion.velocity + noise)], nominal, ShootingSettings(whiten=whiten))
    balance, noisier = form.noisy_residuals(nominal)
    added, held = (np.sqrt((x**2).mean(axis=0)) for x in (noisier - balance, balance))
    np.testing.assert_allclose(added, held, rtol=0.12)


def test_a_step_that_makes_rollouts_worse_is_halved_or_not_made(nominal: Vehicle) -> None:
    form = Shooting([driven(nominal, 60.0)], nominal)
    assert form.nearer(nominal, nominal.with_values({"X_u": 1e4})) is nominal, "diverges at any of five halvings"
    assert form.nearer(nominal, nominal.with_values({"X_u": np.nan})) is nominal
    off = nominal.with_values({"X_u": nominal.value("X_u") - 8.0})
    far = off.with_values({"X_u": nominal.value("X_u") + 24.0})
    near = form.nearer(off, far)
    assert off.value("X_u") < near.value("X_u") < far.value("X_u")


def test_gaps_do_not_make_blocks_independent(nominal: Vehicle) -> None:
    log = driven(nominal, 240.0)
    torn = [replace(log.slice(k, k + 60), source="a") for k in range(0, 2400, 60)]
    sizes = np.bincount(Shooting(torn[:8], nominal).block)
    assert sizes.tolist() == [40, 40], "eight rollouts of ten bins"
    assert np.bincount(Shooting(torn, nominal).block).tolist() == [40] * 10
    few = Shooting(torn, nominal, ShootingSettings(blocks=4)).block
    assert few.max() == 3
    assert (np.diff(few) >= 0).all()


def test_no_block_holds_rollouts_of_two_logs(nominal: Vehicle) -> None:
    log = driven(nominal, 240.0)
    logs = [log.slice(0, 900), replace(log.slice(900, 1000), source="b"), log.slice(1000, 2400), log.slice(0, 700)]
    form = Shooting(logs, nominal)
    assert form.block.max() == 15
    ends = np.cumsum([10 * starts.size for starts in form.data.starts])[:-1]
    assert (form.block[ends] == form.block[ends - 1] + 1).all()
    assert Shooting(logs, nominal, ShootingSettings(blocks=2)).block.max() == 3


def test_too_short_a_log_is_refused(nominal: Vehicle) -> None:
    with pytest.raises(RequestError, match="rollouts of 5 s with commands fit into the log"):
        Shooting([driven(nominal, 15.0)], nominal)


def test_time_steps_that_do_not_fit_together_are_refused(nominal: Vehicle) -> None:
    coarse, finer = driven(nominal, 60.0), replace(driven(nominal, 60.0, step=0.04), source="run 2")
    with pytest.raises(RequestError, match=r"integration step of 0\.1 s, got 0\.04 s in run 2; prepare all logs"):
        Shooting([coarse, finer], nominal)
    assert Shooting([coarse, driven(nominal, 60.0, step=0.05)], nominal).data.stride == (1, 2)


def test_the_polish_wants_parameters(nominal: Vehicle) -> None:
    with pytest.raises(RequestError, match="expected different symbols"):
        polish([driven(nominal, 60.0)], nominal, [])
