"""Tabular fits: boosted trees, Gaussian processes and ridge regression, fitted at once to a table of rows.

The ridge regression has a penalty for each group of its products, by which blocks of time that it has not seen are
predicted best (generalised ridge: Hoerl and Kennard 1970; Hastie et al. 2009, section 3.4). Kernels come
from the marginal likelihood of samples of rows (Rasmussen and Williams 2006, section 5.4.1), which takes neighbours in
time for independent; so lengths and noise are raised in steps, and the kernel kept errs least on unseen blocks of time
(Roberts et al. 2017, doi:10.1111/ecog.02881). Weights come from all rows by the subset of regressors (section 8.3.1,
eq. 8.14).
"""

import warnings
from collections.abc import Callable, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import torch
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular
from scipy.spatial.distance import cdist

from ...measurements.statistics.processors import single_threaded
from ...physics.errors import RequestError
from ...physics.motion import Array
from ...physics.registry_members import how_to_install
from ..models.network_model import numbers
from ..networks.base import Network
from ..networks.gaussian_process import GaussianProcess
from ..networks.ridge import Ridge
from ..networks.symmetric_process import SymmetricProcess
from ..networks.trees import Nodes, Trees


class Table(NamedTuple):
    """Rows that a network is fitted to at once.

    Attributes
    ----------
    rows : (rows, inputs) standardised inputs
    wanted : (rows, 3) target in units of the output
    lengths : rows of each motion, in order
    time_step : between rows of a motion [s]
    """

    rows: Array
    wanted: Array
    lengths: tuple[int, ...]
    time_step: float


_SAMPLE = 400
"""Rows that a kernel is found on: time grows by the cube, and three kernels of three axes take some ten seconds so."""
_SAMPLES, _EACH, _FEWER = 3, 50, 250
"""Samples that are drawn at most, as far as there are rows for them, and epochs that a training of networks would have
for each: each costs as much time again; and the rows of the one that a probe has. See `docs/decisions.md`."""
_SIZE, _LENGTH, _NOISE = (1e-3, 1e2), (0.1, 1e2), (1e-4, 10.0)
"""Bounds of the variance, of lengths in deviations of the inputs, and of the variance of the noise, for a target of
about 1: less noise than a hundredth would only make weights large, and an input of the greatest length says nothing."""
_NUGGET = 1e-4
"""What is added to the variance of a centre, as a share. Weights of bells side by side are then small enough for single
precision; on simulated worlds errors with 1e-6 and 1e-3 are the same within 2 %."""
_LONGER, _LOUDER = (1.0, 1.5, 2.0, 3.0), (1.0, 10.0, 1e2, 1e3, 1e4)
"""Factors of the lengths and of the variance of the noise that are tried with each kernel."""
_FOLDS = 5
"""Blocks of time, each predicted from the others."""
_FAINT = 1e-18
"""Bells that count for nothing: products of them would leave the normal numbers, with which processors are slow."""
_ROWS = 2048
"""Rows whose bells are held in memory at once."""

Kernel = tuple[float, Array, float]
"""Variance, lengths (inputs,) and variance of the noise."""


class _Moments(NamedTuple):
    """Products of columns with each other and with the targets, and of those with themselves, by block of time.

    Attributes
    ----------
    inner, pull, size : (blocks, columns, columns), (blocks, columns, targets), (blocks, targets)
    rows : by which penalties are multiplied
    """

    inner: Array
    pull: Array
    size: Array
    rows: int = 1

    @classmethod
    def of(cls, seen: Array, wanted: Array) -> "_Moments":
        """Of columns (rows, columns) and targets (rows, targets)."""
        parts = np.array_split(np.arange(len(seen)), _FOLDS)
        inner, pull = (np.array([seen[p].T @ some[p] for p in parts]) for some in (seen, wanted))
        return cls(inner, pull, np.array([(wanted[p] ** 2).sum(axis=0) for p in parts]), len(seen))

    def fitted(self, axis: int, penalties: Array) -> Array:
        """Coefficients (columns,) of all rows under penalties (columns,)."""
        shrunk = self.inner.sum(axis=0) + self.rows * np.diag(penalties)
        return np.linalg.solve(shrunk, self.pull.sum(axis=0)[:, axis])

    def unseen(self, axis: int, penalties: Array) -> float:
        """Squared error on blocks of time, each predicted from the others."""
        whole, pulled = self.inner.sum(axis=0), self.pull.sum(axis=0)[:, axis]
        shrunk, error = self.rows * np.diag(penalties), 0.0
        for inner, pull, size in zip(self.inner, self.pull[..., axis], self.size[:, axis], strict=True):
            weights = cho_solve(cho_factor(whole - inner + shrunk), pulled - pull)
            error += size - 2.0 * weights @ pull + weights @ inner @ weights
        return float(error)


@single_threaded
def fit_processes(network: GaussianProcess, table: Table, seed: int, epochs: int) -> float:
    """Fit the Gaussian process of each axis, see `tabular_fit.fit_tabular`."""
    rows, wanted = network.with_images(table.rows.astype(np.float32).astype(float), table.wanted)
    order = np.random.default_rng(seed).permutation(rows.shape[0])
    count, size = min(_SAMPLES, 1 + epochs // _EACH), _SAMPLE if epochs > 1 else _FEWER
    samples = [order[first : first + size] for first in range(0, max(len(order) - size, 0) + 1, size)[:count]]
    centres = rows[order[: network.centres.shape[0]]]
    sharpness, weights = np.zeros(network.sharpness.shape), np.zeros((3, network.centres.shape[0]))
    for axis, target in enumerate(wanted.T):
        if target.any():
            kernel = _holding([_kernel(rows[sample], target[sample]) for sample in samples], rows, target, centres)
            sharpness[axis], weights[axis, : len(centres)] = 1.0 / kernel[1], _fitted(rows, target, centres, kernel)
    with torch.no_grad():
        network.centres[: len(centres)] = torch.as_tensor(centres).to(network.centres)
        network.sharpness.copy_(torch.as_tensor(sharpness))
        network.head["weight"].copy_(torch.as_tensor(weights))
    return float(((_predicted(network, rows) - wanted) ** 2).mean())


def _predicted(network: GaussianProcess | Trees, rows: np.ndarray) -> Array:
    """What a network without memory says at standardised inputs (rows, inputs), (rows, 3) in units of its output."""
    seen = torch.as_tensor(rows).to(network.input_mean)
    with torch.no_grad():
        return numbers(network.correct(seen, seen, None)[0])


def _kernel(rows: Array, target: Array) -> Kernel:
    """By the marginal likelihood of rows."""
    try:
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    except ImportError as error:
        raise RequestError(f"gp needs scikit-learn ({error}): {how_to_install('neural')}") from None
    lengths: Any = np.full(rows.shape[1], 2.0)  # annotated as a number alone
    kernel = ConstantKernel(1.0, _SIZE) * RBF(lengths, _LENGTH) + WhiteKernel(0.1, _NOISE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is an input that tells nothing
        found: Any = GaussianProcessRegressor(kernel).fit(rows, target).kernel_
    return found.k1.k1.constant_value, np.broadcast_to(found.k1.k2.length_scale, lengths.shape), found.k2.noise_level


def _holding(kernels: Sequence[Kernel], rows: Array, target: Array, centres: Array) -> Kernel:
    """The kernel, of some and what is made of them, that errs least on unseen blocks."""
    best, least = kernels[0], np.inf
    for (size, lengths, noise), longer in product(kernels, _LONGER):
        errors = _unseen(rows, target, centres, lengths * longer, [noise / size * louder for louder in _LOUDER])
        if min(errors) < least:
            best, least = (size, lengths * longer, noise * _LOUDER[int(np.argmin(errors))]), min(errors)
    return best


def _unseen(rows: Array, target: Array, centres: Array, lengths: Array, shares: Sequence[float]) -> list[float]:
    """Squared errors on blocks of time that weights have not seen, for shares of noise in the variance."""
    near, count = _near(centres / lengths), len(centres)
    parts = np.array_split(np.arange(len(rows)), _FOLDS)
    inner, pull, size = np.zeros((_FOLDS, count, count)), np.zeros((_FOLDS, count)), np.zeros(_FOLDS)
    for k, part in enumerate(parts):
        for some, wanted in zip(_blocks(rows[part]), _blocks(target[part]), strict=True):
            across = solve_triangular(near, _bells(some / lengths, centres / lengths).T, trans=1)
            inner[k] += across @ across.T
            pull[k] += across @ wanted
            size[k] += wanted @ wanted
    moments = _Moments(inner, pull[..., None], size[:, None])
    return [moments.unseen(0, np.full(count, share)) for share in shares]


def _fitted(rows: Array, target: Array, centres: Array, kernel: Kernel) -> Array:
    """Weights of the centres (centres,), equation 8.14.

    As least squares, a block of rows after the other: the equation itself would square the condition of the bells.
    """
    size, lengths, noise = kernel
    count = len(centres)
    # The last column is the target.
    triangle = np.column_stack([np.sqrt(noise / size) * _near(centres / lengths), np.zeros(count)])
    for some, wanted in zip(_blocks(rows), _blocks(target), strict=True):
        below = np.column_stack([_bells(some / lengths, centres / lengths), wanted])
        reduced: Any = np.linalg.qr(np.vstack([triangle, below]), mode="r")  # annotated for all modes
        triangle = reduced[:count]
    return solve_triangular(triangle[:, :count], triangle[:, count])


def _near(centres: Array) -> Array:
    """The upper triangle (centres, centres) whose square is the kernel of centres in units of their lengths."""
    return cholesky(_bells(centres, centres) + _NUGGET * np.eye(len(centres)))


def _bells(rows: Array, centres: Array) -> Array:
    """The kernel (rows, centres) of inputs in units of their lengths."""
    bells = np.exp(-0.5 * cdist(rows, centres, "sqeuclidean"))
    bells[bells < _FAINT] = 0.0
    return bells


def _blocks(rows: Array) -> list[Array]:
    return [rows[k : k + _ROWS] for k in range(0, len(rows), _ROWS)]


_RATE, _DEPTH = 0.15, 6
"""Share of each tree that counts, and its depth. With 0.1 and no limit, as scikit-learn has them, and 100 trees the
errors on Gazebo's tuning runs are the same, and an answer takes five times as long."""
_SAME = 1e-3
"""By how much the arrays may say something else than the learner, in units of the output: inputs in single precision
fall on the other side of a threshold now and then."""
_ALIKE = 0.99
"""Share of the rows of which that must hold."""


def grow_trees(network: Trees, table: Table, seed: int, epochs: int) -> float:
    """Grow the trees of each axis by scikit-learn's HistGradientBoostingRegressor, see `tabular_fit.fit_tabular`."""
    del epochs
    rows, wanted = table.rows.astype(np.float32), table.wanted
    learners = [_learner(network.options, seed).fit(rows, column) for column in wanted.T]
    try:
        nodes = _nodes(learners, network.feature.shape)
        network.plant(nodes, np.array([learner._baseline_prediction.item() for learner in learners]))
    except (AttributeError, KeyError, IndexError, ValueError, RuntimeError) as error:
        raise RequestError(
            f"trees: this scikit-learn keeps its trees in another form ({error}); train another network"
        ) from error
    told = np.column_stack([learner.predict(rows) for learner in learners])
    ours = _predicted(network, rows)
    if (np.abs(ours - told).max(axis=1) <= _SAME).mean() < _ALIKE:
        raise RequestError(
            "trees: this version of scikit-learn means something else by its trees; train another network"
        )
    return float(((ours - wanted) ** 2).mean())


def _learner(options: dict[str, int | float], seed: int) -> Any:
    try:
        from sklearn.ensemble import HistGradientBoostingRegressor
    except ImportError as error:
        raise RequestError(f"trees need scikit-learn ({error}): {how_to_install('neural')}") from None
    made: Any = HistGradientBoostingRegressor  # its annotations are guessed from its defaults
    return made(
        learning_rate=_RATE,
        max_depth=_DEPTH,
        max_iter=int(options["units"]),
        max_leaf_nodes=int(options["leaves"]),
        early_stopping=False,
        random_state=seed,
    )


def _nodes(learners: list[Any], shape: tuple[int, ...]) -> Nodes:
    """The trees of all learners; those with fewer nodes are filled up with leaves that nothing reaches."""
    here = np.broadcast_to(np.arange(shape[-1]), shape)
    result = Nodes(np.zeros(shape, int), np.zeros(shape), here.copy(), here.copy(), np.zeros(shape))
    for axis, learner in enumerate(learners):
        for k, (tree,) in enumerate(learner._predictors):
            nodes = tree.nodes
            inner, size = nodes["is_leaf"] == 0, nodes.shape[0]
            where = (axis, k, np.flatnonzero(inner))
            result.feature[where] = nodes["feature_idx"][inner]
            result.threshold[where] = nodes["num_threshold"][inner]
            result.left[where], result.right[where] = nodes["left"][inner], nodes["right"][inner]
            result.value[axis, k, :size] = np.where(inner, 0.0, nodes["value"])
    return result


_PENALTIES = 10.0 ** np.arange(-6, 3)
"""Penalties of a group that are tried, as shares of the mean square of a product: from none to nothing left of it."""
_BEGUN, _PLAIN = 1e-3, 1e-5
"""Penalties at which the search for them begins: of a group, and of the first, the linear terms."""
_SWEEPS = 2
"""Times that each group is asked for its penalty."""
_WORTH = 1e-3
"""Share of the unseen error by which another penalty has to be better, lest chance choose."""


@single_threaded
def fit_ridge(network: Ridge, table: Table, seed: int, epochs: int) -> float:
    """Fit the coefficients of each axis, see `tabular_fit.fit_tabular`.

    Inputs are held within their ranges in training: on a noisy log, products a tenth beyond them turned a correction
    that helps over 2 s into one that harms over 10 s.
    """
    del seed, epochs
    inputs = torch.as_tensor(network.scaling.inputs.undo(table.rows))
    states = inputs[:, : network.states]
    known = {"lower": states.amin(dim=0), "upper": states.amax(dim=0), "share": network.shares(table.time_step)}
    with torch.no_grad():
        for name, values in known.items():
            network.get_parameter(name).copy_(values)
        seen = torch.cat([network.regressors(some[None], None)[0][0] for some in inputs.split(table.lengths)]).numpy()
    size = np.maximum(np.sqrt((seen**2).mean(axis=0)), 1e-12)
    moments = _Moments.of(seen / size, table.wanted)
    groups = np.repeat(np.arange(len(network.groups)), network.groups)
    weights = np.array([moments.fitted(axis, _penalties(moments, axis, groups)) / size for axis in range(3)])
    with torch.no_grad():
        network.head["weight"].copy_(torch.as_tensor(weights))
    return float(((seen @ weights.T - table.wanted) ** 2).mean())


def _penalties(moments: _Moments, axis: int, groups: np.ndarray) -> Array:
    """The penalty of each column (columns,), one for each group, asked one group after the other."""
    chosen = np.full(groups.max() + 1, _BEGUN)
    chosen[0] = _PLAIN
    least = moments.unseen(axis, chosen[groups])
    for group in np.tile(np.arange(chosen.size), _SWEEPS):
        for penalty in _PENALTIES:
            tried = chosen.copy()
            tried[group] = penalty
            error = moments.unseen(axis, tried[groups])
            if error < (1.0 - _WORTH) * least:
                chosen, least = tried, error
    return chosen[groups]


GROWING: dict[type[Network], Callable[[Any, Table, int, int], float]] = {
    GaussianProcess: fit_processes,
    SymmetricProcess: fit_processes,
    Ridge: fit_ridge,
    Trees: grow_trees,
}
"""How each network with `Network.grown` is grown from a table, a seed and epochs; gives the mean square of what is
left."""


def fit_tabular(network: Network, table: Table, seed: int, epochs: int) -> float:
    """Grow a network from all rows of a table, see `GROWING`.

    Parameters
    ----------
    table : what it is fitted to
    seed : of what is drawn
    epochs : that a network which is not grown would have: for fewer, less is drawn

    Returns
    -------
    float
        mean square of what is left of the target

    Raises
    ------
    RequestError
        when scikit-learn is missing, or is a version whose learner cannot be kept as arrays.
    """
    return GROWING[type(network)](network, table, seed, epochs)
