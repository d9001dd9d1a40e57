"""The verb `train`: from logs and a vehicle to a trained network, scored beside the nominal model on held-out data."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..physics.errors import RequestError
from ..physics.files import write_json
from ..residuals.model_files import save_network
from ..residuals.models import VehicleModel
from ..residuals.neural import is_network_folder, require_torch
from ..residuals.settings import CHECKPOINT, TrainingSettings
from .assess import scored
from .inputs import Inputs
from .run import Say
from .wording import percent

if TYPE_CHECKING:
    from ..discovery.distilled import Distilled
    from ..residuals.training import Epoch, Trained

TRAIN_SCHEMA = "undertow.train/1"


@dataclass(frozen=True, slots=True)
class TrainRun:
    """A finished training, scored.

    Attributes
    ----------
    inputs : logs and nominal vehicle
    trained : the network and how it came to be
    models : errors of the nominal model and of the network on held-out data, as in `comparison.json`
    distilled : what of the correction is a named effect; None where that was not asked for
    """

    inputs: Inputs
    trained: "Trained"
    models: tuple[dict[str, Any], ...]
    distilled: "Distilled | None" = None

    @property
    def sentences(self) -> list[str]:
        """What was trained, on what, and what to think of it."""
        found, train = self.trained, self.inputs.parts.split.train
        model, logs = found.model, len(self.inputs.paths)
        where = f"{'in the place of' if model.pure else 'beside'} the physics of {model.vehicle.name}"
        told = [
            f"Trained the network {model.network.name} ({model.parameters} weights) {where} "
            f"on {train.seconds:.0f} s of {logs} log{'s' * (logs > 1)} in {model.seconds_to_fit:.0f} s.",
            f"Kept epoch {found.best_epoch} of {found.epochs[-1].number}: {found.stopped}.",
        ]
        if found.best_epoch == 0:
            told.append("No epoch was better than the vehicle alone, so the network is as it began.")
        if found.lawful:
            told.append("It creates no energy without thrust at any state that was tried.")
        else:
            told.append(
                f"It creates energy without thrust at {percent(found.violating)} of the states that were tried, and so "
                "did every epoch: try a larger --lambda-phys, or --residual dissipative, which cannot."
            )
        return told

    def to_dict(self) -> dict[str, Any]:
        """As `train --json` prints it (schema `undertow.train/1`)."""
        found, split = self.trained, self.inputs.parts.split
        model = found.model
        return {
            "schema": TRAIN_SCHEMA,
            "network": model.network.name,
            "options": dict(model.network.options),
            "pure": model.pure,
            "heading": model.heading,
            "logs": list(self.inputs.paths),
            "split": self.inputs.parts.judge,
            "models": list(self.models),
            "training": found.to_dict(),
            "distillation": None if self.distilled is None else self.distilled.to_dict(),
            "data": {
                "rows": sum(part.rows for part in (split.train, split.validation, split.test)),
                "train_seconds": split.train.seconds,
                "notes": list(self.inputs.notes),
            },
        }


def train(
    inputs: Inputs,
    residual: str = "lstm",
    options: Mapping[str, int | float] | None = None,
    *,
    pure: bool = False,
    heading: bool = False,
    settings: TrainingSettings | None = None,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: "Callable[[Epoch], None] | None" = None,
) -> TrainRun:
    """Train a network on the training part of the logs, and score it beside the nominal model on held-out data.

    Parameters
    ----------
    inputs : logs and nominal vehicle, see `read_inputs`
    residual, options : network by name (mlp, lstm, tcn, transformer, dissipative) and its options
    pure : learn all of the motion, without the vehicle's physics
    heading : let the network see the heading
    settings : of the recipe
    out : folder for the network, and for the checkpoint of a training under way; None writes nothing
    resume : go on with the training that was interrupted in `out`
    progress : called after each epoch

    Raises
    ------
    RequestError
        when torch is missing, the folder cannot be used, or training fails; see `residuals.training.train`.
    """
    require_torch()
    from ..residuals.training import train as train_network

    target = None if out is None else check_folder(out, resume)
    found = train_network(
        inputs.parts.split,
        inputs.vehicle,
        residual,
        options,
        pure=pure,
        heading=heading,
        settings=settings,
        folder=target,
        resume=resume,
        progress=progress,
    )
    if target is not None:
        logs = [Path(path).name for path in inputs.paths]
        save_network(found.model, target, {"logs": logs, **found.to_dict()})
    nominal = scored(VehicleModel(inputs.vehicle, "nominal", "physics"), inputs.parts.judged)
    network = scored(found.model, inputs.parts.judged) | {"audit": "pass" if found.lawful else "fail"}
    return TrainRun(inputs, found, (nominal, network))


def explained(run: TrainRun, out: str | os.PathLike[str] | None = None, progress: Say | None = None) -> TrainRun:
    """The training with its correction distilled, see `undertow.distil`; `out` also gets `distillation.json`."""
    from .distilled import distil

    found = distil(run.trained.model, run.inputs, progress=progress)
    if out is not None:
        write_json(Path(out) / "distillation.json", found.to_dict())
    return replace(run, distilled=found)


def check_folder(out: str | os.PathLike[str], resume: bool) -> Path:
    """The folder of a network, if it can be written.

    Raises
    ------
    RequestError
        when its parent is missing, it is a file, it holds other things than a network, an interrupted training would
        be lost, or there is none to resume.
    """
    target = Path(out)
    if target.is_file():
        raise RequestError(f"cannot write the network to {target}: it is a file; give a folder that may be made")
    if not target.absolute().parent.is_dir():
        raise RequestError(f"cannot write the network to {target}: {target.absolute().parent} does not exist; make it")
    interrupted = (target / CHECKPOINT).exists()
    if interrupted and not resume:
        raise RequestError(
            f"{target} holds an interrupted training; go on with it (--resume), or remove {CHECKPOINT} to train anew"
        )
    if resume and not interrupted and is_network_folder(target):
        raise RequestError(f"nothing to resume: the training in {target} is done; leave --resume out to train anew")
    if target.is_dir() and any(target.iterdir()) and not interrupted and not is_network_folder(target):
        raise RequestError(f"cannot write the network to {target}: the folder holds other files; give a new one")
    return target


def settings_with(**given: Any) -> TrainingSettings:
    """The recipe with what was given in place of its defaults; None stands for not given."""
    return replace(TrainingSettings(), **{name: value for name, value in given.items() if value is not None})


def parsed_options(texts: Sequence[str]) -> dict[str, int | float]:
    """Options of a network from texts such as `units=64`.

    Raises
    ------
    RequestError
        for a text of another form, or an option that is given twice.
    """
    found: dict[str, int | float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            number = float(value)
        except ValueError:
            raise RequestError(f"--option {text}: expected NAME=NUMBER, for example units=64") from None
        if name in found:
            raise RequestError(f"--option {text}: {name} is given twice; give it once")
        found[name] = int(number) if number.is_integer() and "." not in value else number
    return found
