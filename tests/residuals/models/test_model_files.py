"""The folder of a network: a round trip without loss, and a clear refusal of everything that is not whole."""

import hashlib
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml
from safetensors.torch import load, save

from undertow.comparison.models_by_name import load_model
from undertow.measurements.preparation.resampling import Standardisation
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.errors import RequestError, VehicleError
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.interval import Interval
from undertow.residuals.models.model_files import _MADE_FOR, _digest, load_network, own_network, save_network
from undertow.residuals.models.network_inputs import input_names, network_inputs
from undertow.residuals.models.network_model import NetworkModel, scaling_of
from undertow.residuals.models.neural import is_network_folder
from undertow.residuals.networks.registry import NETWORKS, build
from undertow.residuals.networks.trust import Trust
from undertow.workflows.compare import compare
from undertow.workflows.inputs import read_inputs

HULL = load_vehicle("blueboat")
TRAINING = {"seed": 3, "epochs": [{"loss": np.float64(0.5), "rmse": (0.1, 0.2, 0.3)}, {"loss": float("inf")}]}


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("log") / "log.csv.gz"
    simulate_world(HULL, {}, duration=60.0, seed=1).write(path)
    return path


@pytest.fixture(scope="module")
def inputs(log: Path) -> Inputs:
    return read_inputs(log, HULL)


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate_world(HULL, {}, duration=30.0, seed=2).motion(0.1)


def trained(
    name: str, motion: Motion, seed: int = 0, heading: bool = False, fade: float = 0.0, **settings
) -> NetworkModel:
    """A model as training would leave it: standardised by data, with no weight at zero; one that fades knows a half."""
    columns = network_inputs(HULL, motion, heading)
    constants = Standardisation.of(input_names(HULL, heading), columns)
    torch.manual_seed(seed)
    network = build(
        name, scaling_of(HULL, constants, np.array([0.11, 0.07, 0.13])), {} if name == "ridge" else {"units": 8}
    )
    with torch.no_grad():
        for parameter in filter(torch.is_floating_point, network.parameters()):
            parameter.add_(0.1 * torch.randn(parameter.shape))
    if fade:
        network.trust(Trust.within(constants.apply(columns)[: len(columns) // 2, :5], fade))
    model = NetworkModel(HULL, network, 0.1, **settings)
    if fade:
        margins = tuple(tuple(0.01 * (axis + size + 1.0) for size in range(11)) for axis in range(3))
        model.interval = Interval(level=0.95, learnt=margins, alone=margins[::-1], wider=(1.0, 2.0, 3.0))
    return model


@pytest.fixture
def folder(tmp_path: Path, motion: Motion) -> Path:
    return save_network(trained("lstm", motion), tmp_path / "net", TRAINING)


def edit(folder: Path, change: Callable[[dict[str, Any]], None]) -> None:
    content = yaml.safe_load((folder / "model.yaml").read_text())
    change(content)
    (folder / "model.yaml").write_text(yaml.safe_dump(content))


def reweigh(folder: Path, change: Callable[[dict[str, torch.Tensor]], Any]) -> None:
    """Change the weights, and the digest with them, as someone who knows the format would."""
    tensors = load((folder / "weights.safetensors").read_bytes())
    change(tensors)
    data = save(tensors)
    (folder / "weights.safetensors").write_bytes(data)
    edit(folder, lambda c: c.update(weights_sha256=hashlib.sha256(data).hexdigest()))


# The round trip


@pytest.mark.parametrize(
    "settings", [{}, {"fade": 0.5}, {"pure": True, "heading": True}], ids=["hybrid", "fading", "pure with heading"]
)
@pytest.mark.parametrize("name", NETWORKS)
def test_a_round_trip_gives_the_same_to_the_last_bit(name: str, settings: dict, motion: Motion, tmp_path: Path):
    if name.startswith("symmetric"):  # what pushes by heading has sides
        settings = settings | {"heading": False}
    model = trained(name, motion, **settings)
    state = torch.random.get_rng_state()
    again = load_network(save_network(model, tmp_path / "net", TRAINING))
    assert torch.equal(torch.random.get_rng_state(), state), "reading a file draws no random numbers"
    assert np.array_equal(again.acceleration(motion), model.acceleration(motion))
    starts = np.array([0, 50])
    assert np.array_equal(again.rollout(motion, starts, 40).states, model.rollout(motion, starts, 40).states)
    assert again.vehicle == HULL
    assert np.array_equal(again.beyond(motion), model.beyond(motion))
    mine, theirs = model.margin(motion), again.margin(motion)
    assert mine is theirs is None or np.array_equal(mine, theirs)  # type: ignore[arg-type]
    kept = ("kind", "pure", "time_step", "parameters", "heading", "fades", "interval")
    assert [getattr(again, key) for key in kept] == [getattr(model, key) for key in kept]
    assert again.name == "net"
    assert sorted(os.listdir(tmp_path / "net")) == ["model.yaml", "weights.safetensors"]


def test_a_network_of_an_older_version_fades_as_it_did(motion: Motion, tmp_path: Path):
    """It has one distance, and is whole within: the weight of its correction was (1 - (d / distance)^2)^2."""
    model = trained("mlp", motion, fade=0.5)
    folder = save_network(model, tmp_path / "net", TRAINING)

    def older(content: dict[str, Any]) -> None:
        trust = content.pop("trust")
        content["fade"] = {"distance": 0.5, "lower": trust["lower"], "upper": trust["upper"]}

    edit(folder, older)
    seal(folder)
    again = load_network(folder)
    said, distance = again.correction(motion), model.beyond(motion)
    assert np.array_equal(said, model.correction(motion))
    assert (distance > 0.0).any()
    assert again.far == 0.5
    model.trust(None)
    weight = np.maximum(1.0 - (distance / 0.5) ** 2, 0.0) ** 2
    assert said == pytest.approx(weight[:, None] * model.correction(motion), rel=1e-4, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda trust: trust["lower"].pop(), "expected 25 ends below and 25 above"),
        (lambda trust: trust["weights"][1].append(0.0), "expected for each axis 2 shares"),
        (lambda trust: trust["weights"][2].__setitem__(0, 1.5), "at most 1 together"),
    ],
)
def test_a_gain_that_is_none_is_refused(change: Callable[[dict], Any], told: str, motion: Motion, tmp_path: Path):
    folder = save_network(trained("mlp", motion, fade=0.5), tmp_path / "net", TRAINING)
    edit(folder, lambda content: change(content["trust"]))
    with pytest.raises(RequestError, match=told):
        load_network(folder)


def seal(folder: Path) -> None:
    """Write the digest of changed settings into the weights, as the version that wrote them would have."""
    content = yaml.safe_load((folder / "model.yaml").read_text())
    data = save(load((folder / "weights.safetensors").read_bytes()), {_MADE_FOR: _digest(content)})
    (folder / "weights.safetensors").write_bytes(data)
    edit(folder, lambda c: c.update(weights_sha256=hashlib.sha256(data).hexdigest()))


def test_the_settings_are_plain_to_read(folder: Path, motion: Motion):
    content = yaml.safe_load((folder / "model.yaml").read_text())
    assert content["schema"] == "undertow.network/1"
    assert (content["network"], content["options"]) == ("lstm", {"units": 8, "layers": 1})
    assert content["pure"] is False
    assert content["time_step"] == 0.1
    assert [c["name"] for c in content["inputs"]] == ["u", "v", "r", "thrust_port", "thrust_stbd"]
    assert content["inputs"][0]["mean"] == pytest.approx(network_inputs(HULL, motion, False)[:, 0].mean(), rel=1e-12)
    assert content["output_scale"] == [0.11, 0.07, 0.13]
    assert content["vehicle"]["mass"] == HULL.mass
    assert content["training"] == {"seed": 3, "epochs": [{"loss": 0.5, "rmse": [0.1, 0.2, 0.3]}, {"loss": None}]}


def test_equal_models_give_equal_bytes(motion: Motion, tmp_path: Path):
    one, other = (save_network(trained("tcn", motion), tmp_path / name, TRAINING) for name in "ab")
    for file in ("model.yaml", "weights.safetensors"):
        assert (one / file).read_bytes() == (other / file).read_bytes()


def test_an_earlier_network_is_replaced_and_other_files_stay(folder: Path, motion: Motion):
    (folder / "notes.txt").write_text("mine")
    model = trained("mlp", motion, seed=9)
    save_network(model, folder, {})
    assert np.array_equal(load_network(folder).acceleration(motion), model.acceleration(motion))
    assert sorted(os.listdir(folder)) == ["model.yaml", "notes.txt", "weights.safetensors"]


@pytest.mark.parametrize("file", ["weights.safetensors", "model.yaml"])
@pytest.mark.parametrize("first", [False, True])
def test_a_disk_that_fails_leaves_the_earlier_network(
    file: str, first: bool, folder: Path, motion: Motion, monkeypatch: pytest.MonkeyPatch
):
    replace, place = os.replace, folder.with_name("new") if first else folder
    before = sorted(os.listdir(folder.parent)), load_network(folder).acceleration(motion)

    def failing(source: Any, target: Any) -> None:
        if Path(target).name == file:
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", failing)
    with pytest.raises(RequestError, match="cannot write the network to .*No space left on device"):
        save_network(trained("mlp", motion), place, {})
    assert np.array_equal(load_network(folder).acceleration(motion), before[1])
    assert sorted(os.listdir(folder)) == ["model.yaml", "weights.safetensors"]
    assert sorted(os.listdir(folder.parent)) == before[0]


@pytest.mark.parametrize("name", ["model.yaml", "weights.safetensors"])
def test_a_network_that_somebody_changed_is_not_lost(name: str, folder: Path, motion: Motion):
    with (folder / name).open("ab") as stream:
        stream.write(b"# mine")
    with pytest.raises(RequestError, match=f"holds .*{name}.*which undertow did not|nothing that this verb wrote"):
        save_network(trained("mlp", motion), folder, {})
    save_network(trained("mlp", motion), folder, {}, force=True)
    assert own_network(folder) == {"model.yaml", "weights.safetensors"}


def test_places_that_cannot_be_written_are_refused(tmp_path: Path, motion: Motion):
    model = trained("mlp", motion)
    (tmp_path / "file").write_text("")
    (tmp_path / "run").mkdir()
    HULL.save(tmp_path / "run" / "model.yaml")
    for place, match in (
        (tmp_path / "file", "it is a file; give a folder"),
        (tmp_path / "no" / "net", "does not exist; make it"),
        (tmp_path / "run", r"the folder holds other files \(model.yaml\)"),
    ):
        with pytest.raises(RequestError, match=match):
            save_network(model, place, {})
    assert load_vehicle(tmp_path / "run" / "model.yaml") == HULL


def test_a_network_made_for_another_vehicle_is_not_written(tmp_path: Path, motion: Motion):
    network = trained("mlp", motion).network
    with pytest.raises(RequestError, match="the mass that the network was made with is not that of its vehicle"):
        save_network(NetworkModel(HULL.with_values({"mass": 40.0}), network, 0.1), tmp_path / "net", {})
    with pytest.raises(
        RequestError, match=r"do not fit the vehicle's thrusters: expected .* thrust_left .* thrust_port"
    ):
        save_network(NetworkModel(renamed("left"), network, 0.1), tmp_path / "net", {})
    assert os.listdir(tmp_path) == []


def renamed(port: str):
    first, second = HULL.thrusters
    return HULL.model_copy(update={"thrusters": (first.model_copy(update={"name": port}), second)})


# What is not whole


SETTINGS_DAMAGE: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "fade of another size": (
        lambda c: c.update(fade={"distance": 0.5, "lower": [0.0], "upper": [1.0]}),
        r"model.yaml: expected 25 ends below and 25 above of what training has seen, got 1 and 1; the file is damaged",
    ),
    "margins of another size": (
        lambda c: c.update(interval={"level": 0.95, "learnt": [[1.0]], "alone": [], "wider": [1.0, 1.0, 1.0]}),
        r"model.yaml: interval: expected 3 rows of 11 margins each, got .*; the file is damaged",
    ),
    "fade at once": (
        lambda c: c.update(fade={"distance": 0.0, "lower": [], "upper": []}),
        r"fade.reaches.0: .*a number above 0, got 0.0",
    ),
    "schema": (lambda c: c.update(schema="undertow.network/9"), r"expected schema 'undertow.network/1', got '.*/9'"),
    "no schema": (lambda c: c.pop("schema"), r"expected schema 'undertow.network/1', got None"),
    "extra key": (lambda c: c.update(time_stp=0.2), r"unknown key 'time_stp': did you mean 'time_step'\?"),
    "extra input key": (
        lambda c: c["inputs"][1].update(scal=1.0),
        r"unknown key 'inputs.1.scal': did you mean 'scale'",
    ),
    "missing key": (lambda c: c.pop("pure"), r"the key 'pure' is missing"),
    "word for a number": (lambda c: c.update(time_step="fast"), r"time_step: .*number.*, got 'fast'"),
    "backwards": (lambda c: c.update(time_step=-0.1), r"time_step: .*a number above 0, got -0.1"),
    "not finite": (
        lambda c: c["inputs"][0].update(mean=float("nan")),
        r"inputs.0.mean: .*finite number .*, got nan",
    ),
    "no scale": (lambda c: c["inputs"][2].update(scale=0.0), r"inputs.2.scale: .*a number above 0, got 0.0"),
    "two axes": (lambda c: c["output_scale"].pop(), r"output_scale"),
    "pure as a word": (lambda c: c.update(pure="yes"), r"pure: .*boolean, got 'yes'"),
    "no digest": (lambda c: c.update(weights_sha256="abc"), r"weights_sha256: .*, got 'abc'"),
    "another digest": (lambda c: c.update(weights_sha256="0" * 64), r"expected the weights with SHA-256 000000000000"),
    "unknown network": (lambda c: c.update(network="lsmt"), r"unknown network 'lsmt': did you mean 'lstm'"),
    "unknown option": (lambda c: c["options"].update(unit=8), r"unknown option 'unit': did you mean 'units'"),
    "code for an option": (lambda c: c["options"].update(units="os.system"), r"whole number .* got 'os.system'"),
    "absurd option": (lambda c: c["options"].update(units=10**9), r"expected a whole number in \(0, 4096\] for units"),
    "more units": (
        lambda c: c["options"].update(units=4096, layers=1),
        r"expected body.weight_ih_l0 as float32 \[16384, 5\], as",
    ),
    "a machine's memory and more": (
        lambda c: c.update(network="tcn", options={"units": 4096, "kernel": 64, "layers": 16}),
        r"not the tensors of a network tcn; missing: blocks.0.0.bias",
    ),
    "more layers": (lambda c: c["options"].update(layers=16), r"not the tensors of a network lstm; missing: body"),
    "another network": (lambda c: c.update(network="mlp", options={"units": 8}), r"not the tensors of a network mlp"),
    "mean": (lambda c: c["inputs"][3].update(mean=c["inputs"][3]["mean"] + 0.01), r"input_mean differs from what"),
    "scale": (lambda c: c["inputs"][0].update(scale=c["inputs"][0]["scale"] * 1.001), r"input_scale differs from what"),
    "output": (lambda c: c["output_scale"].__setitem__(1, 0.08), r"output_scale differs from what"),
    "inputs swapped": (
        lambda c: c["inputs"].reverse(),
        r"inputs do not fit the vehicle's thrusters: expected u v r thr",
    ),
    "an input less": (lambda c: c["inputs"].pop(), r"inputs do not fit the vehicle's thrusters"),
    "a thruster less": (
        lambda c: c["vehicle"]["thrusters"].pop(),
        r"expected u v r thrust_port \[cos_psi sin_psi\], got",
    ),
    "unsound vehicle": (lambda c: c["vehicle"].update(mass=-1.0), r"model.yaml: vehicle: mass: .*a number above 0"),
    "vehicle key": (lambda c: c["vehicle"].update(mas=1.0), r"unknown key 'mas' .*: did you mean 'mass'"),
}


@pytest.mark.parametrize("damage", SETTINGS_DAMAGE)
def test_damaged_settings_are_refused(damage: str, folder: Path):
    change, match = SETTINGS_DAMAGE[damage]
    edit(folder, change)
    with pytest.raises(RequestError, match=match):
        load_network(folder)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("schema: [", r"model.yaml: not readable as YAML"),
        ("- a list", r"expected a mapping with schema 'undertow.network/1', got list"),
        ("", r"expected a mapping with schema 'undertow.network/1', got NoneType"),
        ("schema: undertow.network/1\nschema: undertow.network/1", r"key 'schema' stands twice"),
        ("schema: !!python/object/apply:os.system [echo]", r"not readable as YAML .*the tag .*python/object"),
        ("schema: undertow.network/1", r"the key 'network' is missing; the key 'options' is missing"),
    ],
    ids=["broken", "list", "empty", "twice", "code", "short"],
)
def test_a_file_that_is_no_settings_is_refused(text: str, match: str, folder: Path):
    (folder / "model.yaml").write_text(text)
    with pytest.raises(RequestError, match=match):
        load_network(folder)


WEIGHTS_DAMAGE: dict[str, tuple[Callable[[dict[str, torch.Tensor]], Any], str]] = {
    "not finite": (lambda t: t["head.weight"].fill_(float("nan")), r"head.weight holds numbers that are not finite"),
    "infinite": (lambda t: t["body.bias_ih_l0"].fill_(float("inf")), r"body.bias_ih_l0 holds numbers that are not fin"),
    "lacking": (lambda t: t.pop("head.bias"), r"not the tensors of a network lstm; missing: head.bias; unknown: none"),
    "beyond": (lambda t: t.update(extra=torch.ones(2)), r"missing: none; unknown: extra"),
    "shape": (
        lambda t: t.update({"head.bias": torch.ones(4)}),
        r"expected head.bias as float32 \[3\].*got float32 \[4\]",
    ),
    "type": (lambda t: t.update({"head.bias": torch.ones(3).double()}), r"got float64 \[3\]"),
    "constants": (lambda t: t["input_mean"].add_(0.1), r"input_mean differs from what model.yaml says"),
    "constants nan": (
        lambda t: t["output_scale"].fill_(float("nan")),
        r"output_scale holds numbers that are not finite",
    ),
}


@pytest.mark.parametrize("damage", WEIGHTS_DAMAGE)
def test_damaged_weights_are_refused_though_the_digest_fits(damage: str, folder: Path):
    change, match = WEIGHTS_DAMAGE[damage]
    reweigh(folder, change)
    with pytest.raises(RequestError, match=match):
        load_network(folder)


def test_mass_in_the_weights_must_be_the_vehicles(tmp_path: Path, motion: Motion):
    folder = save_network(trained("dissipative", motion), tmp_path / "net", {})
    edit(folder, lambda c: c["vehicle"].update(mass=31.0))
    with pytest.raises(RequestError, match=r"differs from what model.yaml says of inputs, output and vehicle"):
        load_network(folder)


@pytest.mark.parametrize(
    ("line", "other"),
    [("pure: false", "pure: true"), ("time_step: 0.1", "time_step: 0.05"), ("X_u:", "N_ur: -3.0, X_u:")],
)
def test_settings_that_the_weights_were_not_trained_under_are_refused(line: str, other: str, folder: Path):
    path = folder / "model.yaml"
    text = path.read_text()
    assert line in text
    path.write_text(text.replace(line, other, 1))
    with pytest.raises(RequestError, match="trained under other settings, so the file was edited"):
        load_network(folder)


@pytest.mark.parametrize("kept", [0, 7, 200, -1])
def test_truncated_or_touched_weights_are_refused(kept: int, folder: Path):
    path = folder / "weights.safetensors"
    whole = path.read_bytes()
    path.write_bytes(whole[:kept])
    with pytest.raises(
        RequestError, match=r"expected the weights with SHA-256 .* the file is damaged, or from another"
    ):
        load_network(folder)
    edit(folder, lambda c: c.update(weights_sha256=hashlib.sha256(whole[:kept]).hexdigest()))
    with pytest.raises(RequestError, match=r"weights.safetensors: not readable as safetensors"):
        load_network(folder)
    path.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(RequestError, match=r"the file is damaged"):
        load_network(folder)


def test_a_pickle_is_never_opened(folder: Path, tmp_path: Path):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "sprung"),)

    torch.save({"head.bias": Trap()}, folder / "weights.safetensors")
    digest = hashlib.sha256((folder / "weights.safetensors").read_bytes()).hexdigest()
    edit(folder, lambda c: c.update(weights_sha256=digest))
    with pytest.raises(RequestError, match="not readable as safetensors"):
        load_network(folder)
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize("file", ["model.yaml", "weights.safetensors"])
def test_a_missing_file_is_named(file: str, folder: Path):
    (folder / file).unlink()
    assert is_network_folder(folder), "a damaged network is one all the same, so that the message is about networks"
    with pytest.raises(RequestError, match=file):
        load_network(folder)


def test_what_is_no_folder_is_refused(tmp_path: Path, log: Path):
    with pytest.raises(RequestError, match=r"expected a folder with model.yaml and weights.safetensors"):
        load_network(tmp_path / "nowhere")
    with pytest.raises(RequestError, match=r"expected a folder, got a file"):
        load_network(log)


# Every place that takes a model


def test_network_folders_are_told_from_run_folders(folder: Path, tmp_path: Path):
    (tmp_path / "run").mkdir()
    HULL.save(tmp_path / "run" / "model.yaml")
    assert is_network_folder(folder)
    assert not is_network_folder(tmp_path / "run")
    assert not is_network_folder(folder / "model.yaml")
    assert not is_network_folder(tmp_path / "nowhere")
    assert load_model(folder).kind == "hybrid"
    assert load_model(tmp_path / "run").kind == "symbolic"


def test_networks_stand_in_the_comparison(inputs: Inputs, motion: Motion, tmp_path: Path):
    for name, settings in (("lstm", {}), ("mlp", {"pure": True})):
        save_network(trained(name, motion, **settings), tmp_path / name, TRAINING)
    (tmp_path / "again").mkdir()
    twin = save_network(trained("tcn", motion), tmp_path / "again" / "lstm", {})
    found = compare(inputs, [tmp_path / "lstm", tmp_path / "mlp", twin])
    assert found.models[0].name == "nominal"
    models = [m for m in found.models if m.name not in ("calibrated", "zero acceleration", "hold velocity")]
    assert [m.name for m in models] == ["nominal", "lstm", "mlp", str(twin)]
    assert [m.kind for m in models] == ["physics", "hybrid", "network", "hybrid"]
    sizes = [0, *(load_network(f).parameters for f in (tmp_path / "lstm", tmp_path / "mlp", twin))]
    assert [m.parameters for m in models] == sizes
    for model in models:
        assert set(model.rollout) == {"2"}
        assert all(np.isfinite(v) for v in model.acceleration.rmse.to_dict().values())
    assert {place.model for place in found.failures} <= {"nominal", str(twin)}


def test_a_network_of_other_commands_or_another_rate_is_refused(inputs: Inputs, motion: Motion, tmp_path: Path):
    other = renamed("left")
    constants = Standardisation.of(input_names(other, False), network_inputs(other, motion, False))
    network = build("mlp", scaling_of(other, constants, np.ones(3)))
    save_network(NetworkModel(other, network, 0.1), tmp_path / "other", {})
    with pytest.raises(
        RequestError, match=r"expected the commands .* newton_port newton_stbd, got newton_left newton_st"
    ):
        compare(inputs, [tmp_path / "other"])
    model = trained("mlp", motion)
    save_network(NetworkModel(HULL, model.network, 0.05), tmp_path / "fast", {})
    with pytest.raises(
        RequestError, match=r"model fast: expected rows 0.05 s apart.*got 0.1 s; prepare the log at 20 Hz"
    ):
        compare(inputs, [tmp_path / "fast"])


def test_a_network_is_no_vehicle(folder: Path, log: Path):
    with pytest.raises(VehicleError, match=r"this is a file of schema .undertow.network/1., not a vehicle"):
        read_inputs(log, folder)
    with pytest.raises(VehicleError, match=r"this is a file of schema 'undertow.network/1', not a vehicle"):
        read_inputs(log, folder / "model.yaml")


# Without torch


BLOCKED = """
import sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("torch", "safetensors"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Blocked())
import undertow
from undertow.__main__ import main
sys.argv = ["undertow", *sys.argv[1:]]
main()
"""


def without_torch(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", BLOCKED, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(str(words[1])).parent)


def test_everything_else_works_without_torch(log: Path, tmp_path: Path):
    HULL.with_values({"X_u": -10.0}).save(tmp_path / "other.yaml")
    ran = without_torch("compare", log, "--vehicle", "blueboat", "--model", tmp_path / "other.yaml")
    assert ran.returncode == 0, ran.stderr
    assert "other" in ran.stdout


def test_a_network_without_torch_gives_the_hint(log: Path, folder: Path):
    ran = without_torch("compare", log, "--vehicle", "blueboat", "--model", folder)
    assert ran.returncode == 2
    assert re.fullmatch(
        r"undertow: a neural network needs torch and safetensors \(No module named 'torch'\): "
        r".*pip install -e '\.\[neural\]' -c constraints\.txt \(in .*\)\n",
        ran.stderr,
    )
    assert "Traceback" not in ran.stdout
