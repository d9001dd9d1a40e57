"""How much of a force depends on the past: what lagged motion and thrust tell of it beyond the present state."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...physics.forces import actuation
from ...physics.frames import Array
from ...physics.vehicle import Vehicle
from ..balance.weak_form import WeakForm
from ..candidates.unnamed_terms import features_along

LAGS = (0.3, 0.6, 1.2, 2.4, 4.8)
"""How long before the present velocities and thrusts are looked at [s]."""
_RIDGES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0)
"""In units of a column's mean square: from next to none to as large as the column; the best counts."""
_GUARD = 3.0
"""Rows so near [s] to those that are predicted are not fitted: they share motion with them."""
_FOLDS = 8
"""Stretches of which each is predicted by the others; each fit then sees seven eighths of the log."""


@dataclass(frozen=True, slots=True)
class Past:
    """Shares of the mean square of a force on one axis that linear regressions predict on held-out blocks, 0..1.

    Attributes
    ----------
    present : from the present state: monomials of u, v, r and their moduli to degree three, thrusts and their squares
    memory : what velocities and thrusts at earlier times predict beyond that
    """

    present: float
    memory: float


def past_of(weak: WeakForm, vehicle: Vehicle, force: Array, axes: Sequence[int]) -> dict[int, Past]:
    """Ask of a tested force on some axes what predicts it: the present state, or the past beside it.

    Ridge regressions are fitted to all of the log but one of eight stretches and predict that one; rows within 3 s of
    it are left out of the fit. The best of five ridges counts, for the present and for the past alike.

    Parameters
    ----------
    force : (tests, 3) [N, N, N m]
    axes : indices of the axes that are asked about
    """
    now = np.column_stack([features_along(weak, vehicle, 3)[1], _thrusts(weak, vehicle), np.ones(weak.time.size)])
    both = np.column_stack([now, _before(weak, vehicle)])
    folds = np.minimum(np.arange(weak.time.size) * _FOLDS // weak.time.size, _FOLDS - 1)
    guard = round(_GUARD / weak.settings.stride)
    found = {}
    for axis in axes:
        present, with_past = (_predicted(x, force[:, axis], folds, guard) for x in (now, both))
        found[axis] = Past(present, max(with_past - present, 0.0))
    return found


def _thrusts(weak: WeakForm, vehicle: Vehicle) -> Array:
    """Thrust of each thruster, its modulus and signed square, tested, (tests, 3 thrusters)."""
    thrusts = [actuation(vehicle, motion).thrust.T for motion in weak.motions]
    return weak.average([np.column_stack([t, np.abs(t), t * np.abs(t)]) for t in thrusts])


def _before(weak: WeakForm, vehicle: Vehicle) -> Array:
    """Velocities and thrusts at each lag, tested, (tests, lags (3 + thrusters)); the first row lasts before a log."""
    series = []
    for motion in weak.motions:
        state = np.column_stack([motion.velocity, actuation(vehicle, motion).thrust.T])
        rows = np.arange(state.shape[0])
        series.append(np.column_stack([state[np.maximum(rows - round(s / motion.time_step), 0)] for s in LAGS]))
    return weak.average(series)


def _predicted(features: Array, target: Array, folds: np.ndarray, guard: int) -> float:
    """Share of the mean square of a target that ridge regression predicts on held-out folds, 0..1."""
    scale = np.sqrt((features**2).mean(axis=0))
    alive = scale > 1e-9 * scale.max()
    x = features[:, alive] / scale[alive]
    error = np.zeros(len(_RIDGES))
    for fold in range(_FOLDS):
        rows = np.flatnonzero(folds == fold)
        fitted = np.ones(target.size, dtype=bool)
        fitted[max(rows[0] - guard, 0) : rows[-1] + guard + 1] = False
        left = x[fitted].T @ x[fitted] / fitted.sum()
        right = x[fitted].T @ target[fitted] / fitted.sum()
        for k, ridge in enumerate(_RIDGES):
            answer = np.linalg.solve(left + ridge * np.eye(left.shape[0]), right)
            error[k] += ((target[rows] - x[rows] @ answer) ** 2).sum()
    return float(np.clip(1.0 - error.min() / max(float((target**2).sum()), 1e-300), 0.0, 1.0))
