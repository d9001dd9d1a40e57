"""A pysindy optimizer whose models keep the laws: sparse forces that take energy out over a whole envelope."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from pysindy.optimizers import BaseOptimizer

from ...physics.effects import PARAMETERS
from ...physics.errors import RequestError
from ...physics.frames import Array
from ...physics.laws.certificate import Exponents, basis, control_matrices, degree_of, power_of
from ...physics.laws.damping_power import Envelope
from ...physics.terms import Form, canonical, monomials, parse_form
from .programme import NO_OPTIMUM, LawNumbers, Shape, solve_refit

_TOLERANCE = 1e-6
_MARGIN = 1e-6 * np.eye(3)
_UPPER = {
    (p.axis, canonical(parse_form(p.form).factors)): p.upper
    for p in PARAMETERS.values()
    if p.axis is not None and np.isfinite(p.upper)
}

Place = tuple[int, int]


class LawfulOptimizer(BaseOptimizer):
    """Sequentially thresholded least squares under sign limits and dissipation over an envelope.

    For `pysindy.SINDy` with a `TermLibrary` and forces as targets: give u, v, r [m/s, m/s, rad/s] as the states, and
    as `x_dot` the damping force [N, N, N m] on surge, sway, yaw: inertia and Coriolis force as measured, less thrust.
    Each axis counts by its own size. Terms below the threshold are dropped and the rest is solved again (STLSQ;
    Brunton, Proctor and Kutz 2016), at last under the laws. `normalize_columns` and `unbias` of pysindy are off and
    cannot be chosen: both change the coefficients after the solve, and so break its constraints.

    Parameters
    ----------
    envelope : velocities for which nu^T F <= 0 is guaranteed
    threshold : a term smaller than this share of its axis' force, root mean square over the samples, is dropped
    signs : hold the drag terms of the catalogue (X_u, X_uu, Y_v ...) to their sign
    max_iter : most rounds of thresholding
    initial_guess, copy_X : as in pysindy

    Attributes
    ----------
    coef_ : (3, features)
    price_ : relative rise of the squared error that the law of dissipation costs

    Raises
    ------
    RequestError
        in `fit`, for other features or targets, or when the solver does not report an optimum.
    """

    def __init__(
        self,
        envelope: Envelope,
        threshold: float = 0.02,
        signs: bool = True,
        max_iter: int = 20,
        initial_guess: Array | None = None,
        copy_X: bool = True,
    ) -> None:
        super().__init__(
            max_iter=max_iter, normalize_columns=False, initial_guess=initial_guess, copy_X=copy_X, unbias=False
        )
        self.envelope, self.threshold, self.signs = envelope, threshold, signs

    def _reduce(self, x: Array, y: Array) -> None:
        """Solve, threshold, solve again; sets `coef_` (3, features)."""
        forms = _forms(x.shape[1])
        if y.shape[1] != 3:
            raise RequestError(f"lawful optimizer: expected forces on surge, sway and yaw, got {y.shape[1]} targets")
        size = np.maximum(np.sqrt((y**2).mean(axis=0)), 1e-300)
        weight = np.sqrt((x**2).mean(axis=0))
        support = [(axis, k) for axis in range(3) for k in range(len(forms)) if weight[k] > 0.0]
        free_loss = loss = 0.0
        for lawful in (False, True):
            for _ in range(self.max_iter):
                if not support:
                    break
                values, loss = self._solve(x, y / size, forms, support, size, lawful)
                share = [abs(c) * weight[k] / size[axis] for (axis, k), c in zip(support, values, strict=True)]
                kept = [place for place, s in zip(support, share, strict=True) if s >= self.threshold]
                coefficients: Any = np.zeros((3, len(forms)))  # pysindy's own types are narrower than its arrays
                for (axis, k), value in zip(support, values, strict=True):
                    coefficients[axis, k] = value
                self.coef_ = coefficients
                self.history_.append(coefficients)
                if len(kept) == len(support):
                    break
                support = kept
            if not lawful:
                free_loss = loss
        if not support:
            nothing: Any = np.zeros((3, len(forms)))
            self.coef_ = nothing
        self.price_ = max(0.0, loss / max(free_loss, 1e-300) - 1.0)

    def _solve(
        self, x: Array, y: Array, forms: tuple[Form, ...], support: list[Place], size: Array, lawful: bool
    ) -> tuple[Array, float]:
        """Coefficients of the support, and the squared error in units of each axis' force."""
        parts, target, loss = [], [], 0.0
        for axis in range(3):
            columns = x[:, [k for a, k in support if a == axis]]
            scale = np.sqrt((columns**2).sum(axis=0))
            q, r = np.linalg.qr(columns / scale)
            parts.append((np.pad(r, ((0, r.shape[1] - r.shape[0]), (0, 0))), scale))
            seen = q.T @ y[:, axis]
            target.append(np.pad(seen, (0, r.shape[1] - r.shape[0])))
            loss += float(y[:, axis] @ y[:, axis] - seen @ seen)
        edges = np.cumsum([0, *(scale.size for _, scale in parts)])
        factor = np.zeros((edges[-1], edges[-1]))
        for (r, _), (start, stop) in zip(parts, pairwise(edges), strict=True):
            factor[start:stop, start:stop] = r
        goal = np.concatenate(target)
        length = float(np.linalg.norm(goal)) or 1.0
        unit = length * np.concatenate([size[axis] / scale for axis, (_, scale) in enumerate(parts)])
        upper = np.array([_UPPER.get((axis, forms[k].text), np.inf) if self.signs else np.inf for axis, k in support])
        limits = (np.full(upper.size, -np.inf), upper)
        shape = Shape((False,) * upper.size, tuple(np.isfinite(upper).tolist()))
        law = None
        if lawful:
            degree = degree_of([(axis, forms[k]) for axis, k in support])
            law = _law(forms, support, unit, self.envelope, degree)
            shape = Shape(shape.below, shape.above, len(self.envelope.orthants), degree)
        solution = None
        if law is not None:  # with a margin, where every axis has damping
            solution = solve_refit(
                shape, factor, goal / length, limits, replace(law, allowance=law.allowance - _MARGIN)
            )
        solution = solution or solve_refit(shape, factor, goal / length, limits, law)
        if solution is None:
            raise RequestError(NO_OPTIMUM.format("infeasible"))
        found = np.minimum(solution.values, np.where(np.isfinite(upper), upper, np.inf))
        if law is not None:
            matrices = control_matrices(law.slope @ found, solution.slack, shape.degree)
            least = float(np.linalg.eigvalsh(matrices).min())
            if least < -_TOLERANCE:
                raise RequestError(f"lawful optimizer: the solution breaks dissipation by {-least:.2g} of its scale")
        error = factor @ found * length - goal
        return found * unit, loss + float(error @ error)


def _law(
    forms: tuple[Form, ...], support: list[Place], unit: Array, envelope: Envelope, degree: Exponents
) -> LawNumbers:
    """The numbers of the law for the coefficients of a support."""
    power = np.stack([power_of(axis, forms[k], envelope, degree) for axis, k in support], axis=-1) * unit
    scale = np.maximum(np.abs(power).max(axis=(1, 2), keepdims=True), 1e-12)
    orthants, size, _ = power.shape
    points = len(basis(degree).points)
    ease = np.zeros((orthants, points, 3, 3))
    return LawNumbers(np.zeros((orthants, size)), power / scale, ease, np.eye(3), np.zeros((0, 3, 3)))


def _forms(features: int) -> tuple[Form, ...]:
    """The monomials of the `TermLibrary` with so many features."""
    sizes = {}
    for degree in (1, 2, 3):
        found = monomials(degree)
        sizes[len(found)] = found
    if features not in sizes:
        raise RequestError(
            f"lawful optimizer: expected the features of a TermLibrary ({', '.join(map(str, sizes))}), got {features}"
        )
    return sizes[features]
