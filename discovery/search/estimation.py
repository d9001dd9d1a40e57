"""Estimation of the parameters of named effects: output-error polish on rollouts, and intervals by a block bootstrap.

Whole blocks are reweighed, since residuals depend on their neighbours in time. Weights are drawn (Bayesian bootstrap;
Rubin 1981, doi:10.1214/aos/1176345338) because drawing with replacement loses the one block with the only run astern in
a third of all draws. No interval is narrower than that of least squares with independent errors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...measurements.statistics.blocks import block_scores, block_weights, sandwich, student
from ...physics.effects import Parameter
from ...physics.errors import RequestError
from ...physics.file_records import Number
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..balance.shooting import Shooting, ShootingSettings
from ..candidates.candidate import Candidate
from ..candidates.linearisation import Linearisation, Option
from .gram import RIDGE, GramScores, bounded_solve

_SMALL = 1e-12
"""Square of a column without any: it stands for none."""
RESOLVED = 1e-3
"""Share of a value that no interval is narrower than to either side: steps of integrators, which are in all blocks
alike, leave up to so much where there is no noise."""
_PROFILE, _LEAST_PROFILE, _PROFILED = 0.5, 0.05, 40
"""Values that are tried of a profile: half the value (or half of 0.05) to either side, in so many steps."""
_WIDER = 5
"""Times that the reach may double: even from the least one, that is more than half of full command."""
_TAIL = 0.025
"""Share of draws beyond either end of a 95 % interval."""


class Interval(NamedTuple):
    """95 % interval of one parameter's total value, in the parameter's unit."""

    lower: Number
    upper: Number


def block_bootstrap(
    scores: GramScores,
    chosen: Sequence[Option],
    seed: int,
    draws: int = 400,
    beside: Mapping[str, float] | None = None,
    independent: float = np.inf,
) -> dict[str, Interval]:
    """95 % intervals of every free parameter of a model, by symbol; none for one whose limits leave it no room.

    Blocks are weighed anew and the model is fitted to each draw from the blocks' Gram matrices; the interval is the
    estimate -+ t standard deviations, no less than by least squares and than `RESOLVED` of it, and what is in all
    blocks alike, cut at the physical limits (Efron and Tibshirani 1993, chapters 8 and 12).
    The degrees of freedom of n blocks and p parameters are n - p; draws of blocks scatter by what a fit takes up.

    Parameters
    ----------
    scores : Gram matrices about the model, in which every chosen option stands at its start
    chosen : the options present in the model
    seed : of the draws
    beside : by symbol, an error that is in all blocks alike
    independent : tests that count as independent, of which least squares makes its errors; without end, none
    """
    columns, left, right = scores.block_normal(chosen)
    result: dict[str, Interval] = {}
    if columns.size == 0:
        return result
    counts = block_weights(scores.blocks, draws, seed)
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("kii->i", left), _SMALL))
    normal = np.einsum("dk,kij->dij", counts, left) * (scale[:, None] * scale[None, :])
    normal += RIDGE * np.eye(columns.size)
    pull = (counts @ right) * scale
    changes = np.linalg.solve(normal, pull[..., None])[..., 0] * scale
    spread = changes.std(axis=0, ddof=1) * np.sqrt((scores.blocks + 1) / (scores.blocks - 1))
    spread = np.maximum(spread, scores.standard_errors(chosen, independent))
    reach = student(max(scores.blocks - columns.size, 1), 0.975) * spread
    size = {int(column): float(r) for column, r in zip(columns, reach, strict=True)}
    for symbol, start, column, lower, upper in (number for option in chosen for number in option.numbers):
        if lower < upper:
            wide = max(size[column], RESOLVED * abs(start)) + (beside or {}).get(symbol, 0.0)
            low, high = start - wide, start + wide
            result[symbol] = Interval(max(low, start + min(lower, 0.0)), min(high, start + max(upper, 0.0)))
    return result


def intervals(
    balance: Balance,
    scores: GramScores,
    pool: Sequence[Candidate],
    chosen: Sequence[Option],
    vehicle: Vehicle,
    seed: int,
) -> dict[str, Interval]:
    """95 % intervals of every parameter of a model, by symbol: block bootstrap, or a profile where it moves in steps.

    Parameters
    ----------
    pool : holds the candidate of every chosen option
    vehicle : the model about which the scores were taken
    """
    switches = _of_switches(balance, scores, pool, chosen, vehicle)
    found = block_bootstrap(scores, chosen, seed, beside=switches, independent=balance.independent)
    active = {option.key for option in chosen}
    stepped = [p for candidate in pool if candidate.key in active for p in candidate.parameters if p.stepped]
    return found | {p.symbol: profile_interval(balance, vehicle, p, scores.weight, seed) for p in stepped}


def _of_switches(
    balance: Balance, scores: GramScores, pool: Sequence[Candidate], chosen: Sequence[Option], vehicle: Vehicle
) -> dict[str, float]:
    """By how much each parameter would change if commands jump from one row to the next, by symbol."""
    left = balance.of_switches(vehicle) if chosen else None
    if left is None:
        return {}
    active = [option.key for option in chosen]
    alike = [candidate for candidate in pool if candidate.key in active]
    linear = Linearisation(balance, vehicle, vehicle, alike, active, standing=True)
    free = [number for key in active for number in linear.options[key][0].numbers]
    columns = linear.columns[:, :, [number.column for number in free]]
    pull = np.einsum("a,tap,ta->p", scores.weight, columns, left, optimize=True)
    _, normal, _ = scores.block_normal(chosen)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal.sum(axis=0)), _SMALL))
    system = normal.sum(axis=0) * (scale[:, None] * scale) + RIDGE * np.eye(scale.size)
    change = np.abs(np.linalg.solve(system, pull * scale) * scale)
    return {number.symbol: float(by) for number, by in zip(free, change, strict=True)}


def profile_interval(
    balance: Balance, vehicle: Vehicle, parameter: Parameter, weight: Array, seed: int, draws: int = 400
) -> Interval:
    """95 % interval of a parameter that moves the force in steps, so that no derivative tells its spread.

    The squared error is taken for values all about the estimate; in each draw of blocks every value within rounding of
    the least error is as good as the best one, and the interval holds 95 % of all of these, out to the next values that
    were tried. An end of the profile that is among the best is no limit yet: the profile then reaches twice as far, in
    steps twice as long, up to the physical limits. The other parameters are kept, so the interval is conditional on
    them.

    Parameters
    ----------
    vehicle : the fitted model
    weight : (3,) weight of a squared error on each axis
    """
    value = vehicle.value(parameter.symbol)
    least, most = min(parameter.lower, value), max(parameter.upper, value)
    reach = _PROFILE * max(value, _LEAST_PROFILE)
    blocks = balance.blocks
    counts = block_weights(blocks, draws, seed)

    def errors(values: Array) -> Array:
        """Summed squared error of each block, (blocks, values)."""
        result = np.zeros((blocks, values.size))
        for k, x in enumerate(values.tolist()):
            squares = balance.residual(vehicle.with_values({parameter.symbol: x})) ** 2 @ weight
            np.add.at(result[:, k], balance.block, squares)
        return result

    grid = np.linspace(max(least, value - reach), min(most, value + reach), 2 * _PROFILED + 1)
    seen = errors(grid)
    for widened in range(_WIDER + 1):
        total = counts @ seen
        best = total <= total.min(axis=1, keepdims=True) * (1.0 + 1e-9)
        below, above = (float(best[:, end].mean()) > _TAIL for end in (0, -1))
        below, above = below and grid[0] > least, above and grid[-1] < most
        if not (below or above) or widened == _WIDER:
            break
        further = reach * (1.0 + np.arange(1, _PROFILED // 2 + 1) / (_PROFILED // 2))
        reach *= 2.0
        lower = np.unique(np.maximum(value - further, least)) if below else grid[:0]
        upper = np.unique(np.minimum(value + further, most)) if above else grid[:0]
        lower, upper = lower[lower < grid[0]], upper[upper > grid[-1]]
        grid, seen = np.concatenate([lower, grid, upper]), np.hstack([errors(lower), seen, errors(upper)])
    first, last = best.argmax(axis=1), grid.size - 1 - best[:, ::-1].argmax(axis=1)
    low, high = np.quantile(grid[first], _TAIL), np.quantile(grid[last], 1.0 - _TAIL)
    within = (grid >= min(low, value)).argmax(), grid.size - 1 - (grid <= max(high, value))[::-1].argmax()
    return Interval(float(grid[max(int(within[0]) - 1, 0)]), float(grid[min(int(within[1]) + 1, grid.size - 1)]))


_LEAST_MASS_SHARE = 0.05
"""Share of the start's mass and inertia that a fit leaves at least, which regularises it: they stay positive."""
_STEP, _LEAST_STEP = 1e-3, 1e-5
"""Step of a difference, as a share of the value and at least: far above the rounding of a rollout, and small."""
_DONE = 1e-4
"""Relative fall of the cost from one step below which a fit has ended: its precision."""


@dataclass(frozen=True, slots=True)
class Polish:
    """Parameters polished on rollouts.

    Attributes
    ----------
    vehicle : the model with the polished values
    intervals : 95 % intervals by symbol from blocks of the log, which allow residuals that are not independent, cut at
        the limits; none for a parameter that is held at one, and none at all when there are no more blocks than free
        parameters
    """

    vehicle: Vehicle
    intervals: dict[str, Interval]


def polish(
    motions: Sequence[Motion],
    vehicle: Vehicle,
    symbols: Sequence[str],
    settings: ShootingSettings | None = None,
    *,
    limits: Mapping[str, tuple[float, float]] | None = None,
    rounds: int = 20,
) -> Polish:
    """Fit parameters to the open-loop rollouts of motions by Levenberg-Marquardt steps (output error).

    Each step solves the linearised problem within the limits of the catalogue; it is kept only if the rollouts
    themselves get better (Levenberg 1944, Marquardt 1963). Starts that the model, or one before it, does not follow
    count less.

    Parameters
    ----------
    vehicle : the model to begin from; one whose rollouts diverge is no start
    symbols : parameters to free, of any effect, `mass`, `inertia_z`, or unnamed terms
    settings : horizon, spacing, bins
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
    form = Shooting(motions, vehicle, settings)
    problem = _Problem(names, *_limits(vehicle, names, limits or {}))
    x = np.clip([vehicle.value(s) for s in names], problem.lower, problem.upper)
    vehicle = vehicle.with_values(dict(zip(names, x.tolist(), strict=True)))
    damping = 1e-3
    for _ in range(rounds):
        form = form.refreshed(vehicle)
        error, jacobian = problem.columns(form, vehicle)
        cost = float((error**2).sum())
        if not np.isfinite(cost):
            raise RequestError("polish: the rollouts of the start model diverge; begin from a stable model")
        moved, better, damping = problem.step(form, vehicle, error, jacobian, cost, damping)
        if moved is None:
            break
        vehicle = moved
        if better >= cost * (1.0 - _DONE):
            break
    spread = problem.spread(form.refreshed(vehicle), vehicle)
    intervals = {
        s: Interval(float(max(vehicle.value(s) - reach, low)), float(min(vehicle.value(s) + reach, high)))
        for s, reach, low, high in zip(names, spread, problem.lower, problem.upper, strict=True)
        if np.isfinite(reach)
    }
    return Polish(vehicle, intervals)


@dataclass(frozen=True, slots=True)
class _Problem:
    """Symbols and their limits; every error in units of its axis' scale."""

    symbols: tuple[str, ...]
    lower: Array
    upper: Array

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
            better = float(((form.residual(trial) / form.scale) ** 2).sum())
            if better < cost:
                return trial, better, max(0.2 * damping, 1e-9)
            damping *= 10.0
        return None, cost, damping

    def spread(self, form: Shooting, vehicle: Vehicle) -> Array:
        """Half widths of 95 % intervals from blocks (p,), nan where none can be told.

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
        reach = np.full(x.size, np.nan)
        if free.any() and blocks > free.sum():
            inverse = np.linalg.pinv(jacobian[:, free].T @ jacobian[:, free], rcond=1e-12, hermitian=True)
            covariance = sandwich(inverse, scores[:, free]) / np.outer(size[free], size[free])
            reach[free] = student(blocks - 1, 0.975) * np.sqrt(np.diag(covariance))
        return reach


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
