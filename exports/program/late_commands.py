"""Commands on their way to a force: what a state keeps of them for lag and delay, a thruster at a time."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from ...physics.delays_and_lags import lag_weights, lags
from ...physics.errors import RequestError
from ...physics.thrusters import Thruster
from ...physics.vehicle import Vehicle
from .symbols import Symbol, symbolic

_MOST_KEPT = 1000
"""Commands that a state keeps for thrusters with a delay: eight thrusters, 2 s late, in steps of 20 ms."""


class LateCommands(NamedTuple):
    """How a thruster answers.

    Attributes
    ----------
    lags : commands are kept behind their lag, and the last one without it, too
    whole, part : steps by which the force is late
    names : of the commands that are kept, the newest first
    """

    thruster: Thruster
    time_step: float
    lags: bool
    whole: int
    part: float
    names: tuple[str, ...]

    def after(self, before: Sequence[Symbol], command: Symbol) -> list[Symbol]:
        """The commands that are kept after a step that ends with a command."""
        if not self.lags:
            return [command, *before[:-1]]
        a, b0, b1 = lag_weights(self.thruster.lag, self.time_step)
        return [symbolic(a * before[0] + b0 * before[-1] + b1 * command), *before[:-2], command]

    def force(self, kept: Sequence[Symbol]) -> tuple[Symbol, Symbol]:
        """Force and loss of the thruster: between two samples, as `delays_and_lags.shift` has it."""
        force, load = lasting(self.thruster, kept[self.whole])
        if not self.part:
            return force, load
        earlier = lasting(self.thruster, kept[self.whole + 1])
        between = [symbolic(b + (1.0 - self.part) * (a - b)) for a, b in zip((force, load), earlier, strict=True)]
        return between[0], between[1]


def late_commands(vehicle: Vehicle, time_step: float) -> list[LateCommands]:
    """What is kept for each thruster, in steps of a length [s].

    Raises
    ------
    RequestError
        when a delay is a great many steps.
    """
    found = [_late(thruster, time_step) for thruster in vehicle.thrusters]
    kept = sum(len(one.names) for one in found)
    if kept > _MOST_KEPT:
        raise RequestError(
            f"export: with steps of {time_step:g} s, {kept} commands are on their way in the delays; at most "
            f"{_MOST_KEPT} are written, so take a longer --time-step"
        )
    return found


def _late(thruster: Thruster, time_step: float) -> LateCommands:
    place = thruster.late / time_step
    whole, part = int(place), place - int(place)
    slow = lags(thruster.lag, time_step)
    kept = "lagged" if slow else "command"
    names = tuple(f"{kept}_{thruster.name}_{k}" for k in range(whole + 1 + (part > 0.0)))
    return LateCommands(thruster, time_step, slow, whole, part, (*names, f"asked_{thruster.name}") if slow else names)


def lasting(thruster: Thruster, command: Any) -> tuple[Symbol, Symbol]:
    """See `Thruster.lasting`."""
    force, load = thruster.lasting(command)
    return symbolic(force), symbolic(load)
