"""One page for several runs: the fleet at a glance, the effects side by side, then each run in short."""

import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from ...physics.in_words import listing, unit_text, words
from ..run_contents import RunFolder
from ..sureness import named, sure_caption, with_odds
from ..wording import interval, typeset, within
from .chapters.models import TITLE, models
from .chapters.verdict import headline, hero_errors
from .figures.fleet_figure import side_by_side
from .fleet import Shared, shared_effects, told
from .markup import Html, element, figure, lines, render, table
from .page import document


def fleet_page(runs: Sequence[RunFolder], home: Path) -> str:
    """The HTML text of the page of several runs.

    Parameters
    ----------
    runs : in the order in which they are told
    home : the folder in which the page will lie, from which it points at the page of each run
    """
    names = run_names(runs)
    effects = shared_effects(runs)
    sections = [
        element("h1", _verdict(effects, len(runs))),
        element("p", *_lead(effects, names), cls="lead"),
        element("h2", "The runs"),
        element("div", _table(runs, names, home), cls="card"),
        *_effects(effects, names, runs),
        *(_short(run, name, index) for index, (run, name) in enumerate(zip(runs, names, strict=True))),
    ]
    return document("fleet", "what the models of a fleet are missing", sections)


def run_names(runs: Sequence[RunFolder]) -> list[str]:
    """The name of each run's folder, or its path where two bear one name."""
    short = [run.folder.absolute().name for run in runs]
    return [name if short.count(name) == 1 else str(run.folder) for name, run in zip(short, runs, strict=True)]


def _verdict(effects: Sequence[Shared], count: int) -> str:
    common = [effect for effect in effects if len(effect.found_in) == count]
    sure, likely = ([one.effect for one in common if one.sure is wanted] for wanted in (True, False))
    whole = "Both runs" if count == 2 else f"All {count} runs"
    if sure:
        return f"{whole} lack {listing(sure)}{f', and probably {listing(likely)}' if likely else ''}."
    if likely:
        return f"{whole} probably lack {listing(likely)}."
    if any(len(effect.found_in) > 1 for effect in effects):
        return f"No effect is missing in all {count} runs; some are shared."
    return f"The {count} runs have no missing effect in common."


def _lead(effects: Sequence[Shared], names: Sequence[str]) -> list[str]:
    """What is of some runs only, and where values disagree."""
    sentences = []
    alone = [f"{effect.effect} ({names[effect.found_in[0]]})" for effect in effects if len(effect.found_in) == 1]
    if alone:
        sentences.append(f"Of one run only: {listing(alone)}.")
    apart = [s for effect in effects for s in effect.symbols if effect.agree(s) is False]
    if apart:
        sentences.append(f"The runs disagree on the value of {listing(apart)}: their intervals do not overlap.")
    elif any(effect.agree(s) for effect in effects for s in effect.symbols):
        sentences.append("Where an effect is shared, the intervals of its values overlap.")
    return [" ".join(sentences)]


def _table(runs: Sequence[RunFolder], names: Sequence[str], home: Path) -> Html:
    rows = []
    for index, (run, name) in enumerate(zip(runs, names, strict=True)):
        before, after, horizon, metric, unit = hero_errors(run)
        logs = [Path(log).name for log in run.comparison.logs]
        page = os.path.relpath((run.folder / "report.html").absolute(), home.absolute())
        rows.append(
            (
                element("a", name, attributes={"href": f"#run-{index + 1}"}),
                run.nominal.name,
                render(*lines(logs)),
                run.findings.verdict,
                render(*lines(_names(run))),
                render(
                    *lines(
                        [
                            f"{typeset(before, 2)} \N{RIGHTWARDS ARROW} {typeset(after, 2)} {unit}",
                            f"{metric}, {horizon} s",
                        ]
                    )
                ),
                "not run" if run.audit is None else run.audit.verdict,
                element("a", "its page", attributes={"href": quote(Path(page).as_posix())}),
            )
        )
    head = ("run", "vehicle", "logs", "verdict", "missing", "error of predictions", "laws", "")
    return table(head, rows, "lllllrll")


def _names(run: RunFolder) -> list[str]:
    """What a run misses, then what it probably does, with its odds."""
    likely = [f"probably {with_odds(item)}" for item in named(run.findings, "likely")]
    return [*(words(effect) for effect in run.findings.missing), *likely]


def _effects(effects: Sequence[Shared], names: Sequence[str], runs: Sequence[RunFolder]) -> list[Html]:
    if not effects:
        return [element("h2", "Effects side by side"), element("p", "No run misses an effect.")]
    rows = []
    for effect in effects:
        cells = []
        for values, verdict, sure in zip(effect.values, effect.verdicts, effect.odds, strict=True):
            if not values:
                cells.append(element("span", verdict, cls="facts"))
                continue
            known = f"{verdict} ({sure})" if sure else verdict
            amounts = [
                f"{row.symbol} = {within(row.after, row.interval)} {unit_text(row.unit)}".rstrip() for row in values
            ]
            spans = [interval(list(row.interval)) for row in values]
            pairs = (text for pair in zip(amounts, spans, strict=True) for text in pair)
            cells.append(render(*lines(pairs), element("span", known, cls="facts")))
        rows.append((element("b", effect.effect), *cells, told(effect, names)))
    head = ("effect", *names, "found in")
    note = (
        "Values are those of the corrected vehicle, with 95 % intervals, so that runs with different vehicle files can "
        "be compared. Intervals tell the scatter within one log: two runs may differ by more on another day. Current "
        "and wind belong to the day, not to the boat. "
    ) + f"In brackets {sure_caption(item for run in runs for item in run.findings.candidates)}."
    drawings = [side_by_side(effect, names) for effect in effects if len(effect.found_in) > 1 and effect.symbols]
    caption = (
        "Coefficients that several runs share, each on its own scale: dot and band are the value and its 95 % "
        "interval, the grey stripe is what all intervals have in common. No stripe: the boats, or the days, differ."
    )
    return [
        element("h2", "Effects side by side"),
        element("div", table(head, rows, "l" * len(head)), element("p", note, cls="facts"), cls="card wordy"),
        *[figure(drawings, caption, cls="pair")] * bool(drawings),
    ]


def _short(run: RunFolder, name: str, index: int) -> Html:
    """A run in short: its verdict, and which of its models to trust."""
    return element(
        "section",
        element("h2", f"Run {index + 1}: {name}"),
        headline(run, title="h3"),
        element("h3", TITLE),
        models(run.comparison, run.audit, short_of=name),
        attributes={"id": f"run-{index + 1}"},
    )
