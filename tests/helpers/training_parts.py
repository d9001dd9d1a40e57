"""What trainings are tried on: parts of simulated worlds, and networks with random weights."""

from dataclasses import replace

import numpy as np
import torch

from undertow.measurements.preparation.prepare import PAPER, DataSet
from undertow.measurements.preparation.resampling import Standardisation, smooth
from undertow.measurements.preparation.split import Split, split
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import scaling_of
from undertow.residuals.networks.base import Network
from undertow.residuals.networks.registry import build
from undertow.residuals.training.windows import windows_of

HULL = load_vehicle("blueboat")


def parts_of(effects: dict[str, float], seconds: float = 120.0, noise: str = "field", logs: int = 1) -> Split:
    worlds = [simulate_world(HULL, effects, duration=seconds, noise=noise, seed=k) for k in range(logs)]
    raw = tuple(replace(world.motion(0.1), source=f"{k}") for k, world in enumerate(worlds))
    smoothed = tuple(smooth(motion, 1.2) for motion in raw)
    return split(DataSet(smoothed, (), PAPER, raw))


def fresh(name: str, split_: Split, vehicle: Vehicle = HULL, heading: bool = False, seed: int = 0) -> Network:
    """A network with random weights everywhere, its head included, in double precision."""
    windows = windows_of(split_.train, vehicle, pure=False, heading=heading, seconds=10.0, warm_up=2.0)
    seen = windows.inputs.reshape(-1, windows.inputs.shape[-1])
    scaling = scaling_of(vehicle, Standardisation.of(input_names(vehicle, heading), seen), np.array([0.1, 0.1, 0.2]))
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        network = build(name, scaling, {"units": 8})
        with torch.no_grad():
            for parameter in network.parameters():
                parameter.copy_(0.3 * torch.randn_like(parameter))
    return network.double()
