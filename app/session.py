"""Session of one tab: what is shown, the steps that lead there, and the work beside it."""

import asyncio
import shutil
import tempfile
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..workflows.workbench_facts import OWN_NUMBERS, Source, Trained, Way
from .shown import Shown
from .steps import SESSION, FileNames, History, Step, fleet_in, same_commands
from .worker_client import Observers, Training, WorkerClient


class Session:
    """One tab's work; whoever shows it is told of every change. What is asked for is done one after the other.

    Parameters
    ----------
    paths : files of this machine may be named; not where others than its user may see the page

    Attributes
    ----------
    shown : what all views show
    asked : what was to be opened last
    names : what the user calls uploads
    audience : who is told of every change
    errands, training : what the worker is asked, and a network that another trains
    waiting : how much that was asked for waits for its turn
    """

    def __init__(self, *, paths: bool = True) -> None:
        self._paths = paths
        self.audience = Observers()
        self.errands = WorkerClient(self.audience)
        self.folder = Path(tempfile.mkdtemp(prefix="undertow-app-"))
        self.names = FileNames(self.folder)
        self.shown = Shown(self.errands, self.audience, self.folder, self.names)
        self.asked: Source | None = None
        self.training = Training()
        self._refusal = ""
        self._moving: dict[str, float] = {}
        self._turn = asyncio.Lock()
        self.waiting = 0

    @asynccontextmanager
    async def _my_turn(self) -> AsyncIterator[None]:
        """Wait until all is done that was asked for before, and let everybody see that meanwhile."""
        if waits := self._turn.locked():
            self._wait(1)
        try:
            await self._turn.acquire()
        finally:
            if waits:
                self._wait(-1)
        try:
            yield
        finally:
            self._turn.release()

    def _wait(self, more: int) -> None:
        self.waiting += more
        self.audience.tell()

    # -- what is told --------------------------------------------------------------------------------------------------

    def commands(self) -> str:
        """The commands that do the same on the command line, with remarks on what none of them does."""
        shown = self.shown
        if shown.source is None:
            return ""
        found, other = () if shown.searched is None else shown.searched.found, shown.other_source
        return self.names.in_commands(same_commands(shown.source, shown.stand, found, refits=shown.refits, other=other))

    # -- what is opened ------------------------------------------------------------------------------------------------

    async def open(self, source: Source, opened_one: Callable[[], None] | None = None) -> None:
        """Read a log, show it, and search for what is missing; where it is refused, what was open stays.

        Of the folder of a fleet its hull diary is shown instead. A session goes on where it was saved.

        Parameters
        ----------
        opened_one : called when the log is shown, or was refused, before the search
        """
        saved = any(path.lower().endswith(SESSION) for path in source.logs)
        unsearched = False
        async with self._my_turn():
            self.errands.trouble, self.asked = "", None if saved else source
            with self.errands.telling():
                unsearched = await (self._reopen(source) if saved else self._read(source))
            self._refusal = self.errands.trouble
        if opened_one is not None:
            opened_one()
        if unsearched:
            await self.search()

    async def _read(self, source: Source) -> bool:
        """Show a log or a fleet, and say whether there is something to search."""
        fleet = fleet_in(source)
        if fleet:
            diary = await self.errands.ask("reading the fleet", "diary", fleet, str(self.folder))
            self.shown.turn_to_fleet(diary or self.shown.diary)
            return False
        opened = await self.errands.open(source, self.folder)
        if opened is None:
            return False
        self.training.stop()  # it knows nothing of this log
        self.shown.open(source, opened)
        return True

    async def _reopen(self, source: Source) -> bool:
        """Go on with a session that was saved, and say whether it was searched never; if refused, what was open stays.

        Raises
        ------
        RequestError
            where the file or its log cannot be read.
        """
        from . import session_file as files  # it needs what a search needs, and no log waits for that

        path, beside = files.session_in(source)
        saved = files.read_session(Path(path), self.names.with_user_names(path))
        if self._paths:
            beside = (*beside, str(Path(path).parent))
        places = await asyncio.to_thread(files.find_files, saved, beside, self.folder, self.names, paths=self._paths)
        history = await self._steps(saved.steps, saved.at, places)
        opened = None if history is None else await self.errands.open(history.now.source, self.folder)
        if history is None or opened is None:
            return False
        self.training.stop()  # it knows nothing of this log
        if await self.shown.reopen(history, opened, saved.searched):
            other = None if saved.other is None else files.relocated(saved.other, places)
            marks = saved.selected, saved.selected_on_other
            await self.shown.look_again(other, saved.view, marks, on_other=saved.on_other)
            differs = saved.others_now(self.shown.of_fitted, await self.errands.ask("", "nominal") or "")
            self.errands.trouble = self.errands.trouble or differs
            self.audience.tell()
        return saved.answer is None

    async def _steps(self, steps: Sequence[Step], at: int, places: Mapping[str, str]) -> History | None:
        """The steps of a session with the files where they are now; a log that was repaired is repaired again."""
        from .session_file import relocated

        sources: dict[Source, Source] = {}
        for source in dict.fromkeys(step.source for step in steps):
            found = relocated(source, places)
            if found.original is not None:
                fixed = await self._repaired(found.original)
                if fixed is None:
                    return None
                found = replace(found, logs=(fixed,))
            sources[source] = found
        return History(tuple(replace(step, source=sources[step.source]) for step in steps), at)

    @property
    def refused(self) -> Source | None:
        """What was to be opened, and was refused."""
        errands = self.errands
        told = errands.work is None and errands.trouble and errands.trouble == self._refusal
        return self.asked if told and self.asked is not self.shown.source else None

    @property
    def forcible(self) -> bool:
        """True when the log that was refused is broken, and may be taken as it is."""
        return self.refused is not None and "--as-is" in self.errands.trouble

    async def open_as_is(self) -> None:
        """Open the log that was refused, with a warning above every result."""
        if self.asked is not None:
            await self.open(replace(self.asked, as_is=True))

    async def repair(self) -> None:
        """Make the repairs that are safe, and go on with the repaired log: a step that can be taken back."""
        source = self.refused or self.shown.source
        if source is None:
            return
        async with self._my_turn():
            fixed = await self._repaired(source)
        if fixed is not None:
            repaired = replace(source, logs=(fixed,), channel_map="", frame="", as_is=False, original=source)
            begun = None if source == self.shown.source else History((Step(source),))
            await self._go(lambda history: history.then(Step(repaired)), begun)

    async def _repaired(self, source: Source) -> str | None:
        """The path of a log with the repairs that are safe; None where there are none."""
        fixed = await self.errands.ask("repairing the log", "repair", source, str(self.folder))
        if fixed is not None:
            self.names.call(Path(fixed), "repaired.csv")
        return fixed

    async def unrepair(self) -> None:
        """Go back to the log as it was before it was repaired."""
        source = self.shown.source
        if source is not None and source.original is not None:
            await self.change(source.original)

    async def change(self, source: Source) -> None:
        """Go on with another reading of what is open, such as other numbers of the vehicle: a step."""
        await self._go(lambda history: history.then(Step(source)))

    async def try_on(self, source: Source) -> None:
        """Show the present model on another log, to which nothing is fitted; where it is refused, all stays.

        Parameters
        ----------
        source : the log, its axes and its map; the vehicle is that which is open
        """
        async with self._my_turn():
            self.errands.trouble = ""
            await self.shown.try_on(source)

    async def put_away(self) -> None:
        """Go on without the other log."""
        async with self._my_turn():
            self.shown.put_away()

    async def search(self) -> None:
        """Search for what is missing."""
        async with self._my_turn():
            await self.shown.search()

    async def again(self) -> None:
        """Begin with a new worker where the old one has ended: the same log, the same steps."""
        self.errands.end()
        async with self._my_turn():
            history = self.shown.history
            if history is None or not await self.shown.show(history, anew=True):
                self.audience.tell()
                return
        if self.shown.searched is None:
            await self.search()

    # -- steps ---------------------------------------------------------------------------------------------------------

    async def add(self, *names: str) -> None:
        """Add effects to the model, the first of them beside the model's own numbers, where the search fitted these."""

        def onward(history: History) -> History:
            own = [OWN_NUMBERS] * (self.shown.refits and not history.now.stand.names)
            return history.then(history.now.adding(*dict.fromkeys([*own, *names])))

        await self._go(onward)

    async def remove(self, name: str) -> None:
        """Take an effect out of the model."""
        await self._go(lambda history: history.then(history.now.removing(name)))

    async def leave(self, correction: str) -> None:
        """Read the log without a correction of its sensors, and fit the same effects anew."""
        await self._go(lambda history: history.then(history.now.leaving(correction)))

    async def correct(self, correction: str) -> None:
        """Make a correction of the sensors again that was left out."""
        await self._go(lambda history: history.then(history.now.correcting(correction)))

    async def move(self, symbol: str, value: float) -> None:
        """Set a number of the model by hand; one way of a slider is one step, and of what waits the last is shown."""
        moving = self._moving
        moving[symbol] = value

        def onward(history: History) -> History:
            values = dict(moving)
            moving.clear()
            return history.moving(values)

        await self._go(onward, moving=moving)

    async def unmove(self) -> None:
        """Set all numbers that were moved by hand to their fitted values again."""
        await self._go(lambda history: history.then(history.now.fitting()))

    async def undo(self) -> None:
        """Go one step back."""
        await self._go(History.back)

    async def redo(self) -> None:
        """Take the step again that was taken back."""
        await self._go(History.forth)

    async def _go(
        self,
        onward: Callable[[History], History],
        begun: History | None = None,
        moving: dict[str, float] | None = None,
    ) -> None:
        """Take a step from what is shown when its turn has come; where it cannot be shown, all stays as it was.

        Parameters
        ----------
        begun : steps from which to go on, instead of those that are shown
        moving : what sliders have moved since anything else was asked for
        """
        self._moving = {} if moving is None else moving
        async with self._my_turn():
            before, open_before = begun or self.shown.history, self.shown.source
            history = None if before is None else onward(before)
            if history is None or history == self.shown.history:
                return
            self.errands.trouble, self.asked = "", history.now.source
            if not await self.shown.show(history):
                self._refusal = self.errands.trouble
                self.audience.tell()
                return
        if self.shown.source != open_before:
            self.training.stop()  # it knows nothing of this reading
            if self.shown.searched is None:
                await self.search()

    # -- what is done beside it ----------------------------------------------------------------------------------------

    async def way(self, time: float) -> Way | None:
        """Where the models go from an instant on."""
        async with self._my_turn():
            return await self.errands.ask("", "way", self.shown.stand, time, self.shown.on_other)

    async def take(self, what: str) -> Path | None:
        """Write a file to be taken away, of what is shown when this is asked for."""
        shown = self.shown.history
        async with self._my_turn():
            if shown is None or shown.now.source != self.shown.source:
                self.errands.trouble = "Another log was opened meanwhile; take the file again"
                return None
            name = "" if what == "model" else "writing the run"
            path = await self.errands.ask(name, "take", what, shown.now.stand, str(self.folder), self.names)
            self.audience.tell()
            return None if path is None else Path(path)

    async def save(self) -> Path | None:
        """Write the session into a file, from which it goes on where it is; None where it cannot be."""
        from .session_file import saved_session, write_session

        async with self._my_turn():
            vehicle = await self.errands.ask("", "nominal")
            if vehicle is None:
                return None
            with self.errands.telling():
                saved = await asyncio.to_thread(saved_session, self.shown, vehicle, self.names, self.folder)
                return write_session(saved, self.folder / f"session{SESSION}", self.names)
            return None

    async def ask(self, what: str, *given: Any) -> Any:
        """Something quick of the worker, on what is shown; None where it refuses, and `trouble` says why."""
        async with self._my_turn():
            return await self.errands.ask("", what, *given)

    async def train(self, network: str, epochs: int, told: Callable[[object], None]) -> Trained | None:
        """Train a network in a process of its own; None where it was stopped."""
        assert self.shown.history is not None, "a log is open"
        step, searched = self.shown.history.now, self.shown.searched
        self.errands.trouble = ""  # of a step before: it would be told as why this one ended
        with self.errands.telling():
            return await self.training.run((network, epochs), step, searched, self.folder, told)
        return None

    def close(self) -> None:
        """End the worker, and delete all that was uploaded or made."""
        self.training.stop()
        self.errands.end()
        self.audience.leave()
        self.shown.drop()  # FastAPI keeps the page's upload for longer, and that the session
        shutil.rmtree(self.folder, ignore_errors=True)
