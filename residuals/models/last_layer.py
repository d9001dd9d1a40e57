"""The last layer of a network as parameters in which its correction is linear, to be followed while a boat runs.

Neural-Fly (O'Connell et al. 2022, doi:10.1126/scirobotics.abm6597) writes a residual force as Phi(x) a, with Phi a
network without its last layer and a what adapts. Here a has, for each axis, the gain of the trained layer, and a few
more of its directions: those along which chance changes of its weights move the correction most (randomised range
finder; Halko, Martinsson and Tropp 2011, algorithm 4.1).
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor, nn
from torch.func import functional_call, vmap

from ...physics.errors import RequestError
from ...physics.momentum_balance import mass_matrix
from ...physics.motion import AXES, Array, Motion
from ...physics.vehicle import Vehicle
from ..networks.base import Memory, Network, through
from ..networks.registry import build
from .network_inputs import network_inputs
from .network_model import NetworkModel, numbers, one_thread, scaling_of

DIRECTIONS = 4
"""Directions of the layer that are followed on each axis beside its gain; `benchmarks/following.py` tries others."""
_DRAWS = 24
"""Chance changes of an axis's weights, of which the main directions are taken: six times as many as are followed."""
CHANGE = 0.5
"""A plausible change of a gain, and of a direction in units of what the trained layer says."""
_CONSTANTS = ("input_mean", "input_scale", "output_scale")
"""What a network has from its scaling, and not from its training."""
_LEAST_RATIO = 1e-3
"""Of a thruster's force to what it was, so that one that gives nothing has a scale."""
_LINEAR = 1e-3
"""Relative error up to which a correction counts as linear in its last layer: it is said in single precision."""


_Interleaved = tuple[int, tuple[Memory | None, ...]]
"""Which of the interleaved walks takes the next row, and what each remembers."""


class LastLayer:
    """Gain and main directions of a network's last layer, by axis; see `discovery.calibration.forgetting_fit.Carried`.

    Parameters
    ----------
    model : a network beside a vehicle
    motions : over which the directions are chosen
    noise : (3,) force on each axis [N, N, N m] below which a correction is lost, so that it is not followed there
    directions : of each axis beside the gain

    Attributes
    ----------
    symbols : the gains, such as `net_surge`, and then the directions, `net_surge_2` onwards
    start, amounts : (q,) values of the trained layer, and a plausible change of each
    gains : how many of them are gains

    Raises
    ------
    RequestError
        for a network that stands in the place of the physics, has no last layer in which its correction is linear, or
        says nothing of the motions.
    """

    def __init__(
        self, model: NetworkModel, motions: Sequence[Motion], noise: Array, directions: int = DIRECTIONS
    ) -> None:
        if model.pure:
            raise RequestError(
                f"adapt: expected a network that corrects a vehicle, but {model.name} stands in the place of its "
                "physics; train one without --pure"
            )
        self._model, network = model, model.network
        self._trained = {name: value.detach() for name, value in network.named_parameters() if name.startswith("head.")}
        inputs = [self._inputs(motion, 0)[:, :: self._every(motion)] for motion in motions]
        if not self._linear(inputs[0]):
            raise RequestError(
                f"adapt: expected a network whose correction is linear in its last layer, but {network.name} is not; "
                "mlp, symmetric, lstm, tcn, transformer, ridge, gp and symmetric_gp are"
            )
        mass, rng = mass_matrix(model.vehicle), np.random.default_rng(0)
        gains, others = dict[str, dict[str, Tensor]](), dict[str, dict[str, Tensor]]()
        for axis, name in enumerate(AXES):
            gain = self._of_axis(axis, self._trained)
            drawn = [gain, *(self._of_axis(axis, _drawn(self._trained, rng)) for _ in range(_DRAWS))]
            along = np.concatenate([self._said(drawn, each) for each in inputs]) @ mass[axis]
            if float(np.sqrt((along[:, 0] ** 2).mean())) > noise[axis]:
                weights = _main_directions(along, directions)
                gains[f"net_{name}"] = gain
                others |= {f"net_{name}_{k + 2}": _mixed(drawn, row) for k, row in enumerate(weights)}
        if not gains:
            raise RequestError(
                f"adapt: what the network {model.name} adds is lost in the noise of this log; follow without --network"
            )
        layers = gains | others
        self._stack = {key: torch.stack([layer[key] for layer in layers.values()]) for key in self._trained}
        self.symbols, self.gains = tuple(layers), len(gains)
        self.start = np.repeat([1.0, 0.0], [len(gains), len(others)])
        self.amounts = np.full(len(layers), CHANGE)

    def along(self, motion: Motion, fresh: int, memory: _Interleaved | None) -> tuple[Array, _Interleaved]:
        """What a unit of each parameter adds along the last rows of a motion, (fresh, 3, q) [m/s^2, m/s^2, rad/s^2].

        A network that remembers goes along rows as far apart as those of its training, beginning at each row between.

        Parameters
        ----------
        fresh : rows that have come since the memory was given
        memory : of the call before; None for a motion that begins

        Raises
        ------
        RequestError
            for a network that remembers, where its step is no whole number of the motion's.
        """
        every = self._every(motion)
        first, memories = memory or (0, (None,) * every)
        seen, kept = self._inputs(motion, motion.time.size - fresh), list(memories)
        found = np.zeros((len(self.symbols), fresh, 3))
        for k in range(every):
            rows = slice((k - first) % every, None, every)
            if seen[:, rows].shape[1]:
                found[:, rows], kept[k] = self._asked(self._stack, seen[:, rows], kept[k])
        return np.moveaxis(found, 0, -1), ((first + fresh) % every, tuple(kept))

    def adapted(self, values: Array, vehicle: Vehicle) -> NetworkModel:
        """The network with the last layer that values (q,) make, beside a vehicle of the same thrusters.

        What it says of a command is what was followed, whatever the scales of the thrusters are now. Its interval was
        of the trained layer, and is gone.
        """
        own, like = self._model.network, next(iter(self._stack.values()))
        change = torch.as_tensor(values - self.start, dtype=like.dtype)
        head = {key: value + torch.tensordot(change, self._stack[key], 1) for key, value in self._trained.items()}
        inputs, ratio = own.scaling.inputs, self._thrust_ratio(vehicle)
        moved = replace(inputs, mean=inputs.mean * ratio, scale=inputs.scale * ratio)
        network = build(own.name, scaling_of(vehicle, moved, own.scaling.output), own.options).to(like.dtype)
        limits = torch.as_tensor(ratio[: 3 + own.scaling.drives], dtype=like.dtype)
        ends = {key: own.get_parameter(key) * limits for key in ("lower", "upper") if key in own.state_dict()}
        kept = {key: value for key, value in own.state_dict().items() if key not in _CONSTANTS}
        network.load_state_dict({**network.state_dict(), **kept, **head, **ends})
        network.gain = deepcopy(own.gain)
        return NetworkModel(vehicle, network, self._model.time_step, name=f"{self._model.name}, followed")

    def _thrust_ratio(self, vehicle: Vehicle) -> Array:
        """Of each input of a vehicle to that of the network's own, (inputs,): scales of thrusters are followed, too."""
        before, ratio = self._model.vehicle, np.ones(self._model.network.width)
        for k, pair in enumerate(zip(vehicle.thrusters, before.thrusters, strict=True)):
            now, then = (one.scale * one.thrust_scale for one in pair)
            ratio[3 + k] = max(now / then, _LEAST_RATIO) if then else 1.0
        return ratio

    def _every(self, motion: Motion) -> int:
        """Rows of a motion in a step of a network that remembers; 1 for one that does not."""
        if not self._model.remembers:
            return 1
        ratio = self._model.time_step / motion.time_step
        if ratio < 0.99 or abs(ratio / round(ratio) - 1.0) > 0.01:
            raise RequestError(
                f"adapt: expected a log of {1.0 / self._model.time_step:.4g} Hz or a multiple of it, which the memory "
                f"of the network {self._model.name} was trained at, got {1.0 / motion.time_step:.4g} Hz; take a "
                "network without a memory, such as mlp"
            )
        return round(ratio)

    def _inputs(self, motion: Motion, first: int) -> Tensor:
        """Inputs (1, rows, inputs) from a row on."""
        return self._model.tensor(network_inputs(self._model.vehicle, motion, self._model.heading)[first:])[None]

    def _of_axis(self, axis: int, layer: dict[str, Tensor]) -> dict[str, Tensor]:
        """A layer of which only what leads to one axis is left."""
        only = torch.eye(3)[axis]
        return {key: value * only.reshape(-1, *[1] * (value.ndim - 1)) for key, value in layer.items()}

    def _said(self, layers: Sequence[dict[str, Tensor]], seen: Tensor) -> Array:
        """What several layers say, (rows, layers, 3) [m/s^2, m/s^2, rad/s^2]."""
        stack = {key: torch.stack([layer[key] for layer in layers]) for key in self._trained}
        return np.moveaxis(self._asked(stack, seen, None)[0], 0, 1)

    def _asked(self, stack: dict[str, Tensor], seen: Tensor, memory: Memory | None) -> tuple[Array, Memory | None]:
        """Corrections (layers, rows, 3) by layers that are stacked, and the memory, which none of them changes."""
        network = self._model.network

        def with_layer(layer: dict[str, Tensor]) -> tuple[Tensor, Memory | None]:
            asked = _Through(network)
            return functional_call(asked, {f"network.{key}": value for key, value in layer.items()}, (seen, memory))

        with torch.no_grad(), one_thread():
            said, remembered = vmap(with_layer, out_dims=(0, None))(stack)  # pyright: ignore[reportArgumentType]
        return numbers(said)[:, 0], remembered

    def _linear(self, seen: Tensor) -> bool:
        """True when twice the last layer says twice as much, and none nothing."""
        if not self._trained or any(len(value) != 3 for value in self._trained.values()):
            return False
        layers = [{key: factor * value for key, value in self._trained.items()} for factor in (0.0, 1.0, 2.0)]
        none, once, twice = np.moveaxis(self._said(layers, seen), 1, 0)
        close = _LINEAR * max(float(np.abs(once).max()), 1e-30)
        return bool(np.abs(none).max() <= close and np.abs(twice - 2.0 * once).max() <= close)


class _Through(nn.Module):
    """A network that takes many rows block by block."""

    def __init__(self, network: Network) -> None:
        super().__init__()
        self.network = network

    def forward(self, seen: Tensor, memory: Memory | None) -> tuple[Tensor, Memory | None]:
        return through(self.network, seen, memory)


def _drawn(like: dict[str, Tensor], rng: np.random.Generator) -> dict[str, Tensor]:
    """A layer of chance weights."""
    return {key: torch.as_tensor(rng.standard_normal(value.shape), dtype=value.dtype) for key, value in like.items()}


def _mixed(layers: Sequence[dict[str, Tensor]], weights: Array) -> dict[str, Tensor]:
    """The layer that is a weighted sum of layers."""
    pairs = list(zip(weights.tolist(), layers, strict=True))
    return {key: torch.stack([w * layer[key] for w, layer in pairs]).sum(dim=0) for key in layers[0]}


def _main_directions(along: Array, count: int) -> Array:
    """Weights (count, columns) of the columns (rows, columns) whose sums vary most, apart from the first column.

    Each sum is orthogonal to the first column and the others, and as large as the first.
    """
    first = along[:, 0]
    shares = first @ along / (first @ first)
    left = along - np.outer(first, shares)
    left[:, 0] = 0.0
    _, values, rows = np.linalg.svd(left, full_matrices=False)
    found = []
    for value, row in list(zip(values, rows, strict=True))[:count]:
        if value > _LINEAR * values[0]:
            weights = row * np.linalg.norm(first) / value
            weights[0] = -(shares[1:] @ weights[1:])
            found.append(weights)
    return np.array(found).reshape(len(found), along.shape[1])
