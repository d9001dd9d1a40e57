"""The verb `train` as a user meets it, and what it writes."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
import yaml
from verbs import call, done, strict

import undertow
from undertow.cli.train_verb import parsed_options, settings_with
from undertow.comparison.models_by_name import load_model
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.reports.terminal.progress import Progress, epoch_lines, epoch_words
from undertow.residuals.models.model_files import load_network
from undertow.residuals.training.history import Epoch
from undertow.workflows.inputs import read_inputs
from undertow.workflows.train import train


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a log of a world that lacks quadratic drag, and a network M trained on it."""
    folder = tmp_path_factory.mktemp("train")
    hidden = ("--effect", "surge_quadratic_damping=-10", "--duration", "90")
    done("simulate", "-v", "blueboat", *hidden, "--out", folder / "log.csv")
    words = ("--residual", "mlp", "--option", "units=32", "--epochs", "20")
    result = call("train", folder / "log.csv", "-v", "blueboat", *words, "--out", folder / "M")
    assert (result.exit_code, result.exception) == (0, None), result.stderr
    (folder / "said.txt").write_text(result.stdout)
    (folder / "progress.txt").write_text(result.stderr)
    return folder


def test_training_goes_on_from_a_network(place: Path, tmp_path: Path) -> None:
    words = ("--start", place / "M", "--epochs", "2", "--set", "learning_rate=0.001", "--out", tmp_path / "N")
    result = call("train", place / "log.csv", "-v", "blueboat", *words)
    assert (result.exit_code, result.exception) == (0, None), result.stderr
    assert "Trained the network mlp" in result.stdout
    assert yaml.safe_load((tmp_path / "N" / "model.yaml").read_text())["training"]["start"] == "M"
    refused = call("train", place / "log.csv", "-v", "blueboat", *words, "--residual", "lstm")
    assert refused.exit_code == 2
    assert "says which network it is; leave out --residual" in refused.stderr.replace("\n", " ")


def test_train_says_what_it_did_and_shows_the_errors(place: Path) -> None:
    said = " ".join((place / "said.txt").read_text().split())
    for text in (
        "Trained the network mlp (291 weights) beside the physics of 'BlueBoat",
        "of 1 log; it took",
        "Without it, in surge the vehicle errs by",
        "By parts of the log that it did not know, its correction counts by",
        "standard deviations outside the range of its training inputs on,",
        "Kept epoch",
        "It keeps every law that 'undertow check' asks",
        "Acceleration on the test part",
        "2 s nominal",
        "hybrid mlp pass 291",
        "(model.yaml, weights.safetensors)",
    ):
        assert text in said
    assert "The audit fails" not in said
    assert call("check", place / "M", place / "log.csv").exit_code == 0, "what training calls lawful, check passes"
    lines = (place / "progress.txt").read_text().splitlines()
    assert [line.split()[1] for line in lines] == ["1", "10", "20"]
    assert all("validation error" in line and "breaks the laws at" in line for line in lines)


def test_train_writes_a_network_that_compare_reads(place: Path) -> None:
    assert sorted(path.name for path in (place / "M").iterdir()) == ["model.yaml", "weights.safetensors"]
    training = yaml.safe_load((place / "M" / "model.yaml").read_text())["training"]
    assert training["logs"] == ["log.csv"]
    assert training["settings"]["epochs"] == 20
    assert [epoch["number"] for epoch in training["epochs"]] == list(range(21))
    words = ("compare", place / "log.csv", "-v", "blueboat", "--model", place / "M", "--json")
    known = strict(done(*words, "--split", "validation"))
    surge = {row["name"]: row["acceleration"]["rmse"]["surge"] for row in known["models"]}
    assert surge["M"] < 0.8 * surge["nominal"]
    told = {row["name"]: row["interval"] for row in known["models"]}
    assert told["nominal"] is None
    assert told["M"]["inside"]["rows"] + told["M"]["outside"]["rows"] > 100
    assert min(told["M"]["inside"]["share"].values()) > 0.8, "the rows that calibrated it"
    motion = read_inputs(place / "log.csv", load_vehicle("blueboat")).parts.split.train.motions[0]
    said = np.abs(load_network(place / "M").correction(motion)).mean(axis=0)
    assert said[0] > 20.0 * said[1:].max(), "in sway and yaw there is nothing to learn"
    (note,) = [note for note in strict(done(*words))["notes"] if "far from" in note]
    assert note.startswith("M is judged far from what it was trained on at")
    assert note.endswith("in the median): that is beyond all that its correction knows")


def test_train_explains_what_was_learnt(place: Path, tmp_path: Path) -> None:
    out = tmp_path / "M"
    words = ("--residual", "mlp", "--option", "units=32", "--epochs", "40", "--explain")
    said = " ".join(done("train", place / "log.csv", "-v", "blueboat", *words, "--out", out).split())
    assert "Share of the correction explained" in said
    written = strict((out / "distillation.json").read_text())
    assert written["schema"] == "undertow.distillation/1"
    surge = written["axes"][0]
    assert (surge["axis"], surge["matters"]) == ("surge", True)
    assert surge["share"]["with_possible"] > 0.8
    assert {effect["effect"] for effect in written["effects"]} & {"surge_linear_damping", "surge_quadratic_damping"}
    again = strict(done("explain", out, place / "log.csv", "-v", "blueboat", "--json"))
    assert again["axes"] == written["axes"]
    assert "Share of the correction explained" in done("explain", out, place / "log.csv", "-v", "blueboat")
    refused = call("explain", out, place / "log.csv", "-v", "otter")
    assert (refused.exit_code, refused.stdout) == (2, "")
    beside = load_model(out)
    assert (beside.name, beside.kind) == ("M", "hybrid")
    done("train", place / "log.csv", "-v", "blueboat", "--epochs", "1", "--out", out)
    assert not (out / "distillation.json").exists()  # it told of another network


def test_train_prints_strict_json_and_equal_seeds_give_equal_files(place: Path, tmp_path: Path) -> None:
    words = ("train", place / "log.csv", "-v", "blueboat", "--residual", "mlp", "--option", "units=32")
    found = strict(done(*words, "--epochs", "20", "--out", tmp_path / "N", "--json"))
    assert set(found) == {
        *(
            "warnings",
            "schema",
            "network",
            "options",
            "pure",
            "heading",
            "left",
            "logs",
            "split",
            "kinds",
            "models",
            "training",
            "data",
            "distillation",
        )
    }
    assert (found["schema"], found["network"], found["options"]["units"]) == ("undertow.train/1", "mlp", 32)
    assert [row["name"] for row in found["models"]] == ["nominal", "hybrid mlp"]
    assert found["training"]["lawful"] is True
    assert found["distillation"] is None
    assert [found["left"][axis]["learnable"] for axis in ("surge", "sway")] == [True, False]
    for name in ("model.yaml", "weights.safetensors"):
        assert (tmp_path / "N" / name).read_bytes() == (place / "M" / name).read_bytes()


def test_train_as_a_function_pure_with_heading_and_rollouts(place: Path, tmp_path: Path) -> None:
    inputs = undertow.read_inputs(place / "log.csv", "blueboat")
    settings = undertow.TrainingSettings(epochs=2, rollout_rows=5, lambda_phys=0.0)
    run = undertow.train(
        inputs, undertow.Choice("dissipative", pure=True, heading=True), settings=settings, out=tmp_path / "P"
    )
    read = load_network(tmp_path / "P")
    assert (read.pure, read.heading) == (True, True)
    motion = inputs.parts.judged.motions[0]
    np.testing.assert_array_equal(read.acceleration(motion), run.trained.model.acceleration(motion))
    assert "in the place of the physics" in run.sentences[0]
    assert run.trained.lawful is (run.models[-1]["audit"] == "pass"), "no energy from nothing, yet strong thrusters"
    assert (
        undertow.train(inputs, undertow.Choice("mlp"), settings=undertow.TrainingSettings(epochs=1)).models[1]["kind"]
        == "hybrid"
    )


def test_an_interrupted_training_is_resumed(place: Path, tmp_path: Path) -> None:
    inputs = undertow.read_inputs(place / "log.csv", "blueboat")

    def stop(epoch: Epoch) -> None:
        if epoch.number == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        undertow.train(
            inputs,
            undertow.Choice("mlp", {"units": 32}),
            settings=undertow.TrainingSettings(epochs=20),
            out=tmp_path / "M",
            watch=stop,
        )
    words = ("train", place / "log.csv", "-v", "blueboat", "--residual", "mlp", "--option", "units=32")
    words = (*words, "--epochs", "20", "--out", tmp_path / "M")
    refused = call(*words)
    assert refused.exit_code == 2
    assert "go on with it (--resume)" in refused.stderr
    shutil.copytree(tmp_path / "M", tmp_path / "searched")
    best = ("--residual", "best", "--minutes", "9", "--epochs", "20", "--resume", "--out", tmp_path / "searched")
    said = done("train", place / "log.csv", "-v", "blueboat", *best)
    assert "trying a network" not in said, "what was chosen before stays"
    assert (tmp_path / "searched" / "weights.safetensors").read_bytes() == (
        place / "M" / "weights.safetensors"
    ).read_bytes()
    done(*words, "--resume")
    for name in ("model.yaml", "weights.safetensors"):
        assert (tmp_path / "M" / name).read_bytes() == (place / "M" / name).read_bytes()
    assert not (tmp_path / "M" / "checkpoint.safetensors").exists()


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--residual", "lstn"), "did you mean 'lstm'"),
        (("--option", "units"), "expected NAME=VALUE, for example units=64"),
        (("--option", "units=8", "--option", "units=9"), "units is given twice"),
        (("--option", "width=9"), "unknown option 'width'"),
        (("--set", "learning_rat=1"), "did you mean 'learning_rate'"),
        (("--set", "epochs=3", "--epochs", "3"), "given twice"),
        (("--set", "batch=many"), "expected NAME=NUMBER"),
        (("--epochs", "0"), "at least 1 for epochs"),
        (("--device", "tpu"), "auto or cpu or cuda"),
        (("--rollout-rows", "100"), "give shorter rollouts"),
        (("--minutes", "-1"), "expected minutes of 0 or more, got -1"),
        (("--minutes", "3", "--pure"), "searches among hybrids with fresh weights, so it cannot be with --pure"),
        (("--resume",), "expected a folder with the checkpoint.safetensors of an interrupted training, but M does not"),
        (
            ("--resume", "--out", "empty"),
            "but empty holds none; give the folder of that training, or leave --resume out",
        ),
        (("--out", "missing/M"), "does not exist; make it"),
        (("--out", "full"), "holds other files (thesis.txt) and nothing that this verb wrote; give a new one"),
        (("--out", "file"), "it is a file"),
    ],
)
def test_train_refuses_with_a_cure(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], text: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.txt").write_text("words")
    (tmp_path / "file").write_text("words")
    (tmp_path / "empty").mkdir()
    out = () if "--out" in words else ("--out", "M")
    result = call("train", place / "log.csv", "-v", "blueboat", *out, *words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert text in " ".join(result.stderr.split())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "file", "full"]


@pytest.mark.parametrize(
    ("kept", "text"),
    [(True, "the same command with --resume goes on from M"), (False, "no epoch was done, nothing is kept")],
)
def test_an_interrupt_says_whether_it_can_go_on(
    kept: bool, text: str, place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object, out: Path, **__: object) -> NoReturn:
        out.mkdir()
        if kept:
            (out / "checkpoint.safetensors").write_bytes(b"")
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("undertow.workflows.train.train", interrupt)
    result = call("train", place / "log.csv", "-v", "blueboat", "--out", "M")
    assert result.exit_code == 130
    assert f"undertow: interrupted; {text}" in result.stderr


def test_a_finished_training_has_nothing_to_resume(place: Path) -> None:
    result = call("train", place / "log.csv", "-v", "blueboat", "--out", place / "M", "--resume")
    assert result.exit_code == 2
    assert "nothing to resume" in result.stderr


def test_without_torch_the_verb_says_what_to_install(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lacking(name: str) -> NoReturn:
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr("undertow.residuals.models.neural.import_module", lacking)
    result = call("train", place / "log.csv", "-v", "blueboat", "--out", tmp_path / "M")
    assert (result.exit_code, list(tmp_path.iterdir())) == (2, [])
    assert "pip install -e '.[neural]' -c constraints.txt" in result.stderr


def test_options_of_the_network_are_numbers() -> None:
    found = parsed_options(["units=64", "gain=0.5", "window=2e1"])
    assert found == {"units": 64, "gain": 0.5, "window": 20}
    assert isinstance(found["units"], int)
    with pytest.raises(RequestError, match="expected NAME=NUMBER"):
        parsed_options(["units=many"])


def test_settings_of_the_recipe_and_of_augmentation_are_set_by_name() -> None:
    found = settings_with(["learning_rate=0.01", "speed_noise=0.02", "schedule=cosine"], seed=3, epochs=None)
    assert (found.learning_rate, found.augmentation.speed_noise, found.schedule, found.seed) == (
        0.01,
        0.02,
        "cosine",
        3,
    )


def test_a_terminal_sees_a_bar(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "160")
    epoch = Epoch(3, 0.25, 0.125, 0.01)
    assert epoch_words(epoch) == "loss 0.25, validation error 0.125, breaks the laws at 1.0 %"
    epoch_lines(9, Progress())(epoch)
    assert "validation error 0.125" in " ".join(capsys.readouterr().err.split())


def test_epochs_beyond_the_last_are_those_at_states_against_the_laws() -> None:
    told: list[str] = []
    for number in (10, 20):
        epoch_lines(12, told.append)(Epoch(number, 0.25, 0.125, 0.0))
    assert told[0].startswith("epoch 10 of at most 12: loss")
    assert told[1].startswith("epoch 20, at states against the laws: loss")


def test_what_the_laws_took_and_cost_is_told(place: Path) -> None:
    from undertow.reports.model_words import what_laws_took
    from undertow.residuals.training.trained import Trained

    model = load_network(place / "M")
    errors = (1.0, 0.5, 0.51, 0.6)
    epochs = tuple(Epoch(k, 1.0, error, 0.0) for k, error in enumerate(errors))

    def told(lawful: bool, more: int, best: int) -> str:
        found = Trained(model, epochs, more, best, lawful, "done", undertow.TrainingSettings(), 60.0)
        return " ".join(what_laws_took(found))

    assert told(True, 0, 1) == "It keeps every law that 'undertow check' asks over these logs."
    assert "Epoch 1 had a validation error of 0.5 and not 1" in told(True, 0, 0)
    assert "It does after 1 epoch more at the states where they broke them; the validation error is then 20.0 %" in (
        told(True, 1, 3)
    )
    assert "nor did the epochs next best: try" in told(False, 0, 1)
    assert (
        "and did not after 1 epoch more at the states where they broke them; the validation error is then 20.0 %"
        in (told(False, 1, 1))
    )


def test_how_much_it_errs_on_rows_that_it_did_not_learn_is_told() -> None:
    from undertow.comparison.facts import ComparedModel
    from undertow.reports.model_words import on_judged_rows

    def model(**metres: float) -> ComparedModel:
        rollout = {key[1:]: {"position": size} for key, size in metres.items()}
        return ComparedModel.model_validate({"name": "a model", "rollout": rollout})

    alone = model(h2=0.1, h10=0.5, h30=2.0)
    (less,), (more,) = (on_judged_rows(alone, model(h2=0.1, h10=size, h30=2.0)) for size in (0.4, 0.6))
    assert "errs 20\N{NO-BREAK SPACE}% less over 10 s than that of the vehicle." in less
    assert "errs 20\N{NO-BREAK SPACE}% more over 10 s than that of the vehicle: compare it on another log" in more
    assert "over 2 s" in on_judged_rows(alone, model(h2=0.05))[0]
    for alike in (model(h10=0.501), model(h10=0.5), model(h10=float("nan")), model(h30=0.1), model()):
        assert on_judged_rows(alone, alike) == []


def test_laws_that_the_audit_finds_broken_are_named(place: Path) -> None:
    pytest.importorskip("torch")
    inputs = read_inputs(place / "log.csv", "blueboat")
    run = train(inputs, undertow.Choice("mlp", {"units": 4}), settings=settings_with(epochs=1))
    laws = [
        {"law": "bounded speed", "verdict": "fail", "counts": True},
        {"law": "mirror symmetry", "verdict": "fail", "counts": False},
        {"law": "dissipation", "verdict": "pass", "counts": True},
    ]
    ten = {"10": {"position": 2.0 * run.models[0].rollout["10"].position}}
    said = replace(run, models=(run.models[0], run.models[1].but(audit="fail", laws=laws, rollout=ten))).sentences
    assert any("its position errs 100" in text for text in said)
    assert said[-1].startswith("The audit fails: it breaks bounded speed; 'undertow check' on its folder")
    kept = replace(run, models=(run.models[0], run.models[1].but(audit="pass", laws=laws[2:]))).sentences
    assert not any("audit fails" in text for text in kept)


def test_where_nothing_is_left_to_learn_it_says_so_and_a_run_folder_is_a_vehicle(place: Path) -> None:
    """The vehicle that made the log leaves its noise, whether it is a file or the corrected one of a run."""
    run, out = place / "run", place / "declined"
    run.mkdir()
    (run / "findings.json").write_text("{}")
    true = apply_effects(load_vehicle("blueboat"), {"surge_quadratic_damping": -10.0})
    (run / "model.yaml").write_text(yaml.safe_dump(true.to_dict()))
    words = ("train", place / "log.csv", "-v", run, "--residual", "mlp", "--epochs", "1", "--out", out)
    ended = call(*words)
    assert ended.exit_code == 0
    said = " ".join(ended.stdout.split())
    assert "Nothing is left for a network to learn beside a vehicle that errs on no axis by" in said
    assert "in surge the vehicle errs by" in said
    assert "m/s², no more than noise and preparation" in said
    assert "Use the vehicle as it is; 'undertow train' with --set decline=0 trains all the same" in said
    assert not out.exists()
    told = strict(done(*words, "--json"))
    assert (told["network"], told["why"].startswith("Nothing is left")) == (None, True)
    assert call(*words, "--set", "decline=0").exit_code == 0
    beside = load_network(out)
    assert beside.vehicle == true
