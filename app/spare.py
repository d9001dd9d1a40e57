"""A worker that is there before anybody asks: it has the demo open, and what a search needs is loaded."""

import asyncio
import shutil
import tempfile
import threading
import time
from concurrent.futures import Future, wait
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..workflows.workbench_facts import Source
from .worker import Worker, WorkerLostError

_PICTURE = 1.0
"""Seconds that are left to the first picture of a log before what a search needs is loaded beside it."""
Begun = tuple[Worker, "Future[Any]"]


class Spare:
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
