"""The verbs `check` (what the laws of a hull say of a model) and `explain` (what of its correction has a name)."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..comparison.audit import Audit, audit
from ..comparison.models_by_name import MODEL_CURE, check_commands, load_model
from ..discovery.basis import DiscoverySettings
from ..discovery.distillation import Distilled, distil_model
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.prepared_logs import FOLDS, INPUTS_CURE, Inputs, PathLike
from ..physics.errors import RequestError, VehicleError, expect
from ..physics.forces import calm, held_thrust
from ..physics.laws.audit.bounded import possible_commands, reachable
from ..physics.laws.damping_power import Envelope, envelope_of, mass_margin
from ..physics.motion import Array, Motion
from ..physics.reading import read_json
from ..physics.sources import stale_sources
from ..physics.stage import Say
from ..physics.vehicle import Vehicle, load_vehicle
from ..reports.terminal.progress import SHOWN, showing
from ..residuals.models.base import Model
from ..residuals.models.neural import is_network_folder
from .inputs import read_inputs
from .run_folder.moved_files import UNMOVED, Moved
from .run_folder.read import RunRecord, read_run_inputs
from .run_folder.run_files import is_run

_LEAST = 0.05
"""Least reach of an envelope that a network's standardisation gives [m/s, m/s, rad/s]: a boat that went only ahead
still drifts a little."""


@showing
def check(
    model: Model | PathLike,
    logs: Sequence[PathLike] | PathLike = (),
    vehicle: Vehicle | PathLike | None = None,
    reading: Reading = AS_GUESSED,
    *,
    moved: Moved = UNMOVED,
    seed: int = 0,
    progress: Say | None = SHOWN,
) -> Audit:
    """Judge any model by the laws of a hull in water, and find the state in which it breaks them.

    Parameters
    ----------
    model : a model, or the name of one: vehicle file, run folder, folder of a trained network, ONNX file, or
        `package.module:function`, which is imported
    logs : whose speeds are the envelope, and along which the energy is counted; without, a run folder's own
    vehicle : of the mass and commands of a model that carries none (ONNX, function)
    reading : how logs are read; broken ones are taken as they are. Of a run's own logs the run knows it
    moved : where a run folder's own logs and map are now
    seed : of everything random
    progress : called with lines about the work, shown where nothing is said; None for silence

    Raises
    ------
    RequestError, VehicleError, LogError
        when something cannot be read, or the model does not answer.
    """
    if isinstance(model, Model):
        found, path = model, None
    else:
        path = os.fspath(model)
        own = vehicle if isinstance(vehicle, Vehicle) or vehicle is None else load_vehicle(vehicle, judged=True)
        found = load_model(path, own, judged=True)
    paths = [logs] if isinstance(logs, str | os.PathLike) else list(logs)
    if moved.logs and (paths or path is None or not is_run(path)):
        raise RequestError("check: --log says where the logs of a run folder are now; give a run folder, and no LOG")
    record, note = (None, "") if paths or path is None else _own_logs(Path(path), moved)
    if paths:
        record = RunRecord(paths, reading, found.vehicle, DiscoverySettings())
    if mass_margin(found.vehicle) <= 0.0:  # a log prepared for a mass that cannot be tells nothing
        record, note = None, "Judged without a log: nothing means anything without a positive mass."
    motions: tuple[Motion, ...] = ()
    commands = None
    if record is not None:
        reading = replace(record.reading, as_is=True)  # only the speeds are wanted, and no thruster is judged
        judge = FOLDS if record.folds else "all"
        inputs = record.searched(read_inputs(record.logs, record.vehicle, reading, judge=judge, progress=progress))
        if record.folds:
            inputs = inputs.in_folds([one.fold(list(inputs.starts)) for one in record.folds])
        motions = inputs.parts.judged.motions
        envelope, source = envelope_of(motions, found.vehicle), "the speeds of the log"
    else:
        envelope, source, commands = _without_log(found, path)
    done = audit(found, envelope, motions=motions, commands=commands, envelope_from=source, seed=seed)
    notes = (*done.notes, *([note] if note else []), *stale_sources(found.vehicle))
    return replace(done, notes=notes)


def _own_logs(folder: Path, moved: Moved) -> tuple[RunRecord | None, str]:
    """What a run folder was made from, so that it is judged as in its `audit.json`; or why that cannot be read.

    Raises
    ------
    RequestError, VehicleError
        when that cannot be read where the user says that it is.
    """
    if not folder.is_dir() or is_network_folder(folder):
        return None, ""
    try:
        return read_run_inputs(folder, moved), ""
    except (RequestError, VehicleError) as error:
        if moved != UNMOVED:
            raise
        return None, f"Judged without the logs of the run: {error.typed}."


def _without_log(model: Model, path: str | None) -> tuple[Envelope, str, Array | None]:
    """Envelope, where it came from, and commands, of a model that is judged without a log."""
    stored = None if path is None else _stored_envelope(Path(path))
    if stored is not None:
        return stored, "the run folder: the speeds of its log", None
    commands = possible_commands(model.vehicle)
    if model.seen is not None:
        text = "all that its training has seen" if model.fades else "2 deviations about the mean of its training"
        return _trained_on(model.vehicle, *model.seen, commands, f"the network: {text}")
    return *reachable(model.vehicle, commands), commands  # the same, whatever the seed of the search


def _trained_on(vehicle: Vehicle, low: Array, high: Array, commands: Array, source: str) -> tuple[Envelope, str, Array]:
    """The envelope of a network's training, where it is from, and the commands whose thrust the network has seen."""
    lower = np.round(np.minimum(low[:3], -_LEAST), 3).tolist()
    upper = np.round(np.maximum(high[:3], _LEAST), 3).tolist()
    thrust = held_thrust(calm(vehicle), commands)[0]
    count = thrust.shape[0]
    inside = (np.clip(thrust.T, low[3 : 3 + count], high[3 : 3 + count]) == thrust.T).all(axis=1)
    envelope = Envelope((lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2]))
    return envelope, source, commands[inside]


def _stored_envelope(folder: Path) -> Envelope | None:
    """The envelope that the findings of a run folder hold; None where there is none."""
    if not folder.is_dir() or is_network_folder(folder):
        return None
    try:
        box = read_json(folder / "findings.json")["passivity"]["envelope"]
        (u0, u1), (v0, v1), (r0, r1) = (map(float, box[name]) for name in "uvr")
        return Envelope((u0, v0, r0), (u1, v1, r1))
    except (OSError, ValueError, KeyError, TypeError, OverflowError):
        return None


@showing
def distil(
    model: Model | PathLike,
    inputs: Inputs,
    settings: DiscoverySettings | None = None,
    *,
    progress: Say | None = SHOWN,
) -> Distilled:
    """Say what of a model's correction is a named effect, and what remains.

    The correction is what the model adds to the inputs' vehicle along the training and validation parts at 10 Hz, the
    rate that networks know.

    Parameters
    ----------
    model : a network, or any model of accelerations that takes the commands of the vehicle; or its folder or file
    inputs : logs and nominal vehicle, see `read_inputs`
    settings : of the search, its seed among them
    progress : called with lines about the work, shown where nothing is said; None for silence

    Raises
    ------
    RequestError
        when the model cannot be read or takes other commands, the logs are too short, or the model gives accelerations
        that are not finite.
    """
    expect("distil: inputs", inputs, Inputs, INPUTS_CURE)
    expect("distil: model", model, (Model, str, os.PathLike), MODEL_CURE)
    if not isinstance(model, Model):
        model = load_model(model)
    check_commands(model, inputs)
    parts = inputs.parted("explain").parts.split
    return distil_model(model, (*parts.train.motions, *parts.validation.motions), inputs.vehicle, settings, progress)
