"""How an added acceleration spreads through rollouts that are linearised step by step.

All of it is laid out with the rollouts last, so that matrices of three rows are multiplied for all rollouts at once.
Within the steps of a bin all bins go side by side; from bin to bin only their ends are handed on.
"""

from typing import final

import numpy as np

from ...physics.motion import Array


@final
class Propagation:
    """Steps x' = forward x + drive (a_k + a_k+1) of states whose first three are the velocities.

    Parameters
    ----------
    jacobian : (n, n, steps + 1, starts) derivative of the rates of change of the states by the states [1/s]
    step : of the integration, by Crank and Nicolson [s]
    per_bin : steps in a bin
    """

    def __init__(self, jacobian: Array, step: float, per_bin: int) -> None:
        n, _, rows, starts = jacobian.shape
        eye = np.eye(n)[:, :, None, None]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            half = 0.5 * step * jacobian
            left = _inverse(eye - half[:, :, 1:])
            forward = _product(left, eye + half[:, :, :-1])
            self._drive = 0.5 * step * left[:, :3]
            self._forward = forward.reshape(n, n, (rows - 1) // per_bin, per_bin, starts)
            reached = self._forward[:, :, :, 0]
            total = reached[:3].copy()
            for k in range(1, per_bin):
                reached = _product(self._forward[:, :, :, k], reached)
                total += reached[:3]
        self._end, self._mean = reached, total / per_bin

    def binned(self, added: Array) -> Array:
        """Mean velocities of the bins (bins, 3, starts) that accelerations (steps + 1, 3, starts) make."""
        n, _, bins, per_bin, starts = self._forward.shape
        with np.errstate(over="ignore", invalid="ignore"):
            pushed = np.einsum("ijks,kjs->iks", self._drive, added[:-1] + added[1:])
            pushed = pushed.reshape(n, bins, per_bin, starts)
            state = pushed[:, :, 0]
            total = state[:3].copy()
            for k in range(1, per_bin):
                state = np.einsum("ijbs,jbs->ibs", self._forward[:, :, :, k], state) + pushed[:, :, k]
                total += state[:3]
            begin = np.zeros((n, bins, starts))
            for b in range(1, bins):
                begin[:, b] = np.einsum("ijs,js->is", self._end[:, :, b - 1], begin[:, b - 1]) + state[:, b - 1]
            found = np.einsum("ijbs,jbs->bis", self._mean, begin) + (total / per_bin).transpose(1, 0, 2)
        return np.asarray(found, dtype=float)

    def transitions(self) -> Array:
        """How velocities at the start spread to those at each row, (steps + 1, 3, 3, starts)."""
        n, _, bins, per_bin, starts = self._forward.shape
        state = np.repeat(np.eye(n, 3)[:, :, None], starts, axis=2)
        found = np.empty((bins * per_bin + 1, 3, 3, starts))
        found[0] = state[:3]
        for k in range(bins * per_bin):
            state = _product(self._forward[:, :, k // per_bin, k % per_bin], state)
            found[k + 1] = state[:3]
        return found


def _product(one: Array, other: Array) -> Array:
    """Matrices (i, j, ...) times matrices (j, k, ...)."""
    return np.asarray(np.einsum("ij...,jk...->ik...", one, other), dtype=float)


def _inverse(matrix: Array) -> Array:
    """Inverses of matrices (n, n, ...); of three rows by cross products, which is arithmetic on whole arrays."""
    if len(matrix) != 3:
        return np.moveaxis(np.linalg.inv(np.moveaxis(matrix, (0, 1), (-2, -1))), (-2, -1), (0, 1)).astype(float)
    first, second, third = matrix
    columns = (_crossed(second, third), _crossed(third, first), _crossed(first, second))
    return np.stack(columns, axis=1) / (first * columns[0]).sum(axis=0)


def _crossed(one: Array, other: Array) -> Array:
    """Cross products (3, ...)."""
    return np.stack([one[j] * other[k] - one[k] * other[j] for j, k in ((1, 2), (2, 0), (0, 1))])
