"""Files that undertow or a user writes, spoilt in their structure: for benchmarks/fuzz_files.py and its fast slice."""

import copy
import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import yaml
from log_samples import broken, small_world
from sample_run import compare_many, edit, law, write_sample

from undertow.measurements.formats.registry import log_digests
from undertow.measurements.log_options import Reading
from undertow.physics.vehicle import load_vehicle

HOSTILE: tuple[Any, ...] = (
    *(None, True, False, "", "x", "nan", "1e999", "0x", -1, 0, 1, 7.5, -1e-3, 1e308, -1e308, 5e-324, 1e15, 1e30),
    *(10**400, "\x1b[31mred\x9b2J", "two\nlines", "\u202egnp", "\ud800", "<script>alert(1)</script>", "[red]x[/]"),
    *("x" * 5000, [], {}, [[]], [None], ["x"], [1, 2, 3, 4, 5, 6, 7], {"": ""}, {"x": {"x": {"x": 1}}}, "2001-99-99"),
    *([0] * 30_000, "surge", "10", "u|u|", "../../etc/passwd", {"\x1b": 1}, {"10": "x"}, [{}], [{"effect": 3}]),
)
"""What a value is replaced by."""
_LINES = (
    "!!int ''",
    "!!float x",
    "&a [*a]",
    "*a",
    "[" * 3000,
    "{" * 3000,
    "!!binary =",
    "<<: 1",
    "? [1]",
    "-",
    "1" * 5000,
)
"""What a value of YAML is replaced by in the text."""


def spoilt(content: Any, chance: Random) -> Any:
    """A copy of plain data with one to three values replaced, left out, renamed, doubled, moved or scaled."""
    content = copy.deepcopy(content)
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        places = [(content, key) for key in _keys(content)]
        for holder, key in places:
            places += [(holder[key], inner) for inner in _keys(holder[key])]
        if not places:
            return chance.choice(HOSTILE)
        holder, key = chance.choice(places)
        _spoil(holder, key, chance, places)
    return content


def _keys(value: Any) -> list[Any]:
    return (
        list(value) if isinstance(value, dict) else list(range(min(len(value), 40))) if isinstance(value, list) else []
    )


def _spoil(holder: Any, key: Any, chance: Random, places: list[Any]) -> None:
    if key not in _keys(holder):
        return  # an earlier change took it away
    way = chance.randrange(10)
    other, there = chance.choice(places)
    if way == 0:
        del holder[key]
    elif way == 1 and isinstance(holder, dict):
        holder[chance.choice(("x", "", "\x1b[2J", "schema", f"{key}\n", f"{key}"[:-1]))] = holder.pop(key)
    elif way == 2 and there in _keys(other):
        holder[key] = copy.deepcopy(other[there])
    elif way == 3 and isinstance(holder[key], float):
        holder[key] *= chance.choice((-1.0, 0.0, 1e-12, 1e12, 1e300))
    elif way == 4:
        holder[key] = [holder[key]]
    else:
        holder[key] = copy.deepcopy(chance.choice(HOSTILE))


def spoilt_json(content: bytes, seed: int) -> bytes:
    """JSON spoilt in its structure; in one case of eight, its bytes are broken."""
    chance = Random(seed)
    if chance.random() < 0.12:
        return chance.choice(
            (broken(content, seed), b"[" * 100_000, b'{"a":' * 5000, content[:-3] + b"1e999}", b"\xff\xfe")
        )
    return json.dumps(spoilt(json.loads(content), chance)).encode()


def spoilt_yaml(content: bytes, seed: int) -> bytes:
    """YAML spoilt in its structure; in one case of four, its text is: tags, anchors, depth, or broken bytes."""
    chance = Random(seed)
    if chance.random() < 0.1:
        return broken(content, seed)
    if chance.random() < 0.15:
        lines = content.decode().splitlines()
        at = chance.randrange(len(lines))
        lines[at] = lines[at].partition(":")[0] + ": " + chance.choice(_LINES)
        return "\n".join(lines).encode()
    data = spoilt(yaml.safe_load(content), chance)
    try:
        return yaml.safe_dump(data, sort_keys=False).encode()
    except (yaml.YAMLError, ValueError, UnicodeError):
        return repr(data)[:10_000].encode("utf-8", "replace")


@dataclass(frozen=True)
class Kind:
    """One kind of file: how it is spoilt, and what is then done with it.

    Attributes
    ----------
    write : makes a sound file, and all that is needed beside it, in a folder; gives the file
    spoil : of the content and a seed
    use : every way in which verbs read the file
    """

    write: Callable[[Path], Path]
    spoil: Callable[[bytes, int], bytes]
    use: Callable[[Path], None]


def _vehicle(folder: Path) -> Path:
    path = folder / "boat.yaml"
    load_vehicle("blueboat_paper").save(path)
    return path


def _use_vehicle(path: Path) -> None:
    from undertow.physics.worlds.world import simulate_world

    vehicle = load_vehicle(path)
    vehicle.save(path.with_name("again.yaml"))
    load_vehicle(path.with_name("again.yaml"))
    simulate_world(vehicle, {}, duration=2.0, noise="clean", seed=0)


def _map(folder: Path) -> Path:
    small_world().write(folder / "log.csv")
    path = folder / "map.yaml"
    path.write_text(
        "u: {from: 'odometry:u', scale: 2.0, offset: 0.0}\npsi: {from: 'odometry:psi', unit: deg, frame: enu}\n"
        "v: 'odometry:v'\nnewton_port: {from: 'command:newton_port', scale: 1.0}\npwm_stbd: null\n"
    )
    return path


def _use_map(path: Path) -> None:
    from undertow.measurements.log import read_log

    read_log(path.with_name("log.csv"), Reading(channel_map=path))


def _run(name: str, folder: Path) -> Path:
    run = write_sample(folder / "run", seconds=60.0)
    compare_many(run)
    laws = [law("dissipation"), law("bounded speed", "fail")]
    speeds = {"u": [-1.0, 2.0], "v": [-0.5, 0.5], "r": [-0.5, 0.5]}
    audit = {"schema": "undertow.audit/1", "model": "run", "verdict": "fail", "laws": laws, "envelope": speeds}
    (run / "audit.json").write_text(json.dumps({**audit, "envelope_from": "the log", "notes": ["n"]}))
    log = str(small_world().write(folder / "log.csv"))
    record = {"schema": "undertow.run/1", "logs": [log], "frame": None, "channel_map": None, "namespace": None}
    told = {"versions": {"python": "3.11"}, "log_sha256": log_digests([log]), "command": "undertow"}
    (run / "run.json").write_text(json.dumps({**record, **told, "seed": 0, "as_is": False}))
    worst = {"value": -1.0, "at": {"u": 0.1, "v": 0.0, "r": 0.0}}
    law_held = {"verdict": "pass", "proof": "vertex LMI", "price": 0.0, "sentence": "It holds.", "worst": worst}
    edit(run / "findings.json", lambda findings: findings.update(passivity={"envelope": speeds, **law_held}))
    return run / name


def _use_run(path: Path) -> None:
    """As report, add --run, check RUN, compare --model RUN and explain RUN read it."""
    from undertow.comparison import models_by_name as fitted_on
    from undertow.comparison.models_by_name import load_model
    from undertow.physics.errors import RequestError, VehicleError
    from undertow.reports.page.page import fleet_page, page
    from undertow.workflows import check_and_explain as checked
    from undertow.workflows.run_folder.read import read_run, read_run_inputs

    refused: Exception | None = None
    for use in (read_run_inputs, load_model, checked._stored_envelope):
        try:
            use(path.parent)
        except (RequestError, VehicleError) as error:
            refused = error
    fitted_on.logs_of(path.parent, load_model("blueboat"))
    run = read_run(path.parent)
    page(run).encode()
    fleet_page([run, run], path.parent).encode()
    if refused is not None:
        raise refused


def _network(folder: Path) -> Path:
    """A network's folder, as `train` leaves it."""
    import numpy as np

    from undertow.measurements.preparation.resampling import Standardisation
    from undertow.residuals.models.model_files import save_network
    from undertow.residuals.models.network_inputs import input_names
    from undertow.residuals.models.network_model import NetworkModel, scaling_of
    from undertow.residuals.networks.registry import build

    hull = load_vehicle("blueboat")
    names = input_names(hull, False)
    constants = Standardisation(names, np.zeros(len(names)), np.ones(len(names)))
    network = build("mlp", scaling_of(hull, constants, np.array([0.1, 0.1, 0.1])), {"units": 4})
    training = {"logs": ["log.csv"], "log_sha256": [{"path": "log.csv", "sha256": "0" * 64}], "epochs": [{"loss": 0.5}]}
    return save_network(NetworkModel(hull, network, 0.1), folder / "net", training) / "model.yaml"


def _use_network(path: Path) -> None:
    from undertow.comparison import models_by_name as fitted_on
    from undertow.comparison.models_by_name import load_model

    fitted_on.logs_of(path.parent, load_model("blueboat"))
    load_model(path.parent)


def _use_weights(path: Path) -> None:
    """Weights whose digest is that of the settings, or the file would not be looked into."""
    settings = path.with_name("model.yaml")
    content = yaml.safe_load(settings.read_text())
    content["weights_sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
    settings.write_text(yaml.safe_dump(content, sort_keys=False))
    _use_network(settings)


def _checkpoint(folder: Path) -> Path:
    import torch

    from undertow.residuals.training.checkpoint import Checkpoint, write_checkpoint
    from undertow.residuals.training.history import Epoch

    weights = {"a": torch.zeros(3), "b": torch.ones(2, 2)}
    averaged, kept, moments = ({name: value.clone() for name, value in weights.items()} for _ in range(3))
    state = Checkpoint(
        weights, averaged, {1: kept}, {0: moments}, torch.get_rng_state(), [Epoch(1, 1.0, 0.5, 0.0)], 2.0, {"data": "x"}
    )
    write_checkpoint(folder, state)
    return folder / "checkpoint.safetensors"


def _use_checkpoint(path: Path) -> None:
    from undertow.residuals.training.checkpoint import read_checkpoint

    read_checkpoint(path.parent, {"data": "x"})


def _limits(folder: Path) -> Path:
    from undertow.comparison.error_limits import limits_from_dict

    errors = {"surge": 0.1, "sway": 0.05, "yaw": 0.2}
    content = {"predictions": {2: errors, 10: {"position": 1.5, **errors}}, "acceleration": errors, "laws": "pass"}
    return limits_from_dict(content, "limits").save(folder / "limits.yaml", "made up")


def _use_limits(path: Path) -> None:
    from undertow.comparison.error_limits import load_limits

    load_limits(path).text()


_JSON = ("findings.json", "comparison.json", "audit.json", "inspection.json", "run.json")
KINDS: dict[str, Kind] = {
    "vehicle": Kind(_vehicle, spoilt_yaml, _use_vehicle),
    "channel map": Kind(_map, spoilt_yaml, _use_map),
    "limits": Kind(_limits, spoilt_yaml, _use_limits),
    **{name: Kind(partial(_run, name), spoilt_json, _use_run) for name in _JSON},
    "nominal.yaml": Kind(partial(_run, "nominal.yaml"), spoilt_yaml, _use_run),
    "model.yaml": Kind(partial(_run, "model.yaml"), spoilt_yaml, _use_run),
    "series.csv": Kind(partial(_run, "series.csv"), broken, _use_run),
    "network": Kind(_network, spoilt_yaml, _use_network),
    "weights": Kind(lambda folder: _network(folder).with_name("weights.safetensors"), broken, _use_weights),
    "checkpoint": Kind(_checkpoint, broken, _use_checkpoint),
}
"""Every file that a verb reads, but for logs (see `log_samples`), by its name."""


def judged(kind: Kind, path: Path, sound: bytes, seed: int) -> str:
    """Use a spoilt file: "read", "clear error", or what went wrong."""
    from undertow.physics.errors import MOST_SHOWN, LogError, RequestError, VehicleError

    path.write_bytes(kind.spoil(sound, seed))
    try:
        kind.use(path)
    except (LogError, RequestError, VehicleError) as error:
        return "clear error" if len(str(error)) <= MOST_SHOWN else f"a message of {len(str(error))} characters"
    except Exception as error:
        at = error.__traceback__
        while at is not None and at.tb_next is not None:
            at = at.tb_next
        where = f"{Path(at.tb_frame.f_code.co_filename).name}:{at.tb_lineno}" if at else ""
        return f"{type(error).__name__} at {where}: {str(error)[:100]}"
    return "read"
