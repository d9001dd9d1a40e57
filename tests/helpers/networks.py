"""Networks of random numbers beside a boat, and how what runs an export of one is compared with its own rollouts."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from exported import EXACT, error, facts

from undertow.exports.formats.base import Given, format_named
from undertow.exports.network_operations import Built
from undertow.measurements.preparation.resampling import Standardisation
from undertow.physics.forces import actuation
from undertow.physics.integration import Around, Driven, integrate
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.network_inputs import input_names, stacked_inputs
from undertow.residuals.models.network_model import NetworkModel, scaling_of
from undertow.residuals.networks.base import Network
from undertow.residuals.networks.registry import build
from undertow.residuals.networks.trust import Trust

NETWORKS = [
    ("mlp", {"units": 16, "layers": 2}, True, False),
    ("mlp", {"units": 16, "activation": 2}, False, False),
    ("lstm", {"units": 8, "layers": 2}, False, False),
    ("lstm", {"units": 8}, True, True),
    ("tcn", {"units": 6, "layers": 2}, False, False),
    ("tcn", {"units": 6, "layers": 1, "kernel": 2}, True, True),
    ("dissipative", {"units": 12}, True, False),
    ("port_hamiltonian", {"units": 12, "stores": 5}, True, False),
    ("symmetric", {"units": 8, "layers": 2}, False, False),
    ("ridge", {"filters": 2}, True, False),
    ("ridge", {}, False, False),
    ("dissipative", {"units": 12, "layers": 2}, False, True),
]
"""Kind, options, whether it sees the heading, and whether it is in the place of the physics."""
_STEP, _ROWS, _COUNT = 0.1, 301, 100
"""Of the rollouts: 30 s in steps of the networks, a hundred of them."""


def weights_of(network: Network) -> list[torch.nn.Parameter]:
    """What may be any number: not the ends and filters of a ridge, nor the whole numbers of trees."""
    named = dict(network.named_parameters())
    return [p for name, p in named.items() if name not in ("lower", "upper", "share") and p.is_floating_point()]


def learnt(kind: str, options: dict, heading: bool, pure: bool, double: bool = True) -> NetworkModel:
    """A network of random numbers, with a boat that has lag, delay, wear, a wake and a current."""
    changes = {"lag": 0.3, "delay": 0.17, "thrust_rate": -0.02, "current_north": 0.1, "memory_yaw": 3.0, "wind_x": 0.1}
    hull = load_vehicle("otter").with_values(changes)
    names = input_names(hull, heading)
    rng = np.random.default_rng(5)
    constants = Standardisation(names, rng.normal(size=len(names)), rng.uniform(5.0, 20.0, len(names)))
    network = build(kind, scaling_of(hull, constants, np.array([0.05, 0.02, 0.08])), options)
    network = network.double() if double else network
    generator = torch.Generator().manual_seed(3)
    with torch.no_grad():
        for parameter in weights_of(network):
            parameter.copy_(0.3 * torch.randn(parameter.shape, generator=generator))
        for name, end in (("lower", -9.0), ("upper", 11.0)):  # of a polynomial
            if name in dict(network.named_parameters()):
                network.get_parameter(name).fill_(end)
    if not pure:
        network.trust(Trust.within(rng.normal(0.0, 0.4, (600, 3 + network.scaling.drives)), 1.5))
    return NetworkModel(hull, network, _STEP, pure=pure)


def exported(model: NetworkModel, to: str, path: Path) -> Path:
    """Write a network in a format."""
    given = Given(model.vehicle, facts("as it is"), network=model)
    for each, content in format_named(to).files(given, path).items():
        each.write_bytes(content)
    return path


def _motions(seed: int = 8) -> list[Motion]:
    """Starts, commands and winds of the rollouts."""
    rng = np.random.default_rng(seed)
    time, found = _STEP * np.arange(_ROWS, dtype=float), []
    for _ in range(_COUNT):
        knots, air = rng.uniform(-90.0, 90.0, (2, 32)), rng.uniform(-8.0, 8.0, 2)
        commands = np.column_stack([np.interp(time, np.arange(32.0), column) for column in knots])
        heading, velocity = rng.uniform(-3.0, 3.0), rng.normal(0.0, 0.3, 3)
        still = np.zeros((_ROWS, 2)), np.full(_ROWS, heading), np.tile(velocity, (_ROWS, 1))
        found.append(Motion(time, *still, commands, ("port", "stbd"), air=np.tile(air, (_ROWS, 1))))
    return found


def rolled_out(model: NetworkModel, motions: list[Motion]) -> np.ndarray:
    """What `NetworkModel.rollout` gives of first rows (motions, rows, 6), all side by side."""
    acts = [actuation(model.vehicle, motion) for motion in motions]
    thrust, load = (np.stack([getattr(act, part) for act in acts], axis=-1) for part in ("thrust", "load"))
    air = np.stack([np.asarray(motion.air).T for motion in motions], axis=-1)
    first = np.array([[*m.position[0], m.heading[0], *m.velocity[0]] for m in motions])
    memory, last = None, None

    def added(k: int, state: np.ndarray) -> np.ndarray:
        nonlocal memory, last
        seen = stacked_inputs(model.vehicle, state[2], (state[3], state[4], state[5]), thrust[:, k], model.heading)
        with torch.inference_mode():
            said, memory = model.network(model.tensor(seen)[:, None], memory)
        now, before = said[:, 0].double().numpy().T, last
        last = now
        return now if before is None else 1.5 * now - 0.5 * before

    forces = (np.zeros((0, *thrust.shape[1:])),) * 2 if model.pure else (thrust, load)
    driven = Driven(None if model.pure else model.vehicle, first, *forces, around=Around(air))
    return integrate(driven, _STEP, added).states


def compare_network(
    model: NetworkModel,
    functions: tuple[Built, Built],
    answer: Callable[[Built, np.ndarray], np.ndarray],
    most: float = EXACT,
) -> None:
    """100 rollouts of 30 s side by side; `answer` gives what a function makes of rows of all its inputs."""
    start, step = functions
    motions = _motions()
    expected = rolled_out(model, motions)
    own = model.rollout(motions[0], np.array([0]), _ROWS - 1).states[0]
    assert error(expected[0], own) < most / 10.0
    alone = VehicleModel(model.vehicle, "alone").rollout(motions[0], np.array([0]), _ROWS - 1).states[0]
    assert error(alone, own) > 1e-2
    commands = np.stack([motion.commands for motion in motions], axis=1)
    air = np.array([np.asarray(motion.air)[0] for motion in motions])

    def given(built: Built, k: int, at: float) -> np.ndarray:
        known = {
            "motion": expected[:, 0],
            "command": commands[k],
            "air": air,
            "minutes": np.full((_COUNT, 1), at / 60.0),
        }
        return np.concatenate([known[group.name] for group in built.inputs if group.name in known], axis=1)

    state = answer(start, given(start, 0, 0.0))
    found = [state[:, :6]]
    for k in range(_ROWS - 1):
        state = answer(step, np.concatenate([state, given(step, k + 1, k * _STEP)], axis=1))
        found.append(state[:, :6])
    assert max(map(error, np.array(found).swapaxes(0, 1), expected)) < most
