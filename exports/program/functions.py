"""Functions of a program: groups of named numbers in, groups of named numbers out, and the assignments between."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .symbols import Symbol, call, item, variable


@dataclass(frozen=True, slots=True)
class Group:
    """Numbers that go in or out together.

    Attributes
    ----------
    name : of the argument
    about : what it is, with its unit
    members : names of its numbers; a group that is `single` is one number and no array
    """

    name: str
    about: str
    members: tuple[str, ...]
    single: bool = False

    @property
    def symbols(self) -> tuple[Symbol, ...]:
        """An input for each number; the name tells group and place."""
        return tuple(variable(f"{self.name}.{k}") for k in range(len(self.members)))


@dataclass(frozen=True, slots=True, eq=False)
class Function:
    """A function without branches or loops.

    Attributes
    ----------
    name, about : what it is called, and what it does
    inputs : groups of numbers, of which some may be of no use here
    outputs : groups of numbers, and what each number is
    labels : what some symbols are called in the field
    """

    name: str
    about: str
    inputs: tuple[Group, ...]
    outputs: tuple[tuple[Group, tuple[Symbol, ...]], ...]
    labels: Mapping[Symbol, str] = field(default_factory=dict)

    @property
    def results(self) -> tuple[Symbol, ...]:
        """All numbers that it gives, one after the other."""
        return tuple(symbol for _, symbols in self.outputs for symbol in symbols)

    @property
    def told(self) -> list[str]:
        """What it does, takes and gives, a line each."""
        groups = (*self.inputs, *(group for group, _ in self.outputs))
        return [self.about, *(f"{group.name}: {group.about}" for group in groups)]

    def __call__(self, **groups: Sequence[Symbol]) -> tuple[tuple[Symbol, ...], ...]:
        """Symbols of a call with symbols for each group, by group of the results; groups it lacks are passed over."""
        called = call(self, [symbol for group in self.inputs for symbol in groups[group.name]])
        found, at = [], 0
        for _, symbols in self.outputs:
            found.append(tuple(item(called, at + k) for k in range(len(symbols))))
            at += len(symbols)
        return tuple(found)

    def split(self, values: Sequence[Any]) -> list[Sequence[Any]]:
        """Values of all inputs, one after the other, by group."""
        found, at = [], 0
        for group in self.inputs:
            found.append(values[at : at + len(group.members)])
            at += len(group.members)
        return found


def function(
    name: str,
    about: str,
    inputs: Sequence[Group],
    outputs: Sequence[tuple[Group, Sequence[Symbol]]],
    labels: Mapping[Symbol, str] | None = None,
) -> Function:
    """A function of the inputs that it uses: groups of which nothing is used are left out, but for the first."""
    results = tuple((group, tuple(symbols)) for group, symbols in outputs)
    used = {
        symbol.data.partition(".")[0]
        for symbol in in_order([symbol for _, symbols in results for symbol in symbols])
        if symbol.operation == "input"
    }
    kept = tuple(group for k, group in enumerate(inputs) if not k or group.name in used)
    return Function(name, about, kept, results, labels or {})


def in_order(results: Sequence[Symbol]) -> list[Symbol]:
    """All symbols that results are made of, each after what it is made of."""
    found: dict[int, Symbol] = {}
    waiting = [(symbol, False) for symbol in reversed(results)]
    while waiting:
        symbol, ready = waiting.pop()
        if id(symbol) in found:
            continue
        if ready:
            found[id(symbol)] = symbol
            continue
        waiting.append((symbol, True))
        waiting += [(each, False) for each in reversed(symbol.operands)]
    return list(found.values())


def evaluate(asked: Function, operations: Mapping[str, Callable[..., Any]], inputs: Sequence[Any]) -> list[Any]:
    """What a function gives, worked out by somebody's operations: on arrays, or on the nodes of a graph.

    Parameters
    ----------
    operations : by name, as `symbols.OPERATIONS` has them; and `constant` of a number, `table` of numbers
    inputs : all numbers of all groups, one after the other
    """
    places = (f"{group.name}.{k}" for group in asked.inputs for k in range(len(group.members)))
    known = dict(zip(places, inputs, strict=True))
    values: dict[int, Any] = {}
    for symbol in in_order(asked.results):
        operands = [values[id(each)] for each in symbol.operands]
        if symbol.operation == "input":
            values[id(symbol)] = known[symbol.data]
        elif symbol.operation == "call":
            values[id(symbol)] = evaluate(symbol.data, operations, operands)
        elif symbol.operation == "item":
            values[id(symbol)] = operands[0][symbol.data]
        elif symbol.operation in ("constant", "table"):
            values[id(symbol)] = operations[symbol.operation](symbol.data)
        else:
            values[id(symbol)] = operations[symbol.operation](*operands)
    return [values[id(symbol)] for symbol in asked.results]
