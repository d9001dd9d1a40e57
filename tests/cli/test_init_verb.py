"""The verb `init`: two files, what was found, and the command that goes on from there."""

from pathlib import Path

import numpy as np
import pytest
from verbs import call, done, refused

from undertow.discovery.candidates.candidate import holds_guesses
from undertow.measurements.log import read_log
from undertow.measurements.log_options import AS_GUESSED, Reading
from undertow.physics.vehicle import load_vehicle
from undertow.workflows.inputs import read_inputs


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("init") / "log.csv"
    done("simulate", "-v", "blueboat_paper", "--duration", "60", "--out", path)
    return path


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_what_it_writes_reads_the_log(log: Path, here: Path) -> None:
    said = done("init", log, "--mass", "22", "--spacing", "0.436", "--length", "1.2")
    assert "--vehicle vehicle.yaml --map channels.yaml --out run" in said
    assert holds_guesses(load_vehicle("vehicle.yaml")), "discover fits them unasked"
    assert "given to undertow init" in said
    assert said.count("believed") == 1, "what is doubtful of the map is told once, at the end"
    end = " ".join(said.partition("Settle first: ")[2].split())
    line = end.partition("write its line into the map: ")[2].partition("}")[0] + "}"
    Path("turned.yaml").write_text(line)
    turned, plain = (
        read_log(log, reading).channels["pwm_stbd"] for reading in (Reading(None, "turned.yaml"), AS_GUESSED)
    )
    assert np.allclose(turned.value + plain.value, 3000.0)
    assert "Nobody told the mass" not in said
    assert max(map(len, said.replace(str(log), "LOG").splitlines())) <= 120
    vehicle = load_vehicle("vehicle.yaml")
    assert vehicle.mass == 22.0
    assert [(t.name, t.y) for t in vehicle.thrusters] == [("port", -0.218), ("stbd", 0.218)]
    assert read_inputs(log, vehicle, Reading(channel_map="channels.yaml")).fitting


def test_its_own_files_are_replaced_and_no_others(log: Path, here: Path) -> None:
    done("init", log)
    done("init", log, "--mass", "30")
    assert load_vehicle("vehicle.yaml").mass == 30.0
    Path("vehicle.yaml").write_text(Path("vehicle.yaml").read_text() + "# mine\n")
    refused("init", log, match="did not write it, or it was changed since")
    assert load_vehicle("vehicle.yaml").mass == 30.0


def test_an_impossible_number_is_refused(log: Path, here: Path) -> None:
    refused("init", log, "--mass", "0", match="mass must be above 0")
    assert not Path("vehicle.yaml").exists()


def test_discover_without_a_vehicle_says_what_init_would_write(log: Path, here: Path) -> None:
    said = refused("discover", log, "--out", "run", match="no --vehicle")
    for word in ("no --vehicle", "pwm_port (port) and pwm_stbd (starboard)", "undertow init LOG", "otter"):
        assert word in said
    assert not list(here.iterdir())


def test_a_person_who_is_asked_may_leave_it_to_what_is_typical(
    log: Path, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = iter(["", "heavy", "24,5", "", ""])
    monkeypatch.setattr("undertow.cli.init_verb._on_a_terminal", lambda: True)
    monkeypatch.setattr("typer.prompt", lambda *_, **__: next(answers))
    assert "expected a number, got heavy" in call("init", log).stdout
    assert load_vehicle("vehicle.yaml").mass == 24.5


def test_a_person_may_let_discover_begin_with_what_init_writes(
    log: Path, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("undertow.cli.init_verb._on_a_terminal", lambda: True)
    monkeypatch.setattr("typer.confirm", lambda *_, **__: True)
    asked = []
    monkeypatch.setattr("undertow.cli.discover_verb.tell_discovery", lambda *_, **how: asked.append(how["refit"]))
    assert call("discover", log, "--out", "run").exit_code == 0
    assert asked == [None]
    assert load_vehicle("vehicle.yaml").thrusters
