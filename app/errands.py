"""What the worker of a tab is asked: what goes on meanwhile, and what went wrong."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from typing import Any

from ..physics.errors import LogError, RequestError, VehicleError
from ..physics.stage import Stage
from ..workflows.workbench_facts import HullDiary, Opened, Source
from .audience import Audience
from .spare import Spare
from .work import Work
from .worker import Worker, WorkerLostError

LOST = (
    "The process that computes has ended: it was killed, or the memory was not enough. Your log and your steps are kept"
)

_READING = "reading the log"


class Errands:
    """The worker of a tab, begun when it is first asked for something.

    Parameters
    ----------
    audience : told when work begins, goes on and ends
    spare : a worker that may have opened already what is asked for

    Attributes
    ----------
    work : what goes on; None while nothing does
    trouble : what went wrong, in words; empty where nothing did
    lost : the worker has ended
    lent : the folder of the spare worker, where that was taken
    """

    def __init__(self, audience: Audience, spare: Spare | None) -> None:
        self._audience, self._spare = audience, spare
        self.work: Work | None = None
        self.trouble = ""
        self.lost = False
        self.lent: Path | None = None
        self.worker: Worker | None = None

    async def ask(self, name: str, what: str, *given: Any) -> Any:
        """An answer of the worker; None where it refuses, and `trouble` says why.

        Parameters
        ----------
        name : of the work that all views show meanwhile; empty for what is quick
        what, given : see `Desk`
        """
        with self.telling(), self._working(name):
            if self.worker is None:
                self.worker = Worker()
            return await self.worker.ask(what, *given, say=self._tell if name else None)
        return None

    @contextmanager
    def _working(self, name: str) -> Iterator[None]:
        """Show that something goes on; what is quick has no name, and is not shown."""
        if name:
            self.work = Work(name, monotonic())
            self._audience.tell()
        try:
            yield
        finally:
            if name:
                self.work = None
                self._audience.tell()

    @contextmanager
    def telling(self) -> Iterator[None]:
        """Put what is refused here into `trouble`, in words, and tell everybody."""
        try:
            yield
            return
        except WorkerLostError:
            self.lost, self.trouble = True, LOST
        except (LogError, RequestError, VehicleError) as error:
            self.trouble = error.typed
        except RuntimeError as error:
            self.trouble = f"undertow has a fault: {error}. Please report it"
        self._audience.tell()

    async def open(self, source: Source, folder: Path) -> Opened | None:
        """Read a log, or take what the spare worker has read of it already."""
        taken = await self._spare.take(source) if self._spare is not None and self.worker is None else None
        if taken is not None:
            self.worker, self.lent, waiting = taken
            with (
                suppress(WorkerLostError, LogError, RequestError, VehicleError, RuntimeError),
                self._working(_READING),
            ):
                return await asyncio.wrap_future(waiting)
        return await self.ask(_READING, "open", source, str(folder))

    async def diary(self, fleet: str, folder: Path) -> HullDiary | None:
        """Read a fleet, and write its hull diary."""
        return await self.ask("reading the fleet", "diary", fleet, str(folder))

    def end(self) -> None:
        """End the worker; what is asked next begins with another."""
        if self.worker is not None:
            self.worker.close()
            self.worker = None
        self.lost, self.trouble = False, ""

    def _tell(self, line: str) -> None:
        if self.work is not None:
            self.work = self.work.at(str(line), line.behind if isinstance(line, Stage) else 0.0, monotonic())
            self._audience.tell()
