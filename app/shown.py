"""The step that all views of a tab show: what is open, what was found in it, and the model."""

from dataclasses import replace
from pathlib import Path

from ..workflows.workbench_facts import OWN_NUMBERS, Card, Fit, HullDiary, Opened, Searched, Source, Stand
from .audience import Audience
from .errands import Errands
from .undo import History, Step

Interval = tuple[float, float]


class Shown:
    """What is shown, as the worker has computed it; what it refuses changes nothing.

    Parameters
    ----------
    errands : asked for what is to be shown
    audience : told of every change
    folder : private to the tab

    Attributes
    ----------
    history : the steps, of which the present one is shown; None before anything is open
    opened : the log, as that step reads it
    searches : what was found, by what was searched
    fit : the model of the step
    stairs : the models of every beginning of its effects, the nominal one first, for the falling error; where numbers
        were moved by hand, that with all effects as they are fitted comes before it
    by_hand : what there is to say for terms and effects that were added by name, as they last stood in the model
    selected : stretches of time that are marked in all views [s]
    diary : of a fleet, which is shown in place of a log; None for the log
    """

    def __init__(self, errands: Errands, audience: Audience, folder: Path) -> None:
        self._errands, self._audience, self._folder = errands, audience, folder
        self.history: History | None = None
        self.opened: Opened | None = None
        self.searches: dict[Source, Searched] = {}
        self.fit: Fit | None = None
        self.stairs: tuple[Fit, ...] = ()
        self.by_hand: dict[str, Card] = {}
        self.selected: tuple[Interval, ...] = ()
        self.diary: HullDiary | None = None
        self._stale = False
        self._weighed: Stand | None = None

    @property
    def source(self) -> Source | None:
        """What is open."""
        return None if self.history is None else self.history.now.source

    @property
    def stand(self) -> Stand:
        """The model."""
        return Stand() if self.history is None else self.history.now.stand

    @property
    def searched(self) -> Searched | None:
        """What was found; None before a search."""
        return None if self.history is None else self.searches.get(self.history.now.source)

    @property
    def refits(self) -> bool:
        """Whether the search fitted the model's own numbers."""
        return self.searched is not None and self.searched.refits

    def open(self, source: Source, opened: Opened) -> None:
        """Show a log that was read, and forget all that was found in others."""
        self.diary = None
        self.searches.clear()
        self._put(History((Step(source),)), opened, opened.nominal, other=True)

    async def search(self) -> None:
        """Search for what is missing in what is open, and show it."""
        found = await self._errands.ask("looking for what is missing", "search")
        if found is not None and self.history is not None:
            self.searches[self.history.now.source] = found
            self._stale = found.hidden is not None
            await self.show(self.history)

    async def show(self, history: History, *, anew: bool = False) -> bool:
        """Read and fit what the present step of a history asks for, and show it; whether that could be done.

        Parameters
        ----------
        anew : the worker has nothing open yet
        """
        step, other = history.now, anew or history.now.source != self.source
        opened = await self._turn_to(step.source) if other else self.opened
        if opened is None:
            return False
        left = step.stand.left
        if left != (() if other else self.stand.left) or (self._stale and not other):
            opened = await self._errands.ask("reading the log anew", "opened", left)
        fit = None if opened is None else await self._fit(step.stand, opened)
        if opened is None or fit is None:
            if other and self.source is not None:
                await self._turn_to(self.source)  # what is shown is also what the worker has open
            return False
        self._put(history, opened, fit, other=other)
        await self._climb(step.stand, opened, fit)
        return True

    def select(self, intervals: tuple[Interval, ...]) -> None:
        """Mark stretches of time in all views."""
        self.selected = intervals
        self._audience.tell()

    def turn_to_fleet(self, diary: HullDiary | None) -> None:
        """Show the diary of a fleet in place of a log; None for the log again."""
        self.diary = diary
        self._audience.tell()

    def drop(self) -> None:
        """Let go of what is large."""
        self.opened = self.fit = None
        self.stairs, self.by_hand = (), {}
        self.searches.clear()

    async def _turn_to(self, source: Source) -> Opened | None:
        given = source, str(self._folder), self.searches.get(source)
        return await self._errands.ask("reading the log", "turn_to", *given)

    async def _fit(self, stand: Stand, opened: Opened) -> Fit | None:
        return opened.nominal if stand == Stand(left=stand.left) else await self._errands.ask("", "fit", stand)

    def _put(self, history: History, opened: Opened, fit: Fit, *, other: bool) -> None:
        if other:
            self.selected, self.by_hand, self._weighed = (), {}, None
            self.stairs = (opened.nominal,)
        self.history, self.opened, self.fit, self._stale = history, opened, fit, False
        self._audience.tell()

    async def _climb(self, stand: Stand, opened: Opened, fit: Fit) -> None:
        """Show the error as it falls with every effect, and what there is to say for those that were added by name."""
        stairs = [opened.nominal] if stand.names else []
        for count in range(1, len(stand.names) + bool(stand.moved)):
            stair = await self._errands.ask("", "fit", Stand(stand.names[:count], left=stand.left))
            if stair is None:
                return
            stairs.append(stair)
        self.stairs = (*stairs, fit)
        self._audience.tell()
        await self._weigh(replace(stand, moved=()))

    async def _weigh(self, stand: Stand) -> None:
        if self.searched is None or stand == self._weighed:
            return
        known = {OWN_NUMBERS, *(card.name for card in self.searched.cards)}
        for name in stand.names:
            if name not in known:
                card = await self._errands.ask("weighing what was added by name", "weigh", stand, name)
                if card is not None:
                    self.by_hand[name] = card
                    self._audience.tell()
        self._weighed = stand
