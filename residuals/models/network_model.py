"""A trained network as a model: beside a vehicle's physics (hybrid) or in its place (pure), for motions or row by row.

torch runs on one thread: networks of this size gain nothing from more, and sums do not depend on the machine.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import final

import numpy as np
import torch
from torch import Tensor

from ...measurements.preparation.resampling import Standardisation
from ...physics.errors import RequestError
from ...physics.forces import actuation, held_acceleration, held_thrust, modelled_acceleration
from ...physics.integration import Rollouts, rollout
from ...physics.momentum_balance import mass_matrix, thruster_matrix
from ...physics.motion import Array, Motion
from ...physics.vehicle import Vehicle
from ..networks.base import Memory, Network, Scaling, through
from ..networks.trust import Trust
from .base import Kind, Model
from .interval import Interval, least_known, sizes
from .network_inputs import network_inputs, stacked_inputs
from .unforced_states import SETTLE


@contextmanager
def one_thread() -> Iterator[None]:
    """Let torch compute on one thread inside, and as before afterwards."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


_RATE_SLACK = 0.01
"""Share by which a motion's time step may differ from the network's."""
_SPREAD = 2.0
"""Deviations from the mean within which inputs count as seen in training."""
_STATES = 2048
"""States that go through a network at once."""


def scaling_of(vehicle: Vehicle, inputs: Standardisation, output: Array) -> Scaling:
    """The physical constants of a network for a vehicle: `output` (3,) [m/s^2, m/s^2, rad/s^2], see `Scaling`.

    Parameters
    ----------
    vehicle : that the network corrects
    inputs : mean and scale of each input
    output : scale of each axis (3,) [m/s^2, m/s^2, rad/s^2]
    """
    return Scaling(inputs, np.asarray(output, dtype=float), mass_matrix(vehicle), thruster_matrix(vehicle))


@final
class NetworkModel(Model):
    """A network that corrects the acceleration of a vehicle, or gives all of it.

    Attributes
    ----------
    vehicle : the nominal model: of its physics, of the thrust that the network sees, and of the mass that laws ask for
    network : trained; its input names say whether it sees the heading
    pure : whether the network gives the whole acceleration, without the vehicle's physics
    time_step : of the rows that it was trained on [s]; it knows no other
    interval : how far from the measured acceleration it may be; None where nothing was calibrated
    """

    def __init__(
        self,
        vehicle: Vehicle,
        network: Network,
        time_step: float,
        *,
        pure: bool = False,
        name: str = "",
        seconds_to_fit: float = 0.0,
    ) -> None:
        self.vehicle = vehicle
        self.network = network.eval()
        self.time_step = time_step
        self.pure = pure
        self.name = name or f"{'pure' if pure else 'hybrid'} {network.name}"
        self.kind: Kind = "network" if pure else "hybrid"
        self.parameters = sum(p.numel() for p in network.parameters())
        self.seconds_to_fit = seconds_to_fit
        self.interval: Interval | None = None
        with torch.inference_mode():
            self.remembers = bool(network(self.tensor(np.zeros((1, 1, network.width))))[1])
        self._tell()
        self.rests_on = "vehicle" if network.rests_on == "itself" and not pure else network.rests_on

    def trust(self, given: Trust | None) -> None:
        """Let the correction be said by this gain; None: let it be said whole everywhere."""
        self.network.trust(given)
        self._tell()

    def _tell(self) -> None:
        """What follows from the gain."""
        gain = self.network.gain
        self.seen, self.fades = self._ends(), gain is not None
        self.far = type(self).far if gain is None else float(gain.trust.reaches[-1])

    def _ends(self) -> tuple[Array, Array]:
        """See `Model.seen`; what a network that is said whole has seen is known by its standardisation alone."""
        inputs, gain = self.network.scaling.inputs, self.network.gain
        known = slice(3 + self.network.scaling.drives)
        low, high = (
            (-_SPREAD, _SPREAD) if gain is None else (end[known] for end in (gain.trust.lower, gain.trust.upper))
        )
        mean, scale = inputs.mean[known], inputs.scale[known]
        return mean + low * scale, mean + high * scale

    @property
    def heading(self) -> bool:
        """True when the network sees the heading."""
        return "cos_psi" in self.network.scaling.inputs.names

    def correction(self, motion: Motion) -> Array:
        """Correction by the network along a measured motion, (n, 3) [m/s^2, m/s^2, rad/s^2].

        Raises
        ------
        RequestError
            when the motion's time step is not the network's.
        """
        self._check_rate(motion)
        seen = self.tensor(network_inputs(self.vehicle, motion, self.heading))[None]
        with torch.inference_mode(), one_thread():
            return numbers(through(self.network, seen)[0][0])

    def beyond(self, motion: Motion) -> Array:
        """See `Model.beyond`; of a correction with a gain, the distance that this is a function of."""
        gain = self.network.gain
        if gain is None:
            return super().beyond(motion)
        with torch.inference_mode():
            return np.sqrt(numbers(gain.squared_distance(self._standardised(motion))))

    def weight(self, motion: Motion) -> Array:
        """The gain of its correction along a motion (n, 3); 1 where it is said whole."""
        gain = self.network.gain
        if gain is None:
            return np.ones((motion.time.size, 3))
        with torch.inference_mode():
            return numbers(gain(self._standardised(motion)))

    def margin(self, motion: Motion) -> Array | None:
        """See `Model.margin`; raises as `correction` does."""
        if self.interval is None:
            return None
        found = sizes(self.vehicle, motion, self.acceleration(motion))
        return self.interval.margin(found, *least_known(motion, self.weight(motion), self.beyond(motion)))

    def acceleration(self, motion: Motion) -> Array:
        """See `Model.acceleration`; raises as `correction` does."""
        said = self.correction(motion)
        return said if self.pure else modelled_acceleration(self.vehicle, motion) + said

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        """See `Model.rollout`.

        The network remembers the measured motion up to and with each start; from there on it sees the simulated state
        and the commands only. Its correction is held over a step at the two-step Adams-Bashforth value
        1.5 a_k - 0.5 a_(k-1), of second order, the first step at a_0; the physics goes by Runge-Kutta within the step.

        Raises
        ------
        RequestError
            when the motion's time step is not the network's, or a start leaves fewer than `steps` rows.
        """
        self._check_rate(motion)
        physics = None if self.pure else self.vehicle
        return rollout(physics, motion, starts, steps, _OpenLoop(self, motion, np.asarray(starts, dtype=int)))

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        """See `Model.settled`; a network whose memory settles sees the state for `unforced_states.SETTLE`."""
        if not velocity.shape[0]:
            return np.zeros((0, 3))
        thrust, _ = held_thrust(self.vehicle, commands)
        seen = stacked_inputs(self.vehicle, heading, tuple(velocity.T), thrust, self.heading)
        parts = []
        rows = max(1, round(SETTLE / self.time_step)) if self.remembers and not self.network.starts_settled else 1
        with torch.inference_mode(), one_thread():
            for block in self.tensor(seen).split(_STATES):
                parts.append(self.network(block[:, None].expand(-1, rows, -1))[0][:, -1])
        said = numbers(torch.cat(parts))
        return said if self.pure else held_acceleration(self.vehicle, velocity, heading, commands) + said

    def _standardised(self, motion: Motion) -> Tensor:
        return self.tensor(self.network.scaling.inputs.apply(network_inputs(self.vehicle, motion, self.heading)))

    def tensor(self, values: Array) -> Tensor:
        """Numbers as the network takes them, in its precision and on its device."""
        like = self.network.get_buffer("input_mean")
        return torch.as_tensor(values, dtype=like.dtype, device=like.device)

    def _check_rate(self, motion: Motion) -> None:
        if abs(motion.time_step / self.time_step - 1.0) > _RATE_SLACK:
            rate = 1.0 / self.time_step
            raise RequestError(
                f"model {self.name}: expected rows {self.time_step:g} s apart, as it was trained on, got "
                f"{motion.time_step:g} s; prepare the log at {rate:.4g} Hz, or train a network at "
                f"{1.0 / motion.time_step:.4g} Hz"
            )


class _OpenLoop:
    """What a network adds to each step of a batch of rollouts; see `integration.integrate`."""

    def __init__(self, model: NetworkModel, motion: Motion, starts: np.ndarray) -> None:
        self.model, self.motion, self.starts = model, motion, starts
        self.thrust = actuation(model.vehicle, motion).thrust
        self.memory: Memory = ()
        self.last = np.zeros((3, starts.size))

    def __call__(self, k: int, state: Array) -> Array:
        with torch.inference_mode(), one_thread():
            said = self._first() if k == 0 else self._next(k, state)
        now = numbers(said).T
        held = now if k == 0 else 1.5 * now - 0.5 * self.last
        self.last = now
        return held

    def _first(self) -> Tensor:
        """Walk along the measured rows once, and keep what is said and remembered at each start."""
        model = self.model
        seen = model.tensor(network_inputs(model.vehicle, self.motion, model.heading))[None]
        stops, where = np.unique(self.starts, return_inverse=True)
        said, kept, memory, done = [], [], None, 0
        for stop in stops.tolist():
            part, memory = through(model.network, seen[:, done : stop + 1], memory)
            said.append(part[0, -1])
            kept.append(memory)
            done = stop + 1
        self.memory = tuple(torch.cat(parts)[where] for parts in zip(*kept, strict=True))
        return torch.stack(said)[where]

    def _next(self, k: int, state: Array) -> Tensor:
        model = self.model
        thrust = self.thrust[:, self.starts + k]
        seen = stacked_inputs(model.vehicle, state[2], (state[3], state[4], state[5]), thrust, model.heading)
        said, self.memory = model.network(model.tensor(seen)[:, None], self.memory)
        return said[:, 0]


def numbers(said: Tensor) -> Array:
    """Output of a network in double precision."""
    return said.double().cpu().numpy()


@final
class NetworkWalk:
    """A network beside the physics, fed a row at a time.

    Parameters
    ----------
    model : whose network it is; it sees what `network_inputs` has

    Attributes
    ----------
    said : (3,) what it said of the latest row [m/s^2, m/s^2, rad/s^2]
    """

    def __init__(self, model: NetworkModel) -> None:
        self._model = model
        self._memory: Memory | None = None
        self.said = np.zeros(3)

    def follow(self, seen: Array) -> Array:
        """Correction of rows (n, inputs) that have come, (n, 3); the network remembers them."""
        result, self._memory = self._asked(seen)
        self.said = result[-1]
        return result

    def ahead(self, seen: Array) -> Array:
        """Correction of rows (n, inputs) that would come next, (n, 3); the network remembers nothing of them."""
        return self._asked(seen)[0]

    def _asked(self, seen: Array) -> tuple[Array, Memory]:
        with torch.inference_mode(), one_thread():
            said, memory = self._model.network(self._model.tensor(seen)[None], self._memory)
        return numbers(said[0]), memory
