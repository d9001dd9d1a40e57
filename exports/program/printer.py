"""Printing of a program as text: the base of all languages."""

import re
import textwrap
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain, count

from .symbols import COMPARED, INFIX, Function, Symbol, in_order

_BINDS = dict.fromkeys(COMPARED, 0) | {"add": 1, "subtract": 1, "multiply": 2, "divide": 2, "negative": 3}
"""How strongly operations bind: one that binds less stands in brackets within one that binds more."""
_ATOM = 9
"""How strongly a name, a number or a call binds: more than any operation."""
_LONGEST = 70
"""Letters of an expression that still stands within another; a longer one gets a name of its own."""
_PLAIN = ("input", "constant", "table", "item")
"""What needs no name of its own."""
_ARGUMENTS = dict.fromkeys(("sqrt", "cos", "sin", "sign", "absolute"), "({})")
_ARGUMENTS |= dict.fromkeys(("minimum", "maximum", "power"), "({}, {})")
"""What follows the name of each operation that languages spell as a call."""


def calls(form: str, **names: str) -> dict[str, str]:
    """Spelling of operations as calls of functions, see `Language.spelling`.

    Parameters
    ----------
    form : of a function's name
    names : by operation, where a function is not called as in NumPy

    Examples
    --------
    >>> calls("Math.{}", absolute="abs")["absolute"]
    'Math.abs({})'
    """
    return {name: form.format(names.get(name, name)) + given for name, given in _ARGUMENTS.items()}


class Language(ABC):
    """How a language spells functions of a program; texts have braces for what they are about.

    Attributes
    ----------
    spelling : of the operations that are no signs between or before
    infix : signs between operands
    prefix : of all names that are seen from outside
    literal : a number that is known and not negative
    item, first : an element of an array, and the place of the first
    packed, between : an array of numbers, and what stands between two
    named, several : a name for an expression, and names of more than one result
    """

    spelling: Mapping[str, str]
    infix: Mapping[str, str] = INFIX | COMPARED
    literal = "{!r}"
    item, first = "{}[{}]", 0
    packed, between = "[{}]", ", "
    named, several = "{} = {}", "[{}]"

    def __init__(self, prefix: str, functions: Sequence[Function]) -> None:
        self.prefix = prefix
        self.functions = tuple(functions)
        self._curves: dict[tuple[Symbol, ...], str] = {}
        for asked in functions:
            for symbol in in_order(asked.results):
                if symbol.operation == "interp":
                    self._curves.setdefault(symbol.operands[1:], f"{prefix}curve_{len(self._curves) + 1}")

    def pack(self, texts: Sequence[str]) -> str:
        """An array of numbers."""
        return self.packed.format(self.between.join(texts))

    def called(self, function: Function, given: Sequence[str], names: Sequence[str]) -> list[str]:
        """Lines that call a function: text of each of its inputs, and a name for each group of its results."""
        arguments = [
            texts[0] if group.single else self.pack(texts)
            for group, texts in zip(function.inputs, function.split(given), strict=True)
        ]
        found = names[0] if len(names) == 1 else self.several.format(", ".join(names))
        return [self.named.format(found, f"{function.name}({', '.join(arguments)})")]

    @abstractmethod
    def curve(self, name: str, xs: Sequence[str], ys: Sequence[str]) -> str:
        """A function that is linear between points, and constant beyond the ends, from texts of numbers."""

    @abstractmethod
    def define(self, function: Function, body: Sequence[str], results: Sequence[Sequence[str]]) -> str:
        """A whole function: lines of its body, and the text of each number of each group that it gives."""

    def text(self) -> str:
        """All curves and functions."""
        curves = (
            self.curve(name, *(list(map(self._number, points.data)) for points in both))
            for both, name in self._curves.items()
        )
        return "\n".join([*curves, *(self.define(each, *self._body(each)) for each in self.functions)])

    def _number(self, value: float) -> str:
        return "-" * (value < 0.0) + self.literal.format(abs(value))

    def _element(self, array: str, place: int) -> str:
        return self.item.format(array, place + self.first)

    def _body(self, asked: Function) -> tuple[list[str], list[list[str]]]:
        order = in_order(asked.results)
        uses = Counter([*asked.results, *(each for symbol in order for each in symbol.operands)])
        groups = {group.name: group for group in asked.inputs}
        told: dict[Symbol, tuple[str, int]] = {}
        lines: list[str] = []
        names = groups.keys() | {group.name for group, _ in asked.outputs}
        given: dict[Symbol, list[tuple[str, int]]] = {}
        for symbol in order:
            if symbol.operation == "call":
                function: Function = symbol.data
                found = [f"{group.name}_{len(given) + 1}" for group, _ in function.outputs]
                lines += self.called(function, [told[each][0] for each in symbol.operands], found)
                given[symbol] = [
                    (name, k)
                    for name, (_, results) in zip(found, function.outputs, strict=True)
                    for k in range(len(results))
                ]
                continue
            if symbol.operation == "input":
                name, _, place = symbol.data.partition(".")
                text, binds = name if groups[name].single else self._element(name, int(place)), _ATOM
            elif symbol.operation == "item":
                text, binds = self._element(*given[symbol.operands[0]][symbol.data]), _ATOM
            elif symbol.operation == "table":
                continue
            else:
                text, binds = self._expression(symbol, told)
            label = asked.labels.get(symbol)
            several = symbol.operation not in _PLAIN and (uses[symbol] > 1 or len(text) > _LONGEST)
            if label or several:
                name = _free_name(label or "", names)
                names.add(name)
                lines.append(self.named.format(name, text))
                text, binds = name, _ATOM
            told[symbol] = text, binds
        return lines, [[told[each][0] for each in results] for _, results in asked.outputs]

    def _expression(self, symbol: Symbol, told: Mapping[Symbol, tuple[str, int]]) -> tuple[str, int]:
        """Text of an operation, and how strongly it binds."""
        if symbol.operation == "constant":
            return self._number(symbol.data), _ATOM if symbol.data >= 0.0 else _BINDS["negative"]
        if symbol.operation == "interp":
            return f"{self._curves[symbol.operands[1:]]}({told[symbol.operands[0]][0]})", _ATOM
        operands = [told[each] for each in symbol.operands]
        binds = _BINDS.get(symbol.operation)
        if binds is None:
            return self.spelling[symbol.operation].format(*(text for text, _ in operands)), _ATOM
        if symbol.operation == "negative":
            return f"-{_within(operands[0], binds + 1)}", binds
        sign = self.infix[symbol.operation]
        # The right side of equal rank keeps its brackets: sums of floating-point numbers depend on their order.
        return f"{_within(operands[0], binds)} {sign} {_within(operands[1], binds + 1)}", binds


def _within(told: tuple[str, int], least: int) -> str:
    text, binds = told
    return text if binds >= least else f"({text})"


def _free_name(label: str, taken: set[str]) -> str:
    """A name that is not taken: that of the field where there is one, else with a number."""
    numbered = (f"{label or 't'}{k}" for k in count(1))
    return next(name for name in chain([label] * bool(label), numbered) if name not in taken)


def identifier(name: str) -> str:
    """A vehicle's name as programs write names: small letters, digits and underscores.

    >>> identifier("Otter USV (2 m)")
    'otter_usv_2_m'
    """
    found = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")[:40]
    return found if found[:1].isalpha() else f"boat_{found}".rstrip("_")


_WHOLE = "\N{NO-BREAK SPACE}"
"""Stands for a space within a text, at which no line ends."""


def wrapped(texts: Sequence[str], width: int = 110) -> list[str]:
    """Texts with commas between, each whole, in lines of at most a width."""
    joined = ", ".join(text.replace(" ", _WHOLE) for text in texts)
    lines = textwrap.wrap(joined, width, break_long_words=False, break_on_hyphens=False)
    return [line.replace(_WHOLE, " ") for line in lines]
