"""The terminal: what verbs print, and how they fail."""

import io
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import typer
from typer.core import TyperGroup

from ..physics.errors import MOST_TOLD, one_line, printable, shortened
from ..reports.terminal.progress import Progress

if TYPE_CHECKING:
    from ..comparison.facts import Comparison
    from ..discovery.effect_findings import EffectFinding
    from ..discovery.findings import Findings, Step


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


def say_written(files: Mapping[str, Path | None]) -> None:
    """Say which files were written, by what is in them; None stands for none."""
    for what, path in files.items():
        if path is not None:
            say(f"{what}: {path}")


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
    from .interruption import interruptible

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
    from .interruption import exit_message, leave

    text, code = exit_message(error)
    complain(f"\nundertow: {text}{'; ' * bool(more)}{more}")
    leave(code)
    raise typer.Exit(code) from None


def fail(text: str) -> NoReturn:
    """Print a message on stderr and leave with exit code 2; a long one is shortened in its middle."""
    complain(f"undertow: {shortened(one_line(text), MOST_TOLD)}")
    raise typer.Exit(2)


def show_steps(
    steps: "Sequence[Step]",
    candidates: "Sequence[EffectFinding]" = (),
    comparison: "Comparison | None" = None,
    deciding: str = "",
) -> None:
    """The errors step by step, beside those of a calibration alone, and what is left of them; see `steps_table`."""
    from ..reports.terminal.findings_screen import remaining_error, steps_table

    deciding = deciding or (comparison.best.horizon if comparison else "")
    show(steps_table(steps, candidates, comparison, deciding))
    prose(remaining_error(steps, deciding))


def show_calibrated(findings: "Findings") -> None:
    """The model's own numbers that were fitted, and those that were not; nothing where none was."""
    from ..reports.terminal.findings_screen import calibrated_table, not_calibrated_list

    if findings.calibrated:
        show(calibrated_table(findings.calibrated), not_calibrated_list(findings.left, findings.absorbed))


def warn(warnings: Iterable[str], repairs: Iterable[str] = ()) -> None:
    """What is wrong with the logs, above everything else, and what was repaired in memory, a paragraph each."""
    from ..reports.terminal.layout import UNSURE

    for text in warnings:
        prose(f"Warning: {text}", UNSURE)
    for text in repairs:
        prose(f"{text[:1].upper()}{text[1:]}.")
