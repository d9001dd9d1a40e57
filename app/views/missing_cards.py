"""What is missing: a card for every effect, to be added and taken out again."""

from nicegui import ui

from ...physics.in_words import listing, words
from ...workflows.workbench_facts import Card
from ..session import Session
from .words import button, line, watching

_OWN = "own numbers"
_OPEN = 6
"""Cards that are open at once; the rest is folded."""


def missing_cards(session: Session) -> None:
    """Cards, the most valuable first; what has no evidence is folded."""
    place = ui.element("section").classes("cards stack").props('aria-label="What is missing"')
    shown: list[object] = []

    def refresh() -> None:
        now: list[object] = [session.searched, session.stand.names, session.work is None, session.opened]
        if now == shown:
            return
        shown[:] = now
        place.clear()
        with place:
            _cards(session)

    watching(session, place, refresh)


def _cards(session: Session) -> None:
    searched, names = session.searched, session.stand.names
    with ui.element("div").classes("row"):
        line("What is missing", tag="h2").style("margin: 0; flex: 1")
        left = [] if searched is None else [name for name in searched.found if name not in names]
        if len(left) > 1:
            button("Add all found", lambda: session.add(*left), label="Add all effects that were found")
    if searched is None:
        line("The search has not ended yet." if session.work else "Nothing was searched yet.", "muted")
        if session.work is None and session.opened is not None:
            button("Search", session.search, lead=True)
        return
    if searched.verdict != "missing":
        line(searched.headline, "card small")
    _own_numbers(session)
    found = [card for card in searched.cards if card.verdict != "no evidence" or card.name in names]
    rest = [card for card in searched.cards if card not in found]
    first = next((card for card in found if card.name not in names), None)
    for card in found[:_OPEN]:
        _card(session, card, opened=card is first)
    if found[_OPEN:]:
        with ui.element("details"):
            line(f"{len(found) - _OPEN} more that may be", tag="summary")
            for card in found[_OPEN:]:
                _card(session, card)
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
                _card(session, card)
    _by_hand(session)


def _own_numbers(session: Session) -> None:
    """The model's own numbers, which may be fitted beside the effects."""
    is_in = _OWN in session.stand.names
    with ui.element("article").classes(f"effect {'in' if is_in else ''}"), ui.element("div").classes("head"):
        with ui.element("div"):
            line("The model's own numbers", tag="h3")
            line("Drag, added mass and lag that the vehicle file has, fitted beside what is added.", "muted small")
        _switch(session, _OWN, is_in, "the model's own numbers")


def _card(session: Session, card: Card, *, opened: bool = False) -> None:
    is_in = card.name in session.stand.names
    kind = card.verdict.replace("no evidence", "none")
    with ui.element("article").classes(f"effect {kind} {'in' if is_in else ''}").mark(card.name):
        with ui.element("div").classes("head"):
            with ui.element("div"):
                line(card.title, tag="h3")
                line(card.verdict, f"tag {kind}", tag="span")
            _switch(session, card.name, is_in, card.title)
        for text in card.numbers:
            line(text, "small")
        if card.twins:
            line(f"This log cannot tell it from {listing(list(card.twins))}.", "muted small")
        with ui.element("details").props("open" if opened else "").classes("small"):
            line("why", tag="summary")
            line(card.sentence)
            if card.equation:
                line(card.equation, "equation")
            if card.picture:
                ui.html(card.picture, sanitize=False)
            if card.chance and card.chance not in card.sentence:
                line(card.chance, "muted")
            if card.tell:
                line(f"To tell: {card.tell}", "muted")


def _switch(session: Session, name: str, is_in: bool, spoken: str) -> None:
    if is_in:
        button("Remove", lambda: session.remove(name), label=f"Remove {spoken}").mark(f"remove {name}")
    else:
        button("Add", lambda: session.add(name), lead=True, label=f"Add {spoken}").mark(f"add {name}")


def _by_hand(session: Session) -> None:
    """A term or an effect that the user types."""
    with ui.element("details").classes("small"):
        line("Add by name, or a term by hand", tag="summary")
        line("An effect of the catalogue, or an axis and a product of speeds, such as yaw:u|r|.", "muted")
        with ui.element("div").classes("row"):
            field = ui.input(label="effect or term").props("dense outlined").style("flex: 1")

            async def act() -> None:
                if name := field.value.strip():
                    await session.add(name if ":" in name else name.replace(" ", "_"))

            field.on("keydown.enter", act)
            button("Add", act, label="Add what is typed")
    others = [name for name in session.stand.names if not any(card.name == name for card in session.searched.cards)]  # type: ignore[union-attr]
    for name in others:
        if name != _OWN:
            with ui.element("article").classes("effect in"), ui.element("div").classes("head"):
                line(words(name), tag="h3")
                _switch(session, name, is_in=True, spoken=words(name))
