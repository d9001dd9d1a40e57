"""The work of the machine that goes on: what it is, how far it is, and since when."""

from dataclasses import dataclass, replace

_SHARES = 0.15
"""By how much the shares of `physics.stage` may be wrong here: those of the demo are by up to 0.13, idle or loaded."""


@dataclass(frozen=True, slots=True)
class Work:
    """What goes on.

    Attributes
    ----------
    name : of it, or of its present stage
    begun : when it began [s]
    stages : share that usually lies before each stage that has begun, and when that was [s]

    Examples
    --------
    >>> work = Work("searching", 0.0).at("searching", 0.3, 2.0)
    >>> work.left(5.0) is None, [round(end, 1) for end in work.at("weighing", 0.6, 8.0).left(8.0)]
    (True, [3.3, 22.0])
    """

    name: str
    begun: float
    stages: tuple[tuple[float, float], ...] = ()

    @property
    def behind(self) -> float | None:
        """Share that usually lies behind it; None where nobody knows."""
        return self.stages[-1][0] if self.stages else None

    def at(self, name: str, behind: float, now: float) -> "Work":
        """The same at a stage; of one that was behind it already, as in a second search, it is counted anew."""
        if not behind or behind == self.behind:
            return replace(self, name=name)
        before = () if self.behind is not None and behind < self.behind else self.stages
        return replace(self, name=name, stages=(*before, (behind, now)))

    def left(self, now: float) -> tuple[float, float] | None:
        """Least and most time that is left [s], at the pace of the stages so far; None where they do not tell.

        What lay before the first stage is not counted: what a stage finds done already took no time here.
        """
        if len(self.stages) < 2:
            return None
        (first, begun), (behind, then) = self.stages[0], self.stages[-1]
        took, passed, rest, since = then - begun, behind - first, 1.0 - behind, now - then
        if passed <= _SHARES:
            return None
        least = max(took * (rest - _SHARES) / (passed + _SHARES) - since, 0.0)
        most = took * (rest + _SHARES) / (passed - _SHARES) - since
        return (least, most) if most > 0.0 else None
