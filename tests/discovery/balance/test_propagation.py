"""How an acceleration spreads: bin by bin it is what step by step it is."""

import numpy as np
import pytest

from undertow.discovery.balance.sensitivity import Propagation

STEP, PER_BIN, BINS, STARTS = 0.1, 5, 4, 6


@pytest.mark.parametrize("states", [3, 4, 6])
def test_bins_are_those_of_steps(states: int) -> None:
    rng = np.random.default_rng(states)
    rows = PER_BIN * BINS + 1
    jacobian = rng.standard_normal((states, states, rows, STARTS)) - 2.0 * np.eye(states)[:, :, None, None]
    added = rng.standard_normal((rows, 3, STARTS))
    found = Propagation(jacobian, STEP, PER_BIN)
    state, path = np.zeros((states, STARTS)), []
    spread, spreads = np.repeat(np.eye(states, 3)[:, :, None], STARTS, axis=2), [np.zeros((3, 3, STARTS))]
    spreads[0][:] = spread[:3]
    for k in range(rows - 1):
        after, before = state.copy(), spread.copy()
        for s in range(STARTS):
            left = np.eye(states) - 0.5 * STEP * jacobian[:, :, k + 1, s]
            right = np.eye(states) + 0.5 * STEP * jacobian[:, :, k, s]
            push = np.zeros(states)
            push[:3] = 0.5 * STEP * (added[k, :, s] + added[k + 1, :, s])
            after[:, s] = np.linalg.solve(left, right @ state[:, s] + push)
            spread[:, :, s] = np.linalg.solve(left, right @ before[:, :, s])
        state = after
        path.append(state[:3].copy())
        spreads.append(spread[:3].copy())
    expected = np.stack(path).reshape(BINS, PER_BIN, 3, STARTS).mean(axis=1)
    assert found.binned(added) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert found.transitions() == pytest.approx(np.stack(spreads), rel=1e-9, abs=1e-12)
