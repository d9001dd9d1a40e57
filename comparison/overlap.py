"""Whether a model was fitted to the rows on which it is judged: what its own files say of that, as notes."""

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..measurements.log_digests import log_digests
from ..measurements.prepared_logs import FOLDS, Inputs
from ..physics.in_words import listing
from ..physics.reading import Plain, read_yaml
from ..physics.sources import WHOLE
from ..physics.vehicle import Vehicle
from ..residuals.models.base import Model, VehicleModel
from ..residuals.models.neural import SETTINGS, is_network_folder

_SOURCE = re.compile(rf"(?:identified by undertow from|fitted by undertow to) ({WHOLE})?([^;(]+)")
"""How `sources` in a vehicle file name the logs, and whether to every row of them; see `physics.sources.with_sources`.
"""
_FITTED = ("train", "validation", "all", FOLDS)
"""Rows of a log of which undertow fits some; it never fits the test part, where one is kept."""

Digests = Sequence[tuple[str, str | None]]
"""Paths or names of logs, each with its SHA-256 where that is known."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Judged logs to which a model was fitted: those known by their content, and those that only bear the name."""

    same: tuple[str, ...]
    alike: tuple[str, ...]


def fitted_notes(models: Sequence[tuple[str, Model]], inputs: Inputs) -> list[str]:
    """Sentences that name every model that was fitted to the judged logs, or of which nobody can know.

    Parameters
    ----------
    models : path as the user gave it, and model; an empty path for the nominal one
    inputs : what is judged

    Returns
    -------
    list of str
        Empty where every model is known to come from other logs.
    """
    records = [(path, model.name, logs_of(path, model)) for path, model in models]
    known = any(record for _, _, record in records)  # or no log need be read again
    judged = _pairs(log_digests(inputs.paths if known else ()))
    sure: dict[tuple[str, ...], list[str]] = {}
    perhaps: dict[tuple[str, ...], list[str]] = {}
    unknown = [name for path, name, record in records if path and not record]
    for _, name, record in records:
        found = overlap(record, judged)
        if found.same:
            sure.setdefault(found.same, []).append(name)
        elif found.alike:
            perhaps.setdefault(found.alike, []).append(name)
    whole = {model.name for path, model in models if _saw_everything(path, model)}
    fitted = inputs.parts.judge in _FITTED
    told = []
    for of, known_by in (("", sure), (" of the same name", perhaps)):
        for logs, names in known_by.items():
            for group, saw in ([n for n in names if n in whole], True), ([n for n in names if n not in whole], fitted):
                told += [_sentence(group, logs, of, saw)] if group else []
    if unknown:
        told.append(
            f"whether {listing(unknown)} {_were(unknown)} fitted to the judged rows cannot be known: no file of "
            f"{'it' if len(unknown) == 1 else 'them'} says to which logs"
        )
    return told


def overlap(record: Digests, judged: Digests) -> Overlap:
    """Which of the judged logs a model was fitted to: by their SHA-256 where both are known, else by their names."""
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
    source = Path(path)
    folder = source if source.is_dir() else source.parent
    whole = source.is_dir() or source.name == SETTINGS
    if os.fspath(path) and whole and is_network_folder(folder):
        return _recorded(_read(folder / SETTINGS).get("training"))
    if os.fspath(path) and whole and (folder / "run.json").is_file():
        return _recorded(_read(folder / "run.json"))
    # A network or a foreign model carries the nominal vehicle, whose sources are not its own.
    return _named_in(model.vehicle) if isinstance(model, VehicleModel) else []


def _saw_everything(path: str | os.PathLike[str], model: Model) -> bool:
    """Whether a model was fitted to all rows of its logs: a discovery that folds judged keeps no test part."""
    if os.fspath(path) and (Path(path) / "run.json").is_file():
        return _read(Path(path) / "run.json").get("judged_on") == FOLDS
    return isinstance(model, VehicleModel) and any(every for every, _ in _told_of(model.vehicle))


def _told_of(vehicle: Vehicle) -> list[tuple[str, str]]:
    """What the sources of a vehicle say of logs: `WHOLE` or nothing, and their names."""
    return re.findall(_SOURCE, json.dumps(vehicle.sources, ensure_ascii=False))


def _named_in(vehicle: Vehicle) -> Digests:
    """Names of logs in the sources of a vehicle."""
    names = (name.strip(' "}') for _, logs in _told_of(vehicle) for name in logs.split(", "))
    return [(name, None) for name in dict.fromkeys(names)]


def _recorded(record: Any) -> Digests:
    """The logs of a record of a training or a run; nothing where it holds something else."""
    found: dict[str, list[Any]] = {"log_sha256": [], "logs": []}
    for key in found:
        told = record.get(key) if isinstance(record, dict) else None
        found[key] = told if isinstance(told, list) else []
    pairs = _pairs([item for item in found["log_sha256"] if isinstance(item, dict)])
    return pairs or [(name, None) for name in found["logs"] if isinstance(name, str)]


def _pairs(items: Sequence[Mapping[str, str | None]]) -> Digests:
    return [(str(item.get("path")), item.get("sha256")) for item in items]


def _read(path: Path) -> Plain:
    """A file of plain data; nothing where it cannot be read, about which whoever loads the model complains."""
    try:
        content = read_yaml(path)
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _sentence(names: Sequence[str], logs: Sequence[str], of: str, fitted: bool) -> str:
    who, which = listing(list(names)), listing(list(logs))
    whose = f"{'logs' if len(logs) > 1 else 'a log'}{of} ({which})" if of else which
    done = f"{who} {'may have been' if of else _were(names)} fitted to"
    if fitted:
        return f"{done} rows that are judged here, of {whose}: errors there are too small"
    return f"{done} the earlier parts of {whose}, but not to the test part, which judges"


def _were(names: Sequence[str]) -> str:
    return "was" if len(names) == 1 else "were"
