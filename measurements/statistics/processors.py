"""A second process by fork for work that can wait, and linear algebra on one thread.

A fork sees all that is in memory, so nothing is sent to it, and its results equal this process's to the last bit.
Matrices here are small: threads would wait for each other.
"""

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from importlib import import_module
from itertools import count, islice
from multiprocessing.connection import Connection
from pathlib import Path
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

_DIES_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux: the signal that a process gets when its parent ends."""
_LARGE = 400_000
"""Memory of this process [kB] from which it is not forked: two of them would hold more than a long answer may."""

T = TypeVar("T")
R = TypeVar("R")


@contextmanager
def run_in_fork(work: Callable[[], R]) -> Iterator[Callable[[], R]]:
    """Begin a computation beside this process; what is given waits for its result, once, and raises what it raised.

    Parameters
    ----------
    work : takes nothing, changes nothing, and returns or raises what can be pickled; see `run_steps_in_fork`
    """
    with run_steps_in_fork(lambda: (work() for _ in range(1))) as steps:
        yield lambda: next(steps)


@contextmanager
def run_steps_in_fork(work: Callable[[], Iterator[R]]) -> Iterator[Iterator[R]]:
    """Begin a computation of some steps beside this process; what is given waits for each, and raises what it raised.

    It is done here, when its results are asked for, where there is no second processor or no safe fork: on other
    systems than Linux, where threads of Python may hold a lock, and in a large process. Who leaves without the results
    ends it.

    Parameters
    ----------
    work : takes nothing, changes nothing, and gives, one after the other, or raises what can be pickled
    """
    if not fork_available():
        yield work()
        return
    here, there = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=_send_result, args=(work, here, there), daemon=True)
    try:
        process.start()
    except OSError:  # no more processes, or no memory for one
        here.close()
        there.close()
        yield work()
        return
    there.close()
    try:
        yield _received(work, here)
    finally:
        process.kill()
        process.join()
        here.close()


def _received(work: Callable[[], Iterator[R]], here: Connection) -> Iterator[R]:
    """What a forked process hands back; what it does not come to is done here."""
    for number in count():
        try:
            told = here.recv()
        except (EOFError, OSError):  # it was ended from outside, for its memory perhaps
            yield from islice(work(), number, None)
            return
        if told is None:
            return
        found, error = told
        if error is not None:
            raise error
        yield found


def parallel_map(function: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """A function of each item, every other one beside this process; see `beside`."""
    if len(items) < 2:
        return [function(item) for item in items]

    with run_in_fork(lambda: [function(item) for item in items[1::2]]) as others:
        found = [function(item) for item in items[::2]]
        every = [*found, *others()]
    every[::2], every[1::2] = found, every[len(found) :]
    return every


def preload_modules(modules: Sequence[str]) -> None:
    """Load modules that each forked process would load for itself; one that needs what is not installed is left out."""
    for module in modules:
        with suppress(ImportError):
            import_module(module)


def fork_available() -> bool:
    """True when there is a second processor for a forked process, and no other thread of Python in its way."""
    if sys.platform != "linux" or len(os.sched_getaffinity(0)) < 2:
        return False
    alone = threading.active_count() == 1 and multiprocessing.parent_process() is None
    return alone and _resident() < _LARGE


def _resident() -> float:
    """Memory of this process [kB]; its peak would count what its parent held when it was begun."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1024.0


def _send_result(work: Callable[[], Iterator[R]], here: Connection, there: Connection) -> None:
    """In the forked process: hand back results or an error; Ctrl-C is left to who waits for them, and ends with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    here.close()  # else nobody would be missed at the other end
    ctypes.CDLL(None).prctl(_DIES_WITH_PARENT, signal.SIGKILL)
    with suppress(OSError):  # nobody waits any longer
        try:
            for found in work():
                there.send((found, None))
            there.send(None)
        except Exception as error:  # whatever it is, it is raised where the result is asked for
            there.send((None, error))


P = ParamSpec("P")


def single_threaded(function: Callable[P, R]) -> Callable[P, R]:
    """The same function, with BLAS and LAPACK on one thread while it runs: half the time of a processor, or less."""

    @wraps(function)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return alone
