"""Operations on vectors for tools with graphs: a trained network, and the simulation that it corrects.

The simulation is that of `NetworkModel.rollout`: the network sees the state at the beginning of a step, and its answer
is held during the step at the two-step Adams-Bashforth value 1.5 a_k - 0.5 a_(k-1), the first step at a_0. A program of
single numbers suits a hull; a layer of a network is one product with a matrix.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..physics.errors import RequestError
from ..physics.motion import Array
from .program.model_program import ACCELERATIONS, Program, network_inputs, program_of
from .program.symbols import Function, Group

if TYPE_CHECKING:
    from ..residuals.models.network_model import NetworkModel
    from ..residuals.networks.base import Network
    from ..residuals.networks.trust import Gain


Vector = Any
"""Whatever stands for a vector there: `+`, `-` and `*` act on elements, slices take some, as those of arrays do."""


class VectorOperations(ABC):
    """Operations on vectors that no sign stands for."""

    @abstractmethod
    def zeros(self, count: int) -> Vector:
        """A vector of zeros."""

    @abstractmethod
    def affine(self, weight: Array, bias: Array | None, x: Vector) -> Vector:
        """weight x + bias, for weight (m, n), bias (m,) and x (n,)."""

    @abstractmethod
    def tanh(self, x: Vector) -> Vector:
        """Hyperbolic tangent of each element."""

    @abstractmethod
    def relu(self, x: Vector) -> Vector:
        """Each element, or zero where it is negative."""

    @abstractmethod
    def joined(self, parts: Sequence[Vector]) -> Vector:
        """Vectors one after the other."""

    @abstractmethod
    def called(self, function: Function, groups: Mapping[str, Vector]) -> Vector:
        """What a function of a program gives; groups that it lacks are passed over."""


@dataclass(frozen=True, slots=True)
class Built:
    """A function that is built of vectors.

    Attributes
    ----------
    name, about : what it is called, and what it does
    inputs, outputs : groups of numbers
    build : the outputs by operations of a tool, from the inputs by name
    """

    name: str
    about: str
    inputs: tuple[Group, ...]
    outputs: tuple[Group, ...]
    build: Callable[[VectorOperations, Mapping[str, Vector]], Sequence[Vector]]


Weights = Mapping[str, Array]
_AXES = 3
"""Surge, sway and yaw."""


@dataclass(frozen=True, slots=True)
class _Layers:
    """Layers of a network on the vectors of a tool.

    Attributes
    ----------
    on : operations of the tool
    weights : weights and constants by name
    left : gain of the correction on each axis; None where it is said whole
    """

    on: VectorOperations
    weights: Weights
    left: Vector | None

    def linear(self, name: str, x: Vector) -> Vector:
        """A fully connected layer."""
        return self.on.affine(self.weights[f"{name}.weight"], self.weights[f"{name}.bias"], x)

    def gate(self, x: Vector) -> Vector:
        """1 / (1 + exp(-x)) by a hyperbolic tangent, which overflows nowhere."""
        return self.on.tanh(x * 0.5) * 0.5 + 0.5


_Told = tuple[Vector, Vector | None]
"""What a network says in units of its output, and what it remembers; None where it has no memory."""


def _hidden(layers: _Layers, activation: Callable[[Vector], Vector], x: Vector) -> Vector:
    layer = 0
    while f"body.{layer}.weight" in layers.weights:
        x = activation(layers.linear(f"body.{layer}", x))
        layer += 2  # after each its activation
    return x


def _parts(x: Vector, count: int, size: int = 1, begin: int = 0) -> list[Vector]:
    """Neighbouring parts of a vector, of one size."""
    return [x[k : k + size] for k in range(begin, begin + count * size, size)]


def _perceptron(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    return layers.linear("head", _hidden(layers, layers.on.relu, x)), None


def _smooth_perceptron(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    return layers.linear("head", _hidden(layers, layers.on.tanh, x)), None


def _recurrence(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    """Layers of an LSTM; memory: hidden states of all layers, then their cells."""
    on, weights = layers.on, layers.weights
    count = sum(name.startswith("body.weight_hh") for name in weights)
    units = weights["body.weight_hh_l0"].shape[1]
    before = _parts(on.zeros(2 * count * units) if memory is None else memory, 2 * count, units)
    hidden, cells = [], []
    for k in range(count):
        drive = on.affine(weights[f"body.weight_ih_l{k}"], weights[f"body.bias_ih_l{k}"], x)
        drive = drive + on.affine(weights[f"body.weight_hh_l{k}"], weights[f"body.bias_hh_l{k}"], before[k])
        taken, kept, cell, given = _parts(drive, 4, units)  # in PyTorch's order
        cells.append(layers.gate(kept) * before[count + k] + layers.gate(taken) * on.tanh(cell))
        x = layers.gate(given) * on.tanh(cells[k])
        hidden.append(x)
    return layers.linear("head", x), on.joined([*hidden, *cells])


def _convolutions(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    """Blocks of a TCN; memory: the rows before of each convolution, the oldest first."""
    on, weights = layers.on, layers.weights
    signal, kept, used, block = layers.linear("lift", x), [], 0, 0
    while f"blocks.{block}.0.weight" in weights:
        inner = signal
        for n in range(2):
            weight = weights[f"blocks.{block}.{n}.weight"]
            units, _, kernel = weight.shape
            reach = (kernel - 1) * 2**block
            # At first as if the first row had lasted.
            rows = [inner] * reach if memory is None else _parts(memory, reach, units, used)
            used += reach * units
            rows.append(inner)
            kept += rows[1:]
            taps = on.joined(rows[:: 2**block])
            flat = weight.transpose(0, 2, 1).reshape(units, kernel * units)
            inner = on.relu(on.affine(flat, weights[f"blocks.{block}.{n}.bias"], taps))
        signal = signal + inner
        block += 1
    return layers.linear("head", signal), on.joined(kept) if kept else None


def _dissipation(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    x = _hidden(layers, layers.on.tanh, x)
    return _accelerated(layers, _dissipated(layers, x, seen)), None


def _stores(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    """The same less E y, with stores y that follow E^T nu_r; memory: the stores."""
    on, weights = layers.on, layers.weights
    x = _hidden(layers, on.tanh, x)
    count = weights["kept"].size
    ports = layers.linear("ports", x) * np.repeat(weights["factor_scale"], count)
    moved = on.affine(np.repeat(np.eye(_AXES), count, axis=0), None, seen[0:_AXES])
    wanted = on.affine(np.tile(np.eye(count), _AXES), None, ports * moved)
    if layers.left is not None:
        wanted = wanted * on.affine(np.eye(_AXES)[[0] * count], None, layers.left)
    kept = 1.0 / (1.0 + np.exp(-weights["kept"]))
    stored = wanted if memory is None else memory * kept + wanted * (1.0 - kept)  # at first as if the row had lasted
    back = on.affine(np.repeat(np.eye(_AXES), count, axis=1), None, ports * on.joined([stored] * _AXES))
    return _accelerated(layers, _dissipated(layers, x, seen) - back), stored


def _accelerated(layers: _Layers, force: Vector) -> Vector:
    weights = layers.weights
    return layers.on.affine(weights["inverse_mass"] / weights["output_scale"][:, None], None, force)


def _dissipated(layers: _Layers, x: Vector, seen: Vector) -> Vector:
    """The force -(L L^T + S) nu_r + G T, element by element."""
    on, weights = layers.on, layers.weights
    u, v, r = _parts(seen, _AXES)
    scale = weights["factor_scale"][[0, 1, 1, 2, 2, 2]]  # of the rows of the lower triangle
    a, b, c, d, e, f = _parts(layers.linear("factor", x) * scale, 6)
    p, q, w = _parts(layers.linear("skew", x) * weights["skew_scale"], _AXES)
    one, two, three = a * u + b * v + d * r, c * v + e * r, f * r  # L^T nu_r
    lost = on.joined(
        [
            a * one + p * v + q * r,
            b * one + c * two + w * r - p * u,
            d * one + e * two + f * three - q * u - w * v,
        ]
    )
    drives = weights["drive.bias"].size // _AXES
    gains = on.tanh(layers.linear("drive", x)) * np.repeat(weights["drive_scale"], drives)
    pushed = gains * on.joined([seen[_AXES : _AXES + drives]] * _AXES)
    return on.affine(np.repeat(np.eye(_AXES), drives, axis=1), None, pushed) - lost


def _monomials(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    """Products of velocities, thrusts and heading, and of lags behind filters; memory: the filters."""
    on, weights = layers.on, layers.weights
    lower, upper, share = (weights[name] for name in ("lower", "upper", "share"))
    states, inputs = lower.size, weights["input_mean"].size
    given = seen[0:states]
    unit = np.hypot(weights["input_mean"], weights["input_scale"])[:states]
    held = (given + on.relu(given * -1.0 + lower) - on.relu(given - upper)) * (1.0 / unit)
    size = on.relu(held) + on.relu(held * -1.0)
    around = [seen[states:inputs]] if inputs > states else []
    one = on.affine(np.zeros((1, states)), np.ones(1), held)  # of as many rows as `held`, where a tool has rows
    factors = on.joined([one, held, size, *around])
    every = np.eye(1 + states + inputs)[weights["factors"].astype(int)]
    first, second, third = (on.affine(every[:, k], None, factors) for k in range(every.shape[1]))
    told = first * second * third
    if not share.size:
        return on.affine(weights["head.weight"], None, told), None
    now = on.affine(np.tile(np.eye(states), (share.size, 1)), None, held)
    way = np.repeat(share, states)
    after = now if memory is None else memory * (1.0 - way) + now * way  # at first as if the row had lasted
    return on.affine(weights["head.weight"], None, on.joined([told, now - after])), after


_KINDS: dict[str, Callable[[_Layers, Vector, Vector, Vector | None], _Told]] = {
    "mlp": _perceptron,
    "mlp of tanh": _smooth_perceptron,
    "lstm": _recurrence,
    "tcn": _convolutions,
    "dissipative": _dissipation,
    "port_hamiltonian": _stores,
    "ridge": _monomials,
}
"""Kinds of networks, each from standardised inputs, the inputs themselves, and the memory."""


def _memory_size(kind: str, weights: Weights) -> int:
    if kind == "lstm":
        return 2 * sum(weights[n].shape[1] for n in weights if n.startswith("body.weight_hh"))
    if kind == "tcn":
        shapes = {n: w.shape for n, w in weights.items() if n.startswith("blocks.") and n.endswith(".weight")}
        return sum(units * (kernel - 1) * 2 ** int(n.split(".")[1]) for n, (units, _, kernel) in shapes.items())
    if kind == "ridge":
        return weights["share"].size * weights["lower"].size
    return weights["kept"].size if kind == "port_hamiltonian" else 0


def _gain(on: VectorOperations, gain: "Gain", standardised: Vector) -> Vector:
    """The gain of a correction on each axis, see `residuals.networks.trust`."""
    names = ("rows", "ends", "steep", "weights")
    rows, ends, steep, weights = (gain.get_buffer(name).cpu().numpy().astype(float) for name in names)
    over = on.relu(on.affine(rows, -ends, standardised[0 : gain.inputs]))
    lost = np.repeat(-steep[:, None], ends.size, axis=1)
    left = on.relu(on.affine(lost, np.ones(steep.size), over * over))
    return on.affine(weights, np.zeros(_AXES), left * left)


def weights_of(network: "Network") -> dict[str, Array]:
    """Weights and constants of a network by name, in double precision."""
    return {name: tensor.detach().cpu().numpy().astype(float) for name, tensor in network.state_dict().items()}


class CorrectedProgram:
    """A program and the network that corrects it, or that stands in the place of its physics.

    Attributes
    ----------
    program : `step` takes what the network says as an acceleration beside the model's own
    seen : what the network sees in a state
    built : `correction`, and the simulation `start_corrected` and `step_corrected`

    Raises
    ------
    RequestError
        for a network whose layers have no operations here.
    """

    def __init__(self, model: "NetworkModel") -> None:
        network = model.network.plain()
        kind = network.name + " of tanh" * (network.options.get("activation") == 2)
        if kind not in _KINDS:
            raise RequestError(
                f"export: expected a network of the kinds {', '.join(_KINDS)}, got {kind}; train one of these, or let "
                "'undertow explain' say what of it is a named effect"
            )
        self.program: Program = program_of(
            model.vehicle, model.time_step, corrected="in place" if model.pure else "beside"
        )
        self.seen: Function = network_inputs(self.program.vehicle, model.time_step, model.heading)
        self._kind, self._weights, self._trusted = kind, weights_of(network), network.gain
        remembered = tuple(f"memory_{k}" for k in range(_memory_size(kind, self._weights)))
        self._memory = Group("memory", "what the network remembers", remembered)
        said = Group("correction", "acceleration [m/s^2, m/s^2, rad/s^2]", ACCELERATIONS)
        about = "What the network says of what it sees and remembers."
        kept = (self._memory,) * bool(self._memory.members)
        after = tuple(Group("memory_after", "what it remembers then", one.members) for one in kept)

        def listen(on: VectorOperations, given: Mapping[str, Vector]) -> list[Vector]:
            return self._says(on, given["seen"], given.get("memory"))

        listens = Built("correction", about, (self.seen.outputs[0][0], *kept), (said, *after), listen)
        self.built = (listens, self._start(), self._step())

    def _says(self, on: VectorOperations, seen: Vector, memory: Vector | None) -> list[Vector]:
        """What the network says in m/s^2 and rad/s^2, and what it remembers, if anything."""
        w = self._weights
        standardised = (seen - w["input_mean"]) * (1.0 / w["input_scale"])
        left = None if self._trusted is None else _gain(on, self._trusted, standardised)
        said, after = _KINDS[self._kind](_Layers(on, w, left), standardised, seen, memory)
        if left is not None:
            said = said * left
        return [said * w["output_scale"], *([] if after is None else [after])]

    @property
    def _whole(self) -> Group:
        """State of the simulation: of the program, the memory, and what was said of this state and the one before."""
        body = self.program.step.inputs[0]
        text = f"{body.about}; then what the network remembers, what it says now, and what it said a step ago"
        last = tuple(f"{name}_before" for name in ACCELERATIONS)
        return Group("state", text, (*body.members, *self._memory.members, *ACCELERATIONS, *last))

    def _inputs(self, function: Function) -> list[Group]:
        """Groups of a function beside state and correction, and the time where the network needs it."""
        groups = {group.name: group for group in (*function.inputs, *self.seen.inputs[1:])}
        return [group for name, group in groups.items() if name not in ("state", "added")]

    def _start(self) -> Built:
        start = self.program.start

        def build(on: VectorOperations, given: Mapping[str, Vector]) -> list[Vector]:
            first = on.called(start, given)
            said, *memory = self._says(on, on.called(self.seen, {**given, "state": first}), None)
            return [on.joined([first, *memory, said, said])]

        about = f"{start.about} The network has seen nothing before."
        return Built("start_corrected", about, tuple(self._inputs(start)), (self._whole,), build)

    def _step(self) -> Built:
        step, size, kept = self.program.step, len(self.program.state), len(self._memory.members)
        whole = self._whole

        def build(on: VectorOperations, given: Mapping[str, Vector]) -> list[Vector]:
            state, here = given["state"], size + kept
            memory = state[size:here] if kept else None
            now, last = _parts(state, 2, _AXES, here)
            after = on.called(step, {**given, "state": state[0:size], "added": now * 1.5 - last * 0.5})
            then = dict(given)
            if "minutes" in given:
                then["minutes"] = given["minutes"] + self.program.time_step / 60.0
            said, *memory_after = self._says(on, on.called(self.seen, {**then, "state": after}), memory)
            return [on.joined([after, *memory_after, said, now])]

        after = Group("after", f"the next {whole.about}", whole.members)
        return Built("step_corrected", step.about, (whole, *self._inputs(step)), (after,), build)
