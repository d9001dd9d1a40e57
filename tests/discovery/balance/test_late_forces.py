"""Forces that are late: what is worked out once for all delays is what each delay gives by itself."""

from dataclasses import replace

import numpy as np
import pytest

from undertow.discovery.balance.base import LateForces
from undertow.physics.forces import thruster_response
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle

THRUSTER = load_vehicle("blueboat").thrusters[0]


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
def test_a_late_force_lies_between_whole_rows(delay: float, offset: float, lag: float) -> None:
    motions = [moved(400, 0.05, 1), moved(300, 0.1, 2)]
    changes = {"delay": delay, "command_offset": offset, "lag": lag, "advance_loss": 2.0, "thrust_rate": 0.02}
    unit = THRUSTER.model_copy(update=changes).unit
    forces = LateForces(motions)
    rows = [motion.time.size for motion in motions]
    found = forces.between(unit, lambda late: forces.shifted(0, unit, late), rows)
    expected = np.concatenate([np.stack(thruster_response(motion, 0, unit)) for motion in motions], axis=1)
    assert np.ptp(expected[0]) > 1.0
    assert found == pytest.approx(expected, abs=1e-10)


def test_a_force_that_stays_is_the_same_whatever_the_delay() -> None:
    moving = moved(400, 0.05, 1)
    still = replace(moving, commands=np.full_like(moving.commands, 17.0), run_up=None)
    forces = LateForces([still])
    late = [THRUSTER.model_copy(update={"delay": delay}).unit for delay in (0.0, 0.123)]
    one, other = (forces.between(u, lambda rows, u=u: forces.shifted(0, u, rows), [still.time.size]) for u in late)
    assert np.array_equal(one, other)
