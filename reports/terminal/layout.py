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


def plain_table(title: str, caption: str = "", columns: Sequence[Column] = ()) -> Table:
    """An empty table in the house's style."""
    return Table(
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


def bullets(texts: Sequence[str], style: str = "") -> Table:
    """Sentences, one below the other, wrapped and indented."""
    grid = Table.grid(padding=(0, 1))
    grid.add_column(no_wrap=True)
    for text in texts:
        grid.add_row("-", Prose(text, style))
    return grid


def glossary(pairs: Sequence[tuple[str, str]]) -> Table:
    """Names with a sentence each."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    for name, sentence in pairs:
        grid.add_row(Text(name, style="bold"), Prose(sentence))
    return grid


def section(title: str, *parts: RenderableType, style: str = "bold") -> Group:
    """A heading and what belongs under it."""
    return Group(Text(title, style=style), *parts)


def stacked(parts: Sequence[RenderableType]) -> Group:
    """Sections below one another, a blank line between them."""
    return Group(*(part for index, each in enumerate(parts) for part in ([Text(), each] if index else [each])))


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
