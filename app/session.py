"""What one tab of the browser works on: a log, the step that its model is at, and what is selected in it."""

import asyncio
import re
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..physics.errors import LogError, RequestError, VehicleError
from ..workflows.workbench_facts import OWN_NUMBERS, Card, Fit, Opened, Searched, Source, Stand, Trained, Way
from .audience import Audience
from .errands import Errands
from .same_commands import same_commands
from .spare import Spare
from .training import Training
from .undo import History, Step
from .work import Work

_OF_A_VERB = re.compile(r"^(init|discover|add|fit|train): ")
"""How messages of the command line begin: with the verb that nobody typed here."""
Interval = tuple[float, float]


class Session:
    """One tab's work; whoever shows it is told of every change.

    Parameters
    ----------
    spare : a worker that may have opened already what is asked for

    Attributes
    ----------
    source, opened, searched : what is open, and what was found
    history : the steps; None before anything is open
    asked : what was to be opened last
    names : what the user calls an upload, by the name under which it is kept
    fit : the model of the present step
    stairs : the models of every beginning of its effects, the nominal one first, for the falling error
    by_hand : what there is to say for terms and effects that were added by name, as they last stood in the model
    selected : stretches of time that are marked in all views [s]
    audience : who is told of every change
    errands, training : what the worker is asked, and a network that another trains
    """

    def __init__(self, spare: Spare | None = None) -> None:
        self.audience = Audience()
        self.errands = Errands(self.audience, spare)
        self.source: Source | None = None
        self.asked: Source | None = None
        self._refusal = ""
        self.names: dict[str, str] = {}
        self.opened: Opened | None = None
        self.searched: Searched | None = None
        self.fit: Fit | None = None
        self.stairs: tuple[Fit, ...] = ()
        self.by_hand: dict[str, Card] = {}
        self.selected: tuple[Interval, ...] = ()
        self.folder = Path(tempfile.mkdtemp(prefix="undertow-app-"))
        self.history: History | None = None
        self._shown: Step | None = None
        self._left: tuple[str, ...] | None = ()
        self._weighed: Stand | None = None
        self._searches: dict[Source, Searched] = {}
        self.training = Training()
        self._turn = asyncio.Lock()

    # -- what is shown -------------------------------------------------------------------------------------------------

    @property
    def stand(self) -> Stand:
        """The model of the present step."""
        return Stand() if self.history is None else self.history.now.stand

    def named(self, text: str) -> str:
        """A text with the user's names of uploads in the place of those under which they are kept."""
        for kept, name in self.names.items():
            text = text.replace(f"{self.folder}/{kept}", name).replace(kept, name)
            text = text.replace(f"of {kept.split('.')[0]}", f"of {name.split('.')[0]}")
        return _OF_A_VERB.sub("", text)

    @property
    def work(self) -> Work | None:
        """What goes on; None while nothing does."""
        return self.errands.work

    @property
    def trouble(self) -> str:
        """What went wrong, in words; empty where nothing did."""
        return self.errands.trouble

    def changed(self) -> None:
        """Tell all views."""
        self.audience.tell()

    # -- what is done --------------------------------------------------------------------------------------------------

    async def open(self, source: Source, opened_one: Callable[[], None] | None = None) -> None:
        """Read a log, show it, and search for what is missing; where it is refused, what was open stays.

        Parameters
        ----------
        opened_one : called when the log is shown, or was refused, before the search
        """
        async with self._turn:
            self.errands.trouble, self.asked = "", source
            opened = await self.errands.open(source, self.folder)
            if opened is None:
                self._refusal = self.trouble
                if opened_one is not None:
                    opened_one()
                return
            self._searches.clear()
            self.history = History((Step(source),))
            self._begin(source, opened)
        if opened_one is not None:
            opened_one()
        await self.search()

    @property
    def refused(self) -> Source | None:
        """What was to be opened, and was refused."""
        told = self.work is None and self.trouble and self.trouble == self._refusal
        return self.asked if told and self.asked is not self.source else None

    @property
    def forcible(self) -> bool:
        """Whether the log that was refused is broken, and may be taken as it is."""
        return self.refused is not None and "--as-is" in self.trouble

    async def open_as_is(self) -> None:
        """Open the log that was refused, with a warning above every result."""
        if self.asked is not None:
            await self.open(replace(self.asked, as_is=True))

    async def repair(self) -> None:
        """Make the repairs that are safe, and go on with the repaired log: a step that can be taken back."""
        source = self.refused or self.source
        if source is None:
            return
        async with self._turn:
            fixed = await self.errands.ask("repairing the log", "repair", source, str(self.folder))
        if fixed is not None:
            self.names[Path(fixed).name] = "repaired.csv"
            repaired = replace(source, logs=(fixed,), channel_map="", frame="", as_is=False, original=source)
            here = self.history is not None and source == self.source
            await self._go((self.history if here else History((Step(source),))).then(Step(repaired)))  # type: ignore[union-attr]

    async def unrepair(self) -> None:
        """Go back to the log as it was before it was repaired."""
        if self.source is not None and self.source.original is not None:
            await self.change(self.source.original)

    async def change(self, source: Source) -> None:
        """Go on with another reading of what is open, such as other numbers of the vehicle: a step."""
        await self._then(Step(source))

    async def search(self) -> None:
        """Search for what is missing."""
        async with self._turn:
            found = await self.errands.ask("looking for what is missing", "search")
            if found is None:
                return
            self.searched = found
            if self.source is not None:
                self._searches[self.source] = found
            if found.hidden is not None:
                self._left = None
            if self._now.source == self.source:  # else a step to another reading waits for its turn
                await self._show()

    async def add(self, *names: str) -> None:
        """Add effects to the model."""
        await self._then(self._now.adding(*names))

    async def remove(self, name: str) -> None:
        """Take an effect out of the model."""
        await self._then(self._now.removing(name))

    async def leave(self, correction: str) -> None:
        """Read the log without a correction of its sensors, and fit the same effects anew."""
        await self._then(self._now.leaving(correction))

    async def correct(self, correction: str) -> None:
        """Make a correction of the sensors again that was left out."""
        await self._then(self._now.correcting(correction))

    async def move(self, symbol: str, value: float) -> None:
        """Set a number of the model by hand; one way of a slider is one step."""
        assert self.history is not None, "a log is open"
        step = self._now.moving({symbol: value})
        along = symbol in dict(self.stand.moved) and not self.history.can_redo
        await self._go(self.history.instead(step) if along else self.history.then(step))

    async def unmove(self) -> None:
        """Set all numbers that were moved by hand to their fitted values again."""
        await self._then(self._now.fitting())

    async def undo(self) -> None:
        """Go one step back."""
        if self.history is not None and self.history.can_undo:
            await self._go(self.history.back())

    async def redo(self) -> None:
        """Take the step again that was taken back."""
        if self.history is not None and self.history.can_redo:
            await self._go(self.history.forth())

    def select(self, intervals: tuple[Interval, ...]) -> None:
        """Mark stretches of time in all views."""
        self.selected = intervals
        self.changed()

    async def way(self, time: float) -> Way | None:
        """Where the models go from an instant on."""
        return await self.errands.ask("", "way", self.stand, time)

    async def take(self, what: str) -> Path | None:
        """Write a file to be taken away."""
        async with self._turn:
            name = "" if what == "model" else "writing the run"
            path = await self.errands.ask(name, "take", what, self.stand, str(self.folder))
            self.changed()
            return None if path is None else Path(path)

    async def ask(self, what: str, *given: Any) -> Any:
        """Something quick of the worker; None where it refuses, and `trouble` says why."""
        return await self.errands.ask("", what, *given)

    async def again(self) -> None:
        """Begin with a new worker where the old one has ended: the same log, the same steps."""
        source = self.source
        self.errands.end()
        if source is None:
            self.changed()
            return
        async with self._turn:
            if not await self._turn_to(source):
                return
        if self.searched is None:
            await self.search()
        await self._refit()

    async def train(self, network: str, epochs: int, told: Callable[[object], None]) -> Trained | None:
        """Train a network in a process of its own; None where it was stopped."""
        assert self.source is not None, "a log is open"
        try:
            return await self.training.run((network, epochs), self.stand, self.source, self.searched, self.folder, told)
        except (LogError, RequestError, VehicleError) as error:
            self.errands.trouble = error.typed
        except RuntimeError as error:
            self.errands.trouble = str(error)
        self.changed()
        return None

    def close(self) -> None:
        """End the worker, and delete all that was uploaded or made."""
        self.training.stop()
        self.errands.end()
        self.audience.leave()
        # FastAPI keeps the page's upload for longer, and that the session: what is large goes now.
        self.opened = self.searched = self.fit = None
        self.stairs, self.by_hand = (), {}
        self._searches.clear()
        for folder in filter(None, (self.folder, self.errands.lent)):
            shutil.rmtree(folder, ignore_errors=True)

    def commands(self) -> str:
        """The commands that do the same on the command line, with remarks on what none of them does."""
        if self.source is None:
            return ""
        found = () if self.searched is None else self.searched.found
        return self.named(same_commands(self.source, self.stand, found))

    # -- how -----------------------------------------------------------------------------------------------------------

    @property
    def _now(self) -> Step:
        assert self.history is not None, "a log is open"
        return self.history.now

    async def _then(self, step: Step) -> None:
        """Take a step, if it is one."""
        if self.history is not None and step != self.history.now:
            await self._go(self.history.then(step))

    async def _go(self, history: History) -> None:
        """Show the present step of a history; where that cannot be done, all stays as it was."""
        before, self.history = self.history, history
        if not await self._refit() and self.history is history:
            self.history = before
            self.changed()

    async def _refit(self) -> bool:
        """Fit what the present step asks for, and show it; whether that could be done."""
        async with self._turn:
            step = self._now
            if self._shown == step and step.source == self.source and not self.trouble:
                return True  # a slider has moved on while this one waited
            self.errands.trouble = ""
            other = step.source != self.source
            if other and not await self._turn_to(step.source):
                return False
            if not await self._show():
                return False
        if other and self.searched is None:
            await self.search()
        return True

    async def _turn_to(self, source: Source) -> bool:
        """Go on with what was open before, or is opened beside it; whether that could be read."""
        self.asked = source
        opened = await self.errands.ask("reading the log", "turn_to", source, str(self.folder))
        found = self._searches.get(source)
        if opened is not None and found is not None and found.hidden is not None:
            opened = await self.errands.ask("", "resume", found.hidden)
        if opened is None:
            self._refusal = self.trouble
            return False
        self._begin(source, opened)
        return True

    def _begin(self, source: Source, opened: Opened) -> None:
        """Show what was read, of which a network in training knows nothing."""
        self.training.stop()
        self.searched, self.selected, self.by_hand, self._weighed = self._searches.get(source), (), {}, None
        self.source, self.opened, self._shown, self._left = source, opened, None, ()
        self.fit, self.stairs = opened.nominal, (opened.nominal,)
        self.changed()

    async def _show(self) -> bool:
        step, stand = self._now, self.stand
        opened = self.opened if stand.left == self._left else await self._read(stand.left)
        if opened is None:
            return False
        fit = opened.nominal if stand == Stand(left=stand.left) else await self.errands.ask("", "fit", stand)
        if fit is None:
            return False
        self.opened, self._left, self.fit, self._shown = opened, stand.left, fit, step
        self.changed()
        stairs = [opened.nominal] if stand.names else []
        for count in range(1, len(stand.names)):
            stair = await self.errands.ask("", "fit", Stand(stand.names[:count], left=stand.left))
            if stair is None:
                return True
            stairs.append(stair)
        self.stairs = (*stairs, fit)
        self.changed()
        await self._weigh(replace(stand, moved=()))
        return True

    async def _weigh(self, stand: Stand) -> None:
        """Say what there is for terms and effects that were added by name."""
        if self.searched is None or stand == self._weighed:
            return
        known = {OWN_NUMBERS, *(card.name for card in self.searched.cards)}
        for name in stand.names:
            if name not in known:
                card = await self.errands.ask("weighing what was added by name", "weigh", stand, name)
                if card is not None:
                    self.by_hand[name] = card
                    self.changed()
        self._weighed = stand

    async def _read(self, left: tuple[str, ...]) -> Opened | None:
        """What is measured without some corrections of the sensors."""
        return await self.errands.ask("reading the log anew", "opened", left)
