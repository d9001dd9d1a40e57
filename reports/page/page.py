"""Pages of HTML, pure functions of facts: of a run, of a comparison, of several runs, and of a hull diary."""

import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from ...measurements.statistics.processors import parallel_map
from ...physics.files import at_end
from ...physics.presentation import counted, lasting, listing, unit_text, words
from ...physics.registry_members import objects_in
from .. import hull_diary
from ..hull_diary import BoatRecord, DiaryFacts
from ..run_contents import ComparisonFolder, RunFolder
from ..sureness import named, sure_caption, with_odds
from ..wording import interval, judged_rows, typeset, within
from . import chapters
from .chapters.base import Chapter, Section
from .chapters.models import TITLE, models
from .chapters.play import script_digest
from .chapters.verdict import headline
from .chapters.where_it_fails import TITLE as WHERE
from .chapters.where_it_fails import failing, motion
from .figures.fleet_figures import course, side_by_side, strip
from .figures.model_figures import growth
from .fleet import Held, Relation, SharedNumber, common_effects, shared_numbers
from .markup import NOTHING, Html, card, element, figure, folded, lines, render, style_sheet, table
from .outcome import cannot, hero

VERB = "report"
TITLE_START = "undertow: "
"""How the title of every page begins."""
WAVE = Html(
    '<svg viewBox="0 0 32 18" aria-hidden="true"><g fill="none" stroke-width="2.4" stroke-linecap="round">'
    '<path d="M2 6q5-6 10 0t10 0 8-2" stroke="var(--before)"/>'
    '<path d="M2 13q5-6 10 0t10 0 8-2" stroke="var(--after)"/></g></svg>'
)

CHAPTERS = tuple(sorted(objects_in(chapters, Chapter), key=lambda chapter: chapter.place))
"""Every `Chapter` that a file of their folder holds, from the top of the page down."""


def page(run: RunFolder) -> str:
    """The HTML text of the report."""
    name = run.nominal.name
    sections = parallel_map(lambda chapter: chapter.write(run), CHAPTERS)
    told = [(chapter, section) for chapter, section in zip(CHAPTERS, sections, strict=True) if section is not None]
    return document(name, f"what the model of {name} is missing", [_in_place(*one) for one in told], _contents(told))


def _in_place(chapter: Chapter, section: Section) -> Html:
    """A section under its title, folded where its chapter is; links to it open it."""
    if not section.title:
        return element("section", section.body, cls=section.cls) if section.cls else section.body
    title, anchor = element("h2", section.title), element("a", id=_anchor(chapter))
    if chapter.folded:
        body = element("details.folded", element("summary", title), anchor, section.body)
    else:
        body = render(anchor, title, section.body)
    return element("section", body, cls=section.cls)


def _contents(told: Sequence[tuple[Chapter, Section]]) -> Html:
    """The titles as links, at the side of the page where there is room."""
    links = []
    for chapter, section in told:
        short, to = section.title.partition(":")[0], {"href": f"#{_anchor(chapter)}"}
        links += [element("a", short, cls="detail" * chapter.folded, **to)] * bool(short)
    return element("nav.contents", *links, aria_label="contents")


def _anchor(chapter: Chapter) -> str:
    return f"chapter-{chapter.place}"


def document(title: str, subject: str, sections: Sequence[Html], contents: Html = NOTHING, *, verb: str = VERB) -> str:
    """A whole page: the style sheet in its head, the sign of undertow on top, the sections, and a mark at the end.

    A policy forbids it to load anything, and to run any script but its own.
    """
    brand = element("div.brand", WAVE, element("b", "undertow"), element("span", subject))
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src '{script_digest()}'"
    head = element(
        "head",
        Html('<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'),
        Html(f'<meta http-equiv="Content-Security-Policy" content="{policy}">'),
        element("title", f"{TITLE_START}{title}"),
        element("style", Html(style_sheet())),
    )
    body = element("body", contents, element("main", brand, *sections))
    text = "<!doctype html>\n" + render(element("html", head, body, lang="en")) + "\n"
    return at_end(verb, text.encode("utf-8")).decode("utf-8")


GROWTH = (
    "Root mean square over predictions from every half second, open loop from measured states: lower is better. A "
    "dashed line is a guess that knows nothing of the boat: a model above it is of no use at that length."
)

MOST = 3  # logs that a line names before it counts them


def comparison_page(folder: ComparisonFolder) -> str:
    """The HTML text of the page."""
    found = folder.comparison
    ends = list(dict.fromkeys([found.models[0].name, *(one.model for one in found.structure)]))
    verdict, _, why = found.best.sentence.partition(": ")
    several = len(found.logs) > 1
    logs = listing([Path(log).name for log in found.logs]) if len(found.logs) <= MOST else f"{len(found.logs)} logs"
    rows = judged_rows(found.split)
    fitted = [model.name for model in found.models if model.fitted_here]
    where = failing(found, folder.series)
    not_counted = f" Marked, because fitted to rows that are judged: {listing(fitted)}." if fitted else ""
    sections = [
        *(element("p.card warning", unit_text(text)) for text in found.warnings),
        element("h1", f"{verdict}." if why else verdict),
        *(element("p.lead", unit_text(f"{one[:1].upper()}{one[1:]}")) for one in (why, cannot(found)) if one),
        element("p.lead", f"Judged on {rows} of {logs}.{not_counted}"),
        element("h2", TITLE),
        models(found.but(best=found.best.but(sentence=""))),
        element("h2", "How the error grows"),
        figure([growth(found.models, ends)], GROWTH, cls="wide"),
        element("h2", "Measured against predicted"),
        motion(folder.series, f"of {'one of the logs' if several else logs}", found, ends[-1]),
        element("section", element("details.folded", element("summary", element("h2", WHERE)), where)),
    ]
    return document(logs, f"models compared on {logs}", sections)


def fleet_page(runs: Sequence[RunFolder], home: Path) -> str:
    """The HTML text of the page of several runs.

    Parameters
    ----------
    runs : in the order in which they are told
    home : the folder in which the page will lie, from which it points at the page of each run
    """
    names = run_names(runs)
    numbers = shared_numbers(runs, names)
    sections = [
        element("h1", _runs_verdict(numbers, len(runs))),
        element("p.lead", _runs_lead(runs, numbers)),
        *_side_by_side(numbers, names, runs),
        element("h2", "The runs"),
        card(_run_table(runs, names, home)),
        *(_run_in_short(run, name, index) for index, (run, name) in enumerate(zip(runs, names, strict=True))),
    ]
    return document("fleet", "what the models of a fleet are missing", sections)


def run_names(runs: Sequence[RunFolder]) -> list[str]:
    """The name of each run's folder, or its path where two bear one name."""
    short = [run.folder.absolute().name for run in runs]
    return [name if short.count(name) == 1 else str(run.folder) for name, run in zip(short, runs, strict=True)]


def _runs_verdict(numbers: Sequence[SharedNumber], count: int) -> str:
    """What tells the runs apart, in a sentence."""
    apart = [one.effect for one in numbers if one.relation in (Relation.DIFFERS, Relation.ONLY_HERE)]
    same = sum(one.relation is Relation.SAME for one in numbers)
    whole = "two" if count == 2 else str(count)
    if apart:
        return f"The {whole} runs differ in {listing(list(dict.fromkeys(apart)))}."
    equal = f": {counted(same, 'number')} {'is' if same == 1 else 'are'} the same"
    return f"Nothing tells the {whole} runs apart{equal if same else ', and no number is in two of them'}."


def _runs_lead(runs: Sequence[RunFolder], numbers: Sequence[SharedNumber]) -> str:
    """What all runs lack, and how many numbers stand how."""
    sure, likely = common_effects(runs)
    whole = "Both runs" if len(runs) == 2 else f"All {len(runs)} runs"
    also = f", and probably {listing(likely)}" * bool(likely)
    lack = (
        f"{whole} lack {listing(sure)}{also}." if sure else f"{whole} probably lack {listing(likely)}." * bool(likely)
    )
    counts = [(relation.value, [one.symbol for one in numbers if one.relation is relation]) for relation in Relation]
    texts = [f"{word.capitalize()}: {', '.join(symbols)}." for word, symbols in counts if symbols]
    return " ".join(filter(None, [lack, *texts]))


def _run_table(runs: Sequence[RunFolder], names: Sequence[str], home: Path) -> Html:
    rows = []
    for index, (run, name) in enumerate(zip(runs, names, strict=True)):
        led = hero(run.findings.steps, run.comparison.best.horizon)
        error = f"{typeset(led.before, 2)} \N{RIGHTWARDS ARROW} {typeset(led.after, 2)} {led.unit}"
        logs = [Path(log).name for log in run.comparison.logs]
        page = os.path.relpath((run.folder / "report.html").absolute(), home.absolute())
        here, there = element("a", name, href=f"#run-{index + 1}"), quote(Path(page).as_posix())
        found = (run.findings.verdict, lines(_missing_names(run)), lines([error, f"{led.metric}, {led.horizon} s"]))
        laws = "not run" if run.audit is None else run.audit.verdict
        rows.append((here, run.nominal.name, lines(logs), *found, laws, element("a", "its page", href=there)))
    head = ("run", "vehicle", "logs", "verdict", "missing", "error of predictions", "laws", "")
    return table(head, rows, "lllllrll")


def _missing_names(run: RunFolder) -> list[str]:
    """What a run misses, then what it probably does, with its odds."""
    likely = [f"probably {with_odds(item)}" for item in named(run.findings, "likely")]
    return [*(words(effect) for effect in run.findings.missing), *likely]


def _side_by_side(numbers: Sequence[SharedNumber], names: Sequence[str], runs: Sequence[RunFolder]) -> list[Html]:
    """The drawing and the table of all numbers that some run found."""
    title = element("h2", "Numbers side by side")
    if not numbers:
        return [title, element("p", "No run found a number that is not in its file.")]
    rows = []
    for one in numbers:
        cells = [_number_cell(held, other) for held, other in zip(one.held, one.elsewhere, strict=True)]
        name = render(element("div", element("b", one.symbol)), element("span.facts", one.effect))
        rows.append((name, one.told(names), *cells))
    head = ("number", "together", *names)
    note = (
        "Values are those of a corrected vehicle file, with 95 % intervals, so that runs with different files can be "
        "compared. Same: they scatter no more than their intervals allow; one in twenty equal numbers seems to differ. "
        "Only here: the other log was searched, would show an effect of this size, and does not. Intervals tell the "
        "scatter within one log: on another day, current and wind are others. "
    ) + f"In brackets {sure_caption(item for run in runs for item in run.findings.candidates)}."
    caption = (
        "Each number on its own scale: dot and band are value and 95 % interval in each run, a ring is the value of "
        "the file of a run that does not find it. The grey stripe is what numbers that are the same have in common."
    )
    drawings = [side_by_side(one, names) for one in numbers]
    return [
        title,
        figure(drawings, caption, cls="pair"),
        element("div.card wordy", table(head, rows, "l" * len(head)), element("p.facts", note)),
    ]


def _number_cell(held: Held | None, elsewhere: str) -> Html:
    """A number of one run: its value, its interval, and how sure its effect is."""
    if held is None:
        return element("span.facts", elsewhere)
    return render(lines([held.number.amount(), interval(held.number.ci95)]), element("span.facts", held.verdict))


def _run_in_short(run: RunFolder, name: str, index: int) -> Html:
    """A run in short: its verdict, and which of its models to trust."""
    return element(
        "section",
        element("h2", f"Run {index + 1}: {name}"),
        headline(run, title="h3"),
        element("h3", TITLE),
        models(run.comparison, run.audit, short_of=name),
        id=f"run-{index + 1}",
    )


_DIARY_VERB = "diary"
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
    boats = hull_diary.in_telling_order(diary.boats)
    sections = [
        *_diary_verdicts(diary, boats, linked=True),
        element("h2", BOATS),
        figure([strip(diary, boats)], STRIP, cls="wide"),
        element("h2", "What the boats share"),
        card(_shared_parameters(diary)),
        element("h2", "Boat by boat"),
        element("p.facts", COURSE),
        *(_boat_section(boat, diary) for boat in boats),
    ]
    return document(diary.fleet, "how the hulls of a fleet change", sections, verb=_DIARY_VERB)


def glance(diary: DiaryFacts) -> Html:
    """What stands on top of the page, for another page that does not go on with every boat."""
    boats = hull_diary.in_telling_order(diary.boats)
    drawing = element("div.scroll", strip(diary, boats))
    days = element("section.card", element("h2", BOATS), drawing, element("p.muted", STRIP))
    return render(*_diary_verdicts(diary, boats, linked=False), days)


def _diary_verdicts(diary: DiaryFacts, boats: Sequence[BoatRecord], *, linked: bool) -> list[Html]:
    """The verdict on the fleet, then what is told of each boat; those that stayed as they were folded."""
    told = [boat for boat in boats if boat.changes or boat.odd_days or hull_diary.differs_sentence(boat)]
    same = [_boat_line(boat, linked) for boat in boats if boat not in told]
    return [
        element("h1", hull_diary.verdict(diary)),
        element("p.lead", hull_diary.caution(diary)),
        *[card(*(_boat_line(boat, linked) for boat in told))] * bool(told),
        *[folded(f"{len(same)} without a change", *same)] * bool(same),
    ]


def _boat_line(boat: BoatRecord, linked: bool) -> Html:
    """What is told of a boat, a line a change, after its name, which may lead to its section."""
    name = element("b", boat.boat)
    parts: list[str] = [element("a", name, href=f"#{_boat_anchor(boat)}") if linked else name]
    for change in boat.changes:
        cls = "tag missing" if len(change.causes) == 1 else "tag possible"
        causes = element("span", hull_diary.causes_words(change), cls=cls)
        parts += [" ", causes, " ", hull_diary.change_sentence(change)]
    if not boat.changes:
        parts += [" ", hull_diary.unchanged_sentence(boat)]
    return element("p", *parts, " ", hull_diary.odd_sentence(boat), " ", hull_diary.differs_sentence(boat))


def _boat_anchor(boat: BoatRecord) -> str:
    return f"boat-{quote(boat.boat)}"


def _shared_parameters(diary: DiaryFacts) -> Html:
    rows = []
    for one in diary.parameters:
        mean, spread = one.mean, one.spread
        ends = [mean.low, mean.high]
        others = [boat.boat for boat in diary.boats for own in boat.parameters if own.name == one.name and own.differs]
        band = (typeset(spread.value, 2), interval([spread.low, spread.high]))
        name = (hull_diary.plain(one.name), unit_text(one.unit), typeset(one.nominal))
        rows.append((*name, within(mean.value, ends), interval(ends), *band, ", ".join(others) or "none"))
    head = ("parameter", "unit", "vehicle file", "mean of boats", "95 % interval", "boats scatter by", "95 % interval")
    return table((*head, "who differs"), rows, "llrrrrrl")


def _boat_section(boat: BoatRecord, diary: DiaryFacts) -> Html:
    fleet = {one.name: one for one in diary.parameters}
    drawings = [course(boat, one, fleet[one.name]) for one in boat.parameters if one.rows]
    rows = []
    for one in boat.parameters:
        ends, name = [one.own.low, one.own.high], hull_diary.plain(one.name)
        rows.append((name, unit_text(fleet[one.name].unit), within(one.own.value, ends), interval(ends)))
    logs = f"{counted(boat.logs, 'log')} on {counted(boat.days, 'day')}"
    facts = f"{logs}, {lasting(boat.hours)}, {boat.first} to {boat.last}."
    parts = (
        element("p", hull_diary.boat_sentences(boat)),
        figure(drawings, facts, cls="three"),
        element("div.card", table(("parameter", "unit", "now, by boat and fleet", "95 % interval"), rows, "llrr")),
    )
    anchor = {"id": _boat_anchor(boat)}
    if boat.changes or hull_diary.differs_sentence(boat):
        return element("section", element("h3", boat.boat), *parts, **anchor)
    return element("section", folded(boat.boat, *parts), **anchor)
