"""Models by name: whatever a user may put behind `--model`, and what is asked of it before it is compared."""

import os
from pathlib import Path

from ..measurements.prepared_logs import Inputs, PathLike
from ..physics.errors import RequestError
from ..physics.folders import finish
from ..physics.reading import read_json
from ..physics.vehicle import Vehicle, load_vehicle
from ..residuals.models.base import Model, VehicleModel
from ..residuals.models.foreign import NO_MASS, is_function_name, load_function
from ..residuals.models.model_files import load_network
from ..residuals.models.neural import SETTINGS, WEIGHTS, is_network_folder
from ..residuals.models.onnx_model import load_onnx
from .facts import CORRECTED, ComparedModel, Comparison

MODEL_CURE = "undertow.load_model(PATH) reads one"


def check_commands(model: Model, inputs: Inputs) -> None:
    """Check that a model takes the commands that the logs were prepared for.

    Raises
    ------
    RequestError
        when it takes others.
    """
    commands = tuple(thruster.channel for thruster in model.vehicle.thrusters)
    if commands != inputs.channels:
        raise RequestError(
            f"model {model.name}: expected the commands of the nominal vehicle, {' '.join(inputs.channels)}, got "
            f"{' '.join(commands)}; give a model with the same thrusters"
        )


def load_model(path: PathLike, vehicle: Vehicle | None = None, *, judged: bool = False) -> Model:
    """A model from a vehicle file, a run folder, the folder of a trained network, an ONNX file or a Python function.

    Parameters
    ----------
    path : of the file or folder, after which the model is named; or `package.module:function`, which is imported
    vehicle : of a model that carries none (ONNX file, function): its mass, thrusters and water
    judged : take a vehicle that cannot be too, see `load_vehicle`

    Raises
    ------
    RequestError, VehicleError
        when there is none, a network is given and torch is missing, or a foreign model without a vehicle.
    """
    source, text = Path(path), os.fspath(path)
    finish(source)
    if source.suffix == ".onnx":
        if vehicle is None:
            raise RequestError(f"model {text}: {NO_MASS}")
        return load_onnx(source, vehicle)
    if is_function_name(text) and not source.exists():
        return load_function(text, vehicle)
    if is_network_folder(source):
        return load_network(source)
    if source.is_file() and source.name in (SETTINGS, WEIGHTS) and is_network_folder(source.parent):
        raise RequestError(f"{source} is a part of a network; give its folder, {source.parent}")
    if source.name == "model.yaml" and (source.parent / "findings.json").is_file():
        source = source.absolute().parent  # the model of a run bears the name of the run
    if source.is_dir():
        if not (source / "model.yaml").is_file():
            raise RequestError(f"{source} holds no model.yaml; give a run folder, a network or a vehicle file")
        written = load_vehicle(source / "model.yaml", judged=judged)
        model = VehicleModel(written, source.name, "symbolic", fitted_numbers(source))
        found = _corrected(source)
        model.band = None if found is None else found.band
        return model
    return VehicleModel(load_vehicle(path, judged=judged), source.stem, "physics")


def fitted_numbers(run: Path) -> int:
    """How many numbers the corrected model of a run folder had fitted, as its own comparison says; 0 without one."""
    found = _corrected(run)
    return 0 if found is None else found.parameters or 0


def _corrected(run: Path) -> ComparedModel | None:
    """What the comparison of a run folder says of its corrected model; None where there is none that can be read."""
    path = run / "comparison.json"
    try:
        models = Comparison.read(read_json(path), path, "").models
    except (OSError, ValueError):
        return None
    return next((model for model in models if model.name == CORRECTED), None)
