"""The gain of a correction, 0 to 1 on each axis, falling smoothly with the distance from the training data.

g is the weight of Wolpert's (1992) stacking, from networks of the same kind tried on parts of the log that they do not
know, with columns that fade within several reaches l_j, under the limits of Yao et al. (2018); see `stacked`. What the
farthest distance tried does not take fades within `ENDS` times that distance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple, final

import numpy as np
import torch
from torch import Tensor, nn

from ...physics.motion import Array

NARROW = 0.5
"""The least of the reaches, each twice the one before [deviations]: closer, and rounding of a log is a distance."""
_TRIED = 0.9
"""Quantile of the distances beyond training that counts as tried: single jumps of a command go farther."""
ENDS = 4.0
"""Times the last reach that was tried, within which the rest of a gain fades; `benchmarks/trust.py` tries others."""
_DRAWS = 100
"""Of whole stretches: their mean is then known to a tenth of its scatter."""
_SUM = 1e3
"""Weight of the sum of all weights in the least squares, in the largest column: it is then one to a millionth."""
_ROUNDING = 1e-5
"""Deviations that training may be left by, so that rounding in single precision fades nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class Trust:
    """Trust region of a training, and the gain of its correction by the distance from there.

    The distance is that from a polytope: the root of the squared excess over the least and the most that each input,
    and each sum and difference of two, had in training. A box alone would call full ahead at full astern thrust known
    to a boat that met the two apart.

    Attributes
    ----------
    lower, upper : (directions,) ends of the training along each of `directions`, the inputs first [deviations]
    reaches : (reaches,) distances at which nothing is left of each share [deviations], the least first
    weights : (3, reaches + 1) the shares, the last one that which does not fade
    error : (3, reaches + 1) standard errors of the gain at distance 0 and at each reach
    """

    lower: Array
    upper: Array
    reaches: Array
    weights: Array
    error: Array

    @classmethod
    def within(cls, seen: Array, reach: float | None = None) -> "Trust":
        """Trust region of a training on standardised inputs (rows, inputs): whole within, and to a reach or anywhere.

        Parameters
        ----------
        reach : at which nothing is left [deviations]; None for a gain of 1 everywhere
        """
        along = seen @ directions(seen.shape[-1]).T
        shares = np.tile([1.0, 0.0] if reach else [0.0, 1.0], (3, 1))
        ends = along.min(axis=0) - _ROUNDING, along.max(axis=0) + _ROUNDING
        return cls(*ends, np.array([reach or NARROW]), shares, np.zeros(shares.shape))

    def gain(self, distance: Array) -> Array:
        """The gain (..., 3) at distances (...)."""
        return _faded(distance, self.reaches) @ self.weights.T


def _faded(distance: Array, reaches: Array) -> Array:
    """What is left (..., reaches + 1) of what fades within each reach, and of what does not, at distances (...)."""
    far = np.append(reaches, np.inf)
    return np.maximum(1.0 - (np.asarray(distance)[..., None] / far) ** 2, 0.0) ** 2


def directions(size: int) -> Array:
    """Unit vectors along each axis, and the sum and difference of each two, (size + size (size - 1), size)."""
    axes = np.eye(size)
    pairs = [axes[i] + sign * axes[j] for i, j in combinations(range(size), 2) for sign in (1.0, -1.0)]
    return np.concatenate([axes, np.sqrt(0.5) * np.array(pairs).reshape(-1, size)])


class HeldOutTrial(NamedTuple):
    """A correction on rows that it was not trained on, one after the other in time.

    Attributes
    ----------
    lacking : (rows, 3) what the vehicle lacks [m/s^2, m/s^2, rad/s^2]
    predicted : (rows, 3) the correction
    distance : (rows,) from what it was trained on [deviations]
    stretch : their log, and which of its stretches they are: what happens in one tells of itself alone
    """

    lacking: Array
    predicted: Array
    distance: Array
    stretch: tuple[str, int]


def stacked(
    tried: Sequence[HeldOutTrial], rows: int, *, common: bool = False, seed: int = 0
) -> tuple[Array, Array, Array]:
    """Reaches, weights and standard errors of a `Trust`, by what was tried.

    With c the correction at a distance d from training,

        g(d) = sum_j w_j (1 - (d / l_j)^2)^2 for d < l_j,   w >= 0,   sum w <= 1,

    by least squares of what the vehicle lacks, both integrated over some seconds, since rollouts add up what is slow
    and forget what is quick. Draws of whole stretches give the spread (Rubin 1981), and the gain is their mean, as of
    bagged predictors (Breiman 1996).

    The last reach lies beyond all that was tried: its weight is fitted as if it did not fade.

    Parameters
    ----------
    rows : over which corrections are added up
    common : one gain for all axes, for a correction that keeps laws by its form: they do not hold of a part of a force

    Returns
    -------
    (reaches, weights, error)
        as `Trust` has them; one narrow reach where nothing was tried beyond it, and no weight where nothing at all was
    """
    distances = np.concatenate([one.distance for one in tried]) if tried else np.zeros(0)
    beyond = distances[distances > 0.0]
    far = float(np.quantile(beyond, _TRIED)) if beyond.size else 0.0
    count = 1 + max(0, int(np.floor(np.log2(max(far, NARROW) / NARROW))))
    reaches = np.array([NARROW * 2.0**k for k in range(count)])
    count += far > NARROW  # what does not fade is one of them only where that was tried
    none = np.zeros((3, reaches.size + 1))
    stretches = {stretch: k for k, stretch in enumerate(dict.fromkeys(one.stretch for one in tried))}
    grams = np.zeros((len(stretches), 3, count + 1, count + 1))
    for one in tried:
        columns = np.concatenate(
            [_faded(one.distance, reaches)[:, None, :count] * one.predicted[:, :, None], one.lacking[:, :, None]],
            axis=2,
        )
        starts = np.arange(0, len(columns) - rows + 1, rows)
        added = np.add.reduceat(columns[: len(starts) * rows], starts) if starts.size else columns[:0]
        grams[stretches[one.stretch]] += np.einsum("nai,naj->aij", added, added)
    if not grams.any():
        return reaches, none, none
    unit = np.maximum(grams.sum(axis=0)[:, -1, -1], 1e-300)
    grams /= unit[:, None, None]
    if common:
        grams[:] = grams.sum(axis=1, keepdims=True)
    rng = np.random.default_rng(seed)
    draws = rng.dirichlet(np.ones(len(grams)), _DRAWS) * len(grams)
    found = np.zeros((_DRAWS, 3, reaches.size + 1))
    found[..., :count] = [[_weights(gram) for gram in np.tensordot(draw, grams, 1)] for draw in draws]
    if count > reaches.size:
        reaches = np.append(reaches, ENDS * reaches[-1])
        found = np.append(found, np.zeros((_DRAWS, 3, 1)), axis=-1)
    at = np.append(0.0, reaches)
    return reaches, found.mean(axis=0), (found @ _faded(at, reaches).T).std(axis=0)


def _weights(gram: Array) -> Array:
    """Weights (reaches,) of least squares, not negative and at most one in sum, from (reaches + 1, reaches + 1)."""
    from scipy.optimize import nnls

    values, vectors = np.linalg.eigh(gram)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    size = _SUM * max(float(np.abs(root).max()), 1e-300)
    count = len(gram) - 1
    above = np.column_stack([root[:, :count], np.zeros(len(root))])
    return nnls(np.vstack([above, np.full(count + 1, size)]), np.append(root[:, count], size))[0][:count]


@final
class Gain(nn.Module):
    """The gain of a `Trust` as a network applies it; its constants do not stand among the weights.

    Parameters
    ----------
    trust : in deviations of the inputs
    inputs : how many of the network's inputs, from the first, are known: velocities and thrusts
    """

    rows: Tensor
    ends: Tensor
    steep: Tensor
    weights: Tensor

    def __init__(self, trust: Trust, inputs: int) -> None:
        super().__init__()
        self.trust, self.inputs = trust, inputs
        along = directions(inputs)
        constants = {
            "rows": np.concatenate([along, -along]),
            "ends": np.concatenate([trust.upper, -trust.lower]),
            "steep": np.append(trust.reaches**-2.0, 0.0),
            "weights": trust.weights,
        }
        for label, values in constants.items():
            self.register_buffer(label, torch.as_tensor(values, dtype=torch.float32), persistent=False)

    def squared_distance(self, standardised: Tensor) -> Tensor:
        """Squared distance of inputs (..., inputs or more) beyond the training (...) [deviations squared]."""
        over = standardised[..., : self.inputs] @ self.rows.mT - self.ends
        return torch.relu(over).square().sum(dim=-1)

    def forward(self, standardised: Tensor) -> Tensor:
        """The gain (..., 3) at inputs (..., inputs or more)."""
        lost = self.squared_distance(standardised)[..., None] * self.steep
        return torch.relu(1.0 - lost).square() @ self.weights.mT
