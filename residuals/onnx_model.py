"""An ONNX file as a model: accelerations from velocity, heading and commands, run by onnxruntime."""

from importlib import import_module
from pathlib import Path
from typing import Any, final

import numpy as np

from ..physics.errors import RequestError
from ..physics.frames import Array
from ..physics.motion import Motion
from ..physics.simulation import Rollouts
from ..physics.vehicle import Vehicle
from .foreign import checked_shape, open_loop
from .models import Kind, Model

_TYPES = {"tensor(float)": np.float32, "tensor(double)": np.float64}


@final
class OnnxModel(Model):
    """A network in an ONNX file, without memory.

    It has three inputs in this order, velocity over ground (n, 3), heading (n,) or (n, 1), and commands (n, thrusters),
    or one with these side by side (n, 4 + thrusters); its first output is the acceleration over ground (n, 3).
    """

    def __init__(self, session: Any, vehicle: Vehicle, name: str) -> None:
        self.session = session
        self.vehicle = vehicle
        self.name = name
        self.kind: Kind = "network"
        self.parameters = 0
        self.seconds_to_fit = 0.0
        found = [(each.name, each.type, len(each.shape or ())) for each in session.get_inputs()]
        if len(found) not in (1, 3) or any(kind not in _TYPES for _, kind, _ in found):
            told = ", ".join(f"{label} {kind}" for label, kind, _ in found)
            raise RequestError(
                f"model {name}: expected inputs velocity, heading and commands, or one of them side by side, as float "
                f"or double tensors, got {told}"
            )
        self._inputs = found

    def acceleration(self, motion: Motion) -> Array:
        """See `Model.acceleration`."""
        return self.settled(motion.velocity, motion.heading, motion.commands)

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """See `Model.rollout`."""
        return open_loop(self.settled, motion, starts, steps)

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`.

        Raises
        ------
        RequestError
            when onnxruntime refuses the inputs, or the output has another shape.
        """
        columns = [velocity, heading[:, None], commands]
        given = [np.concatenate(columns, axis=1)] if len(self._inputs) == 1 else columns
        feed = {
            label: (values[:, 0] if rank == 1 else values).astype(_TYPES[kind])
            for (label, kind, rank), values in zip(self._inputs, given, strict=True)
        }
        try:
            said = np.asarray(self.session.run(None, feed)[0], dtype=float)
        except Exception as error:  # onnxruntime's own errors share no base class
            raise RequestError(f"model {self.name}: onnxruntime failed on {len(velocity)} states: {error}") from None
        return checked_shape(said, velocity, self.name)


def load_onnx(path: Path, vehicle: Vehicle) -> OnnxModel:
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
    return OnnxModel(session, vehicle, path.stem)
