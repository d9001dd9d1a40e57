"""An ONNX file as a model: a function of velocity, heading and commands that onnxruntime runs."""

from importlib import import_module
from pathlib import Path
from typing import Any, final

import numpy as np

from ..physics.errors import RequestError
from ..physics.frames import Array
from ..physics.vehicle import Vehicle
from .foreign import FunctionModel

_TYPES = {"tensor(float)": np.float32, "tensor(double)": np.float64}


@final
class OnnxAnswer:
    """A network in an ONNX file, without memory, as `foreign.Answer`.

    It has three inputs in this order, velocity over ground (n, 3) [m/s, m/s, rad/s], heading (n,) or (n, 1) [rad], and
    commands (n, thrusters), or one with these side by side (n, 4 + thrusters); its first output is the acceleration
    over ground (n, 3) [m/s^2, m/s^2, rad/s^2].

    Raises
    ------
    RequestError
        when the session has other inputs; `name` is the model's in the message.
    """

    def __init__(self, session: Any, name: str) -> None:
        self.session = session
        found = [(each.name, each.type, len(each.shape or ())) for each in session.get_inputs()]
        if len(found) not in (1, 3) or any(kind not in _TYPES for _, kind, _ in found):
            told = ", ".join(f"{label} {kind}" for label, kind, _ in found)
            raise RequestError(
                f"model {name}: expected inputs velocity, heading and commands, or one of them side by side, as float "
                f"or double tensors, got {told}"
            )
        self._inputs = found

    def __call__(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """Acceleration over ground (n, 3)."""
        columns = [velocity, heading[:, None], commands]
        given = [np.concatenate(columns, axis=1)] if len(self._inputs) == 1 else columns
        feed = {
            label: (values[:, 0] if rank == 1 else values).astype(_TYPES[kind])
            for (label, kind, rank), values in zip(self._inputs, given, strict=True)
        }
        return np.asarray(self.session.run(None, feed)[0], dtype=float)


def onnx_model(session: Any, vehicle: Vehicle, name: str) -> FunctionModel:
    """A session of onnxruntime as a model; raises as `OnnxAnswer` does."""
    return FunctionModel(OnnxAnswer(session, name), vehicle, name, "network")


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
        raise RequestError(f"an ONNX model needs onnxruntime ({error}): pip install 'undertow[export]'") from None
    if not path.is_file():
        raise RequestError(f"model {path}: no such file")
    try:
        session = runtime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's own errors share no base class
        raise RequestError(f"model {path}: onnxruntime cannot read it: {error}") from None
    return onnx_model(session, vehicle, path.stem)
