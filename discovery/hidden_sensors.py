"""Errors of sensors that no other record shows, so that only forces tell of them: a lever arm, a compass turned aside.

A receiver that measures places and speeds where it stands and not at the origin agrees with itself, and so do speeds
that were turned into the body by a heading that is off by a constant. What they make of a motion no hull explains but
with many effects at once, each a stand-in; taken away, the few that are real remain.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..measurements.kinematic_errors import corrected_for
from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.stage import Stage
from .basis import choose
from .findings import SensorError
from .found_effects import FoundTerm
from .search.beside_errors import Beside, best_beside
from .search.floating import Search, State
from .selection import Selected, select

_USUAL = (1.0, 1.0, 0.2)
"""Errors that are nothing unusual [m, m, rad]: of an antenna on a boat of one or two metres, and 11 degrees."""
_STEP = 0.1
"""Share of these by which a column is taken: the motion is all but linear in so little."""
_ASKS, _BETTER = 8.0, 10.0
"""Log-likelihood that such errors must earn beside the model that was found for a second search to be tried, and that
the second must be better by, their price paid: right sensors earn less than one."""
_LEAST = (0.05, 0.05, 0.02)
"""Sizes from which an error matters [m, m, rad]."""
_SETTLED = 0.003
"""Change of an estimate, in units of what is usual, from which it stays."""
ARM, COMPASS = "mount", "compass_constant"
"""Names of the corrections for a lever arm, and for a heading that lacks something."""
_ROUNDS = 4
"""Searches with a better and better estimate."""


@dataclass(frozen=True, slots=True)
class HiddenErrors:
    """Where the sensor of places and speeds is, ahead and to starboard [m], and what a heading lacks [rad].

    `unsure` are keys of effects for which the log would not ask were these numbers a little different.
    """

    arm_x: float
    arm_y: float
    compass: float
    unsure: tuple[str, ...] = ()

    @classmethod
    def of(cls, estimate: Array) -> "HiddenErrors":
        """From three numbers, those that do not matter taken for none."""
        ahead, aside, turned = np.where(np.abs(estimate) >= _LEAST, estimate, 0.0).tolist()
        return cls(ahead, aside, turned)

    def leaving(self, left: Collection[str]) -> "HiddenErrors":
        """The same without some of them, by the names of their corrections: these stay in the motion."""
        arm_x, arm_y = (0.0, 0.0) if ARM in left else (self.arm_x, self.arm_y)
        return replace(self, arm_x=arm_x, arm_y=arm_y, compass=0.0 if COMPASS in left else self.compass)

    def corrected(self, motion: Motion) -> Motion:
        """A motion as it is at the origin, and along the true heading."""
        errors = {"mount_x": self.arm_x, "mount_y": self.arm_y, "compass_constant": self.compass}
        return corrected_for(motion, errors)

    @property
    def doubts(self) -> dict[str, str]:
        """Why effects are not certain beside them, by key, as the end of a sentence."""
        return dict.fromkeys(self.unsure, "were the sensors off by a little more, the log would not ask for it")

    @property
    def findings(self) -> tuple[SensorError, ...]:
        """What is told of them."""
        found = []
        if max(abs(self.arm_x) / _LEAST[0], abs(self.arm_y) / _LEAST[1]) >= 1.0:
            told = (
                f"Places and speeds are measured {self.arm_x:+.2f} m ahead and {self.arm_y:+.2f} m to starboard of the "
                "vehicle's origin, as the forces tell; the motion is corrected for it."
            )
            terms = (
                FoundTerm(symbol="arm_x", value=self.arm_x, unit="m"),
                FoundTerm(symbol="arm_y", value=self.arm_y, unit="m"),
            )
            found.append(
                SensorError(error="antenna_arm", verdict="present", sentence=told, terms=terms, correction=ARM)
            )
        if abs(self.compass) >= _LEAST[2]:
            angle = float(np.degrees(self.compass))
            told = f"The heading lacks {angle:+.1f} degrees, as the forces tell; it and the speeds are corrected."
            terms = (FoundTerm(symbol="misalignment", value=angle, unit="deg"),)
            error = "compass_deviation"
            found.append(SensorError(error=error, verdict="present", sentence=told, terms=terms, correction=COMPASS))
        return tuple(found)


def beside_sensors(looked: Selected, say: Callable[[str], None]) -> tuple[Selected, HiddenErrors | None]:
    """What was found, or what is found without an error of the sensors, where the force balance asks for one.

    Where rollouts judge, the force balance leaves what no model takes, and that looks like anything: they leave what an
    error of the sensors makes undecided.
    """
    basis = looked.basis
    if basis.rolls or basis.forces.claimed or not looked.search.named(looked.state.active):
        return looked, None
    state, search = looked.state, looked.search
    columns = _columns(search, state)
    if Beside(search, columns[:, :, :0], state).worth() - Beside(search, columns, state).worth() < _ASKS:
        return looked, None
    say(Stage("the forces ask for an error of the sensors: searching beside it"))
    empty = search.evaluate(search.nominal, ())
    estimate = best_beside(search, _columns(search, empty), empty).errors * _USUAL
    best, found = looked, None
    for _ in range(_ROUNDS):
        errors = HiddenErrors.of(estimate)
        motions = [errors.corrected(motion) for motion in basis.forces.motions]
        other = select(choose(motions, basis.nominal, basis.settings), lambda text: None)
        paid = search.settings.price * np.count_nonzero((errors.arm_x, errors.arm_y, errors.compass))
        if other.basis.rolls or other.state.score + paid > best.state.score - (_BETTER if found is None else 0.0):
            break
        best, found = other, errors
        beside = best_beside(other.search, _columns(other.search, other.state), other.state)
        unsure = set(other.search.named(other.state.active)) - set(beside.state.active)
        found, more = replace(errors, unsure=tuple(sorted(unsure))), beside.errors
        if np.abs(more).max() < _SETTLED:
            break
        estimate = estimate + more * _USUAL
    if found is not None:
        say("; ".join(error.sentence for error in found.findings))
        notes = (*filter(None, [basis.part]), *best.notes)
        best = replace(best, basis=replace(best.basis, part=basis.part), notes=notes)
    return best, found


def _columns(search: Search, state: State) -> Array:
    """What errors of the usual size add to the balance of a model, (tests, 3, 3)."""
    balance, vehicle = search.balance, state.vehicle
    rest = balance.balance(vehicle)

    def without(place: int) -> Sequence[Motion]:
        sizes = [_STEP * usual if k == place else 0.0 for k, usual in enumerate(_USUAL)]
        return [HiddenErrors(sizes[0], sizes[1], sizes[2]).corrected(motion) for motion in balance.motions]

    moved = [balance.commanded(without(place), vehicle) for place in range(len(_USUAL))]
    return np.stack([(rest - balance_of) / _STEP for balance_of in moved], axis=2)
