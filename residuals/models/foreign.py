"""Somebody else's model as a Python function: accelerations from velocity, heading and commands.

The module is imported, and with it its code is run, only by `load_function`, which nothing calls but for a name that
the user gave; no file can name one.
"""

import re
import sys
from collections.abc import Callable
from importlib import import_module
from inspect import signature
from os import getcwd
from typing import Any, cast, final

import numpy as np

from ...physics.errors import RequestError
from ...physics.frames import Array
from ...physics.integration import SPEED_LIMIT, Rollouts
from ...physics.motion import Motion
from ...physics.simulation import check_starts
from ...physics.stiff_simulation import integrate_stiff
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
    """Whether a text has the form `package.module:function`."""
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
