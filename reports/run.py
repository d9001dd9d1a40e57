"""The main job: from logs and a vehicle to findings, scores and the story of the falling error."""

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from ..discovery.add import add_effects
from ..discovery.discover import Discovery, DiscoverySettings, find_missing
from ..discovery.findings import Findings
from ..physics.errors import RequestError, expect
from ..physics.frames import AXES, FORCE_UNITS
from ..physics.sources import with_sources
from ..physics.vehicle import Vehicle, load_vehicle
from ..residuals.foreign import is_function_name, load_function
from ..residuals.model_files import load_network
from ..residuals.models import Model, VehicleModel
from ..residuals.neural import SETTINGS, WEIGHTS, is_network_folder
from ..residuals.onnx_model import load_onnx
from .assess import audit_along, comparison, model_failures, score_step, series
from .audit import Audit
from .inputs import INPUTS_CURE, Inputs, PathLike
from .viewer import compared, require_mcap, write_series

Say = Callable[[str], None]
MODEL_CURE = "undertow.load_model(PATH) reads one"


@dataclass(frozen=True, slots=True)
class Run:
    """A finished main job, before it is written; `audit` is of the corrected model."""

    inputs: Inputs
    discovery: Discovery
    findings: Findings
    comparison: dict[str, Any]
    series: pd.DataFrame
    settings: DiscoverySettings
    audit: Audit


def discover(inputs: Inputs, settings: DiscoverySettings | None = None, progress: Say | None = None) -> Run:
    """Name the physical effects that the vehicle model misses in the logs, add them one by one, and score each step.

    Parameters
    ----------
    inputs : logs and nominal vehicle, see `read_inputs`
    settings : of the search, its seed among them
    progress : called with a line for each step

    Raises
    ------
    RequestError
        when a log is too short, or a solver fails.
    """
    chosen = settings or DiscoverySettings()
    expect("discover: inputs", inputs, Inputs, INPUTS_CURE)
    expect("discover: settings", chosen, DiscoverySettings, "undertow.DiscoverySettings(...) makes them")
    return assess(inputs, find_missing(inputs.fitting, inputs.vehicle, chosen, progress), chosen, progress)


def add(
    effects: Sequence[str],
    inputs: Inputs,
    progress: Say | None = None,
) -> Run:
    """Add effects by name to the nominal model, fit them together, and score before and after on held-out data.

    Parameters
    ----------
    effects : names of the catalogue (`thruster_asymmetry[port]` chooses the thruster), or terms such as `yaw:u|r|`

    Raises
    ------
    RequestError
        for an unknown effect, naming the nearest.
    """
    expect("add: effects", effects, (list, tuple), 'give a list of names, such as ["surge_quadratic_damping"]')
    expect("add: inputs", inputs, Inputs, INPUTS_CURE)
    settings = DiscoverySettings()
    found = add_effects(inputs.fitting, inputs.vehicle, effects, settings)
    return assess(inputs, found, settings, progress)


def assess(inputs: Inputs, found: Discovery, settings: DiscoverySettings, progress: Say | None = None) -> Run:
    """Score every step of a discovery on held-out data, and find where the models fail."""
    how = f"identified by undertow from {inputs.log_names}"
    found = replace(found, corrected=with_sources(found.nominal, found.corrected, how))
    if progress is not None:
        progress("scoring every step on held-out data")
    models = _models(found)
    table = series(models[0], models[-1], inputs.parts, inputs.channels)
    steps = tuple(
        {"added": None if label is None else label.split("[")[0], **score_step(model, inputs.parts.judged)}
        for (label, _), model in zip(found.steps, models, strict=True)
    )
    ends = [models[0], models[-1]] if len(models) > 1 else [models[0], _renamed(models[0])]
    if progress is not None:
        progress("judging both models by the laws of a hull")
    audits = [audit_along(model, inputs.parts) for model in ends]
    judged = comparison(ends, audits, inputs.parts, inputs.paths, table)
    weak = (inputs.weak.train, inputs.weak.validation, inputs.weak.test)
    data = {
        "rows": sum(part.rows for part in weak),
        "seconds": sum(part.seconds for part in weak),
        "split": f"chronological {'/'.join(f'{100 * s:.0f}' for s in inputs.weak.train.recipe.shares)}",
        "unexplained": _unexplained(found),
        "notes": [*inputs.notes, *found.notes, *_leftovers(found)],
    }
    findings = replace(
        found.findings,
        steps=steps,
        failures=tuple(model_failures(table, models[0], "before", inputs.parts.judge)),
        data=data,
    )
    return Run(inputs, found, findings, judged, table, settings, audits[-1])


def _unexplained(found: Discovery) -> dict[str, dict[str, Any]]:
    """Force that the corrected model leaves on each axis, beside what sensor noise alone would leave."""
    rows = zip(AXES, found.force_error, found.noise_error, FORCE_UNITS, strict=True)
    return {axis: {"force": float(f), "noise": float(n), "unit": unit} for axis, f, n, unit in rows}


def _leftovers(found: Discovery) -> list[str]:
    """Sentences on the axes where much more force is left than sensor noise and the material share explain."""
    scale = found.findings.criterion["force_scale"]
    if found.findings.criterion["unit"][AXES[0]] != FORCE_UNITS[0]:
        return []  # judged on rollouts; the notes tell what the force balance leaves
    return [
        f"{axis}: {f:.2g} {unit} (root mean square) stay unexplained, {n:.2g} {unit} of it sensor noise"
        for axis, f, n, unit in zip(AXES, found.force_error, found.noise_error, FORCE_UNITS, strict=True)
        if f > max(2.0 * n, 0.05 * scale[axis])
    ]


def _models(found: Discovery) -> list[VehicleModel]:
    """The vehicle after each step as a model: nominal, the ones between, corrected."""
    last = len(found.steps) - 1
    terms = [term for c in found.findings.candidates if c.verdict == "missing" for term in c.terms]
    models = [VehicleModel(found.nominal, "nominal", "physics")]
    for k, (label, vehicle) in enumerate(found.steps[1:], start=1):
        fitted = len(terms) + len(found.findings.unnamed) + len(found.findings.calibrated)
        name, size = ("corrected", fitted) if k == last else (f"+ {label}", 0)
        models.append(VehicleModel(vehicle, name, "symbolic", parameters=size))
    return models


def _renamed(model: VehicleModel) -> VehicleModel:
    return VehicleModel(model.vehicle, "corrected", "symbolic")


def compare(inputs: Inputs, models: Sequence[PathLike] = (), series_file: PathLike | None = None) -> dict[str, Any]:
    """Models against measurements: the nominal vehicle and any others, on the same rows.

    Parameters
    ----------
    inputs : logs and nominal vehicle, with the part to judge on
    models : vehicle files, run folders, folders of trained networks, ONNX files, or `package.module:function`
    series_file : MCAP file to write for viewers, with what was measured and what each model predicts

    Returns
    -------
    dict
        As `comparison.json`.

    Raises
    ------
    RequestError, VehicleError
        when a model cannot be read, takes other commands than the nominal vehicle, is given twice, or is a network
        that was trained at another rate than that of the comparison, 10 Hz; when a series is asked for and the package
        mcap is missing.
    """
    expect("compare: inputs", inputs, Inputs, INPUTS_CURE)
    expect("compare: models", models, (list, tuple), "give a list of paths")
    if series_file is not None:
        require_mcap()
    found: list[Model] = [VehicleModel(inputs.vehicle, "nominal", "physics")]
    paths = [os.fspath(path) for path in models]
    for path in paths:
        if paths.count(path) > 1:
            raise RequestError(f"model {path} is given twice; give it once")
        found.append(_comparable(path, inputs, [model.name for model in found]))
    table = series(found[0], found[-1], inputs.parts, inputs.channels)
    audits = [audit_along(model, inputs.parts) for model in found]
    if series_file is not None:
        write_series(series_file, compared(found, inputs.parts, inputs.channels), inputs.channels, inputs.parts)
    return comparison(found, audits, inputs.parts, inputs.paths, table)


def _comparable(path: str, inputs: Inputs, taken: Sequence[str]) -> Model:
    """A model that takes the commands that the logs were prepared for, under a name of its own."""
    model = load_model(path, inputs.vehicle)
    if model.name in taken:
        model.name = path
    check_commands(model, inputs)
    return model


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


def load_model(path: PathLike, vehicle: Vehicle | None = None) -> Model:
    """A model from a vehicle file, a run folder, the folder of a trained network, an ONNX file or a Python function.

    Parameters
    ----------
    path : of the file or folder, after which the model is named; or `package.module:function`, which is imported
    vehicle : of a model that carries none (ONNX file, function): its mass, thrusters and water

    Raises
    ------
    RequestError, VehicleError
        when there is none, a network is given and torch is missing, or a foreign model without a vehicle.
    """
    source, text = Path(path), os.fspath(path)
    if source.suffix == ".onnx" or (is_function_name(text) and not source.exists()):
        if vehicle is None:
            raise RequestError(f"model {text}: it carries no mass and no thrusters; give --vehicle V")
        return load_onnx(source, vehicle) if source.suffix == ".onnx" else load_function(text, vehicle)
    if is_network_folder(source):
        return load_network(source)
    if source.is_file() and source.name in (SETTINGS, WEIGHTS) and is_network_folder(source.parent):
        raise RequestError(f"{source} is a part of a network; give its folder, {source.parent}")
    if source.is_dir():
        if not (source / "model.yaml").is_file():
            raise RequestError(f"{source} holds no model.yaml; give a run folder, a network or a vehicle file")
        return VehicleModel(load_vehicle(source / "model.yaml"), source.name, "symbolic", _fitted(source))
    return VehicleModel(load_vehicle(path), source.stem, "physics")


def _fitted(run: Path) -> int:
    """How many numbers the corrected model of a run folder had fitted, as its own comparison says; 0 without one."""
    try:
        models = json.loads((run / "comparison.json").read_text("utf-8"))["models"]
        return int(models[-1]["parameters"])
    except (OSError, ValueError, KeyError, IndexError, TypeError):
        return 0
