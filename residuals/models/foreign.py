"""Foreign models: a Python function that the user names, or an ONNX file that onnxruntime runs.

`load_function` imports a module and so runs its code; only a name that the user gave reaches it, never one from a file.
"""

import re
import sys
from collections.abc import Callable
from importlib import import_module
from inspect import signature
from os import getcwd
from pathlib import Path
from typing import Any, cast, final

import numpy as np

from ...physics.errors import RequestError
from ...physics.integration import SPEED_LIMIT, Rollouts, check_starts, integrate_stiff
from ...physics.motion import Array, Motion
from ...physics.registry_members import how_to_install
from ...physics.vehicle import Vehicle
from .base import Kind, Model

Answer = Callable[[Array, Array, Array], Array]
"""Acceleration over ground (n, 3) from velocity over ground (n, 3), heading (n,) and commands (n, thrusters)."""

SIGNATURE = "f(velocity (n, 3), heading (n,), commands (n, thrusters)) -> accelerations (n, 3)"
"""Of a function that is a model, as messages tell it; velocities and accelerations are over ground."""
NO_MASS = "it carries no mass and no thrusters; give --vehicle V"
"""Said of a foreign model that comes without a vehicle."""

_NAME = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*")


@final
class FunctionModel(Model):
    """A function as a model; it has no memory, and knows of the vehicle only its commands.

    Attributes
    ----------
    answer : the function
    vehicle : of the mass that laws ask for, and of the commands
    """

    remembers = False

    def __init__(self, answer: Answer, vehicle: Vehicle, name: str, kind: Kind = "physics") -> None:
        self.answer = answer
        self.vehicle = vehicle
        self.name = name
        self.kind = kind
        self.parameters = 0
        self.seconds_to_fit = 0.0

    def acceleration(self, motion: Motion) -> Array:
        """See `Model.acceleration`."""
        return self.settled(motion.velocity, motion.heading, motion.commands)

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """See `Model.rollout`; commands are linear between rows, and the step is stable however stiff the function is.

        Raises
        ------
        RequestError
            when a start leaves fewer than `steps` rows.
        """
        starts = check_starts(motion, starts, steps)
        initial = np.column_stack([motion.position, motion.heading, motion.velocity])[starts]
        commands = motion.commands[starts[:, None] + np.arange(steps + 1)]
        return integrate_stiff(self.settled, initial, commands, motion.time_step, SPEED_LIMIT)

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`.

        Raises
        ------
        RequestError
            when the function fails, or does not answer with an acceleration for each state.
        """
        try:
            said = np.asarray(self.answer(velocity.copy(), heading.copy(), np.array(commands)), dtype=float)
        except Exception as error:
            raise RequestError(
                f"model {self.name}: expected {SIGNATURE}; it failed on {velocity.shape[0]} states: {error!r}"
            ) from error
        if said.shape != velocity.shape:
            raise RequestError(
                f"model {self.name}: expected accelerations of shape {velocity.shape} (surge, sway, yaw by state), got "
                f"{said.shape}"
            )
        return said


def is_function_name(text: str) -> bool:
    """True when a text has the form `package.module:function`."""
    return _NAME.fullmatch(text) is not None


def load_function(text: str, vehicle: Vehicle | None) -> FunctionModel:
    """Import `package.module:function`, from the folder where one stands too; this runs the module's code.

    Raises
    ------
    RequestError
        when there is no such module or function, it does not take three arguments, or there is no vehicle.
    """
    module, name = text.split(":")
    here = getcwd()
    sys.path.insert(0, here)
    try:
        found: Any = getattr(import_module(module), name, None)
    except Exception as error:
        raise RequestError(
            f"model {text}: cannot import {module} ({error!r}); expected package.module:function, installed or in "
            f"{here}"
        ) from error
    finally:
        if here in sys.path:
            sys.path.remove(here)
    if not callable(found):
        raise RequestError(f"model {text}: {module} has no function {name}")
    try:
        arguments = signature(found)
    except (TypeError, ValueError):
        arguments = None  # a function in C may not tell them; the first call will
    if arguments is not None:
        try:
            arguments.bind(None, None, None)
        except TypeError as error:
            raise RequestError(f"model {text}: expected {SIGNATURE}, got {name}{arguments}: {error}") from error
    if vehicle is None:
        raise RequestError(f"model {text}: {NO_MASS}")
    return FunctionModel(cast(Answer, found), vehicle, text)


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
            text = ", ".join(f"{label} {kind} {tuple(shape)}" for label, kind, shape in found)
            raise RequestError(
                f"model {name}: expected some of the inputs velocity (n, 3), heading (n,) and commands "
                f"(n, {thrusters}), or one of them side by side (n, {4 + thrusters}), as float or double "
                f"tensors, got {text or 'none'}; "
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
    """A session of onnxruntime as a model; raises as `OnnxAnswer` does.

    Parameters
    ----------
    session : of onnxruntime
    vehicle : whose commands the model takes
    name : of the model
    """
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
