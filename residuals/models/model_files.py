"""The folder of a trained network: `model.yaml` with settings, `weights.safetensors` with numbers.

Nothing is unpickled: YAML is checked key by key, weights by the SHA-256 in `model.yaml`. torch loads on use.
"""

import hashlib
import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, StrictBool, ValidationError, model_validator

from ...measurements.preparation.resampling import Standardisation
from ...physics.errors import RequestError, VehicleError, listed, shown
from ...physics.files import on_top, strict_json, write_bytes, write_text, written_by, yaml_text
from ...physics.folders import finish_move, replace_folder
from ...physics.reading import (
    Number,
    Plain,
    Positive,
    complaint,
    complaints,
    location,
    parse_json,
    parse_yaml,
    read_bytes,
    read_yaml,
    reason,
    unknown_key,
)
from ...physics.vehicle import Vehicle, vehicle_from_dict
from .band_record import PredictionBand
from .interval import Interval
from .network_inputs import input_names
from .neural import CHECKPOINT, SCHEMA, SETTINGS, WEIGHTS, require_torch

if TYPE_CHECKING:
    from torch import Tensor

    from ..networks.base import Network, Scaling
    from ..networks.trust import Trust
    from .network_model import NetworkModel


class TrustRecord(BaseModel):
    """A `networks.trust.Trust`, by axis; the `fade` of older files is one reach, within which a correction is whole."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    lower: tuple[Number, ...]
    upper: tuple[Number, ...]
    reaches: tuple[Positive, ...]
    weights: tuple[tuple[Number, ...], tuple[Number, ...], tuple[Number, ...]]
    error: tuple[tuple[Number, ...], tuple[Number, ...], tuple[Number, ...]]

    @model_validator(mode="before")
    @classmethod
    def _of_an_older_file(cls, said: object) -> object:
        if not (isinstance(said, dict) and "distance" in said):
            return said
        rest = {name: value for name, value in said.items() if name != "distance"}
        return {"reaches": [said["distance"]], "weights": [[1.0, 0.0]] * 3, "error": [[0.0, 0.0]] * 3} | rest

    @classmethod
    def of(cls, trust: "Trust") -> "TrustRecord":
        """Record of a trust region for a file."""
        names = ("lower", "upper", "reaches", "weights", "error")
        return cls.model_validate({name: getattr(trust, name).tolist() for name in names})

    def trust(self, inputs: int, where: str) -> "Trust":
        """Trust region of a network that knows so many velocities and thrusts; loads torch.

        Raises
        ------
        RequestError
            when the numbers are too many or too few for it, or no shares; `where` names the file.
        """
        from ..networks.trust import Trust, directions

        sides, count = len(directions(inputs)), len(self.reaches)
        if (len(self.lower), len(self.upper)) != (sides, sides):
            raise RequestError(
                f"{where}: expected {sides} ends below and {sides} above of what training has seen, got "
                f"{len(self.lower)} and {len(self.upper)}; the file is damaged, so train the network again"
            )
        rows = (*self.weights, *self.error)
        if (
            not count
            or any(len(row) != count + 1 for row in rows)
            or any(min(row) < 0.0 or sum(row) > 1.0 + 1e-6 for row in self.weights)
        ):
            raise RequestError(
                f"{where}: trust: expected for each axis {count + 1} shares of at least 0 and at most 1 together, "
                f"got {self.weights}; the file is damaged, so train the network again"
            )
        return Trust(*(np.array(getattr(self, name)) for name in ("lower", "upper", "reaches", "weights", "error")))


_MADE_FOR = "undertow.settings_sha256"
"""Key of the digest of the settings in the metadata of the weights: weights mean nothing under other settings."""
VERB = "train"
DISTILLATION = "distillation.json"
"""What a network's folder says of its correction; it goes when another network takes the folder."""
NETWORK_FILES = (SETTINGS, WEIGHTS, CHECKPOINT, DISTILLATION)
"""What a network's folder, or that of a training under way, may hold."""
_BEGINNINGS = {CHECKPOINT: b"undertow.checkpoint/3", DISTILLATION: b'"schema": "undertow.distillation/1"'}
_HEAD = 300
"""Bytes at the beginning of a file in which its schema stands [B]."""
_MOST_WEIGHTS = 2**29
"""Bytes of the weights: networks here have some 100 kB, and a hundred million numbers are more than any boat needs."""
_SAME = 1e-6
"""Relative difference up to which two constants are the same; weights are written in single precision."""


class _Input(BaseModel):
    """One input of the network and how it is standardised."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    name: str
    mean: Number
    scale: Positive


class _Settings(BaseModel):
    """The content of `model.yaml`."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    schema_name: Literal["undertow.network/1"] = Field(alias="schema")
    network: str
    options: Plain  # the registry of networks checks them
    pure: StrictBool
    time_step: Positive
    inputs: tuple[_Input, ...]
    output_scale: tuple[Positive, Positive, Positive]
    trust: TrustRecord | None = None
    fade: TrustRecord | None = None  # what older files call it
    interval: Interval | None = None
    band: PredictionBand | None = None
    vehicle: dict[str, object]
    weights_sha256: str = Field(pattern="^[0-9a-f]{64}$")
    training: dict[str, object]


def own_network(folder: Path) -> set[str]:
    """Names of the files of a network, or of a training under way, that undertow wrote and nobody changed since."""
    own = {name for name, begin in _BEGINNINGS.items() if begin in _head(folder / name)}
    if written_by(folder / SETTINGS) != VERB:
        return own
    said = re.search(r"^weights_sha256: ([0-9a-f]{64})$", (folder / SETTINGS).read_text("utf-8"), re.MULTILINE)
    weights = (folder / WEIGHTS).read_bytes() if (folder / WEIGHTS).is_file() else b""
    same = said is not None and hashlib.sha256(weights).hexdigest() == said[1]
    return own | {SETTINGS} | ({WEIGHTS} if same else set())


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            return stream.read(_HEAD)
    except OSError:
        return b""


def save_network(
    model: "NetworkModel", folder: str | os.PathLike[str], training: Mapping[str, object], *, force: bool = False
) -> Path:
    """Write a network's folder; weights are kept in the network's own precision.

    The folder is replaced as a whole, see `replace_folder`: what an earlier network and its training left goes.

    Parameters
    ----------
    folder : made if it is missing, in a folder that exists; other files in it stay
    training : plain data: the settings and the log of the training
    force : replace also files that undertow did not write, or that were changed since

    Raises
    ------
    RequestError
        when torch is missing, the folder cannot be written or holds the model of something else, or the network was
        not made for the vehicle's thrusters, inputs and mass.
    """
    require_torch()
    from safetensors.torch import save

    target = Path(folder)
    _check_target(target)
    scaling = model.network.scaling
    _check_scaling(scaling, model.vehicle, f"cannot write the network to {target}")
    constants = scaling.inputs
    settings = {
        "schema": SCHEMA,
        "network": model.network.name,
        "options": dict(model.network.options),
        "pure": model.pure,
        "time_step": float(model.time_step),
        "inputs": [
            {"name": name, "mean": float(mean), "scale": float(scale)}
            for name, mean, scale in zip(constants.names, constants.mean, constants.scale, strict=True)
        ],
        "output_scale": [float(scale) for scale in scaling.output],
        "vehicle": model.vehicle.to_dict(),
    }
    if model.network.gain is not None:
        settings["trust"] = TrustRecord.of(model.network.gain.trust).model_dump(mode="json")
    if model.interval is not None:
        settings["interval"] = model.interval.model_dump(mode="json")
    if model.band is not None:
        settings["band"] = model.band.model_dump(mode="json")
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in model.network.state_dict().items()}
    weights = save(tensors, {_MADE_FOR: _digest(settings)})
    settings |= {
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
        "training": parse_json(strict_json(dict(training))),
    }
    text = yaml_text(settings, width=120, default_flow_style=None)

    def build(work: Path) -> tuple[str, str]:
        write_bytes(work / WEIGHTS, weights)
        write_text(work / SETTINGS, on_top(VERB, text))
        return WEIGHTS, SETTINGS

    try:
        replace_folder(target, build, own_network, force=force)
    except OSError as error:
        raise RequestError(f"cannot write the network to {target}: {error.strerror or error}") from None
    return target


def load_network(folder: str | os.PathLike[str]) -> "NetworkModel":
    """Read a network's folder; the model bears the folder's name.

    Raises
    ------
    RequestError
        when torch is missing, or the folder is not one that `save_network` wrote: a file is missing, damaged or from
        another network.
    """
    source = Path(folder)
    finish_move(source)
    settings = _settings(source)
    require_torch()
    from .network_model import NetworkModel, scaling_of

    try:
        vehicle = vehicle_from_dict(settings.vehicle, f"{source / SETTINGS}: vehicle")
    except VehicleError as error:
        raise RequestError(error.typed) from None
    names = tuple(column.name for column in settings.inputs)
    mean, scale = (np.array([getattr(column, key) for column in settings.inputs]) for key in ("mean", "scale"))
    scaling = scaling_of(vehicle, Standardisation(names, mean, scale), np.array(settings.output_scale))
    _check_scaling(scaling, vehicle, f"{source / SETTINGS}")
    weights, made_for = _weights(source / WEIGHTS, settings.weights_sha256)
    network = _network(settings, scaling, weights, source)
    trust = settings.trust or settings.fade
    if trust is not None:
        network.trust(trust.trust(3 + scaling.drives, f"{source / SETTINGS}"))
    if settings.interval is not None:
        settings.interval.check(vehicle, f"{source / SETTINGS}")
    if made_for != _digest(read_yaml(source / SETTINGS)):
        raise RequestError(
            f"{source / SETTINGS}: the weights were trained under other settings, so the file was edited; put it back, "
            "or train the network again"
        )
    model = NetworkModel(vehicle, network, settings.time_step, pure=settings.pure, name=source.name)
    model.interval, model.band = settings.interval, settings.band
    return model


def _check_target(target: Path) -> None:
    if target.exists() and not target.is_dir():
        raise RequestError(f"cannot write the network to {target}: it is a file; give a folder that may be made")
    if not target.absolute().parent.is_dir():
        raise RequestError(f"cannot write the network to {target}: {target.absolute().parent} does not exist; make it")


def _settings(source: Path) -> _Settings:
    path = source / SETTINGS
    try:
        content = read_yaml(path)
    except FileNotFoundError:
        raise RequestError(
            f"network {source}: expected a folder with {SETTINGS} and {WEIGHTS}, but {path} is missing"
        ) from None
    except NotADirectoryError:
        raise RequestError(f"network {source}: expected a folder, got a file") from None
    except (OSError, ValueError) as error:
        raise RequestError(f"{path}: not readable as YAML ({reason(error)})") from None
    if not isinstance(content, dict):
        raise RequestError(f"{path}: expected a mapping with schema {SCHEMA!r}, got {type(content).__name__}")
    if content.get("schema") != SCHEMA:
        raise RequestError(f"{path}: expected schema {SCHEMA!r}, got {shown(content.get('schema'))}")
    try:
        return _Settings.model_validate(content)
    except ValidationError as error:
        raise RequestError(f"{path}: {complaints(error.errors(include_url=False), _in_words)}") from None


def _in_words(item: Any) -> str:
    """One of pydantic's complaints as a sentence."""
    where = location(item["loc"])
    if item["type"] == "extra_forbidden":
        fields = (_Input if item["loc"][0] == "inputs" else _Settings).model_fields
        return unknown_key(where, [field.alias or name for name, field in fields.items()])
    if item["type"] == "missing":
        return f"the key {where!r} is missing"
    return complaint(item, item["loc"])


def _check_scaling(scaling: "Scaling", vehicle: Vehicle, where: str) -> None:
    """Refuse a network whose inputs or constants are not those of the vehicle."""
    from .network_model import scaling_of

    names = scaling.inputs.names
    fitting = [input_names(vehicle, heading) for heading in (False, True)]
    if names not in fitting:
        raise RequestError(
            f"{where}: the inputs do not fit the vehicle's thrusters: expected {' '.join(fitting[0])} "
            f"[cos_psi sin_psi], got {listed(names)}"
        )
    own = scaling_of(vehicle, scaling.inputs, scaling.output)
    for label in ("mass", "reach"):
        if not _same(getattr(scaling, label), getattr(own, label)):
            raise RequestError(f"{where}: the {label} that the network was made with is not that of its vehicle")


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and np.allclose(one, other, rtol=_SAME, atol=1e-3 * _SAME * np.abs(other).max())


def _digest(settings: Mapping[str, object]) -> str:
    """Digest of all that gives weights their meaning, the same before and after a trip through YAML."""
    meant = {name: value for name, value in settings.items() if name not in ("weights_sha256", "training")}
    plain = parse_yaml(yaml.safe_dump(meant))
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def _weights(path: Path, digest: str) -> "tuple[dict[str, Tensor], str | None]":
    """Give the tensors, and the digest of the settings that they belong to."""
    from safetensors import SafetensorError
    from safetensors.torch import load

    try:
        data = read_bytes(path, _MOST_WEIGHTS)
    except (OSError, ValueError) as error:
        raise RequestError(f"{path}: cannot be read ({reason(error)}); a network needs its weights") from None
    found = hashlib.sha256(data).hexdigest()
    if found != digest:
        raise RequestError(
            f"{path}: expected the weights with SHA-256 {digest[:12]}..., as {SETTINGS} says, got {found[:12]}...: the "
            "file is damaged, or from another network"
        )
    try:
        tensors = load(data)
        header = parse_json(data[8 : 8 + int.from_bytes(data[:8], "little")])
        return tensors, (header.get("__metadata__") or {}).get(_MADE_FOR)
    except (SafetensorError, ValueError, KeyError) as error:
        raise RequestError(f"{path}: not readable as safetensors ({error})") from None


def _network(settings: _Settings, scaling: "Scaling", weights: "dict[str, Tensor]", source: Path) -> "Network":
    """Build the network and fill it; nothing is allocated before the file's own tensors are known to fill it."""
    import torch

    from ..networks.registry import build

    def refuse(text: str) -> NoReturn:
        raise RequestError(f"{source / WEIGHTS}: {text}")

    try:
        with torch.device("meta"):
            wanted = build(settings.network, scaling, settings.options).state_dict()
    except RequestError as error:
        raise RequestError(f"{source / SETTINGS}: {error.typed}") from None
    if wanted.keys() != weights.keys():
        lacking = listed(sorted(wanted.keys() - weights.keys())) or "none"
        beyond = listed(sorted(weights.keys() - wanted.keys())) or "none"
        refuse(f"these are not the tensors of a network {settings.network}; missing: {lacking}; unknown: {beyond}")
    for name, expected in wanted.items():
        tensor = weights[name]
        here, there = (f"{str(t.dtype).removeprefix('torch.')} {list(t.shape)}" for t in (expected, tensor))
        if here != there:
            refuse(f"expected {name} as {here}, as the options in {SETTINGS} have it, got {there}")
        if not torch.isfinite(tensor).all():
            refuse(f"{name} holds numbers that are not finite; train the network again")
    with torch.random.fork_rng(devices=[]):
        network = build(settings.network, scaling, settings.options)
    for name, constant in network.named_buffers():
        if name in weights and not _same(weights[name].numpy(), constant.numpy()):
            refuse(f"{name} differs from what {SETTINGS} says of inputs, output and vehicle")
    network.load_state_dict(weights)
    return network
