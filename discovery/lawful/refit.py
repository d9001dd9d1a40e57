"""The lawful refit: the chosen parameters again under limits and laws, and how the model made of them stands.

Every limit is checked again on the numbers that a solver returns, and dissipation by a random search beside the proof.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...physics.errors import RequestError
from ...physics.laws.damping_power import (
    Envelope,
    Exponents,
    basis,
    control_matrices,
    corner_state,
    envelope_of,
    mass_margin,
    state_in_words,
    vehicle_power,
    worst_dissipation,
)
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from ..balance.shooting import predicts_worse
from ..candidates.candidate import Kind
from ..candidates.linearisation import Option
from ..search.gram import GramScores, bounded_solve
from .convex_program import NO_OPTIMUM, Shape, Solution, solve_refit
from .laws_over import (
    MARGIN,
    NOTHING,
    Binding,
    MostPower,
    Passivity,
    certify,
    laws_over,
    least_margin,
    percent,
    price_in_words,
)

_TOLERANCE = 1e-6
"""Share by which a returned number may break a limit or a law: the solver stops at a hundredth of it, see
`convex_program`."""
_PULL = 1e-9
"""Gradient that is none, in units in which every number is of order one."""
_FLAT = 1e-9
"""Share of the largest eigenvalue of a normal matrix (columns of length one) below which data say nothing."""


@dataclass(frozen=True, slots=True)
class LawfulFit:
    """A refit that keeps the laws over an envelope.

    Attributes
    ----------
    values : total values by symbol
    free : the same without the laws, under the limits alone
    kept : True when dissipation is proved; False when the nominal model breaks it beyond what these parameters can
        mend, and the refit is no worse than nominal instead
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
    are not negative, added mass adds. What keeps them, and is held only where it would go beyond them, is the answer;
    where none is found so, the quadratic programme is solved by Clarabel through cvxpy on the R factor of the
    compressed data. Each limit is checked again on the numbers that came back.

    Raises
    ------
    RequestError
        when the solver does not report an optimum, or a returned number breaks a limit.
    """
    values = {s: v for option in chosen for s, v in zip(option.symbols, option.start, strict=True)}
    scaled = _scaled(scores, chosen)
    if not scaled.symbols:
        return values
    return values | scaled.totals(_within_limits(scaled))


def _within_limits(scaled: "_Scaled") -> Solution | None:
    """Least squares under the limits; None when nothing satisfies them."""
    (lower, upper), r, d = scaled.limits, scaled.factor, scaled.target
    if np.linalg.matrix_rank(r, rtol=_FLAT) == len(scaled.symbols):
        x, held = bounded_solve(r.T @ r, r.T @ d, lower, upper)
        x[~held] = np.linalg.lstsq(r[:, ~held], d - r[:, held] @ x[held], rcond=None)[0]
        pull = r.T @ (d - r @ x)
        outwards = np.where(x <= lower, pull <= _PULL, pull >= -_PULL)
        # What keeps the limits, and is held only where it would go beyond them, is the optimum (Karush, Kuhn, Tucker).
        if ((lower <= x) & (x <= upper)).all() and outwards[held].all():
            return Solution(x, np.zeros((0, 0)), np.zeros((0, 0, 3, 3)))
    return solve_refit(scaled.shape(), r, d, scaled.limits)


def passive_refit(
    scores: GramScores, chosen: Sequence[Option], nominal: Vehicle, envelope: Envelope, strict: bool = False
) -> LawfulFit:
    """The lawful refit with dissipation over an envelope and positive mass guaranteed, and what that costs.

    The damping of nominal plus chosen terms is proved dissipative by positive semidefinite matrices at the corners of
    each orthant of the envelope (`physics/laws/damping_power.py`), M is positive definite, limits are as in
    `lawful_refit`. Every constraint is checked again on the returned numbers.

    Parameters
    ----------
    nominal : the vehicle to which the chosen options are added
    envelope : velocities relative to the water
    strict : raise, instead of being no worse than nominal, where the law cannot be kept

    Raises
    ------
    RequestError
        when the solver does not report an optimum, a returned number breaks a constraint, or, if `strict`, when the
        nominal model breaks the law beyond what the chosen parameters can mend.
    """
    free = lawful_refit(scores, chosen)
    misfit_free = scores.loss(chosen, free)
    without = nominal.with_values(free)
    least_mass = least_margin(nominal)
    if certify(without, envelope).holds and mass_margin(without) >= least_mass:
        return LawfulFit(
            free, free, True, misfit_free, misfit_free, None, price_in_words(0.0, None, True, nominal.name)
        )
    problem = _Passive(_scaled(scores, chosen), nominal, without, envelope, least_mass)
    solution = None if problem.laws.hopeless else problem.solve(-MARGIN) or problem.solve(0.0)
    kept = solution is not None
    if solution is None:
        if strict:
            raise RequestError(
                f"lawful refit: no values of {', '.join(problem.scaled.symbols) or 'no parameters'} make the damping "
                f"of {nominal.name} dissipative over the envelope {envelope.to_dict()}; "
                "free a damping parameter, or mend the nominal ones"
            )
        problem.laws = problem.laws.allowing_nominal()
        solution = problem.solve(0.0)
    values = free
    if problem.scaled.symbols:
        values = free | problem.scaled.totals(solution)
    misfit = scores.loss(chosen, values)
    price = max(0.0, misfit / max(misfit_free, 1e-300) - 1.0)
    binding = None
    if solution is not None:
        problem.recheck(nominal.with_values(values), solution)
        if price > NOTHING:
            binding = problem.binding(solution, free, values, misfit_free * 3 * scores.tests)
    return LawfulFit(
        values, free, kept, misfit_free, misfit, binding, price_in_words(price, binding, kept, nominal.name)
    )


@dataclass(frozen=True, slots=True)
class _Scaled:
    """A refit in units in which every number is of order one; x = total value / unit, loss = size^2 |R x - d|^2."""

    symbols: tuple[str, ...]
    unit: Array
    factor: Array
    target: Array
    limits: tuple[Array, Array]
    size: float

    def shape(self, orthants: int = 0, degree: Exponents = (1, 1, 1), mass: bool = False) -> Shape:
        """What the compiled programme depends on."""
        below, above = (tuple(np.isfinite(x).tolist()) for x in self.limits)
        return Shape(below, above, orthants, degree, mass)

    def totals(self, solution: Solution | None) -> dict[str, float]:
        """Total values by symbol, every limit checked again."""
        if solution is None:
            raise RequestError(NO_OPTIMUM.format("infeasible"))
        (lower, upper), found = self.limits, solution.values
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
    rows = [number for option in chosen for number in option.numbers]
    free = [k for k, row in enumerate(rows) if row.lower < row.upper]
    if not free:
        return _Scaled((), np.zeros(0), np.zeros((0, 0)), np.zeros(0), (np.zeros(0), np.zeros(0)), 1.0)
    # What the data do not show beyond noise stays as it was, beside what they show.
    shown = [k for k in free if normal[k, k] > 0.0]
    if not shown:
        raise RequestError(
            f"lawful refit: beyond sensor noise the log says nothing about {', '.join(rows[k].symbol for k in free)}; "
            "see with 'undertow inspect' whether every thruster has its own command and every sensor works, or give a "
            "livelier log"
        )
    normal, pull, rows = normal[np.ix_(shown, shown)], pull[shown], [rows[k] for k in shown]
    scale = 1.0 / np.sqrt(np.diag(normal))
    factor, target = _factor(normal * (scale[:, None] * scale[None, :]), pull * scale)
    start = np.array([row.start for row in rows]) / scale
    target = target + factor @ start
    size = float(np.linalg.norm(target)) or 1.0
    ends = ([row.lower for row in rows], [row.upper for row in rows])
    lower, upper = ((np.array(end) / scale + start) / size for end in ends)
    return _Scaled(tuple(row.symbol for row in rows), size * scale, factor, target / size, (lower, upper), size)


class _Passive:
    """The programme of `passive_refit` for one model, in units of order one."""

    def __init__(
        self, scaled: _Scaled, nominal: Vehicle, without: Vehicle, envelope: Envelope, least_mass: float
    ) -> None:
        self.scaled, self.nominal, self.envelope, self.least_mass = scaled, nominal, envelope, least_mass
        symbols = dict(zip(scaled.symbols, scaled.unit.tolist(), strict=True))
        self.laws = laws_over(envelope, nominal, without, symbols, least_mass)

    def solve(self, ease: float) -> Solution | None:
        """The refit with S + allowance + ease >= 0 at the control points; None when no values do that."""
        if not self.scaled.symbols:
            return None
        law = replace(self.laws.numbers, allowance=self.laws.numbers.allowance + ease * np.eye(3))
        shape = self.scaled.shape(len(law.power), self.laws.degree, self.laws.mass)
        return solve_refit(shape, self.scaled.factor, self.scaled.target, self.scaled.limits, law)

    def recheck(self, vehicle: Vehicle, solution: Solution) -> None:
        """Check both laws on the vehicle that was made of the returned numbers.

        Raises
        ------
        RequestError
            when one is broken by more than rounding.
        """
        power = vehicle_power(vehicle, self.envelope, self.laws.degree) / self.laws.scale
        matrices = control_matrices(power, solution.slack, self.laws.degree) + self.laws.numbers.allowance
        least = np.linalg.eigvalsh(matrices)[..., 0]
        if least.min() < -_TOLERANCE:
            raise RequestError(
                f"lawful refit: the solution breaks dissipation by {-least.min():.2g} of the power scale; "
                "try fewer effects"
            )
        if mass_margin(vehicle) < self.least_mass - _TOLERANCE:
            raise RequestError(
                f"lawful refit: the solution's mass matrix has an eigenvalue of {mass_margin(vehicle):.2g} of the "
                "rigid body's; try fewer effects"
            )

    def binding(self, solution: Solution, free: dict[str, float], values: dict[str, float], misfit: float) -> Binding:
        """The control point with the largest multiplier, and the parameter whose move costs the fit most.

        Parameters
        ----------
        misfit : weighted sum of squares without the laws
        """
        relief = np.trace(solution.pull, axis1=2, axis2=3) / self.laws.scale
        orthant, point = np.unravel_index(int(np.argmax(relief)), relief.shape)
        push = np.einsum("oqij,qijm,omk->k", solution.pull, basis(self.laws.degree).lift, self.laws.numbers.slope)
        moved = np.array([values[s] - free[s] for s in self.scaled.symbols]) / self.scaled.unit
        k = int(np.argmax(np.abs(push * moved)))
        symbol = self.scaled.symbols[k]
        return Binding(
            state=corner_state(self.envelope, int(orthant), int(point), self.laws.degree),
            multiplier=float(relief[orthant, point]) * self.scaled.size**2 / max(misfit, 1e-300),
            symbol=symbol,
            wanted=free[symbol],
            allowed=values[symbol],
            unit=self.nominal.parameter(symbol).unit,
        )


def _factor(normal: Array, pull: Array) -> tuple[Array, Array]:
    """R and d with R^T R = normal and R^T d = pull, so that |R x - d|^2 is the least-squares loss up to a constant.

    Where the data say nothing, x stays at zero: an interior-point solver would otherwise go to the middle between the
    limits, where a model that bends is another than the one that was linearised.
    """
    size, vectors = np.linalg.eigh(normal)
    flat = size <= _FLAT * size.max()
    root = np.sqrt(np.where(flat, size.max(), size))
    return root[:, None] * vectors.T, np.where(flat, 0.0, vectors.T @ pull) / root


@dataclass(frozen=True, slots=True)
class Lawful:
    """A corrected model.

    Attributes
    ----------
    vehicle : the model to be written
    unconstrained : what the data alone ask for, under the limits of single parameters
    passivity : how the law stands in `vehicle`
    """

    vehicle: Vehicle
    unconstrained: Vehicle
    passivity: Passivity


def lawful_model(
    motions: Sequence[Motion], scores: GramScores, chosen: Sequence[Option], nominal: Vehicle, name: str
) -> Lawful:
    """Fit the chosen options under the laws over the envelope of the motions.

    The law wins over the data for effects of the catalogue. A term that nobody has named may be the trace of something
    that does create energy (a drag law with a wrong sign in a simulator); where the law makes 10 s rollouts
    significantly worse than the estimate, the estimate is kept and the verdict is "fail".

    Parameters
    ----------
    name : of the corrected vehicle

    Raises
    ------
    RequestError
        when a solver fails, or a returned number breaks a constraint.
    """
    if all(option.kind is Kind.SENSOR for option in chosen):
        envelope = envelope_of(motions, nominal)
        return Lawful(nominal, nominal, judge_passivity(nominal, envelope))
    start = {s: v for option in chosen for s, v in zip(option.symbols, option.start, strict=True)}
    envelope = envelope_of(motions, nominal.with_values(start))
    fit = passive_refit(scores, chosen, nominal, envelope)
    grown = _union(envelope, envelope_of(motions, nominal.with_values(fit.values)))
    if grown != envelope:  # the current, and with it the velocity relative to the water, has moved
        envelope, fit = grown, passive_refit(scores, chosen, nominal, grown)
    vehicle, free = (nominal.with_values(v, name=name) for v in (fit.values, fit.free))
    unnamed = [option.key for option in chosen if option.kind is Kind.TERM]
    if unnamed and fit.binding is not None and predicts_worse(motions, free, vehicle):
        return Lawful(free.checked(), free, judge_passivity(free, envelope, fit, unnamed))
    return Lawful(vehicle.checked(), free, judge_passivity(vehicle, envelope, fit))


def judge_passivity(
    vehicle: Vehicle, envelope: Envelope, fit: LawfulFit | None = None, against: Sequence[str] = ()
) -> Passivity:
    """The verdict on a model, checked by a proof and independently by a random search of 1e5 states.

    Parameters
    ----------
    fit : the refit from which the model comes; None for a model that was not fitted
    against : terms that are kept although the law speaks against them
    """
    proved = certify(vehicle, envelope).holds
    worst = worst_dissipation(vehicle, envelope)
    verdict = "pass" if proved or worst.power <= 0.0 else "fail"
    proof = "vertex LMI" if proved else "search"
    price, binding = (0.0, None) if fit is None else (fit.price, fit.binding)
    found = f"up to {worst.power:.3g} W, at {state_in_words(worst.state)}"
    if against:
        sentence = (
            f"The log asks for a force that creates energy ({', '.join(against)}). Under the law the misfit would "
            f"rise by {percent(price)} and predictions would get worse, so the force is kept as it was found: this "
            f"model puts energy into the hull ({found}) and is not to be trusted beyond the log."
        )
    elif fit is not None:
        sentence = fit.sentence
    elif verdict == "pass":
        sentence = "The model's damping takes energy out of the hull everywhere in the envelope."
    else:
        sentence = "The model's damping creates energy in a part of the envelope."
    if verdict == "fail" and not against:
        sentence += f" A random search finds {found}."
    elif not proved and not against:
        sentence += (
            " There is no proof for the corrected model, but a random search of 100 000 states finds no violation."
        )
    return Passivity(
        verdict=verdict,
        proof=proof,
        envelope=envelope,
        price=price,
        binding=binding,
        worst=MostPower(value=worst.power, at=worst.state),
        sentence=sentence,
    )


def _union(a: Envelope, b: Envelope) -> Envelope:
    low, high = np.minimum(a.lower, b.lower).tolist(), np.maximum(a.upper, b.upper).tolist()
    return Envelope((low[0], low[1], low[2]), (high[0], high[1], high[2]))
