"""The terminal: what verbs print, and how they fail."""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

import typer

WIDEST = 120
"""Columns beyond which nothing is spread out."""


def flush() -> None:
    """Send what is still buffered; end with exit code 1 when the reader has left (a closed pipe), 2 for a full disk."""
    try:
        sys.stdout.flush()
    except OSError as error:
        _drop_output()
        if isinstance(error, BrokenPipeError):
            raise SystemExit(1) from None
        print(f"undertow: cannot write the output: {error.strerror or error}", file=sys.stderr)
        raise SystemExit(2) from None


def _drop_output() -> None:
    """Let nothing more be written that cannot be, or Python complains at its own last flush."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def tell_replaced(paths: Iterable[Path]) -> None:
    """Say on stderr of which earlier files others took the place."""
    for path in paths:
        progress(f"replaced the earlier {path}")


def progress(line: str) -> None:
    """Print a line about work that goes on, on stderr."""
    with suppress(OSError):  # work does not end for want of somebody who hears of it
        print(f"  {line}", file=sys.stderr, flush=True)


def say(text: str) -> None:
    """Print a line as it is."""
    print(text)


def prose(text: str) -> None:
    """Print a paragraph, wrapped at the terminal's width, and a blank line; nothing for an empty text."""
    from .layout import Prose

    show(Prose(text) if text else None)


def show(*parts: Any) -> None:
    """Print tables and texts, each with a blank line after it; None is passed over."""
    from rich.console import Console

    console = Console()
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
        named = error.filename2 or error.filename
        if named is None:
            _drop_output()
        fail(f"{'cannot write the output' if named is None else named}: {error.strerror or error}")


def fail(text: str) -> NoReturn:
    """Print a message on stderr and leave with exit code 2."""
    print(f"undertow: {text}", file=sys.stderr)
    raise typer.Exit(2)
