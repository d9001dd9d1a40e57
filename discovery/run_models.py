"""The models of a finished run: what is added of what it found has its numbers, and is not fitted a second way."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..physics.effects import BY_NAME
from ..physics.frames import AXES, FORCE_UNITS
from ..physics.vehicle import Vehicle
from .candidates.nuisance import CALIBRATED
from .findings import Findings, Step
from .search.bootstrap import Interval


@dataclass(frozen=True, slots=True, eq=False)
class RunStep:
    """A step of a run: what it added, the model after it, and the same fitted without each fold, where any was."""

    label: str
    vehicle: Vehicle
    unseen: tuple[Vehicle, ...]


@dataclass(frozen=True, slots=True, eq=False)
class RunModels:
    """The models of a run, step by step.

    Attributes
    ----------
    findings : of the run
    nominal : the vehicle that it corrects
    steps : after the nominal model
    """

    findings: Findings
    nominal: Vehicle
    steps: tuple[RunStep, ...]

    @classmethod
    def of(cls, findings: Findings | None, nominal: Vehicle) -> "RunModels | None":
        """The models that findings hold; None where they hold none, as those of an earlier version."""
        steps = findings.steps[1:] if findings else ()
        if findings is None or not steps or not all(step.values for step in steps):
            return None
        name = f"{nominal.name}, corrected"
        judged = findings.folds is not None and bool(findings.folds.models)  # by folds, and not by a part kept aside
        made = [
            RunStep(
                _label(step),
                nominal.with_values(step.values, name=name),
                tuple(nominal.with_values(values) for values in step.unseen) if judged else (),
            )
            for step in steps
        ]
        return cls(findings, nominal, tuple(made))

    @property
    def own(self) -> bool:
        """Whether the file's own numbers are fitted in them."""
        return self.steps[0].label == CALIBRATED

    @property
    def rolls(self) -> bool:
        """Whether rollouts judged the run, and not the force balance."""
        return self.findings.criterion.unit.get(AXES[0], FORCE_UNITS[0]) != FORCE_UNITS[0]

    @property
    def names(self) -> tuple[str, ...]:
        """The effects and terms of the run's model, in the order of its steps."""
        return tuple(step.label for step in self.steps if step.label != CALIBRATED)

    @property
    def last(self) -> RunStep:
        """The run's model."""
        return self.steps[-1]

    def holds(self, names: Sequence[str]) -> bool:
        """Whether the run's model has all of these."""
        return set(names) <= set(self.names)

    def is_whole(self, names: Sequence[str]) -> bool:
        """Whether these are all that the run's model has."""
        return set(names) == set(self.names)

    def step(self, names: Sequence[str]) -> RunStep | None:
        """The step of the run whose model has these effects and no others; None where it has none."""
        found: set[str] = set()
        for one in self.steps:
            found |= {one.label} - {CALIBRATED}
            if found == set(names):
                return one
        return None

    @property
    def intervals(self) -> Mapping[str, Interval]:
        """95 % intervals of the numbers of the run's model, by symbol, as a corrected file has them."""
        found = {one.symbol: one.ci95 for one in self.findings.calibrated if one.ci95 is not None}
        for effect in self.findings.added:
            for term in effect.terms:
                if term.ci95 is not None:
                    added = effect.effect in BY_NAME and BY_NAME[effect.effect].added
                    more = self.nominal.value(term.symbol) if added else 0.0
                    found[term.symbol] = Interval(term.ci95.lower + more, term.ci95.upper + more)
        return found | {f"{t.axis}:{t.form}": t.ci95 for t in self.findings.unnamed if t.ci95 is not None}


def named_as_found(findings: Findings | None, effects: Sequence[str]) -> list[str]:
    """Effects by name, each on the thrusters on which a run found it where the name tells no thruster."""
    steps = [step for step in findings.steps if step.thruster] if findings else []
    found = [(name, [_label(step) for step in steps if step.added == name]) for name in effects]
    return [each for name, meant in found for each in (meant or [name])]


def values_of_step(vehicle: Vehicle, nominal: Vehicle) -> dict[str, float]:
    """What a model has in the place of the nominal model's numbers, by symbol."""
    return {symbol: value for symbol, value in vehicle.values.items() if value != nominal.value(symbol)}


def _label(step: Step) -> str:
    return f"{step.added}[{step.thruster}]" if step.thruster else str(step.added)
