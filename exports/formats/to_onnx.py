"""An ONNX graph of the model's step, for any runtime: double precision, one boat a call.

Inputs and outputs bear the names of the groups of `step`. Beside it stands the graph of `derivatives`.
"""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...physics.errors import RequestError
from ...physics.extras import how_to_install
from ..program.functions import Function, evaluate
from ..program.model_program import program_of
from .base import Export, Given

_OPSET, _IR = 17, 8
"""Versions of the operators and of the file: of 2022 (ONNX 1.12), which every runtime of today reads."""
_NODES = {
    "add": "Add",
    "sub": "Sub",
    "mul": "Mul",
    "div": "Div",
    "neg": "Neg",
    "abs": "Abs",
    "sign": "Sign",
    "min": "Min",
    "max": "Max",
    "pow": "Pow",
    "sqrt": "Sqrt",
    "cos": "Cos",
    "sin": "Sin",
    "select": "Where",
    "lt": "Less",
    "le": "LessOrEqual",
    "gt": "Greater",
    "ge": "GreaterOrEqual",
}


def onnx_module() -> ModuleType:
    """The package onnx.

    Raises
    ------
    RequestError
        when it is not installed.
    """
    try:
        return import_module("onnx")
    except ImportError as error:
        raise RequestError(f"onnx is not installed ({error}): {how_to_install('export')}") from None


class _Graph:
    """Nodes as they come; a value is the name of a tensor of one number."""

    def __init__(self, onnx: ModuleType) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.constants: dict[tuple[float, ...], str] = {}

    def node(self, kind: str, *inputs: str, outputs: Sequence[str] = (), **attributes: int) -> str:
        """One node more; the name of its first output."""
        names = list(outputs) or [f"t{len(self.nodes)}"]
        self.nodes.append(self.onnx.helper.make_node(kind, list(inputs), names, **attributes))
        return names[0]

    def constant(self, *values: float) -> str:
        """Name of a tensor that is known."""
        return self.constants.setdefault(values, f"c{len(self.constants)}")

    def interpolated(self, x: str, xs: tuple[float, ...], ys: tuple[float, ...]) -> str:
        """Linear between points, constant beyond: the sum of what every piece contributes."""
        low, high = self.constant(*xs[:-1]), self.constant(*xs[1:])
        slopes = np.diff(ys) / np.diff(xs)
        inside = self.node("Sub", self.node("Min", self.node("Max", x, low), high), low)
        pieces = self.node("Mul", inside, self.constant(*slopes.tolist()))
        return self.node("Add", self.node("ReduceSum", pieces, keepdims=1), self.constant(ys[0]))

    def operations(self) -> Mapping[str, Callable[..., Any]]:
        """What a program is made of, as nodes."""

        def of(kind: str) -> Callable[..., str]:
            return lambda *operands: self.node(kind, *operands)

        beside = {"interp": self.interpolated, "constant": self.constant, "table": lambda values: values}
        return {name: of(kind) for name, kind in _NODES.items()} | beside


def onnx_graph(asked: Function, facts: Sequence[str]) -> bytes:
    """A function of a program as an ONNX file."""
    onnx = onnx_module()
    helper, kind = onnx.helper, onnx.TensorProto.DOUBLE
    graph, inputs = _Graph(onnx), []
    for group in asked.inputs:
        size = len(group.members)
        parts = [f"{group.name}_{k}" for k in range(size)]
        graph.node("Split", group.name, outputs=parts, axis=0)
        inputs += parts
    values = iter(evaluate(asked, graph.operations(), inputs))
    for group, symbols in asked.outputs:
        graph.node("Concat", *[next(values) for _ in symbols], outputs=[group.name], axis=0)
    told = {group.name: group.about for group in (*asked.inputs, *(group for group, _ in asked.outputs))}
    outputs = [helper.make_tensor_value_info(g.name, kind, [len(g.members)], told[g.name]) for g, _ in asked.outputs]
    made = helper.make_graph(
        graph.nodes,
        asked.name,
        [helper.make_tensor_value_info(g.name, kind, [len(g.members)], told[g.name]) for g in asked.inputs],
        outputs,
        [helper.make_tensor(name, kind, [len(x)], x) for x, name in graph.constants.items()],
        doc_string="\n".join([asked.about, *facts]),
    )
    model = helper.make_model(
        made, producer_name="undertow export", ir_version=_IR, opset_imports=[helper.make_opsetid("", _OPSET)]
    )
    onnx.checker.check_model(model, full_check=True)
    return model.SerializeToString()


def _files(given: Given, path: Path) -> Mapping[Path, bytes]:
    program, facts = program_of(given.vehicle, given.choices.time_step), given.facts.lines()
    beside = {
        path.with_name(f"{path.stem}_{function.name}{path.suffix}"): onnx_graph(function, facts)
        for function in (program.start, program.derivatives)
    }
    return {path: onnx_graph(program.step, facts)} | beside


EXPORT = Export("ONNX graphs of a step, its start and the derivatives, in double precision", ".onnx", _files, ("", ""))
