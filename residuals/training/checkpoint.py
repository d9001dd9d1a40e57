"""The state of a training between two epochs in one file, from which it goes on as if it had never stopped."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from ...physics.errors import RequestError, shown
from ...physics.files import write_bytes
from ...physics.reading import parse_json
from ..models.neural import CHECKPOINT
from .history import Epoch

SCHEMA = "undertow.checkpoint/3"


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """What a training needs to go on.

    Attributes
    ----------
    weights, averaged : of the last epoch by name, and their average
    kept : those of the best epochs so far by `number/name`
    moments : state of Adam by parameter number and name
    draw : state of the random generator
    history : of the epochs
    seconds : spent so far [s]
    recipe : all that the result depends on; a training goes on only with the same
    """

    weights: Mapping[str, Tensor]
    averaged: Mapping[str, Tensor]
    kept: Mapping[str, Tensor]
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
    tensors = {f"weights/{name}": value for name, value in state.weights.items()}
    tensors |= {f"averaged/{name}": value for name, value in state.averaged.items()}
    tensors |= {f"kept/{name}": value for name, value in state.kept.items()}
    tensors |= {f"adam/{k}/{name}": value for k, row in state.moments.items() for name, value in row.items()}
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


FREE = ("epochs", "patience", "learning_rate", "schedule", "clip", "decline")
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
        moments: dict[int, dict[str, Tensor]] = {}
        for name, value in _under(tensors, "adam").items():
            number, _, label = name.partition("/")
            moments.setdefault(int(number), {})[label] = value
        history = [Epoch(**row) for row in said["history"]]
        weights, averaged, kept = (_under(tensors, head) for head in ("weights", "averaged", "kept"))
        return Checkpoint(weights, averaged, kept, moments, tensors["draw"], history, said["seconds"], said["recipe"])
    except RequestError:
        raise
    except (OSError, SafetensorError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RequestError(
            f"{path} is no checkpoint that training can go on from ({error}); remove it to train anew"
        ) from error


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


def cloned(values: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """A copy that later steps do not change."""
    return {name: torch.clone(value.detach()) for name, value in values.items()}
