"""The verb `check` as a user meets it: any model, its envelope, exit codes, and what it writes."""

import importlib.util
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from verbs import call, strict

import undertow
from undertow.comparison.audit import audit
from undertow.physics.errors import RequestError
from undertow.physics.laws.damping_power import Envelope, envelope_of
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.foreign import onnx_model

HULL = load_vehicle("blueboat")
HAS_ONNX = importlib.util.find_spec("onnxruntime") is not None
FOREIGN = """
import numpy as np
def drag(velocity, heading, commands):
    return -0.5 * velocity
def push(velocity, heading, commands):
    return 0.5 * velocity
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    return tmp_path


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "log.csv"
    assert call("simulate", "-v", "blueboat", "--duration", "60", "--out", path).exit_code == 0
    return path


def test_a_lawful_vehicle_passes_and_nothing_is_written(here: Path):
    result = call("check", "blueboat")
    said = " ".join(result.stdout.split())
    assert (result.exit_code, result.exception, list(here.iterdir())) == (0, None, [])
    for text in (
        "blueboat breaks no law. Judged for u from -2.17 to 2.17 m/s",
        "from the speeds that the vehicle reaches with its thrusters",
        "Without thrust the model loses energy everywhere in the envelope (proved: vertex LMI).",
        "Coriolis forces do no work.",
    ):
        assert text in said


def test_a_violation_is_exit_code_one_with_the_state(here: Path):
    result = call("check", "cybership2", "--out", "audit.json")
    said = " ".join(result.stdout.split())
    assert result.exit_code == 1
    assert "cybership2 breaks the law 'dissipation'" in said
    assert "it creates energy" in said
    assert "u = 0.00 m/s, v = " in said
    written = strict((here / "audit.json").read_text())
    assert (written["schema"], written["verdict"]) == ("undertow.audit/1", "fail")
    assert strict(call("check", "cybership2", "--json").stdout) == written


def test_the_table_fits_a_narrow_terminal(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", "80")
    lines = call("check", "cybership2").stdout.splitlines()
    assert max(map(len, lines)) <= 80
    assert "…" not in "".join(lines)


def test_the_log_gives_the_envelope_and_the_energy_balance(log: Path, here: Path):
    found = strict(call("check", "blueboat", log, "--json").stdout)
    assert found["envelope_from"] == "the speeds of the log"
    balance = next(law for law in found["laws"] if law["law"] == "energy balance")
    assert (balance["verdict"], balance["proof"]) == ("pass", "data only")
    assert set(balance["worst"]["at"]) == {"from", "to", "u", "v", "r"}
    motions = undertow.read_inputs(log, HULL, judge="all").parts.judged.motions
    assert found["envelope"] == envelope_of(motions, HULL).to_dict()


def test_a_run_folder_keeps_the_envelope_of_its_log(here: Path):
    HULL.save(here / "model.yaml")
    box = {"u": [-0.5, 1.5], "v": [-0.3, 0.3], "r": [-0.9, 0.9]}
    (here / "findings.json").write_text(json.dumps({"passivity": {"envelope": box}}))
    found = undertow.check(here)
    assert found.envelope.to_dict() == box
    assert found.envelope_from == "the run folder: the speeds of its log"
    (here / "findings.json").write_text("{}")
    assert undertow.check(here).envelope_from.startswith("the speeds that the vehicle reaches")


def test_a_run_folder_is_judged_along_its_own_logs(log: Path, here: Path):
    assert call("discover", log, "-v", "blueboat", "--out", "run", "--no-report").exit_code == 0
    stored, found = strict((here / "run" / "audit.json").read_text()), strict(call("check", "run", "--json").stdout)
    assert {**found, "model": stored["model"]} == stored
    record = json.loads((here / "run" / "run.json").read_text())
    (here / "run" / "run.json").write_text(json.dumps({**record, "logs": ["gone.csv"], "from_run": None}))
    without = undertow.check("run")
    assert without.envelope_from == "the run folder: the speeds of its log"
    assert without.ruling("energy balance").verdict == "not applicable"
    assert "Judged without the logs of the run: run was made from 'gone.csv', which is not there" in without.notes[0]


def test_a_network_is_judged_where_it_was_trained(here: Path, monkeypatch: pytest.MonkeyPatch):
    torch = pytest.importorskip("torch")
    from undertow.measurements.preparation.resampling import Standardisation
    from undertow.residuals.models.model_files import save_network
    from undertow.residuals.models.network_inputs import input_names
    from undertow.residuals.models.network_model import NetworkModel, scaling_of
    from undertow.residuals.networks.registry import build

    inputs = Standardisation(input_names(HULL, True), np.zeros(7), np.array([0.8, 0.2, 0.4, 8.0, 8.0, 0.7, 0.7]))
    network = build("lstm", scaling_of(HULL, inputs, np.array([0.1, 0.05, 0.1])))
    save_network(NetworkModel(HULL, network, 0.1), here / "net", {})
    settled, asked = NetworkModel.settled, []
    monkeypatch.setattr(NetworkModel, "settled", lambda *words: asked.append(len(words[1])) or settled(*words))
    result = call("check", "net")
    assert result.exit_code == 0, result.stdout
    assert sum(asked) < 150_000, "each is held for seconds, so this is what a verdict costs"
    assert "from the network: 2 deviations about the mean of its training" in " ".join(result.stdout.split())
    with torch.no_grad():
        network.get_parameter("head.bias").copy_(torch.tensor([0.0, 0.0, 5.0]))
    found = audit(NetworkModel(HULL, network, 0.1), Envelope((-1.0, -0.5, -1.0), (2.0, 0.5, 1.0)))
    assert found.ruling("rest stays at rest").verdict == "fail"


def test_a_function_is_imported_because_the_user_names_it(here: Path):
    (here / "foreign_boat.py").write_text(FOREIGN)
    assert call("check", "foreign_boat:drag", "-v", "blueboat").exit_code == 0
    result = call("check", "foreign_boat:push", "-v", "blueboat", "--json")
    found = strict(result.stdout)
    assert (result.exit_code, found["model"]) == (1, "foreign_boat:push")
    assert next(law for law in found["laws"] if law["law"] == "dissipation")["violating_share"] > 0.9
    assert str(here) not in sys.path


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("check",), "Missing argument 'MODEL'"),
        (("check", "operator:setitem"), "operator:setitem: it carries no mass and no thrusters; give --vehicle V"),
        (("check", "no_module:f"), "cannot import no_module"),
        (("check", "operator:add"), "expected f(velocity (n, 3), heading (n,), commands (n, thrusters)) -> "),
        (("check", "operator:add"), "got add(a, b, /): too many positional arguments"),
        (("check", "net.onnx"), "net.onnx: it carries no mass and no thrusters; give --vehicle V"),
        (("check", "no_module:f", "-v", "blueboat"), "cannot import no_module"),
        (("check", "nowhere.yaml"), "nowhere.yaml: no such file"),
        (("check", "blueboat", "nowhere.csv"), "nowhere.csv"),
        (("check", "blueboat", "--out", "no/audit.json"), "the folder no does not exist"),
    ],
)
def test_wrong_usage_is_exit_code_two(words: tuple[str, ...], text: str, here: Path):
    result = call(*words)
    assert result.exit_code == 2
    assert text in " ".join(result.stderr.split())
    assert list(here.iterdir()) == []


@pytest.mark.skipif(HAS_ONNX, reason="onnxruntime is installed")
def test_without_onnxruntime_the_message_says_how_to_get_it(here: Path):
    (here / "net.onnx").write_bytes(b"")
    result = call("check", "net.onnx", "-v", "blueboat")
    assert result.exit_code == 2
    assert "an ONNX model needs onnxruntime" in result.stderr
    assert "pip install -e '.[export]' -c constraints.txt" in result.stderr


@pytest.mark.skipif(not HAS_ONNX, reason="needs onnxruntime")
def test_a_broken_onnx_file_is_refused(here: Path):
    (here / "net.onnx").write_bytes(b"no network")
    result = call("check", "net.onnx", "-v", "blueboat")
    assert (result.exit_code, "onnxruntime cannot read it" in result.stderr) == (2, True)


class Session:
    """What onnxruntime's session is to us: inputs with name, type and shape, and a run."""

    def __init__(self, *shapes: tuple[Any, ...], kind: str = "tensor(float)") -> None:
        self.inputs = [SimpleNamespace(name=f"in{k}", type=kind, shape=shape) for k, shape in enumerate(shapes)]
        self.fed: dict[str, Any] = {}

    def get_inputs(self) -> list[Any]:
        return self.inputs

    def run(self, names: None, feed: dict[str, Any]) -> list[Any]:
        self.fed = feed
        return [-0.5 * feed["in0"][:, :3]]


def named(**shapes: tuple[Any, ...]) -> Session:
    session = Session(*shapes.values())
    for each, name in zip(session.inputs, shapes, strict=True):
        each.name = name
    return session


@pytest.mark.parametrize(
    ("session", "parts"),
    [
        (named(velocity=("n", 3), commands=("n", 2)), ["velocity", "commands"]),
        (named(commands=("n", 2), velocity=("n", 3)), ["commands", "velocity"]),
        (named(velocity=("n", 3)), ["velocity"]),
        (named(velocity=("n", "w"), heading=("n",)), ["velocity", "heading"]),
        (named(a=("n", 2), b=("n", 3)), ["commands", "velocity"]),
        (named(x=("n", 3)), ["velocity"]),
        (named(x=("n", 5)), ["velocity commands"]),
        (named(velocity=("n", 6)), ["velocity heading commands"]),
        (named(x=("n", "w")), ["velocity heading commands"]),
    ],
)
def test_an_onnx_model_may_lack_what_it_does_not_use(session: Session, parts: list[str]):
    fed: dict[str, Any] = {}
    session.run = lambda names, feed: fed.update(feed) or [np.zeros((5, 3))]  # type: ignore[method-assign]
    given = {"velocity": np.full((5, 3), 1.0), "heading": np.full(5, 2.0), "commands": np.full((5, 2), 3.0)}
    onnx_model(session, HULL, "net").settled(**given)  # type: ignore[arg-type]
    for said, part in zip(fed.values(), parts, strict=True):
        wanted = np.concatenate([given[p].reshape(5, -1) for p in part.split()], axis=1)
        assert np.array_equal(said.reshape(5, -1), wanted)


@pytest.mark.parametrize("session", [named(v=("n", 3), w=("n", 3)), named(x=("n", 7)), named(a=("n", 3), b=("n", 9))])
def test_an_onnx_model_with_unknown_inputs_is_told_what_may_be(session: Session):
    with pytest.raises(RequestError, match=r"expected some of the inputs velocity .*input_names="):
        onnx_model(session, HULL, "net")


@pytest.mark.parametrize(
    ("change", "law"),
    [
        ("mass: -22.0", "positive mass"),
        ("mass: 0.0", "positive mass"),
        ("inertia_z: -1.0", "positive mass"),
        ("added_mass: {Y_vdot: 40.0}", "positive mass"),
        ("damping: {}", "bounded speed"),
        ("damping: {X_u: 60.0}", "dissipation"),
    ],
)
def test_a_vehicle_that_cannot_be_gets_a_verdict(change: str, law: str, log: Path, here: Path):
    key = change.split(":")[0]
    data = {**HULL.to_dict(), **yaml.safe_load(change)}
    (here / "boat.yaml").write_text(yaml.safe_dump(data))
    for logs in ((), (log,)) if key != "damping" else ((),):
        result = call("check", "boat.yaml", *logs, "--json")
        found = strict(result.stdout)
        assert (result.exit_code, found["verdict"]) == (1, "fail")
        assert law in [each["law"] for each in found["laws"] if each["verdict"] == "fail"]


@pytest.mark.parametrize(
    ("shapes", "fed"),
    [
        ((("n", 3), ("n",), ("n", 2)), [(5, 3), (5,), (5, 2)]),
        ((("n", 3), ("n", 1), ("n", 2)), [(5, 3), (5, 1), (5, 2)]),
        ((("n", 6),), [(5, 6)]),
    ],
)
def test_an_onnx_model_is_fed_side_by_side_or_apart(shapes: tuple[tuple[Any, ...], ...], fed: list[tuple[int, ...]]):
    session = Session(*shapes)
    model = onnx_model(session, HULL, "net")
    nu = np.arange(15.0).reshape(5, 3)
    assert model.settled(nu, np.zeros(5), np.ones((5, 2))) == pytest.approx(-0.5 * nu)
    assert [x.shape for x in session.fed.values()] == fed
    assert {x.dtype for x in session.fed.values()} == {np.dtype("float32")}
    assert audit(model, Envelope((-1.0, -0.5, -1.0), (2.0, 0.5, 1.0))).verdict == "pass"


def test_an_onnx_model_with_other_inputs_is_refused():
    with pytest.raises(RequestError, match="expected some of the inputs velocity.*got in0 tensor.int64."):
        onnx_model(Session(("n", 6), kind="tensor(int64)"), HULL, "net")


def test_a_model_that_is_in_memory_is_judged_like_a_file():
    assert undertow.check(VehicleModel(HULL, "blueboat")).to_dict() == undertow.check("blueboat").to_dict()
