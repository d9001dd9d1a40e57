"""What a boat with one thruster at each side does in calm water when it runs straight or turns steadily.

Throttle and steering are those of autopilots: the sum and the difference of the shares of full command at both sides.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from ..physics.effects import PARAMETERS
from ..physics.errors import RequestError
from ..physics.forces import at_beginning, calm
from ..physics.frames import Array
from ..physics.laws.damping_power import Envelope
from ..physics.matrices import push_of
from ..physics.motion import Motion
from ..physics.simulation import Legs, rollouts
from ..physics.thrusters import Thruster, command_of
from ..physics.vehicle import Vehicle
from .left_out import told

_SETTLING, _STEP = 120.0, 0.05
"""Time after which a boat runs steadily, and step of the simulation [s]: five times the slowest hull of the shipped."""
Commanded = Callable[[Thruster, Array], Array]


@dataclass(frozen=True, slots=True)
class Sides:
    """A boat with one thruster at each side; places of both among its thrusters."""

    vehicle: Vehicle
    port: int
    starboard: int

    def steady(self, left: Array, right: Array, commanded: Commanded = command_of) -> Array:
        """Velocities (n, 3) after two minutes of commands, shares of full command at both sides (n,) each.

        `commanded` makes commands of a thruster from shares.
        """
        vehicle = calm(at_beginning(self.vehicle))
        rows = round(_SETTLING / _STEP) + 1
        time, names = _STEP * np.arange(rows, dtype=float), tuple(t.name for t in vehicle.thrusters)
        commands = np.zeros((len(left), len(names)))
        for k, share in ((self.port, left), (self.starboard, right)):
            commands[:, k] = commanded(vehicle.thrusters[k], share)
        asked = []
        for held in commands:
            still = np.zeros((rows, 3))
            motion = Motion(time, still[:, :2], still[:, 2], still, np.tile(held, (rows, 1)), names)
            asked.append((vehicle, Legs(motion, np.array([0]), rows - 1)))
        return np.array([found.states[0, -1, 1:] for found in rollouts(asked, placed=False)])

    def thrusters(self) -> tuple[Thruster, Thruster]:
        """That at port and that at starboard."""
        return self.vehicle.thrusters[self.port], self.vehicle.thrusters[self.starboard]


def not_there(vehicle: Vehicle, envelope: Envelope, written: Collection[str] = ()) -> list[str]:
    """A sentence for all that surrounds a vehicle or changes by the minute, but for symbols that are written."""
    stated = (p for p in PARAMETERS.values() if p.section == "environment" or p.unit.endswith("/min"))
    return told(vehicle, envelope, {p.symbol: p.null for p in stated if p.symbol not in written})


def sides_of(vehicle: Vehicle, to: str) -> Sides:
    """The thrusters of a boat at both sides.

    Raises
    ------
    RequestError
        when it has not one thruster to port and one to starboard that push ahead.
    """
    pushes = [push_of(thruster) for thruster in vehicle.thrusters]
    port = [k for k, (ahead, _, turn) in enumerate(pushes) if ahead > 0.5 and turn > 0.0]
    starboard = [k for k, (ahead, _, turn) in enumerate(pushes) if ahead > 0.5 and turn < 0.0]
    if len(vehicle.thrusters) != 2 or len(port) != 1 or len(starboard) != 1:
        told = ", ".join(f"{t.name} at y = {t.y:g} m" for t in vehicle.thrusters)
        raise RequestError(
            f"export --to {to}: expected one thruster at port and one at starboard that push ahead, got {told}; the "
            f"parameters of {to} that steer by thrust are for such boats"
        )
    return Sides(vehicle, port[0], starboard[0])
