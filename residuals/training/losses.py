"""Losses of a batch of windows: data, laws, smoothness, and short open-loop rollouts that gradients flow through."""

from typing import Any, NamedTuple, final

import torch
from torch import Tensor, nn

from ...physics.forces import ForceEquation, relative_velocity
from ...physics.integration import runge_kutta
from ...physics.laws.energy import EXCESS_UNIT, coasting_power, full_force, full_power, surplus
from ...physics.motion import Array
from ...physics.vehicle import Vehicle
from ..models.unforced_states import UnforcedStates
from ..networks.base import Memory, Network
from .training_settings import TrainingSettings
from .windows import Augmenter, Windows

_relative: Any = relative_velocity  # annotated for arrays; what acts on them acts on tensors, too
_runge_kutta: Any = runge_kutta

Acceleration = tuple[Tensor, ...]
"""Of u, v, r, each (batch,)."""
Slopes = tuple[Tensor, ...]
"""Of heading, u, v, r and the wake memory's sway speed and yaw rate, each (batch,)."""


class Forcing(NamedTuple):
    """Inputs from outside along a rollout: thrust, load (batch, rows, thrusters), air (batch, rows, 2).

    In a row of it: (thrusters, batch) and (2, batch).
    """

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
        memory: Memory | None = network(inputs[:, :start])[1] if start else None
        state = states[:, start].T
        heading = inputs.shape[-1] > 3 + forcing.thrust.shape[-1]
        outside = [Forcing(*now) for now in zip(*(x.permute(1, 2, 0) for x in forcing), strict=True)]
        found: list[Tensor] = []
        before: Tensor | None = None
        for k in range(start, inputs.shape[1] - 1):
            relative = _relative(self.vehicle, state[0], state[1:4])
            seen = [*relative, *outside[k].thrust.unbind(0), *((state[0].cos(), state[0].sin()) if heading else ())]
            said, memory = network(torch.stack(seen, dim=-1)[:, None], memory)
            now = said[:, 0]
            held = now if before is None else 1.5 * now - 0.5 * before
            before = now
            state = self._step(state, held.unbind(-1), outside[k], outside[k + 1])
            found.append(state[1:4].T)
        return torch.stack(found, dim=1)

    def _step(self, state: Tensor, said: Acceleration, first: Forcing, last: Forcing) -> Tensor:
        middle = Forcing(*(0.5 * (a + b) for a, b in zip(first, last, strict=True)))

        def slope(x: Tensor, outside: Forcing) -> Tensor:
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


STATES = 64
"""States with and without thrust that are drawn for each batch."""


@final
class Objective:
    """lambda_data |a - a_measured|^2 + lambda_phys |power beyond the laws|^2 + lambda_smooth |delta r|^2 + rollouts.

    The network's output passes through the filter of the measured acceleration before they are compared. All that does
    not depend on weights is worked out once.

    Parameters
    ----------
    windows : of the training part
    taps : of the filter, see `windows.filter_taps`
    unit : (3,) of the error on each axis [m/s^2, m/s^2, rad/s^2]
    coasting : states with and without thrust from the training envelope, of the type and on the device of the weights
    vehicle : rolled out with the network, where `settings.rollout_rows` asks for it
    augmenter : varies each batch

    Attributes
    ----------
    met : states more at which the laws are asked for: those that an audit met against them
    """

    met: UnforcedStates | None = None

    def __init__(
        self,
        windows: Windows,
        taps: Array,
        unit: Array,
        coasting: UnforcedStates,
        vehicle: Vehicle,
        settings: TrainingSettings,
        *,
        pure: bool,
        augmenter: Augmenter,
    ) -> None:
        def tensor(values: object) -> Tensor:
            return torch.as_tensor(values, dtype=coasting.inputs.dtype, device=coasting.inputs.device)

        self.settings, self.coasting, self.augmenter = settings, coasting, augmenter
        self.filter, self.unit = tensor(windows.filter_matrix(taps)[:, windows.first :]), tensor(unit)
        self.inputs, self.allowed, self.base = map(tensor, (windows.inputs, windows.allowed, windows.base))
        self.scale = tensor(EXCESS_UNIT * full_power(full_force(vehicle), windows.inputs[..., :3]))
        self.target = tensor(windows.target[:, windows.compared])
        self.shooter = Shooter(vehicle, pure=pure, time_step=windows.time_step)
        self.states = tensor(windows.states)
        self.forcing = Forcing(*map(tensor, (windows.thrust, windows.load, windows.air)))
        self.warm_rows = windows.first

    @property
    def count(self) -> int:
        """Number of windows."""
        return self.inputs.shape[0]

    def __call__(self, network: Network, index: Tensor, draw: torch.Generator) -> Tensor:
        """Loss of the windows `index`; `draw` decides states, starts and variants."""
        settings, unit = self.settings, self.unit
        inputs, target = self.augmenter(self.inputs[index], self.target[index], index, draw)
        said = self._said(network, inputs)
        loss = settings.lambda_data * robust((self.filter @ said - target) / unit, settings.huber).mean()
        if settings.lambda_smooth:
            loss = loss + settings.lambda_smooth * (said.diff(dim=1) / unit).square().mean()
        if settings.lambda_phys:
            loss = loss + settings.lambda_phys * self._unlawful(network, index, inputs, said, draw)
        if settings.rollout_rows and settings.lambda_rollout:
            loss = loss + settings.lambda_rollout * self._astray(network, index, inputs, draw)
        return loss

    def _said(self, network: Network, inputs: Tensor) -> Tensor:
        """What a network says of windows behind their first rows, on which its memory warms up, and learns nothing."""
        memory = None
        if self.warm_rows:
            with torch.no_grad():
                _, memory = network(inputs[:, : self.warm_rows])
        return network(inputs[:, self.warm_rows :], memory)[0]

    def _unlawful(self, network: Network, index: Tensor, inputs: Tensor, said: Tensor, draw: torch.Generator) -> Tensor:
        """Mean squared power beyond the laws: along the windows, and at states with and without thrust."""
        base, allowed, scale = (x[index, self.warm_rows :] for x in (self.base, self.allowed, self.scale))
        power = base + coasting_power(self.coasting.mass, inputs[:, self.warm_rows :, :3], said)
        along = surplus(power - allowed) / scale
        loss = along.square().mean()
        for asked in (self.coasting, self.met):
            if asked is not None:
                drawn = torch.randint(asked.count, (STATES,), generator=draw).to(index)
                loss = loss + asked.penalty(network, drawn)
        return loss

    def _astray(self, network: Network, index: Tensor, inputs: Tensor, draw: torch.Generator) -> Tensor:
        """Mean squared velocity error along rollouts from one random row, in what the unit adds up to on them.

        The rows before it are those that the network sees in `inputs`, noise included.
        """
        steps, warm = self.settings.rollout_rows, self.warm_rows
        most = self.inputs.shape[1] - steps - 1
        start = int(torch.randint(warm, most + 1, (), generator=draw))
        rows = slice(start - warm, start + steps + 1)
        states = self.states[index, rows]
        forcing = Forcing(*(x[index, rows] for x in self.forcing))
        rolled = self.shooter.velocities(network, inputs[:, rows], states, forcing, warm)
        error = (rolled - states[:, warm + 1 :, 1:4]) / (self.unit * steps * self.shooter.time_step)
        return error.square().mean()


def robust(error: Tensor, huber: float) -> Tensor:
    """The square of errors up to `huber`, and a line of the same slope beyond it (Huber 1964); all squares if 0."""
    if not huber:
        return error.square()
    return 2.0 * nn.functional.huber_loss(error, torch.zeros_like(error), reduction="none", delta=huber)
