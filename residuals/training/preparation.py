"""Preparation of a training: network, loss and judge, from scratch or from a network of another boat.

An epoch is judged by its error on held-out motions, filtered as scores filter it, and by the laws. A network that goes
on from another (Nichol, Achiam and Schulman 2018) keeps the scale of its inputs and outputs; mass, thrusters and the
fading distance are those of the new vehicle.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import final

import numpy as np
import torch
from torch.nn.utils.rnn import pad_sequence

from ...measurements.preparation.prepare import DataSet
from ...measurements.preparation.resampling import Standardisation, accelerations
from ...measurements.preparation.split import Split
from ...physics.errors import RequestError
from ...physics.laws.damping_power import envelope_of
from ...physics.laws.energy import coasting_states
from ...physics.momentum_balance import thruster_matrix
from ...physics.motion import Array, Motion
from ...physics.thrusters import neutral_command
from ...physics.vehicle import Vehicle
from ..models.network_inputs import input_names, network_inputs
from ..models.network_model import NetworkModel, numbers, scaling_of
from ..models.unforced_states import UnforcedStates
from ..networks.base import Network, Scaling, through
from ..networks.registry import NETWORKS, build, default_options, network_named
from ..scores import same_filter, target_acceleration
from .losses import Objective
from .probes import WARM_UP
from .tabular_fit import Table
from .training_settings import Choice, TrainingSettings
from .windows import Augmenter, Windows, filter_taps, seen_noise, sister_targets, windows_of


@final
class Judge:
    """Held-out motions, ready to be judged after every epoch.

    Parameters
    ----------
    data : validation motions
    coasting : states at which the laws are asked for
    unit : (3,) of the error on each axis [m/s^2, m/s^2, rad/s^2]
    """

    def __init__(
        self, data: DataSet, vehicle: Vehicle, coasting: UnforcedStates, unit: Array, *, pure: bool, heading: bool
    ) -> None:
        self.data, self.coasting, self.unit = data, coasting, unit
        self.targets = [target_acceleration(vehicle, motion, data, pure) for motion in data.motions]
        seen = [network_inputs(vehicle, motion, heading) for motion in data.motions]
        # Networks are causal: rows after the end of a shorter motion change nothing before it.
        self.inputs = pad_sequence([torch.as_tensor(see) for see in seen], batch_first=True).to(coasting.inputs)

    def error(self, network: Network) -> float:
        """Root mean square error of the acceleration, each axis in its unit; the axes count alike."""
        with torch.no_grad():
            said = numbers(through(network, self.inputs)[0])
        if not np.isfinite(said).all():
            return float("nan")
        rows = [
            same_filter(s[: target.shape[0]], motion, self.data) - target
            for s, target, motion in zip(said, self.targets, self.data.motions, strict=True)
        ]
        return float(np.sqrt(((np.concatenate(rows) / self.unit) ** 2).mean()))

    def violating(self, network: Network) -> float:
        """Share of the states without thrust at which the network creates energy."""
        return self.coasting.violating_share(network)


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

    Parameters
    ----------
    start : the trained network
    vehicle : of the new boat
    heading : whether the network sees it

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


POOL = 4096
"""States among which each batch draws, a half of them without thrust."""
JUDGED = (128, 512)
"""States at which an epoch is judged: validation velocities, and a sample of the training envelope; each with thrust
and without."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """Everything that a training needs.

    Attributes
    ----------
    network : on its device, with fresh weights or those of a start
    objective, judge : loss of a batch, and verdict on an epoch
    asked_at : states u, v, r, heading and commands (n, 4 + thrusters) made ready to be put to the network
    pure : whether the network stands in the place of the physics
    table : all training rows, for what is fitted at once
    time_step : of the rows [s]
    recipe : all that the result depends on, as plain data
    """

    network: Network
    objective: Objective
    judge: Judge
    asked_at: Callable[[Array], UnforcedStates]
    pure: bool
    table: Table
    time_step: float
    recipe: dict[str, object]


def prepare_training(split: Split, vehicle: Vehicle, choice: Choice, settings: TrainingSettings) -> Prepared:
    """Cut windows, scale, build the network, and work out all that does not depend on its weights.

    Parameters
    ----------
    split : training, validation and test part
    vehicle : that is corrected
    choice : kind and options of the network
    settings : of the training

    Raises
    ------
    RequestError
        for an unknown network or option, a device that is not there, or data that are too short.
    """
    device = _device(settings.device)
    remembers = _remembers(choice)
    warm_up = WARM_UP if remembers else 0.0
    chosen = {"pure": choice.pure, "heading": choice.heading}
    lengths = {"seconds": settings.window, "warm_up": warm_up, "overlap": settings.overlap}
    cut_for = partial(windows_of, split.train, **chosen, **lengths)
    windows = cut_for(vehicle)
    sisters = sister_targets(vehicle, settings, windows.target, pure=choice.pure, cut_for=cut_for)
    _check_rollouts(settings, windows)
    motions = split.train.motions
    seen = windows.inputs.reshape(-1, windows.inputs.shape[-1])
    unit = _unit(windows, motions)
    if choice.start is None:
        known = network_named(choice.network).alike(seen, thruster_matrix(vehicle))
        scaling = scaling_of(vehicle, Standardisation.of(input_names(vehicle, choice.heading), known), unit)
    else:
        scaling = scaling_from(choice.start, vehicle, choice.heading)
    network = build(choice.network, scaling, choice.options).to(device)
    if choice.start is not None:
        take_weights(network, choice.start)
    like = next(network.parameters())
    envelope, pool = envelope_of(motions, vehicle), np.concatenate([motion.commands for motion in motions])
    idle = np.array([neutral_command(t) for t in vehicle.thrusters])
    settles = remembers and not network.starts_settled
    how = {**chosen, "time_step": windows.time_step, "settles": settles, "like": like}

    def coasting(states: Array) -> UnforcedStates:
        commands = pool[np.random.default_rng(5).integers(0, pool.shape[0], states.shape[0])]
        commands[::2] = idle
        return UnforcedStates(vehicle, states, commands, **how)

    def asked_at(states: Array) -> UnforcedStates:
        return UnforcedStates(vehicle, states[:, :4], states[:, 4:], **how)

    judged = np.concatenate([_thinned(split.validation.motions, vehicle), coasting_states(envelope, JUDGED[1])])
    judge = Judge(split.validation, vehicle, coasting(np.repeat(judged, 2, axis=0)), unit, **chosen)
    compared = None if sisters is None else torch.as_tensor(sisters[:, :, windows.compared]).to(like)
    noise = seen_noise(split.train, settings, remembers)
    objective = Objective(
        windows,
        filter_taps(split.train.recipe, windows.time_step),
        unit,
        coasting(coasting_states(envelope, POOL, seed=1)),
        vehicle,
        settings,
        pure=choice.pure,
        augmenter=Augmenter(settings.augmentation.thrust_spread, noise, scaling.drives, compared),
    )
    recipe = {
        "network": choice.network,
        "options": default_options(choice.network) | dict(choice.options or {}),
        **chosen,
        "settings": settings.to_dict(),
        "device": device.type,
        "data": _digest(windows.inputs, windows.target, windows.states, *judge.targets),
        "vehicle": vehicle.digest,
    }
    if choice.start is not None:
        recipe["start"] = _digest(*(p.detach().cpu().numpy() for p in choice.start.network.parameters()))
    table = tabulate(split.train, vehicle, scaling, **chosen)
    return Prepared(network, objective, judge, asked_at, choice.pure, table, windows.time_step, recipe)


def tabulate(data: DataSet, vehicle: Vehicle, scaling: Scaling, *, pure: bool, heading: bool) -> Table:
    """All rows of a data set, for a network that is grown at once.

    Parameters
    ----------
    data : what it learns
    vehicle : that it corrects
    scaling : of the network
    pure, heading : see `Choice`
    """
    seen = np.concatenate([network_inputs(vehicle, motion, heading) for motion in data.motions])
    target = np.concatenate([target_acceleration(vehicle, motion, data, pure) for motion in data.motions])
    lengths = tuple(motion.time.size for motion in data.motions)
    return Table(scaling.inputs.apply(seen), target / scaling.output, lengths, data.motions[0].time_step)


def _remembers(choice: Choice) -> bool:
    """True when a network has a memory, found by asking a throw-away one."""
    with torch.no_grad():
        asked = sample(choice)
        return bool(asked(torch.zeros(1, 1, 4).to(asked.get_buffer("input_mean")))[1])


def sample(choice: Choice) -> Network:
    """A throw-away network of a kind, of a boat with one thruster."""
    scaling = Scaling(
        Standardisation(("u", "v", "r", "thrust"), np.zeros(4), np.ones(4)), np.ones(3), np.eye(3), np.eye(3)[:, :1]
    )
    with torch.random.fork_rng():
        return build(choice.network, scaling, choice.options)


def _unit(windows: Windows, motions: tuple[Motion, ...]) -> Array:
    """Root mean square of what is to be explained (3,), the unit of errors and the size of the output on each axis.

    At least a thousandth of that of the measured acceleration. In units of the measured acceleration an axis on which
    the vehicle is nearly right would not be learnt at all.
    """
    target, measured = windows.target[:, windows.compared].reshape(-1, 3), [accelerations(m) for m in motions]
    left, whole = (np.sqrt((x**2).mean(axis=0)) for x in (target, np.concatenate(measured)))
    return np.maximum(left, 1e-3 * whole + 1e-9)


def _thinned(motions: tuple[Motion, ...], vehicle: Vehicle) -> Array:
    """Evenly spread velocities relative to the water (at most 128, 3)."""
    states = np.concatenate([network_inputs(vehicle, motion, False)[:, :3] for motion in motions])
    return states[:: -(-states.shape[0] // JUDGED[0])]


def _check_rollouts(settings: TrainingSettings, windows: Windows) -> None:
    room = windows.inputs.shape[1] - windows.first - 1
    if settings.rollout_rows > room:
        raise RequestError(
            f"training: expected rollouts of at most {room} rows in windows of {settings.window:g} s, got "
            f"{settings.rollout_rows}; give shorter rollouts or longer windows"
        )


def _device(wanted: str) -> torch.device:
    if wanted == "cuda" and not torch.cuda.is_available():
        raise RequestError("training: no GPU that torch can use was found; give device cpu or auto")
    return torch.device("cuda" if wanted == "cuda" else "cpu")


def _digest(*arrays: Array) -> str:
    found = hashlib.sha256()
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()[:16]
