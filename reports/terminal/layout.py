"""Layout of every screen on the terminal: headings, bullets, and tables that fit the width."""

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from rich import box
from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.measure import Measurement
from rich.segment import Segment
from rich.table import Column, Table
from rich.text import Text

from ...physics.errors import printable, shortened

GOOD, BAD, UNSURE, FOUND, LIKELY, ASIDE = "green", "bold red", "yellow", "bold cyan", "cyan", "dim"
"""Colours by what they mean; without colours (`NO_COLOR`, a pipe) the words beside them say the same."""
_WIDEST = 1000
"""Columns in which every table stands without folding, to learn how wide it is by itself."""


class _Terminal(Console):
    """A console on which text is text: no markup, no emoji codes, and no character that a terminal obeys."""

    def render_str(self, text: str, **how: Any) -> Text:
        """Make the text of a cell printable before its width is measured."""
        return super().render_str(shortened(printable(text)), **how)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Make every piece printable, whatever it was made of; rich adds its own colours later."""
        if isinstance(renderable, Text) and printable(renderable.plain) != renderable.plain:
            how = {key: getattr(renderable, key) for key in ("style", "justify", "overflow", "no_wrap")}
            renderable = Text(printable(renderable.plain), **how)  # before it is wrapped, so that no part is cut off
        for segment in super().render(renderable, options):
            text, style, control = segment
            yield segment if control or text.isprintable() else Segment(printable(text), style, control)


def terminal() -> Console:
    """The console for all that verbs print in tables and paragraphs."""
    return _Terminal(markup=False, emoji=False)


@dataclass(frozen=True, slots=True)
class Prose:
    """Words that are wrapped where there is room, but never between a number and its percent sign, as rich would."""

    text: str
    style: str = ""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        """Wrap when the width is known; a path that is longer than a line is folded, not cut."""
        lines = textwrap.wrap(self._told, options.max_width, break_on_hyphens=False) or [""]
        yield from (Text(line, style=self.style, no_wrap=True) for line in lines)

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        """Any width will do, up to the whole text in one line."""
        return Measurement(1, max(len(self._told), 1)).with_maximum(options.max_width)

    @property
    def _told(self) -> str:
        """The text as it is shown: one paragraph, at most as long as a message."""
        return shortened(printable(self.text))


def word_columns(*titles: str) -> list[Column]:
    """Columns of names and units, each on one line."""
    return [Column(title, no_wrap=True) for title in titles]


def number_columns(*titles: str) -> list[Column]:
    """Columns of numbers, which stand at the right, each on one line."""
    return [Column(title, no_wrap=True, justify="right") for title in titles]


def text_columns(*titles: str) -> list[Column]:
    """Columns of texts, folded where there is no room."""
    return [Column(title, overflow="fold") for title in titles]


def plain_table(
    title: str, caption: str = "", columns: Sequence[Column] = (), rows: Iterable[Sequence[RenderableType]] = ()
) -> Table:
    """A table in the house's style; a row has a cell for each column."""
    table = Table(
        *columns,
        title=Text(title, style="bold") if title else None,
        caption=Text(caption, style="dim") if caption else None,
        box=box.SIMPLE_HEAD,
        padding=(0, 1),
        pad_edge=False,
        show_edge=False,
        collapse_padding=True,
        title_justify="left",
        caption_justify="left",
    )
    for row in rows:
        table.add_row(*row)
    return table


def bullets(texts: Iterable[str], style: str = "") -> Table:
    """Sentences, one below the other, wrapped and indented."""
    return _grid(1, [("-", Prose(text, style)) for text in texts])


def glossary(pairs: Iterable[tuple[str, str]]) -> Table:
    """Names with a sentence each."""
    return _grid(2, [(Text(name, style="bold"), Prose(sentence)) for name, sentence in pairs])


def _grid(gap: int, rows: Iterable[Sequence[RenderableType]]) -> Table:
    grid = Table.grid(padding=(0, gap))
    grid.add_column(no_wrap=True)
    for row in rows:
        grid.add_row(*row)
    return grid


def section(title: str, *parts: Table | Prose | None, style: str = "bold") -> Group | None:
    """A heading and what belongs under it; None where no part has a row."""
    filled = [part for part in parts if part is not None and (isinstance(part, Prose) or part.row_count)]
    return Group(Text(title, style=style), *filled) if filled else None


def stacked(parts: Iterable[RenderableType | None]) -> Group:
    """Sections below one another, a blank line between them; None is passed over."""
    filled = [part for part in parts if part is not None]
    return Group(*(part for index, each in enumerate(filled) for part in ([Text(), each] if index else [each])))


@dataclass(frozen=True, slots=True)
class Fitting:
    """The first of several tables, from full to bare, that needs no cutting or folding at the width that there is."""

    tables: Sequence[Table]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        """Choose when the width is known."""
        free = options.update(width=_WIDEST)
        widths = (console.measure(table, options=free).maximum for table in self.tables)
        fitting = (table for table, width in zip(self.tables, widths, strict=True) if width <= options.max_width)
        yield next(fitting, self.tables[-1])


def fitting(
    title: str,
    caption: str,
    columns: Sequence[Column],
    rows: Iterable[Sequence[RenderableType]],
    kept: Iterable[Sequence[int]],
) -> Fitting:
    """A table with fewer of its columns where it is narrow.

    Parameters
    ----------
    kept : places of the columns of each of the tables that are tried, from full to bare
    """
    filled = list(rows)
    some = [([columns[k].copy() for k in places], [[row[k] for k in places] for row in filled]) for places in kept]
    return Fitting([plain_table(title, caption, *one) for one in some])
