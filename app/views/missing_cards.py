"""Cards of findings: what is missing and what the sensors do wrong, to be added and taken out again."""

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace

from nicegui import ui

from ...physics.presentation import listing, words
from ...workflows.workbench_facts import OWN_NUMBERS, Card, Searched
from ..session import Session
from .words import button, folded, line, watching

Act = Callable[[str], Awaitable[None]]


_KINDS = {
    "missing": "missing",
    "likely": "likely",
    "possible": "possible",
    "present": "possible",
    "betters unseen rows": "possible",
}
"""How a verdict looks; as no evidence where it is none of these."""


class FindingCard:
    """One card on the page.

    Parameters
    ----------
    card : what it says
    add, remove : what its button does, called with the card's name; a card without a name has no button
    opened : its reasons are shown at once
    whose : of which fit its numbers are
    """

    def __init__(self, card: Card, add: Act, remove: Act, *, opened: bool = False, whose: str = "") -> None:
        self._card, self._acts, self._in = card, (add, remove), False
        self._place = ui.element("article").classes("effect").mark(card.name or card.title)
        kind = _KINDS.get(card.verdict, "none")
        self._place.classes(kind)
        self._button: ui.button | None = None
        with self._place:
            with ui.element("div").classes("head"):
                with ui.element("div"):
                    line(card.title, tag="h3")
                    if card.verdict:
                        line(f"{card.verdict} {card.odds}".rstrip(), f"tag {kind}", tag="span")
                if card.name:
                    self._button = button("Add", self._act, label=f"Add {card.title}")
                    self._button.classes("lead")
            if whose and card.numbers:
                line(f"{whose}:", "muted small")
            for text in card.numbers:
                line(text, "small")
            if card.twins:
                line(f"This log cannot tell it from {listing(list(card.twins))}.", "muted small")
            if card.equation:
                self._why(opened)
            else:
                line(card.sentence, "muted small")

    def set_in(self, is_in: bool) -> None:
        """Show whether it is in the model."""
        if is_in == self._in or self._button is None:
            return
        self._in = is_in
        text = "Remove" if is_in else "Add"
        self._button.set_text(text)
        self._button.props(f'aria-label="{text} {self._card.title}"')
        self._button.classes(add="plain" if is_in else "lead", remove="lead" if is_in else "plain")
        self._place.classes(add="in" if is_in else None, remove=None if is_in else "in")

    def delete(self) -> None:
        """Take it from the page."""
        self._place.delete()

    async def _act(self) -> None:
        await self._acts[self._in](self._card.name)

    def _why(self, opened: bool) -> None:
        """The finding with its picture, which is sent when it is looked at."""
        card = self._card
        details = folded("why")
        with details:
            line(card.sentence)
            line(card.equation, "equation")
            picture = ui.element("div")
            if card.tell:
                line(f"To tell: {card.tell}", "muted")
        drawn: list[bool] = []

        def draw() -> None:
            if card.picture and not drawn:
                drawn.append(True)
                with picture:
                    ui.html(card.picture, sanitize=False)

        details.on("toggle", draw)
        if opened:
            details.props("open")
            draw()


_OWN = Card(
    OWN_NUMBERS,
    "The model's own numbers",
    "",
    "Drag, added mass and lag that the vehicle file has, as far as the log identifies them, fitted beside these.",
    "",
)
"""What is no effect and may be fitted all the same."""
_CORRECTED = "The log is read with these corrections. Without one, the same effects are fitted anew."
_SEARCH, _SHOWN = "In the search's fit", "In the shown model"
"""Whose the numbers on a card are."""
_TITLE = "What is missing"
"""Over the cards before a search has said how sure that is."""
_OPEN = 6
"""Cards that are shown at once; the rest is folded."""


class MissingCards:
    """Cards, the most valuable first; what has no evidence is folded. They stay in their place when one is added."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._searched: Searched | None = None
        self._cards: dict[str, FindingCard] = {}
        self._sensors: dict[str, FindingCard] = {}
        self._by_name: dict[str, Card] = {}
        place = ui.element("section").classes("cards stack").props(f'aria-label="{_TITLE}"')
        with place:
            with ui.element("div").classes("flow"):
                self._title = line(_TITLE, tag="h2").style("margin: 0; flex: 1")
                self._all = button("Add all found", self._add_all, label="Add all effects that were found")
            self._waits = line("", "muted")
            self._search = button("Search", session.search, lead=True)
            self._body = ui.element("div").classes("stack")
        watching(session, place, self._refresh)

    async def _add_all(self) -> None:
        await self._session.add(*self._left())

    def _left(self) -> Sequence[str]:
        """What was found and is not in the model."""
        searched, names = self._session.shown.searched, self._session.shown.stand.names
        return [] if searched is None else [name for name in searched.found if name not in names]

    def _refresh(self) -> None:
        session = self._session
        searched, stand, busy = session.shown.searched, session.shown.stand, session.errands.work is not None
        self._waits.set_visibility(searched is None)
        self._waits.set_text("The search goes on." if busy else "Nothing was searched yet.")
        self._search.set_visibility(searched is None and not busy and session.shown.opened is not None)
        self._all.set_visibility(len(self._left()) > 1)
        if searched is not self._searched:
            self._searched = searched
            self._title.set_text(_TITLE if searched is None else searched.title)
            for part in (self._body, self._cards, self._sensors, self._by_name):
                part.clear()
            if searched is not None:
                with self._body:
                    self._build(searched)
        for name in stand.names:
            if searched is not None and (name not in self._cards or name in self._by_name):
                card = session.shown.by_hand.get(name, Card(name, words(name), "", "Added by name.", ""))
                if self._by_name.get(name) != card:
                    if name in self._by_name:
                        self._cards[name].delete()
                    self._by_name[name] = card
                    with self._typed:
                        self._card(card, whose=_SHOWN)
        for name, shown in self._cards.items():
            shown.set_in(name in stand.names)
        for name, card in self._sensors.items():
            card.set_in(name not in stand.left)
        if any(self._sensors):  # what has no name was not corrected
            left = listing([words(name) for name in stand.left])
            text = f"Now the log is read without the correction of {left}." if left else _CORRECTED
            self._corrected.set_text(session.names.with_user_names(text))

    def _build(self, searched: Searched) -> None:
        found = [card for card in searched.cards if card.verdict != "no evidence"]
        rest = [card for card in searched.cards if card.verdict == "no evidence"]
        if any(card.numbers for card in found):
            line("The search's fit has all that was found; the table has the shown model's numbers.", "muted small")
        if any(card.odds for card in found):
            line(f"In percent: {searched.sure.removeprefix('sure: ')}.", "muted small")
        for card in found[:_OPEN]:
            self._card(card, opened=card is found[0])
        if found[_OPEN:]:
            with folded(f"{len(found) - _OPEN} more that may be", "stack"):
                for card in found[_OPEN:]:
                    self._card(card)
        self._card(_OWN)
        self._typed = ui.element("div").classes("stack")
        if searched.sensors:
            line("What the sensors do wrong", tag="h2").style("margin: 8px 0 0")
            self._corrected = line("", "muted small")
        for card in searched.sensors:
            self._sensors[card.name] = FindingCard(self._named(card), self._session.correct, self._session.leave)
        if searched.advice:
            with folded("What would tell more"):
                for manoeuvre, why in searched.advice:
                    line(f"{manoeuvre} {why}", "muted")
        if rest:
            with folded(f"{len(rest)} effects without evidence", "stack"):
                for card in rest:
                    self._card(card)
        self._by_hand()

    def _card(self, card: Card, *, opened: bool = False, whose: str = _SEARCH) -> None:
        acts = self._session.add, self._session.remove
        self._cards[card.name] = FindingCard(self._named(card), *acts, opened=opened, whose=whose)

    def _named(self, card: Card) -> Card:
        """A card with the user's names of the logs."""
        told = self._session.names.with_user_names
        return replace(card, title=told(card.title), sentence=told(card.sentence))

    def _by_hand(self) -> None:
        """A term or an effect that the user types."""
        with folded("Add by name, or a term by hand"):
            line("An effect of the catalogue, or an axis and a product of speeds, such as yaw:u|r|.", "muted")
            with ui.element("div").classes("flow"):
                field = ui.input(label="effect or term").props("dense outlined").style("flex: 1")

                async def act() -> None:
                    if name := (field.value or "").strip():
                        await self._session.add(name if ":" in name else name.replace(" ", "_"))

                field.on("keydown.enter", act)
                button("Add", act, label="Add what is typed")
