"""The step that all views of a tab show: what is open, what was found in it, and the model, on one of two logs."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from ..workflows.workbench_facts import OWN_NUMBERS, Card, Fit, HullDiary, ModelChoice, Opened, Searched, Source
from .steps import FileNames, History, Step
from .worker_client import Observers, WorkerClient

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class OnLog:
    """The model on a log.

    Attributes
    ----------
    opened : the log, as the present step reads it
    fit : the model of the step
    stairs : the models of every beginning of its effects, the nominal one first, for the falling error; where numbers
        were moved by hand, that with all effects as they are fitted comes before it
    selected : stretches of time that are marked in all views [s]
    source : what another log than that of the step was read from
    """

    opened: Opened
    fit: Fit
    stairs: tuple[Fit, ...] = ()
    selected: tuple[Interval, ...] = ()
    source: Source | None = None


@dataclass(frozen=True, slots=True)
class View:
    """What the plots show, and of which force and over what the map is."""

    drawn: Literal["speeds", "forces"] = "speeds"
    axis: Literal["X", "Y", "N"] = "X"
    over: Literal["turn", "command"] = "turn"


class Shown:
    """What is shown, as the worker has computed it; what it refuses changes nothing.

    Parameters
    ----------
    errands : asked for what is to be shown
    audience : told of every change
    folder : private to the tab
    names : what the user calls the files in it

    Attributes
    ----------
    history : the steps, of which the present one is shown; None before anything is open
    fitted : the log that models are fitted to
    other : another log, on which the same models are judged; None where there is none
    on_other : the views show the other log
    view : what they draw of it
    searches : what was found, by what was searched
    by_hand : what there is to say for terms and effects that were added by name, as they last stood in the model
    diary : of a fleet, which is shown in place of a log; None for the log
    """

    def __init__(
        self, errands: WorkerClient, audience: Observers, folder: Path, names: FileNames | None = None
    ) -> None:
        self._errands, self._audience, self._folder = errands, audience, folder
        self._names = names or FileNames(folder)
        self.history: History | None = None
        self.fitted: OnLog | None = None
        self.other: OnLog | None = None
        self.on_other = False
        self.view = View()
        self.searches: dict[Source, Searched] = {}
        self.by_hand: dict[str, Card] = {}
        self.diary: HullDiary | None = None
        self._stale = False
        self._weighed: ModelChoice | None = None

    # -- the log that is chosen ----------------------------------------------------------------------------------------

    @property
    def chosen(self) -> OnLog | None:
        """The model on the log that the views show."""
        return self.other if self.on_other else self.fitted

    @property
    def other_source(self) -> Source | None:
        """What the other log was read from."""
        return None if self.other is None else self.other.source

    @property
    def opened(self) -> Opened | None:
        """The log that the views show."""
        return None if self.chosen is None else self.chosen.opened

    @property
    def fit(self) -> Fit | None:
        """The model on that log."""
        return None if self.chosen is None else self.chosen.fit

    @property
    def stairs(self) -> tuple[Fit, ...]:
        """See `OnLog`, of that log."""
        return () if self.chosen is None else self.chosen.stairs

    @property
    def selected(self) -> tuple[Interval, ...]:
        """Stretches of that log that are marked [s]."""
        return () if self.chosen is None else self.chosen.selected

    @property
    def of_fitted(self) -> tuple[Fit, ...]:
        """The stairs on the log that models are fitted to."""
        return () if self.fitted is None else self.fitted.stairs

    # -- the step ------------------------------------------------------------------------------------------------------

    @property
    def source(self) -> Source | None:
        """What is open."""
        return None if self.history is None else self.history.now.source

    @property
    def stand(self) -> ModelChoice:
        """The model."""
        return ModelChoice() if self.history is None else self.history.now.stand

    @property
    def searched(self) -> Searched | None:
        """What was found; None before a search."""
        return None if self.history is None else self.searches.get(self.history.now.source)

    @property
    def refits(self) -> bool:
        """True when the search fitted the model's own numbers."""
        return self.searched is not None and self.searched.refits

    def open(self, source: Source, opened: Opened) -> None:
        """Show a log that was read, and forget all that was found in others."""
        self.diary = None
        self.searches.clear()
        self._put(History((Step(source),)), OnLog(opened, opened.nominal), None, anew=True)

    async def reopen(self, history: History, opened: Opened, searched: Searched | None) -> bool:
        """Show a step of a history on a log that was read, with what a search of it has found; whether that could be.

        Parameters
        ----------
        searched : the facts of the search, of which the rest is made; see `Workbench.recall`
        """
        self.open(history.now.source, opened)
        if searched is None:
            return await self.show(history)
        found = await self._errands.ask("reading what was found", "recall", searched)
        return await self._show_found(found, history)

    async def search(self) -> None:
        """Search for what is missing in what is open, and show it."""
        found = await self._errands.ask("looking for what is missing", "search")
        await self._show_found(found, self.history)

    async def _show_found(self, found: Searched | None, history: History | None) -> bool:
        """Show a step of a history with what was found, where something was; whether that could be."""
        if found is None or history is None:
            return False
        self.searches[history.now.source] = found
        self._stale = found.hidden is not None or (found.findings is not None and found.findings.change is not None)
        return await self.show(history)

    async def show(self, history: History, *, anew: bool = False) -> bool:
        """Read and fit what the present step of a history asks for, and show it; whether that could be done.

        Parameters
        ----------
        anew : the worker has nothing open yet
        """
        step, anew = history.now, anew or history.now.source != self.source
        opened = await self._turn_to(step.source) if anew else self.fitted and self.fitted.opened
        if opened is None:
            return False
        left = step.stand.left
        if left != (() if anew else self.stand.left) or (self._stale and not anew):
            opened = await self._errands.ask("reading the log anew", "opened", left)
        fit = None if opened is None else await self._fit(step.stand, opened)
        other = await self._on_other(step.stand, anew=anew) if fit is not None else None
        if opened is None or fit is None or self._errands.lost:
            if anew and self.source is not None:
                await self._turn_to(self.source)  # what is shown is also what the worker has open
            return False
        self._put(history, OnLog(opened, fit), other, anew=anew)
        await self._climb(step.stand)
        await self._climb(step.stand, on_other=True)
        await self._weigh(replace(step.stand, moved=()))
        return True

    def select(self, intervals: tuple[Interval, ...]) -> None:
        """Mark stretches of time in all views."""
        if self.on_other and self.other is not None:
            self.other = replace(self.other, selected=intervals)
        elif self.fitted is not None:
            self.fitted = replace(self.fitted, selected=intervals)
        self._audience.tell()

    def turn_to_fleet(self, diary: HullDiary | None) -> None:
        """Show the diary of a fleet in place of a log; None for the log again."""
        self.diary = diary
        self._audience.tell()

    def drop(self) -> None:
        """Let go of what is large."""
        self.fitted = self.other = None
        self.by_hand = {}
        self.searches.clear()

    # -- another log ---------------------------------------------------------------------------------------------------

    async def try_on(self, source: Source) -> bool:
        """Read another log and show the model on it, fitted as it is; whether that could be done."""
        if self.fitted is None:
            return False
        other = await self._read_other(source, self.stand)
        if other is None:
            return False
        self.other, self.on_other = other, True
        self._audience.tell()
        await self._climb(self.stand, on_other=True)
        return True

    def look_at(self, *, other: bool) -> None:
        """Show the model on the other log, or on that to which it is fitted."""
        self.on_other = other and self.other is not None
        self._audience.tell()

    async def look_again(
        self,
        other: Source | None,
        view: View,
        selected: tuple[tuple[Interval, ...], tuple[Interval, ...]],
        *,
        on_other: bool,
    ) -> None:
        """Look at the present step as a session was saved.

        Parameters
        ----------
        other : the other log; None for none
        selected : stretches that are marked on the fitted and on the other log
        """
        if other is not None:
            await self.try_on(other)
        self.view = view
        of_fitted, of_other = selected
        if self.fitted is not None:
            self.fitted = replace(self.fitted, selected=of_fitted)
        if self.other is not None:
            self.other = replace(self.other, selected=of_other)
        self.look_at(other=on_other)

    def put_away(self) -> None:
        """Go on without the other log."""
        self.other, self.on_other = None, False
        self._audience.tell()

    async def _on_other(self, stand: ModelChoice, *, anew: bool) -> OnLog | None:
        """The model of a stand on the other log, which is read anew where the vehicle may be another."""
        if self.other is None or self.other.source is None:
            return None
        if anew:
            return await self._read_other(self.other.source, stand)
        fit = await self._fit(stand, self.other.opened, on_other=True)
        return None if fit is None else replace(self.other, fit=fit)

    async def _read_other(self, source: Source, stand: ModelChoice) -> OnLog | None:
        found = await self._errands.ask("reading the other log", "try_on", source, stand, self._names)
        return None if found is None else OnLog(*found, stairs=(found[0].nominal,), source=source)

    # -- what the worker is asked --------------------------------------------------------------------------------------

    async def _turn_to(self, source: Source) -> Opened | None:
        searched = self.searches.get(source)
        return await self._errands.ask("reading the log", "turn_to", source, str(self._folder), searched)

    async def _fit(self, stand: ModelChoice, opened: Opened, *, on_other: bool = False) -> Fit | None:
        plain = stand == ModelChoice(left=stand.left)
        return opened.nominal if plain else await self._errands.ask("", "fit", stand, on_other)

    def _put(self, history: History, fitted: OnLog, other: OnLog | None, *, anew: bool) -> None:
        before = None if anew else self.fitted
        if anew:
            self.by_hand, self._weighed = {}, None
        stairs = (fitted.opened.nominal,) if before is None else before.stairs
        self.fitted = replace(fitted, stairs=stairs, selected=() if before is None else before.selected)
        self.other, self.on_other = other, self.on_other and other is not None
        self.history, self._stale = history, False
        self._audience.tell()

    async def _climb(self, stand: ModelChoice, *, on_other: bool = False) -> None:
        """Show the error as it falls with every effect, on one of the logs."""
        on = self.other if on_other else self.fitted
        if on is None:
            return
        stairs = [on.opened.nominal] if stand.names else []
        for count in range(1, len(stand.names) + bool(stand.moved)):
            below = ModelChoice(stand.names[:count], left=stand.left)
            stair = await self._errands.ask("", "fit", below, on_other)
            if stair is None:
                return
            stairs.append(stair)
        if not on_other:
            self.fitted = replace(self.fitted or on, stairs=(*stairs, on.fit))
        elif self.other is not None:  # it may have been put away meanwhile
            self.other = replace(self.other, stairs=(*stairs, on.fit))
        self._audience.tell()

    async def _weigh(self, stand: ModelChoice) -> None:
        """Find what there is to say for effects that were added by name."""
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
