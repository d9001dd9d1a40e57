"""Checkpoints: the state of a training between two epochs, and the choice of the weights that are kept.

Kept are the best weights that keep all laws. An audit searches for states against the laws; these are asked in the loss
for a few epochs more, and the audit searches anew (Chang, Roohi and Gao 2019, "Neural Lyapunov control").
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import final

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from ...measurements.preparation.prepare import DataSet
from ...physics.errors import RequestError, shown
from ...physics.files import write_bytes
from ...physics.motion import Array
from ...physics.reading import parse_json
from ..models.base import Model, VehicleModel
from ..models.network_model import NetworkModel
from ..models.neural import CHECKPOINT
from ..scores import rollout_errors
from .history import Epoch, best_epochs
from .training_settings import MOVED, Choice, TrainingSettings

SCHEMA = "undertow.checkpoint/3"


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """State from which a training goes on.

    Attributes
    ----------
    weights, averaged : of the last epoch by name, and their average
    kept : those of the best epochs so far by number and name
    moments : state of Adam by parameter number and name
    draw : state of the random generator
    history : of the epochs
    seconds : spent so far [s]
    recipe : all that the result depends on; a training goes on only with the same
    """

    weights: Mapping[str, Tensor]
    averaged: Mapping[str, Tensor]
    kept: Mapping[int, Mapping[str, Tensor]]
    moments: Mapping[int, Mapping[str, Tensor]]
    draw: Tensor
    history: Sequence[Epoch]
    seconds: float
    recipe: Mapping[str, object]


def write_checkpoint(folder: Path, state: Checkpoint) -> None:
    """Write `checkpoint.safetensors` whole or not at all.

    Raises
    ------
    OSError
        when the folder is not writable; an older checkpoint is then untouched.
    """
    groups = {"weights": state.weights, "averaged": state.averaged}
    groups |= {f"kept/{number}": weights for number, weights in state.kept.items()}
    groups |= {f"adam/{number}": moments for number, moments in state.moments.items()}
    tensors = {f"{head}/{name}": value for head, group in groups.items() for name, value in group.items()}
    tensors["draw"] = state.draw
    said = {
        "schema": SCHEMA,
        "history": [asdict(epoch) for epoch in state.history],
        "seconds": state.seconds,
        "recipe": dict(state.recipe),
    }
    # Copies: where nothing is averaged both are one, and safetensors takes no memory twice.
    plain = {name: value.cpu().contiguous() for name, value in cloned(tensors).items()}
    write_bytes(folder / CHECKPOINT, save(plain, {"undertow": json.dumps(said, allow_nan=False)}))


FREE = ("epochs", "patience", "learning_rate", "schedule", "clip", "decline", "minutes")
"""Settings that may change when a training goes on: it is then longer, or more careful, and not another one."""


_OTHER = {"data": "the logs, or how they are prepared, are others", "vehicle": "the vehicle is another"}


def read_checkpoint(folder: Path, recipe: Mapping[str, object]) -> Checkpoint | None:
    """The state that an interrupted training left in `folder`, None where there is none.

    Raises
    ------
    RequestError
        when the file is damaged, or belongs to another recipe, naming what differs.
    """
    path = folder / CHECKPOINT
    if not path.exists():
        return None
    try:
        with safe_open(path, framework="pt") as stream:
            said = parse_json(stream.metadata()["undertow"])
            tensors = {name: stream.get_tensor(name) for name in stream.keys()}  # noqa: SIM118
        if said["schema"] != SCHEMA:
            raise ValueError(f"schema {said['schema']!r}")
        _check_recipe(path, said["recipe"], recipe)
        weights, averaged = (_under(tensors, head) for head in ("weights", "averaged"))
        kept, moments = (_numbered(_under(tensors, head)) for head in ("kept", "adam"))
        history = [Epoch(**row) for row in said["history"]]
        return Checkpoint(weights, averaged, kept, moments, tensors["draw"], history, said["seconds"], said["recipe"])
    except RequestError:
        raise
    except (OSError, SafetensorError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RequestError(
            f"{path} is no checkpoint that training can go on from ({error}); remove it to train anew"
        ) from error


def interrupted(folder: Path, settings: TrainingSettings) -> tuple[Choice, TrainingSettings] | None:
    """What an interrupted training in `folder` had chosen to train, so that nothing is searched for again.

    Parameters
    ----------
    settings : those that are given now: they stay, but for what a search may have moved

    Returns
    -------
    (choice, settings)
        None where there is no checkpoint, or one that `read_checkpoint` refuses
    """
    try:
        with safe_open(folder / CHECKPOINT, framework="pt") as stream:
            recipe = parse_json(stream.metadata()["undertow"])["recipe"]
        moved = {name: recipe["settings"][name] for name in MOVED}
        choice = Choice(recipe["network"], recipe["options"], recipe["pure"], recipe["heading"])
        return choice, replace(settings, **moved)
    except (OSError, SafetensorError, ValueError, KeyError, TypeError):
        return None


def _check_recipe(path: Path, written: Mapping[str, object], wanted: Mapping[str, object]) -> None:
    plain = parse_json(json.dumps(dict(wanted)))
    written = dict(written)
    for recipe in (plain, written):
        settings = recipe.get("settings")
        recipe["settings"] = {k: v for k, v in settings.items() if k not in FREE} if isinstance(settings, dict) else {}
    told = []
    for key in sorted({**written, **plain}.keys()):
        before, now = written.get(key), plain.get(key)
        if isinstance(before, dict) and isinstance(now, dict):
            names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
            told += [f"{name} was {shown(before.get(name))}, is {shown(now.get(name))}" for name in names]
        elif before != now:
            told.append(_OTHER.get(key) or f"{key} was {shown(before)}, is {shown(now)}")
    if told:
        raise RequestError(
            f"{path} belongs to another training: {'; '.join(told)}. Go on with the same, or remove the checkpoint to "
            "train anew"
        )


def _under(tensors: Mapping[str, Tensor], head: str) -> dict[str, Tensor]:
    return {name.removeprefix(f"{head}/"): value for name, value in tensors.items() if name.startswith(f"{head}/")}


def _numbered(tensors: Mapping[str, Tensor]) -> dict[int, dict[str, Tensor]]:
    numbers = dict.fromkeys(name.partition("/")[0] for name in tensors)
    return {int(number): _under(tensors, number) for number in numbers}


def cloned(values: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """A copy that later steps do not change."""
    return {name: torch.clone(value.detach()) for name, value in values.items()}


_ROUNDS = 5
"""Times that the states of an audit are learnt at most."""
_ALIKE = 128
"""States as which those of each audit count: the last one meets few, and these are what is left to learn."""

Weights = Mapping[str, Tensor]
Again = Callable[[Array], tuple[int, Weights]]
"""Trains on for some epochs at states u, v, r, heading, commands (n, 4 + thrusters); number and weights of the last."""


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """Verdict of an auditor on a model.

    Attributes
    ----------
    lawful : whether it keeps all laws
    against : states u, v, r, heading and commands (n, 4 + thrusters) that were met against them; none where a law is
        broken of which no state tells
    """

    lawful: bool
    against: Array


Auditor = Callable[[NetworkModel], Verdict]


@dataclass(frozen=True, slots=True)
class SelectedCheckpoint:
    """The weights that are kept.

    Attributes
    ----------
    epoch : of which they are
    lawful : what the auditor says of them; None where there is none
    """

    epoch: int
    lawful: bool | None


@final
class CheckpointSelector:
    """Loads weights into a model, and puts it before the laws.

    Parameters
    ----------
    model : that takes the weights
    held_out : validation part, whose rollouts rank the epochs
    auditor : None for one who asks nothing
    lawful : whether epochs that break the laws stand behind the others, see `history.best_epochs`
    """

    def __init__(self, model: NetworkModel, held_out: DataSet, auditor: Auditor | None, lawful: bool) -> None:
        self.model, self.held_out, self.auditor, self.lawful = model, held_out, auditor, lawful
        self._against: list[Array] = []

    def best(self, ranked: list[int], kept: Mapping[int, Weights]) -> SelectedCheckpoint:
        """Load the best weights that the auditor passes, or the best.

        Parameters
        ----------
        ranked : numbers of the best epochs, the best first
        kept : their weights by number
        """
        if self.auditor is not None:
            for number in ranked if self.lawful else ranked[:1]:  # what never heard of laws is not chosen by them
                self.model.network.load_state_dict(kept[number])
                if self._passes():
                    return SelectedCheckpoint(number, True)
        self.model.network.load_state_dict(kept[ranked[0]])
        return SelectedCheckpoint(ranked[0], None if self.auditor is None else False)

    def mended(self, found: SelectedCheckpoint, again: Again) -> SelectedCheckpoint:
        """Train on at the states against the laws until the auditor passes one; leave all as it is where it passed one.

        The weights at the end of a round are put before it, for those of its first epochs have learnt the least.
        """
        if found.lawful is not False:
            return found
        before = cloned(self.model.network.state_dict())
        learnt = 0
        for _ in range(_ROUNDS):
            if len(self._against) == learnt:  # the last audit met no states
                break
            learnt = len(self._against)
            try:
                number, weights = again(np.concatenate(self._against))
            except RequestError:  # a loss that is not finite: what was found before is as good as it was
                break
            self.model.network.load_state_dict(weights)
            if self._passes():
                return SelectedCheckpoint(number, True)
        self.model.network.load_state_dict(before)
        return found

    def _passes(self) -> bool:
        assert self.auditor is not None
        said = self.auditor(self.model)
        if said.against.size:
            self._against.append(np.resize(said.against, (_ALIKE, said.against.shape[1])))
        return said.lawful

    def ranked(self, history: list[Epoch], kept: Mapping[int, Weights]) -> list[int]:
        """The best epochs, those of the least product of both errors first, and those that break the laws last.

        The errors are those of one step and of rollouts; the weights of the best are then loaded.
        """
        told = {epoch.number: epoch for epoch in history}
        best = best_epochs(history, lawful=self.lawful)
        alone = VehicleModel(self.model.vehicle, "alone")
        unit = np.zeros(0) if self.model.pure else np.maximum(_squares(alone, self.held_out), 1e-300)

        def error(number: int) -> tuple[bool, float]:
            self.model.network.load_state_dict(kept[number])
            unlawful = self.lawful and told[number].violating > 0.0
            ratio = float((_squares(self.model, self.held_out) / unit).mean()) if unit.size else 1.0
            return unlawful, told[number].rmse * (np.sqrt(ratio) if np.isfinite(ratio) else np.inf)

        result = sorted(best, key=error)
        self.model.network.load_state_dict(kept[result[0]])
        return result


def _squares(model: Model, data: DataSet) -> Array:
    """Mean square errors of u, v, r and position (4,) of the longest rollouts that fit; none where none does."""
    found = rollout_errors(model, data, (10.0, 2.0))
    longest = max(found, key=float, default=None)
    return np.zeros(0) if longest is None else np.concatenate(found[longest].squares).mean(axis=0)
