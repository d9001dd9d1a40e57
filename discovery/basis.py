"""The choice of the balance for a log: the force balance where its residual is white noise, else open-loop rollouts.

The choice is made once a log, for discovery, adding by name, calibration and distillation alike.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..measurements.kinematics import compass_shown
from ..physics.effects import COMMAND_OFFSET
from ..physics.momentum_balance import mass_matrix
from ..physics.motion import AXES, FORCE_UNITS, Array, Motion
from ..physics.vehicle import Vehicle
from .balance.base import Balance
from .balance.long_logs import STRAIGHT_RUNS, correct_compass, subsample_long_log
from .balance.shooting import Shooting, ShootingSettings
from .balance.weak_form import WeakForm
from .candidates.candidate import (
    SCALES_OF_ALL,
    Candidate,
    Kind,
    candidates,
    command_timing,
    holds_guesses,
    measurable,
    needs_sway,
)
from .candidates.linearisation import Linearisation
from .candidates.unnamed_terms import features_along
from .search.floating import Search
from .search.record_errors_in_search import has_residual_structure
from .settings import DiscoverySettings

COLOURED = 2.0
"""A force error that no model explains, above this many times what white noise makes, is coloured."""
MATERIAL = 0.05
"""Share of the force scale that a coloured error must reach to be worth the slower search on rollouts."""
CLEAN_MATERIAL = 0.2
"""The same share for a log without sensor noise, as simulators write it."""
_LOUD, _SENSED = 9.0, 1e-3
"""Times what white noise makes from which an error is coloured, however small a share of the force it is, and noise of
sensors from which that is asked [m/s, rad/s]: short field logs leave 9.4 to 130 on some axis, simulated up to 8."""
_ENOUGH, _STRICTER = 200.0, (2.5, 2.0)
"""Independent tests below which structure is left in any log, and how much higher both thresholds then are."""
_TESTS_A_COLUMN = 3.0
"""Independent tests for each free factor at least: with fewer, factors fit noise and nothing would look coloured."""
_NEW = 1e-6
"""Share of its square that a column must keep beside others to be a new one: less of it is noise and rounding."""
_RANK = 1e-7
"""Share of the largest singular value below which a direction is rounding: some times the root of double precision."""


@dataclass(frozen=True, slots=True)
class Unexplained:
    """Residual of the balance when every effect and every term up to degree three is fitted at once.

    Attributes
    ----------
    error : (3,) root mean square force [N, N, N m]
    noise : (3,) what white sensor noise makes [N, N, N m]
    share : (3,) error over the force scale
    independent : effective number of independent tests
    sensed : the log has sensor noise, as no simulator's exact state has
    """

    error: Array
    noise: Array
    share: Array
    independent: float
    sensed: bool

    @property
    def sentence(self) -> str:
        """The reason for rollouts, with numbers."""
        texts = [
            f"{axis} {e:.2g} {unit} (white noise {n:.2g})"
            for axis, e, n, unit, far in zip(AXES, self.error, self.noise, FORCE_UNITS, self.coloured, strict=True)
            if far
        ]
        return (
            f"no model of the catalogue explains the force balance of this log to within white sensor noise: "
            f"{', '.join(texts)} stay; effects are judged by open-loop rollouts instead"
        )

    @property
    def coloured(self) -> np.ndarray:
        """(3,) True for an axis whose error is coloured and material."""
        material = MATERIAL if self.noise.any() else CLEAN_MATERIAL
        louder, larger = (1.0, 1.0) if self.independent >= _ENOUGH else _STRICTER
        large = (self.error > louder * COLOURED * self.noise) & (self.share > larger * material)
        return large | ((self.error > _LOUD * self.noise) & self.sensed)


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
    deviates = _sensed(weak) and compass_shown(weak.motions).plain
    return _DEVIATES if deviates and has_residual_structure(search, search.run()) else ""


def fit_all_forces(weak: WeakForm, search: Search) -> Unexplained:
    """Fit the measured acceleration by all forces of a search about its nominal model, and see what is left.

    Each axis gets every thruster's force, every shape of every effect, all unnamed terms up to degree three, and terms
    that turn with the heading as a strong current's do, each with a free factor: an upper limit of what any model of
    the catalogue could explain, whatever its mass. The columns are those that the search needs anyway; a short log gets
    their main directions only, three independent tests each.
    """
    linear, features = _forces(weak, search)
    inertia = {i for c in search.pool if c.effect.family == "mass" for o in linear.options[c.key] for i in o.free}
    forces = [i for i in range(linear.columns.shape[2] - 1) if i not in inertia]
    rates = weak.derivative([motion.velocity for motion in weak.motions])
    error = np.zeros(3)
    for axis in range(3):
        other = rates[:, [(2,), (2,), (0, 1)][axis]]  # through m13 and m23, which y_g and x_g make
        columns = _unit_length(np.column_stack([linear.columns[:, axis, forces], features, other]))
        vectors, values, _ = np.linalg.svd(columns, full_matrices=False)
        rank = min(int((values > _RANK * values[0]).sum()), int(weak.independent / _TESTS_A_COLUMN))
        vectors = vectors[:, :rank]
        left = rates[:, axis] - vectors @ (vectors.T @ rates[:, axis])
        error[axis] = np.sqrt((left**2).mean() * weak.independent / (weak.independent - rank))
    mass = np.diag(mass_matrix(search.nominal))
    share = error * mass / search.share_scale
    return Unexplained(error * mass, search.noise_error, share, weak.independent, _sensed(weak))


def residual_of_few_forces(weak: WeakForm, search: Search, most: int) -> Array:
    """Residual of the few best forces on each axis, (3,) mean squares: those that explain most of the nominal model's.

    Each has a free factor on each axis, and is the one that takes most beside those before it: orthogonal matching
    pursuit (Pati, Rezaiifar and Krishnaprasad 1993, doi:10.1109/ACSSC.1993.342465). What a search calibrates in every
    model is fitted beside them and does not count.

    Parameters
    ----------
    most : forces on an axis; a log has many more independent tests
    """
    linear, features = _forces(weak, search)
    calibrated = [i for key in search.nuisances for o in linear.options[key] for i in o.free if i >= 0]
    error = np.zeros(3)
    for axis in range(3):
        left, rest = linear.columns[:, axis, -1], np.column_stack([linear.columns[:, axis, :-1], features])
        if calibrated:
            known, _ = np.linalg.qr(_unit_length(linear.columns[:, axis, calibrated]))
            left, rest = left - known @ (known.T @ left), rest - known @ (known.T @ rest)
        rest = _unit_length(rest)
        for _ in range(min(most, rest.shape[1])):
            squares = (rest**2).sum(axis=0)
            gains = np.divide((left @ rest) ** 2, squares, out=np.zeros(squares.size), where=squares > _NEW)
            best = int(gains.argmax())
            unit = rest[:, best] / np.sqrt(max(squares[best], _NEW))
            left, rest = left - unit * (unit @ left), rest - np.outer(unit, unit @ rest)
        error[axis] = (left**2).mean() * weak.independent / (weak.independent - most)
    return error


def _forces(weak: WeakForm, search: Search) -> tuple[Linearisation, Array]:
    """All columns of a search about its nominal model, and all terms up to degree three, of unit mass."""
    linear, _ = search.linearise(search.nominal, ())
    return linear, np.column_stack([features_along(weak, search.nominal, 3)[1], _turned(weak)])


def _unit_length(columns: Array) -> Array:
    """Columns of unit length, without those that are nothing."""
    size = np.sqrt((columns**2).sum(axis=0))
    return np.asarray(columns[:, size > 0] / size[size > 0])


def _sensed(weak: WeakForm) -> bool:
    return bool(weak.noise.max() >= _SENSED)


def _turned(weak: WeakForm) -> Array:
    """Velocities and their moduli times the cosine and the sine of the heading, tested, (tests, 12)."""
    series = []
    for motion in weak.motions:
        speeds = np.column_stack([motion.velocity, np.abs(motion.velocity)])
        series.append(
            np.column_stack([speeds * np.cos(motion.heading)[:, None], speeds * np.sin(motion.heading)[:, None]])
        )
    return weak.average(series)


_MEASURES = ("thruster_arm",)
"""What rollouts measure the rest by."""


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
    deviates : the compass plainly does, and no law of sway is judged
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
        """True when sensors made the log: the exact state of a simulator has no noise, white or coloured."""
        return _sensed(self.forces)

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

        Rollouts cannot tell long arms from little inertia and damping in yaw together. Beside a compass that deviates,
        they tell nothing that acts in sway, and beside one that is not proven, no common scale of thrust and drag.
        """
        if not self.uses_rollouts:
            return True
        unproven = self.settings.shooting.turned > 0.0
        blind = candidate.key in _MEASURES or (unproven and bool({*SCALES_OF_ALL} & {*candidate.symbols}))
        return not (blind or (self.deviates and needs_sway(candidate)))

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

    def with_rollouts(self, why: str) -> "Basis":
        """The same judged by rollouts, for a reason in words, on motions that are cleared of what sensors add."""
        clear = correct_compass(self.forces.motions)
        settings = _beside(self.settings, clear.turned)
        return replace(
            self, settings=settings, motions=clear.motions, notes=clear.notes, why=why, deviates=clear.deviates
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
