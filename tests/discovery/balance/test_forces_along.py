"""What is kept of columns and of thrusters is what is computed, and it is bounded."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from undertow.discovery.balance import forces_along
from undertow.discovery.balance.forces_along import ColumnCache, ThrusterResponses
from undertow.physics.forces import thruster_response
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle

HULL = load_vehicle("blueboat")
THRUSTER = HULL.thrusters[0]
JOINED = partial(np.concatenate, axis=1)


def moved(rows: int, step: float, seed: int) -> Motion:
    """A motion whose command is held and switched, behind some history."""
    commands = (5.0 * np.repeat(np.random.default_rng(seed).integers(-5, 6, rows // 5), 5)[:, None]).astype(np.float64)
    nothing = np.zeros((rows, 3))
    whole = Motion(
        step * np.arange(rows, dtype=np.float64), nothing[:, :2], nothing[:, 0], nothing, commands, ("port",)
    )
    return whole.slice(40, rows)


@pytest.mark.parametrize(("delay", "offset"), [(0.0, 0.0), (0.35, 0.0), (0.13, 0.0), (0.2, -0.31), (0.0, 0.004)])
@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_the_response_is_that_of_each_motion(delay: float, offset: float, lag: float) -> None:
    motions = [moved(400, 0.05, 1), moved(300, 0.1, 2)]
    changes = {"delay": delay, "command_offset": offset, "lag": lag, "advance_loss": 2.0, "thrust_rate": 0.02}
    responses = ThrusterResponses(motions, JOINED)
    for scale in (1.0, 0.7):  # a thruster of the same shape is computed once
        thruster = THRUSTER.model_copy(update=changes | {"scale": scale})
        found = np.concatenate(responses.of(HULL.model_copy(update={"thrusters": (thruster,)})))
        expected = np.concatenate([np.stack(thruster_response(motion, 0, thruster)) for motion in motions], axis=1)
        assert np.ptp(expected[0]) > 1.0
        assert found == pytest.approx(expected, abs=1e-10)


def test_a_force_that_stays_is_the_same_whatever_the_delay() -> None:
    moving = moved(400, 0.05, 1)
    commands = np.full((moving.time.size, 2), 17.0)
    still = replace(moving, commands=commands, thrusters=("port", "stbd"), run_up=None)
    late = [HULL.with_values({"delay": delay}) for delay in (0.0, 0.123)]
    one, other = (ThrusterResponses([still], JOINED).of(vehicle)[0][0] for vehicle in late)
    assert np.array_equal(one, other)


def test_what_is_kept_is_bounded_in_bytes(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(forces_along, "_MOST", 1000)
    kept = ColumnCache()
    asked: list[str] = []

    def ask(key: str, size: int = 50) -> None:
        def compute() -> np.ndarray:
            asked.append(key)
            return np.zeros(size)

        kept.of(key, compute)

    for key in "abac":  # 400 bytes each: two have room, and the one asked for longest ago goes
        ask(key)
    ask("a")
    ask("b")
    assert asked == ["a", "b", "c", "b"]
    ask("large", 1000)
    ask("large", 1000)
    assert asked[4:] == ["large"]
