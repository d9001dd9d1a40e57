"""The first lines of a text table: its separator, decimal sign, encoding, column names, and the remarks above them."""

import codecs
import csv
import re
from dataclasses import dataclass

import numpy as np

from ...physics.motion import Array

_SEPARATORS = (",", ";", "\t")
_BLANKS = " "
"""The separator of a table whose columns are set apart by blanks, one or more."""
_MARKS = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16", codecs.BOM_UTF8: "utf-8-sig"}
"""First bytes of a text that tell its encoding; Excel's "Unicode text" is UTF-16."""
_NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)", re.IGNORECASE)
_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
_POINT = re.compile(r"[-+]?\d*\.\d+([eE][-+]?\d+)?")
_LOOKED_AT = 200
"""Rows in which a decimal comma is looked for: a column that is no whole number shows one in almost every row."""


@dataclass(frozen=True, slots=True)
class TextHeader:
    """How a text table is written.

    Attributes
    ----------
    separator : of its columns; a blank for columns set apart by blanks
    columns : their names, stripped; "column 1", "column 2" ... where the table has none; empty when it is no text
    remarks : lines before the names that begin with `#`, without that mark
    above : lines before the first row of numbers
    named : whether the table names its columns
    decimal : the decimal sign
    encoding : of the text
    """

    separator: str = ","
    columns: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    above: int = 1
    named: bool = True
    decimal: str = "."
    encoding: str = "utf-8-sig"


def read_header(content: bytes) -> TextHeader:
    """Tell how a text table is written by its first bytes; without columns where it is no text.

    Names may be quoted and hold the separator (RFC 4180, section 2.6). A table without names whose last remark has as
    many words as it has columns takes them for names: `numpy.savetxt` writes its header so.
    """
    encoding = next((name for mark, name in _MARKS.items() if content.startswith(mark)), "utf-8-sig")
    # The last character may be cut in two.
    lines = codecs.getincrementaldecoder(encoding)("replace").decode(content).splitlines()
    remarks = 0
    while remarks < len(lines) - 1 and lines[remarks].startswith("#"):
        remarks += 1
    line = lines[remarks] if lines else ""
    if "\ufffd" in line or not line.replace("\t", " ").isprintable():
        return TextHeader()
    rows = lines[remarks + 1 : remarks + 1 + _LOOKED_AT]
    separator = max(_SEPARATORS, key=lambda mark: len(_cells(line, mark)))
    if len(_cells(line, separator)) == 1 and len(line.split()) > 1:
        separator = _BLANKS
    elif separator == "," and len(line.split()) > 1 and all(map(_COMMA.fullmatch, line.split())):
        separator = _BLANKS  # numbers with a decimal comma, and blanks between them
    names = _cells(line, separator)
    told = tuple(remark.strip("# \r") for remark in lines[:remarks])
    above, named = remarks + 1, True
    if len(names) > 1 and any(names) and all(map(_NUMBER.fullmatch, filter(None, names))):
        rows, above, named = [line, *rows], remarks, False
        names = tuple(f"column {k}" for k in range(1, len(names) + 1))
        written = _cells(told[-1], separator if separator in told[-1] else _BLANKS) if told else ()
        if len(written) == len(names) and not any(map(_NUMBER.fullmatch, written)):
            names, told, named = written, told[:-1], True
    return TextHeader(separator, names, told, above, named, _decimal(rows, separator), encoding)


def first_numbers(content: bytes, header: TextHeader) -> dict[str, Array]:
    """The columns (n,) of the whole rows among the first bytes of a table, NaN where there is no number."""
    lines = codecs.getincrementaldecoder(header.encoding)("replace").decode(content).splitlines()
    rows = [_cells(line, header.separator) for line in lines[header.above : header.above + _LOOKED_AT]]
    whole = [row for row in rows if len(row) == len(header.columns)]
    return {name: np.array([_number(row[k], header.decimal) for row in whole]) for k, name in enumerate(header.columns)}


def _number(cell: str, decimal: str) -> float:
    try:
        return float(cell.replace(decimal, "."))
    except ValueError:
        return np.nan


def _cells(line: str, separator: str) -> tuple[str, ...]:
    """The cells of a line, stripped of blanks and quotes."""
    if separator == _BLANKS:
        return tuple(line.split())
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a cell of more than 131,072 letters is no name
        return (line,)
    return tuple(cell.strip().strip('"').strip() for cell in cells)


def _decimal(rows: list[str], separator: str) -> str:
    """The decimal sign of a table: a comma where numbers have one and none has a point."""
    if separator == ",":
        return "."
    cells = [cell for row in rows for cell in _cells(row, separator)]
    return "," if any(map(_COMMA.fullmatch, cells)) and not any(map(_POINT.fullmatch, cells)) else "."
