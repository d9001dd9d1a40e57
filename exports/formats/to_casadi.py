"""CasADi functions for optimal control and estimation, and C that CasADi makes of them.

Everything is a plain operation, so that derivatives of any order are exact where the model has them. Lags, delays and
the wake's memory are states.
"""

import json
import operator
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from ...physics.motion import Array
from ..network_operations import Built, CorrectedProgram, Vector, VectorOperations
from ..program.model_program import Program, program_of
from ..program.printer import identifier
from ..program.symbols import Function, evaluate
from .base import Export, Given, required

Operations = Mapping[str, Callable[..., Any]]
_NAMES = (
    {"add": "plus", "subtract": "minus", "multiply": "times", "divide": "rdivide"}
    | {"less": "lt", "less_equal": "le", "greater": "gt", "greater_equal": "ge"}
    | {"absolute": "fabs", "minimum": "fmin", "maximum": "fmax", "where": "if_else"}
    | {name: name for name in ("sign", "power", "sqrt", "cos", "sin")}
)
"""Names there of the operations, but for a sign before."""


def operations(casadi: ModuleType) -> Operations:
    """What a program is made of, on CasADi's symbols."""
    return {name: getattr(casadi, theirs) for name, theirs in _NAMES.items()} | {
        "negative": operator.neg,
        "interp": partial(_interpolated, casadi),
        "constant": casadi.SX,
        "table": lambda values: values,
    }


def _interpolated(casadi: ModuleType, x: Any, xs: tuple[float, ...], ys: tuple[float, ...]) -> Any:
    """Linear between points, constant beyond: the sum of what every piece contributes."""
    total = casadi.SX(ys[0])
    for a, b, fa, fb in zip(xs, xs[1:], ys, ys[1:], strict=False):
        if fa != fb:
            total += (fb - fa) / (b - a) * (casadi.fmin(casadi.fmax(x, a), b) - a)
    return total


def casadi_function(asked: Function) -> Any:
    """A function of a program as a `casadi.Function` of the same groups."""
    casadi = required("casadi")
    groups = [casadi.SX.sym(group.name, len(group.members)) for group in asked.inputs]
    inputs = [group[k] for group in groups for k in range(group.numel())]
    values = iter(evaluate(asked, operations(casadi), inputs))
    outputs = [casadi.vertcat(*(next(values) for _ in symbols)) for _, symbols in asked.outputs]
    names = [group.name for group in asked.inputs], [group.name for group, _ in asked.outputs]
    return casadi.Function(asked.name, groups, outputs, *names)


class _Vectors(VectorOperations):
    """Vectors as CasADi's columns; functions of the program are called, not copied."""

    def __init__(self, casadi: ModuleType, functions: Mapping[str, Any]) -> None:
        self._casadi, self._functions = casadi, functions

    def zeros(self, count: int) -> Vector:
        """See `VectorOperations.zeros`."""
        return self._casadi.DM.zeros(count)

    def affine(self, weight: Array, bias: Array | None, x: Vector) -> Vector:
        """See `VectorOperations.affine`."""
        product = self._casadi.mtimes(self._casadi.DM(weight), x)
        return product if bias is None else product + bias

    def tanh(self, x: Vector) -> Vector:
        """See `VectorOperations.tanh`."""
        return self._casadi.tanh(x)

    def relu(self, x: Vector) -> Vector:
        """See `VectorOperations.relu`."""
        return self._casadi.fmax(x, 0.0)

    def joined(self, parts: Sequence[Vector]) -> Vector:
        """See `VectorOperations.joined`."""
        return self._casadi.vertcat(*parts)

    def called(self, function: Function, groups: Mapping[str, Vector]) -> Vector:
        """See `VectorOperations.called`."""
        return self._functions[function.name](*(groups[group.name] for group in function.inputs))

    def function(self, built: Built) -> Any:
        """A `casadi.Function` of the same groups."""
        given = {group.name: self._casadi.MX.sym(group.name, len(group.members)) for group in built.inputs}
        names = [group.name for group in built.inputs], [group.name for group in built.outputs]
        return self._casadi.Function(built.name, [*given.values()], [*built.build(self, given)], *names)


def _functions(given: Given) -> tuple[Program, list[Any]]:
    """The program, and all its functions in CasADi; with a network beside it, those that it corrects."""
    if given.network is None:
        program = program_of(given.vehicle, given.choices.time_step)
        return program, [casadi_function(each) for each in program.functions]
    corrected = CorrectedProgram(given.network)
    program, seen = corrected.program, corrected.seen
    functions = {each.name: casadi_function(each) for each in (*program.functions, seen)}
    on = _Vectors(required("casadi"), functions)
    own = (program.thrust, seen) if given.network.pure else (*program.functions, seen)
    return program, [*(functions[each.name] for each in own), *(on.function(each) for each in corrected.built)]


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    casadi, name = required("casadi"), identifier(path.stem)
    program, functions = _functions(given)
    told = {
        "written_by": "undertow export",
        "facts": given.facts.lines(),
        "time_step": program.time_step,
        "command": program.thrust.inputs[0].members,
        "state": program.state,
        "functions": {each.name(): each.serialize() for each in functions},
    }
    beside = path.with_name(f"{name}_casadi.c")
    with tempfile.TemporaryDirectory() as folder:
        generator = casadi.CodeGenerator(beside.name, {"with_header": False})
        for each in functions:
            generator.add(each)
        generator.generate(f"{folder}/")
        code = (Path(folder) / beside.name).read_text("utf-8")
    facts = "\n".join(f"// {line}".rstrip() for line in ("undertow export", *given.facts.lines()))
    return {path: (json.dumps(told, indent=1) + "\n").encode(), beside: f"{facts}\n{code}".encode()}


EXPORT = Export(
    "CasADi functions, serialised in JSON, and the C that CasADi makes of them",
    ".json",
    _files,
    ("", ""),
    networks=True,
)
