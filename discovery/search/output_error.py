"""The output-error polish: named parameters moved until open-loop rollouts follow the log, within physical limits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...measurements.statistics.blocks import block_scores, sandwich
from ...measurements.statistics.quantiles import student
from ...physics.errors import RequestError
from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..balance.shooting import Shooting, ShootingSettings
from .bootstrap import Interval
from .gram import RIDGE, bounded_solve

_LEAST_MASS_SHARE = 0.05
"""Share of the start's mass and inertia that a fit leaves at least, so that they stay positive."""
_STEP, _LEAST_STEP = 1e-3, 1e-5
"""Step of a difference, as a share of the value and at least: far above the rounding of a rollout, and small."""
_DONE = 1e-4
"""Relative fall of the cost from one step below which a fit has ended; a judgement."""


@dataclass(frozen=True, slots=True)
class Polish:
    """Parameters polished on rollouts.

    Attributes
    ----------
    vehicle : the model with the polished values
    values : total values by symbol
    symbols : order of the rows of `covariance`
    covariance : (p, p) from blocks of the log, which allows residuals that are not independent
    intervals : 95 % intervals by symbol, cut at the limits; none for a parameter that is held at one, and none at all
        when there are no more blocks than free parameters
    error_before, error : (3,) root mean square rollout error [m/s, m/s, rad/s], weighted as at the end
    rounds : steps made
    """

    vehicle: Vehicle
    values: dict[str, float]
    symbols: tuple[str, ...]
    covariance: Array
    intervals: dict[str, Interval]
    error_before: Array
    error: Array
    rounds: int


def polish(
    motions: Sequence[Motion],
    vehicle: Vehicle,
    symbols: Sequence[str],
    settings: ShootingSettings | None = None,
    *,
    blind: Sequence[bool] = (False, False, False),
    limits: Mapping[str, tuple[float, float]] | None = None,
    rounds: int = 20,
) -> Polish:
    """Fit parameters to the open-loop rollouts of motions by Levenberg-Marquardt steps (output error).

    Each step solves the linearised problem within the limits of the catalogue; it is kept only if the rollouts
    themselves get better (Levenberg 1944, Marquardt 1963). Starts that the model does not follow count less, by weights
    that follow the model.

    Parameters
    ----------
    vehicle : the model to begin from; one whose rollouts diverge is no start
    symbols : parameters to free, of any effect, `mass`, `inertia_z`, or unnamed terms
    settings : horizon, spacing, bins
    blind : axes that are not scored
    limits : narrower limits of total values by symbol
    rounds : most steps

    Raises
    ------
    RequestError
        when nothing is to be freed, a symbol is given twice, the motions are too short, or the start diverges.
    """
    names = tuple(symbols)
    if not names or len(set(names)) < len(names):
        raise RequestError(f"polish: expected different symbols, at least one, got {', '.join(names) or 'none'}")
    form = Shooting(motions, vehicle, settings, blind)
    problem = _Problem(names, _limits(vehicle, names, limits or {}))
    x = np.clip([vehicle.value(s) for s in names], problem.lower, problem.upper)
    vehicle = vehicle.with_values(dict(zip(names, x.tolist(), strict=True)))
    start, damping, made = vehicle, 1e-3, 0
    for _ in range(rounds):
        form = form.refreshed(vehicle)
        error, jacobian = problem.columns(form, vehicle)
        cost = float((error**2).sum())
        if not np.isfinite(cost):
            raise RequestError("polish: the rollouts of the start model diverge; begin from a stable model")
        moved, better, damping = problem.step(form, vehicle, error, jacobian, cost, damping)
        if moved is None:
            break
        vehicle, made = moved, made + 1
        if better >= cost * (1.0 - _DONE):
            break
    form = form.refreshed(vehicle)
    covariance, spread = problem.spread(form, vehicle)
    values = {s: vehicle.value(s) for s in names}
    intervals = {
        s: Interval(float(max(values[s] - reach, low)), float(min(values[s] + reach, high)))
        for s, reach, low, high in zip(names, spread, problem.lower, problem.upper, strict=True)
        if np.isfinite(reach)
    }
    before, after = (np.sqrt((form.balance(v) ** 2).mean(axis=0)) for v in (start, vehicle))
    return Polish(vehicle, values, names, covariance, intervals, before, after, made)


@dataclass(frozen=True, slots=True)
class _Problem:
    """Symbols and their limits; every error in units of its axis' scale."""

    symbols: tuple[str, ...]
    bounds: tuple[Array, Array]

    @property
    def lower(self) -> Array:
        return self.bounds[0]

    @property
    def upper(self) -> Array:
        return self.bounds[1]

    def columns(self, form: Shooting, vehicle: Vehicle) -> tuple[Array, Array]:
        """Errors (rows,) and what a unit of each parameter takes off them (rows, p)."""
        near = form.about(vehicle)
        base = near.balances(vehicle)[0]
        columns = np.empty((base.size, len(self.symbols)))
        for k, symbol in enumerate(self.symbols):
            now = vehicle.value(symbol)
            step = max(_STEP * abs(now), _LEAST_STEP)
            step = -step if now + step > self.upper[k] else step
            columns[:, k] = ((base - near.balances(vehicle.with_values({symbol: now + step}))[0]) / form.scale).ravel()
            columns[:, k] /= step
        return (base / form.scale).ravel(), columns

    def step(
        self, form: Shooting, vehicle: Vehicle, error: Array, jacobian: Array, cost: float, damping: float
    ) -> tuple[Vehicle | None, float, float]:
        """The first damped step that makes the rollouts better, its cost, and the damping for the next; or None."""
        size = np.sqrt(np.maximum((jacobian**2).sum(axis=0), 1e-300))
        normal = (jacobian / size).T @ (jacobian / size)
        pull = (jacobian / size).T @ error
        x = np.array([vehicle.value(s) for s in self.symbols])
        low, high = (self.lower - x) * size, (self.upper - x) * size
        while damping < 1e6:
            change, _ = bounded_solve(normal + (damping + RIDGE) * np.eye(x.size), pull, low, high)
            moved = np.clip(x + change / size, self.lower, self.upper)
            trial = vehicle.with_values(dict(zip(self.symbols, moved.tolist(), strict=True)))
            better = float(((form.balance(trial) / form.scale) ** 2).sum())
            if better < cost:
                return trial, better, max(0.2 * damping, 1e-9)
            damping *= 10.0
        return None, cost, damping

    def spread(self, form: Shooting, vehicle: Vehicle) -> tuple[Array, Array]:
        """Covariance (p, p) from blocks, and half widths of 95 % intervals (p,), nan where none can be told.

        The sandwich H^-1 (sum over blocks of g g^T) H^-1 with g the gradient of a block (White 1982, Liang and Zeger
        1986); parameters at a limit are held, and have no width (nan). At the optimum the g add up to zero: no more
        blocks than free parameters leave the sandwich short of rank, its widths are too small, and none are given.
        """
        error, jacobian = self.columns(form, vehicle)
        size = np.sqrt(np.maximum((jacobian**2).sum(axis=0), 1e-300))
        jacobian = jacobian / size
        block = np.repeat(form.block, 3)
        blocks = int(block.max()) + 1
        scores = block_scores(jacobian, error, block)
        x = np.array([vehicle.value(s) for s in self.symbols])
        free = (x > self.lower) & (x < self.upper)
        covariance, reach = np.zeros((x.size, x.size)), np.full(x.size, np.nan)
        if free.any():
            inverse = np.linalg.pinv(jacobian[:, free].T @ jacobian[:, free], rcond=1e-12, hermitian=True)
            covariance[np.ix_(free, free)] = sandwich(inverse, scores[:, free]) / np.outer(size[free], size[free])
        if blocks > free.sum():
            reach[free] = student(blocks - 1, 0.975) * np.sqrt(np.diag(covariance)[free])
        return covariance, reach


def _limits(
    vehicle: Vehicle, symbols: Sequence[str], narrower: Mapping[str, tuple[float, float]]
) -> tuple[Array, Array]:
    """Limits of total values: the catalogue's, a positive mass and inertia, and those that the caller gives."""
    low, high = [], []
    for symbol in symbols:
        parameter = vehicle.parameter(symbol)
        if symbol in ("mass", "inertia_z"):
            parameter = replace(parameter, lower=_LEAST_MASS_SHARE * vehicle.value(symbol))
        below, above = narrower.get(symbol, (-np.inf, np.inf))
        low.append(max(parameter.lower, below))
        high.append(min(parameter.upper, above))
    return np.array(low), np.array(high)
