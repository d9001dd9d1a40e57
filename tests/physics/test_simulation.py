"""Simulation: order of convergence, agreement with the force equation, batches, divergence, and speed."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.physics.batch_rates import Flattened
from undertow.physics.effects import EFFECTS, Effect
from undertow.physics.errors import LogError, RequestError
from undertow.physics.forces import modelled_acceleration
from undertow.physics.integration import SPEED_LIMIT, Driven, Legs, integrate, rollout, rollouts, simulate_motion
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import with_hull


def commanded(vehicle: Vehicle, seconds: float, step: float) -> Motion:
    """From 0.5 m/s ahead, with smooth commands of a different period for each thruster."""
    t = step * np.arange(round(seconds / step) + 1, dtype=float)
    names = tuple(thruster.name for thruster in vehicle.thrusters)
    commands = np.column_stack([18.0 * np.sin(t * (0.9 + 0.3 * k) + k) + 4.0 for k in range(len(names))])
    n = t.size
    velocity = np.tile([0.5, 0.0, 0.1], (n, 1))
    return Motion(t, np.zeros((n, 2)), np.full(n, 0.3), velocity, commands, names)


def boat() -> Vehicle:
    """The BlueBoat with a hull of some size, which cross-flow drag asks for."""
    return with_hull(load_vehicle("blueboat"), np.random.default_rng(1))


def changed(vehicle: Vehicle, effect: Effect) -> Vehicle:
    """The vehicle with a plain size of an effect."""
    sizes = {"grid": 0.3, "drag": -6.0, "scale": 0.7}
    values = {}
    for k, p in enumerate(effect.parameters):
        kind = "grid" if p.grid else "drag" if p.upper == 0.0 else "scale" if p.null == 1.0 else ""
        value = effect.default[k] if effect.default else sizes.get(kind, 0.2 if p.unit in ("m", "m/s") else 3.0)
        symbol = p.symbol.replace("{thruster}", vehicle.thrusters[0].name)
        values[symbol] = value + (vehicle.value(symbol) if effect.added else 0.0)
    return vehicle.with_values(values).checked()


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_simulated_motion_obeys_the_force_equation(effect: Effect) -> None:
    """The regression's acceleration along a simulated motion is the motion's own derivative, for every effect."""
    vehicle = changed(boat(), effect)
    motion = simulate_motion(vehicle, commanded(vehicle, 5.0, 0.01))
    derivative = np.gradient(motion.velocity, motion.time_step, axis=0, edge_order=2)
    error = np.abs(modelled_acceleration(vehicle, motion) - derivative)
    # 95 %: a dead zone makes steps, at which a derivative by differences is wrong.
    assert (np.quantile(error, 0.95, axis=0) < 2e-3 * np.abs(derivative).max(axis=0)).all()


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_every_effect_changes_the_motion(effect: Effect) -> None:
    vehicle = boat()
    commands = commanded(vehicle, 4.0, 0.05)
    before, after = simulate_motion(vehicle, commands), simulate_motion(changed(vehicle, effect), commands)
    assert np.abs(after.velocity - before.velocity).max() > 1e-3


def test_runge_kutta_converges_with_order_four() -> None:
    """In a steady-handed turn, where no modulus changes its branch (the force is smooth)."""
    vehicle = load_vehicle("blueboat").with_values({"current_north": 0.2, "N_uv": 5.0})
    start = np.array([[0.0, 0.0, 0.4, 1.5, -0.3, 0.6]])

    def end(step: float) -> np.ndarray:
        steps = round(2.0 / step)
        thrust = np.tile(np.array([[20.0], [12.0]])[:, None, :], (1, steps + 1, 1))
        return integrate(Driven(vehicle, start, thrust, np.zeros_like(thrust)), step).states[0, -1]

    exact = end(0.2 / 64)
    errors = [np.abs(end(h) - exact).max() for h in (0.2, 0.1, 0.05)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert ((orders > 3.8) & (orders < 4.3)).all(), orders


@pytest.mark.parametrize("rate", [5.0, 30.0, 200.0])
def test_damping_that_is_faster_than_the_log_decays_as_it_does_in_small_steps(rate: float) -> None:
    vehicle = load_vehicle("blueboat")
    stiff = vehicle.with_values({"Y_v": -rate * (vehicle.mass - vehicle.value("Y_vdot"))})
    coarse, fine = (commanded(vehicle, 4.0, step) for step in (0.1, 0.002))
    found, true = (simulate_motion(stiff, motion).velocity for motion in (coarse, fine))
    assert found[10:] == pytest.approx(true[::50][10:], abs=5e-3)


def test_a_batch_equals_its_members() -> None:
    vehicle = load_vehicle("blueboat").with_values(
        {"lag": 0.4, "delay": 0.15, "current_east": 0.3, "memory_sway": 12.0}
    )
    motion = simulate_motion(vehicle, commanded(vehicle, 20.0, 0.05))
    starts = np.array([0, 37, 200])
    together = rollout(vehicle, motion, starts, 100).states
    for k, start in enumerate(starts):
        alone = rollout(vehicle, motion, np.array([start]), 100).states[0]
        np.testing.assert_allclose(together[k], alone, rtol=1e-11, atol=1e-13)


def test_vehicles_motions_and_lengths_of_one_batch_do_not_see_each_other() -> None:
    hull = load_vehicle("blueboat")
    drifting = hull.with_values({"current_east": 0.3, "memory_sway": 12.0, "y_g": 0.05, "advance_loss": 0.2})
    changing = hull.with_values({"current_rate_north": 0.1, "memory_yaw": 3.0, "memory_time": 2.0, "X_uu": -9.0})
    motion = commanded(hull, 20.0, 0.05)
    windy = replace(motion, air=np.tile([2.0, -1.0], (motion.time.size, 1)), minutes=motion.minutes + 3.0)
    blown = hull.with_values({"wind_x": 0.4})
    asked = [
        (drifting, Legs(motion, np.array([3]), 40)),
        (changing, Legs(motion, np.array([0, 37, 200]), 100)),
        (hull, Legs(motion, np.array([5, 9]), 40)),
        (blown, Legs(windy, np.array([11]), 150)),
    ]
    for (vehicle, legs), together in zip(asked, rollouts(asked), strict=True):
        alone = rollout(vehicle, *legs)
        assert together.states.shape == (legs.starts.size, legs.steps + 1, 6)
        np.testing.assert_allclose(together.states, alone.states, rtol=1e-11, atol=1e-13)


def test_who_diverges_in_a_batch_is_alone_in_it() -> None:
    hull, motion = load_vehicle("blueboat"), commanded(load_vehicle("blueboat"), 20.0, 0.1)
    asked = [(v, Legs(motion, np.array([0, 5]), 150)) for v in (hull, hull.with_values({"X_u": 60.0, "X_uu": 40.0}))]
    calm, lost = rollouts(asked)
    assert not calm.diverged.any()
    assert lost.diverged.all()
    np.testing.assert_allclose(calm.states, rollout(*asked[0][:1], *asked[0][1]).states, rtol=1e-11, atol=1e-13)


def test_rollout_from_the_middle_continues_the_simulation() -> None:
    """With the commands' history (lag, delay) a rollout from any row of a simulated motion is that motion."""
    vehicle = load_vehicle("blueboat").with_values({"lag": 0.5, "delay": 0.23, "current_north": 0.3})
    motion = simulate_motion(vehicle, commanded(vehicle, 20.0, 0.05))
    states = rollout(vehicle, motion, np.array([150]), 200).states[0]
    np.testing.assert_allclose(states[:, 3:], motion.velocity[150:351], atol=1e-10)
    np.testing.assert_allclose(states[:, :2], motion.position[150:351], atol=1e-10)


def test_rollout_with_wake_memory_continues_the_simulation_nearly() -> None:
    """The memory is rebuilt from sampled velocities, linear between samples: second order in the step."""
    vehicle = load_vehicle("blueboat").with_values(
        {"memory_sway": 20.0, "memory_yaw": 4.0, "memory_time": 1.2, "current_east": 0.4}
    )
    motion = simulate_motion(vehicle, commanded(vehicle, 20.0, 0.05))
    states = rollout(vehicle, motion, np.array([150]), 200).states[0]
    np.testing.assert_allclose(states[:, 3:], motion.velocity[150:351], atol=2e-4)


@pytest.mark.parametrize("wrong", [{"X_u": 60.0, "X_uu": 40.0}, {"X_uu": 1e9}])
def test_divergence_is_flagged_and_stays_finite(wrong: dict[str, float]) -> None:
    vehicle = load_vehicle("blueboat").with_values(wrong)
    motion = commanded(vehicle, 20.0, 0.1)
    result = rollout(vehicle, motion, np.array([0, 5]), 150)
    assert result.diverged.all()
    assert np.isfinite(result.states).all()
    assert np.abs(result.states[:, :, 3:]).max() <= SPEED_LIMIT
    assert np.abs(np.diff(result.states[:, :, :3], axis=1)).max() <= 1.5 * SPEED_LIMIT * 0.1, "nor off the map"
    assert not rollout(load_vehicle("blueboat"), motion, np.array([0, 5]), 150).diverged.any()


@pytest.mark.parametrize("starts", [[], [-1], [60]])
def test_starts_beyond_the_motion_are_refused(starts: list[int]) -> None:
    vehicle = load_vehicle("blueboat")
    with pytest.raises(RequestError, match=r"rollout of 50 steps: starts must lie in 0\.\.50"):
        rollout(vehicle, commanded(vehicle, 10.0, 0.1), np.array(starts), 50)


def test_a_thousand_rollouts_ask_for_forces_as_often_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    vehicle = load_vehicle("blueboat")
    motion = simulate_motion(vehicle, commanded(vehicle, 80.0, 0.05))
    slope, asked = Flattened.__call__, []
    monkeypatch.setattr(Flattened, "__call__", lambda *words: asked.append(1) or slope(*words))
    for starts in (1, 1000):
        asked.clear()
        assert rollout(vehicle, motion, np.arange(starts), 300).states.shape == (starts, 301, 6)
        assert len(asked) == 4 * 300, "the stages of Runge-Kutta, for all starts at once"


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("heading", np.zeros(5), r"expected heading of shape \(11,\), got \(5,\)"),
        ("velocity", np.full((11, 3), np.nan), "velocity holds values that are not finite"),
        ("time", np.linspace(0, 1, 11) ** 2, "the time base is not even"),
        ("time", np.linspace(1, 0, 11), "the time base is not even"),
    ],
)
def test_a_motion_that_is_no_motion_is_refused(field: str, value: np.ndarray, message: str) -> None:
    good = commanded(load_vehicle("blueboat"), 1.0, 0.1)
    with pytest.raises(LogError, match=message):
        replace(good, **{field: value})


def test_a_motion_of_one_row_is_refused_and_a_slice_is_a_motion() -> None:
    motion = commanded(load_vehicle("blueboat"), 10.0, 0.1)
    with pytest.raises(LogError, match="at least 2 rows, got 1"):
        motion.slice(3, 4)
    part = motion.slice(10, 31)
    assert part.duration == pytest.approx(2.0)
    assert part.time_step == pytest.approx(0.1)
    np.testing.assert_array_equal(part.commands, motion.commands[10:31])
