"""Client of a tab's worker: requests, a network in training in a process of its own, progress, and observers."""

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import Any

from ..physics.errors import LogError, RequestError, VehicleError
from ..physics.stage import Stage
from ..workflows.workbench_facts import Opened, Searched, Source, Trained
from .steps import Step
from .worker import Worker, WorkerLostError

View = Callable[[], None]


class Observers:
    """Views, called after every change."""

    def __init__(self) -> None:
        self._views: list[View] = []

    def watch(self, view: View) -> View:
        """Call a view after every change, until the function that is given back is called."""
        self._views.append(view)

        def leave() -> None:
            with suppress(ValueError):
                self._views.remove(view)

        return leave

    def tell(self) -> None:
        """Tell all views; one that fails keeps no other from being told."""
        failed = None
        for view in tuple(self._views):
            try:
                view()
            except Exception as error:
                failed = error
        if failed is not None:
            raise failed

    def leave(self) -> None:
        """Tell nobody any more."""
        self._views.clear()


_SHARES = 0.15
"""By how much the shares of `physics.stage` may be wrong here: those of the demo are by up to 0.13, idle or loaded."""


@dataclass(frozen=True, slots=True)
class Work:
    """What goes on.

    Attributes
    ----------
    name : of it, or of its present stage
    begun : when it began [s]
    stages : share that usually lies before each stage that has begun, and when that was [s]

    Examples
    --------
    >>> work = Work("searching", 0.0).at("searching", 0.3, 2.0)
    >>> work.left(5.0) is None, [round(end, 1) for end in work.at("weighing", 0.6, 8.0).left(8.0)]
    (True, [3.3, 22.0])
    """

    name: str
    begun: float
    stages: tuple[tuple[float, float], ...] = ()

    @property
    def behind(self) -> float | None:
        """Share that usually lies behind it; None where nobody knows."""
        return self.stages[-1][0] if self.stages else None

    def at(self, name: str, behind: float, now: float) -> "Work":
        """The same at a stage; of one that was behind it already, as in a second search, it is counted anew."""
        if not behind or behind == self.behind:
            return replace(self, name=name)
        before = () if self.behind is not None and behind < self.behind else self.stages
        return replace(self, name=name, stages=(*before, (behind, now)))

    def left(self, now: float) -> tuple[float, float] | None:
        """Least and most time that is left [s], at the pace of the stages so far; None where they do not tell.

        What lay before the first stage is not counted: what a stage finds done already took no time here.
        """
        if len(self.stages) < 2:
            return None
        (first, begun), (behind, then) = self.stages[0], self.stages[-1]
        took, passed, rest, since = then - begun, behind - first, 1.0 - behind, now - then
        if passed <= _SHARES:
            return None
        least = max(took * (rest - _SHARES) / (passed + _SHARES) - since, 0.0)
        most = took * (rest + _SHARES) / (passed - _SHARES) - since
        return (least, most) if most > 0.0 else None


LOST = (
    "The process that computes has ended: it was killed, or the memory was not enough. Your log and your steps are kept"
)


class WorkerClient:
    """The worker of a tab, begun when it is first asked for something.

    Parameters
    ----------
    audience : told when work begins, goes on and ends

    Attributes
    ----------
    work : what goes on; None while nothing does
    trouble : what went wrong, in words; empty where nothing did
    lost : the worker has ended
    """

    def __init__(self, audience: Observers) -> None:
        self._audience = audience
        self.work: Work | None = None
        self.trouble = ""
        self.lost = False
        self.worker: Worker | None = None
        self._ahead: tuple[Source, Future[Opened]] | None = None

    async def ask(self, name: str, what: str, *given: Any) -> Any:
        """An answer of the worker; None where it refuses, and `trouble` says why.

        Parameters
        ----------
        name : of the work that all views show meanwhile; empty for what is quick
        what, given : see `WorkerService`
        """
        if self.worker is None:
            self.worker = Worker()
        return await self._heard(name, self.worker.ask(what, *given, say=self._tell if name else None))

    def read_ahead(self, source: Source, folder: Path) -> None:
        """Begin to read a log before it is asked for."""
        self.worker = Worker()
        self._ahead = source, self.worker.begin("open", source, str(folder))

    async def open(self, source: Source, folder: Path) -> Opened | None:
        """Read a log, or take what was read ahead."""
        name, (asked, opened) = "reading the log", self._ahead or (None, None)
        self._ahead = None
        if self.worker is not None and opened is not None:
            if not self.worker.alive:
                self.end()
            elif asked == source:
                return await self._heard(name, asyncio.wrap_future(opened))
        return await self.ask(name, "open", source, str(folder))

    async def _heard(self, name: str, answer: Awaitable[Any]) -> Any:
        """An answer, while views show that something goes on; what is quick has no name, and is not shown."""
        if name:
            self.work = Work(name, monotonic())
            self._audience.tell()
        try:
            with self.telling():
                return await answer
        finally:
            if name:
                self.work = None
                self._audience.tell()
        return None

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


class Training:
    """One training at a time."""

    def __init__(self) -> None:
        self._worker: Worker | None = None

    async def run(
        self,
        network: tuple[str, int],
        step: Step,
        searched: Searched | None,
        folder: Path,
        told: Callable[[object], None],
    ) -> Trained | None:
        """Train a network beside the model of a step; None where it was stopped.

        Parameters
        ----------
        network : its name, and how many epochs at most
        searched : what was found, where something was
        told : called with every epoch

        Raises
        ------
        LogError, RequestError, VehicleError, RuntimeError
            as reading the log and training do.
        """
        self._worker = Worker()
        try:
            own = folder / "training"  # two processes may not write one file
            own.mkdir(exist_ok=True)
            await self._worker.ask("turn_to", step.source, str(own), searched)
            name, epochs = network
            return await self._worker.ask("train", name, step.stand, epochs, say=told)
        except (asyncio.CancelledError, WorkerLostError):
            return None
        finally:
            self.stop()

    def stop(self) -> None:
        """End a training that goes on."""
        if self._worker is not None:
            self._worker.close()
            self._worker = None
