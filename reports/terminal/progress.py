"""Progress of work: a bar with the time left on a terminal, plain lines elsewhere; steps, bytes and training epochs."""

import math
import os
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from ...physics.errors import MOST_TOLD, one_line, shortened
from ...physics.stage import Course, Say, Stage

if TYPE_CHECKING:
    from ...residuals.training.history import Epoch


_WORTH_TELLING = 2.0
"""Time from which a line tells how long the work took so far [s]: less is no wait."""
_TICK = 0.25
"""Time between two looks of the bar [s]: its clock shows whole seconds."""
_CELLS = 20
"""Width of the bar: a step of a cell is a twentieth of the work, and the rest of 80 columns is for words."""
_NARROWEST = 40
"""Columns below which there is no bar: beside the times no word would fit."""
_MINUTES = 100.0
"""Time from which what is left is told in minutes [s]: no pace is known to a second of it."""
_ERASE = "\r\x1b[K"

P = ParamSpec("P")
R = TypeVar("R")


class Progress:
    """Who is told of work that goes on, and shows it on stderr: called with lines, and with `counted` parts of a step.

    On a terminal a `Stage` and counted parts are shown in one line, with a bar where the share of the whole job is
    known; it goes when the work ends, and the bar only goes forward. Other lines stay. Elsewhere every line is printed.

    Parameters
    ----------
    quiet : nothing is shown
    ticks : the bar's clock goes on between lines, by the timer of this process, which must be ours to take
    tell : prints a line

    Attributes
    ----------
    quiet : as given
    """

    def __init__(self, quiet: bool = False, ticks: bool = False, tell: Say | None = None) -> None:
        self._tell, self._ticks = tell or _on_stderr, ticks
        self.begin(quiet)

    def begin(self, quiet: bool = False) -> None:
        """Begin anew: other work, with a clock of its own."""
        self.quiet, self._since = quiet, time.monotonic()
        self._stage, self._detail, self._course = Stage(""), "", Course()
        self._counted: tuple[str, float, float] | None = None
        self._process = 0

    def __call__(self, line: str) -> None:
        """Show a line."""
        if self.quiet:
            return
        so_far, left = time.monotonic() - self._since, 0.0
        if isinstance(line, Stage) and line.behind:
            self._course.begin(line, so_far)
            left = self._course.time_left(so_far)
        if isinstance(line, Stage) and on_terminal():
            if line.behind:
                self._stage, self._detail = line, ""
            else:
                self._detail = line
            self._counted = None
            self._draw(so_far)
            return
        more = f", {about(left)}" if left >= _WORTH_TELLING else ""
        after = f" [{so_far:.0f} s{more}]" if so_far >= _WORTH_TELLING else ""
        if on_terminal():
            _write(_ERASE)
        self._tell(f"  {shortened(one_line(line), MOST_TOLD)}{after}")

    def counted(self, line: str, share: float, left: float, *, whole: bool = False) -> bool:
        """Show how much of a step is done, if this is a terminal; whether it is.

        Parameters
        ----------
        line : the step and its parts, in words
        share : of the step that is done, 0..1
        left : time that is left of it [s], nan where nobody knows
        whole : the step is the job, and fills the bar; others follow on one that is a part, and begin anew
        """
        if not self.quiet and on_terminal():
            told = (line, share if whole else 0.0, left)
            self._counted, self._detail = (told, self._detail) if share < 1.0 else (None, "")
            self._draw(time.monotonic() - self._since)
            return True
        return self.quiet

    def close(self) -> None:
        """Take the bar away: what follows is printed."""
        if hasattr(signal, "setitimer") and signal.getsignal(signal.SIGALRM) == self._tick:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
        if not self.quiet and on_terminal():
            _write(_ERASE)
        self._process = 0

    def _draw(self, so_far: float) -> None:
        """Draw the bar; a process that was forked while there is one leaves it to its parent."""
        if self._process not in (0, os.getpid()) or not (self._stage or self._detail or self._counted):
            return
        if self._process == 0:
            self._process = os.getpid()
            self._listen()
        _write(f"{_ERASE}{self.line(so_far, shutil.get_terminal_size().columns)}")

    def line(self, so_far: float, columns: int) -> str:
        """The bar after so long [s], as wide as the terminal at most."""
        words, share, left = self._detail, 0.0, 0.0
        if self._counted is not None:
            words, share, left = self._counted
        if self._stage:
            share, left = self._course.share(so_far), self._course.time_left(so_far)
            words = f"{self._stage}: {words}" if words else self._stage
        text = f"{so_far:.0f} s" + (f", {about(left)}" if left >= _WORTH_TELLING else "")
        bar = f"{_cells(share)} " if share and columns >= _NARROWEST else ""
        line, room = f"  {bar}{text}  ", columns - 1
        used = len(line) - (len(bar) - _CELLS - 1 if bar else 0)
        return line + _cut(one_line(words), max(room - used, 0))

    def _listen(self) -> None:
        """Let the clock go on."""
        main = threading.current_thread() is threading.main_thread()
        if self._ticks and main and hasattr(signal, "setitimer") and signal.getsignal(signal.SIGALRM) == signal.SIG_DFL:
            signal.signal(signal.SIGALRM, self._tick)
            signal.siginterrupt(signal.SIGALRM, False)  # who reads a file goes on
            signal.setitimer(signal.ITIMER_REAL, _TICK, _TICK)

    def _tick(self, *_: Any) -> None:
        with suppress(RuntimeError):  # in the midst of another line
            self._draw(time.monotonic() - self._since)


def SHOWN(line: str) -> None:
    """Stand for a `Progress` of its own, the default of every function that works for seconds; None is silent."""
    raise AssertionError(f"a function without @showing was given {line!r}")


def showing(work: Callable[P, R]) -> Callable[P, R]:
    """A function that shows its progress, unless it is called with another `progress`, or with None."""

    @wraps(work)
    def shown(*args: P.args, **kwargs: P.kwargs) -> R:
        if kwargs.get("progress", SHOWN) is not SHOWN:
            return work(*args, **kwargs)
        kwargs["progress"] = progress = Progress()
        try:
            return work(*args, **kwargs)
        finally:
            progress.close()

    return shown


def on_terminal() -> bool:
    """True when stderr is a terminal on which a line can be drawn anew."""
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


def about(seconds: float) -> str:
    """The time that is left, in words.

    >>> about(12.3), about(150.0)
    ('about 12 s left', 'about 2 min left')
    """
    return f"about {seconds:.0f} s left" if seconds < _MINUTES else f"about {seconds / 60.0:.0f} min left"


def _cut(words: str, room: int) -> str:
    return words if len(words) <= room else f"{words[: max(room - 3, 0)]}..."


def _cells(share: float) -> str:
    """A bar that is full to a share: heavy and light, in colour where the terminal has it."""
    full = round(_CELLS * min(max(share, 0.0), 1.0))
    heavy, light = ("━", "─") if "utf" in (sys.stderr.encoding or "").lower() else ("#", "-")
    done, rest = heavy * full, light * (_CELLS - full)
    return f"{done}{rest}" if os.environ.get("NO_COLOR") else f"\x1b[36m{done}\x1b[2m{rest}\x1b[0m"


def _write(text: str) -> None:
    with suppress(OSError, ValueError):  # nobody reads it
        sys.stderr.write(text)
        sys.stderr.flush()


def _on_stderr(line: str) -> None:
    _write(f"{line}\n")


T = TypeVar("T")

FIRST = 2.0
"""Time after which a step tells how far it is [s]: less is no wait."""
SECONDS_A_LINE = 5.0
"""Seconds between lines after that: often enough to see that it goes on, seldom enough for the log of a batch job."""
_MEGABYTE = 1e6
"""[B], in which lines tell of bytes."""
_OFTEN = 0.1
"""Seconds between two looks of a bar: more nobody sees."""


class Pace:
    """Lines about a step whose parts are counted.

    Parameters
    ----------
    say : called with a line; None for nobody
    step : its name, as the line begins
    unit : of what is counted
    even : whether the parts take equal times, so that the time left follows from those that are done
    """

    def __init__(self, say: Say | None, step: str, unit: str = "", even: bool = True) -> None:
        self._say, self._step, self._unit, self._even = say, step, unit, even
        self._begin()

    def _begin(self) -> None:
        self._begun = self._look = time.monotonic()
        self._done, self._next = 0.0, self._begun + FIRST

    def told(self, done: float, total: float) -> None:
        """Take note of how much is done, and tell it: a bar at once, lines where the last one is long ago.

        Fewer than before are those of another step of the same name, such as the next log.
        """
        if done < self._done:
            self._begin()
        self._done, now, ended = done, time.monotonic(), done >= total
        left = (now - self._begun) * (total - done) / done if self._even and done > 0.0 else math.nan
        line = f"{self._step}: {done:.0f} of {total:.0f}{self._unit}"
        if isinstance(self._say, Progress):
            if now < self._look and not ended:
                return
            self._look = now + _OFTEN
            if self._say.counted(line, 1.0 if ended else done / total, left):
                return
        if self._say is not None and not ended and now >= self._next:
            self._next = now + SECONDS_A_LINE
            self._say(line if math.isnan(left) else f"{line}, {about(left)}")


def megabytes(say: Say | None) -> Callable[[int, int], None]:
    """Who is told of bytes that are read, of a large log after the other."""
    pace = Pace(say, "reading", " MB")
    return lambda done, total: pace.told(done / _MEGABYTE, total / _MEGABYTE)


def paced(items: Sequence[T], step: str, say: Say | None, *, even: bool = True) -> Iterator[T]:
    """The items of a step, with lines about it; see `Pace`."""
    pace = Pace(say, step, even=even)
    for done, item in enumerate(items):
        pace.told(done, len(items))
        yield item
    pace.told(len(items), len(items))


EPOCHS_A_LINE = 10
"""Epochs between plain lines: thirty for a training of the usual 300."""


def epoch_lines(epochs: int, say: Say | None) -> "Callable[[Epoch], None]":
    """A function that tells of an epoch; the time left is that of all epochs, which a training seldom needs."""
    begun, first = time.monotonic(), [0]

    def told(epoch: "Epoch") -> None:
        first[0] = first[0] or epoch.number  # of a training that is resumed, not 1
        of = f" of at most {epochs}" if epoch.number <= epochs else ", at states against the laws"
        line = f"epoch {epoch.number}{of}: {epoch_words(epoch)}"
        done = epoch.number - first[0] + 1
        left = (time.monotonic() - begun) * (epochs - epoch.number) / done if done > 1 else math.nan
        if isinstance(say, Progress) and say.counted(line, epoch.number / epochs, left, whole=True):
            return
        if say is not None and (epoch.number == 1 or epoch.number % EPOCHS_A_LINE == 0):
            say(line)

    return told


def epoch_words(epoch: "Epoch") -> str:
    """Loss, validation error and violating share of an epoch."""
    loss = "none" if epoch.loss is None else f"{epoch.loss:.3g}"
    return f"loss {loss}, validation error {epoch.rmse:.3f}, breaks the laws at {100 * epoch.violating:.1f} %"
