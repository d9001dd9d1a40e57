"""The page of a hull diary: a sentence a boat, all boats over their days, then each boat by parameter."""

from collections.abc import Callable, Sequence
from urllib.parse import quote

from ...physics.in_words import counted, lasting, unit_text
from ..diary_facts import BoatRecord, DiaryFacts
from ..diary_words import (
    boat_sentences,
    causes_words,
    caution,
    change_sentence,
    differs_sentence,
    first_told,
    odd_sentence,
    plain,
    unchanged_sentence,
    verdict,
)
from ..wording import interval, typeset, within
from .figures.diary_figures import course, strip
from .markup import Html, element, figure, folded, render, table
from .page import document

VERB = "diary"
BOATS = "All boats over their days"
STRIP = (
    "A line a boat, a tick for each day with a log. A bar begins with a change, with the days on which it may have "
    "begun as a thin line; the dot is the day on which the logs told it. Its name and size stand beside it where there "
    "is room. A ring is a single odd day."
)
COURSE = (
    "Dots are days, lines their 95 % intervals with the scatter of days; the grey band holds the boats of this fleet, "
    "the orange line is a change, with the days on which it may have begun. Values now are those since the last "
    "change; of a hull that still changes, those of its last week."
)


def diary_page(diary: DiaryFacts) -> str:
    """The HTML text of the page."""
    boats = first_told(diary.boats)
    sections = [
        *_verdicts(diary, boats, _linked),
        element("h2", BOATS),
        figure([strip(diary, boats)], STRIP, cls="wide"),
        element("h2", "What the boats share"),
        element("div", _shared(diary), cls="card"),
        element("h2", "Boat by boat"),
        element("p", COURSE, cls="facts"),
        *(_boat(boat, diary) for boat in boats),
    ]
    return document(diary.fleet, "how the hulls of a fleet change", sections, verb=VERB)


def glance(diary: DiaryFacts) -> Html:
    """What stands on top of the page, for another page that does not go on with every boat."""
    boats = first_told(diary.boats)
    drawing = element("div", strip(diary, boats), cls="scroll")
    days = element("section", element("h2", BOATS), drawing, element("p", STRIP, cls="muted"), cls="card")
    return render(*_verdicts(diary, boats, _named), days)


def _verdicts(diary: DiaryFacts, boats: Sequence[BoatRecord], name: Callable[[BoatRecord], Html]) -> list[Html]:
    """The verdict on the fleet, then what is told of each boat; those that stayed as they were folded."""
    told = [boat for boat in boats if boat.changes or boat.odd_days or differs_sentence(boat)]
    same = [_sentence(boat, name) for boat in boats if boat not in told]
    return [
        element("h1", verdict(diary)),
        element("p", caution(diary), cls="lead"),
        *[element("div", *(_sentence(boat, name) for boat in told), cls="card")] * bool(told),
        *[folded(f"{len(same)} without a change", *same)] * bool(same),
    ]


def _named(boat: BoatRecord) -> Html:
    return element("b", boat.boat)


def _linked(boat: BoatRecord) -> Html:
    return element("a", _named(boat), attributes={"href": f"#{_anchor(boat)}"})


def _sentence(boat: BoatRecord, name: Callable[[BoatRecord], Html]) -> Html:
    """What is told of a boat, a line a change, after its name."""
    parts: list[str] = [name(boat)]
    for change in boat.changes:
        cls = "tag missing" if len(change.causes) == 1 else "tag possible"
        parts += [" ", element("span", causes_words(change), cls=cls), " ", change_sentence(change)]
    if not boat.changes:
        parts += [" ", unchanged_sentence(boat)]
    return element("p", *parts, " ", odd_sentence(boat), " ", differs_sentence(boat))


def _anchor(boat: BoatRecord) -> str:
    return f"boat-{quote(boat.boat)}"


def _shared(diary: DiaryFacts) -> Html:
    rows = []
    for one in diary.parameters:
        mean, spread = one.mean, one.spread
        ends = [mean.low, mean.high]
        others = [boat.boat for boat in diary.boats for own in boat.parameters if own.name == one.name and own.differs]
        rows.append(
            (
                plain(one.name),
                unit_text(one.unit),
                typeset(one.nominal),
                within(mean.value, ends),
                interval(ends),
                typeset(spread.value, 2),
                interval([spread.low, spread.high]),
                ", ".join(others) or "none",
            )
        )
    head = ("parameter", "unit", "vehicle file", "mean of boats", "95 % interval", "boats scatter by", "95 % interval")
    return table((*head, "who differs"), rows, "llrrrrrl")


def _boat(boat: BoatRecord, diary: DiaryFacts) -> Html:
    fleet = {one.name: one for one in diary.parameters}
    drawings = [course(boat, one, fleet[one.name]) for one in boat.parameters if one.rows]
    rows = []
    for one in boat.parameters:
        ends = [one.own.low, one.own.high]
        rows.append((plain(one.name), unit_text(fleet[one.name].unit), within(one.own.value, ends), interval(ends)))
    logs = f"{counted(boat.logs, 'log')} on {counted(boat.days, 'day')}"
    facts = f"{logs}, {lasting(boat.hours)}, {boat.first} to {boat.last}."
    parts = (
        element("p", boat_sentences(boat)),
        figure(drawings, facts, cls="three"),
        element(
            "div", table(("parameter", "unit", "now, by boat and fleet", "95 % interval"), rows, "llrr"), cls="card"
        ),
    )
    anchor = {"id": _anchor(boat)}
    if boat.changes or differs_sentence(boat):
        return element("section", element("h3", boat.boat), *parts, attributes=anchor)
    return element("section", folded(boat.boat, *parts), attributes=anchor)
