"""Workers: a process for each open log, so that no failure of it stops the page."""

import asyncio
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from ..physics.errors import LogError, RequestError, VehicleError

Say = Callable[[Any], None]
_ROOMS = ("undertow.app.preload", "undertow.__main__")
"""Loaded once, by the process that all workers are forked from: what answers, and the program itself, which
multiprocessing loads again in each."""
_PATIENCE = 2.0
"""Time [s] in which what a process that was ended has said last is heard."""
_PICTURE = 1.0
"""Seconds that are left to the first picture of a log before what a search needs is loaded."""


class WorkerLostError(RuntimeError):
    """The worker's process ended before it answered: killed, or out of memory."""


_ERRORS = {kind.__name__: kind for kind in (LogError, RequestError, VehicleError, WorkerLostError)}
"""What an answer may be besides a result, by the name that is sent; any other is a fault."""


def prepare() -> None:
    """Begin to load what workers need, beside this process; a worker is then there in a few hundredths of a second."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # workers fork, and threads of the parent would not be there
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    multiprocessing.set_forkserver_preload(list(_ROOMS))
    from multiprocessing.forkserver import ensure_running

    ensure_running()


class Worker:
    """The side of a worker that asks; its process begins with the first question, and answers one after the other."""

    def __init__(self) -> None:
        self._pipe, self._there = multiprocessing.Pipe()
        context = multiprocessing.get_context("forkserver")
        # No daemon, for these may have no children, and a search works in two processes. It ends with its pipe.
        self.process = context.Process(target=_serve, args=(self._there,), daemon=False)
        self._turn = threading.Lock()
        self._waiting: set[Future[Any]] = set()
        self._begun = self._closed = False

    @property
    def alive(self) -> bool:
        """True when it can be asked."""
        return not self._closed and (not self._begun or self.process.is_alive())

    async def ask(self, what: str, *given: Any, say: Say | None = None) -> Any:
        """The answer of a method of the service.

        Parameters
        ----------
        what, given : name of the method, and its arguments
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
        self._waiting.add(answer)
        question = what, given, say is not None
        threading.Thread(target=self._converse, args=(answer, question, say), daemon=True).start()
        return answer

    def close(self) -> None:
        """End the process, whatever it does."""
        self._closed = True
        for answer in tuple(self._waiting):  # before the process is found gone: nobody lost it
            answer.cancel()
        if self.process.is_alive():
            self.process.kill()
        heard = self._turn.acquire(timeout=_PATIENCE)  # whoever listens has ended before the pipe goes
        self._pipe.close()
        if heard:
            self._turn.release()

    def _converse(self, answer: "Future[Any]", question: tuple[str, tuple[Any, ...], bool], say: Say | None) -> None:
        """Ask one question, and wait for its answer."""
        try:
            with self._turn:
                kind, content = self._answer(question, say)
        except (EOFError, OSError, TypeError):  # a TypeError where the pipe is closed in the midst of reading
            kind, content = WorkerLostError.__name__, ""
        self._waiting.discard(answer)
        if not answer.set_running_or_notify_cancel():
            return
        if kind == "done":
            answer.set_result(content)
        else:
            answer.set_exception(_ERRORS.get(kind, RuntimeError)(content))

    def _answer(self, question: tuple[str, tuple[Any, ...], bool], say: Say | None) -> tuple[str, Any]:
        if self._closed:
            raise EOFError
        if not self._begun:
            self.process.start()
            self._there.close()
            self._begun = True
        self._pipe.send(question)
        while True:
            kind, content = self._pipe.recv()
            if kind != "line":
                return kind, content
            if say is not None:
                say(content)


def _serve(pipe: Connection) -> None:
    """Answer until nobody asks any more; Ctrl-C, which all processes hear, is left to the server."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from .worker_service import WorkerService

    service = WorkerService()
    idle: float | None = _PICTURE
    while True:
        try:
            if not pipe.poll(idle):
                service.load()
                idle = None
                continue
            what, given, telling = pipe.recv()
        except (EOFError, OSError):
            return
        more = {"say": lambda line: pipe.send(("line", line))} if telling else {}
        try:
            answer = "done", getattr(service, what)(*given, **more)
        except (LogError, RequestError, VehicleError) as error:
            answer = type(error).__name__, error.typed
        except BrokenPipeError:
            return
        except Exception as error:
            answer = "fault", f"{type(error).__name__}: {error}"
        with suppress(OSError):
            pipe.send(answer)
