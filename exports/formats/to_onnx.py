"""ONNX graphs of the model's step and start, for any runtime: double precision, a boat a row.

Inputs and outputs bear the names of the groups of `step`. Beside it stands the graph of `derivatives`; of a network
beside physics or in its place, the step has what the network remembers among the states.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, final

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

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
class _Tensor(NDArrayOperatorsMixin):
    """A value of a graph, (boats, n), or a known one (n,), which is for all boats; what acts on it becomes a node."""

    def __init__(self, graph: "_Graph", name: str, known: bool = False) -> None:
        self.graph, self.name, self.known = graph, name, known

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any) -> "_Tensor":
        """The node of a function of NumPy."""
        return self.graph.node(_NODES[ufunc.__name__], *inputs)

    def __getitem__(self, part: slice) -> "_Tensor":
        """Some of the n elements; the last axis is that of a tensor and of known numbers alike."""
        places = (np.array([place]) for place in (part.start, part.stop, -1))
        return self.graph.node("Slice", self, *map(self.graph.tensor, places))


@final
class _Graph(VectorOperations):
    """Nodes as they come."""

    def __init__(self, onnx: ModuleType) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.tensors: list[Any] = []
        self._numbers: dict[tuple[float, ...], _Tensor] = {}

    def node(self, kind: str, *inputs: Any, outputs: Sequence[str] = (), **attributes: int) -> _Tensor:
        """Add a node on tensors or numbers; its first output."""
        given = [each if isinstance(each, _Tensor) else self.number(*np.ravel(each).tolist()) for each in inputs]
        names = list(outputs) or [f"t{len(self.nodes)}"]
        made = self.onnx.helper.make_node(kind, [each.name for each in given], names, **attributes)
        self.nodes.append(made)
        return _Tensor(self, names[0])

    def tensor(self, values: Array) -> _Tensor:
        """Known numbers, whole or not."""
        name = f"w{len(self.tensors)}"
        self.tensors.append(self.onnx.numpy_helper.from_array(np.ascontiguousarray(values), name))
        return _Tensor(self, name, known=True)

    def number(self, *values: float) -> _Tensor:
        """Known numbers in a row, the same for the same."""
        if values not in self._numbers:
            self._numbers[values] = self.tensor(np.array(values))
        return self._numbers[values]

    def interpolated(self, x: _Tensor, xs: tuple[float, ...], ys: tuple[float, ...]) -> _Tensor:
        """Linear between points, constant beyond: the sum of what every piece contributes."""
        low, high = np.array(xs[:-1]), np.array(xs[1:])
        inside = self.node("Min", self.node("Max", x, low), high) - low
        return self.affine((np.diff(ys) / np.diff(xs))[None], np.array(ys[:1]), inside)

    def zeros(self, count: int) -> _Tensor:
        """See `VectorOperations.zeros`."""
        return self.number(*[0.0] * count)

    def affine(self, weight: Array, bias: Array | None, x: Vector) -> _Tensor:
        """See `VectorOperations.affine`."""
        product = self.node("MatMul", x, self.tensor(weight.T))
        return product if bias is None else product + bias

    def tanh(self, x: Vector) -> _Tensor:
        """See `VectorOperations.tanh`."""
        return self.node("Tanh", x)

    def relu(self, x: Vector) -> _Tensor:
        """See `VectorOperations.relu`."""
        return self.node("Relu", x)

    def joined(self, parts: Sequence[Vector]) -> _Tensor:
        """See `VectorOperations.joined`."""
        return self.node("Concat", *parts, axis=1)

    def called(self, function: Function, groups: Mapping[str, Vector]) -> _Tensor:
        """See `VectorOperations.called`."""
        return self.worked_out(function, groups)[0]

    def worked_out(self, function: Function, groups: Mapping[str, Vector]) -> list[_Tensor]:
        """All groups that a function of a program gives."""
        inputs: list[_Tensor] = []
        for group in function.inputs:
            parts = [f"{group.name}_{len(self.nodes)}_{k}" for k in range(len(group.members))]
            self.node("Split", groups[group.name], outputs=parts, axis=1)
            inputs += [_Tensor(self, part) for part in parts]
        operations = {name: partial(self.node, kind) for name, kind in _NODES.items()}
        known = {"interp": self.interpolated, "constant": self.number, "table": lambda values: values}
        values = iter(evaluate(function, operations | known, inputs))
        like = self.node("Shape", inputs[0])

        def column(value: _Tensor) -> _Tensor:
            return self.node("Expand", value, like) if value.known else value

        return [self.joined([column(next(values)) for _ in symbols]) for _, symbols in function.outputs]

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
    given = {group.name: _Tensor(graph, group.name) for group in asked.inputs}
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
