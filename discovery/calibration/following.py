"""Online adaptation: parameters followed row by row as motion comes in, or along a whole log without looking ahead.

Rows are those of the weak form: a test function that ends now gives the missing force, its columns the force of each
parameter. Only effects in which the force is linear are followed, and the last layer of a network beside them
(as O'Connell et al. 2022, doi:10.1126/scirobotics.abm6597, do). The noise of a row comes from a stretch of
motion, the plausible change of a parameter from trials simulated on the vehicle.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np

from ...measurements.statistics.processors import single_threaded
from ...physics.effects import effect_named
from ...physics.errors import RequestError, expect
from ...physics.laws.damping_power import Envelope, envelope_of
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle, lacking
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Candidate, calibratable, candidates, measurable, nuisance_candidates
from ..candidates.linearisation import Linearisation
from ..identifiability.rehearsal import plausible_amounts, rehearse
from ..lawful.nearest_lawful import LawfulSet
from ..search.floating import Search, SearchSettings
from .change_watch import Alarm, AlarmSettings, ChangeWatch, calibrate_widening
from .forgetting_fit import AdaptationPrior, AdaptSettings, Carried, ForgettingFit

_DAMPING = "_damping"
"""How the names of the effects of damping on an axis end."""


def followed_by_default(vehicle: Vehicle) -> tuple[str, ...]:
    """The damping that stands in the vehicle, and the scale of each thruster."""
    found = []
    for candidate in candidates(vehicle):
        damping = candidate.effect.name.endswith(_DAMPING) and any(vehicle.value(s) for s in candidate.symbols)
        if damping or candidate.effect.name == "thruster_asymmetry":
            found.append(candidate.key)
    return tuple(found)


def candidates_to_follow(
    vehicle: Vehicle, names: Sequence[str], motions: Sequence[Motion] = ()
) -> tuple[Candidate, ...]:
    """The candidates that names mean, every thruster's where none is chosen.

    Parameters
    ----------
    motions : that must have the channels that the effects need; none where that is not known yet

    Raises
    ------
    RequestError
        for an unknown effect, one that is not linear in its parameters, needs channels that the motions lack or for
        which the vehicle file states too little, none or one twice.
    """
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
        if lacks := lacking(vehicle, effect):
            raise RequestError(f"adapt: {name} {lacks}")
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


def held_parameters(vehicle: Vehicle, symbols: Sequence[str]) -> tuple[Candidate, ...]:
    """Candidates for the numbers that stand in the vehicle, are not followed, and move the force in proportion."""
    held = [s for s in calibratable(vehicle) if s not in symbols]
    bent = [s for s in held if vehicle.parameter(s).nonlinear or vehicle.parameter(s).grid]
    return nuisance_candidates(vehicle, [s for s in held if s not in bent])


_GROWS = 1.1
"""Times a speed by which the envelope of the laws grows when the boat goes beyond it, so that it grows seldom."""


@dataclass(frozen=True, slots=True, eq=False)
class Update:
    """The parameters after a test function.

    Attributes
    ----------
    time : end of the test function, the instant at which its row was known [s]
    values : (p,) total values of the parameters, in their units
    deviation : (p,) their standard deviations
    excited : the row counted
    before, error : (3,) force that the vehicle as it was, and as it was followed up to the row before, leaves
        unexplained [N, N, N m]
    alarm : a change that was noticed now
    """

    time: float
    values: Array
    deviation: Array
    excited: bool
    before: Array
    error: Array
    alarm: Alarm | None = None


def learn_prior(
    motions: Sequence[Motion],
    vehicle: Vehicle,
    pool: Sequence[Candidate],
    settings: AdaptSettings,
    carrying: Callable[[Array], Carried] | None = None,
) -> AdaptationPrior:
    """Learn the noise of a row and the size of the forces from motions, and what change is plausible from trials.

    Parameters
    ----------
    motions : a stretch of motion in which the model is as the file says
    vehicle : the model before anything changes
    pool : the candidates that are followed
    settings : of the adaptation
    carrying : makes a correction whose parameters are followed beside them, given the noise of a row (3,)

    Raises
    ------
    RequestError
        when the motions are too short.
    """
    weak = WeakForm(motions, settings.weak)
    search = Search(weak, vehicle, pool, SearchSettings(materiality=settings.materiality))
    amounts = plausible_amounts(search, rehearse(search, vehicle, ()))
    noise = np.sqrt(search.noise_error**2 + search.floor)
    each = np.array([amount for candidate in pool for amount in amounts[candidate.key]])
    carried = None if carrying is None else carrying(noise)
    each = each if carried is None else np.append(each, carried.amounts)
    seconds = sum(motion.duration for motion in motions)
    return AdaptationPrior(vehicle, tuple(pool), settings, noise, each, envelope_of(motions, vehicle), seconds, carried)


class TestedRows:
    """Motions as rows of the weak form, test function by test function.

    Parameters
    ----------
    vehicle : the model at the start
    pool : candidates whose parameters are followed
    settings : test functions
    carried : a correction whose parameters are followed, too: their columns come after those of the pool
    """

    def __init__(
        self, vehicle: Vehicle, pool: Sequence[Candidate], settings: AdaptSettings, carried: Carried | None = None
    ) -> None:
        self._vehicle, self._pool, self._carried = vehicle, tuple(pool), carried
        self._settings = replace(settings.weak, copies=0, blocks=1)
        self._tail: Motion | None = None
        self._like: WeakForm | None = None
        self._memory: Any = None
        self._forces = np.zeros((0, 3, 0))

    def of(self, motion: Motion) -> tuple[Array, Array, Array]:
        """Rows that are known with the next motion, whether it goes on where the last one ended or begins anew.

        Returns
        -------
        (time, columns, balance)
            (n,) ends of the test functions [s]; (n, 3, p) force that a unit of each parameter adds; (n, 3) force that
            the vehicle at the start leaves unexplained [N, N, N m]
        """
        whole = motion
        if self._tail is not None:
            late = motion.time[0] - self._tail.time[-1] - motion.time_step
            whole = self._tail.followed_by(motion) if abs(late) < 0.01 * motion.time_step else motion
        forces = self._carried_forces(whole, whole.time.size - motion.time.size)
        half = max(2, round(self._settings.half_width / whole.time_step))
        stride = max(1, round(self._settings.stride / whole.time_step))
        count = len(range(half, whole.time.size - half, stride))
        left = whole.time.size - count * stride
        self._tail = whole.slice(count * stride, whole.time.size) if count and left > 1 else None if count else whole
        self._forces = forces[count * stride :]
        size = sum(len(candidate.parameters) for candidate in self._pool) + forces.shape[2]
        if not count:
            return np.zeros(0), np.zeros((0, 3, size)), np.zeros((0, 3))
        weak = self._like = WeakForm([whole], self._settings, like=self._like)
        linear = Linearisation(weak, self._vehicle, self._vehicle, self._pool, ())
        free = [index for c in self._pool for index in linear.options[c.key][1].free]
        columns, balance = linear.columns[:, :, free], linear.columns[:, :, -1]
        if self._carried is not None:
            more = weak.average([forces.reshape(len(forces), -1)]).reshape(len(columns), 3, -1)
            columns, balance = np.concatenate([columns, more], axis=2), balance - more @ self._carried.start
        return weak.time + self._settings.half_width, columns, balance

    def _carried_forces(self, whole: Motion, known: int) -> Array:
        """Force of a unit of each parameter that is carried along the rows of a motion, of which some are known."""
        if self._carried is None:
            return np.zeros((whole.time.size, 3, 0))
        memory = self._memory if known else None
        added, self._memory = self._carried.along(whole, whole.time.size - known, memory)
        force = np.einsum("ij,njq->niq", mass_matrix(self._vehicle), added)
        return np.concatenate([self._forces, force]) if known else force


class Follower:
    """Follows the parameters of effects as motion comes in.

    Parameters
    ----------
    known : of the boat and its log, and what is followed
    watch : looks for changes; None for nobody

    Attributes
    ----------
    symbols, units : of the parameters
    """

    def __init__(self, known: AdaptationPrior, watch: ChangeWatch | None = None) -> None:
        parameters, vehicle, settings = known.parameters, known.vehicle, known.settings
        self.symbols = known.symbols
        self.units = (*(p.unit for p in parameters), *["1"] * (len(self.symbols) - len(parameters)))
        self._known, self._watch = known, watch
        held = held_parameters(vehicle, self.symbols)
        self._deviation = settings.held * np.abs([vehicle.value(c.symbols[0]) for c in held])
        start = known.start[: len(parameters)]
        self._limits = (
            np.minimum([p.lower for p in parameters], start),
            np.maximum([p.upper for p in parameters], start),
        )
        self._prior = settings.prior * known.amounts
        self._rows = TestedRows(vehicle, (*known.pool, *held), settings, known.carried)
        import_module("scipy.ndimage")  # which an envelope that grows may ask for: no update waits until it is loaded
        self._hold(known.envelope)
        self._fit = ForgettingFit(known.start, self._prior, settings, self._nearest, len(held))

    def take(self, motion: Motion) -> list[Update]:
        """Follow the next rows of motion: an update for each test function that ends in them."""
        self._watch_envelope(motion)
        times, every, balances = self._rows.of(motion)
        own = len(self._known.parameters)
        held = every[:, :, own : own + self._deviation.size]
        columns = np.concatenate([every[:, :, :own], every[:, :, own + self._deviation.size :]], axis=2)
        told = np.abs(columns * self._prior) >= self._known.settings.excitation * self._known.noise[:, None]
        return [self._taken(*row) for row in zip(times.tolist(), columns, balances, told, held, strict=True)]

    def _taken(self, time: float, columns: Array, balance: Array, told: np.ndarray, held: Array) -> Update:
        error = balance - columns @ self._fit.change
        rows, alarm = told.any(axis=1), None
        if rows.any():
            scale = self._known.noise[rows]
            scaled = columns[rows] / scale[:, None], balance[rows] / scale
            self._fit.take(*scaled, np.asarray(told.any(axis=0)), held[rows] * self._deviation / scale[:, None])
            alarm = None if self._watch is None else self._watch.take(time, *scaled)
        return Update(time, self._fit.value, self._fit.deviation, bool(rows.any()), balance, error, alarm)

    def _nearest(self, values: Array, information: Array) -> Array:
        """The nearest values of which those of the vehicle are lawful; what is carried follows them, under no law."""
        own = len(self._known.parameters)
        within, across, beyond = information[:own, :own], information[:own, own:], information[own:, own:]
        pulled = np.linalg.solve(beyond, across.T)
        found = self._lawful.nearest(values[:own], within - across @ pulled)
        return np.append(found, values[own:] - pulled @ (found - values[:own]))

    def _hold(self, envelope: Envelope) -> None:
        """Keep the laws over an envelope."""
        self._envelope = envelope
        own = [parameter.symbol for parameter in self._known.parameters]
        units = dict(zip(own, self._known.amounts[: len(own)].tolist(), strict=True))
        self._lawful = LawfulSet(self._known.vehicle, units, self._limits, envelope)

    def _watch_envelope(self, motion: Motion) -> None:
        """Let the envelope grow where the boat goes beyond it; a peak that is gone in a moment is a sensor's."""
        low, high = np.array(self._envelope.lower), np.array(self._envelope.upper)
        if not ((motion.velocity < low) | (motion.velocity > high)).any():
            return
        reached = envelope_of([motion], self._known.vehicle)
        beyond_low, beyond_high = np.array(reached.lower) < low, np.array(reached.upper) > high
        if beyond_low.any() or beyond_high.any():
            lower = np.where(beyond_low, _GROWS * np.array(reached.lower), low).round(3).tolist()
            upper = np.where(beyond_high, _GROWS * np.array(reached.upper), high).round(3).tolist()
            self._hold(Envelope((lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])))


def rehearsed_watch(motions: Sequence[Motion], known: AdaptationPrior, alarms: AlarmSettings) -> ChangeWatch | None:
    """A watch whose budget is rehearsed with the noise of motions in which nothing changes; None where too few tell.

    Parameters
    ----------
    motions : in which nothing changes
    known : of the boat and its log, and what is followed, see `learn_prior`
    alarms : the budget of false alarms
    """
    widening = calibrate_widening(*informing_rows(motions, known), known, alarms)
    return None if widening is None else ChangeWatch(known, alarms, widening)


def informing_rows(motions: Sequence[Motion], known: AdaptationPrior) -> tuple[Array, Array]:
    """Columns (n, 3, p) and balance (n, 3) of the rows of motions that inform, over the noise."""
    tested = TestedRows(known.vehicle, known.pool, known.settings, known.carried)
    rows = [tested.of(motion) for motion in motions]
    columns = np.concatenate([row[1] for row in rows]) / known.noise[:, None]
    balance = np.concatenate([row[2] for row in rows]) / known.noise
    told = (np.abs(columns * known.amounts) >= known.settings.excitation).any(axis=(1, 2))
    return columns[told], balance[told]


_MOTIONS = "undertow.prepare(undertow.read_log(LOG), vehicle, undertow.WEAK).motions are some"


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

    Noise and size of the forces are taken from the log as a whole; `undertow adapt` follows a log that grows, and takes
    them from its beginning.

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
    pool = candidates_to_follow(vehicle, effects, runs)
    follower = Follower(learn_prior(runs, vehicle, pool, settings))
    updates = [update for motion in runs for update in follower.take(motion)]
    return Adapted(
        follower.symbols,
        follower.units,
        np.array([update.time for update in updates]),
        np.array([update.values for update in updates]),
        np.array([update.deviation for update in updates]),
        np.array([update.excited for update in updates]),
        settings.weak.half_width,
        settings.weak.stride,
        np.sqrt(np.mean([update.before**2 for update in updates], axis=0)),
        np.sqrt(np.mean([update.error**2 for update in updates], axis=0)),
    )
