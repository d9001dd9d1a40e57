"""The terminal: what verbs print, how they fail, and the files they refuse to write."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import typer

from ..physics.printable import one_line, printable, shortened

WIDEST = 120
"""Columns beyond which nothing is spread out."""
_MOST_TOLD = 3900
"""Characters of a message, so that what stands before it fits into 4,000 as well."""


def flush() -> None:
    """Send what is still buffered; when the reader has left (a closed pipe), end without a word, with exit code 1."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains at its own last flush
        raise SystemExit(1) from None


def check_file(out: Path, source: Any = None, kind: str = "other") -> bool:
    """Refuse a file that cannot be written, is the one read, or is of another `kind`, before the work on it begins.

    `check_replaced` says what kinds there are. True when a file is there, of which `tell_replaced` speaks later.
    """
    from ..physics.errors import RequestError

    if source is not None and out.exists() and Path(source).exists() and out.samefile(source):
        raise RequestError(f"--out {out} is the vehicle file that is read; give another name, so that it is not lost")
    if out.is_dir():
        raise RequestError(f"cannot write {out}: it is a folder; give the name of a file")
    if not out.parent.is_dir():
        raise RequestError(f"cannot write {out}: the folder {out.parent} does not exist; create it first")
    if not out.is_file():  # a device such as /dev/stdout loses nothing
        return out.exists()
    from .replacing import check_replaced

    check_replaced(out, kind)
    return True


def tell_replaced(out: Path, earlier: bool) -> None:
    """Say on stderr that a file took the place of an earlier one, if it did."""
    if earlier:
        progress(f"replaced the earlier {out}")


def progress(line: str) -> None:
    """Print a line about work that goes on, on stderr."""
    print(f"  {shortened(one_line(line), _MOST_TOLD)}", file=sys.stderr, flush=True)


def say(text: str) -> None:
    """Print a line; what no terminal should be told is written as escapes."""
    print(shortened(one_line(text)))


def say_lines(text: str) -> None:
    """Print several lines that are a whole, such as a channel map, in full."""
    print(printable(text))


def prose(text: str) -> None:
    """Print a paragraph, wrapped at the terminal's width, and a blank line; nothing for an empty text."""
    from .layout import Prose

    show(Prose(text) if text else None)


def show(*parts: Any) -> None:
    """Print tables and texts, each with a blank line after it; None is passed over."""
    from .layout import terminal

    console = terminal()
    console.width = min(console.width, WIDEST)
    for part in parts:
        if part is not None:
            console.print(part)
            console.print()


def print_json(data: dict[str, Any]) -> None:
    """Print strict JSON."""
    from ..physics.files import strict_json

    print(strict_json(data))


@contextmanager
def failing_clearly() -> Iterator[None]:
    """Turn undertow's own errors, and files that cannot be opened, into one message on stderr and exit code 2."""
    from ..physics.errors import LogError, RequestError, VehicleError

    try:
        yield
    except (LogError, RequestError, VehicleError) as error:
        fail(str(error))
    except BrokenPipeError:
        raise  # whoever read the output has left; typer ends without a word
    except OSError as error:
        fail(f"{error.filename2 or error.filename or 'output'}: {error.strerror or error}")
    except MemoryError:
        fail("the memory of this machine does not suffice; give less at once: a shorter log, or fewer logs")


def fail(text: str) -> NoReturn:
    """Print a message on stderr and leave with exit code 2; a long one is shortened in its middle."""
    print(f"undertow: {shortened(one_line(text), _MOST_TOLD)}", file=sys.stderr)
    raise typer.Exit(2)
