"""Fitting Gaussian processes to the rows of a training part: scikit-learn finds the kernel, all rows the weights.

Kernels and their noise come from the marginal likelihood of samples of rows, drawn one after the other (Rasmussen and
Williams 2006, section 5.4.1). The weights come from all rows, by the subset of regressors (section 8.3.1, equation
8.14), whose centres are the first rows of the same draw. That kernel is kept under which all rows are likeliest: a
sample misses rare turns. Where all rows are centres that is the whole Gaussian process.
"""

import warnings
from typing import Any

import numpy as np
import torch
from scipy.linalg import cholesky, solve_triangular
from scipy.spatial.distance import cdist

from ...measurements.statistics.single_threaded import single_threaded
from ...physics.errors import RequestError
from ...physics.extras import how_to_install
from ...physics.frames import Array
from ..networks.gaussian_process import GaussianProcess

_SAMPLE = 400
"""Rows that a kernel is found on: time grows by the cube, and three kernels of three axes take some ten seconds so."""
_SAMPLES = 3
"""Samples that are drawn, as far as there are rows for them: each costs as much time again. See `docs/decisions.md`."""
_SIZE, _LENGTH, _NOISE = (1e-3, 1e2), (0.1, 1e2), (1e-4, 10.0)
"""Bounds of the variance, of lengths in deviations of the inputs, and of the variance of the noise, for a target of
about 1: less noise than a hundredth would only make weights large, and an input of the greatest length says nothing."""
_NUGGET = 1e-4
"""What is added to the variance of a centre, as a share. Weights of bells side by side are then small enough for single
precision; on simulated worlds errors with 1e-6 and 1e-3 are the same within 2 %."""
_ROWS = 2048
"""Rows whose bells are held in memory at once."""


@single_threaded
def fit_processes(network: GaussianProcess, table: tuple[Array, Array], seed: int) -> float:
    """Fit the Gaussian process of each axis; an axis whose target is zero throughout gets none. See `growing.grow`."""
    rows, wanted = table[0].astype(np.float32).astype(float), table[1]
    order = np.random.default_rng(seed).permutation(rows.shape[0])
    starts = range(0, max(len(order) - _SAMPLE, 0) + 1, _SAMPLE)[:_SAMPLES]
    samples = [order[first : first + _SAMPLE] for first in starts]
    centres = rows[order[: network.centres.shape[0]]]
    sharpness, weights = np.zeros(network.sharpness.shape), np.zeros((3, network.centres.shape[0]))
    for axis, target in enumerate(wanted.T):
        if target.any():
            kernels = [_kernel(rows[sample], target[sample]) for sample in samples]
            fitted = [_fitted(rows, target, centres, kernel) for kernel in kernels]
            best = int(np.argmax([likely for _, likely in fitted]))
            sharpness[axis], weights[axis, : len(centres)] = 1.0 / kernels[best][1], fitted[best][0]
    with torch.no_grad():
        network.centres[: len(centres)] = torch.as_tensor(centres).to(network.centres)
        network.sharpness.copy_(torch.as_tensor(sharpness))
        network.head.get_parameter("weight").copy_(torch.as_tensor(weights))
        left = []
        for asked, target in zip(_blocks(rows), _blocks(wanted), strict=True):
            seen = torch.as_tensor(asked).to(network.centres)
            left.append(network.correct(seen, seen, None)[0].double().cpu().numpy() - target)
    return float((np.concatenate(left) ** 2).mean())


def _kernel(rows: Array, target: Array) -> tuple[float, Array, float]:
    """Variance, lengths (inputs,) and variance of the noise by the marginal likelihood of rows."""
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


def _fitted(rows: Array, target: Array, centres: Array, kernel: tuple[float, Array, float]) -> tuple[Array, float]:
    """Weights of the centres (centres,), equation 8.14, and the log likelihood of the target under a kernel.

    As least squares, a block of rows after the other: the equation itself would square the condition of the bells. The
    likelihood (equation 5.8, with the covariance that the centres make of the kernel) needs no more than the same
    triangle; its constant is left out.
    """
    size, lengths, noise = kernel
    count, share = len(centres), noise / size
    near = cholesky(_bells(centres / lengths, centres / lengths) + _NUGGET * np.eye(count))
    triangle = np.column_stack([np.sqrt(share) * near, np.zeros(count)])  # the last column is the target
    for some, wanted in zip(_blocks(rows), _blocks(target), strict=True):
        below = np.column_stack([_bells(some / lengths, centres / lengths), wanted])
        reduced: Any = np.linalg.qr(np.vstack([triangle, below]), mode="r")  # annotated for all modes
        triangle = reduced  # its last row is what the bells leave of the target
    sides = np.log(np.abs(np.diag(triangle)[:count])).sum() - np.log(np.diag(near)).sum() - 0.5 * count * np.log(share)
    left = triangle[count:, count] @ triangle[count:, count]
    weights = solve_triangular(triangle[:count, :count], triangle[:count, count])
    return weights, float(-sides - 0.5 * (len(target) * np.log(noise) + left / noise))


def _bells(rows: Array, centres: Array) -> Array:
    """The kernel (rows, centres) of inputs in units of their lengths."""
    return np.exp(-0.5 * cdist(rows, centres, "sqeuclidean"))


def _blocks(rows: Array) -> list[Array]:
    return [rows[k : k + _ROWS] for k in range(0, len(rows), _ROWS)]
