"""A line about work that goes on, which knows what share of the work usually lies behind it."""

SEARCHING, WEIGHING, SCORING, COMPARING, WRITING = 0.3, 0.6, 0.75, 0.82, 0.9
"""Shares of a discovery's time that lie before its stages, the page included: of logs of one to five minutes, judged by
forces and by rollouts, to within a tenth."""


class Stage(str):
    """The name of a stage of a long job, as a line that is told.

    Attributes
    ----------
    behind : share of the whole job's time that usually lies before it, 0..1

    Examples
    --------
    >>> stage = Stage("weighing the evidence", 0.5)
    >>> stage, stage.left(6.0)
    ('weighing the evidence', 6.0)
    """

    behind: float
    __slots__ = ("behind",)

    def __new__(cls, line: str, behind: float) -> "Stage":
        """A line with its share."""
        stage = super().__new__(cls, line)
        stage.behind = behind
        return stage

    def __getnewargs__(self) -> tuple[str, float]:
        return str(self), self.behind

    def left(self, so_far: float) -> float:
        """Time that is left [s], after so long."""
        return so_far * (1.0 - self.behind) / self.behind
