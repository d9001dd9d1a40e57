"""The sum of all Adds is the model of the run, on the command line, in Python and in the workbench."""

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from verbs import done

import undertow
from undertow.app.steps import Step
from undertow.discovery.findings import Step as ScoredStep
from undertow.discovery.sensor_error_search import HiddenErrors
from undertow.physics.errors import RequestError
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.log_view import LogView
from undertow.workflows.run_folder.read import read_run_inputs
from undertow.workflows.workbench import Workbench
from undertow.workflows.workbench_facts import OWN_NUMBERS, ModelChoice, Searched, Source

HIDDEN = {"stbd_scale": 0.8, "munk_moment": 20.0}
NAMES = {"thruster_asymmetry[stbd]", "munk_moment"}
WRONG = {"X_u": -14.0, "Y_v": -42.0, "N_r": -10.0, "X_udot": -4.0, "Y_vdot": -25.0, "N_rdot": -3.5}
GUESSED = "typical of a hull of this length, to be replaced"


@dataclass(frozen=True)
class Place:
    """A log, a vehicle file of guesses, and the run of both."""

    log: Path
    vehicle: Path
    run: Path

    @property
    def inputs(self) -> undertow.Inputs:
        return undertow.read_inputs(self.log, self.vehicle, progress=None)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Place:
    folder = tmp_path_factory.mktemp("place")
    found = Place(folder / "log.csv", folder / "vehicle.yaml", folder / "run")
    hull = load_vehicle("blueboat")
    simulate_world(hull, HIDDEN, duration=200.0, noise="field", seed=3).write(found.log)
    guessed = dict.fromkeys(("added_mass", "damping"), GUESSED)
    wrong = hull.with_values(WRONG).model_copy(update={"sources": dict(hull.sources) | guessed})
    wrong.save(found.vehicle)
    done("discover", found.log, "-v", found.vehicle, "--no-report", "--out", found.run)
    return found


@pytest.fixture(scope="module")
def bench(place: Place) -> Workbench:
    return Workbench(LogView(place.inputs))


@pytest.fixture(scope="module")
def searched(bench: Workbench) -> Searched:
    return bench.search()


def names_in(run: Path) -> list[str]:
    """What the steps of a run added, without the file's own numbers."""
    steps = json.loads((run / "findings.json").read_text("utf-8"))["steps"]
    added = [step for step in steps if step["added"] not in (None, "calibrated")]
    return [f"{step['added']}[{step['thruster']}]" if "thruster" in step else step["added"] for step in added]


def positions(steps: Sequence[ScoredStep]) -> list[float]:
    return [step.rollout("10").position for step in steps]


def same(one: Vehicle, other: Vehicle) -> bool:
    return {**one.values} == pytest.approx({**other.values}, rel=1e-9, abs=1e-9)


def test_a_file_of_guesses_has_its_own_numbers_fitted_unasked(place: Place):
    assert json.loads((place.run / "run.json").read_text("utf-8"))["refit"] is True
    assert set(names_in(place.run)) >= NAMES
    steps = json.loads((place.run / "findings.json").read_text("utf-8"))["steps"]
    assert [step["added"] for step in steps[:2]] == [None, "calibrated"]


def test_all_of_a_run_on_the_command_line_is_its_model(place: Place, tmp_path: Path):
    out = tmp_path / "added.yaml"
    told = json.loads(done("add", *names_in(place.run), "--run", place.run, "--out", out, "--json"))
    assert same(load_vehicle(out), load_vehicle(place.run / "model.yaml"))
    found = json.loads((place.run / "findings.json").read_text("utf-8"))
    for one, other in zip(told["steps"], found["steps"], strict=True):
        assert one["added"] == other["added"]
        assert one["rollout_rmse"]["10"]["position"] == pytest.approx(other["rollout_rmse"]["10"]["position"], rel=1e-6)
    terms = {c["effect"]: c["terms"] for c in found["candidates"]}
    assert all(c["terms"] == terms[c["effect"]] for c in told["candidates"])


def test_all_of_a_run_in_python_is_its_model_in_any_order(place: Place):
    record = read_run_inputs(place.run)
    assert record.findings is not None
    added = undertow.add(names_in(place.run)[::-1], place.inputs, record.settings, record.findings, progress=None)
    assert same(added.discovery.corrected, load_vehicle(place.run / "model.yaml"))
    assert added.findings.missing == record.findings.missing
    assert positions(added.findings.steps)[-1] == pytest.approx(positions(record.findings.steps)[-1], rel=1e-6)


def test_the_workbench_goes_down_the_stairs_of_the_run(place: Place, bench: Workbench, searched: Searched):
    findings = read_run_inputs(place.run).findings
    assert findings is not None
    assert searched.found == (OWN_NUMBERS, *names_in(place.run))
    step = Step(Source())
    for name, position in zip(searched.found, positions(findings.steps)[1:], strict=True):
        step = step.adding(name)
        assert bench.fit(step.stand).error["position"] == pytest.approx(position, rel=1e-6)
    model = load_vehicle(place.run / "model.yaml")
    assert same(bench.vehicle(step.stand), model)
    values = {value.symbol: value for value in bench.fit(step.stand).values}
    assert {symbol: value.after for symbol, value in values.items()} == pytest.approx(
        {symbol: value for symbol, value in model.values.items() if value != bench.inputs(()).vehicle.value(symbol)}
    )
    munk = next(term for c in findings.added for term in c.terms if term.symbol == "N_uv")
    assert munk.ci95 is not None
    assert values["N_uv"].ci95 == pytest.approx(tuple(munk.ci95), rel=1e-6)


def test_a_part_is_fitted_from_the_model_of_the_run(place: Place, bench: Workbench, searched: Searched):
    names = names_in(place.run)
    part = ModelChoice((OWN_NUMBERS, *names[1:]))  # no step of the run has these alone
    left = bench.vehicle(part)
    assert left.value({"munk_moment": "N_uv"}.get(names[0], "stbd_scale")) in (0.0, 1.0)
    record = read_run_inputs(place.run)
    added = undertow.add(names[1:], place.inputs, record.settings, record.findings, progress=None)
    assert {**added.discovery.corrected.values} == pytest.approx({**left.values}, rel=1e-5, abs=1e-6)


def test_what_the_run_has_not_is_added_beside_its_numbers(bench: Workbench, searched: Searched):
    more = bench.fit(ModelChoice((*searched.found, "yaw_trim")))
    whole = bench.fit(ModelChoice(searched.found))
    before = {value.symbol: value.after for value in whole.values}
    assert {value.symbol for value in more.values} == {*before, "yaw_trim"}
    assert more.error["position"] == pytest.approx(whole.error["position"], rel=0.2)
    near = {value.symbol: value.after for value in more.values if value.symbol != "yaw_trim"}
    assert near == pytest.approx(before, rel=0.05)


def test_another_worker_goes_on_with_the_numbers_of_the_search(place: Place, bench: Workbench, searched: Searched):
    other = Workbench(LogView(place.inputs))
    other.resume(searched)
    assert same(other.vehicle(ModelChoice(searched.found)), bench.vehicle(ModelChoice(searched.found)))
    assert same(other.vehicle(ModelChoice(searched.found[:2])), bench.vehicle(ModelChoice(searched.found[:2])))


def test_own_numbers_that_stay_are_not_those_of_the_run(place: Place, bench: Workbench, searched: Searched):
    """What is added to the file as it is, is fitted to the file as it is."""
    names = tuple(names_in(place.run))
    kept = bench.vehicle(ModelChoice(names))
    nominal = load_vehicle(place.vehicle)
    assert all(kept.value(symbol) == nominal.value(symbol) for symbol in ("Y_vdot", "N_rdot"))
    told = done("add", *names, "--run", place.run, "--no-refit", "--json")
    assert [step["added"] for step in json.loads(told)["steps"]] == [None, *(name.partition("[")[0] for name in names)]


@pytest.mark.parametrize("in_memory", [False, True])
def test_findings_of_other_logs_are_refused_though_these_have_as_many_rows(
    place: Place, tmp_path: Path, in_memory: bool
):
    record, other = read_run_inputs(place.run), tmp_path / "other.csv"
    assert record.findings is not None
    table = pd.read_csv(place.log)
    table.loc[table["field"] == "u", "value"] *= 1.01
    table.to_csv(other, index=False)
    log = undertow.Log.from_dataframe(table, name="other.csv") if in_memory else other
    inputs = undertow.read_inputs(log, place.vehicle, progress=None)
    assert inputs.weak.train.rows == place.inputs.weak.train.rows
    with pytest.raises(RequestError, match=r"of other\.csv, got those of a run of other logs.*leave findings out"):
        undertow.add(["munk_moment"], inputs, record.settings, record.findings, progress=None)


def test_a_log_is_known_wherever_it_lies(place: Place, tmp_path: Path):
    record, moved = read_run_inputs(place.run), tmp_path / "moved.csv"
    shutil.copy(place.log, moved)
    inputs = undertow.read_inputs(moved, place.vehicle, progress=None)
    added = undertow.add(names_in(place.run), inputs, record.settings, record.findings, progress=None)
    assert same(added.discovery.corrected, load_vehicle(place.run / "model.yaml"))


def test_of_a_log_that_was_read_otherwise_every_number_is_fitted_anew(place: Place):
    record = read_run_inputs(place.run)
    assert record.findings is not None
    older = record.findings.but(data=record.findings.data.but(rows=1000, log_sha256=()))
    added = undertow.add(["munk_moment"], place.inputs, record.settings, older, progress=None).discovery.corrected
    alone = undertow.add(["munk_moment"], place.inputs, record.settings, progress=None).discovery.corrected
    assert added.values == alone.values


def test_what_was_found_beside_an_antenna_that_only_forces_show_is_added_beside_it(tmp_path: Path):
    world = simulate_world(load_vehicle("blueboat"), {"yaw_trim": 1.5}, duration=200.0, noise="clean", seed=3)
    motion = HiddenErrors(-0.6, 0.0, 0.0).corrected(world.motion(0.05))
    columns = ["t", "x", "y", "psi", "u", "v", "r", "newton_port", "newton_stbd"]
    table = np.column_stack([motion.time, motion.position, motion.heading, motion.velocity, motion.commands])
    pd.DataFrame(table, columns=columns).to_csv(tmp_path / "log.csv", index=False)
    inputs = undertow.read_inputs(tmp_path / "log.csv", "blueboat", progress=None)
    run = undertow.discover(inputs, progress=None)
    assert run.discovery.hidden is not None
    assert "yaw_trim" in run.findings.missing
    names = [str(label) for label, _ in run.discovery.steps[1:]]
    whole = undertow.add(names, inputs, run.settings, run.findings, progress=None)
    assert same(whole.discovery.corrected, run.discovery.corrected)
    assert positions(whole.findings.steps) == pytest.approx(positions(run.findings.steps), rel=1e-6)
    more = undertow.add([*names, "sway_lift"], inputs, run.settings, run.findings, progress=None)
    assert "antenna_arm" in {sensor.error for sensor in more.findings.sensors if sensor.verdict == "present"}
