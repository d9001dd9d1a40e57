"""Stages of a verb: lines of progress that know their usual share of the time, and memory freed between stages.

The C library of Linux keeps free blocks between used ones, and Python looks for cycles of objects too often for a verb:
both are dealt with here.
"""

import ctypes
import gc
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
    >>> stage, stage.behind
    ('weighing the evidence', 0.5)
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


class Course:
    """Progress of a job, by the stages that it tells: it only goes forward.

    A job may go back to a stage that it had behind it, such as a second search. What it does from there on shares what
    is left of the bar, at the pace of the first time.

    Examples
    --------
    >>> course = Course()
    >>> course.begin(Stage("scoring", 0.75), 9.0)
    >>> course.share(9.0), course.time_left(9.0)
    (0.75, 3.0)
    >>> course.begin(Stage("searching again", 0.3), 9.0)
    >>> course.share(9.0), round(course.time_left(9.0), 1)
    (0.75, 8.4)
    """

    __slots__ = ("_before", "_from", "_stage", "_then")

    def __init__(self) -> None:
        self._stage, self._then = Stage(""), 0.0
        self._from = 0.0, 0.0
        self._before = 0.0

    def __bool__(self) -> bool:
        """True when any stage has begun."""
        return bool(self._stage)

    def begin(self, stage: Stage, now: float) -> None:
        """A stage with a known share begins, so long after the beginning of all [s]."""
        if stage.behind < self._stage.behind and self._then > 0.0:
            shown, whole = self.share(now), (now - self._before) / self._passed(now)
            self._from = shown, stage.behind
            self._before = now - stage.behind * whole
        self._stage, self._then = stage, now - self._before

    def share(self, now: float) -> float:
        """Share of the job that is done, 0..1."""
        shown, behind = self._from
        return shown + (1.0 - shown) * (self._passed(now) - behind) / (1.0 - behind)

    def time_left(self, now: float) -> float:
        """Time that is left [s]; 0 where nobody knows."""
        passed = self._passed(now)
        return (now - self._before) * (1.0 - passed) / passed if passed else 0.0

    def _passed(self, now: float) -> float:
        """Share of a job that goes through its stages once."""
        return self._stage.share(self._then, now - self._before)


def trim_memory() -> None:
    """Hand back all that is free; where the C library is another than GNU's, it does as it likes."""
    try:
        ctypes.CDLL(None).malloc_trim(0)
    except (OSError, TypeError, AttributeError):
        return


_PACE = 50_000
"""New objects from one look to the next, with Python 700 or 2000: loading and searching make hundreds of thousands that
stay, and hardly a cycle; to look for them takes a twentieth of an answer's time."""


def collect_seldom() -> None:
    """Look less often."""
    gc.set_threshold(_PACE)


def freeze_loaded_objects() -> None:
    """Look no more at what there is now, modules most of all; nor does a look then copy their pages in a fork."""
    gc.freeze()


def collect_and_freeze() -> None:
    """Take away the cycles that there are, and look no more at what is left.

    Who must answer within milliseconds does so before: a look at all that is loaded takes 50 to 150 of them.
    """
    gc.collect()
    gc.freeze()
