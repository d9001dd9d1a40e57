"""Workers: a process for each open log, so that no failure of it stops the page, and one that is ready beforehand."""

import asyncio
import multiprocessing
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..physics.errors import LogError, RequestError, VehicleError
from ..workflows.workbench_facts import Source

Say = Callable[[Any], None]
_ROOMS = ("undertow.app.preload", "undertow.__main__")
"""Loaded once, by the process that all workers are forked from: what answers, and the program itself, which
multiprocessing loads again in each."""
_REFUSALS = {kind.__name__: kind for kind in (LogError, RequestError, VehicleError)}

_PATIENCE = 2.0
"""Time [s] in which what a process that was ended has said last is heard."""


class WorkerLostError(RuntimeError):
    """The worker's process ended before it answered: killed, or out of memory."""


def prepare() -> None:
    """Begin to load what workers need, beside this process; a worker is then there in a few hundredths of a second."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # workers fork, and threads of the parent would not be there
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    multiprocessing.set_forkserver_preload(list(_ROOMS))
    from multiprocessing.forkserver import ensure_running

    ensure_running()


class Worker:
    """The side of a worker that asks, from whatever thread; made once its process is there."""

    def __init__(self) -> None:
        self._pipe, there = multiprocessing.Pipe()
        context = multiprocessing.get_context("forkserver")
        # No daemon, for these may have no children, and a search works in two processes. It ends with its pipe.
        self.process = context.Process(target=_serve, args=(there,), daemon=False)
        self.process.start()
        there.close()
        self._asked: dict[int, tuple[Future[Any], Say | None]] = {}
        self._count = 0
        self._closed = False
        self._one = threading.Lock()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    @property
    def alive(self) -> bool:
        """True when it can be asked."""
        return not self._closed and self.process.is_alive()

    async def ask(self, what: str, *given: Any, say: Say | None = None) -> Any:
        """The answer of a method of the desk.

        Parameters
        ----------
        say : called with each line that it tells meanwhile

        Raises
        ------
        LogError, RequestError, VehicleError
            as the method does.
        WorkerLostError
            when the process has ended.
        """
        loop, tell = asyncio.get_running_loop(), say or (lambda line: None)

        def here(line: Any) -> None:
            with suppress(RuntimeError):  # the loop is closed, and nobody waits any more
                loop.call_soon_threadsafe(tell, line)

        return await asyncio.wrap_future(self.begin(what, *given, say=here if say else None))

    def begin(self, what: str, *given: Any, say: Say | None = None) -> "Future[Any]":
        """What `ask` waits for; `say` is called in another thread."""
        answer: Future[Any] = Future()
        with self._one:
            if self._closed:
                raise WorkerLostError
            self._count += 1
            self._asked[self._count] = answer, say
            try:
                self._pipe.send((self._count, what, given, say is not None))
                return answer
            except OSError:
                pass
        self._lost()
        return answer

    def close(self) -> None:
        """End the process, whatever it does."""
        for answer in self._end():  # before the listener finds the process gone: nobody lost it
            answer.cancel()
        if self.process.is_alive():
            self.process.kill()
        if threading.current_thread() is not self._listener:  # which the end of the process ends, before its pipe goes
            self._listener.join(_PATIENCE)
        with suppress(OSError):
            self._pipe.close()

    def _listen(self) -> None:
        while True:
            try:
                number, kind, content = self._pipe.recv()
            except (EOFError, OSError, TypeError):  # a TypeError where the pipe is closed in the midst of reading
                self._lost()
                return
            self._take(number, kind, content)

    def _take(self, number: int, kind: str, content: Any) -> None:
        with self._one:
            answer, say = self._asked.get(number, (None, None))
            if kind != "line":
                self._asked.pop(number, None)
        if kind == "line":
            if say is not None:
                say(content)
        elif answer is not None and answer.set_running_or_notify_cancel():
            if kind == "done":
                answer.set_result(content)
            else:
                answer.set_exception(_REFUSALS.get(kind, RuntimeError)(content))

    def _lost(self) -> None:
        for answer in self._end():
            if answer.set_running_or_notify_cancel():
                answer.set_exception(WorkerLostError())

    def _end(self) -> "list[Future[Any]]":
        """What still waits, of a worker that is asked no more."""
        with self._one:
            waiting, self._asked, self._closed = [answer for answer, _ in self._asked.values()], {}, True
        return waiting


def _serve(pipe: Connection) -> None:
    """Answer until nobody asks any more; Ctrl-C, which all processes hear, is left to the server."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from .worker_service import WorkerService

    desk = WorkerService()
    while True:
        try:
            number, what, given, telling = pipe.recv()
        except (EOFError, OSError):
            return
        more = {"say": lambda line, number=number: pipe.send((number, "line", line))} if telling else {}
        try:
            answer = number, "done", getattr(desk, what)(*given, **more)
        except (LogError, RequestError, VehicleError) as error:
            answer = number, type(error).__name__, error.typed
        except BrokenPipeError:
            return
        except Exception as error:
            answer = number, "fault", f"{type(error).__name__}: {error}"
        with suppress(OSError):
            pipe.send(answer)


_PICTURE = 1.0
"""Seconds that are left to the first picture of a log before what a search needs is loaded beside it."""
Begun = tuple[Worker, "Future[Any]"]


class PrewarmedWorker:
    """The first worker of a server, for the first tab that opens something; it begins while the pages are loaded.

    Parameters
    ----------
    first : what the first tab will open, as far as that is known; else the demo
    """

    def __init__(self, first: Source | None) -> None:
        self._source = first or Source()
        self._folder = Path(tempfile.mkdtemp(prefix="undertow-app-"))
        self._begun: Future[Begun] | None = Future()
        self._begun.set_running_or_notify_cancel()  # a tab that is closed while it waits does not end it
        threading.Thread(target=self._begin, args=(self._begun,), daemon=True).start()

    def _begin(self, begun: "Future[Begun]") -> None:
        try:
            worker = Worker()  # waits until its process is there
            opened = worker.begin("open", self._source, str(self._folder))
        except Exception as error:  # whoever takes it is told
            begun.set_exception(error)
            return
        begun.set_result((worker, opened))
        wait((opened,))
        time.sleep(_PICTURE)
        with suppress(WorkerLostError):
            worker.begin("load")

    async def take(self, source: Source) -> "tuple[Worker, Path, Future[Any]] | None":
        """The worker, its folder, and its answer, for who opens this and comes first; None for anybody else."""
        begun = self._begun
        if begun is None or source != self._source:
            return None
        try:
            worker, opened = await asyncio.wrap_future(begun)
        except Exception:  # no process could be made; who asks tries again, and is told
            return None
        if self._begun is not begun or not worker.alive:  # another tab was sooner, or it was killed
            return None
        self._begun = None
        return worker, self._folder, opened

    def close(self) -> None:
        """End it, if nobody has taken it."""
        begun, self._begun = self._begun, None
        if begun is not None:
            begun.add_done_callback(lambda done: None if done.exception() else done.result()[0].close())
            with suppress(OSError):
                shutil.rmtree(self._folder)
