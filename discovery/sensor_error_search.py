"""What only forces show of a record: a lever arm of the position sensor, a constant compass error, water that moves.

Such an error agrees with itself in every record, but makes of the motion what only many effects together explain. So
where a search leaves structure, or ends with many effects, the errors are estimated, taken off the motions, and the
search runs again; its answer is kept where the errors earn their price.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..measurements.kinematics import corrected_for
from ..measurements.statistics.processors import parallel_map
from ..physics.errors import RequestError
from ..physics.motion import Array, Motion
from ..physics.stage import Say, Stage
from .basis import Basis, choose_balance
from .candidates.candidate import Kind
from .claims import why_no_hull
from .effect_findings import FittedTerm
from .evidence.unexplained import residual_of_few_forces
from .evidence.weighing import CERTAINLY
from .findings import WATER, SensorError
from .search.floating import Search, State
from .search.rival_explanations import RecordErrorFit, search_with_record_errors
from .selection import ForceFit, SearchResult, finish, search_forces, select
from .water_of_logs import CURRENT, Flow, flow_of, flow_terms, in_water, sentence_of

_LEAST = (0.05, 0.05, 0.02)
"""Sizes from which an error matters [m, m, rad]."""
ARM, COMPASS = "mount", "compass_constant"
"""Names of the corrections for a lever arm, and for a heading that lacks something; `WATER` is that for currents."""


@dataclass(frozen=True, slots=True)
class HiddenErrors:
    """Sensor errors that only forces show: place of the position sensor (ahead, starboard) [m], compass error [rad].

    And the currents of several logs [m/s], in whose water they are judged.
    """

    arm_x: float
    arm_y: float
    compass: float
    flows: tuple[Flow, ...] = ()

    @classmethod
    def of(cls, estimate: Array) -> "HiddenErrors":
        """Make them of three numbers, those that do not matter taken for none."""
        ahead, aside, turned = np.where(np.abs(estimate) >= _LEAST, estimate, 0.0).tolist()
        return cls(ahead, aside, turned)

    @classmethod
    def of_findings(cls, sensors: Iterable[SensorError], logs: Sequence[str]) -> "HiddenErrors | None":
        """Those that findings tell; None where they tell none.

        Parameters
        ----------
        sensors : of the findings
        logs : of the run, where they are now, in its order

        Raises
        ------
        RequestError
            when the findings have currents of more logs, or of fewer.
        """
        told = tuple(sensors)
        found = {term.symbol: term.value for s in told if s.correction in (ARM, COMPASS) for term in s.terms}
        flows = [term for s in told if s.correction == WATER for term in s.terms]
        pairs = zip(flows[::2], flows[1::2], strict=True)
        by_log = tuple((north.value, east.value) for north, east in pairs)
        if by_log and len(by_log) != len(logs):
            raise RequestError(
                f"findings: expected the {len(by_log)} logs of the run, each in its own water, got {len(logs)}; run "
                "'undertow discover' with these logs"
            )
        currents = tuple((log, *flow) for log, flow in zip(logs, by_log, strict=False))
        if not found and not by_log:
            return None
        turned = float(np.radians(found.get("misalignment", 0.0)))
        return cls(found.get("arm_x", 0.0), found.get("arm_y", 0.0), turned, currents)

    @property
    def count(self) -> int:
        """Number of errors that are not zero."""
        return int(np.count_nonzero((self.arm_x, self.arm_y, self.compass)))

    def keeping(self, left: Collection[str]) -> "HiddenErrors":
        """The same without some of them, by the names of their corrections: these stay in the motion."""
        arm_x, arm_y = (0.0, 0.0) if ARM in left else (self.arm_x, self.arm_y)
        flows = () if WATER in left else self.flows
        return replace(self, arm_x=arm_x, arm_y=arm_y, compass=0.0 if COMPASS in left else self.compass, flows=flows)

    def corrected(self, motion: Motion) -> Motion:
        """A motion as it is at the origin, along the true heading, and in the water of its log."""
        errors = {"mount_x": self.arm_x, "mount_y": self.arm_y, "compass_constant": self.compass}
        north, east = flow_of(motion, self.flows)
        return corrected_for(in_water(motion, north, east) if north or east else motion, errors)

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
        if self.flows:
            water = sentence_of(self.flows, "Beyond the current of the file, the water moves at", "m/s")
            text = f"{water}; each log is judged in its own water."
            terms = flow_terms(self.flows, CURRENT, "m/s")
            error = "water_speed"
            found.append(SensorError(error=error, verdict="present", sentence=text, terms=terms, correction=WATER))
        return tuple(found)


NONE = HiddenErrors(0.0, 0.0, 0.0)


_USUAL = (1.0, 1.0, 0.2)
"""Errors that are nothing unusual [m, m, rad], which regularise a fit of them: of an antenna on a boat of one or two
metres, and 11 degrees."""
_STEP = 0.1
"""Share of these by which a column is taken: the motion is all but linear in so little."""
_ASKS = 4.0
"""Log-likelihood that such errors must earn beside the model that was found for a second search, which costs time; it
must be better by `CERTAINLY`, their price paid. Right sensors earn less than one, and wrong ones no more than five
where a dozen effects stand in for them."""
_SETTLED = {False: 0.003, True: 0.02}
"""Change of an estimate, in units of what is usual, from which it stays: without noise of sensors, and with it."""
_ROUNDS = 4
"""Searches with a better and better estimate: each costs time."""
_STAND_IN = 1.0 / 3.0
"""Share of what stood unexplained that may be left beside such errors: what is left of a bad compass and was taken for
an arm left three quarters, an arm that was there less than a sixth, of that which noise does not hide."""


def search_with_sensor_errors(basis: Basis, say: Say) -> tuple[SearchResult, HiddenErrors | None]:
    """Search with sensor errors among the causes, where the force balance asks for one; else without.

    Where rollouts judge, a third of what stood unexplained may be left without it; they are not asked of a log that
    forces explain without it. Where the log asks less plainly, nothing is corrected.
    """
    if basis.uses_rollouts or basis.forces.claimed:
        return select(basis, say), None
    fit = search_forces(basis, say)
    estimate = _asked(fit)
    corrected = None if estimate is None else _corrected(fit, estimate, say)
    return corrected or (finish(fit, say), None)


def _asked(fit: ForceFit) -> Array | None:
    """Errors of the sensors that a log asks for: where its model leaves structure or stands in, or where they earn."""
    if (fit.rolling is not None or _stands_in(fit)) and (estimate := _estimate(fit.basis)) is not None:
        return estimate
    if (
        fit.rolling is not None
        or not fit.names
        or RecordErrorFit(fit.search, _columns(fit.search, fit.state), fit.state).earned < _ASKS
    ):
        return None
    return _fit_with_sensor_errors(fit.search).errors * _USUAL


def _overfits(fit: ForceFit) -> bool:
    """True when a model is a crowd of stand-ins, beside which an error of the sensors would earn nothing more."""
    terms = fit.search.of_kind(fit.names, Kind.TERM)
    return bool(terms) or fit.beyond_terms or len(fit.names) >= fit.search.settings.overfit_from


def _stands_in(fit: ForceFit) -> bool:
    """True when a model is a crowd, or of a hull that cannot be: it stands for something else."""
    return _overfits(fit) or bool(why_no_hull(fit.search.nominal, fit.state.vehicle))


def _corrected(fit: ForceFit, estimate: Array, say: Say) -> tuple[SearchResult, HiddenErrors] | None:
    """What is found on motions without an error of the sensors, as it is refined.

    None where that is no better, no simpler, or leaves what no noise explains: more than a stand-in would.

    Parameters
    ----------
    fit : the model of forces alone, which it must be better than where that explains the log and is no stand-in
    """
    basis = fit.basis
    say(Stage("the forces ask for an error of the sensors: searching beside it"))
    best: ForceFit | None = None
    found = NONE
    worth = np.inf if fit.rolling is not None or _stands_in(fit) else fit.state.score - CERTAINLY
    for _ in range(_ROUNDS):
        errors = HiddenErrors.of(estimate)
        if errors == NONE:
            break
        motions = [errors.corrected(motion) for motion in basis.forces.motions]
        begun = choose_balance(motions, basis.nominal, basis.settings)
        if begun.uses_rollouts:
            break
        after = search_forces(begun, _quiet)
        paid = after.search.settings.price * errors.count
        if after.state.score + paid > worth or not _simpler(fit, after, errors):
            break
        best, found, worth = after, errors, after.state.score + paid
        ends = parallel_map(partial(_end, after.search), (after.state, None))
        _, left = min(ends, key=lambda end: end[0])
        if np.abs(left).max() < _SETTLED[basis.has_sensor_noise]:
            break
        estimate = estimate + left * _USUAL
    if best is None or _stands_in(best) or _leaves_too_much(fit, best, found):
        return None
    say("; ".join(error.sentence for error in found.findings))
    looked = finish(best, _quiet)
    notes = (*filter(None, [basis.part]), *looked.notes)
    return replace(looked, basis=replace(looked.basis, part=basis.part), notes=notes), found


def _quiet(text: str) -> None:
    """Say nothing."""


def _simpler(against: ForceFit, after: ForceFit, errors: HiddenErrors) -> bool:
    """True when fewer causes explain a log beside errors of the sensors, these among them, and no crowd that is new.

    Turning moves an antenna as it bends the flow along a hull: four effects about another origin do as well as five
    laws of drag, and forces that explain a log need no error of the sensors. A centre of gravity that moves farther
    than the antenna is another origin, too.
    """
    search, state = after.search, after.state
    for symbol, arm in (("x_g", errors.arm_x), ("y_g", errors.arm_y)):
        if arm and abs(state.vehicle.value(symbol) - search.nominal.value(symbol)) > abs(arm):
            return False
    least = len(against.names) if against.explains else np.inf
    crowd = _overfits(after) and not _overfits(against)
    return not crowd and bool(len(after.names) + errors.count < least)


def _leaves_too_much(fit: ForceFit, after: ForceFit, errors: HiddenErrors) -> bool:
    """True when a model beside errors of the sensors leaves more than a stand-in would, of what is left without them.

    Never where it is better than one that explains the log. A crowd may be better by its numbers alone: beside it that
    is asked of what as many forces leave, free on each axis, and these must not explain the log.
    """
    paid = after.search.settings.price * errors.count
    if fit.rolling is None and after.state.score + paid < fit.state.score - CERTAINLY:
        return False
    left = fit.state.fit.held_out
    if _overfits(fit):
        left = residual_of_few_forces(fit.basis.forces, fit.search, len(after.names) + errors.count)
        if not fit.search.has_residual_structure(left):
            return True
    right = after.search.unexplained(after.state.fit.held_out)
    return not after.explains and right > _STAND_IN * fit.search.unexplained(left)


def _fit_with_sensor_errors(search: Search, begin: State | None = None) -> RecordErrorFit:
    """The model that explains a force balance best beside errors of the sensors, from one, or from nothing added."""
    begin = begin or search.evaluate(search.nominal, ())
    return search_with_record_errors(search, _columns(search, begin), begin)


def _end(search: Search, begin: State | None) -> tuple[float, Array]:
    """The worth and the errors (3,) at which `_fit_with_sensor_errors` ends: what another process can hand back."""
    there = _fit_with_sensor_errors(search, begin)
    return there.worth(), there.errors


def _estimate(basis: Basis) -> Array | None:
    """Errors of the sensors that a force balance asks for whatever model stands beside them; None where for none.

    Beside an error that is taken out by half there is a crowd of stand-ins, so the estimate is refined until it stays
    before anything is searched for without it.
    """
    search = basis.force_search
    empty = search.evaluate(search.nominal, ())
    columns = _columns(search, empty)
    fit = search_with_record_errors(search, columns, empty)
    alone = search_with_record_errors(search, columns[:, :, :0], empty).worth()
    estimate, best = fit.errors * _USUAL, fit.worth()
    for _ in range(_ROUNDS):
        errors = HiddenErrors.of(estimate)
        if errors == NONE:
            return None
        taken = np.array([errors.arm_x, errors.arm_y, errors.compass])
        motions = [errors.corrected(motion) for motion in basis.forces.motions]
        fit = _fit_with_sensor_errors(choose_balance(motions, basis.nominal, basis.settings).force_search)
        best = min(best, fit.worth() + 0.5 * float(np.square(taken / _USUAL).sum()))
        if alone - best < CERTAINLY:
            return None
        estimate = taken + fit.errors * _USUAL
        if np.abs(fit.errors).max() < _SETTLED[basis.has_sensor_noise]:
            break
    return estimate


def _columns(search: Search, state: State) -> Array:
    """What errors of the usual size add to the balance of a model, (tests, 3, 3)."""
    balance, vehicle = search.balance, state.vehicle
    rest = balance.residual(vehicle)

    def without(place: int) -> Sequence[Motion]:
        sizes = [_STEP * usual if k == place else 0.0 for k, usual in enumerate(_USUAL)]
        return [HiddenErrors(sizes[0], sizes[1], sizes[2]).corrected(motion) for motion in balance.motions]

    moved = [balance.recorded(without(place), vehicle) for place in range(len(_USUAL))]
    return np.stack([(rest - balance_of) / _STEP for balance_of in moved], axis=2)
