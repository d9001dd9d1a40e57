"""The verb `fit` and `discover --refit` as a user meets them, and the law of dissipation on screen and page."""

import re
from pathlib import Path

import pytest
import yaml
from verbs import call, done, refused, strict

import undertow
from undertow.discovery.lawful.laws_over import MostPower, Passivity
from undertow.physics.laws.damping_power import Envelope
from undertow.physics.vehicle import load_vehicle
from undertow.reports.wording import energy_lines, energy_verdict

HULL = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a log of a BlueBoat, a vehicle file that is wrong, and what `fit` wrote."""
    folder = tmp_path_factory.mktemp("fit")
    HULL.with_values({"X_u": -9.0, "Y_v": -55.0, "N_r": -8.0}).save(folder / "wrong.yaml")
    done("simulate", "-v", "blueboat", "--effect", "munk_moment=14", "--duration", "75", "--out", folder / "log.csv")
    said = done(
        "fit", folder / "log.csv", "-v", folder / "wrong.yaml", "--free", "N_uv,thrust_scale", "-o", folder / "v"
    )
    (folder / "said.txt").write_text(said)
    return folder


@pytest.fixture(scope="module")
def refit(place: Path) -> Path:
    """The same with what `discover --refit` wrote."""
    said = done("discover", place / "log.csv", "-v", place / "wrong.yaml", "--refit", "--out", place / "run")
    (place / "told.txt").write_text(said)
    return place


def test_fit_prints_parameters_errors_law_and_what_was_left(place: Path) -> None:
    said = (place / "said.txt").read_text()
    for text in ("Calibrated 10 parameters", "95 % interval", "Left as they were", "common factor", "10 s", "Energy:"):
        assert text in said
    assert "Proved for u from" in " ".join(said.split())


def test_fit_writes_a_vehicle_that_says_where_its_numbers_come_from(place: Path) -> None:
    vehicle = load_vehicle(place / "v")
    assert vehicle.value("N_uv") == pytest.approx(14.0, rel=0.1)
    assert vehicle.value("X_u") == pytest.approx(-15.0, rel=0.1)
    assert (vehicle.mass, vehicle.value("thrust_scale")) == (HULL.mass, 1.0)
    sources = yaml.safe_load((place / "v").read_text())["sources"]
    assert sources["damping"].startswith("X_u, X_uu, Y_v, Y_vv, N_r, N_rr: fitted by undertow")
    assert f"the others, and these before: {HULL.sources['damping']}" in sources["damping"]
    for symbol, section in (("X_u", "damping"), ("N_uv", "coupling"), ("X_udot", "added_mass")):
        assert re.search(rf"\b{symbol}\b.*: fitted by undertow to log.csv \(", sources[section])
    assert (sources["mass"], sources["thrusters"]) == (HULL.sources["mass"], HULL.sources["thrusters"])
    assert sources["all"].startswith("Not of what undertow identified (see ")
    assert str(place) not in str(sources)


def test_fit_prints_strict_json_and_the_same_again(place: Path, tmp_path: Path) -> None:
    words = ("fit", place / "log.csv", "-v", place / "wrong.yaml", "--free", "N_uv", "--free", "thrust_scale")
    text = done(*words, "--json", "--out", tmp_path / "v")
    found = strict(text)
    assert set(found) == {
        *("schema", "warnings", "sentences", "method", "parameters", "left", "steps", "chosen_by", "passivity", "data")
    }
    assert found["schema"] == "undertow.fit/1"
    for row in found["parameters"]:
        assert set(row) == {"symbol", "before", "after", "wanted", "unit", "ci95", "at_limit", "held_by_law"}
        assert row["ci95"][0] < row["wanted"] < row["ci95"][1]
    assert [step["added"] for step in found["steps"]] == [None, "calibrated"]
    assert [row["symbol"] for row in found["left"]] == ["thrust_scale"]
    assert found["passivity"]["verdict"] == "pass"
    assert (tmp_path / "v").read_bytes() == (place / "v").read_bytes()


def test_fit_as_a_function(place: Path) -> None:
    inputs = undertow.read_inputs(place / "log.csv", place / "wrong.yaml")
    run = undertow.fit(inputs, hold=["X_udot"])
    assert "X_u" in [p.symbol for p in run.calibration.parameters]
    assert run.vehicle.value("X_udot") == inputs.vehicle.value("X_udot")
    assert any("discover --refit" in sentence for sentence in run.sentences)  # the Munk moment was not free


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--free", "X_uuu"), "did you mean 'X_uu'"),
        (("--free", "mass"), "of mass and added mass"),
        (("--free", "Y_r", "--hold", "Y_r"), "both freed and held"),
        (("--hold", "X_u,X_uu,Y_v,Y_vv,N_r,N_rr,X_udot,Y_vdot,N_rdot"), "no parameter to calibrate"),
        (("--out", "missing/v.yaml"), "does not exist; create it first"),
        (("--frame", "up"), "expected enu or ned"),
    ],
)
def test_fit_refuses_with_a_cure(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], text: str
) -> None:
    monkeypatch.chdir(tmp_path)
    out = () if "--out" in words else ("--out", "v.yaml")
    result = call("fit", place / "log.csv", "-v", place / "wrong.yaml", *out, *words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert text in " ".join(result.stderr.split())
    assert list(tmp_path.iterdir()) == []


def test_refit_is_told_on_the_terminal(refit: Path) -> None:
    told = " ".join((refit / "told.txt").read_text().split())
    assert "The model is missing Munk moment" in told
    energy = "Energy: the damping takes energy out"
    for text in ("Calibrated parameters", "own numbers fitted", "+ Munk moment", energy):
        assert text in told
    assert "would do the same: thrust scale" in told


def test_refit_is_told_in_the_run_folder_and_on_the_page(refit: Path) -> None:
    found = strict((refit / "run" / "findings.json").read_text())
    assert [step["added"] for step in found["steps"]] == [None, "calibrated", "munk_moment"]
    assert {"X_u", "N_rdot"} < {row["symbol"] for row in found["calibrated"]}
    assert (found["left"], found["absorbed"]) == ([], ["thrust_scale"])
    assert strict((refit / "run" / "run.json").read_text())["refit"] is True
    page = (refit / "run" / "report.html").read_text()
    for text in ("Calibrated parameters", "Energy: the damping takes energy out"):
        assert text in page


def test_add_fits_the_own_numbers_as_the_run_did(refit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a number that is wrong in the file takes what the effect was found to do beside it."""
    told = " ".join(done("add", "munk_moment", "--run", refit / "run", "--out", tmp_path / "with_it.yaml").split())
    for text in ("beside the model's own numbers", "Calibrated parameters", "own numbers fitted", "+ Munk moment"):
        assert text in told
    found, added = load_vehicle(refit / "run" / "model.yaml"), load_vehicle(tmp_path / "with_it.yaml")
    for symbol in ("N_uv", "X_u", "N_r", "N_rdot"):
        assert added.value(symbol) == pytest.approx(found.value(symbol), rel=0.02), symbol
    done("add", "munk_moment", "--run", refit / "run", "--no-refit", "--out", tmp_path / "without.yaml")
    assert load_vehicle(tmp_path / "without.yaml").value("X_u") == -9.0
    monkeypatch.chdir(tmp_path)
    refused("add", "thrust_scale", "--run", refit / "run", match="would explain the same")


def test_a_run_without_refit_says_nothing_of_calibration(place: Path) -> None:
    done("discover", place / "log.csv", "-v", "blueboat", "--out", place / "plain")
    found = strict((place / "plain" / "findings.json").read_text())
    assert (found["calibrated"], found["left"], found["absorbed"]) == ([], [], [])
    page = (place / "plain" / "report.html").read_text()
    assert "Calibrated parameters" not in page
    assert "Energy: the damping takes energy out" in page


def test_a_law_that_is_broken_is_said() -> None:
    given = Passivity(
        verdict="fail",
        proof="search",
        envelope=Envelope((-1.0, -0.5, -1.0), (2.0, 0.5, 1.0)),
        price=0.0,
        worst=MostPower(value=3.0, at=(2.0, 0.0, 1.0)),
        sentence="It creates energy.",
    )
    said = " ".join(energy_lines(given))
    assert said == "It creates energy. Searched for u from -1.00 to 2.00 m/s, v from -0.500 to 0.500 m/s and r " + (
        "from -1.00 to 1.00 rad/s."
    )
    assert energy_verdict(given) == "the damping creates energy"
