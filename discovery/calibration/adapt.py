"""Online adaptation: named parameters followed along a log as it is replayed, by least squares that forgets.

The rows are those of the weak form: a test function that ends now says what force the model misses, and its columns
what force each parameter would add. A row that excites a parameter makes what was known of it fade, towards what was
known at the start and no further (Kulhavy and Zarrop 1993; by parameter, Parkum, Poulsen and Holst 1992), and faster
while errors are larger than the noise explains (Fortescue, Kershenbaum and Ydstie 1981). A boat at rest keeps what it
knows.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...measurements.statistics.single_threaded import single_threaded
from ...physics.effects import Parameter, effect_named
from ...physics.errors import RequestError, expect
from ...physics.frames import Array
from ...physics.motion import Motion
from ...physics.vehicle import Vehicle
from ..balance.weak_form import WeakForm, WeakSettings
from ..candidates.candidate import Candidate, candidates, measurable
from ..candidates.linearisation import Linearisation
from ..identifiability.rehearsal import plausible_amounts, rehearse
from ..search.floating import Search, SearchSettings
from ..search.gram import bounded_solve

_MOTIONS = "undertow.prepare(undertow.read_log(LOG), vehicle, undertow.WEAK).motions are some"


@dataclass(frozen=True, slots=True)
class AdaptSettings:
    """How fast adaptation forgets, and what it trusts.

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
    weak: WeakSettings = field(default_factory=WeakSettings)

    def __post_init__(self) -> None:
        for name in ("forgetting", "materiality", "prior", "surprise"):
            if not getattr(self, name) > 0.0:
                raise RequestError(f"adapt: expected {name} above 0, got {getattr(self, name):g}")
        for name, least in (("excitation", 0.0), ("hurry", 1.0)):
            if not getattr(self, name) >= least:
                raise RequestError(f"adapt: expected {name} of at least {least:g}, got {getattr(self, name):g}")


@dataclass(frozen=True, slots=True, eq=False)
class Adapted:
    """Parameters along a replayed log.

    Attributes
    ----------
    symbols, units : of the parameters
    time : (n,) end of each test function, the instant at which its row was known [s]
    values : (n, p) total values of the parameters after each row, in their units
    deviation : (n, p) their standard deviations
    excited : (n,) True where the row counted
    delay : by which values lag behind `time`: a test function that ends now is centred so long ago [s]
    step : time between rows [s]
    error_before, error_after : (3,) root mean square force that the vehicle as it was, and as it was followed up to the
        row before, leaves unexplained [N, N, N m]
    """

    symbols: tuple[str, ...]
    units: tuple[str, ...]
    time: Array
    values: Array
    deviation: Array
    excited: np.ndarray
    delay: float
    step: float
    error_before: Array
    error_after: Array

    @property
    def excitation(self) -> Array:
        """Seconds of excitation up to and with each row, (n,) [s]."""
        return self.step * np.cumsum(self.excited)


@single_threaded
def adapt(
    motions: Sequence[Motion] | Motion, vehicle: Vehicle, effects: Sequence[str], settings: AdaptSettings | None = None
) -> Adapted:
    """Follow the parameters of effects along a log as it is replayed, without looking ahead.

    Only two constants per axis and an amount per parameter are known beforehand: the sensor noise and the size of the
    forces, taken from the log as a whole, and what change is plausible, from trials simulated on the vehicle.

    Parameters
    ----------
    motions : gap-free stretches in the order of time, unfiltered
    vehicle : the model at the start
    effects : names of the catalogue; `thruster_asymmetry[port]` chooses a thruster. The force must be linear in the
        parameters: damping, couplings, added mass, scales of thrust, wind and trim

    Raises
    ------
    RequestError
        for an unknown effect, one that is not linear in its parameters or needs channels that the log lacks, none or
        one twice, or a log that is too short.
    """
    settings = settings or AdaptSettings()
    expect("adapt: motions", motions, (Motion, Iterable), _MOTIONS)
    runs = [motions] if isinstance(motions, Motion | str) else list(motions)
    for motion in runs:
        expect("adapt: motions", motion, Motion, _MOTIONS)
    expect("adapt: vehicle", vehicle, Vehicle, "undertow.load_vehicle(PATH) reads one")
    expect("adapt: effects", effects, (list, tuple), 'give a list of names, such as ["surge_quadratic_damping"]')
    expect("adapt: settings", settings, AdaptSettings, "undertow.AdaptSettings(...) makes them")
    pool = _linear(runs, vehicle, effects)
    weak = WeakForm(runs, settings.weak)
    search = Search(weak, vehicle, pool, SearchSettings(materiality=settings.materiality))
    amounts = plausible_amounts(search, rehearse(search, vehicle, ()))
    linear = Linearisation(weak, vehicle, vehicle, pool, ())
    return _replayed(search, linear, amounts, settings)


def _linear(motions: Sequence[Motion], vehicle: Vehicle, names: Sequence[str]) -> tuple[Candidate, ...]:
    """The candidates that names mean, every thruster's where none is chosen."""
    every = candidates(vehicle)
    found: list[Candidate] = []
    for name in names:
        effect = effect_named(name.split("[")[0])
        bent = [p.symbol for p in effect.parameters if p.nonlinear or p.grid]
        if bent:
            raise RequestError(
                f"adapt {name}: expected an effect whose force is linear in its parameters, but it is not in "
                f"{', '.join(bent)}; find its value with discover or add, and put it into the vehicle"
            )
        if effect not in measurable(motions):
            raise RequestError(f"adapt {name}: expected the channels {' and '.join(effect.channels)} in every log")
        meant = [c for c in every if c.effect is effect and ("[" not in name or c.key == name)]
        if not meant:
            keys = ", ".join(c.key for c in every if c.effect is effect)
            raise RequestError(
                f"adapt {name}: {vehicle.name} has no such thruster; expected {keys or 'another effect'}"
            )
        found += meant
    if not found or len({c.key for c in found}) < len(found):
        raise RequestError(f"adapt: expected effects by name, each once, got {', '.join(names) or 'none'}")
    return tuple(found)


def _replayed(
    search: Search, linear: Linearisation, amounts: dict[str, tuple[float, ...]], settings: AdaptSettings
) -> Adapted:
    weak, vehicle = search.balance, search.nominal
    parameters = [p for c in search.pool for p in c.parameters]
    options = [linear.options[c.key][1] for c in search.pool]
    columns = linear.columns[:, :, [index for option in options for index in option.free]]
    prior = settings.prior * np.array([amount for c in search.pool for amount in amounts[c.key]])
    noise = np.sqrt(search.noise_error**2 + search.floor)
    follower = Follower(parameters, vehicle, prior, settings)
    told = np.abs(columns * prior) >= settings.excitation * noise[:, None]
    rows = told.any(axis=2)
    balance = linear.columns[:, :, -1]
    error = np.empty_like(balance)
    values, deviation = np.empty((2, balance.shape[0], prior.size))
    for k in range(balance.shape[0]):
        error[k] = balance[k] - columns[k] @ follower.change
        if rows[k].any():
            scale = noise[rows[k]]
            follower.take(columns[k, rows[k]] / scale[:, None], balance[k, rows[k]] / scale, told[k].any(axis=0))
        values[k], deviation[k] = follower.value, follower.deviation
    half = settings.weak.half_width
    return Adapted(
        tuple(p.symbol for p in parameters),
        tuple(p.unit for p in parameters),
        weak.time + half,
        values,
        deviation,
        rows.any(axis=1),
        half,
        settings.weak.stride,
        np.sqrt((balance**2).mean(axis=0)),
        np.sqrt((error**2).mean(axis=0)),
    )


class Follower:
    """Recursive least squares that forgets what is excited, under limits, in the information form.

    Parameters
    ----------
    parameters : what is followed, with limits
    vehicle : where the parameters start
    prior : (p,) standard deviations at the start, which are also the largest
    settings : how fast it forgets

    Attributes
    ----------
    change : (p,) change of each parameter from the start
    information : (p, p) inverse of their covariance, were the noise as expected
    surprise : (p,) mean square of recent errors of rows that inform each parameter, over what was expected; at least 1
    """

    def __init__(
        self, parameters: Sequence[Parameter], vehicle: Vehicle, prior: Array, settings: AdaptSettings
    ) -> None:
        self._start = np.array([vehicle.value(p.symbol) for p in parameters])
        self._lower = np.minimum(np.array([p.lower for p in parameters]) - self._start, 0.0)
        self._upper = np.maximum(np.array([p.upper for p in parameters]) - self._start, 0.0)
        self._rate = settings.weak.stride / settings.forgetting
        self._calmed = float(np.exp(-settings.weak.stride / settings.surprise))
        self._share = settings.weak.stride / settings.weak.half_width
        self._most = settings.hurry
        self._prior = prior
        self.change = np.zeros(prior.size)
        self.information = np.diag(1.0 / prior**2)
        self.surprise = np.ones(prior.size)

    @property
    def value(self) -> Array:
        """Total values of the parameters, (p,)."""
        return self._start + self.change

    @property
    def deviation(self) -> Array:
        """Standard deviations of the values, (p,)."""
        return np.sqrt(np.diag(np.linalg.inv(self.information)) * self.surprise)

    def take(self, columns: Array, balance: Array, excited: np.ndarray) -> None:
        """Take a row of each axis that informs.

        Parameters
        ----------
        columns : (axes, p) force that a unit of each parameter adds, over the noise
        balance : (axes,) force that the model at the start misses, over the noise
        excited : (p,) True for a parameter that the rows excite, so that what was known of it fades
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
        # Tests overlap: together they tell as much as one in every half width.
        self.information = faded + self._share * columns.T @ columns
        self.change = self._within(self.change + np.linalg.solve(self.information, self._share * columns.T @ error))

    def _within(self, change: Array) -> Array:
        """The nearest change within the limits, in the metric of the information (Goodwin and Sin 1984, chapter 3)."""
        if ((change >= self._lower) & (change <= self._upper)).all():
            return change
        scale = np.sqrt(np.diag(self.information))
        metric = self.information / (scale[:, None] * scale[None, :])
        found, _ = bounded_solve(metric, metric @ (change * scale), self._lower * scale, self._upper * scale)
        return np.clip(found / scale, self._lower, self._upper)
