"""A worker that is there before anybody asks: it has the demo open, and what a search needs is loaded."""

import asyncio
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..workflows.workbench_facts import Opened, Source
from .worker import Worker


class Spare:
    """The first worker of a server, for the first tab that opens something.

    Parameters
    ----------
    first : what the first tab will open, as far as that is known; else the demo
    """

    def __init__(self, first: Source | None) -> None:
        self._source = first or Source()
        self._folder = Path(tempfile.mkdtemp(prefix="undertow-app-"))
        self._worker: Worker | None = Worker()
        self._opened: asyncio.Task[Any] = asyncio.create_task(self._begin(self._worker))

    async def _begin(self, worker: Worker) -> Opened:
        opened = await worker.ask("open", self._source, str(self._folder))
        self._loading = asyncio.create_task(worker.ask("load"))
        return opened

    def take(self, source: Source) -> tuple[Worker, Path, "asyncio.Task[Opened]"] | None:
        """The worker, its folder, and its answer, for who opens this and comes first; None for anybody else."""
        worker = self._worker
        if worker is None or not worker.alive or source != self._source:
            return None
        self._worker = None
        return worker, self._folder, self._opened

    def close(self) -> None:
        """End it, if nobody has taken it."""
        if self._worker is not None:
            self._opened.cancel()
            self._worker.close()
            self._worker = None
            with suppress(OSError):
                shutil.rmtree(self._folder)
