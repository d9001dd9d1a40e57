"""What preparation makes: a `DataSet` of motions, by a `Recipe` that says how."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

from ...physics.errors import RequestError
from ...physics.motion import Motion


@dataclass(frozen=True, slots=True)
class Recipe:
    """How logs become motions.

    Attributes
    ----------
    rate : of the even time base [Hz]; None for the odometry's own rate, at most 20 Hz
    cutoff : of the zero-phase Butterworth low-pass on the velocities [Hz]; None for no filter
    order : of that filter (it acts twice, once in each direction)
    max_gap : longest stretch without a sample that is still bridged [s]; None for the larger of 0.5 s and five
        sample periods of the channel
    commands : "hold" for commands that stay until the next one, "interpolate" for a sampled continuous command
    shares : of train, validation and test, in this order in time
    guard : dropped at each boundary between them [s]

    Raises
    ------
    RequestError
        when a number cannot be used.
    """

    rate: float | None = 10.0
    cutoff: float | None = 1.2
    order: int = 4
    max_gap: float | None = None
    commands: Literal["hold", "interpolate"] = "hold"
    shares: tuple[float, float, float] = (0.70, 0.15, 0.15)
    guard: float = 1.0

    def __post_init__(self) -> None:
        for name in ("rate", "cutoff", "max_gap"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise RequestError(f"recipe: expected a positive {name} or None, got {value}.")
        if self.order < 1:
            raise RequestError(f"recipe: expected a filter order of at least 1, got {self.order}.")
        if self.commands not in ("hold", "interpolate"):
            raise RequestError(f"recipe: expected commands 'hold' or 'interpolate', got {self.commands!r}.")
        if min(self.shares) < 0 or abs(sum(self.shares) - 1.0) > 1e-9:
            raise RequestError(f"recipe: expected three shares that add up to 1, got {self.shares}.")
        if self.guard < 0:
            raise RequestError(f"recipe: expected a guard of at least 0 s, got {self.guard}.")
        if self.rate is not None and self.cutoff is not None and self.cutoff >= self.rate / 2:
            raise RequestError(
                f"recipe: a cutoff of {self.cutoff} Hz needs a rate above {2 * self.cutoff} Hz, got {self.rate} Hz."
            )


PAPER = Recipe()
"""The paper's preparation: 10 Hz, 4th-order Butterworth at 1.2 Hz, zero phase; then central differences."""

WEAK = Recipe(rate=None, cutoff=None)
"""For the weak form, which needs no derivative: the log's own rate and no filter."""


@dataclass(frozen=True, slots=True)
class DataSet:
    """Motions of one or several logs, ready for use.

    Attributes
    ----------
    motions : gap-free stretches, log by log, in the order of time; filtered if the recipe has a cutoff
    notes : every guess, conversion and loss on the way, as sentences
    recipe : how they were made
    unfiltered : the same motions before the filter, from which `split` starts so that the filter never looks across
        a boundary; None when `motions` are not filtered
    """

    motions: tuple[Motion, ...]
    notes: tuple[str, ...]
    recipe: Recipe = field(default=WEAK)
    unfiltered: tuple[Motion, ...] | None = None

    @property
    def rows(self) -> int:
        """Number of time stamps in all motions."""
        return sum(motion.time.size for motion in self.motions)

    @property
    def seconds(self) -> float:
        """Summed duration of all motions [s]."""
        return float(sum(motion.duration for motion in self.motions))

    def mapped(self, change: Callable[[Motion], Motion]) -> "DataSet":
        """The same with every motion changed, filtered and unfiltered alike: it is linear in what is filtered."""
        raw = None if self.unfiltered is None else tuple(map(change, self.unfiltered))
        return replace(self, motions=tuple(map(change, self.motions)), unfiltered=raw)

    @property
    def raw(self) -> tuple[Motion, ...]:
        """The motions without filter."""
        return self.motions if self.unfiltered is None else self.unfiltered
