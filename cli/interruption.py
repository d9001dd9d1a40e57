"""Interruption of a verb: Ctrl-C or a shutdown signal ends it with one line and the shell's exit code.

Python raises KeyboardInterrupt anywhere, also where nobody can catch it (imports, callbacks, finalizers), and then
prints a traceback or goes on. So outside of the work the process ends at once; inside, a signal passed over is raised
again.
"""

import atexit
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

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


def exit_message(error: KeyboardInterrupt) -> tuple[str, int]:
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
    text, code = exit_message(KeyboardInterrupt(number))
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
