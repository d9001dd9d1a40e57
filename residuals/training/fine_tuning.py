"""A training that goes on from a trained network: its layers, its inputs and their units, on the log of another boat.

Few minutes of a new hull tell too little for fresh weights. A network of a sister hull, or one that was made to be a
start (Nichol, Achiam and Schulman 2018), needs fewer. What it sees and says keeps the scale that it was trained with,
else its weights would mean something else; mass and thrusters are those of the new vehicle, and so is what it fades
beyond.
"""

import torch

from ...physics.errors import RequestError
from ...physics.vehicle import Vehicle
from ..models.network_inputs import input_names
from ..models.network_model import NetworkModel, scaling_of
from ..networks.base import Network, Scaling
from ..networks.registry import NETWORKS
from .training_settings import Choice


def going_on_from(start: NetworkModel) -> Choice:
    """The choice of a network like one that is trained, which starts as it.

    Raises
    ------
    RequestError
        for one that is not trained but grown, such as trees.
    """
    grown = start.network.grown
    if grown is not None:
        trained = ", ".join(name for name, network in NETWORKS.items() if network.grown is None)
        raise RequestError(
            f"train: expected a network that can go on learning, got the {grown.parts} of {start.name}, which are "
            f"{grown.how} anew; start from another ({trained}), or leave the start out"
        )
    heading = start.network.width > 3 + start.network.scaling.drives
    return Choice(start.network.name, dict(start.network.options), start.pure, heading, start=start)


def scaling_from(start: NetworkModel, vehicle: Vehicle, heading: bool) -> Scaling:
    """The constants of a network that goes on from another, for a vehicle.

    Raises
    ------
    RequestError
        when the vehicle has other thrusters than that of the start.
    """
    known, asked = start.network.scaling, input_names(vehicle, heading)
    if known.inputs.names != asked:
        raise RequestError(
            f"train: expected a vehicle whose network sees what that of {start.name} sees "
            f"({', '.join(known.inputs.names)}), got {', '.join(asked)}; start from a network of a boat with the same "
            "thrusters, or leave the start out"
        )
    return scaling_of(vehicle, known.inputs, known.output)


@torch.no_grad()
def take_weights(network: Network, start: NetworkModel) -> None:
    """Give a network the weights of the start; its constants stay its own."""
    given = dict(start.network.named_parameters())
    for name, parameter in network.named_parameters():
        parameter.copy_(given[name])
