"""A line about work that goes on, which knows what share of the work usually lies behind it."""

from collections.abc import Callable

Say = Callable[[str], None]
"""Who is told lines about work that goes on."""

SEARCHING, WEIGHING, SCORING, COMPARING, WRITING = 0.3, 0.6, 0.75, 0.82, 0.9
"""Shares of a discovery's time that lie before its stages, the page included: of logs of one to five minutes, judged by
forces and by rollouts, to within a tenth."""
CALIBRATING, PREDICTED = 0.6, (0.68, 0.76, 0.84, 0.92)
"""The same of a calibration: before it, and after each part that is predicted, of a log of four minutes that took 8 s;
on rollouts the first lasts longer."""
_MARKS = (SEARCHING, WEIGHING, SCORING, COMPARING, WRITING, 1.0)
"""Shares that no bar passes before the next stage begins."""


class Stage(str):
    """A line that matters only while the work goes on, such as the name of a stage of a long job.

    Attributes
    ----------
    behind : share of the whole job's time that usually lies before it, 0..1; 0 where nobody knows

    Examples
    --------
    >>> stage = Stage("weighing the evidence", 0.5)
    >>> stage, stage.left(6.0)
    ('weighing the evidence', 6.0)
    """

    behind: float
    __slots__ = ("behind",)

    def __new__(cls, line: str, behind: float = 0.0) -> "Stage":
        """A line with its share."""
        stage = super().__new__(cls, line)
        stage.behind = behind
        return stage

    def __getnewargs__(self) -> tuple[str, float]:
        return str(self), self.behind

    def left(self, so_far: float) -> float:
        """Time that is left [s], after so long; 0 where nobody knows."""
        return so_far * (1.0 - self.behind) / self.behind if self.behind else 0.0

    def share(self, then: float, now: float) -> float:
        """Share of the work that is done, when the stage began and it is now so long after the beginning of all [s].

        It does not pass the mark of the next stage before that begins.

        Examples
        --------
        >>> Stage("searching", 0.3).share(3.0, 5.0), Stage("searching", 0.3).share(3.0, 60.0)
        (0.5, 0.6)
        """
        end = next((mark for mark in _MARKS if mark > self.behind), 1.0)
        return min(self.behind * now / then, end) if then > 0.0 else self.behind
