"""Boats of the audit's trial: sisters of shipped vehicles, larger and smaller ones, and functions made of them."""

from collections.abc import Callable

import numpy as np

from undertow.physics.laws.audit.bounded import possible_commands, reachable
from undertow.physics.laws.damping_power import damping_power
from undertow.physics.laws.energy import full_force
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.motion import Array
from undertow.physics.thrusters import TableCurve, Thruster, command_of
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.foreign import FunctionModel

Force = Callable[[Array, Array, Array], Array]
"""Force (n, 3) [N, N, N m] from velocity (n, 3), heading (n,) and commands (n, thrusters)."""
Inside = Callable[[Array, Array, Array], np.ndarray]
"""Whether states lie in a window (n,), from the same three."""


def sister(rng: np.random.Generator) -> Vehicle:
    """A BlueBoat or an Otter with every mass and damping varied by up to a quarter."""
    return random_hull(load_vehicle(("blueboat", "otter")[int(rng.integers(2))]), rng, 0.25)


def scaled(boat: Vehicle, size: float) -> Vehicle:
    """The boat `size` times as long, by Froude's law: forces grow as size^3, speeds as size^0.5."""
    axes = {"X": 0, "Y": 1, "N": 2}
    changes = {"mass": boat.mass * size**3, "inertia_z": boat.inertia_z * size**5, "x_g": boat.x_g * size}
    powers = {"X_udot": 3.0, "Y_vdot": 3.0, "N_rdot": 5.0, "Y_rdot": 4.0}
    changes |= {s: boat.value(s) * size**p for s, p in powers.items()}
    for symbol in boat.damping:
        head, _, tail = symbol.partition("_")
        per = sum(0.5 if k in "uv" else -0.5 for k in tail)
        changes[symbol] = boat.value(symbol) * size ** (3.0 + (axes[head] == 2) - per)
    thrusters = tuple(
        t.model_copy(update={"x": t.x * size, "y": t.y * size, "scale": t.scale * size**3}) for t in boat.thrusters
    )
    return boat.with_values(changes).model_copy(update={"thrusters": thrusters})


def thruster(name: str, x: float, y: float, degrees: float, newton: float) -> Thruster:
    """A thruster that is commanded in newtons."""
    ends = (-newton, 0.0, newton)
    curve = TableCurve(kind="table", command=ends, force=ends)
    return Thruster(name=name, x=x, y=y, angle=float(np.radians(degrees)), command="newton", curve=curve)


def without_damping(boat: Vehicle) -> Vehicle:
    """The boat that nothing brakes."""
    return boat.with_values(dict.fromkeys(boat.damping, 0.0))


def function(boat: Vehicle, force: Force, name: str, of: Vehicle | None = None) -> FunctionModel:
    """A boat as foreign code with a force beside its own; the code is that `of` another boat, where one is given."""
    own = boat if of is None else of
    inverse, hull = np.linalg.inv(mass_matrix(own)), VehicleModel(own, "hull")

    def answer(velocity: Array, heading: Array, commands: Array) -> Array:
        return hull.settled(velocity, heading, commands) + force(velocity, heading, commands) @ inverse.T

    return FunctionModel(answer, boat, name)


def dragged(boat: Vehicle, drag: Callable[[Array], Array], name: str) -> FunctionModel:
    """A boat as foreign code with a drag force (n, 3) of the velocity in the place of its own."""
    return function(boat, lambda nu, psi, c: drag(nu), name, of=without_damping(boat))


def window(boat: Vehicle, inside: Inside, name: str, over: float = 1.5, share: float = 0.1) -> FunctionModel:
    """A boat as foreign code with a push along its motion inside a window, and there everywhere.

    It wins over the drag `over` times and gives a `share` of full thrust's power beyond that.
    """
    full = full_force(boat)

    def push(nu: Array, psi: Array, commands: Array) -> Array:
        power = -over * damping_power(boat, nu) + share * (np.abs(nu) @ full)
        along = nu * full
        weight = np.where(inside(nu, psi, commands), power / np.maximum((nu * along).sum(axis=1), 1e-12), 0.0)
        return weight[:, None] * along

    return function(boat, push, name)


def ends(boat: Vehicle) -> Array:
    """How far the envelope reaches to both sides on each axis (3,)."""
    box = reachable(boat, possible_commands(boat))[0]
    return np.minimum(-np.array(box.lower), np.array(box.upper))


def newtons(boat: Vehicle) -> Array:
    """Full command of each thruster (thrusters,), which is commanded symmetrically about zero."""
    return np.array([float(command_of(t, np.array(1.0))) for t in boat.thrusters])
