"""Subspace identification: the observability matrix from projected block rows, then what drives its states."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from undertow.measurements.preparation.prepare import DataSet
from undertow.physics.motion import Array
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model

from .cases import Data
from .stepped import Linear, Stepped, best_of, filtered_thrust, step_means

ROWS = 10
"""Block rows of the past and of the future: a second each."""
ORDERS = (3, 4, 5, 6, 8)
"""Orders that validation chooses among."""
WINDOW = 20
"""Rows from which the state at a start is estimated: two seconds."""
_STABLE = 0.9999
"""Largest modulus of an eigenvalue; larger ones are set back to it, or a rollout of a slow mode would run away."""


def subspace(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """PO-MOESP (Verhaegen 1994, doi:10.1016/0005-1098(94)90229-1), its order chosen by rollouts of the validation part.

    The past inputs and outputs are the instruments, as in N4SID (Van Overschee and De Moor 1994,
    doi:10.1016/0005-1098(94)90230-5), whose weights alone differ.
    """
    del seed
    made = [partial(_identified, vehicle, name, order) for order in ORDERS]
    return best_of(made, *data.parts)


def _identified(vehicle: Vehicle, name: str, order: int, data: DataSet) -> Model:
    motions = [m for m in data.motions if m.time.size > 3 * ROWS]
    runs = [(m.velocity, step_means(filtered_thrust(vehicle, m, data))) for m in motions]
    scale = np.concatenate([velocity for velocity, _ in runs]).std(axis=0)
    runs = [(velocity / scale, pushed) for velocity, pushed in runs]
    seen = _observability(runs, order)
    c = seen[:3]
    a = _held(np.asarray(np.linalg.lstsq(seen[:-3], seen[3:], rcond=None)[0], dtype=float))
    b = _driven(a, c, runs)
    return Stepped(Linear(a, b, scale[:, None] * c, window=WINDOW), vehicle, motions[0].time_step, name)


def _observability(runs: Sequence[tuple[Array, Array]], order: int) -> Array:
    """The extended observability matrix (3 ROWS, order), by an LQ decomposition of future inputs, past, and future."""
    past_y, future_y = (np.hstack([_blocks(y, begin) for y, _ in runs]) for begin in (0, ROWS))
    past_u, future_u = (np.hstack([_blocks(u, begin) for _, u in runs]) for begin in (0, ROWS))
    stacked = np.vstack([future_u, past_u, past_y, future_y])
    lower = np.asarray(np.linalg.qr(stacked.T, mode="r"), dtype=float).T
    first, second = len(future_u), len(future_u) + len(past_u) + len(past_y)
    left, sizes, _ = np.linalg.svd(lower[second:, first:second], full_matrices=False)
    return left[:, :order] * np.sqrt(sizes[:order])


def _blocks(values: Array, begin: int) -> Array:
    """Block Hankel matrix (ROWS columns-of-values, windows) of rows that begin so many rows after a window."""
    windows = len(values) - 2 * ROWS + 1
    return np.vstack([values[begin + k : begin + k + windows].T for k in range(ROWS)])


def _held(a: Array) -> Array:
    """The same matrix with no eigenvalue outside of the unit circle."""
    values, vectors = np.linalg.eig(a)
    size = np.abs(values)
    if size.max() <= _STABLE:
        return a
    values = np.where(size > _STABLE, values / np.maximum(size, 1e-12) * _STABLE, values)
    return np.real(vectors @ np.diag(values) @ np.linalg.inv(vectors))


def _driven(a: Array, c: Array, runs: Sequence[tuple[Array, Array]]) -> Array:
    """The B (states, thrusters) by which simulated outputs fit best; first states are fitted beside it."""
    states, thrusters = len(a), runs[0][1].shape[1]
    rows, target = [], []
    for number, (velocity, pushed) in enumerate(runs):
        inner, free = np.zeros((states, states * thrusters)), np.eye(states)
        for k, measured in enumerate(velocity):
            row = np.zeros((3, states * (thrusters + len(runs))))
            row[:, : states * thrusters] = c @ inner
            row[:, states * (thrusters + number) : states * (thrusters + number + 1)] = c @ free
            rows.append(row)
            target.append(measured)
            inner = a @ inner + np.kron(np.eye(states), pushed[k])
            free = a @ free
    found = np.linalg.lstsq(np.concatenate(rows), np.concatenate(target), rcond=None)[0]
    return found[: states * thrusters].reshape(states, thrusters)
