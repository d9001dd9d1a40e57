"""A finding as a card, with a button that puts it into the model and takes it out again."""

from collections.abc import Awaitable, Callable

from nicegui import ui

from ...physics.in_words import listing
from ...workflows.workbench_facts import Card
from .words import button, line

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
        details = ui.element("details").classes("small")
        with details:
            line("why", tag="summary")
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
