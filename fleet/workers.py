"""The map over logs: processes of this machine, or a cluster that is there, and what is done when one dies."""

import os
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from ..physics.errors import RequestError
from ..physics.registry_members import how_to_install

T = TypeVar("T")
R = TypeVar("R")

_TRIES = 2
"""Times that a task may take its worker with it, alone, before it is given up: once may be the system's doing."""
_AHEAD = 3
"""Tasks that are handed out for each worker: one at work, and enough waiting that it never waits itself."""
_LOOK = 1.0
"""Seconds after which a worker looks again whether its parent is there."""
_PATIENCE = "10s"
"""Time in which a scheduler must answer."""


class WorkerLost(Exception):  # noqa: N818  # it is an answer, of a task that nobody could do
    """The worker that did a task died, each time."""


@dataclass(frozen=True, slots=True)
class Engine:
    """Who does the work.

    Attributes
    ----------
    workers : processes of this machine; None for as many as it has processors, 1 for this process alone
    scheduler : address of a Dask scheduler, such as tcp://10.0.0.5:8786, in their place

    Raises
    ------
    RequestError
        for fewer than one worker, or both.
    """

    workers: int | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise RequestError(f"workers: expected at least 1, got {self.workers}")
        if self.workers is not None and self.scheduler is not None:
            raise RequestError("expected either workers on this machine or a scheduler, got both; leave one out")


def mapped(function: Callable[[T], R], tasks: Sequence[T], engine: Engine) -> Iterator[tuple[int, R | WorkerLost]]:
    """What a function answers to each task, with the task's number, in the order in which they are done.

    When a worker dies, those at work are begun again, one by one, so that the task which killed it is known.

    Raises
    ------
    RequestError
        when no scheduler answers, or Dask is not installed.
    """
    if not tasks:
        return
    if engine.scheduler is None and engine.workers == 1:
        yield from enumerate(map(function, tasks))
        return
    waiting, suspects = deque(range(len(tasks))), deque[int]()
    deaths: Counter[int] = Counter()
    while waiting or suspects:
        flying: dict[Future[R], int] = {}
        alone = bool(suspects)
        with _pool(engine, len(tasks)) as (pool, room):
            queue = suspects if alone else waiting
            try:
                while queue or flying:
                    while queue and len(flying) < (1 if alone else room):
                        flying[pool.submit(function, tasks[queue[0]])] = queue[0]
                        queue.popleft()
                    for future in wait(flying, return_when=FIRST_COMPLETED).done:
                        answer = _answer(future)
                        yield flying.pop(future), answer
            except BrokenExecutor:
                for future, number in list(flying.items()):
                    if future.done() and not future.exception():
                        yield number, future.result()
                    elif alone and (deaths := deaths + Counter([number]))[number] >= _TRIES:
                        yield number, WorkerLost("its worker died each time")
                    else:
                        suspects.append(number)


def _answer(future: "Future[R]") -> R | WorkerLost:
    """What a task came to; a cluster tries a task whose worker dies some times, and then gives it up."""
    try:
        return future.result()
    except BrokenExecutor:
        raise
    except CancelledError:
        raise RequestError(
            "the scheduler went away before the work was done; what was done is kept: start one, and give the same "
            "call again"
        ) from None
    except Exception as error:
        if type(error).__name__ == "KilledWorker":
            return WorkerLost(str(error))
        raise RequestError(
            f"a worker cannot do its work ({type(error).__name__}: {error}); see that undertow is there, in this "
            "version, on every machine of the cluster"
        ) from error


@contextmanager
def _pool(engine: Engine, tasks: int) -> Iterator[tuple[Executor, int]]:
    """Who works, and how many tasks are handed out at a time."""
    if engine.scheduler is not None:
        with _client(engine.scheduler) as client:
            count = sum(client.nthreads().values())
            yield client.get_executor(pure=False), _AHEAD * max(count, 1)
        return
    from joblib.externals.loky import ProcessPoolExecutor, cpu_count

    count = min(engine.workers or cpu_count(), tasks)
    pool = ProcessPoolExecutor(max_workers=count, initializer=end_with, initargs=(os.getpid(),))
    try:
        yield pool, _AHEAD * count
    except BaseException:
        pool.shutdown(wait=False, kill_workers=True)
        raise
    pool.shutdown(wait=True, kill_workers=True)


def end_with(parent: int) -> None:
    """Let this process end when its parent has: a call that the system kills leaves no workers behind."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _dask(what: str) -> Any:
    """The package `distributed`, for what needs it."""
    try:
        import distributed
    except ImportError:
        raise RequestError(f"{what} needs Dask: {how_to_install('cluster')}") from None
    return distributed


def _client(address: str) -> Any:
    dask = _dask("a scheduler")
    try:
        return dask.Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        told = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise RequestError(
            f"scheduler {address}: expected one that answers, got none ({told}); 'undertow cluster' starts one"
        ) from None


@contextmanager
def local_cluster(workers: int | None) -> Iterator[str]:
    """A Dask cluster on this machine alone; gives the address of its scheduler.

    Raises
    ------
    RequestError
        when Dask is not installed.
    """
    made = _dask("a cluster").LocalCluster
    with made(n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=":0") as cluster:
        yield cluster.scheduler_address
