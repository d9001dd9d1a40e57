"""Sensor errors that only forces show: a lever arm of the position sensor, and a constant compass error.

Such an error agrees with itself in every record, but makes of the motion what only many effects together explain. So
where a search leaves structure, or ends with many effects, the errors are estimated, taken off the motions, and the
search runs again; its answer is kept where the errors earn their price.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ..measurements.kinematics import corrected_for
from ..measurements.statistics.processors import fork_available, parallel_map, run_in_fork
from ..physics.errors import RequestError
from ..physics.motion import Array, Motion
from ..physics.stage import Say, Stage
from .basis import Basis, choose_balance, residual_of_few_forces
from .candidates.candidate import Kind
from .effect_findings import FittedTerm
from .findings import SensorError
from .kept_effects import ForceFit, SearchResult
from .search.floating import Search, State
from .search.record_errors_in_search import RecordErrorFit, has_residual_structure, search_with_record_errors
from .selection import Selection

_LEAST = (0.05, 0.05, 0.02)
"""Sizes from which an error matters [m, m, rad]."""
ARM, COMPASS = "mount", "compass_constant"
"""Names of the corrections for a lever arm, and for a heading that lacks something."""


@dataclass(frozen=True, slots=True)
class HiddenErrors:
    """Sensor errors that only forces show: place of the position sensor (ahead, starboard) [m], compass error [rad]."""

    arm_x: float
    arm_y: float
    compass: float

    @classmethod
    def of(cls, estimate: Array) -> "HiddenErrors":
        """Make them of three numbers, those that do not matter taken for none."""
        ahead, aside, turned = np.where(np.abs(estimate) >= _LEAST, estimate, 0.0).tolist()
        return cls(ahead, aside, turned)

    @classmethod
    def of_findings(cls, sensors: Iterable[SensorError]) -> "HiddenErrors | None":
        """Those that findings tell; None where they tell none."""
        found = {term.symbol: term.value for s in sensors if s.correction in (ARM, COMPASS) for term in s.terms}
        if not found:
            return None
        turned = float(np.radians(found.get("misalignment", 0.0)))
        return cls(found.get("arm_x", 0.0), found.get("arm_y", 0.0), turned)

    @property
    def count(self) -> int:
        """Number of errors that are not zero."""
        return int(np.count_nonzero((self.arm_x, self.arm_y, self.compass)))

    def keeping(self, left: Collection[str]) -> "HiddenErrors":
        """The same without some of them, by the names of their corrections: these stay in the motion."""
        arm_x, arm_y = (0.0, 0.0) if ARM in left else (self.arm_x, self.arm_y)
        return replace(self, arm_x=arm_x, arm_y=arm_y, compass=0.0 if COMPASS in left else self.compass)

    def corrected(self, motion: Motion) -> Motion:
        """A motion as it is at the origin, and along the true heading."""
        errors = {"mount_x": self.arm_x, "mount_y": self.arm_y, "compass_constant": self.compass}
        return corrected_for(motion, errors)

    @property
    def findings(self) -> tuple[SensorError, ...]:
        """Findings on these errors."""
        found = []
        if max(abs(self.arm_x) / _LEAST[0], abs(self.arm_y) / _LEAST[1]) >= 1.0:
            text = (
                f"Places and speeds are measured {self.arm_x:+.2f} m ahead and {self.arm_y:+.2f} m to starboard of the "
                "vehicle's origin, as the forces tell; the motion is corrected for it."
            )
            terms = (
                FittedTerm(symbol="arm_x", value=self.arm_x, unit="m"),
                FittedTerm(symbol="arm_y", value=self.arm_y, unit="m"),
            )
            found.append(
                SensorError(error="antenna_arm", verdict="present", sentence=text, terms=terms, correction=ARM)
            )
        if abs(self.compass) >= _LEAST[2]:
            angle = float(np.degrees(self.compass))
            text = f"The heading lacks {angle:+.1f} degrees, as the forces tell; it and the speeds are corrected."
            terms = (FittedTerm(symbol="misalignment", value=angle, unit="deg"),)
            error = "compass_deviation"
            found.append(SensorError(error=error, verdict="present", sentence=text, terms=terms, correction=COMPASS))
        return tuple(found)


NONE = HiddenErrors(0.0, 0.0, 0.0)


_USUAL = (1.0, 1.0, 0.2)
"""Errors that are nothing unusual [m, m, rad]: of an antenna on a boat of one or two metres, and 11 degrees."""
_STEP = 0.1
"""Share of these by which a column is taken: the motion is all but linear in so little."""
_ASKS, _BETTER = 4.0, 10.0
"""Log-likelihood that such errors must earn beside the model that was found for a second search to be tried, and that
this must be better by, their price paid. Right sensors earn less than one, and wrong ones no more than five where a
dozen effects stand in for them."""
_SETTLED = {False: 0.003, True: 0.02}
"""Change of an estimate, in units of what is usual, from which it stays: without noise of sensors, and with it."""
_ROUNDS = 4
"""Searches with a better and better estimate."""
_STAND_IN = 1.0 / 3.0
"""Share of what stood unexplained that may be left beside such errors: what is left of a bad compass and was taken for
an arm left three quarters, an arm that was there less than a sixth, of that which noise does not hide."""


class SensorErrorSearch(NamedTuple):
    """Result of a search, and the errors of the sensors that were taken out for it."""

    result: SearchResult
    errors: HiddenErrors | None = None


def search_with_sensor_errors(basis: Basis, say: Say) -> SensorErrorSearch:
    """Search with sensor errors among the causes, where the force balance asks for one; else without.

    Where rollouts judge, a third of what stood unexplained may be left without it; they are not asked of a log that
    forces explain without it. Where the log asks less plainly, nothing is corrected.
    """
    before = Selection(basis, say)
    if basis.forces.claimed:
        return SensorErrorSearch(before.result)
    first = before.first
    much = first is not None and _leaves_much(first)
    asked = _estimate_while_searching(basis, before) if much else None
    at_once = _corrected(before, first, asked, _explained_by_one) if first and asked is not None else None
    if first and at_once and not _few_forces_explain(first, at_once):
        return at_once
    looked = before.force_fit
    earned = _earned(looked.search, looked.state) if looked else 0.0
    estimate = None
    if before.needs_rollouts or (looked and _overfits(looked.search, looked.state)):
        estimate = asked if much else _estimate(basis)
    if estimate is None and looked and earned >= _ASKS:
        estimate = _fit_with_sensor_errors(looked.search).errors * _USUAL
    corrected = None
    if estimate is not None:
        corrected = _corrected(before, looked, estimate, partial(_selected, before))
    return corrected or SensorErrorSearch(before.result)


def _estimate_while_searching(basis: Basis, before: Selection) -> Array | None:
    """See `_asked`; with a second processor the forces are searched further meanwhile, as most logs want next."""
    with run_in_fork(partial(_estimate, basis)) as asked:
        if fork_available():
            with suppress(RequestError):  # it is told where that search is asked for, if it is
                before.search_on()
        return asked()


def _few_forces_explain(first: ForceFit, found: SensorErrorSearch) -> bool:
    """True when as many forces on each axis, free there, would explain a log without errors of the sensors, too."""
    many = len(_named(found.result)) + (found.errors.count if found.errors else 0)
    return not first.search.has_residual_structure(residual_of_few_forces(first.basis.forces, first.search, many))


def _leaves_much(first: ForceFit) -> bool:
    """True when a first search leaves structure, or ends with so many effects that they may be a crowd of stand-ins."""
    return not first.explains or len(_named(first)) >= first.search.settings.prune_from


def _named(found: ForceFit | SearchResult) -> tuple[str, ...]:
    return found.search.named(found.state.active)


def _overfits(search: Search, state: State) -> bool:
    """True when a model is a crowd of stand-ins, beside which an error of the sensors would earn nothing more."""
    named = search.named(state.active)
    return bool(search.of_kind(named, Kind.TERM)) or len(named) >= search.settings.overfit_from


def _earned(search: Search, state: State) -> float:
    """What errors of the sensors earn beside a model."""
    if not search.named(state.active):
        return 0.0
    return RecordErrorFit(search, _columns(search, state), state).earned


def _corrected(
    before: Selection, against: ForceFit | None, estimate: Array, look: Callable[[Basis], Selection | None]
) -> SensorErrorSearch | None:
    """What is found on motions without an error of the sensors, as it is refined.

    None where that is no better, or leaves what no noise explains.

    Parameters
    ----------
    against : the model of forces alone that it must be better than; None where these settle nothing
    look : looks at corrected motions; None where what it sees is no better for sure
    """
    basis, say = before.given, before.say
    say(Stage("the forces ask for an error of the sensors: searching beside it"))
    best: Selection | None = None
    found = None
    worth = np.inf if against is None else against.state.score - _BETTER
    for _ in range(_ROUNDS):
        errors = HiddenErrors.of(estimate)
        if errors == NONE:
            break
        begun = choose_balance(
            [errors.corrected(motion) for motion in basis.forces.motions], basis.nominal, basis.settings
        )
        other = look(begun)
        if other is None:
            break
        search, state = _on_forces(begun, other.outcome)
        paid = search.settings.price * errors.count
        if state.score + paid > worth or not _simpler(against, other.outcome, errors):
            break
        best, found, worth = other, errors, state.score + paid
        end = min(parallel_map(partial(_end, search), (state, None)), key=lambda end: end.worth)
        more = end.errors
        if np.abs(more).max() < _SETTLED[basis.has_sensor_noise]:
            break
        estimate = estimate + more * _USUAL
    if best is None or found is None:
        return None
    if (
        has_residual_structure(best.outcome.search, best.outcome.state)
        and _unexplained_share(before.outcome, best.outcome) > _STAND_IN
    ):
        return None
    say("; ".join(error.sentence for error in found.findings))
    looked = best.result
    notes = (*filter(None, [basis.part]), *looked.notes)
    looked = replace(looked, basis=replace(looked.basis, part=basis.part), notes=notes)
    return SensorErrorSearch(looked, found)


def _explained_by_one(begun: Basis) -> Selection | None:
    """What is found on corrected motions, where a first search explains them by one effect at most."""
    after = Selection(begun, _quiet)
    return after if after.first and after.first.explains and len(_named(after.first)) <= 1 else None


def _selected(before: Selection, begun: Basis) -> Selection | None:
    """What is found on corrected motions; None where both roll, and more than a stand-in leaves is left of the first.

    None as well where rollouts would judge the first and a search ends with a crowd on the other. Rollouts are asked
    last: what forces leave of a log they hardly explain.
    """
    after, rolls = Selection(begun, _quiet, thorough=True), before.basis.uses_rollouts
    if rolls and after.first and _overfits(after.first.search, after.first.state):
        return None
    left = after.needs_rollouts
    if left and rolls and _share(before.outcome, left.search, left.state) > _STAND_IN:
        return None
    both_roll = rolls and after.basis.uses_rollouts
    return None if both_roll and _unexplained_share(before.outcome, after.outcome) > _STAND_IN else after


def _quiet(text: str) -> None:
    """Say nothing."""


def _simpler(against: ForceFit | None, after: ForceFit | SearchResult, errors: HiddenErrors) -> bool:
    """True when fewer causes explain a log beside errors of the sensors, these among them, and no crowd of stand-ins.

    Turning moves an antenna as it bends the flow along a hull: four effects about another origin do as well as five
    laws of drag, and forces that explain a log need no error of the sensors. A centre of gravity that moves farther
    than the antenna is another origin, too.
    """
    search, state = after.search, after.state
    for symbol, arm in (("x_g", errors.arm_x), ("y_g", errors.arm_y)):
        if arm and abs(state.vehicle.value(symbol) - search.nominal.value(symbol)) > abs(arm):
            return False
    named = len(_named(after)) + errors.count
    least = len(_named(against)) if against and against.explains else np.inf
    return not _overfits(search, state) and bool(named < least)


def _unexplained_share(before: ForceFit | SearchResult, after: ForceFit | SearchResult) -> float:
    """The share of what one model leaves unexplained that another leaves, both on the force balance of the other."""
    return _share(before, *_on_forces(after.basis, after))


def _share(before: ForceFit | SearchResult, search: Search, later: State) -> float:
    """The share of what one model leaves unexplained that another one of a force balance leaves there."""
    _, earlier = _on_forces(before.basis, before)
    return search.unexplained(later.fit.held_out) / max(search.unexplained(earlier.fit.held_out), 1e-12)


def _on_forces(basis: Basis, found: ForceFit | SearchResult) -> tuple[Search, State]:
    """What a force balance makes of a model, whichever judge found it: scores of two judges do not compare."""
    if not found.basis.uses_rollouts:
        return found.search, found.state
    search, named = (
        basis.force_search,
        found.search.named(found.state.active),
    )  # what is calibrated is no candidate of it
    return search, search.evaluate(found.state.vehicle, [c.key for c in search.pool if c.key in named])


def _fit_with_sensor_errors(search: Search, begin: State | None = None) -> RecordErrorFit:
    """The model that explains a force balance best beside errors of the sensors, from one, or from nothing added."""
    begin = begin or search.evaluate(search.nominal, ())
    return search_with_record_errors(search, _columns(search, begin), begin)


class _End(NamedTuple):
    """Where a search beside errors of the sensors ends: its worth, and the errors."""

    worth: float
    errors: Array


def _end(search: Search, begin: State | None) -> _End:
    """See `_beside`; what another process can hand back."""
    there = _fit_with_sensor_errors(search, begin)
    return _End(there.worth(), there.errors)


def _estimate(basis: Basis) -> Array | None:
    """Errors of the sensors that a force balance asks for whatever model stands beside them.

    None where for none, or where a crowd stands beside them.
    """
    search = basis.force_search
    empty = search.evaluate(search.nominal, ())
    columns = _columns(search, empty)
    within = search_with_record_errors(search, columns, empty)
    errors = HiddenErrors.of(within.errors * _USUAL)
    if errors == NONE:
        return None
    # A search beside errors that are not taken out yet may end where one without them does not: then it is told anew.
    motions = [errors.corrected(motion) for motion in basis.forces.motions]
    again = _fit_with_sensor_errors(choose_balance(motions, basis.nominal, basis.settings).force_search)
    if _overfits(search, again.state):  # stand-ins for whatever it is, not for errors of the sensors
        return None
    taken = np.array([errors.arm_x, errors.arm_y, errors.compass])
    best = min(within.worth(), again.worth() + 0.5 * float(np.square(taken / _USUAL).sum()))
    if search_with_record_errors(search, columns[:, :, :0], empty).worth() - best < _BETTER:
        return None
    return taken + again.errors * _USUAL


def _columns(search: Search, state: State) -> Array:
    """What errors of the usual size add to the balance of a model, (tests, 3, 3)."""
    balance, vehicle = search.balance, state.vehicle
    rest = balance.residual(vehicle)

    def without(place: int) -> Sequence[Motion]:
        sizes = [_STEP * usual if k == place else 0.0 for k, usual in enumerate(_USUAL)]
        return [HiddenErrors(sizes[0], sizes[1], sizes[2]).corrected(motion) for motion in balance.motions]

    moved = [balance.recorded(without(place), vehicle) for place in range(len(_USUAL))]
    return np.stack([(rest - balance_of) / _STEP for balance_of in moved], axis=2)
