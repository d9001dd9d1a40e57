"""The terminal: what verbs print, how they fail, and how Ctrl-C ends them.

The terminal: what verbs print, and how they fail.

Ctrl-C, and the signals of a system that shuts down, end a verb with one line and the shell's exit code.

Python raises KeyboardInterrupt wherever it is, also where nobody can catch it: while modules load, in a callback of a
library, in a finalizer. There it ends in a traceback, or is passed over and the program goes on. So outside of the work
the process ends at once, and inside, what was passed over is asked for again.
"""

import atexit
import io
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, TextIO

import typer
from typer.core import TyperGroup

from ..physics.errors import MOST_TOLD, one_line, printable, shortened
from ..reports.terminal.progress import Progress

if TYPE_CHECKING:
    from ..comparison.facts import Comparison
    from ..discovery.findings import Step
    from ..discovery.found_effects import FoundEffect


WIDEST = 120
"""Columns beyond which nothing is spread out."""
NARROWEST = 20
"""Columns below which nothing is squeezed: a name and a number beside each other need them; the terminal wraps."""


def open_streams() -> None:
    """Make streams of closed ones, and let a terminal that cannot show "m/s²" have "m/s?", not a traceback.

    Where stdin, stdout or stderr is closed, the next file that is opened would take its number, and what a library
    prints would stand in it; and `print` to a stderr that is None goes to stdout.
    """
    while (handle := os.open(os.devnull, os.O_RDWR)) <= 2:  # the lowest number that is free
        pass
    os.close(handle)
    for number, name in enumerate(("stdout", "stderr"), start=1):
        stream = getattr(sys, name)
        if stream is None:
            raw = io.FileIO(number, "w", closefd=False)
            setattr(sys, name, io.TextIOWrapper(io.BufferedWriter(raw), encoding="utf-8"))
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    columns = os.environ.get("COLUMNS", "")
    if columns and not (columns.isdecimal() and len(columns) <= 4 and int(columns) >= NARROWEST):
        del os.environ["COLUMNS"]  # the terminal knows better


def check_here() -> None:
    """Leave with exit code 2 when the working folder was removed: every relative path, and Python itself, need it."""
    try:
        os.getcwd()
    except OSError as error:
        complain(f"undertow: the current folder cannot be used ({error.strerror}); change to one that is there")
        raise SystemExit(2) from None


@contextmanager
def sending() -> Iterator[None]:
    """Send all that is printed inside; end without a word, with exit code 1, when the reader has left (a closed pipe).

    Exit code 2 for a full disk.
    """
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except OSError as error:
        _silence(sys.stdout)
        if isinstance(error, BrokenPipeError):
            raise SystemExit(1) from None
        complain(f"undertow: cannot write the output: {error.strerror or error}")
        raise SystemExit(2) from None


def _silence(stream: TextIO) -> None:
    """Send what cannot be written nowhere, or Python tries again at its own end, and complains."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    with suppress(OSError, ValueError):  # a stream that is no file
        os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def tell_replaced(paths: Iterable[Path]) -> None:
    """Say on stderr of which earlier files others took the place."""
    for path in paths:
        complain(f"  replaced the earlier {shortened(one_line(str(path)), MOST_TOLD)}")


def complain(text: str) -> None:
    """Print on stderr, below all progress."""
    progress.close()
    _on_stderr(text)


def _on_stderr(text: str) -> None:
    """Print on stderr; where nobody can read that, the work goes on all the same."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:
        _silence(sys.stderr)


progress = Progress(ticks=True, tell=_on_stderr)
"""What the verb at work tells of it."""


def say(text: str) -> None:
    """Print a line; what no terminal should be told is written as escapes."""
    progress.close()
    print(shortened(one_line(text)))


def say_lines(text: str) -> None:
    """Print several lines that are a whole, such as a channel map, in full."""
    progress.close()
    print(printable(text))


def prose(text: str, style: str = "") -> None:
    """Print a paragraph, wrapped at the terminal's width, and a blank line; nothing for an empty text."""
    from ..reports.terminal.layout import Prose

    show(Prose(text, style) if text else None)


def show(*parts: Any) -> None:
    """Print tables and texts, each with a blank line after it; None is passed over."""
    from ..reports.terminal.layout import terminal

    progress.close()
    console = terminal()
    console.width = max(NARROWEST, min(console.width, WIDEST))
    for part in parts:
        if part is not None:
            console.print(part)
            console.print()


def print_json(data: dict[str, Any]) -> None:
    """Print strict JSON."""
    from ..physics.files import strict_json

    progress.close()
    print(strict_json(data))


QuietOption = Annotated[
    bool,
    typer.Option(
        "--quiet", "-q", help="Tell nothing of work that goes on; results, warnings and errors are told all the same."
    ),
]


def telling(verb: Callable[..., None]) -> Callable[..., None]:
    """A verb that takes --quiet beside its own options, and knows when it began."""

    @wraps(verb)
    def told(*words: Any, quiet: bool = False, **options: Any) -> None:
        progress.begin(quiet)
        verb(*words, **options)

    own = signature(verb)
    option = Parameter("quiet", Parameter.KEYWORD_ONLY, default=False, annotation=QuietOption)
    vars(told)["__signature__"] = own.replace(parameters=[*own.parameters.values(), option])
    told.__annotations__ = {**verb.__annotations__, "quiet": QuietOption}
    return told


class Verbs(TyperGroup):
    """The verbs, whose messages about mistyped words quote those words as short and harmless as all others do."""

    def make_context(self, *words: Any, **more: Any) -> Any:
        """See `click.Command.make_context`: the options before the verb."""
        with _quoting():
            return super().make_context(*words, **more)

    def invoke(self, ctx: Any) -> Any:
        """See `click.Command.invoke`: the verb, and what comes after it."""
        with _quoting():
            return super().invoke(ctx)


@contextmanager
def _quoting() -> Iterator[None]:
    try:
        yield
    except Exception as error:
        told = getattr(error, "message", None)
        if hasattr(error, "format_message") and isinstance(told, str):  # click's own, a copy of which typer carries
            vars(error)["message"] = shortened(one_line(told), MOST_TOLD // 2)  # and it puts a frame round each line
        raise


@contextmanager
def failing_clearly() -> Iterator[None]:
    """Turn undertow's own errors, and files that cannot be opened, into one message on stderr and exit code 2."""
    from ..physics.errors import LogError, RequestError, VehicleError

    try:
        with interruptible():
            yield
    except (LogError, RequestError, VehicleError) as error:
        fail(error.typed)
    except KeyboardInterrupt as error:
        interrupted(error)
    except BrokenPipeError:
        raise  # whoever read the output has left; typer ends without a word
    except OSError as error:
        named = error.filename2 or error.filename
        if named is None:
            _silence(sys.stdout)
        fail(f"{'cannot write the output' if named is None else named}: {error.strerror or error}")
    except MemoryError:
        fail("the memory of this machine does not suffice; give less at once: a shorter log, or fewer logs")


def interrupted(error: KeyboardInterrupt, more: str = "") -> NoReturn:
    """Say that the user, or the system, ended a verb, and what is kept of it; exit code 130 for Ctrl-C."""
    text, code = told(error)
    complain(f"\nundertow: {text}{'; ' * bool(more)}{more}")
    leave(code)
    raise typer.Exit(code) from None


def fail(text: str) -> NoReturn:
    """Print a message on stderr and leave with exit code 2; a long one is shortened in its middle."""
    complain(f"undertow: {shortened(one_line(text), MOST_TOLD)}")
    raise typer.Exit(2)


def show_steps(
    steps: "Sequence[Step]", candidates: "Sequence[FoundEffect]" = (), comparison: "Comparison | None" = None
) -> None:
    """The errors step by step, beside those of a calibration alone, and what is left of them; see `steps_table`."""
    from ..reports.terminal.findings_screen import error_left, steps_table

    show(steps_table(steps, candidates, comparison))
    prose(error_left(steps, comparison.best.horizon if comparison else ""))


def tell_repairs(repairs: Iterable[str]) -> None:
    """What was repaired in the logs in memory, a paragraph a log."""
    for text in repairs:
        prose(f"{text[:1].upper()}{text[1:]}.")


def warn(warnings: Iterable[str]) -> None:
    """What is wrong with the logs, above everything else."""
    from ..reports.terminal.layout import UNSURE

    for text in warnings:
        prose(f"Warning: {text}", UNSURE)


WORDS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "the terminal was closed"}
"""What is said of each signal; a system may lack some of them."""
_PATIENCE = 3.0
"""Seconds to tidy up after the first signal: temporary folders go in less, and a user waits no longer."""
_AGAIN = 0.05
"""Seconds after which an interruption that a library passed over is raised again."""


_heard: list[int] = []
"""The signals that were raised as KeyboardInterrupt."""


def listen() -> None:
    """From now on a signal ends this process at once; `nohup` and whoever handles signals already are respected."""
    for number in _signals():
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, _leave)
    sys.unraisablehook = _unraisable


@contextmanager
def interruptible() -> Iterator[None]:
    """Inside, the first signal raises KeyboardInterrupt, so that work can be tidied up; a second ends the process.

    Nothing changes in a process that does not `listen`.
    """
    ours = [number for number in _signals() if signal.getsignal(number) is _leave]
    for number in ours:
        signal.signal(number, _interrupt)
    try:
        yield
    except KeyboardInterrupt:
        raise
    except BaseException:
        _passed_over()
        raise
    else:
        _passed_over()
    finally:
        for number in ours:
            signal.signal(number, _leave)
        if _heard and hasattr(signal, "setitimer"):  # what was asked for again is about to be told
            signal.setitimer(signal.ITIMER_REAL, 0.0)


def _passed_over() -> None:
    """Raise an interruption that the work went on after: a library caught it, or made another error of it."""
    if _heard:
        raise KeyboardInterrupt(_heard[0]) from None


def told(error: KeyboardInterrupt) -> tuple[str, int]:
    """What to say of an interruption, and the exit code: 130 for Ctrl-C, as in every shell."""
    number = error.args[0] if error.args and isinstance(error.args[0], int) else signal.SIGINT
    return WORDS.get(signal.Signals(number).name, WORDS["SIGINT"]), 128 + number


def leave(code: int) -> None:
    """End a process that listens, now that all is tidied up and said; return in any other.

    Python's own end takes its time and forgets the handlers, and after an interruption inside of `exec`, which makes
    dataclasses, it does not give the code that it was asked for.
    """
    if _listening():
        os._exit(code)


def finish(code: int) -> None:
    """End a process that listens, its work done, and all said: what is pressed now is too late.

    Python's own end takes 0.4 s, in which it takes apart objects that end with the process.
    """
    ours = _listening()
    for number in ours:
        signal.signal(number, signal.SIG_IGN)
    if ours:
        atexit._run_exitfuncs()  # what libraries left for the end: temporary folders, logs
        sys.stderr.flush()
        os._exit(code)


def _listening() -> list[int]:
    """The signals that this module handles in this process."""
    return [number for number in _signals() if signal.getsignal(number) in (_leave, _interrupt)]


def _signals() -> list[int]:
    return [getattr(signal, name) for name in WORDS if hasattr(signal, name)]


def _leave(number: int, _: FrameType | None = None) -> None:
    """End the process; nothing that is half done has its name yet."""
    text, code = told(KeyboardInterrupt(number))
    with suppress(OSError):
        os.write(2, f"\nundertow: {text}\n".encode())
    os._exit(code)


def _interrupt(number: int, _: FrameType | None = None) -> None:
    for each in _signals():
        if signal.getsignal(each) is _interrupt:
            signal.signal(each, _leave)
    _ask_again(number, _PATIENCE, _leave)
    _heard.append(number)
    raise KeyboardInterrupt(number)


def _ask_again(number: int, seconds: float, what: Any) -> None:
    """Do it when the process is still there; a system without timers has only the second signal."""
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, lambda *_: what(number))
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _unraisable(args: Any) -> None:
    """An error in a callback or a finalizer, which Python only prints: an interruption is raised again elsewhere."""
    error = args.exc_value
    if isinstance(error, KeyboardInterrupt):
        _ask_again(error.args[0] if error.args else signal.SIGINT, _AGAIN, _interrupt)
    elif not (_heard or isinstance(error, BrokenPipeError)):  # what an interruption broke is no news, and `flush` tells
        sys.__unraisablehook__(args)  # by the exit code that the reader has left
