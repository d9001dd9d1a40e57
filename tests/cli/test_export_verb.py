"""The verb `export`: what is known about a model stands in its export, and nothing is lost or half written."""

import sys
from pathlib import Path

import pytest
import yaml
from added_run import write_added
from exported import facts
from verbs import SCRIPT, done, process, refused

import undertow
from undertow.exports.formats.base import format_named, format_names


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_run_brings_its_audit_its_intervals_and_its_sources(here: Path):
    write_added(here, report=False)
    found = undertow.load_vehicle(here / "run" / "model.yaml")
    shown = done("export", "run", "--to", "c", "--out", "boat.h")
    text = (here / "boat.h").read_text("utf-8")
    assert (here / "boat_test.c").is_file()
    assert "c: boat.h, boat_test.c" in shown
    assert "Audit. pass: of 10 laws" in text
    assert "// Found. Added by name: " in text
    assert "Found: Added by name: " in shown
    assert "Trust " in " ".join(shown.split("Audit:")[0].split())
    (drag,) = [line for line in text.splitlines() if line.startswith("// - X_uu = ")]
    assert "95 % interval" in drag
    assert f"{found.value('X_uu'):.9g} N s^2/m^2" in drag
    words = " ".join(text.replace("//", "").split())
    assert "identified by undertow from" in words
    assert "(the speeds of the log)" in words
    assert found.digest in words


def test_a_broken_law_stands_in_the_file(here: Path):
    vehicle = yaml.safe_load(yaml.safe_dump(undertow.load_vehicle("blueboat").to_dict()))
    vehicle["terms"] = [{"axis": "surge", "form": "u", "value": 40.0}]
    (here / "boat.yaml").write_text(yaml.safe_dump(vehicle), "utf-8")
    shown = done("export", "boat.yaml", "--to", "python", "--out", "boat.py")
    assert "Audit: fail" in shown
    assert "# Audit. fail: of 10 laws" in (here / "boat.py").read_text("utf-8")
    assert "# - dissipation: " in (here / "boat.py").read_text("utf-8")


def test_its_own_file_is_replaced_and_no_other(here: Path):
    done("export", "otter", "--to", "c", "--out", "boat.h")
    done("export", "blueboat", "--to", "c", "--out", "boat.h")
    assert "BlueBoat" in (here / "boat.h").read_text("utf-8")
    (here / "boat_test.c").write_text("int main(void) { return 0; }\n", "utf-8")
    refused(
        "export", "otter", "--to", "c", "--out", "boat.h", match="boat_test.c is there, and 'undertow export' did not"
    )
    done("export", "otter", "--to", "c", "--out", "boat.h", "--force")


@pytest.mark.parametrize(
    ("typed", "meant"), [("gazebo", "sdf"), ("ros2", "ros"), ("mss", "matlab"), ("fmu", "fmi"), ("numpy", "python")]
)
def test_a_format_has_the_names_that_people_type(typed: str, meant: str):
    assert format_named(typed) is format_named(meant)


def test_refusals(here: Path):
    refused("export", "otter", "--to", "pyton", "--out", "a", match="unknown format 'pyton': did you mean 'python'")
    refused("export", "otter", "--to", "gazbo", "--out", "a", match=r"did you mean 'gazebo'\? .*sdf \(or gazebo\)$")
    refused("export", "otter", "--to", "c", "--out", "a.h", "--time-step", "0", match="a time step of 0.0001 to 10 s")
    refused("export", "otter", "--to", "c", "--out", "nowhere/a.h", match="nowhere does not exist")
    refused(
        "export", "otter", "--to", "c", "--out", "a.h", "--gz", "harmonic", match="--gz: expected garden or fortress"
    )
    refused("export", "nobody.yaml", "--to", "c", "--out", "a.h", match="no such file")


@pytest.mark.parametrize(("to", "package"), [("casadi", "casadi"), ("onnx", "onnx")])
def test_a_missing_package_is_named_with_its_cure(to: str, package: str, here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, package, None)
    refused("export", "otter", "--to", to, "--out", "a", match=rf"{package} is not installed.*pip install .*export")


def test_without_a_name_the_file_bears_that_of_the_model(here: Path):
    assert done("export", "otter", "--to", "c").startswith("c: otter.h, otter_test.c")
    (here / "boat.yaml").write_text(yaml.safe_dump(undertow.load_vehicle("blueboat").to_dict()), "utf-8")
    done("export", "boat.yaml", "--to", "sdf")
    assert sorted(path.name for path in here.iterdir()) == ["boat.sdf", "boat.yaml", "otter.h", "otter_test.c"]


def test_a_hull_that_gazebos_plugin_cannot_move_is_refused_with_the_command_that_works(here: Path):
    refused("export", "otter", "--to", "sdf", match="use --gz garden --added-mass inertial")
    refused("export", "otter", "--to", "sdf", "--gz", "fortress", match="use --gz garden --added-mass inertial")
    done("export", "otter", "--to", "sdf", "--gz", "garden", "--added-mass", "inertial")


def test_a_source_of_each_number_stands_beside_it_and_no_dictionary_in_the_file(here: Path):
    content = undertow.load_vehicle("blueboat").to_dict()
    own = {"damping": {"X_u": "towed"}, "thrusters": {"port": "bollard"}, "mass": "weighed"}
    (here / "boat.yaml").write_text(yaml.safe_dump({**content, "sources": own}), "utf-8")
    done("export", "boat.yaml", "--to", "ros")
    head = [line for line in (here / "boat_ros.yaml").read_text("utf-8").splitlines() if line.startswith("#")]
    assert any(line.startswith("# - X_u = ") and line.endswith("; towed") for line in head)
    assert "# - source of thrusters, port: bollard" in head
    assert not any("{" in line for line in head)


def test_a_delay_of_too_many_steps_is_refused(here: Path):
    undertow.load_vehicle("otter").with_values({"delay": 1.0}).save("late.yaml")
    refused(
        *("export", "late.yaml", "--to", "c", "--out", "a.h", "--time-step", "0.001"),
        match="2002 commands are on their way in the delays.*longer --time-step",
    )


def test_a_stream_gets_the_file_that_was_asked_for(here: Path):
    shown = process(SCRIPT, "export", "otter", "--to", "c", "--out", "/dev/stdout", cwd=here).stdout
    assert "#endif /* UNDERTOW_STDOUT_H */" in shown
    assert "int main(void)" not in shown
    assert list(here.iterdir()) == []


def test_a_model_that_is_no_formula_is_refused():
    model = undertow.load_model("math:hypot", undertow.load_vehicle("otter"))
    with pytest.raises(undertow.RequestError, match="expected a vehicle file or a run folder.*undertow explain"):
        undertow.export(model, "c", "a.h")


@pytest.mark.parametrize("name", format_names())
def test_every_format_knows_its_own_files_and_is_the_same_again(name: str, here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("undertow.workflows.export.known_facts", lambda model, path: facts("as it is"))
    out = here / f"boat{format_named(name).suffix}"
    first = {path: path.read_bytes() for path in undertow.export("blueboat", name, out).files}
    assert set(first) == set(here.iterdir())
    again = undertow.export("blueboat", name, out)
    assert again.files[0] == out
    assert {path: path.read_bytes() for path in again.files} == first
    out.write_bytes(b"my own\n")
    with pytest.raises(undertow.RequestError, match="'undertow export' did not write it"):
        undertow.export("blueboat", name, out)


@pytest.mark.parametrize("name", format_names())
def test_every_format_says_what_it_is(name: str):
    found = format_named(name)
    assert found.about
    assert found.suffix.startswith(".")
