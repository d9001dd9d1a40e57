"""Scores from Gram matrices: the rows of a block compressed, so that a model is scored in microseconds.

The rows of [columns, balance] of a block become one Gram matrix an axis; least squares, blocked cross-validation and
the block bootstrap then need only matrices of the size of the model.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...physics.motion import Array
from ..candidates.linearisation import Option

RIDGE = 1e-9
"""Added to the diagonal of normal matrices, in units of a column's square: columns that are one can be solved, and none
that differ by more than rounding is moved."""
TOGETHER = 32
"""Choices that are fitted together: their matrices stay in the cache of any core, a megabyte of a model of nine."""
_MOST_NOISE = 0.5
"""Share of the square of any combination of columns that clearing may take off: it regularises the cleared
equations."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted choice of options.

    Attributes
    ----------
    columns : (p,) indices of free columns
    change : (p,) change of each parameter from its option's start
    held : (p,) True where a physical limit holds the parameter
    held_out_blocks : (blocks, 3) summed squared force error of each block under the fit to the others, less what
        sensor noise adds to it
    held_out : (3,) mean square force error on held-out blocks [N^2, N^2, (N m)^2]
    in_sample : (3,) mean square force error of the full fit
    """

    columns: np.ndarray
    change: Array
    held: np.ndarray
    held_out_blocks: Array
    held_out: Array
    in_sample: Array


class _Laid(NamedTuple):
    """A choice of options, see `GramScores.layout`: of the columns its target is made of, some may be free as well."""

    columns: np.ndarray
    lower: Array
    upper: Array
    target: Array
    used: np.ndarray
    rest: np.ndarray

    @classmethod
    def of(cls, columns: np.ndarray, lower: Array, upper: Array, target: Array) -> "_Laid":
        """With the columns of its target, and those of them that are not free."""
        (used,) = target.nonzero()
        rest = np.setdiff1d(used, columns) if target[columns].any() else used
        return cls(columns, lower, upper, target, used, rest)


class GramScores:
    """Per-block Gram matrices of a linearisation, on each axis.

    Held-out errors are cleared of sensor noise: a model's coefficients decide how much of the noise on the velocities
    reaches the balance, so an effect could seem to help by letting less of it through. What the noise adds is known
    from noisier copies of the log, and counts as for the model at hand (errors-in-variables; Carroll et al. 2006,
    chapter 5). Normal equations are cleared likewise, or noise on a column would pull its coefficient towards zero
    (ibid., eq. 3.8), and noise in a modulus would pass for another drag.

    Parameters
    ----------
    columns : (tests, 3, p + 1), the last the balance
    noise : (copies, tests, 3, p + 1) what sensor noise adds to them; no copies for a log without noise
    block : (tests,) block index, not decreasing
    weight : (3,) weight of a squared force error on each axis
    """

    def __init__(self, columns: Array, noise: Array, block: np.ndarray, weight: Array) -> None:
        self.size = columns.shape[2] - 1
        self.tests = columns.shape[0]
        self.blocks = int(block.max()) + 1
        self.weight = weight
        edges = np.searchsorted(block, np.arange(self.blocks + 1))
        gram = _grams(columns, edges)
        scale = np.sqrt(weight @ np.diagonal(gram.sum(axis=0), axis1=1, axis2=2) / self.tests)
        self.scale = np.where(scale > 0, scale, 1.0)
        self.scale[-1] = 1.0
        unit = 1.0 / (self.scale[:, None] * self.scale)
        self.gram = gram * unit
        self.noise = added_by_noise(columns, noise, edges, gram) * unit
        self._sum_up()

    def drawn(self, counts: np.ndarray) -> "GramScores":
        """The same scores with each block counted so many times, (blocks,), as a block bootstrap draws them."""
        other = copy(self)
        other.gram = self.gram * counts[:, None, None, None]
        other.noise = self.noise * counts[:, None, None, None]
        other._sum_up()
        return other

    def seeing(self, seen: np.ndarray, columns: Array, noise: Array, block: np.ndarray) -> "GramScores":
        """The same scores from some tests alone, in the same units; blocks of which none is seen stay, and are empty.

        Where none is seen at all, nothing speaks for any option.

        Parameters
        ----------
        seen : (tests,) which tests
        columns, noise, block : as they were given for all of them
        """
        other = copy(self)
        other.tests = max(int(seen.sum()), 1)  # so that of none, every mean is nothing
        other.gram, unit = self.gram.copy(), 1.0 / (self.scale[:, None] * self.scale)
        other.noise = self.noise.copy()
        for k in np.unique(block[~seen]):
            rows = np.flatnonzero(seen & (block == k))
            edges = np.array([0, rows.size])
            gram = _grams(columns[rows], edges)
            other.gram[k] = gram[0] * unit
            other.noise[k] = added_by_noise(columns[rows], noise[:, rows], edges, gram)[0] * unit
        other._sum_up()
        return other

    def _sum_up(self) -> None:
        self._weighted = np.tensordot(self.gram, self.weight, axes=(1, 0))
        self._total = self._weighted.sum(axis=0)
        self._blur = np.tensordot(self.noise, self.weight, axes=(1, 0))
        self._blurred = self._blur.sum(axis=0)
        self._clear, self._sharp = self.gram - self.noise, self._weighted - self._blur
        self._sum = self.gram.sum(axis=0, keepdims=True)

    def fit(self, chosen: Sequence[Option]) -> Fit:
        """Bounded least squares on all blocks and, with the held parameters kept, on all blocks but one."""
        return self.fits([chosen])[0]

    def fits(self, choices: Sequence[Sequence[Option]], *, limited: bool = True) -> list[Fit]:
        """The fit of each of several choices: those of one size together, which takes a third of the time.

        Not limited, a fit has the errors of the unbounded one, which is a tenth of the work where many limits hold; its
        changes are cut at the limits, and those that are cut are its `held`.
        """
        laid = [_Laid.of(*self.layout(chosen)) for chosen in choices]
        alike: dict[tuple[int, ...], list[int]] = {}
        for n, one in enumerate(laid):
            alike.setdefault((one.columns.size, one.used.size, one.rest.size), []).append(n)
        found: dict[int, Fit] = {}
        for places in alike.values():
            for k in range(0, len(places), TOGETHER):
                some = places[k : k + TOGETHER]
                found |= zip(some, self._fitted([laid[n] for n in some], limited), strict=True)
        return [found[n] for n in range(len(laid))]

    def _fitted(self, laid: Sequence["_Laid"], limited: bool) -> list[Fit]:
        """The fits of choices of one size."""
        columns, lower, upper = (np.stack([one[k] for one in laid]) for k in range(3))
        every, right = self._cleared_each(columns, laid)
        size = columns.shape[1]
        h, total = every.sum(axis=0) + RIDGE * self.tests * np.eye(size), right.sum(axis=0)
        change = np.linalg.solve(h, total[..., None])[..., 0]
        beyond = (change < lower) | (change > upper)
        held = np.zeros(columns.shape, dtype=bool)
        bound = np.flatnonzero(beyond.any(axis=1)) if limited else np.zeros(0, dtype=int)
        for k in bound:
            change[k], held[k] = bounded_solve(h[k], total[k], lower[k], upper[k], change[k])
        left = h - every
        if bound.size:  # of what is held only the value stays in the equations
            right[:, bound] -= (every[:, bound] @ (change * held)[bound, :, None])[..., 0]
            left *= ~held[:, :, None] & ~held[:, None, :]
            left += held[:, :, None] * np.eye(size)
        pull = np.where(held, change, right.sum(axis=0) - right)
        without = np.linalg.solve(left, pull[..., None])[..., 0]
        held_out = self._errors(self._clear, laid, without)
        in_sample = self._errors(self._sum, laid, change[None])[:, 0]
        if not limited:
            change, held = np.clip(change, lower, upper), beyond
        return [
            Fit(
                one.columns,
                change[n] / self.scale[one.columns],
                held[n],
                held_out[n],
                held_out[n].sum(axis=0) / self.tests,
                in_sample[n] / self.tests,
            )
            for n, one in enumerate(laid)
        ]

    def _cleared_each(self, columns: np.ndarray, laid: Sequence["_Laid"]) -> tuple[Array, Array]:
        """`_cleared` of choices of one size, (blocks, n, p, p) and (blocks, n, p)."""
        used = np.array([one.used for one in laid])
        weights = np.array([one.target[one.used] for one in laid])[..., None]
        left, across, aim = columns[:, :, None], columns[:, None, :], used[:, None, :]
        share = shares_taken(self._total[left, across], self._blurred[left, across])[:, None, None]
        if (share == 1.0).all():
            return self._sharp[:, left, across], (self._sharp[:, left, aim] @ weights)[..., 0]
        every, aimed = (self._weighted[:, left, k] - share * self._blur[:, left, k] for k in (across, aim))
        return every, (aimed @ weights)[..., 0]

    def _cleared(self, columns: np.ndarray, target: Array) -> tuple[Array, Array]:
        """Normal equations of each block, (blocks, p, p) and (blocks, p), cleared of what sensor noise adds to them.

        Where noise is most of some combination of the columns, a smaller share of all of it is taken off, so that no
        combination loses more than half of its square; one hopeless column then leaves some noise in the others.
        """
        share = self.noise_taken(columns)
        rows = self._sharp if share == 1.0 else self._weighted - share * self._blur
        left, used = columns[:, None], np.flatnonzero(target)
        return rows[:, left, columns], rows[:, left, used] @ target[used]

    def noise_taken(self, columns: np.ndarray) -> float:
        """The share of what noise adds to some columns that is taken off."""
        return float(shares_taken(*(g[None, columns[:, None], columns] for g in (self._total, self._blurred)))[0])

    def screen(self, kept: Sequence[Option], others: Sequence[Option]) -> Array:
        """Drop of the weighted in-sample error by each of several options beside kept ones, (options,).

        One projection of the Gram matrix off the kept columns serves all; limits are honoured for single parameters.
        """
        columns, _, _, target = self.layout(kept)
        left = self._total[:, columns]
        inner = self._total[np.ix_(columns, columns)] + RIDGE * self.tests * np.eye(columns.size)
        projected = self._total - left @ np.linalg.solve(inner, left.T)
        pull = projected @ target
        gains = np.zeros(len(others))
        for n, option in enumerate(others):
            index = np.array([k for k in option.free if k >= 0], dtype=int)
            gain, h = 0.0, pull[index]
            if option.offset >= 0:
                size = self.scale[option.offset]
                gain = 2.0 * size * pull[option.offset] - size**2 * projected[option.offset, option.offset]
                h = h - size * projected[index, option.offset]
            if index.size == 1:
                k, limits = int(index[0]), zip(option.free, option.lower, option.upper, strict=True)
                (low, high) = next((a, b) for free, a, b in limits if free == k)
                curve = projected[k, k] + RIDGE * self.tests
                step = float(np.clip(h[0] / curve, low * self.scale[k], high * self.scale[k]))
                gain += 2.0 * step * h[0] - step**2 * projected[k, k]
            elif index.size:
                inside = projected[np.ix_(index, index)] + RIDGE * self.tests * np.eye(index.size)
                gain += float(h @ np.linalg.solve(inside, h))
            gains[n] = gain
        return gains

    def layout(self, chosen: Sequence[Option]) -> tuple[np.ndarray, Array, Array, Array]:
        """Free columns (p,), lower and upper limits (p,), and the target as a combination of all columns, scaled."""
        columns, lower, upper = [], [], []
        target: Array = np.zeros(self.size + 1)
        target[-1] = 1.0
        for option in chosen:
            if option.offset >= 0:
                target[option.offset] -= self.scale[option.offset]
            for index, low, high in zip(option.free, option.lower, option.upper, strict=True):
                if index >= 0:
                    columns.append(index)
                    lower.append(low * self.scale[index])
                    upper.append(high * self.scale[index])
        return np.array(columns, dtype=int), np.array(lower), np.array(upper), target

    def _errors(self, gram: Array, laid: Sequence["_Laid"], solutions: Array) -> Array:
        """Squared errors (n, blocks, 3) of each block under solutions of its own, (blocks, n, p)."""
        used = np.stack([np.concatenate([one.columns, one.rest]) for one in laid])
        own = np.stack([one.target[one.columns] for one in laid]) - solutions
        rest = np.stack([one.target[one.rest] for one in laid])
        part = np.concatenate([own, np.broadcast_to(rest, (solutions.shape[0], *rest.shape))], axis=2)
        inner = gram[:, :, used[:, :, None], used[:, None, :]]
        return np.asarray(np.einsum("banp,bnp->nba", (inner @ part[:, None, ..., None])[..., 0], part), dtype=float)

    def loss(self, chosen: Sequence[Option], values: Mapping[str, float]) -> float:
        """Weighted mean square force error of total values by symbol; the mean over axes is about 1 at the fit.

        What noise on the columns adds to it is left out, so that it is least at the cleared fit.
        """
        columns, _, _, target = self.layout(chosen)
        moved = [values[number.symbol] - number.start for option in chosen for number in option.numbers]
        change = np.array(moved) * self.scale[columns]
        left, right = (part.sum(axis=0) for part in self._cleared(columns, target))
        return float(target @ self._total @ target - 2.0 * right @ change + change @ left @ change) / (3 * self.tests)

    def block_normal(self, chosen: Sequence[Option]) -> tuple[np.ndarray, Array, Array]:
        """Normal equations of each block, cleared of noise: (columns, (blocks, p, p), (blocks, p)), unscaled."""
        columns, _, _, target = self.layout(chosen)
        s = self.scale[columns]
        left, right = self._cleared(columns, target)
        return columns, left * (s[:, None] * s[None, :]), right * s

    def standard_errors(self, chosen: Sequence[Option], independent: float) -> Array:
        """Standard errors (p,) of the free parameters by least squares, of errors that are independent on each axis.

        Parameters
        ----------
        independent : tests of all that count as independent
        """
        columns, *_ = self.layout(chosen)
        scale = self.scale[columns]
        inner = np.tensordot(self.weight, self.gram.sum(axis=0)[:, columns[:, None], columns], axes=1)
        inverse = np.linalg.inv(inner + RIDGE * self.tests * np.eye(columns.size))
        meat = self.meat(chosen, independent) / (scale[:, None] * scale)
        return np.asarray(np.sqrt(np.maximum(np.diag(inverse @ meat @ inverse), 0.0)) / scale)

    def meat(self, chosen: Sequence[Option], independent: float) -> Array:
        """Covariance (p, p) of the normal equations' right side, of errors that are independent on each axis.

        Parameters
        ----------
        chosen : options, whose numbers stand where they start
        independent : tests of all that count as independent
        """
        columns, _, _, target = self.layout(chosen)
        gram, scale = self.gram.sum(axis=0), self.scale[columns]
        error = np.einsum("i,aij,j->a", target, gram, target) / self.tests
        inner = gram[:, columns[:, None], columns] * (scale[:, None] * scale)
        return np.asarray(np.tensordot(self.weight**2 * error, inner, axes=1) * self.tests / independent)


def shares_taken(total: Array, blur: Array) -> Array:
    """The share of what noise adds to products of columns that may be taken off: no more than half of any.

    Parameters
    ----------
    total, blur : (models, p, p)
    """
    if not blur.any():
        return np.ones(len(total))
    try:  # most often no combination is half noise, which a factor shows at once
        np.linalg.cholesky(_MOST_NOISE * total - blur)
    except np.linalg.LinAlgError:
        square = np.diagonal(total, axis1=1, axis2=2)
        size = 1.0 / np.sqrt(np.where(square > 0.0, square, np.inf))
        unit = size[:, :, None] * size[:, None, :]
        level, vectors = np.linalg.eigh(total * unit)
        least = 1e-10 * np.maximum(level[:, -1:], 1.0)
        root = vectors / np.sqrt(np.maximum(level, least))[:, None, :]
        worst = np.linalg.eigvalsh(root.swapaxes(1, 2) @ (blur * unit) @ root)[:, -1]
        return np.asarray(np.minimum(1.0, _MOST_NOISE / np.maximum(worst, 1e-300)))
    return np.ones(len(total))


def added_by_noise(columns: Array, noise: Array, edges: np.ndarray, gram: Array | None = None) -> Array:
    """Addition of sensor noise to the Gram matrices of columns, (blocks, a, p, p): those of noisier copies have more.

    Nothing of a log without noise, which has no copies. That counts where copies come in pairs of opposite noise; one
    alone tells the squares of its noise, and by chance what it has in common with the columns.

    Parameters
    ----------
    columns : (tests, a, p)
    noise : (copies, tests, a, p) what each copy has more
    edges : (blocks + 1,) first row of each block, and the end
    gram : those of the columns, where they are at hand
    """
    copies, _, axes, size = noise.shape
    if copies == 0:
        return np.zeros((edges.size - 1, axes, size, size))
    if copies == 1:
        return _grams(noise[0], edges)
    every = sum((_grams(columns + part, edges) for part in noise), np.zeros(()))
    return every / copies - (_grams(columns, edges) if gram is None else gram)


def _grams(columns: Array, edges: np.ndarray) -> Array:
    """Gram matrix of each block's rows on each axis, (blocks, a, p, p), from columns (tests, a, p)."""
    ordered = np.ascontiguousarray(columns.transpose(1, 2, 0))  # no copy where they were laid out so
    gram = np.zeros((edges.size - 1, ordered.shape[0], columns.shape[2], columns.shape[2]))
    for k, (start, stop) in enumerate(pairwise(edges)):
        rows = ordered[:, :, start:stop]
        np.matmul(rows, rows.swapaxes(1, 2), out=gram[k])
    return gram


def bounded_solve(
    h: Array, right: Array, lower: Array, upper: Array, start: Array | None = None
) -> tuple[Array, np.ndarray]:
    """Minimise x^T h x / 2 - right^T x within limits, by holding violators at their limit; small and fast.

    Returns the solution and a mask of the held entries. A held entry whose gradient points inwards is released again.

    Parameters
    ----------
    h : positive definite (p, p)
    right : (p,)
    lower, upper : limits (p,), infinite where there is none
    start : the solution without limits (p,), where it is at hand
    """
    size = right.size
    x = np.array(np.linalg.solve(h, right) if start is None else start, dtype=float)
    held = np.zeros(size, dtype=bool)
    if not ((x < lower) | (x > upper)).any():
        return x, held
    curve = np.sqrt(np.diag(h))
    for rounds in range(3 * size + 1):
        free = ~held
        if rounds and free.any():
            x[free] = np.linalg.solve(h[np.ix_(free, free)], right[free] - h[np.ix_(free, held)] @ x[held])
        below, above = x < lower, x > upper
        broken = free & (below | above)
        if broken.any():
            past = np.where(below, lower, upper)
            excess = np.where(broken, np.abs(np.where(broken, past, x) - x) * curve, 0.0)
            worst = int(np.argmax(excess))
            x[worst] = lower[worst] if below[worst] else upper[worst]
            held[worst] = True
            continue
        gradient = h @ x - right
        inward = held & (((x <= lower) & (gradient < 0)) | ((x >= upper) & (gradient > 0))) & (lower < upper)
        if not inward.any():
            break
        held[int(np.argmax(np.abs(gradient) * inward))] = False
    return x, held
