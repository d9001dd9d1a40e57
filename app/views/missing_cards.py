"""What is missing: a card for every effect, to be added and taken out again."""

from collections.abc import Sequence

from nicegui import ui

from ...physics.in_words import listing, words
from ...workflows.workbench_facts import OWN_NUMBERS, Card, Searched
from ..session import Session
from .words import button, line, watching

_OWN = Card(
    OWN_NUMBERS,
    "The model's own numbers",
    "",
    "Drag, added mass and lag that the vehicle file has, as far as the log identifies them, fitted beside these.",
    "",
)
"""What is no effect and may be fitted all the same."""
_OPEN = 6
"""Cards that are shown at once; the rest is folded."""


class MissingCards:
    """Cards, the most valuable first; what has no evidence is folded. They stay in their place when one is added."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._searched: Searched | None = None
        self._cards: dict[str, _Shown] = {}
        place = ui.element("section").classes("cards stack").props('aria-label="What is missing"')
        with place:
            with ui.element("div").classes("flow"):
                line("What is missing", tag="h2").style("margin: 0; flex: 1")
                self._all = button("Add all found", self._add_all, label="Add all effects that were found")
            self._waits = line("", "muted")
            self._search = button("Search", session.search, lead=True)
            self._body = ui.element("div").classes("stack")
        watching(session, place, self._refresh)

    async def _add_all(self) -> None:
        await self._session.add(*self._left())

    def _left(self) -> Sequence[str]:
        """What was found and is not in the model."""
        searched = self._session.searched
        return [] if searched is None else [name for name in searched.found if name not in self._session.stand.names]

    def _refresh(self) -> None:
        session = self._session
        searched, busy = session.searched, session.work is not None
        self._waits.set_visibility(searched is None)
        self._waits.set_text("The search goes on." if busy else "Nothing was searched yet.")
        self._search.set_visibility(searched is None and not busy and session.opened is not None)
        self._all.set_visibility(len(self._left()) > 1)
        if searched is not self._searched:
            self._searched = searched
            self._body.clear()
            self._cards.clear()
            if searched is not None:
                with self._body:
                    self._build(searched)
        for name in session.stand.names:
            if searched is not None and name not in self._cards:
                with self._typed:
                    self._card(Card(name, words(name), "", "Added by name.", ""))
        for name, card in self._cards.items():
            card.set_in(name in session.stand.names)

    def _build(self, searched: Searched) -> None:
        found = [card for card in searched.cards if card.verdict != "no evidence"]
        rest = [card for card in searched.cards if card.verdict == "no evidence"]
        for card in found[:_OPEN]:
            self._card(card, opened=card is found[0])
        if found[_OPEN:]:
            with ui.element("details").classes("stack"):
                line(f"{len(found) - _OPEN} more that may be", tag="summary")
                for card in found[_OPEN:]:
                    self._card(card)
        self._card(_OWN)
        self._typed = ui.element("div").classes("stack")
        for sentence in searched.sensors:
            line(sentence, "card small")
        if searched.advice:
            with ui.element("details").classes("small"):
                line("What would tell more", tag="summary")
                for manoeuvre, why in searched.advice:
                    line(f"{manoeuvre} {why}", "muted")
        if rest:
            with ui.element("details").classes("stack"):
                line(f"{len(rest)} effects without evidence", tag="summary")
                for card in rest:
                    self._card(card)
        self._by_hand()

    def _card(self, card: Card, *, opened: bool = False) -> None:
        self._cards[card.name] = _Shown(self._session, card, opened=opened)

    def _by_hand(self) -> None:
        """A term or an effect that the user types."""
        with ui.element("details").classes("small"):
            line("Add by name, or a term by hand", tag="summary")
            line("An effect of the catalogue, or an axis and a product of speeds, such as yaw:u|r|.", "muted")
            with ui.element("div").classes("flow"):
                field = ui.input(label="effect or term").props("dense outlined").style("flex: 1")

                async def act() -> None:
                    if name := (field.value or "").strip():
                        await self._session.add(name if ":" in name else name.replace(" ", "_"))

                field.on("keydown.enter", act)
                button("Add", act, label="Add what is typed")


class _Shown:
    """One card on the page."""

    def __init__(self, session: Session, card: Card, *, opened: bool) -> None:
        self._session, self._card, self._in = session, card, False
        self._place = ui.element("article").classes("effect").mark(card.name)
        kind = {"no evidence": "none", "": "none"}.get(card.verdict, card.verdict)
        self._place.classes(kind)
        with self._place:
            with ui.element("div").classes("head"):
                with ui.element("div"):
                    line(card.title, tag="h3")
                    if card.verdict:
                        line(card.verdict, f"tag {kind}", tag="span")
                self._button = button("Add", self._act, label=f"Add {card.title}")
                self._button.classes("lead")
            for text in card.numbers:
                line(text, "small")
            if card.twins:
                line(f"This log cannot tell it from {listing(list(card.twins))}.", "muted small")
            if card.equation:
                self._why(opened)
            else:
                line(card.sentence, "muted small")

    def set_in(self, is_in: bool) -> None:
        """Show whether the effect is in the model."""
        if is_in == self._in:
            return
        self._in = is_in
        text = "Remove" if is_in else "Add"
        self._button.set_text(text)
        self._button.props(f'aria-label="{text} {self._card.title}"')
        self._button.classes(add="plain" if is_in else "lead", remove="lead" if is_in else "plain")
        self._place.classes(add="in" if is_in else None, remove=None if is_in else "in")

    async def _act(self) -> None:
        await (self._session.remove(self._card.name) if self._in else self._session.add(self._card.name))

    def _why(self, opened: bool) -> None:
        """The finding with its picture, which is sent when it is looked at."""
        card = self._card
        details = ui.element("details").classes("small")
        with details:
            line("why", tag="summary")
            line(card.sentence)
            line(card.equation, "equation")
            picture = ui.element("div")
            if card.chance and card.chance not in card.sentence:
                line(card.chance, "muted")
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
