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
"""Whatever stands for a vector there."""


class VectorOperations(ABC):
    """Operations on vectors."""

    @abstractmethod
    def constant(self, values: Array) -> Vector:
        """A vector that is known."""

    @abstractmethod
    def affine(self, weight: Array, bias: Array | None, x: Vector) -> Vector:
        """weight x + bias, for weight (m, n), bias (m,) and x (n,)."""

    @abstractmethod
    def add(self, a: Vector, b: Vector) -> Vector:
        """Elements added."""

    @abstractmethod
    def mul(self, a: Vector, b: Vector) -> Vector:
        """Elements multiplied."""

    @abstractmethod
    def tanh(self, x: Vector) -> Vector:
        """Hyperbolic tangent of each element."""

    @abstractmethod
    def relu(self, x: Vector) -> Vector:
        """Each element, or zero where it is negative."""

    @abstractmethod
    def part(self, x: Vector, begin: int, end: int) -> Vector:
        """The elements from one place up to another, which is left out."""

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
_GATES = 4
"""Of a cell of an LSTM, in PyTorch's order: input, forget, cell, output."""
_AXES = 3
"""Surge, sway and yaw."""


class _Layers:
    """Layers of a network on the vectors of a tool.

    Attributes
    ----------
    on : operations of the tool
    weights : weights and constants by name
    left : gain of the correction on each axis; None where it is said whole
    """

    def __init__(self, on: VectorOperations, weights: Weights, left: Vector | None) -> None:
        self.on, self.weights, self.left = on, weights, left

    def linear(self, name: str, x: Vector) -> Vector:
        """A fully connected layer."""
        return self.on.affine(self.weights[f"{name}.weight"], self.weights[f"{name}.bias"], x)

    def scaled(self, values: Array, x: Vector) -> Vector:
        """Elements times numbers."""
        return self.on.mul(self.on.constant(values), x)

    def gate(self, x: Vector) -> Vector:
        """1 / (1 + exp(-x)) by a hyperbolic tangent, which overflows nowhere."""
        half = np.array([0.5])
        return self.on.add(self.on.constant(half), self.scaled(half, self.on.tanh(self.scaled(half, x))))


_Told = tuple[Vector, Vector | None]
"""What a network says in units of its output, and what it remembers; None where it has no memory."""


def _hidden(layers: _Layers, activation: Callable[[Vector], Vector], x: Vector) -> Vector:
    layer = 0
    while f"body.{layer}.weight" in layers.weights:
        x = activation(layers.linear(f"body.{layer}", x))
        layer += 2  # after each its activation
    return x


def _perceptron(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    return layers.linear("head", _hidden(layers, layers.on.relu, x)), None


def _smooth_perceptron(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    return layers.linear("head", _hidden(layers, layers.on.tanh, x)), None


def _recurrence(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    """Layers of an LSTM; memory: hidden states of all layers, then their cells."""
    on, weights = layers.on, layers.weights
    count = sum(name.startswith("body.weight_hh") for name in weights)
    units = weights["body.weight_hh_l0"].shape[1]
    before = on.constant(np.zeros(2 * count * units)) if memory is None else memory
    hidden, cells = [], []
    for k in range(count):
        own = on.part(before, k * units, (k + 1) * units)
        cell = on.part(before, (count + k) * units, (count + k + 1) * units)
        drive = on.add(
            on.affine(weights[f"body.weight_ih_l{k}"], weights[f"body.bias_ih_l{k}"], x),
            on.affine(weights[f"body.weight_hh_l{k}"], weights[f"body.bias_hh_l{k}"], own),
        )
        gates = [on.part(drive, n * units, (n + 1) * units) for n in range(_GATES)]
        taken, kept, given = (layers.gate(gates[n]) for n in (0, 1, 3))
        cell = on.add(on.mul(kept, cell), on.mul(taken, on.tanh(gates[2])))
        x = on.mul(given, on.tanh(cell))
        hidden.append(x)
        cells.append(cell)
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
            if memory is None:  # as if the first row had lasted
                rows = [inner] * reach
            else:
                rows = [on.part(memory, used + k * units, used + (k + 1) * units) for k in range(reach)]
            used += reach * units
            rows.append(inner)
            kept += rows[1:]
            taps = on.joined(rows[:: 2**block])
            flat = weight.transpose(0, 2, 1).reshape(units, kernel * units)
            inner = on.relu(on.affine(flat, weights[f"blocks.{block}.{n}.bias"], taps))
        signal = on.add(signal, inner)
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
    scale = np.repeat(weights["factor_scale"], count)
    ports = layers.scaled(scale, layers.linear("ports", x))
    moved = on.affine(np.repeat(np.eye(_AXES), count, axis=0), None, on.part(seen, 0, _AXES))
    wanted = on.affine(np.tile(np.eye(count), _AXES), None, on.mul(ports, moved))
    if layers.left is not None:
        wanted = on.mul(on.affine(np.eye(_AXES)[[0] * count], None, layers.left), wanted)
    kept = 1.0 / (1.0 + np.exp(-weights["kept"]))
    stored = wanted
    if memory is not None:  # else as if the first row had lasted
        stored = on.add(layers.scaled(kept, memory), layers.scaled(1.0 - kept, wanted))
    back = on.affine(-np.repeat(np.eye(_AXES), count, axis=1), None, on.mul(ports, on.joined([stored] * _AXES)))
    return _accelerated(layers, on.add(_dissipated(layers, x, seen), back)), stored


def _accelerated(layers: _Layers, force: Vector) -> Vector:
    weights = layers.weights
    return layers.on.affine(weights["inverse_mass"] / weights["output_scale"][:, None], None, force)


def _dissipated(layers: _Layers, x: Vector, seen: Vector) -> Vector:
    """The force -(L L^T + S) nu_r + G T, element by element."""
    on, weights = layers.on, layers.weights
    u, v, r = (on.part(seen, k, k + 1) for k in range(_AXES))
    scale = weights["factor_scale"][[0, 1, 1, 2, 2, 2]]  # of the rows of the lower triangle
    lower = layers.scaled(scale, layers.linear("factor", x))
    a, b, c, d, e, f = (on.part(lower, k, k + 1) for k in range(6))
    skew = layers.scaled(weights["skew_scale"], layers.linear("skew", x))
    p, q, w = (on.part(skew, k, k + 1) for k in range(_AXES))

    def summed(*products: tuple[Vector, Vector]) -> Vector:
        total = on.mul(*products[0])
        for pair in products[1:]:
            total = on.add(total, on.mul(*pair))
        return total

    along = (summed((a, u), (b, v), (d, r)), summed((c, v), (e, r)), on.mul(f, r))
    damping = (
        on.mul(a, along[0]),
        summed((b, along[0]), (c, along[1])),
        summed((d, along[0]), (e, along[1]), (f, along[2])),
    )
    back = layers.scaled(np.array([-1.0]), on.joined([u, v]))
    minus_u, minus_v = on.part(back, 0, 1), on.part(back, 1, 2)
    turning = (summed((p, v), (q, r)), summed((w, r), (p, minus_u)), summed((q, minus_u), (w, minus_v)))
    drives = weights["drive.bias"].size // _AXES
    gains = layers.scaled(np.repeat(weights["drive_scale"], drives), on.tanh(layers.linear("drive", x)))
    thrusts = on.part(seen, _AXES, _AXES + drives)
    pushed = on.mul(gains, on.joined([thrusts] * _AXES))
    sums = np.repeat(np.eye(_AXES), drives, axis=1)
    lost = layers.scaled(np.full(_AXES, -1.0), on.add(on.joined(damping), on.joined(turning)))
    return on.add(on.affine(sums, None, pushed), lost)


def _monomials(layers: _Layers, x: Vector, seen: Vector, memory: Vector | None) -> _Told:
    """Products of velocities, thrusts and heading, and of lags behind filters; memory: the filters."""
    on, weights = layers.on, layers.weights
    lower, upper, share = (weights[name] for name in ("lower", "upper", "share"))
    states, angles = lower.size, weights["input_mean"].size - lower.size
    given = on.part(seen, 0, states)
    both = np.vstack([np.eye(states), -np.eye(states)])
    beyond = on.relu(on.affine(-both, np.concatenate([lower, -upper]), given))
    held = on.add(given, on.affine(both.T, None, beyond))
    unit = np.hypot(weights["input_mean"], weights["input_scale"])[:states]
    held = layers.scaled(1.0 / unit, held)
    size = on.affine(np.abs(both).T, None, on.relu(on.affine(both, None, held)))
    around = [on.part(seen, states, states + angles)] if angles else []
    one = on.affine(np.zeros((1, states)), np.ones(1), held)  # of as many rows as `held`, where a tool has rows
    factors = on.joined([one, held, size, *around])
    every = np.eye(1 + 2 * states + angles)[weights["factors"].astype(int)]
    chosen = [on.affine(every[:, k], None, factors) for k in range(every.shape[1])]
    told = on.mul(on.mul(chosen[0], chosen[1]), chosen[2])
    if not share.size:
        return on.affine(weights["head.weight"], None, told), None
    now = on.affine(np.tile(np.eye(states), (share.size, 1)), None, held)
    after = now  # as if the first row had lasted
    if memory is not None:
        way = np.repeat(share, states)
        after = on.add(layers.scaled(1.0 - way, memory), layers.scaled(way, now))
    lag = on.add(now, layers.scaled(np.full(share.size * states, -1.0), after))
    return on.affine(weights["head.weight"], None, on.joined([told, lag])), after


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
    over = on.relu(on.affine(rows, -ends, on.part(standardised, 0, gain.inputs)))
    lost = np.repeat(-steep[:, None], ends.size, axis=1)
    left = on.relu(on.affine(lost, np.ones(steep.size), on.mul(over, over)))
    return on.affine(weights, np.zeros(_AXES), on.mul(left, left))


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
        self._memory = Group(
            "memory", "what the network remembers", _numbered("memory", _memory_size(kind, self._weights))
        )
        said = Group("correction", "acceleration [m/s^2, m/s^2, rad/s^2]", ACCELERATIONS)
        about = "What the network says of what it sees and remembers."
        kept = (self._memory,) * bool(self._memory.members)
        after = tuple(Group("memory_after", "what it remembers then", one.members) for one in kept)
        listens = Built("correction", about, (self.seen.outputs[0][0], *kept), (said, *after), self._listened)
        self.built = (listens, self._start(), self._step())

    def _says(self, on: VectorOperations, seen: Vector, memory: Vector | None) -> _Told:
        """What the network says in m/s^2 and rad/s^2, and remembers."""
        w = self._weights
        shifted = on.add(on.constant(-w["input_mean"]), seen)
        standardised = on.mul(on.constant(1.0 / w["input_scale"]), shifted)
        layers = _Layers(on, w, None if self._trusted is None else _gain(on, self._trusted, standardised))
        said, after = _KINDS[self._kind](layers, standardised, seen, memory)
        if layers.left is not None:
            said = on.mul(layers.left, said)
        return layers.scaled(w["output_scale"], said), after

    def _listened(self, on: VectorOperations, given: Mapping[str, Vector]) -> list[Vector]:
        said, after = self._says(on, given["seen"], given.get("memory"))
        return [said] if after is None else [said, after]

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
            said, memory = self._says(on, on.called(self.seen, {**given, "state": first}), None)
            return [on.joined([first, *([] if memory is None else [memory]), said, said])]

        about = f"{start.about} The network has seen nothing before."
        return Built("start_corrected", about, tuple(self._inputs(start)), (self._whole,), build)

    def _step(self) -> Built:
        step, size, kept = self.program.step, len(self.program.state), len(self._memory.members)
        whole = self._whole

        def build(on: VectorOperations, given: Mapping[str, Vector]) -> list[Vector]:
            state, here = given["state"], size + kept
            memory = on.part(state, size, here) if kept else None
            now, last = (on.part(state, here + k, here + k + _AXES) for k in (0, _AXES))
            held = on.add(on.mul(on.constant(np.array([1.5])), now), on.mul(on.constant(np.array([-0.5])), last))
            after = on.called(step, {**given, "state": on.part(state, 0, size), "added": held})
            then = dict(given)
            if "minutes" in given:
                then["minutes"] = on.add(given["minutes"], on.constant(np.array([self.program.time_step / 60.0])))
            said, memory = self._says(on, on.called(self.seen, {**then, "state": after}), memory)
            return [on.joined([after, *([] if memory is None else [memory]), said, now])]

        after = Group("after", f"the next {whole.about}", whole.members)
        return Built("step_corrected", step.about, (whole, *self._inputs(step)), (after,), build)


def _numbered(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}_{k}" for k in range(count))
