"""An ONNX file as a model: a function of velocity, heading and commands that onnxruntime runs."""

from importlib import import_module
from pathlib import Path
from typing import Any, final

import numpy as np

from ...physics.errors import RequestError
from ...physics.extras import how_to_install
from ...physics.frames import Array
from ...physics.vehicle import Vehicle
from .foreign import FunctionModel

_TYPES = {"tensor(float)": np.float32, "tensor(double)": np.float64}


_NAMES = ("velocity", "heading", "commands")


@final
class OnnxAnswer:
    """A network in an ONNX file, without memory, as `foreign.Answer`.

    Its inputs are any of velocity over ground (n, 3) [m/s, m/s, rad/s], heading (n,) or (n, 1) [rad], and commands
    (n, thrusters): an export drops what a network does not use. They are told apart by their names; by their widths,
    where they bear others; all three may have any names, in this order. Or one input holds them side by side,
    (n, 4 + thrusters), or (n, 3 + thrusters) without the heading. The first output is the acceleration over ground
    (n, 3) [m/s^2, m/s^2, rad/s^2].

    Parameters
    ----------
    thrusters : how many commands there are
    name : the model's, in messages

    Raises
    ------
    RequestError
        when the session has other inputs.
    """

    def __init__(self, session: Any, name: str, thrusters: int) -> None:
        self.session = session
        found = [(each.name, each.type, list(each.shape or ())) for each in session.get_inputs()]
        parts = _told_apart([(label, shape) for label, _, shape in found], thrusters)
        if parts is None or any(kind not in _TYPES for _, kind, _ in found):
            told = ", ".join(f"{label} {kind} {tuple(shape)}" for label, kind, shape in found)
            raise RequestError(
                f"model {name}: expected some of the inputs velocity (n, 3), heading (n,) and commands "
                f"(n, {thrusters}), or one of them side by side (n, {4 + thrusters}), as float or double "
                f"tensors, got {told or 'none'}; "
                "export it with input_names=['velocity', 'heading', 'commands']"
            )
        self._inputs = [
            (label, kind, len(shape), part) for (label, kind, shape), part in zip(found, parts, strict=True)
        ]

    def __call__(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """Acceleration over ground (n, 3)."""
        columns = {"velocity": velocity, "heading": heading[:, None], "commands": commands}
        feed = {}
        for label, kind, rank, part in self._inputs:
            values = np.concatenate([columns[p] for p in part], axis=1)
            feed[label] = (values[:, 0] if rank == 1 else values).astype(_TYPES[kind])
        return np.asarray(self.session.run(None, feed)[0], dtype=float)


def _told_apart(inputs: list[tuple[str, list[Any]]], thrusters: int) -> list[tuple[str, ...]] | None:
    """What each input of a name and shape holds; None where that cannot be told."""
    names = [label.lower() for label, _ in inputs]
    if set(names) <= set(_NAMES) and len(set(names)) == len(names) > 0:
        widths = [_width(shape) for _, shape in inputs]
        alone = len(inputs) == 1 and widths[0] not in (3, None)  # one may hold all, whatever it is called
        if not alone or names[0] != "velocity":
            return [(label,) for label in names]
    if len(inputs) == len(_NAMES):
        return [(label,) for label in _NAMES]
    by_width: dict[int | None, tuple[str, ...]] = {3: ("velocity",)}
    if thrusters not in (1, 3):
        by_width |= {1: ("heading",), thrusters: ("commands",)}
    if len(inputs) == 1:
        by_width |= {4 + thrusters: _NAMES, 3 + thrusters: ("velocity", "commands"), None: _NAMES}
    found = [by_width.get(_width(shape)) for _, shape in inputs]
    if not found or len(set(found)) < len(found):
        return None
    return [part for part in found if part is not None] if None not in found else None


def _width(shape: list[Any]) -> int | None:
    """Length of the second side, 1 where there is none, None where the file leaves it open."""
    if len(shape) < 2:
        return 1
    return shape[1] if isinstance(shape[1], int) else None


def onnx_model(session: Any, vehicle: Vehicle, name: str) -> FunctionModel:
    """A session of onnxruntime as a model; raises as `OnnxAnswer` does."""
    return FunctionModel(OnnxAnswer(session, name, len(vehicle.thrusters)), vehicle, name, "network")


def load_onnx(path: Path, vehicle: Vehicle) -> FunctionModel:
    """Read an ONNX file.

    Raises
    ------
    RequestError
        when onnxruntime is missing, or the file is not ONNX.
    """
    try:
        runtime = import_module("onnxruntime")
    except ImportError as error:
        raise RequestError(f"an ONNX model needs onnxruntime ({error}): {how_to_install('export')}") from None
    if not path.is_file():
        raise RequestError(f"model {path}: no such file")
    try:
        session = runtime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's own errors share no base class
        raise RequestError(f"model {path}: onnxruntime cannot read it: {error}") from None
    return onnx_model(session, vehicle, path.stem)
