"""Score of a model: held-out error above a floor, plus a price for its parameters; and whether an effect is material.

The score is the sum over axes of (independent tests / 2) log(held-out error + floor^2), plus a price a parameter. The
floor is a share of the axis's force scale: what is smaller is not material.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import NamedTuple

import numpy as np

from ...physics.effects import PARAMETERS
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from ..balance.base import Balance
from ..balance.shooting import TRIFLE, rollout_difference
from ..candidates.candidate import Candidate, Kind
from ..candidates.linearisation import Linearisation, Option
from .gram import Fit, GramScores

TELL_APART = 5.0
"""Log-likelihood by which an effect must beat another in its place, or nothing, or a log cannot tell them apart: what
is wrong beats the truth by so much by chance in at most one log in exp(5), 150."""
SLIGHT = 0.05
"""Share of an error or a force below which a part of it is slight: of several right names all but the first remove
little of what the nominal model leaves, and what a simple law lacks of a general one is less."""
MATERIAL = 0.1
"""Share of the force at work, or of an effect's own, from which a rest, or a change, is material. Waves of 0.2 m/s
leave 0.07 or less in surge and yaw over 5 s where the model is right, commands that are cut at a third 0.15 to 0.5."""
ALIVE = 2.0
"""Times what sensor noise alone makes of a force from which it is motion to learn from, and of a force error that no
model explains from which it is coloured."""
_STRUCTURE = 1.5
"""A force error above this many times what sensor noise explains is structure that the model leaves."""
MOST = 0.5
"""Share of what there is from which a part is most of it: of the nominal model's error, in squares, over some seconds
and in rollouts, and of a rest (means of white noise over 5 s hold 0.3 of it, of waves 0.02 to 0.3)."""
_WITHOUT = 40
"""Models less an effect that are kept: pruned of each of its effects, a model is then weighed without each of them."""
_AT_HAND = 30_000_000
"""Bytes of columns that stay at hand, of a quarter of an hour or so; those of a long log are made again."""
_CONVERGED = 0.05
"""Share of the margin of a search that a Gauss-Newton step gains below which it is the last (the Newton decrement; Boyd
and Vandenberghe 2004, section 9.5). At half and at twice no name and no odds change: `benchmarks/steady_numbers.py`."""
_INERTIA = tuple(p.symbol for p in PARAMETERS.values() if p.section in ("added_mass", "top"))
"""What the mass matrix is made of, in proportion."""


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """Prices and thresholds of a search.

    Attributes
    ----------
    materiality : floor of the force error on an axis, as a share of its force scale; an effect above it matters
    loud : the floor on a quiet axis, in multiples of what sensor noise makes there
    least : share of the force scale below which an effect never matters
    weight : share by which 10 s rollouts must change without an effect that lies between the two
    price : log-likelihood that a parameter of a named effect must earn
    unnamed_price : log-likelihood that a term nobody has named, or a parameter of a general effect, must earn
    margin : log-likelihood that a change must earn beyond its price
    rounds : most changes made
    overfit_from : effects from which a model may be a crowd of stand-ins for an error of the sensors
    refinements : Gauss-Newton steps after a change
    """

    materiality: float = 0.02
    loud: float = 4.0
    least: float = 0.007
    weight: float = TRIFLE
    price: float = 3.0
    unnamed_price: float = 8.0
    margin: float = 1.0
    rounds: int = 40
    overfit_from: int = 6
    refinements: int = 2


@dataclass(frozen=True, slots=True)
class State:
    """A model during the search: the vehicle, what is active in it, its fit and its score (lower is better)."""

    vehicle: Vehicle
    active: tuple[str, ...]
    fit: Fit
    score: float


class Loss(NamedTuple):
    """Loss of a model without an effect: error, as the largest share of the force scale of an axis, and score."""

    share: float
    score: float
    key: str


class Scoring:
    """The score of models made of candidates, on one balance, of forces or of rollouts.

    Parameters
    ----------
    balance : what models are held against, of forces or of rollouts
    nominal : the vehicle to be corrected
    pool : candidates that may be missing; those that are nuisances are in every model, whatever a caller asks for
    settings : what a change must be worth

    Attributes
    ----------
    tests : how many are seen
    nuisances : keys of the parameters that are calibrated while effects are judged
    force_scale : (3,) size of the forces at work [N, N, N m]
    quiet : (3,) True for an axis on which hardly anything but sensor noise is at work
    floor : (3,) square of the force error that does not matter: a share of the force scale, or on a quiet axis
        several times what sensor noise makes, lest noise be explained
    """

    def __init__(self, balance: Balance, nominal: Vehicle, pool: Sequence[Candidate], settings: SearchSettings) -> None:
        self.balance, self.nominal, self.pool, self.settings = balance, nominal, tuple(pool), settings
        self.tests, self._share = balance.time.size, 1.0
        self._without: deque[tuple[State, str, State]] = deque(maxlen=_WITHOUT)
        self._latest: tuple[tuple[object, ...], Linearisation] | None = None
        self.nuisances = tuple(c.key for c in self.pool if c.nuisance)
        self._kinds = {c.key: c.kind for c in self.pool}
        self._general = {c.key for c in self.pool if c.effect.general}
        self.force_scale = np.maximum(balance.force_scale(nominal), 1e-9)
        self._mass = np.diag(mass_matrix(nominal))
        self._heavier = {
            symbol: np.diag(mass_matrix(nominal.with_values({symbol: nominal.value(symbol) + 1.0}))) - self._mass
            for symbol in _INERTIA
        }
        self.noise_blocks = noise_by_block(balance.noisy_residuals(nominal), balance.block)
        self.nominal_error = (balance.residual(nominal) ** 2).mean(axis=0)
        at_work = np.maximum(self.force_scale, np.sqrt(self.nominal_error))
        self.quiet = at_work < ALIVE * self.noise_error
        self.floor = np.where(
            self.quiet, (settings.loud * self.noise_error) ** 2, (settings.materiality * self.force_scale) ** 2
        )

    def linearise(
        self,
        vehicle: Vehicle,
        active: Sequence[str],
        error: Array | None = None,
        pool: Sequence[Candidate] | None = None,
        standing: bool = False,
        roughly: bool = False,
    ) -> tuple[Linearisation, GramScores]:
        """Columns (of a part of the pool, if given) about a vehicle, axes weighted by the error that remains.

        Those of all options stay at hand until others are asked for: of one model it is asked what the log can show of
        it, what its effects are worth, and what would be beside an error of the sensors.

        Parameters
        ----------
        vehicle : about which derivatives are taken
        active : keys of the effects in it
        error : error that remains on each axis (3,); that of `vehicle` for None
        pool : candidates to linearise; all for None
        standing, roughly : see `Linearisation`
        """
        pool = self.pool if pool is None else pool
        asked = (vehicle, tuple(active), tuple(c.key for c in pool), roughly)
        linear = self._latest[1] if self._latest is not None and self._latest[0] == asked and not standing else None
        if linear is None:
            if not standing:
                self._latest = None  # lest two be in memory
            linear = Linearisation(self.balance, vehicle, self.nominal, pool, active, standing, roughly)
            if not standing and linear.noise.nbytes < _AT_HAND:
                self._latest = (asked, linear)
        remains = (linear.columns[:, :, -1] ** 2).mean(axis=0) if error is None else error
        weight = 1.0 / (np.maximum(remains, 0.0) + self.floor)  # cleared of noise, an error may be below nothing
        return linear, GramScores(linear.columns, linear.noise, self.balance.block, weight)

    def about(self, state: State, *, roughly: bool = False) -> tuple[Linearisation, GramScores, dict[str, Option]]:
        """Columns and scores about a model, see `linearise`, and the option in which each of its effects stands."""
        linear, scores = self.linearise(state.vehicle, state.active, state.fit.in_sample, roughly=roughly)
        return linear, scores, {key: linear.options[key][0] for key in state.active}

    def fit(self, scores: GramScores, chosen: Sequence[Option]) -> Fit:
        """Fit a choice of options, held-out errors made comparable between models.

        An unexplained acceleration is mass times smaller a force for a lighter hull, which would always seem to fit
        better; errors are therefore compared as accelerations, multiplied by nominal over fitted mass. What
        sensor noise adds counts as for the nominal model. Rollout errors are compared as they are.
        """
        return self.fits(scores, [chosen])[0]

    def fits(self, scores: GramScores, choices: Sequence[Sequence[Option]], *, limited: bool = True) -> list[Fit]:
        """The same of several choices; see `GramScores.fits`.

        Parameters
        ----------
        scores : of the columns
        choices : an option for each effect, model by model
        limited : hold parameters to their physical limits
        """
        return [
            self._comparable(fit, chosen, scores.tests)
            for fit, chosen in zip(scores.fits(choices, limited=limited), choices, strict=True)
        ]

    def _comparable(self, fit: Fit, chosen: Sequence[Option], tests: int) -> Fit:
        by_column = dict(zip(fit.columns.tolist(), fit.change.tolist(), strict=True))
        mass = self._mass.copy()
        for option in chosen if self.balance.forces else ():
            for symbol, start, index in zip(option.symbols, option.start, option.free, strict=bool(option.free)):
                if symbol in self._heavier:
                    change = start + by_column.get(index, 0.0) - self.nominal.value(symbol)
                    mass += change * self._heavier[symbol]
        ratio = self._mass / np.maximum(mass, 0.05 * self._mass)
        blocks = fit.held_out_blocks * ratio**2 + self.noise_blocks
        return replace(fit, held_out_blocks=blocks, held_out=np.maximum(blocks.sum(axis=0) / tests, 0.0))

    def score(self, fit: Fit, chosen: Sequence[Option]) -> float:
        """Half the independent tests times the log held-out error, summed over axes, plus the price of parameters."""
        likelihood = 0.5 * self.independent * np.log(fit.held_out + self.floor).sum()
        return float(likelihood + self.price(fit, chosen))

    @property
    def independent(self) -> float:
        """Number of independent tests among those that are seen."""
        return self._share * self.balance.independent

    @property
    def share_scale(self) -> Array:
        """Unit (3,) of shares: the force scale, or on a quiet axis one of which the floor is material."""
        return np.sqrt(self.floor) / self.settings.materiality

    @property
    def noise_error(self) -> Array:
        """Root mean square that sensor noise alone leaves in the nominal balance, (3,) [N, N, N m]."""
        return np.sqrt(self.noise_blocks.sum(axis=0) / self.tests)

    def price(self, fit: Fit, chosen: Sequence[Option]) -> float:
        """Price of the parameters that no limit holds; a fixed shape counts as one parameter."""
        total, at = 0.0, 0
        for option in chosen:
            size = sum(index >= 0 for index in option.free)
            free = int((~fit.held[at : at + size]).sum())
            at += size
            if option.present and option.key not in self.nuisances:
                total += self._each(option) * (free if size else 1)
        return total

    def price_of(self, option: Option) -> float:
        """The price of an option none of whose parameters is held."""
        return self._each(option) * max(1, sum(index >= 0 for index in option.free))

    def _each(self, option: Option) -> float:
        broad = option.kind is Kind.TERM or option.key in self._general
        return self.settings.unnamed_price if broad else self.settings.price

    def named(self, active: Sequence[str]) -> tuple[str, ...]:
        """The keys among `active` that are effects or terms, not nuisances."""
        return tuple(key for key in active if key not in self.nuisances)

    def is_general(self, key: str) -> bool:
        """True when a candidate holds simpler ones as special cases."""
        return key in self._general

    def of_kind(self, keys: Sequence[str], kind: Kind) -> tuple[str, ...]:
        """The keys among `keys` whose candidates are of a kind."""
        return tuple(key for key in keys if self._kinds[key] is kind)

    def evaluate(self, vehicle: Vehicle, active: Sequence[str], error: Array | None = None) -> State:
        """Refine a model's parameters by Gauss-Newton and score it.

        Parameters
        ----------
        vehicle : start of the refinement
        active : keys of the effects that are fitted
        error : error (3,) by which axes are weighted at first
        """
        named = self.named(active)
        pool = [c for c in self.pool if c.fitted(named)]
        active = (*(c.key for c in pool if c.nuisance), *named)
        unused = [c for c in self.pool if c.nuisance and c not in pool]
        if unused:
            vehicle = vehicle.with_values({s: self.nominal.value(s) for c in unused for s in c.symbols})
        for refined in count():
            linear, scores = self.linearise(vehicle, active, error, pool, standing=True)
            chosen = [linear.options[key][0] for key in active]
            fit = self.fit(scores, chosen)
            last, moved = refined == self.settings.refinements, vehicle
            if not last:
                moved = self.balance.nearer(vehicle, apply_fit(vehicle, chosen, fit))
            if last or self._gain(linear, fit) < _CONVERGED * self.settings.margin:
                break
            vehicle, error = moved, fit.in_sample
        return State(moved, tuple(active), fit, self.score(fit, chosen))

    def _gain(self, linear: Linearisation, fit: Fit) -> float:
        """Log-likelihood that a step from a model to its fit gains, or loses where the fit is cleared of noise."""
        before = (linear.columns[:, :, -1] ** 2).mean(axis=0) + self.floor
        return float(0.5 * self.independent * np.abs(np.log(before / (fit.in_sample + self.floor))).sum())

    def without(self, state: State, key: str) -> State:
        """A model without one of its effects, the others fitted again."""
        for known, gone, result in self._without:
            if known is state and gone == key:
                return result
        self._without.append((state, key, self.restrict(state, tuple(k for k in state.active if k != key))))
        return self._without[-1][2]

    def losses(self, state: State) -> list[Loss]:
        """Worth of each effect of a model about the columns at hand, the others not refined."""
        pool = [c for c in self.pool if c.key in state.active]
        linear, scores = self.linearise(state.vehicle, state.active, state.fit.in_sample, pool)
        now = {key: linear.options[key][0] for key in state.active}
        result = []
        for key in self.named(state.active):
            chosen = list({**now, key: linear.options[key][1]}.values())
            fit = self.fit(scores, chosen)
            share = np.sqrt(np.maximum(fit.held_out - state.fit.held_out, 0.0)) / self.share_scale
            result.append(Loss(float(share.max()), self.score(fit, chosen), key))
        return result

    def restrict(self, state: State, active: Sequence[str]) -> State:
        """A model with some of its effects only, fitted again."""
        gone = [c for c in self.pool if c.key in self.named(state.active) and c.key not in active]
        null = {s: self.nominal.value(s) for c in gone for s in c.symbols}
        return self.evaluate(state.vehicle.with_values(null), tuple(active), state.fit.in_sample)

    def replace(self, state: State, old: str, new: str, linear: Linearisation, scores: GramScores) -> State:
        """A model with one effect in place of another, fitted from the better of its shapes.

        Parameters
        ----------
        state : the model
        old, new : keys of the effect that goes and the one that comes
        linear, scores : columns about the model, `new` among them
        """
        now = {key: linear.options[key][0] for key in state.active}
        rest = {key: option for key, option in now.items() if key != old} | {old: linear.options[old][1]}
        shapes = [option for option in linear.options[new] if option.present]
        best = min(
            ({**rest, new: option} for option in shapes), key=lambda change: self.score_linearised(scores, change)
        )
        return self.apply(state, now, best, scores)

    def apply(self, state: State, now: dict[str, Option], change: dict[str, Option], scores: GramScores) -> State:
        """Make a change that was scored about the columns at hand, and refine it.

        Parameters
        ----------
        state : the model
        now, change : options by key, before the change and after it
        scores : of the columns about the model
        """
        chosen = list(change.values())
        fit = self.fit(scores, chosen)
        start = apply_fit(reset(state.vehicle, self.nominal, now, change), chosen, fit)
        return self.evaluate(start, present_keys(change), fit.in_sample)

    def is_material(self, without: State, within: State) -> bool:
        """True when what a model adds to another is material.

        It explains a material share of the force on some axis; or a smaller one, which is yet more than what stays
        unexplained there, sensor noise apart, and which changes 10 s rollouts. Where it removes most of the nominal
        model's error on an axis, a third of that change will do: the nominal model is as good as that.
        """
        share = self.unique_share(without, within)
        if (share >= self.settings.materiality).any():
            return True
        unexplained = np.sqrt(np.maximum(within.fit.held_out - self.noise_error**2, 0.0)) / self.share_scale
        if not (share >= np.maximum(self.settings.least, unexplained))[~self.quiet].any():
            return False
        removed = (without.fit.held_out - within.fit.held_out) / np.maximum(self.nominal_error, 1e-300)
        most = bool((removed >= MOST)[~self.quiet & (share >= self.settings.least)].any())
        parts = rollout_difference(self.balance.motions, without.vehicle, within.vehicle)
        return bool((parts >= self.settings.weight / (3.0 if most else 1.0))[~self.quiet].any())

    def with_general(self, keys: set[str]) -> set[str]:
        """Keys of effects, and of the general effects that hold any of them as a special case."""
        names = {c.effect.name for c in self.pool if c.key in keys}
        return keys | {c.key for c in self.pool if names & set(c.effect.includes)}

    def does_as_well(self, other: tuple[Fit, float], best: tuple[Fit, float]) -> bool:
        """True when a model cannot be told from a better one, or leaves immaterially more error.

        Parameters
        ----------
        other, best : fit and score of each; what is material is a share of the nominal model's squared error of an axis
        """
        lost = (other[0].held_out - best[0].held_out) / np.maximum(self.nominal_error, 1e-300)
        return bool(other[1] <= best[1] + TELL_APART or lost.max() < MATERIAL)

    def unique_share(self, without: State, within: State) -> Array:
        """Root of the held-out squared force error that a model removes, as a share of each axis' force scale (3,)."""
        return np.sqrt(np.maximum(without.fit.held_out - within.fit.held_out, 0.0)) / self.share_scale

    def has_residual_structure(self, error: Array) -> bool:
        """True when a mean square error (3,) is on some axis neither immaterial nor explained by sensor noise."""
        return self.unexplained(error) > 0.0

    def leaves_more_than_slight(self, error: Array) -> bool:
        """True when a mean square error (3,) has structure on an axis, and is no slight part of the force there."""
        material = np.sqrt(error) > SLIGHT * self.force_scale
        return bool((material & (self._excess(error) > 0.0)).any())

    def unexplained(self, error: Array) -> float:
        """Excess of a mean square error (3,) over the floor and sensor noise, relative to both, summed over axes."""
        return float(self._excess(error).sum())

    def _excess(self, error: Array) -> Array:
        least = np.maximum(self.floor, np.square(_STRUCTURE * self.noise_error))
        return np.maximum(error / least - 1.0, 0.0)

    def score_linearised(self, scores: GramScores, change: dict[str, Option]) -> float:
        """Score of a neighbouring model about the columns at hand, without refinement."""
        return self.score_all_linearised(scores, [change])[0]

    def score_all_linearised(
        self, scores: GramScores, changes: Sequence[dict[str, Option]], below: float = np.inf
    ) -> list[float]:
        """Scores of several of them.

        Parameters
        ----------
        below : scores above it need not be right: a model that is not below it without its limits keeps the score that
            it has then. Where limits calm a fit that predicts held-out blocks badly, a better model may be passed by
        """
        choices = [list(change.values()) for change in changes]
        free = np.isfinite(below)
        fits = self.fits(scores, choices, limited=not free)
        result = [self.score(fit, chosen) for fit, chosen in zip(fits, choices, strict=True)]
        again = [n for n, fit in enumerate(fits) if free and fit.held.any() and result[n] < below]
        for n, fit in zip(again, self.fits(scores, [choices[n] for n in again]), strict=True):
            result[n] = self.score(fit, choices[n])
        return result


def noise_by_block(balances: Array, block: np.ndarray) -> Array:
    """Summed squares that sensor noise adds to the balances (1 + copies, tests, 3) in each block, (blocks, 3)."""
    blocks = np.zeros((int(block.max()) + 1, 3))
    if balances.shape[0] > 1:
        np.add.at(blocks, block, ((balances[1:] - balances[0]) ** 2).mean(axis=0))
    return blocks


def present_keys(change: dict[str, Option]) -> tuple[str, ...]:
    """Keys of what a changed model holds: a dropped effect stays in it as absent."""
    return tuple(key for key, option in change.items() if option.present)


def reset(vehicle: Vehicle, nominal: Vehicle, now: dict[str, Option], change: dict[str, Option]) -> Vehicle:
    """The vehicle with everything that a change drops set back to nominal.

    Parameters
    ----------
    vehicle, nominal : the model, and the one without effects
    now, change : options by key, before the change and after it
    """
    gone = [option for key, option in now.items() if key not in present_keys(change)]
    return vehicle.with_values({s: nominal.value(s) for option in gone for s in option.symbols})


def apply_fit(vehicle: Vehicle, chosen: Sequence[Option], fit: Fit) -> Vehicle:
    """The vehicle with the fitted parameters set.

    Parameters
    ----------
    vehicle : about which the columns are
    chosen : an option for each effect of the model
    fit : change of each free column
    """
    by_column = dict(zip(fit.columns.tolist(), fit.change.tolist(), strict=True))
    values = {}
    for option in chosen:
        for symbol, start, index in zip(
            option.symbols, option.start, option.free or (-1,) * len(option.symbols), strict=True
        ):
            values[symbol] = start + by_column.get(index, 0.0)
    return vehicle.with_values(values)
