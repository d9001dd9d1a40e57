"""ONNX graphs of the model's step and start, for any runtime: double precision, a boat a row.

Inputs and outputs bear the names of the groups of `step`. Beside it stands the graph of `derivatives`; of a network
beside physics or in its place, the step has what the network remembers among the states.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, final

import numpy as np

from ...physics.motion import Array
from ..network_operations import Built, CorrectedProgram, Vector, VectorOperations
from ..program.model_program import program_of
from ..program.symbols import Function, Group, evaluate
from .base import Export, Given, required

_OPSET, _IR = 17, 8
"""Versions of the operators and of the file: of 2022 (ONNX 1.12), which every runtime of today reads."""
_NODES = {
    **{name: name.capitalize() for name in ("add", "less", "greater", "sign", "sqrt", "cos", "sin", "where")},
    **{name: name[:3].capitalize() for name in ("subtract", "multiply", "divide", "negative", "absolute")},
    **{name: name[:3].capitalize() for name in ("minimum", "maximum", "power")},
    "less_equal": "LessOrEqual",
    "greater_equal": "GreaterOrEqual",
}
"""Names there of the operations."""
_BOATS = "boats"
"""Name of the number of rows, which is free."""


@final
class _Graph(VectorOperations):
    """Nodes as they come; a value is the name of a tensor (boats, n), or of a constant (n,), which is for all boats."""

    def __init__(self, onnx: ModuleType) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.tensors: list[Any] = []
        self.constants: dict[tuple[float, ...], str] = {}

    def node(self, kind: str, *inputs: str, outputs: Sequence[str] = (), **attributes: int) -> str:
        """One node more; the name of its first output."""
        names = list(outputs) or [f"t{len(self.nodes)}"]
        self.nodes.append(self.onnx.helper.make_node(kind, list(inputs), names, **attributes))
        return names[0]

    def tensor(self, values: Array) -> str:
        """Name of a tensor of known numbers, whole or not."""
        name = f"w{len(self.tensors)}"
        self.tensors.append(self.onnx.numpy_helper.from_array(np.ascontiguousarray(values), name))
        return name

    def number(self, *values: float) -> str:
        """Name of known numbers, the same for the same."""
        if values not in self.constants:
            self.constants[values] = self.tensor(np.array(values))
        return self.constants[values]

    def interpolated(self, x: str, xs: tuple[float, ...], ys: tuple[float, ...]) -> str:
        """Linear between points, constant beyond: the sum of what every piece contributes."""
        low, high = self.number(*xs[:-1]), self.number(*xs[1:])
        inside = self.node("Sub", self.node("Min", self.node("Max", x, low), high), low)
        return self.affine((np.diff(ys) / np.diff(xs))[None], np.array(ys[:1]), inside)

    def operations(self) -> Mapping[str, Callable[..., Any]]:
        """What a program is made of, as nodes."""

        def of(kind: str) -> Callable[..., str]:
            return lambda *operands: self.node(kind, *operands)

        beside = {"interp": self.interpolated, "constant": self.number, "table": lambda values: values}
        return {name: of(kind) for name, kind in _NODES.items()} | beside

    def constant(self, values: Array) -> Vector:
        """See `VectorOperations.constant`."""
        return self.number(*values.tolist())

    def affine(self, weight: Array, bias: Array | None, x: Vector) -> Vector:
        """See `VectorOperations.affine`."""
        product = self.node("MatMul", x, self.tensor(weight.T))
        return product if bias is None else self.add(product, self.constant(bias))

    def add(self, a: Vector, b: Vector) -> Vector:
        """See `VectorOperations.add`."""
        return self.node("Add", a, b)

    def mul(self, a: Vector, b: Vector) -> Vector:
        """See `VectorOperations.mul`."""
        return self.node("Mul", a, b)

    def tanh(self, x: Vector) -> Vector:
        """See `VectorOperations.tanh`."""
        return self.node("Tanh", x)

    def relu(self, x: Vector) -> Vector:
        """See `VectorOperations.relu`."""
        return self.node("Relu", x)

    def part(self, x: Vector, begin: int, end: int) -> Vector:
        """See `VectorOperations.part`."""
        axis = -1  # of a tensor and of a constant alike
        return self.node("Slice", x, *(self.tensor(np.array([place])) for place in (begin, end, axis)))

    def joined(self, parts: Sequence[Vector]) -> Vector:
        """See `VectorOperations.joined`."""
        return self.node("Concat", *parts, axis=1)

    def called(self, function: Function, groups: Mapping[str, Vector]) -> Vector:
        """See `VectorOperations.called`."""
        return self.worked_out(function, groups)[0]

    def worked_out(self, function: Function, groups: Mapping[str, Vector]) -> list[Vector]:
        """All groups that a function of a program gives."""
        inputs = []
        for group in function.inputs:
            parts = [f"{group.name}_{len(self.nodes)}_{k}" for k in range(len(group.members))]
            self.node("Split", groups[group.name], outputs=parts, axis=1)
            inputs += parts
        values = iter(evaluate(function, self.operations(), inputs))
        like = self.node("Shape", inputs[0])
        return [self.joined([self._of_all(next(values), like) for _ in symbols]) for _, symbols in function.outputs]

    def _of_all(self, value: str, like: str) -> str:
        """A value as a column, a constant as one of a shape."""
        return self.node("Expand", value, like) if value in self.constants.values() else value

    def file(self, name: str, told: Sequence[str], inputs: Sequence[Group], outputs: Sequence[Group]) -> bytes:
        """The graph as an ONNX file; tensors of inputs and outputs bear the names of the groups."""
        helper, kind = self.onnx.helper, self.onnx.TensorProto.DOUBLE
        ends = [
            [helper.make_tensor_value_info(g.name, kind, [_BOATS, len(g.members)], g.about) for g in groups]
            for groups in (inputs, outputs)
        ]
        made = helper.make_graph(self.nodes, name, *ends, self.tensors, doc_string="\n".join(told))
        model = helper.make_model(
            made, producer_name="undertow export", ir_version=_IR, opset_imports=[helper.make_opsetid("", _OPSET)]
        )
        self.onnx.checker.check_model(model, full_check=True)
        return model.SerializeToString()


def onnx_graph(asked: Function | Built, facts: Sequence[str]) -> bytes:
    """A function of a program, or one that is built of vectors, as an ONNX file."""
    graph = _Graph(required("onnx"))
    given = {group.name: group.name for group in asked.inputs}
    if isinstance(asked, Built):
        outputs, found = asked.outputs, asked.build(graph, given)
    else:
        outputs, found = tuple(group for group, _ in asked.outputs), graph.worked_out(asked, given)
    for group, value in zip(outputs, found, strict=True):
        graph.node("Identity", value, outputs=[group.name])
    return graph.file(asked.name, [asked.about, *facts], asked.inputs, outputs)


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    facts = given.facts.lines()
    if given.network is None:
        program = program_of(given.vehicle, given.choices.time_step)
        step, beside = program.step, {"start": program.start, "derivatives": program.derivatives}
    else:
        _, start, step = CorrectedProgram(given.network).built
        beside = {"start": start}
    others = {path.with_name(f"{path.stem}_{n}{path.suffix}"): onnx_graph(each, facts) for n, each in beside.items()}
    return {path: onnx_graph(step, facts)} | others


EXPORT = Export(
    "ONNX graphs of a step, its start and the derivatives, in double precision",
    ".onnx",
    _files,
    ("", ""),
    networks=True,
)
