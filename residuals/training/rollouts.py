"""Short open-loop rollouts that gradients flow through: the force equation and the network, step by step."""

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from ...physics.forces import ForceEquation, relative_velocity
from ...physics.integration import runge_kutta
from ...physics.vehicle import Vehicle
from ..networks.base import Memory, Network

_relative: Any = relative_velocity  # annotated for arrays; what acts on them acts on tensors, too
_runge_kutta: Any = runge_kutta

Acceleration = tuple[Tensor, ...]
"""Of u, v, r, each (batch,)."""
Slopes = tuple[Tensor, ...]
"""Of heading, u, v, r and the wake memory's sway speed and yaw rate, each (batch,)."""


@dataclass(frozen=True, slots=True)
class Forcing:
    """What acts from outside along a rollout: thrust, load (batch, rows, thrusters), air (batch, rows, 2)."""

    thrust: Tensor
    load: Tensor
    air: Tensor


class Shooter:
    """Rollouts as `NetworkModel.rollout` makes them, on tensors.

    Physics by classical Runge-Kutta; the network speaks once a step, and is held at 1.5 a_k - 0.5 a_(k-1) for the step.

    Parameters
    ----------
    vehicle : of the physics, and of the water
    pure : whether the network gives the whole acceleration
    time_step : [s]
    """

    def __init__(self, vehicle: Vehicle, *, pure: bool, time_step: float) -> None:
        self.vehicle, self.pure, self.time_step = vehicle, pure, time_step
        self.equation: Any = ForceEquation(vehicle)

    def velocities(self, network: Network, inputs: Tensor, states: Tensor, forcing: Forcing, start: int) -> Tensor:
        """Velocities over ground (batch, steps, 3) after each step from row `start` to the last row.

        Parameters
        ----------
        inputs : (batch, rows, inputs) measured; those before `start` warm the network up
        states : (batch, rows, 6) measured, as `Windows` holds them; only row `start` is used
        """
        memory: Memory | None = None
        if start:
            _, memory = network(inputs[:, :start])
        state = states[:, start].T
        heading = inputs.shape[-1] > 3 + forcing.thrust.shape[-1]
        thrust, load, air = (x.permute(1, 2, 0).unbind(0) for x in (forcing.thrust, forcing.load, forcing.air))
        found: list[Tensor] = []
        before: Tensor | None = None
        for k in range(start, inputs.shape[1] - 1):
            relative = _relative(self.vehicle, state[0], state[1:4])
            seen = [*relative, *thrust[k].unbind(0), *((state[0].cos(), state[0].sin()) if heading else ())]
            said, memory = network(torch.stack(seen, dim=-1)[:, None], memory)
            now = said[:, 0]
            held = now if before is None else 1.5 * now - 0.5 * before
            before = now
            ends = tuple((x[k], x[k + 1]) for x in (thrust, load, air))
            state = self._step(state, held.unbind(-1), *ends)
            found.append(state[1:4].T)
        return torch.stack(found, dim=1)

    def _step(self, state: Tensor, said: Acceleration, *ends: tuple[Tensor, Tensor]) -> Tensor:
        first, last = tuple(e[0] for e in ends), tuple(e[1] for e in ends)
        middle = tuple(0.5 * (e[0] + e[1]) for e in ends)

        def slope(x: Tensor, outside: tuple[Tensor, Tensor, Tensor]) -> Tensor:
            return torch.stack(self._slope(x, said, *outside))

        return _runge_kutta(slope, state, (first, middle, last), self.time_step)

    def _slope(self, state: Tensor, said: Acceleration, thrust: Tensor, load: Tensor, air: Tensor) -> Slopes:
        heading, u, v, r, slow_v, slow_r = state.unbind(0)
        if self.pure:
            return r, *said, torch.zeros_like(u), torch.zeros_like(u)
        velocity = (u, v, r)
        relative = _relative(self.vehicle, heading, velocity)
        equation = self.equation
        force = equation.force(relative, heading, thrust, load, (slow_v, slow_r), tuple(air.unbind(0)))
        slopes = equation.acceleration(force, relative, velocity, heading)
        if equation.has_memory:
            constant = self.vehicle.values["memory_time"]
            lag = ((relative[1] - slow_v) / constant, (r - slow_r) / constant)
        else:
            lag = (torch.zeros_like(u), torch.zeros_like(u))
        return r, *(a + b for a, b in zip(slopes, said, strict=True)), *lag
