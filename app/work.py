"""The work of the machine that goes on: what it is, how far it is, and since when."""

from dataclasses import dataclass
from time import monotonic


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
