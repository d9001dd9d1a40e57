"""The choice of the balance for a log: the force balance where its residual is white noise, else open-loop rollouts.

The choice is made once a log, for discovery, adding by name, calibration and distillation alike. Before it a long log
is thinned to half an hour: half of the pieces form a D-optimal design, built greedily (Fedorov 1972), so that a rare
manoeuvre is kept; the others are spread evenly over time, so that a slow change is kept. A compass deviation is taken
off the motions that rollouts judge.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from ..measurements.compass import corrected
from ..measurements.kinematics import compass_shown
from ..physics.effects import COMMAND_OFFSET
from ..physics.motion import Array, Motion
from ..physics.vehicle import Vehicle
from .balance.base import Balance, WeakSettings
from .balance.shooting import Shooting, ShootingSettings
from .balance.starts import limit_horizon
from .balance.weak_form import WeakForm
from .candidates.candidate import (
    Candidate,
    Kind,
    candidates,
    command_timing,
    holds_guesses,
    measurable,
    needs_sway,
)
from .evidence.record_errors import STRAIGHT_RUNS
from .evidence.unexplained import fit_all_forces, has_sensor_noise
from .search.floating import Search
from .search.rival_explanations import has_residual_structure
from .search.scoring import SearchSettings

MOST_TESTS = 7_500
"""Test functions that a search works on, at the usual stride 25 minutes: each more costs time and memory."""
_SLACK = 1.2
"""Times as many that are searched as they are: pieces do not add up to the limit exactly, and to thin costs time,
too."""
_PIECE = 500
"""Test functions of a piece: 100 s hold a few manoeuvres from beginning to end; each piece costs time of its own."""
_RIDGE = 1e-6
"""Ridge of the design, of the mean square of a signal: what has never been seen tells much, but not without end."""


def subsample_long_log(motions: Sequence[Motion], settings: WeakSettings) -> tuple[tuple[Motion, ...], str]:
    """The stretches of a long log that it is searched on, in the order of time, and what to say of it.

    A log of no more than `MOST_TESTS` test functions is itself, and there is nothing to say.
    """
    pieces = [piece for number, motion in enumerate(motions) for piece in _cut(number, motion, settings)]
    tests = sum(motion.time.size // _stride(motion, settings) for motion in motions)
    if tests <= _SLACK * MOST_TESTS:
        return tuple(motions), ""
    length = np.array([(stop - start) // _stride(motions[number], settings) for number, start, stop in pieces])
    grams = np.stack([_gram(motions[number].slice(start, stop)) for number, start, stop in pieces])
    size = np.sqrt(np.einsum("kii->i", grams) / len(grams))
    size[size == 0.0] = 1.0
    grams /= size[:, None] * size
    telling = _most_telling(grams, length)
    others = np.setdiff1d(np.arange(len(pieces)), telling)
    count = int((MOST_TESTS - length[telling].sum()) / max(1.0, length[others].mean())) if others.size else 0
    evenly = others[np.linspace(0, others.size - 1, min(count, others.size)).round().astype(int)]
    chosen = [pieces[k] for k in sorted({*telling, *evenly.tolist()})]
    found = tuple(motions[number].slice(start, stop) for number, start, stop in _joined(chosen))
    text = (
        f"effects are searched for on {len(chosen)} pieces of this long log, "
        f"{sum(m.duration for m in found) / 60.0:.0f} of its {sum(m.duration for m in motions) / 60.0:.0f} min: those "
        "that tell most, and others spread evenly; errors of predictions are those of the rows that judge"
    )
    return found, text


def _stride(motion: Motion, settings: WeakSettings) -> int:
    return max(1, round(settings.stride / motion.time_step))


def _cut(number: int, motion: Motion, settings: WeakSettings) -> Iterator[tuple[int, int, int]]:
    """Pieces of a motion (number, first row, last row but one), all but the last of one length."""
    rows = _PIECE * _stride(motion, settings)
    edges = [*range(0, max(1, motion.time.size - rows // 2), rows), motion.time.size]
    for start, stop in pairwise(edges):
        yield number, start, stop


def _gram(piece: Motion) -> Array:
    """Mean products of what forces are made of: speeds, their squares, their changes, commands, the heading."""
    u, v, r = piece.velocity.T
    turned = [f(piece.heading) for f in (np.cos, np.sin)]
    signals = [
        *(u, v, r, u * abs(u), v * abs(v), r * abs(r), u * v, u * r, v * r, abs(u), *turned, u * turned[0]),
        *(u * turned[1], *np.gradient(piece.velocity, axis=0).T),
        *(c for k in piece.commands.T for c in (k, k * abs(k), k * abs(k) * k)),
    ]
    columns = np.column_stack(signals)
    return np.asarray(columns.T @ columns / len(columns))


def _most_telling(grams: Array, length: np.ndarray) -> list[int]:
    """Pieces (pieces, n, n) that raise the determinant of the sum of their products most, one after the other.

    They are half of what is searched, by their length in test functions (pieces,).
    """
    total = _RIDGE * np.eye(grams.shape[1])
    result: list[int] = []
    while len(result) < len(grams) and length[result].sum() < MOST_TESTS // 2:
        gains = np.linalg.slogdet(total + grams)[1]
        gains[result] = -np.inf
        result.append(int(gains.argmax()))
        total = total + grams[result[-1]]
    return result


def _joined(pieces: Sequence[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    """Pieces in the order of time, those that follow each other as one."""
    result: list[tuple[int, int, int]] = []
    for number, start, stop in pieces:
        if result and result[-1][0] == number and result[-1][2] == start:
            start = result.pop()[1]
        result.append((number, start, stop))
    return result


UNKNOWN = float(np.radians(5.0))
"""Deviation that a compass on a boat may have of which nothing is known [rad]: one that was swung has less."""


@dataclass(frozen=True, slots=True)
class CorrectedMotions:
    """Motions without what sensors add to them.

    Attributes
    ----------
    motions : the motions without it
    turned : standard deviation of what the heading may lack for all that the log shows [rad]; 0 where it is right
    deviates : the compass does, so that no law of sway is learnt beside what a correction leaves of it
    notes : the same in words
    """

    motions: tuple[Motion, ...]
    turned: float
    deviates: bool
    notes: tuple[str, ...]


def correct_compass(motions: Sequence[Motion]) -> CorrectedMotions:
    """Find a compass deviation, and correct headings and velocities for it.

    What stays unknown of the deviation is left out of what is judged.
    """
    compass = compass_shown(motions)
    if compass.sound:
        return CorrectedMotions(tuple(motions), 0.0, False, ())
    turned = min(float(np.hypot(compass.size, compass.error)), UNKNOWN)
    logs = {motion.source for motion in motions}
    apart = ([m for m in motions if m.source == log] for log in logs) if len(logs) > 1 else ()
    deviates = compass.plain or any(compass_shown(own).plain for own in apart)
    judged = [
        *(["heading and velocities are corrected"] if compass.plain else []),
        *(["in one of the logs it does deviate"] if deviates and not compass.plain else []),
        *(["no law of sway is judged, nor mass"] if deviates else []),
        f"forces are judged beside a deviation of {np.degrees(turned):.1f} degrees",
    ]
    clear = (corrected(m, compass) for m in motions) if compass.plain else motions
    return CorrectedMotions(tuple(clear), turned, deviates, (f"{compass.sentence}; {', '.join(judged)}",))


@dataclass(frozen=True, slots=True)
class DiscoverySettings:
    """All settings of a discovery; they are printed in the report.

    Attributes
    ----------
    weak : test functions
    search : price and materiality
    seed : of the bootstrap
    refit : True to calibrate the parameters of the nominal model while effects are judged; None to do so where the
        vehicle file holds guesses, as one that `init` wrote does
    shooting : rollouts, for logs whose error is coloured
    """

    weak: WeakSettings = field(default_factory=WeakSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    seed: int = 0
    refit: bool | None = None
    shooting: ShootingSettings = field(default_factory=ShootingSettings)


_DEVIATES = (
    "the compass of this log deviates, and what is left after a correction is no white noise; effects are judged by "
    "open-loop rollouts"
)


LEAVES = (
    "the effects and terms that the force balance of this log asks for leave more of it than white sensor noise; "
    "effects are judged by open-loop rollouts instead"
)


def why_rollouts(weak: WeakForm, search: Search) -> str:
    """The reason why rollouts must judge a log, in a sentence; empty where the force balance does.

    Parameters
    ----------
    weak : the force balance
    search : on it, about its nominal model
    """
    left = fit_all_forces(weak, search)
    if left.coloured.any():
        return left.sentence
    # Forces that explain a log to its noise need no error of the compass: a weak thruster makes a boat drift, too.
    # Where there is no noise, they tell the error itself, and better than the straight runs do; see
    # `sensor_error_search`.
    deviates = has_sensor_noise(weak) and compass_shown(weak.motions).plain
    return _DEVIATES if deviates and has_residual_structure(search, search.run()) else ""


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """The balance that judges a log, with the motions and candidates for it.

    Attributes
    ----------
    nominal : the vehicle to be corrected
    settings : of the discovery, which say whether the model's own numbers are fitted
    motions : as they are fitted: cleared of what sensors add, where rollouts judge
    notes : what was done to the motions, in words
    forces : the force balance of the log as it came
    force_search : a search of all that the log can show, on that balance
    why : why rollouts judge, in a sentence; empty where the force balance does
    part : of a long log, which part is searched; else empty
    timed : how early or late the commands were recorded is fitted in every model
    deviates : the compass of a log plainly does, and no law of sway is judged
    """

    nominal: Vehicle
    settings: DiscoverySettings
    motions: tuple[Motion, ...]
    notes: tuple[str, ...]
    forces: WeakForm
    force_search: Search
    why: str
    part: str = ""
    timed: bool = True
    deviates: bool = False

    @property
    def uses_rollouts(self) -> bool:
        """True when rollouts judge."""
        return bool(self.why)

    @property
    def has_sensor_noise(self) -> bool:
        """See `has_sensor_noise`."""
        return has_sensor_noise(self.forces)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on the part of a long log, on rollouts as judges, and on corrections of the motions."""
        return (*filter(None, [self.part, self.why]), *self.notes)

    @property
    def pool(self) -> tuple[Candidate, ...]:
        """All candidates that the log's channels can show."""
        return tuple(c for c in self.force_search.pool if self.timed or c.kind is not Kind.SENSOR)

    def judges(self, candidate: Candidate) -> bool:
        """True for a candidate that what judges the log can tell from the rest, as far as the compass is known.

        Beside a compass that deviates, rollouts tell nothing that acts in sway, and no mass, which sway alone tells
        from a common scale of thrust and drag.
        """
        return not (self.uses_rollouts and self.deviates and needs_sway(candidate))

    def balance(self, about: Vehicle | None = None, shooting: ShootingSettings | None = None) -> Balance:
        """The balance that judges.

        Parameters
        ----------
        about : model whose rollouts tell weights; the nominal one as a rule
        shooting : how rollouts are laid, in the place of the settings'

        Raises
        ------
        RequestError
            when the log is too short for a few blocks of rollouts.
        """
        if not self.uses_rollouts:
            return self.forces
        return Shooting(self.motions, about or self.nominal, shooting or self.settings.shooting)

    def with_rollouts(self, why: str, *found: Vehicle) -> "Basis":
        """The same judged by rollouts, for a reason in words, on motions that are cleared of what sensors add.

        Parameters
        ----------
        why : a sentence
        found : models by which an error of a start may grow, beside the nominal one
        """
        clear = correct_compass(self.forces.motions)
        settings = _beside(self.settings, clear.turned)
        shooting = limit_horizon(settings.shooting, clear.motions, self.nominal, *found)
        return replace(
            self,
            settings=replace(settings, shooting=shooting),
            motions=clear.motions,
            notes=clear.notes,
            why=why,
            deviates=clear.deviates,
        )

    def trusting_compass(self) -> "Basis":
        """The same for a compass that is taken to be right, see `choose`."""
        motions = self.forces.motions
        if compass_shown(motions).deviates:
            return self
        return replace(self, settings=_beside(self.settings, 0.0), motions=motions, notes=())

    def keeping_errors(self, left: Collection[str]) -> "Basis":
        """The same with some errors of the record left in it, by the names of their corrections."""
        found = self
        if STRAIGHT_RUNS in left:
            found = replace(found, motions=self.forces.motions, notes=(), deviates=False)
        return replace(found, timed=False) if COMMAND_OFFSET.symbol in left else found

    def cleared_forces(self) -> WeakForm:
        """The force balance of the motions as they are fitted."""
        return WeakForm(self.motions, self.settings.weak)


def _beside(settings: DiscoverySettings, deviation: float) -> DiscoverySettings:
    """Settings by which rollouts are judged beside a deviation of the compass [rad]."""
    return replace(settings, shooting=replace(settings.shooting, turned=deviation))


def choose_balance(
    motions: Sequence[Motion],
    nominal: Vehicle,
    settings: DiscoverySettings,
    claims: Sequence[Array] | None = None,
    pool: Sequence[Candidate] | None = None,
    *,
    trusting: bool = False,
) -> Basis:
    """Decide what judges a log, and clear its motions for it.

    Parameters
    ----------
    motions : gap-free stretches, unfiltered
    claims : accelerations that a model claims, see `WeakForm`; no rollout judges them, for they have no sensor noise
    pool : candidates; None for all that the log's channels can show
    trusting : a compass of which the log does not show that it is right is taken to be, as its owner does who says what
        to calibrate

    Raises
    ------
    RequestError
        when the log is too short for the weak form.
    """
    if settings.refit is None:
        settings = replace(settings, refit=claims is None and holds_guesses(nominal))
    told = ""
    if claims is None:
        motions, told = subsample_long_log(motions, settings.weak)
    forces = WeakForm(motions, settings.weak, claims)
    every = candidates(nominal, measurable(motions)) if pool is None else pool
    if pool is None and not forces.claimed:
        every = (command_timing(motions), *every)
    instant = Search(forces, nominal, every, settings.search)
    why = "" if forces.claimed else why_rollouts(forces, instant)
    basis = Basis(nominal, settings, forces.motions, (), forces, instant, why, told)
    cleared = why and (not trusting or compass_shown(motions).deviates)
    return basis.with_rollouts(why) if cleared else basis
