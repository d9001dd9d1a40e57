"""A trained network beside a vehicle's physics as CasADi functions: plain operations, its memory among the states.

The simulation is that of `NetworkModel.rollout`: the network sees the state at the beginning of a step, and what it
says is held during the step at the two-step Adams-Bashforth value 1.5 a_k - 0.5 a_(k-1), the first step at a_0.
"""

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..physics.errors import RequestError
from ..physics.frames import Array
from .program.functions import Function

if TYPE_CHECKING:
    from ..residuals.models.network_model import NetworkModel

Weights = Mapping[str, Array]
_GATES = 4
"""Of a cell of an LSTM, in PyTorch's order: input, forget, cell, output."""


def weights_of(model: "NetworkModel") -> dict[str, Array]:
    """Weights and constants of a network by name, in double precision."""
    return {name: tensor.detach().cpu().numpy().astype(float) for name, tensor in model.network.state_dict().items()}


def correction(casadi: ModuleType, model: "NetworkModel") -> Any:
    """What the network says of what it sees and remembers: a function (seen, memory) -> (correction, memory after).

    Raises
    ------
    RequestError
        for a network whose layers have no plain operations here.
    """
    network, weights = model.network, weights_of(model)
    layers = {"mlp": _perceptron, "lstm": _recurrence}
    if network.name not in layers:
        raise RequestError(
            f"export: expected a network of the kinds {' or '.join(layers)}, got {network.name}; train one of these, "
            "or let 'undertow explain' say what of it is a named effect"
        )
    seen = casadi.MX.sym("seen", network.width)
    size = _memory_size(network.name, weights)
    memory = casadi.MX.sym("memory", size)
    standardised = (seen - weights["input_mean"]) / weights["input_scale"]
    said, after = layers[network.name](casadi, weights, standardised, memory)
    outputs = [weights["output_scale"] * _linear(casadi, weights, "head", said), after]
    return casadi.Function("correction", [seen, memory], outputs, ["seen", "memory"], ["correction", "memory_after"])


def _linear(casadi: ModuleType, weights: Weights, name: str, x: Any) -> Any:
    return casadi.mtimes(casadi.DM(weights[f"{name}.weight"]), x) + weights[f"{name}.bias"]


def _perceptron(casadi: ModuleType, weights: Weights, x: Any, memory: Any) -> tuple[Any, Any]:
    layer = 0
    while f"body.{layer}.weight" in weights:
        x = casadi.fmax(_linear(casadi, weights, f"body.{layer}", x), 0.0)
        layer += 2  # after each a ReLU
    return x, memory


def _recurrence(casadi: ModuleType, weights: Weights, x: Any, memory: Any) -> tuple[Any, Any]:
    """Layers of an LSTM; memory: hidden states of all layers, then their cells."""
    layers = sum(name.startswith("body.weight_hh") for name in weights)
    units = weights["body.weight_hh_l0"].shape[1]
    hidden, cells = [], []
    for k in range(layers):
        before = memory[k * units : (k + 1) * units]
        cell = memory[(layers + k) * units : (layers + k + 1) * units]
        drive = casadi.mtimes(casadi.DM(weights[f"body.weight_ih_l{k}"]), x) + weights[f"body.bias_ih_l{k}"]
        drive += casadi.mtimes(casadi.DM(weights[f"body.weight_hh_l{k}"]), before) + weights[f"body.bias_hh_l{k}"]
        gates = [drive[n * units : (n + 1) * units] for n in range(_GATES)]
        taken, kept, given = (0.5 + 0.5 * casadi.tanh(0.5 * gates[n]) for n in (0, 1, 3))
        cell = kept * cell + taken * casadi.tanh(gates[2])
        x = given * casadi.tanh(cell)
        hidden.append(x)
        cells.append(cell)
    return x, casadi.vertcat(*hidden, *cells)


def _memory_size(name: str, weights: Weights) -> int:
    if name != "lstm":
        return 0
    return 2 * sum(weights[n].shape[1] for n in weights if n.startswith("body.weight_hh"))


def corrected_functions(
    casadi: ModuleType, model: "NetworkModel", asked: Sequence[Function], physics: Mapping[str, Any]
) -> list[Any]:
    """`start_corrected` and `step_corrected`: the state is that of the physics, the memory, and what was said last.

    Parameters
    ----------
    asked : the functions seen, start and step of the program
    physics : the same as CasADi functions, by name
    """
    says = correction(casadi, model)
    seen, start, step = asked
    size, remembered = len(step.inputs[0].members), says.numel_in(1)

    def listened(state: Any, memory: Any, minutes: Any) -> tuple[Any, Any]:
        return says(physics["seen"](*([state, minutes] if len(seen.inputs) > 1 else [state])), memory)

    def symbols(function: Function) -> dict[str, Any]:
        kept = [group for group in function.inputs if group.name not in ("state", "added")]
        return {group.name: casadi.MX.sym(group.name, len(group.members)) for group in kept}

    given = symbols(start)
    clock = given.setdefault("minutes", casadi.MX.sym("minutes", 1))
    first = physics["start"](*(given[group.name] for group in start.inputs))
    said, memory = listened(first, np.zeros(remembered), clock)
    whole = casadi.vertcat(first, memory, said, said)
    made = [casadi.Function("start_corrected", [*given.values()], [whole], [*given], ["state"])]
    given = symbols(step)
    clock = given.setdefault("minutes", casadi.MX.sym("minutes", 1))
    state = casadi.MX.sym("state", size + remembered + 6)
    body, memory = state[:size], state[size : size + remembered]
    now, last = state[size + remembered : size + remembered + 3], state[size + remembered + 3 :]
    at_hand = given | {"state": body, "added": 1.5 * now - 0.5 * last}
    after = physics["step"](*(at_hand[group.name] for group in step.inputs))
    said, memory = listened(after, memory, clock + model.time_step / 60.0)
    whole = casadi.vertcat(after, memory, said, now)
    names = ["state", *given]
    return [says, *made, casadi.Function("step_corrected", [state, *given.values()], [whole], names, ["after"])]
