"""Models by name, whatever a user puts behind `--model`, and whether one was fitted to the rows that judge it."""

import json
import os
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..measurements.formats.registry import log_digests
from ..measurements.prepared_logs import ALL, FOLDS, Inputs, PathLike
from ..physics.errors import RequestError
from ..physics.folders import finish_move
from ..physics.presentation import listing
from ..physics.reading import Plain, read_json, read_yaml
from ..physics.sources import WHOLE
from ..physics.vehicle import Vehicle, load_vehicle
from ..residuals.models.base import Model, VehicleModel
from ..residuals.models.foreign import NO_MASS, is_function_name, load_function, load_onnx
from ..residuals.models.model_files import load_network
from ..residuals.models.neural import SETTINGS, WEIGHTS, is_network_folder
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
    finish_move(source)
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
        found = _corrected(source)
        model = VehicleModel(written, source.name, "symbolic", found.parameters or 0)
        model.band = found.band
        return model
    return VehicleModel(load_vehicle(path, judged=judged), source.stem, "physics")


def fitted_numbers(run: Path) -> int:
    """Number of parameters fitted in the corrected model of a run folder, by its own comparison; 0 without one."""
    return _corrected(run).parameters or 0


def _corrected(run: Path) -> ComparedModel:
    """What the comparison of a run folder says of its corrected model; nothing where there is none that can be read."""
    path, models = run / "comparison.json", ()
    with suppress(OSError, ValueError):
        models = Comparison.read(read_json(path), path, "").models
    return next((model for model in models if model.name == CORRECTED), ComparedModel(name=CORRECTED))


_SOURCE = re.compile(rf"(?:identified by undertow from|fitted by undertow to) ({WHOLE})?([^;(]+)")
"""How `sources` in a vehicle file name the logs, and whether to every row of them; see `physics.sources.with_sources`.
"""
_FITTED = ("train", "validation", ALL, FOLDS)
"""Rows of a log of which undertow fits some; it never fits the test part, where one is kept."""

Digests = Sequence[tuple[str, str | None]]
"""Paths or names of logs, each with its SHA-256 where that is known."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Judged logs to which a model was fitted: those known by their content, and those that only bear the name."""

    same: tuple[str, ...]
    alike: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A model, and to which logs it was fitted, as far as its files say.

    Attributes
    ----------
    path : as the user gave it; empty for the nominal one
    model : which one; its name is that under which it is compared
    logs : to which it was fitted; empty where no file says
    overlap : which of the judged logs are among them
    whole : it was fitted to every row of its logs
    """

    path: str
    model: Model
    logs: Digests
    overlap: Overlap
    whole: bool

    @property
    def known_disjoint(self) -> bool:
        """True when it is known to come from other logs than the judged ones."""
        return bool(self.logs) and not (self.overlap.same or self.overlap.alike)

    def saw(self, judge: str) -> bool:
        """True when it was fitted to rows of its logs that judge."""
        return self.whole or judge in _FITTED

    def saw_judged(self, judge: str) -> bool:
        """True when it was fitted to rows that judge: a judged log has the content of one of its own, or its name."""
        return bool(self.overlap.same or self.overlap.alike) and self.saw(judge)


def fitted_to(models: Sequence[tuple[str, Model]], paths: Sequence[str]) -> list[Fitted]:
    """Logs to which models were fitted, as far as their files say.

    Parameters
    ----------
    models : path as the user gave it, and model; an empty path for the nominal one
    paths : of the logs that are judged; what they hold is known by their SHA-256, wherever they lie now

    Returns
    -------
    list of Fitted
        One of each model, in their order.
    """
    known = [_provenance(path, model) for path, model in models]
    told = any(record for record, _ in known)
    judged = _pairs(log_digests(paths if told else ()))  # where no record is, no log need be read again
    return [
        Fitted(path, model, record, overlap(record, judged), whole)
        for (path, model), (record, whole) in zip(models, known, strict=True)
    ]


def fitted_notes(models: Sequence[Fitted], judge: str) -> list[str]:
    """Sentences that name every model that was fitted to the judged logs, or of which nobody can know.

    Parameters
    ----------
    models : see `fitted_to`
    judge : what judges, see `Parts`

    Returns
    -------
    list of str
        Empty where every model is known to come from other logs.
    """
    alike: defaultdict[tuple[str, tuple[str, ...]], list[Fitted]] = defaultdict(list)
    for one in models:
        of, logs = ("", one.overlap.same) if one.overlap.same else (" of the same name", one.overlap.alike)
        if logs:
            alike[of, logs].append(one)
    told = []
    for (of, logs), known in sorted(alike.items(), key=lambda group: group[0][0]):  # what is sure first
        for saw in (True, False):
            names = [one.model.name for one in known if one.saw(judge) is saw]
            told += [_sentence(names, logs, of, judge if saw else "")] if names else []
    unknown = [one.model.name for one in models if one.path and not one.logs]
    if unknown:
        told.append(
            f"whether {listing(unknown)} {_were(unknown)} fitted to the judged rows cannot be known: no file of "
            f"{'it' if len(unknown) == 1 else 'them'} says to which logs"
        )
    return told


def overlap(record: Digests, judged: Digests) -> Overlap:
    """Judged logs to which a model was fitted: by their SHA-256 where both are known, else by their names."""
    same, alike = [], []
    for path, digest in judged:
        for other, known in record:
            if digest and known:
                if digest == known:
                    same.append(Path(path).name)
                    break
            elif Path(other).name == Path(path).name:
                alike.append(Path(path).name)
                break
    return Overlap(tuple(same), tuple(alike))


def logs_of(path: str | os.PathLike[str], model: Model) -> Digests:
    """The logs that a model was fitted to, with their SHA-256 where its files know them; empty where none says."""
    return _provenance(path, model)[0]


def _provenance(path: str | os.PathLike[str], model: Model) -> tuple[Digests, bool]:
    """See `logs_of`; and True where the model was fitted to every row of them, as a discovery that folds judged is."""
    source, given = Path(path), bool(os.fspath(path))
    folder = source if source.is_dir() else source.parent
    if given and (source.is_dir() or source.name == SETTINGS) and is_network_folder(folder):
        return _recorded(_read(folder / SETTINGS).get("training")), False
    run = source.parent if source.name == "model.yaml" else source
    if given and (record := _read(run / "run.json")):
        return _recorded(record), record.get("judged_on") == FOLDS
    if not isinstance(model, VehicleModel):
        return [], False  # a network or a foreign model carries the nominal vehicle, whose sources are not its own
    found = re.findall(_SOURCE, json.dumps(model.vehicle.sources, ensure_ascii=False))
    names = (name.strip(' "}') for _, logs in found for name in logs.split(", "))
    return [(name, None) for name in dict.fromkeys(names)], any(every for every, _ in found)


def _recorded(record: Any) -> Digests:
    """The logs of a record of a training or a run; nothing where it holds something else."""
    given = record if isinstance(record, dict) else {}
    digests, names = (told if isinstance(told := given.get(key), list) else [] for key in ("log_sha256", "logs"))
    pairs = _pairs([item for item in digests if isinstance(item, dict)])
    return pairs or [(name, None) for name in names if isinstance(name, str)]


def _pairs(items: Sequence[Mapping[str, str | None]]) -> Digests:
    return [(str(item.get("path")), item.get("sha256")) for item in items]


def _read(path: Path) -> Plain:
    """A file of plain data; nothing where it cannot be read, about which whoever loads the model complains."""
    content = None
    with suppress(OSError, ValueError):
        content = read_yaml(path)
    return content if isinstance(content, dict) else {}


def _sentence(names: Sequence[str], logs: Sequence[str], of: str, judge: str) -> str:
    """That models saw the rows that judge, or where `judge` is empty that they saw others of the same logs."""
    who, which = listing(list(names)), listing(list(logs))
    whose = f"{'logs' if len(logs) > 1 else 'a log'}{of} ({which})" if of else which
    done = f"{who} {'may have been' if of else _were(names)} fitted to"
    if judge:
        uncounted = "" if judge == "test" else ", and do not count"
        uncounted += "; if it is another log, give it another name" * bool(of)
        return f"{done} rows that are judged here, of {whose}: errors there are too small{uncounted}"
    return f"{done} the earlier parts of {whose}, but not to the test part, which judges"


def _were(names: Sequence[str]) -> str:
    return "was" if len(names) == 1 else "were"
