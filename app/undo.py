"""The steps of a person's work, back and forth; each says what is open and what is made of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ..workflows.workbench_facts import Source, Stand

_KEPT = 200
"""Steps back at most."""


@dataclass(frozen=True, slots=True)
class Step:
    """What is open, and the model that is made of it.

    Examples
    --------
    >>> step = Step(Source()).adding("sway_lift").moving({"Y_ur": -3.0})
    >>> step.stand.names, step.stand.moved, step.adding("sway_lift") == step
    (('sway_lift',), (('Y_ur', -3.0),), True)
    """

    source: Source
    stand: Stand = field(default_factory=Stand)

    def adding(self, *names: str) -> "Step":
        """The same with effects that are not yet in the model; numbers that were moved are fitted again."""
        fresh = [name for name in names if name not in self.stand.names]
        return self._with(names=(*self.stand.names, *fresh), moved=()) if fresh else self

    def removing(self, name: str) -> "Step":
        """The same without an effect."""
        return self._with(names=tuple(one for one in self.stand.names if one != name), moved=())

    def moving(self, values: Mapping[str, float]) -> "Step":
        """The same with some numbers set by hand."""
        return self._with(moved=tuple(sorted({**dict(self.stand.moved), **values}.items())))

    def fitting(self) -> "Step":
        """The same with no number set by hand."""
        return self._with(moved=())

    def leaving(self, correction: str) -> "Step":
        """The same on the log without a correction of its sensors."""
        return self._with(left=tuple(sorted({*self.stand.left, correction})), moved=())

    def correcting(self, correction: str) -> "Step":
        """The same on the log with a correction that was left out."""
        return self._with(left=tuple(one for one in self.stand.left if one != correction), moved=())

    def _with(self, **changes: tuple[object, ...]) -> "Step":
        return replace(self, stand=replace(self.stand, **changes))  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class History:
    """Steps, the first one first, and which of them is the present one.

    Examples
    --------
    >>> first = Step(Source())
    >>> history = History((first,)).then(first.adding("sway_lift"))
    >>> history.back().now == first, history.back().forth() == history, history.can_redo
    (True, True, False)
    """

    steps: tuple[Step, ...]
    at: int = 0

    @property
    def now(self) -> Step:
        """The present step."""
        return self.steps[self.at]

    @property
    def can_undo(self) -> bool:
        """Whether there is a step before this one."""
        return self.at > 0

    @property
    def can_redo(self) -> bool:
        """Whether a step was taken back."""
        return self.at + 1 < len(self.steps)

    def then(self, step: Step) -> "History":
        """A step more, if it is one; those that were taken back are forgotten, and the eldest of too many."""
        if step == self.now:
            return self
        kept = (*self.steps[: self.at + 1], step)[-_KEPT:]
        return History(kept, len(kept) - 1)

    def instead(self, step: Step) -> "History":
        """Another step in the place of the last one."""
        return History((*self.steps[:-1], step), self.at)

    def moving(self, values: Mapping[str, float]) -> "History":
        """Some numbers set by hand: a step, or another last one where the same were moved already."""
        step = self.now.moving(values)
        along = values.keys() <= dict(self.now.stand.moved).keys() and not self.can_redo
        return self.instead(step) if along else self.then(step)

    def back(self) -> "History":
        """One step back, or the same at the first."""
        return replace(self, at=max(self.at - 1, 0))

    def forth(self) -> "History":
        """The step again that was taken back, or the same at the last."""
        return replace(self, at=min(self.at + 1, len(self.steps) - 1))
