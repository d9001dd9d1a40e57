"""The lawful refit: the chosen parameters again, by a convex programme whose limits hold on the numbers returned."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...physics.errors import RequestError
from ...physics.frames import Array
from ...physics.laws.certificate import basis, corner_state
from ...physics.laws.damping_power import Envelope, mass_margin
from ...physics.vehicle import Vehicle
from ..candidates.linearisation import Option
from ..search.gram import GramScores, bounded_solve
from .affine_laws import MARGIN, Laws, Solution, certify, laws_over, least_margin
from .price_of_law import NOTHING, Binding, price_in_words

_TOLERANCE = 1e-6
"""Share by which a returned number may break a limit or a law: the solver stops at a thousandth of it."""
_PULL = 1e-9
"""Gradient that is rounding, in units in which every number is of order one."""
_FLAT = 1e-9
"""Share of the largest eigenvalue of a normal matrix (columns of length one) below which data say nothing."""


@dataclass(frozen=True, slots=True)
class LawfulFit:
    """A refit that keeps the laws over an envelope.

    Attributes
    ----------
    values : total values by symbol
    free : the same without the laws, under the limits alone
    kept : dissipation is proved; False when the nominal model breaks it beyond what these parameters can mend, and the
        refit is no worse than nominal instead
    misfit_free, misfit : weighted mean square force error without and with the laws
    binding : where dissipation binds; None when it costs nothing
    sentence : the same in words
    """

    values: dict[str, float]
    free: dict[str, float]
    kept: bool
    misfit_free: float
    misfit: float
    binding: Binding | None
    sentence: str

    @property
    def price(self) -> float:
        """Relative rise of the misfit that the laws cost; 0.003 is 0.3 %."""
        return max(0.0, self.misfit / max(self.misfit_free, 1e-300) - 1.0)


def lawful_refit(scores: GramScores, chosen: Sequence[Option]) -> dict[str, float]:
    """Least squares of the chosen parameters under their physical limits, by symbol (total values).

    Limits are those of the catalogue on nominal plus added value: damping never drives, thruster scales and lags
    are not negative, added mass adds. Each is checked again on the numbers that came back.

    Raises
    ------
    RequestError
        when the solver does not report an optimum, or a returned number breaks a limit.
    """
    values = {s: v for option in chosen for s, v in zip(option.symbols, option.start, strict=True)}
    scaled = _scaled(scores, chosen)
    return values | scaled.totals(_within_limits(scaled)) if scaled.symbols else values


def _within_limits(scaled: "_Scaled") -> Array | None:
    """Least squares under the limits; None when nothing satisfies them."""
    (lower, upper), r, d = scaled.limits, scaled.factor, scaled.target
    if np.linalg.matrix_rank(r, rtol=_FLAT) == len(scaled.symbols):
        x, held = bounded_solve(r.T @ r, r.T @ d, lower, upper)
        x[~held] = np.linalg.lstsq(r[:, ~held], d - r[:, held] @ x[held], rcond=None)[0]
        pull = r.T @ (d - r @ x)
        outwards = np.where(x <= lower, pull <= _PULL, pull >= -_PULL)
        # What keeps the limits, and is held only where it would go beyond them, is the optimum (Karush, Kuhn, Tucker).
        if ((lower <= x) & (x <= upper)).all() and outwards[held].all():
            return x
    from .conic import minimise  # here, because it takes half a second to load

    found = minimise(r.T @ r, -r.T @ d, scaled.limits, np.zeros((0, 3, 3)), np.zeros((0, 3, 3, d.size)))
    return None if found is None else found[0]


def passive_refit(scores: GramScores, chosen: Sequence[Option], nominal: Vehicle, envelope: Envelope) -> LawfulFit:
    """The lawful refit with dissipation over an envelope and positive mass guaranteed, and what that costs.

    The damping of nominal plus chosen terms is proved dissipative by positive semidefinite matrices at the corners of
    each orthant of the envelope (`physics/laws/certificate.py`), M is positive definite, limits are as in
    `lawful_refit`. Every constraint is checked again on the returned numbers.

    Parameters
    ----------
    nominal : the vehicle to which the chosen options are added
    envelope : velocities relative to the water

    Raises
    ------
    RequestError
        when the solver does not report an optimum, or a returned number breaks a constraint.
    """
    free = lawful_refit(scores, chosen)
    misfit_free = scores.loss(chosen, free)
    without = nominal.with_values(free)
    least_mass = least_margin(nominal)
    if certify(without, envelope).holds and mass_margin(without) >= least_mass:
        sentence = price_in_words(0.0, None, True, nominal.name)
        return LawfulFit(free, free, True, misfit_free, misfit_free, None, sentence)
    scaled = _scaled(scores, chosen)
    laws = laws_over(envelope, nominal, without, scaled.units, least_mass)
    solution = None if laws.hopeless else _solved(scaled, laws.eased(-MARGIN)) or _solved(scaled, laws)
    kept = solution is not None
    if not kept:
        laws = laws.allowing_nominal()
        solution = _solved(scaled, laws)
    values = free
    if scaled.symbols:
        values = free | scaled.totals(None if solution is None else solution.values)
    misfit = scores.loss(chosen, values)
    price = max(0.0, misfit / max(misfit_free, 1e-300) - 1.0)
    binding = None
    if solution is not None:
        _recheck(laws, nominal.with_values(values), scaled, solution, least_mass)
        if price > NOTHING:
            binding = _binding(laws, scaled, solution, (free, values), envelope, nominal)
            share = scaled.size**2 / max(misfit_free * 3 * scores.tests, 1e-300)
            binding = binding.model_copy(update={"multiplier": binding.multiplier * share})
    sentence = price_in_words(price, binding, kept, nominal.name)
    return LawfulFit(values, free, kept, misfit_free, misfit, binding, sentence)


@dataclass(frozen=True, slots=True)
class _Scaled:
    """A refit in units in which every number is of order one; x = total value / unit, loss = size^2 |R x - d|^2."""

    symbols: tuple[str, ...]
    unit: Array
    factor: Array
    target: Array
    limits: tuple[Array, Array]
    size: float

    @property
    def units(self) -> dict[str, float]:
        """The unit of each parameter."""
        return dict(zip(self.symbols, self.unit.tolist(), strict=True))

    def totals(self, found: Array | None) -> dict[str, float]:
        """Total values by symbol, every limit checked again."""
        if found is None:
            raise RequestError("lawful refit: expected an optimum, no values keep the limits; try fewer effects")
        lower, upper = self.limits
        slack = _TOLERANCE * (1.0 + np.abs(found))
        broken = (found < lower - slack) | (found > upper + slack)
        if broken.any():
            names = ", ".join(symbol for symbol, bad in zip(self.symbols, broken, strict=True) if bad)
            raise RequestError(f"lawful refit: the solution breaks the limits of {names}; try fewer effects")
        total = np.clip(found, lower, upper) * self.unit
        return dict(zip(self.symbols, total.tolist(), strict=True))


def _scaled(scores: GramScores, chosen: Sequence[Option]) -> _Scaled:
    """Solve for total values, each in units of its own size, so that every number the solver sees is of order one."""
    normal, pull = (part.sum(axis=0) for part in scores.block_normal(chosen)[1:])
    rows = [
        (symbol, start, low, high)
        for o in chosen
        for symbol, start, index, low, high in zip(o.symbols, o.start, o.free, o.lower, o.upper, strict=bool(o.free))
        if index >= 0
    ]
    free = [k for k, (_, _, low, high) in enumerate(rows) if low < high]
    if not free:
        return _Scaled((), np.zeros(0), np.zeros((0, 0)), np.zeros(0), (np.zeros(0), np.zeros(0)), 1.0)
    # What the data do not show beyond noise stays as it was, beside what they show.
    shown = [k for k in free if normal[k, k] > 0.0]
    if not shown:
        raise RequestError(
            f"lawful refit: beyond sensor noise the log says nothing about {', '.join(rows[k][0] for k in free)}; see "
            "with 'undertow inspect' whether every thruster has its own command and every sensor works, or give a "
            "livelier log"
        )
    normal, pull, rows = normal[np.ix_(shown, shown)], pull[shown], [rows[k] for k in shown]
    scale = 1.0 / np.sqrt(np.diag(normal))
    factor, target = _factor(normal * (scale[:, None] * scale[None, :]), pull * scale)
    start = np.array([row[1] for row in rows]) / scale
    target = target + factor @ start
    size = float(np.linalg.norm(target)) or 1.0
    lower, upper = ((np.array([row[k] for row in rows]) / scale + start) / size for k in (2, 3))
    return _Scaled(tuple(row[0] for row in rows), size * scale, factor, target / size, (lower, upper), size)


def _factor(normal: Array, pull: Array) -> tuple[Array, Array]:
    """R and d with R^T R = normal and R^T d = pull, so that |R x - d|^2 is the least-squares loss up to a constant.

    Where the data say nothing, x stays at zero: an interior-point solver would otherwise go to the middle between the
    limits, where a model that bends is another than the one that was linearised.
    """
    size, vectors = np.linalg.eigh(normal)
    flat = size <= _FLAT * size.max()
    root = np.sqrt(np.where(flat, size.max(), size))
    return root[:, None] * vectors.T, np.where(flat, 0.0, vectors.T @ pull) / root


def _solved(scaled: _Scaled, laws: Laws) -> Solution | None:
    """The refit under the laws; None when no values keep them."""
    if not scaled.symbols:
        return None
    r, d = scaled.factor, scaled.target
    return laws.minimise(r.T @ r, r.T @ d, scaled.limits)


def _recheck(laws: Laws, vehicle: Vehicle, scaled: _Scaled, solution: Solution, least_mass: float) -> None:
    """Check both laws on the vehicle that was made of the returned numbers.

    Raises
    ------
    RequestError
        when one is broken by more than rounding.
    """
    x = np.array([vehicle.value(symbol) for symbol in scaled.symbols]) / scaled.unit
    least = float(np.linalg.eigvalsh(laws.matrices(x, solution.slack)[0])[..., 0].min())
    if least < -_TOLERANCE:
        raise RequestError(
            f"lawful refit: the solution breaks dissipation by {-least:.2g} of the power scale; try fewer effects"
        )
    mass = mass_margin(vehicle)
    if mass < least_mass - _TOLERANCE:
        raise RequestError(
            f"lawful refit: the solution's mass matrix has an eigenvalue of {mass:.2g} of the rigid body's; "
            "try fewer effects"
        )


def _binding(
    laws: Laws,
    scaled: _Scaled,
    solution: Solution,
    totals: tuple[dict[str, float], dict[str, float]],
    envelope: Envelope,
    nominal: Vehicle,
) -> Binding:
    """The control point with the largest multiplier, and the parameter whose move costs the fit most."""
    free, values = totals
    relief = np.trace(solution.pull, axis1=2, axis2=3) / laws.scale
    orthant, point = np.unravel_index(int(np.argmax(relief)), relief.shape)
    push = np.einsum("oqij,qijm,omk->k", solution.pull, basis(laws.degree).lift, laws.slope)
    moved = np.array([values[s] - free[s] for s in scaled.symbols]) / scaled.unit
    symbol = scaled.symbols[int(np.argmax(np.abs(push * moved)))]
    return Binding(
        state=corner_state(envelope, int(orthant), int(point), laws.degree),
        multiplier=float(relief[orthant, point]),
        symbol=symbol,
        wanted=free[symbol],
        allowed=values[symbol],
        unit=nominal.parameter(symbol).unit,
    )
