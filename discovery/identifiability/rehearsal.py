"""Trials of the library simulated on a model: every candidate's force along them, and which candidates look alike."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Strict

from ...measurements.statistics.signals import sensor_noise
from ...physics.file_records import Number, Record
from ...physics.motion import Array, Motion
from ...physics.presentation import words
from ...physics.vehicle import Vehicle
from ...physics.worlds.manoeuvres import TRIALS, Trial, drive
from ..balance.weak_form import WeakForm
from ..candidates.candidate import Candidate
from ..candidates.linearisation import Linearisation, Option
from ..search.floating import Search

PLAUSIBLE = 0.25
"""Share of the force at work that a plausible amount of an effect makes in the trial in which it shows most."""
_BESIDE = 0.1
"""Share of the largest share below which an effect does not act on an axis, but spills over to it."""
_ANY = 1e4
"""Amount that stands for any, where no rehearsal tells what is plausible."""
_LARGEST = {"cg_offset": 0.3, "lateral_cg": 0.1}
"""Amounts beyond which an effect is not plausible, where its physical limits are wider [its unit]."""

_NOISE_SEED = 20041
"""Any number: all trials are compared under the same noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Rehearsal:
    """The trials as one model drives them.

    Attributes
    ----------
    trials : those that did not diverge
    linear : every candidate's columns about the model, free of noise, (tests, 3, columns + 1)
    trial : (tests,) index of the trial that each test function lies in, -1 where it reaches across two runs
    force : (tests, 3) largest contribution to the balance [N, N, N m]
    noise : (tests, 3) what sensors as noisy as the log's would add to the balance [N, N, N m]; None for as much as in
        the log. Fast turns multiply it
    """

    trials: tuple[Trial, ...]
    linear: Linearisation
    trial: np.ndarray
    force: Array
    noise: Array | None = None

    def noise_squares(self, error: Array) -> Array:
        """Summed squares of the noise over each trial (trials, 3); `error` (3,) is its root mean square in the log."""
        rows = [self.trial == k for k in range(len(self.trials))]
        if self.noise is None:
            return np.array([row.sum() * error**2 for row in rows])
        return np.array([(self.noise[row] ** 2).sum(axis=0) for row in rows])

    def moments(self, scale: Array) -> tuple[Array, Array, np.ndarray]:
        """Sums over each trial: column products (trials, 3, p, p) of columns over `scale`, squared force, tests."""
        gram, force, tests = [], [], []
        for k in range(len(self.trials)):
            rows = self.trial == k
            columns = (self.linear.columns[rows] / scale).transpose(1, 2, 0)
            gram.append(columns @ columns.transpose(0, 2, 1))
            force.append((self.force[rows] ** 2).sum(axis=0))
            tests.append(int(rows.sum()))
        return np.array(gram), np.array(force), np.array(tests)


def rehearse(search: Search, vehicle: Vehicle, active: Sequence[str]) -> Rehearsal | None:
    """Drive every trial of the library on a vehicle and take the columns of a search's candidates about it.

    The trials begin on the heading on which the log begins, and all are driven when it ends: what changes by the minute
    has then done all that the log can show of it. When all of them diverge, as they may on a vehicle that a
    doubtful fit has made, the nominal vehicle drives them; None when they diverge there too.

    Parameters
    ----------
    active : keys of the candidates present in `vehicle`
    """
    motions = search.balance.motions
    heading, end = float(motions[0].heading[0]), max(float(motion.minutes[-1]) for motion in motions)
    for driver in (vehicle, search.nominal):
        driven = drive(driver, TRIALS, heading, end)
        if any(driven):
            return rehearsal_of(search, vehicle, active, TRIALS, driven)
    return None


def rehearsal_of(
    search: Search,
    vehicle: Vehicle,
    active: Sequence[str],
    trials: Sequence[Trial],
    driven: Sequence[Sequence[Motion]],
    *,
    sensed: bool = False,
) -> Rehearsal:
    """The columns of a search's candidates about a vehicle, along trials that were driven.

    Parameters
    ----------
    active : keys of the candidates present in `vehicle`
    trials : any, see `drive`
    driven : the motions of each, at least one of one; trials without a motion are left out
    sensed : work out the noise of sensors along the trials
    """
    runs = [(n, run) for n, several in enumerate(driven) for run in several]
    settings = search.balance.tests
    numbers = list(dict.fromkeys(n for n, _ in runs))
    # One long motion is far quicker than many; test functions across its joints are left out.
    motion = _joined([run for _, run in runs])
    weak = WeakForm([motion], replace(settings, copies=0))
    ends = np.cumsum([run.time.size for _, run in runs])
    row = np.round((weak.time - motion.time[0]) / motion.time_step).astype(int)
    half = round(settings.half_width / motion.time_step)
    first, last = (np.searchsorted(ends, row + reach, side="right") for reach in (-half, half))
    of_run = np.array([numbers.index(n) for n, _ in runs])
    trial = np.where(first == last, of_run[np.minimum(first, len(runs) - 1)], -1)
    linear = Linearisation(weak, vehicle, search.nominal, search.pool, active)
    noise = _noise(search, weak, motion) if sensed else None
    return Rehearsal(tuple(trials[n] for n in numbers), linear, trial, weak.largest_contribution(search.nominal), noise)


def _noise(search: Search, weak: WeakForm, motion: Motion) -> Array:
    """What white noise as strong as the log's adds to the balance of a motion (tests, 3), drawn once."""
    form = search.balance
    deviation = sensor_noise(form.motions) * np.sqrt(form.motions[0].time_step / motion.time_step)
    drawn = np.random.default_rng(_NOISE_SEED).standard_normal(motion.velocity.shape) * deviation
    noisy = WeakForm([replace(motion, velocity=motion.velocity + drawn)], weak.settings)
    return noisy.residual(search.nominal) - weak.residual(search.nominal)


def amplitude_columns(candidate: Candidate, options: Sequence[Option]) -> tuple[int, ...]:
    """Columns of a candidate's amplitudes, as it stands or, if absent, in the middle one of its shapes.

    Lag, delay and dead zone have no amplitude: their column is the force that the whole effect adds or takes.
    """
    present = [option for option in options[1:] if option.present]
    here = options[0] if options[0].present else present[len(present) // 2]
    if candidate.effect.fixed_amplitude:
        return (options[1].offset if options[0].present else here.offset,)
    pairs = zip(candidate.parameters, here.free, strict=True)
    return tuple(index for parameter, index in pairs if index >= 0 and not parameter.grid)


def plausible_amounts(search: Search, rehearsal: Rehearsal | None) -> dict[str, tuple[float, ...]]:
    """A plausible amount of every candidate, for each of its amplitude columns [the parameter's unit].

    The amount that makes a quarter of the force at work in the trial in which it shows most, on the axis in which it
    shows least (axes with less than a tenth of the largest share do not count), within the physical limits; 1 for lag,
    delay and dead zone, whose column is already that of a middling one. Where the nominal vehicle diverges in every
    trial, as one with wrong signs does, any amount at all is plausible.

    Parameters
    ----------
    rehearsal : of the nominal vehicle, with all candidates absent
    """
    if rehearsal is None:
        sizes = {c.key: 1.0 if c.effect.fixed_amplitude else _ANY for c in search.pool}
        return {c.key: (sizes[c.key],) * max(1, len(c.effect.amplitudes)) for c in search.pool}
    gram, force, tests = rehearsal.moments(np.ones(rehearsal.linear.columns.shape[2]))
    square = gram.diagonal(axis1=2, axis2=3) / tests[:, None, None]
    scale = np.maximum(force / tests[:, None], force.sum(axis=0) / tests.sum())
    share = np.sqrt(square / np.maximum(scale, 1e-18)[:, :, None]).max(axis=0)
    share = np.where(share >= _BESIDE * share.max(axis=0), share, np.inf).min(axis=0)
    amounts = {}
    for candidate in search.pool:
        options = rehearsal.linear.options[candidate.key]
        columns = amplitude_columns(candidate, options)
        if candidate.effect.fixed_amplitude:
            amounts[candidate.key] = (1.0,)
            continue
        limits = {n.column: max(abs(n.lower), abs(n.upper)) for option in options for n in option.numbers}
        most = _LARGEST.get(candidate.key, np.inf)
        wanted = (PLAUSIBLE / max(float(share[index]), 1e-12) for index in columns)
        amounts[candidate.key] = tuple(min(w, most, limits[k]) for w, k in zip(wanted, columns, strict=True))
    return amounts


def _joined(runs: Sequence[Motion]) -> Motion:
    rows, step = sum(run.time.size for run in runs), runs[0].time_step
    return Motion(
        step * np.arange(rows, dtype=float),
        np.concatenate([run.position for run in runs]),
        np.concatenate([run.heading for run in runs]),
        np.concatenate([run.velocity for run in runs]),
        np.concatenate([run.commands for run in runs]),
        runs[0].thrusters,
        minutes=np.concatenate([run.minutes for run in runs]),
    )


Ratio = Annotated[float, BeforeValidator(lambda value: math.inf if value is None else value), Strict()]
"""A ratio that JSON has as null where it is infinite."""


class Excitation(Record):
    """Excitation of one candidate by a log.

    Attributes
    ----------
    share : root mean square force of a plausible amount, over the force scale of the axis on which it is largest
    signal_to_noise : of its clearest column, all axes together; infinite where sensor noise does not enter
    """

    share: Number
    signal_to_noise: Ratio = math.inf


class Identifiability(Record):
    """Identifiability of all candidates about one model.

    Attributes
    ----------
    groups : keys of candidates that move alike, each with a canonical correlation above 0.98 with another of its group;
        without effects of which simpler ones are special cases
    dormant : keys of candidates of which a plausible amount leaves no material force
    absorbed : keys of candidates of which a plausible amount leaves none beside what calibration can explain
    noise_limited : keys of candidates whose columns are hardly more than sensor noise
    quiet_axes : those on which hardly anything but sensor noise is at work
    condition : of the matrix of all other columns, each scaled to length one; None when there are none. All thrusters'
        common scale is left out beside those of each thruster, whose sum it is, and so is the thrust curve.
    excitation : by key of the candidate
    """

    groups: tuple[tuple[str, ...], ...] = ()
    dormant: tuple[str, ...] = ()
    absorbed: tuple[str, ...] = ()
    noise_limited: tuple[str, ...] = ()
    quiet_axes: tuple[str, ...] = ()
    condition: Number | None = None
    excitation: Mapping[str, Excitation] = {}

    def alike(self, key: str) -> tuple[str, ...]:
        """The other candidates in the group of a candidate."""
        return tuple(other for group in self.groups if key in group for other in group if other != key)

    @property
    def sentence(self) -> str:
        """Candidates that the log cannot show or tell apart, for a line of progress."""
        blind = [words(key) for key in (*self.dormant, *self.absorbed, *self.noise_limited)]
        groups = [" and ".join(map(words, group)) for group in self.groups]
        told = [f"does not show {', '.join(blind)}"] if blind else []
        told += [f"hardly tells apart {'; '.join(groups)}"] if groups else []
        return (
            f"before the search: this log {', and '.join(told) or 'shows every effect, and no two of them move alike'}"
        )
