"""What the checks of a log's quality found, as a table: the worst first, with what follows and what to do."""

from collections.abc import Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ...measurements.canonical import is_canonical
from ...measurements.quality.finding import Finding
from .layout import ASIDE, BAD, GOOD, UNSURE, Prose, bullets, plain_table, section

STYLES = {"defect": BAD, "warning": UNSURE, "note": "cyan", "cannot tell": ASIDE, "ok": GOOD}
_TABLED = ("defect", "warning", "note")


def quality_parts(findings: Sequence[Finding]) -> list[RenderableType]:
    """Findings as sections: a table, what cannot be told, and what is fine."""
    tabled = [item for verdict in _TABLED for item in findings if item.verdict == verdict]
    parts: list[RenderableType] = []
    if tabled:
        parts.append(_table(tabled))
    for verdict, title, style in (("cannot tell", "Cannot be told", ASIDE), ("ok", "Checked and sound", "")):
        told = [f"{item.check}: {item.sentence}" for item in findings if item.verdict == verdict]
        if told:
            parts.append(section(title, bullets(told, style)))
    return parts


def style_of(findings: Sequence[Finding]) -> str:
    """The style of the worst finding."""
    verdicts = {item.verdict for item in findings}
    return next((STYLES[verdict] for verdict in _TABLED[:2] if verdict in verdicts), STYLES["ok"])


def _table(findings: Sequence[Finding]) -> Table:
    table = plain_table("Quality", _caption(findings))
    table.add_column("check", no_wrap=True)
    table.add_column("what was found, what follows, and what to do")
    for item in findings:
        lines = [_capital(item.sentence) + "."]
        if item.consequence:
            lines.append(_capital(item.consequence) + ".")
        text = Table.grid()
        text.add_row(Prose(" ".join(lines)))
        if item.remedy:
            text.add_row(Prose(f"> {_remedy(item)}"))
        table.add_row(_name(item), text, end_section=True)
    return table


def _name(item: Finding) -> Text:
    return Text(f"{item.check}\n{item.verdict}", style=STYLES[item.verdict])


def _remedy(item: Finding) -> str:
    return _capital(item.remedy) + (" (--fix does it)" if item.fix else "")


def _caption(findings: Sequence[Finding]) -> str:
    count = sum(1 for item in findings if item.fix)
    return f"inspect LOG --fix OUT.csv writes a log with {count} of these put right" if count else ""


def _capital(text: str) -> str:
    """Text with a capital letter, but not where it opens with the name of a channel.

    Examples
    --------
    >>> _capital("the gyro is late"), _capital("r is in degrees"), _capital("RCOU.C1 is reversed")
    ('The gyro is late', 'r is in degrees', 'RCOU.C1 is reversed')
    """
    word = text.split(" ")[0]
    return text if is_canonical(word) or not word.islower() else text[:1].upper() + text[1:]
