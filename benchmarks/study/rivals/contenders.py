"""All models of the study of rivals by their names, each with what it is and how it is made."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from undertow.discovery.balance.shooting import TRIFLE
from undertow.physics.effects import COMMAND_OFFSET
from undertow.physics.forces import at_beginning
from undertow.physics.vehicle import Vehicle
from undertow.residuals.learnable_residual import measure_learnable_residual
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.training.best_kind import best_of, candidates
from undertow.residuals.training.epochs import train
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows.discover_and_add import discover
from undertow.workflows.whole_answer import names_leave

from .bare import EPOCHS, bare
from .cases import Data
from .gaussian import gaussian
from .koopman import dmdc, koopman
from .literature import informed, kinetic_prior, physical_priors
from .rolled import neural_ode, port_hamiltonian
from .sindy import scaled_sindy, sindy
from .subspace import subspace

Made = Callable[[Data, Vehicle, str, int], Model]
"""Makes a model from the data, the vehicle that it stands beside or takes its thrust from, its name, and a seed."""


@dataclass(frozen=True, slots=True)
class Contender:
    """A model of the study.

    Attributes
    ----------
    kind : under which the table lists it
    what : what it is, and what was chosen
    make : makes it
    beside : the vehicle that it is given: nominal or calibrated
    random : whether a seed changes it
    """

    kind: str
    what: str
    make: Made
    beside: str = "nominal"
    random: bool = True


def _vehicle(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    del data, seed
    return VehicleModel(vehicle, name)


def _symbolic(data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    del vehicle, seed
    return VehicleModel(discover(data.run, progress=None).discovery.corrected, name, "symbolic")


def _network(choice: Choice, settings: Mapping[str, Any], data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    recipe = replace(TrainingSettings(seed=seed, epochs=EPOCHS, patience=EPOCHS, device="cpu"), **settings)
    model = train(data.split, vehicle, choice, settings=recipe).model
    model.name = name
    return model


LAWFUL = {"trust": False}
"""Settings of the losses of the laws alone: all of a correction counts everywhere."""
_AS_BARE = "without laws and trust"
KINDS = ("mlp", "symmetric", "lstm", "tcn", "transformer", "dissipative", "trees", "gp", "ridge")
"""Of networks, as `train` makes them."""


def _best(whole: bool, data: Data, vehicle: Vehicle, name: str, seed: int) -> Model:
    """The network that parts of the training run choose: beside the calibrated vehicle, or what `discover` names.

    The vehicle alone where no network errs less in another part of the run, as the verbs have it.
    """
    late = 0.0
    if whole:
        run = discover(data.run, progress=None)
        vehicle, late = run.discovery.corrected, run.findings.command_offset
        if names_leave(run.findings) < TRIFLE:
            return VehicleModel(vehicle, name)
    alone, changing = VehicleModel(vehicle, name), vehicle.with_values({COMMAND_OFFSET.symbol: late})
    vehicle = at_beginning(changing)
    left = measure_learnable_residual(vehicle, (data.split.train, data.split.validation))
    settings = TrainingSettings(seed=seed, epochs=EPOCHS, patience=EPOCHS, device="cpu")
    chosen = best_of(candidates(data.split, vehicle, settings, alone=changing), learnable=left.worth_it)
    if chosen is None:
        return alone
    model = train(data.split, vehicle, replace(chosen.choice, probes=chosen.probes), settings=settings).model
    model.name, model.vehicle = name, at_beginning(alone.vehicle)
    return model


def _ours(network: str) -> Contender:
    return Contender("undertow", f"`train --residual {network}`", partial(_network, Choice(network), {}), "calibrated")


CONTENDERS: dict[str, Contender] = {
    "Fossen as it is": Contender("vehicle", "the nominal vehicle file", _vehicle, random=False),
    "Fossen calibrated": Contender("vehicle", "`fit`", _vehicle, "calibrated", random=False),
    "symbolic": Contender("vehicle", "`discover`, from the nominal vehicle", _symbolic, random=False),
    "the whole answer": Contender("undertow", "`discover --residual best`", partial(_best, True)),
    "undertow best": Contender("undertow", "`train --residual best`", partial(_best, False), "calibrated"),
    **{f"undertow {name}": _ours(name) for name in KINDS},
    "feed-forward residual (Skulstad et al.)": Contender(
        "literature", f"`mlp` {_AS_BARE}", partial(bare, Choice("mlp")), "calibrated"
    ),
    "transformer residual (Miao et al., DyTR)": Contender(
        "literature", f"`transformer` {_AS_BARE}", partial(bare, Choice("transformer")), "calibrated"
    ),
    "kinetic prior (Lim and Oh)": Contender(
        "literature", "a perceptron that sees what the calibrated vehicle says", kinetic_prior, "calibrated"
    ),
    "trigonometric heading (Wang et al.)": Contender(
        "literature",
        f"`mlp --heading` {_AS_BARE}",
        partial(bare, Choice("mlp", heading=True)),
        "calibrated",
    ),
    "PINN (Xu et al.), its network": Contender(
        "literature", "a perceptron held to an equation of motion", partial(informed, equation=False)
    ),
    "PINN (Xu et al.), its equation": Contender(
        "literature", "the coefficients that were trained with it", partial(informed, equation=True)
    ),
    "physical priors (Fang et al.)": Contender(
        "literature", "a residual that is symmetric, at rest nothing, bounded, damping", physical_priors, "calibrated"
    ),
    "LSTM with energy and damping losses": Contender(
        "literature",
        "`lstm` with the losses of the laws, without trust",
        partial(_network, Choice("lstm"), LAWFUL),
        "calibrated",
    ),
    "TCN with energy and damping losses": Contender(
        "literature",
        "`tcn` with the losses of the laws, without trust",
        partial(_network, Choice("tcn"), LAWFUL),
        "calibrated",
    ),
    "pysindy": Contender("rival", "SINDYc by its defaults", sindy, random=False),
    "pysindy, scaled": Contender(
        "rival", "the same in units of each spread, its threshold chosen", scaled_sindy, random=False
    ),
    "DMDc": Contender("rival", "a linear map of velocities and thrusts", dmdc, random=False),
    "Koopman (EDMDc)": Contender("rival", "a linear map of lifted velocities", koopman),
    "subspace (MOESP)": Contender("rival", "a linear system with states of its own", subspace, random=False),
    "Gaussian process": Contender("rival", "of the whole acceleration", partial(gaussian, pure=True)),
    "Gaussian process residual": Contender(
        "rival", "beside the calibrated vehicle", partial(gaussian, pure=False), "calibrated"
    ),
    "neural ODE": Contender("rival", "a perceptron trained through rollouts", neural_ode),
    "port-Hamiltonian": Contender("rival", "a network whose energy only falls without thrust", port_hamiltonian),
}
