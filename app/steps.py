"""A step of a person's work, and the work of the machine that goes on meanwhile."""

from dataclasses import dataclass
from time import monotonic


@dataclass(frozen=True, slots=True)
class Stand:
    """A model as its steps make it: the effects in it, in order, and numbers that were moved by hand."""

    names: tuple[str, ...] = ()
    moved: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Work:
    """What goes on: its name, the share that usually lies behind it (None where nobody knows), and since when."""

    name: str
    behind: float | None
    begun: float

    @property
    def left(self) -> float | None:
        """Time that is left [s], as far as it can be told."""
        so_far = monotonic() - self.begun
        return so_far * (1.0 - self.behind) / self.behind if self.behind and so_far > 1.0 else None
