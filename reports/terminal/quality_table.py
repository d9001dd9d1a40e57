"""What the checks of a log's quality found, as a table: the worst first, with what follows and what to do."""

from collections.abc import Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

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
        text = Table.grid()
        text.add_row(Prose(item.told))
        if item.remedy:
            text.add_row(Prose(f"> {_remedy(item)}"))
        table.add_row(_name(item), text, end_section=True)
    return table


def _name(item: Finding) -> Text:
    return Text(f"{item.check}\n{item.verdict}", style=STYLES[item.verdict])


def _remedy(item: Finding) -> str:
    return item.cure + (" (--fix does it)" if item.fix else "")


def _caption(findings: Sequence[Finding]) -> str:
    count = sum(1 for item in findings if item.fix)
    return f"inspect LOG --fix OUT.csv writes a log with {count} of these put right" if count else ""
