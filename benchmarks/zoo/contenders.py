"""The models that the study compares, and how each is made from a case."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from undertow.measurements.prepared_logs import Inputs
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.networks.registry import NETWORKS
from undertow.residuals.training.epochs import train
from undertow.residuals.training.training_settings import Augmentation, Choice, TrainingSettings
from undertow.workflows.fit import fit

from .cases import Case
from .inertial import Inertial

NETWORKS[Inertial.name] = Inertial


@dataclass(frozen=True, slots=True)
class Contender:
    """A model of the study.

    Attributes
    ----------
    base : the vehicle under it: nominal or calibrated
    network : which, or None for a vehicle
    """

    base: str
    network: str | None = None
    pure: bool = False
    heading: bool = False
    settings: tuple[tuple[str, Any], ...] = ()


SHORT = (("epochs", 40), ("patience", 40))
"""The budget of a network: 350 of them are to be trained in half an hour on two processors."""
VARIED = Augmentation(thrust_spread=0.1, hull_spread=0.1)
CONTENDERS = {
    "Fossen as it is": Contender("nominal"),
    "Fossen calibrated": Contender("calibrated"),
    "pure MLP": Contender("nominal", "mlp", pure=True),
    "pure LSTM": Contender("nominal", "lstm", pure=True),
    "pure TCN": Contender("nominal", "tcn", pure=True),
    "residual MLP": Contender("nominal", "mlp"),
    "hybrid MLP": Contender("calibrated", "mlp"),
    "hybrid LSTM": Contender("calibrated", "lstm"),
    "hybrid TCN": Contender("calibrated", "tcn"),
    "hybrid MLP without laws": Contender("calibrated", "mlp", settings=(("lambda_phys", 0.0),)),
    "hybrid MLP that sees heading": Contender("calibrated", "mlp", heading=True),
    "hybrid MLP that sees its change": Contender("calibrated", "inertial", settings=(("sensor_noise", 0.0),)),
    "hybrid MLP, robust loss": Contender("calibrated", "mlp", settings=(("huber", 2.0),)),
    "hybrid MLP, varied": Contender("calibrated", "mlp", settings=(("augmentation", VARIED),)),
}


def vehicles(case: Case) -> dict[str, Callable[[], Vehicle]]:
    """The vehicles that stand under the models, each made when it is asked for."""
    return {"nominal": lambda: case.train.vehicle, "calibrated": lambda: fit(case.train).vehicle}


def made(who: Contender, base: Vehicle, inputs: Inputs, seed: int) -> Model:
    """The model, trained where it is a network."""
    if who.network is None:
        return VehicleModel(base, who.base)
    # Those of the paper count whole, and no audit chooses their epoch.
    settings = replace(TrainingSettings(seed=seed, trust=False), **dict(SHORT), **dict(who.settings))
    choice = Choice(who.network, pure=who.pure, heading=who.heading)
    return train(inputs.parts.split, base, choice, settings=settings).model
