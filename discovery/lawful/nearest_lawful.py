"""The lawful set of some parameters of a vehicle, and its point nearest to a guess.

The set is that of the refit (`laws_over.py`): limits, a proof of dissipation over an envelope, positive mass. It is
convex. A guess is clipped to its limits first; only in orthants where the proof then fails is a small conic programme
solved, with the slacks of the last proof tried first, so a lawful guess costs some eigenvalues.
"""

from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module

import numpy as np
from scipy.sparse import csc_matrix

from ...physics.laws.damping_power import Envelope, basis, control_matrices
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from ..search.gram import bounded_solve
from .laws_over import MARGIN, laws_over, least_margin

_HALVINGS = 40
"""Of the way back to the start, where a solver's answer is not lawful: to rounding."""
_CLOSE = (1e-12, 1e-10, 1e-9)
"""Gaps and feasibility at which the solver stops: a parameter is then known to a millionth of a plausible amount."""
_COLUMN, _ROW = np.tril_indices(3)
"""The upper triangle of a 3 x 3 matrix, column by column, as conic solvers take it."""
_WEIGHT = np.where(_ROW == _COLUMN, 1.0, np.sqrt(2.0))
"""Of its elements, so that lengths stay."""
_SOLVER = import_module("clarabel")
"""Compiled, and without types."""


class LawfulSet:
    """Values of parameters that are within their limits and make a lawful vehicle.

    Parameters
    ----------
    nominal : the vehicle whose other parameters stay; where it breaks a law, no more than it has is asked for
    units : plausible amounts by symbol, in the order of the values
    limits : lower and upper (p,), which hold the nominal values
    envelope : velocities relative to the water

    Raises
    ------
    RequestError
        when a solver fails on the nominal vehicle.
    """

    def __init__(
        self, nominal: Vehicle, units: Mapping[str, float], limits: tuple[Array, Array], envelope: Envelope
    ) -> None:
        self._unit = np.array(list(units.values()))
        self._start = np.array([nominal.value(symbol) for symbol in units]) / self._unit
        self._lower, self._upper = (limit / self._unit for limit in limits)
        laws = laws_over(envelope, nominal, nominal, units, least_margin(nominal))
        kept = replace(laws.numbers, allowance=laws.numbers.allowance - MARGIN * np.eye(3))
        self._laws = replace(laws, numbers=kept)
        self._damped = bool(kept.slope.any())
        self._slack = np.zeros((len(kept.power), basis(laws.degree).slack.shape[-1]))
        broken, _ = self._broken(self._start)
        if broken.any():
            self._solved(self._start, np.eye(self._start.size), broken)
            if self._broken(self._start)[0].any():  # the nominal vehicle breaks the law, or is about to
                self._laws = laws.allowing_nominal()

    def nearest(self, values: Array, information: Array) -> Array:
        """The lawful values with the least (x - values)^T information (x - values), (p,)."""
        guess = values / self._unit
        metric = information * np.outer(self._unit, self._unit)
        size = np.sqrt(np.diag(metric))
        inside = bool(((guess >= self._lower) & (guess <= self._upper)).all())
        found = guess
        if not inside:
            scaled = metric / np.outer(size, size)
            limits = self._lower * size, self._upper * size
            found = np.clip(bounded_solve(scaled, scaled @ (guess * size), *limits)[0] / size, self._lower, self._upper)
        used = np.zeros(len(self._slack), dtype=bool)
        for _ in range(len(self._slack) + 1):
            broken, heavy = self._broken(found)
            if not broken.any() and heavy:
                return values if inside and found is guess else found * self._unit
            if not (broken & ~used).any() and used.any():
                break
            used |= broken
            found = self._solved(guess, metric, used)
        return self._between(found) * self._unit

    def _broken(self, x: Array) -> tuple[np.ndarray, bool]:
        """In which orthants the last exchanges prove nothing of x, (orthants,), and whether its mass is positive."""
        law = self._laws.numbers
        broken = np.zeros(len(self._slack), dtype=bool)
        if self._damped:
            matrices = control_matrices(law.power + law.slope @ x, self._slack, self._laws.degree) + law.allowance
            # The margin is the solver's to miss; what is not above zero is broken.
            least = np.linalg.eigvalsh(matrices)[..., 0].min(axis=1)
            broken = least < -0.5 * MARGIN
        heavy = not self._laws.mass or np.linalg.eigvalsh(law.mass + np.tensordot(x, law.mass_slope, 1))[0] >= -1e-9
        return broken, bool(heavy)

    def _solved(self, guess: Array, metric: Array, used: np.ndarray) -> Array:
        """The nearest x that keeps the laws in the used orthants, whose exchanges are kept; the start where none."""
        law, b, p = self._laws.numbers, basis(self._laws.degree), guess.size
        orthants = np.flatnonzero(used)
        slacks = self._slack.shape[1]
        size = p + orthants.size * slacks
        rows, ends, cones = [], [], []
        for sign, limit in ((-1.0, self._lower), (1.0, self._upper)):
            known = np.flatnonzero(np.isfinite(limit))
            if known.size:
                part = np.zeros((known.size, size))
                part[np.arange(known.size), known] = sign
                rows.append(part)
                ends.append(sign * limit[known])
                cones.append(_SOLVER.NonnegativeConeT(known.size))
        for k, orthant in enumerate(orthants):
            at_zero = np.einsum("kijm,m->kij", b.lift, law.power[orthant]) + law.allowance[orthant]
            part = np.zeros((len(b.points), _WEIGHT.size, size))
            moved = np.einsum("kijm,mp->kijp", b.lift, law.slope[orthant])
            part[:, :, :p] = -_packed(np.moveaxis(moved, -1, 1)).swapaxes(1, 2)
            part[:, :, p + k * slacks : p + (k + 1) * slacks] = -_packed(np.moveaxis(b.slack, -1, 1)).swapaxes(1, 2)
            rows.append(part.reshape(-1, size))
            ends.append(_packed(at_zero).ravel())
            cones += [_SOLVER.PSDTriangleConeT(3)] * len(b.points)
        if self._laws.mass:
            part = np.zeros((_WEIGHT.size, size))
            part[:, :p] = -_packed(law.mass_slope).T
            rows.append(part)
            ends.append(_packed(law.mass))
            cones.append(_SOLVER.PSDTriangleConeT(3))
        scale = np.trace(metric)
        quadratic = np.zeros((size, size))
        quadratic[:p, :p] = np.triu(metric) / scale
        linear = np.zeros(size)
        linear[:p] = -metric @ guess / scale
        settings = _SOLVER.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = _CLOSE
        problem = csc_matrix(quadratic), linear, csc_matrix(np.concatenate(rows)), np.concatenate(ends)
        answer = _SOLVER.DefaultSolver(*problem, cones, settings).solve()
        if answer.status not in (_SOLVER.SolverStatus.Solved, _SOLVER.SolverStatus.AlmostSolved):
            return self._start
        z = np.array(answer.x)
        self._slack[orthants] = z[p:].reshape(orthants.size, slacks)
        return np.clip(z[:p], self._lower, self._upper)

    def _between(self, x: Array) -> Array:
        """The last lawful point on the way from the start to x: for a solver's answer that breaks a law by rounding."""
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            broken, heavy = self._broken(self._start + middle * (x - self._start))
            low, high = (middle, high) if heavy and not broken.any() else (low, middle)
        return self._start + low * (x - self._start)


def _packed(matrices: Array) -> Array:
    """Symmetric matrices (..., 3, 3) as weighed triangles (..., 6)."""
    return matrices[..., _ROW, _COLUMN] * _WEIGHT
