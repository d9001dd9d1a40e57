"""Logs whose own checks say that nothing found in them is about the boat: refused with the cure, or warned of."""

import json
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from verbs import call, refused, strict

from undertow.discovery.basis import DiscoverySettings
from undertow.measurements.inspection import inspect_log
from undertow.measurements.log import read_log
from undertow.measurements.log_options import Reading
from undertow.physics.errors import LogError, RequestError
from undertow.physics.vehicle import Vehicle, load_vehicle, vehicle_from_dict
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.discover_and_add import add, chosen_ahead, discover
from undertow.workflows.inputs import _alignment_notes, read_in_steps, read_inputs
from undertow.workflows.run_folder.read import read_run_inputs

HULL = load_vehicle("blueboat")
ALONE = r"newton_stbd is reversed: .*'newton_stbd: \{from: command:newton_stbd, scale: -1\}'.*--as-is"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sound log of two minutes."""
    log = simulate_world(HULL, {"surge_quadratic_damping": -6.0}, duration=120.0, seed=31)
    return log.write(tmp_path_factory.mktemp("log") / "sound.csv")


@pytest.fixture(scope="module")
def reversed_(whole: Path) -> Path:
    """The same with the starboard command turned round."""
    table = pd.read_csv(whole)
    table.loc[table["field"] == "newton_stbd", "value"] *= -1.0
    target = whole.with_name("reversed.csv")
    table.to_csv(target, index=False)
    return target


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [("discover", "-o", "run"), ("fit", "-o", "v.yaml"), ("compare",), ("train", "-o", "net", "--residual", "mlp")],
    ids=lambda words: words[0],
)
def test_a_reversed_thruster_is_refused_with_the_line_that_mends_it(words, reversed_: Path, here: Path):
    refused(words[0], reversed_, "-v", "blueboat", *words[1:], match=ALONE)


def test_several_logs_tell_together_and_the_one_that_differs_is_named(whole: Path, reversed_: Path):
    with pytest.raises(LogError, match="all logs together: newton_stbd is reversed"):
        read_inputs([reversed_, reversed_], HULL)
    with pytest.raises(LogError, match=r"reversed\.csv: newton_stbd is reversed"):
        read_inputs([whole, reversed_], HULL)


def test_swapped_sides_are_refused(whole: Path, tmp_path: Path):
    other = {"newton_port": "newton_stbd", "newton_stbd": "newton_port"}
    table = pd.read_csv(whole).replace({"field": other})
    table.to_csv(tmp_path / "swapped.csv", index=False)
    with pytest.raises(LogError, match="port and starboard look swapped.*swap them in a channel map: 'newton_"):
        read_inputs(tmp_path / "swapped.csv", HULL)


def test_what_was_begun_with_a_broken_log_is_thrown_away(reversed_: Path, whole: Path):
    settings = DiscoverySettings()
    prepared, checks = read_in_steps(reversed_, HULL)
    assert chosen_ahead(prepared, settings) is not None
    with pytest.raises(LogError, match="newton_stbd is reversed"):
        checks()
    sound, checks = read_in_steps(whole, HULL)
    inputs, whole_inputs = sound.with_checks(checks()), read_inputs(whole, HULL)
    assert (inputs.notes, inputs.warnings, inputs.inspections) == (
        whole_inputs.notes,
        whole_inputs.warnings,
        whole_inputs.inspections,
    )
    basis = chosen_ahead(sound, settings)
    assert discover(inputs, settings, basis=basis, progress=None).findings == discover(inputs, progress=None).findings


def test_nothing_judges_too_few_rows_and_discover_says_why(whole: Path):
    few = read_inputs(whole, HULL).whole().mapped(lambda motion: motion.slice(0, 100))
    assert chosen_ahead(few, DiscoverySettings()) is None
    with pytest.raises(RequestError, match="give a longer log"):
        discover(few, progress=None)


def test_a_vehicle_that_is_wired_that_way_takes_the_log(reversed_: Path):
    assert read_inputs(reversed_, wired()).warnings == ()


def test_inputs_of_another_vehicle_are_inspected_for_that(whole: Path):
    inputs = read_inputs(whole, HULL)
    other = replace(inputs, vehicle=wired())
    for seen, verdict in ((inputs.inspections, "ok"), (other.inspections, "defect")):
        assert [f.verdict for f in seen[0].quality if f.check == "direction"] == [verdict]
    assert replace(inputs, notes=()).inspections is inputs.inspections


def wired() -> Vehicle:
    """The hull with its starboard thruster wired the other way round."""
    content = HULL.to_dict()
    (stbd,) = [t for t in content["thrusters"] if t["name"] == "stbd"]
    stbd["curve"]["force"] = [-f for f in stbd["curve"]["force"]]
    return vehicle_from_dict(content, "reversed at starboard")


def test_a_sound_log_is_taken_without_a_word(whole: Path):
    assert read_inputs(whole, HULL).warnings == ()


def test_as_is_goes_on_and_says_so_above_everything(reversed_: Path, here: Path, monkeypatch: pytest.MonkeyPatch):
    quick = ["surge_quadratic_damping"]  # a search of the whole catalogue for what a reversed thruster is takes long
    monkeypatch.setattr(
        "undertow.workflows.discover_and_add.discover",
        lambda inputs, *_, **__: replace(add(quick, inputs), verb=("discover",)),
    )
    result = call("discover", reversed_, "-v", "blueboat", "-o", "run", "--as-is")
    assert result.exit_code == 0, result.stderr
    told = " ".join(result.stdout.split())
    warning = "Warning: Taken as it is, so no result can be trusted: reversed.csv: newton_stbd is reversed"
    findings = strict((here / "run" / "findings.json").read_text())
    assert told.startswith(warning)
    assert told.index(warning) < told.index(findings["headline"])
    assert "newton_stbd is reversed" in findings["warnings"][0]
    page = (here / "run" / "report.html").read_text()
    assert page.index("Taken as it is") < page.index("<h1")
    record = json.loads((here / "run" / "run.json").read_text())
    assert (record["as_is"], " --as-is " in record["command"]) == (True, True)
    assert read_run_inputs("run").reading.as_is
    assert strict((here / "run" / "comparison.json").read_text())["warnings"] == findings["warnings"]


def test_records_that_merely_do_not_follow_each_other_are_no_reason_to_refuse(whole: Path):
    sound = inspect_log(read_log(whole), HULL)
    assert sound.alignment
    for correlation, contrary in ((-0.01, False), (-0.9, True)):
        records = tuple(one.but(offset=None, correlation=correlation) for one in sound.alignment)
        with pytest.raises(LogError, match=r"Reading\(as_is=True\)") if contrary else nullcontext():
            _alignment_notes(sound.but(alignment=records), False)


def test_records_that_contradict_each_other_are_taken_only_as_they_are(whole: Path, tmp_path: Path):
    table = pd.read_csv(whole)
    table.loc[table["field"] == "v", "value"] *= -1.0
    table.to_csv(tmp_path / "turned.csv", index=False)
    with pytest.raises(LogError, match=r"opposite sign.*Reading\(as_is=True\)"):
        read_inputs(tmp_path / "turned.csv", HULL)
    warning, again = read_inputs(tmp_path / "turned.csv", HULL, Reading(as_is=True)).warnings
    assert "v has the opposite sign" in again
    assert "opposite sign" in warning
