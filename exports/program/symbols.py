"""Symbols in the place of numbers, and the functions of a program that they make.

NumPy hands its functions to an operand that asks for it (NEP 13 and NEP 18), so `ForceEquation`, `Thruster` and
`runge_kutta` run as they are, and the program is what they did; zeros and ones leave nothing behind.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count, islice
from typing import Any, final
from weakref import WeakValueDictionary

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from ...physics.motion import Array

INFIX = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
COMPARED = {"less": "<", "less_equal": "<=", "greater": ">", "greater_equal": ">="}
OPERATIONS = (*INFIX, *COMPARED, "negative", "absolute", "sign", "minimum", "maximum", "power", "sqrt", "cos", "sin")
"""Every operation on numbers, by its name in NumPy; beside them are `where`, and `interp`, which takes two tables."""


@final
class Symbol(NDArrayOperatorsMixin):
    """A number that is not known yet: an operation on others, an input, or a constant. Equal ones are one object.

    Attributes
    ----------
    operation : one of `OPERATIONS`, `where` or `interp`, or `input`, `constant`, `table`, `call` of a function and
        `item` of what it gives
    operands : what it acts on
    data : name of an input, value of a constant, numbers of a table, the function that is called, or place of an item
    """

    __slots__ = ("__weakref__", "data", "operands", "operation")
    operation: str
    operands: tuple["Symbol", ...]
    data: Any

    __hash__ = object.__hash__  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:  # type: ignore[override]
        return self is other

    def __bool__(self) -> bool:
        raise TypeError(f"a program cannot branch on a value ({self}); np.where chooses between two")

    def __repr__(self) -> str:
        inside = ", ".join(map(repr, self.operands)) if self.operands else repr(self.data)
        return f"{self.operation}({inside})"

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Any:
        """Write an operation of NumPy down, of single symbols or, one by one, of arrays that hold some."""
        if method != "__call__" or ufunc.__name__ not in OPERATIONS or not set(kwargs) <= {"out", "where"}:
            return NotImplemented
        if any(isinstance(each, np.ndarray) and each.ndim for each in inputs):
            spread = np.broadcast(*(np.asarray(each, dtype=object) for each in inputs))
            return np.array([ufunc(*each) for each in spread], dtype=object).reshape(spread.shape)
        done = operation(ufunc.__name__, *inputs)
        where = kwargs.get("where", True)
        return done if where is True else operation("where", where, done, kwargs["out"][0])

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        """Write a function of NumPy down."""
        return _FUNCTIONS[func](*args, **kwargs) if func in _FUNCTIONS else NotImplemented


_KNOWN: "WeakValueDictionary[tuple[Any, ...], Symbol]" = WeakValueDictionary()


def _symbol(name: str, operands: tuple[Symbol, ...] = (), data: Any = None) -> Symbol:
    key = (name, tuple(map(id, operands)), data if not isinstance(data, float) else (data, math.copysign(1.0, data)))
    result = _KNOWN.get(key)
    if result is None:
        result = Symbol()
        result.operation, result.operands, result.data = name, operands, data
        _KNOWN[key] = result
    return result


def constant(value: float) -> Symbol:
    """A number that is known."""
    return _symbol("constant", data=float(value))


def variable(name: str) -> Symbol:
    """An input."""
    return _symbol("input", data=name)


def table(values: Sequence[float] | Array) -> Symbol:
    """Numbers that are known, in a row."""
    return _symbol("table", data=tuple(float(value) for value in values))


def symbolic(value: Any) -> Symbol:
    """A symbol as it is, anything else as a constant."""
    return value if isinstance(value, Symbol) else constant(float(value))


def operation(name: str, *given: Any) -> Symbol:
    """An operation on symbols or numbers; what can be worked out or left out is."""
    operands = tuple(map(symbolic, given))
    if all(each.operation in ("constant", "table") for each in operands):
        return constant(getattr(np, name)(*(each.data for each in operands)))
    simpler = _SIMPLER.get(name)
    found = simpler(*operands) if simpler else None
    return _symbol(name, operands) if found is None else found


def is_known(symbol: Symbol, value: float) -> bool:
    """True when a symbol is a certain constant."""
    return symbol.operation == "constant" and symbol.data == value


def _add(a: Symbol, b: Symbol) -> Symbol | None:
    if is_known(a, 0.0) or is_known(b, 0.0):
        return b if is_known(a, 0.0) else a
    return operation("subtract", a, b.operands[0]) if b.operation == "negative" else None


def _sub(a: Symbol, b: Symbol) -> Symbol | None:
    if is_known(b, 0.0):
        return a
    if is_known(a, 0.0):
        return operation("negative", b)
    return operation("add", a, b.operands[0]) if b.operation == "negative" else None


def _mul(a: Symbol, b: Symbol) -> Symbol | None:
    for one, other in ((a, b), (b, a)):
        if is_known(one, 0.0):
            return constant(0.0)
        if is_known(one, 1.0):
            return other
        if is_known(one, -1.0):
            return operation("negative", other)
        if one.operation in COMPARED:
            return operation("where", one, other, 0.0)
        if one.operation == "negative":
            return operation("negative", operation("multiply", one.operands[0], other))
        if one.operation == "constant" and one.data < 0.0:
            return operation("negative", operation("multiply", -one.data, other))
    return None


def _div(a: Symbol, b: Symbol) -> Symbol | None:
    if is_known(a, 0.0):
        return a
    return a if is_known(b, 1.0) else None


def _neg(a: Symbol) -> Symbol | None:
    return a.operands[0] if a.operation == "negative" else None


def _abs(a: Symbol) -> Symbol | None:
    return operation("absolute", a.operands[0]) if a.operation == "negative" else None


def _pow(a: Symbol, b: Symbol) -> Symbol | None:
    if is_known(b, 1.0):
        return a
    if is_known(b, 2.0):
        return operation("multiply", a, a)
    return operation("sqrt", a) if is_known(b, 0.5) else None


def _select(chosen: Symbol, a: Symbol, b: Symbol) -> Symbol | None:
    if chosen.operation == "constant":
        return a if chosen.data else b
    return a if a is b else None


_SIMPLER: dict[str, Callable[..., Symbol | None]] = {
    "add": _add,
    "subtract": _sub,
    "multiply": _mul,
    "divide": _div,
    "negative": _neg,
    "absolute": _abs,
    "power": _pow,
    "where": _select,
}


def _clip(value: Any, low: Any, high: Any) -> Symbol:
    found = symbolic(value) if low == -np.inf else operation("maximum", value, low)
    return found if high == np.inf else operation("minimum", found, high)


_FUNCTIONS: dict[Any, Callable[..., Symbol]] = {
    np.where: lambda chosen, a, b: operation("where", chosen, a, b),
    np.clip: _clip,
    np.interp: lambda x, xs, ys: operation("interp", x, table(xs), table(ys)),
    np.zeros_like: lambda like: constant(0.0),
    np.full_like: lambda like, value: constant(value),
}


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
    def symbols(self) -> tuple[Any, ...]:
        """A `Symbol` of an input for each number, which stands where numbers do; its name tells group and place."""
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
    def description(self) -> list[str]:
        """What it does, takes and gives, a line each."""
        groups = (*self.inputs, *(group for group, _ in self.outputs))
        return [self.about, *(f"{group.name}: {group.about}" for group in groups)]

    def __call__(self, **groups: Sequence[Any]) -> tuple[tuple[Symbol, ...], ...]:
        """Symbols of a call with symbols or numbers by group, in groups of the results; groups it lacks are left."""
        called = _symbol("call", tuple(symbolic(x) for group in self.inputs for x in groups[group.name]), self)
        items = (_symbol("item", (called,), place) for place in count())
        return tuple(tuple(islice(items, len(symbols))) for _, symbols in self.outputs)

    def split(self, values: Sequence[Any]) -> list[list[Any]]:
        """Values of all inputs, one after the other, by group."""
        remaining = iter(values)
        return [list(islice(remaining, len(group.members))) for group in self.inputs]


def function(
    name: str,
    about: str,
    inputs: Sequence[Group],
    outputs: Sequence[tuple[Group, Sequence[Any]]],
    labels: Mapping[Symbol, str] | None = None,
) -> Function:
    """A function of the inputs that it uses: groups of which nothing is used are left out, but for the first."""
    results = tuple((group, tuple(map(symbolic, values))) for group, values in outputs)
    used = set(in_order([symbol for _, symbols in results for symbol in symbols]))
    kept = tuple(group for k, group in enumerate(inputs) if not k or used.intersection(group.symbols))
    return Function(name, about, kept, results, labels or {})


def in_order(results: Sequence[Symbol]) -> list[Symbol]:
    """All symbols that results are made of, each after what it is made of."""
    found: dict[Symbol, None] = {}
    waiting = [(symbol, False) for symbol in reversed(results)]
    while waiting:
        symbol, ready = waiting.pop()
        if ready:
            found[symbol] = None
        elif symbol not in found:
            waiting.append((symbol, True))
            waiting += [(each, False) for each in reversed(symbol.operands)]
    return list(found)


def evaluate(asked: Function, operations: Mapping[str, Callable[..., Any]], inputs: Sequence[Any]) -> list[Any]:
    """What a function gives, worked out by somebody's operations: on arrays, or on the nodes of a graph.

    Parameters
    ----------
    operations : by their names in NumPy; and `constant` of a number, `table` of numbers
    inputs : all numbers of all groups, one after the other
    """
    known = (symbol for group in asked.inputs for symbol in group.symbols)
    values: dict[Symbol, Any] = dict(zip(known, inputs, strict=True))
    for symbol in in_order(asked.results):
        operands = [values[each] for each in symbol.operands]
        if symbol.operation == "call":
            values[symbol] = evaluate(symbol.data, operations, operands)
        elif symbol.operation == "item":
            values[symbol] = operands[0][symbol.data]
        elif symbol.operation in ("constant", "table"):
            values[symbol] = operations[symbol.operation](symbol.data)
        elif symbol.operation != "input":
            values[symbol] = operations[symbol.operation](*operands)
    return [values[symbol] for symbol in asked.results]
