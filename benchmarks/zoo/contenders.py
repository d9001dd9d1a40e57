"""The models that the study compares, and how each is made from a case."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from undertow.comparison.audit import audit_along
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.training.choosing import Verdict
from undertow.residuals.training.epochs import train
from undertow.residuals.training.training_settings import Augmentation, Choice, TrainingSettings
from undertow.workflows.discover_and_add import discover
from undertow.workflows.fit import fit

from .cases import Case


@dataclass(frozen=True, slots=True)
class Contender:
    """A model of the study.

    Attributes
    ----------
    network : which, or None for a vehicle
    case : the only case that it takes part in; empty for all
    base : the vehicle under it: true, nominal, calibrated or symbolic
    audited : the best epochs are put before the laws, the first that keeps them is kept
    """

    base: str
    network: str | None = None
    pure: bool = False
    heading: bool = False
    settings: tuple[tuple[str, Any], ...] = ()
    case: str = ""
    audited: bool = True


FREE = (("lambda_phys", 0.0),)
VARIED = Augmentation(thrust_spread=0.1, hull_spread=0.1)
CONTENDERS = {
    "the true boat": Contender("true"),
    "Fossen as it is": Contender("nominal"),
    "Fossen calibrated": Contender("calibrated"),
    "symbolic": Contender("symbolic"),
    "residual MLP": Contender("nominal", "mlp", settings=FREE),
    "hybrid MLP": Contender("calibrated", "mlp"),
    "hybrid LSTM": Contender("calibrated", "lstm"),
    "hybrid TCN": Contender("calibrated", "tcn"),
    "hybrid transformer": Contender("calibrated", "transformer"),
    "hybrid dissipative": Contender("calibrated", "dissipative"),
    "pure MLP": Contender("nominal", "mlp", pure=True),
    "pure LSTM": Contender("nominal", "lstm", pure=True),
    "pure TCN": Contender("nominal", "tcn", pure=True),
    "hybrid LSTM that sees no noise": Contender("calibrated", "lstm", settings=(("sensor_noise", 0.0),)),
    "hybrid LSTM through rollouts": Contender("calibrated", "lstm", settings=(("rollout_rows", 10), ("epochs", 60))),
    "hybrid LSTM, varied": Contender("calibrated", "lstm", settings=(("augmentation", VARIED),)),
    "hybrid LSTM that sees heading": Contender("calibrated", "lstm", heading=True, case="gazebo C"),
}


def vehicles(case: Case) -> dict[str, Callable[[], Vehicle]]:
    """The vehicles that stand under the models, each made when it is asked for; the true one where it is known."""
    inputs, true = case.train, case.true
    known = {} if true is None else {"true": lambda: true}
    return known | {
        "nominal": lambda: inputs.vehicle,
        "calibrated": lambda: fit(inputs).vehicle,
        "symbolic": lambda: discover(inputs).discovery.corrected,
    }


def made(who: Contender, base: Vehicle, inputs: Inputs, seed: int) -> tuple[Model, dict[str, Any]]:
    """The model, trained where it is a network, and what training had to say."""
    if who.network is None:
        return VehicleModel(base, who.base), {}
    # What a network says beyond its training is judged here; `benchmarks/fading.py` judges what is left where it fades.
    settings = replace(TrainingSettings(seed=seed, fade=0.0), **dict(who.settings))

    def judged(model: NetworkModel) -> Verdict:
        found = audit_along(model, inputs.parts)
        return Verdict(found.verdict == "pass", found.against)

    done = train(
        inputs.parts.split,
        base,
        Choice(who.network, pure=who.pure, heading=who.heading),
        settings=settings,
        auditor=judged if who.audited else None,
    )
    told = {"lawful": done.lawful, "best": done.best_epoch, "epochs": len(done.epochs)}
    return done.model, {**told, "seconds": done.model.seconds_to_fit}
