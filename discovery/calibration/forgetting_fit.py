"""Recursive least squares with directional forgetting, held within the lawful set.

A row that excites a parameter makes old knowledge of it fade, back to the prior and no further (Kulhavy and Zarrop
1993; by parameter, Parkum, Poulsen and Holst 1992), and faster while errors exceed the noise (Fortescue, Kershenbaum
and Ydstie 1981). A boat at rest keeps what it knows.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ...physics.effects import Parameter
from ...physics.errors import RequestError
from ...physics.laws.damping_power import Envelope
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from ..balance.base import WeakSettings
from ..candidates.candidate import Candidate

Nearest = Callable[[Array, Array], Array]
"""Given values (p,) and an information matrix, the nearest values that are allowed."""


@dataclass(frozen=True, slots=True)
class AdaptSettings:
    """Settings of an adaptation: forgetting, excitation, prior and surprise.

    Attributes
    ----------
    forgetting : time constant with which information fades while the boat excites it [s]; infinite for none
    excitation : a row excites a parameter when a plausible change of it would make a force of so many times the row's
        noise, and counts when it excites any; 0 for every row
    materiality : force that no model of this kind explains, as a share of the force scale of an axis; noise of a row is
        what sensors and this make together
    prior : deviation of each parameter at the start, in plausible amounts
    surprise : time constant over which squared errors are averaged and held against what noise and deviations explain
        [s]; the ratio, if above 1, widens the deviations and hastens the forgetting
    hurry : most times that it hastens it; 1 for always the same forgetting
    held : deviation of the numbers of the vehicle that are not followed, as a share of each: what they would move the
        values by is a part of the deviations; 0 for a vehicle that is exact beside what is followed
    weak : test functions

    Raises
    ------
    RequestError
        when a number is out of range.
    """

    forgetting: float = 15.0
    excitation: float = 1.0
    materiality: float = 0.02
    prior: float = 1.0
    surprise: float = 3.0
    hurry: float = 10.0
    held: float = 0.06
    weak: WeakSettings = field(default_factory=WeakSettings)

    def __post_init__(self) -> None:
        for name in ("forgetting", "materiality", "prior", "surprise"):
            if not getattr(self, name) > 0.0:
                raise RequestError(f"adapt: expected {name} above 0, got {getattr(self, name):g}")
        for name, least in (("excitation", 0.0), ("hurry", 1.0), ("held", 0.0)):
            if not getattr(self, name) >= least:
                raise RequestError(f"adapt: expected {name} of at least {least:g}, got {getattr(self, name):g}")

    @property
    def share(self) -> float:
        """Weight of a row: tests overlap, and together they tell as much as one in every half width."""
        return self.weak.stride / self.weak.half_width


class Carried(Protocol):
    """A correction of the acceleration that is linear in its parameters, followed beside the numbers of the vehicle.

    Attributes
    ----------
    symbols : names of its q parameters, which are plain numbers
    start, amounts : (q,) their values at the start, and a plausible change of each
    gains : how many of them, the first, have a meaning of their own: changes of these ring, and they are shown
    """

    symbols: tuple[str, ...]
    start: Array
    amounts: Array
    gains: int

    def along(self, motion: Motion, fresh: int, memory: Any) -> tuple[Array, Any]:
        """What a unit of each parameter adds along the last rows of a motion (fresh, 3, q), and what it remembers.

        Parameters
        ----------
        fresh : rows that have come since the memory was given
        memory : of the call before; None for a motion that begins
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class AdaptationPrior:
    """What is followed of a boat, and what is known of it and its log before.

    Attributes
    ----------
    vehicle : the model at the start
    pool : candidates whose parameters are followed
    settings : of the adaptation
    noise : (3,) noise of a row: what sensors, and forces that no model of this kind explains, make together
        [N, N, N m]
    amounts : (p,) a plausible change of each parameter, in its unit
    envelope : velocities relative to the water over which the laws are kept
    seconds : of motion from which this is known
    carried : a correction whose parameters are followed, too, after those of the pool
    """

    vehicle: Vehicle
    pool: tuple[Candidate, ...]
    settings: AdaptSettings
    noise: Array
    amounts: Array
    envelope: Envelope
    seconds: float
    carried: Carried | None = None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Of the vehicle, that are followed."""
        return tuple(parameter for candidate in self.pool for parameter in candidate.parameters)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Names of all that is followed, p of them."""
        own = tuple(parameter.symbol for parameter in self.parameters)
        return own if self.carried is None else own + self.carried.symbols

    @property
    def watched(self) -> int:
        """How many of them, the first, ring when they change."""
        return len(self.parameters) + (0 if self.carried is None else self.carried.gains)

    @property
    def start(self) -> Array:
        """Their values at the start, (p,)."""
        own = np.array([self.vehicle.value(parameter.symbol) for parameter in self.parameters])
        return own if self.carried is None else np.append(own, self.carried.start)


class ForgettingFit:
    """Recursive least squares in the information form.

    Parameters
    ----------
    start : (p,) values at the start
    prior : (p,) standard deviations at the start, which are also the largest
    settings : how fast it forgets
    nearest : the nearest allowed values, in the metric of the information (Goodwin and Sin 1984, chapter 3)

    Attributes
    ----------
    change : (p,) change of each parameter from the start
    information : (p, p) inverse of their covariance, were the noise as expected
    surprise : (p,) mean square of recent errors of rows that inform each parameter, over what was expected; at least 1
    leaning : (p, m) what a deviation of each parameter that is held moves the values by
    """

    def __init__(self, start: Array, prior: Array, settings: AdaptSettings, nearest: Nearest, held: int = 0) -> None:
        self._start, self._prior, self._nearest = start, prior, nearest
        self._rate = settings.weak.stride / settings.forgetting
        self._calmed = float(np.exp(-settings.weak.stride / settings.surprise))
        self._share, self._most = settings.share, settings.hurry
        self.change = np.zeros(prior.size)
        self.information = np.diag(1.0 / prior**2)
        self.surprise = np.ones(prior.size)
        self.leaning = np.zeros((prior.size, held))

    @property
    def value(self) -> Array:
        """Total values of the parameters, (p,)."""
        return self._start + self.change

    @property
    def deviation(self) -> Array:
        """Standard deviations of the values, (p,)."""
        rows = np.diag(np.linalg.inv(self.information)) * self.surprise
        return np.sqrt(rows + (self.leaning**2).sum(axis=1))

    def take(self, columns: Array, balance: Array, excited: np.ndarray, held: Array) -> None:
        """Take a row of each axis that informs.

        Parameters
        ----------
        columns : (axes, p) force that a unit of each parameter adds, over the noise
        balance : (axes,) force that the model at the start misses, over the noise
        excited : (p,) True for a parameter that the rows excite, so that what was known of it fades
        held : (axes, m) force that a deviation of each parameter that is held adds, over the noise
        """
        error = balance - columns @ self.change
        expected = 1.0 + np.diag(columns @ np.linalg.solve(self.information, columns.T))
        weight = (columns * self._prior) ** 2
        ratio = (weight * (error**2 / expected)[:, None]).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-300)
        calm = np.maximum(self._calmed * self.surprise + (1.0 - self._calmed) * ratio, 1.0)
        self.surprise = np.where(excited, calm, self.surprise)
        hurry = np.clip(self.surprise, 1.0, self._most)
        kept = np.where(excited, np.exp(-0.5 * self._rate * hurry), 1.0)
        faded = self.information * np.outer(kept, kept) + np.diag((1.0 - kept**2) / self._prior**2)
        self.information = faded + self._share * columns.T @ columns
        # What the held ones make of the balance moves the values as the balance does.
        errors = np.column_stack([error, held - columns @ self.leaning])
        steps = np.linalg.solve(self.information, self._share * columns.T @ errors)
        self.change = self._nearest(self._start + self.change + steps[:, 0], self.information) - self._start
        self.leaning = self.leaning + steps[:, 1:]
