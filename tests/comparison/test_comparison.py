"""The comparison: every model on the same rows, baselines that know nothing, and a recommendation that holds back."""

import io
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, final

import numpy as np
import pytest
from rich.console import Console
from verbs import done, refused, strict

from undertow.comparison.comparison import _at_rest as at_rest
from undertow.comparison.comparison import _with_noise as share_with_noise
from undertow.comparison.comparison import (
    calibrated_model,
    comparison,
    ends,
    judge,
    judge_all,
    reference_models,
    score_step,
)
from undertow.comparison.facts import Comparison
from undertow.comparison.recommendation import best
from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.effect_findings import EffectFinding
from undertow.measurements.preparation.prepare import WEAK, DataSet
from undertow.measurements.prepared_logs import ALL, Inputs, Parts
from undertow.physics.errors import RequestError
from undertow.physics.integration import Rollouts
from undertow.physics.motion import Array, Motion
from undertow.physics.presentation import percent
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.reports.terminal.comparison_screen import failures_table
from undertow.reports.wording import models_sentence, risen
from undertow.residuals.models.base import HoldVelocity, Model, VehicleModel, ZeroAcceleration, baselines
from undertow.residuals.models.network_inputs import in_box
from undertow.residuals.scores import Errors, evaluate
from undertow.residuals.series import series
from undertow.workflows.compare import compare, compare_run
from undertow.workflows.discover_and_add import add
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.write import write_run

HULL = load_vehicle("blueboat")
TRUE = HULL.with_values({"X_uu": -20.0})


@cache
def minute() -> Motion:
    return simulate_world(HULL, {}, duration=60.0, noise="clean", seed=4).motion(0.1)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of 300 s with hidden quadratic surge drag."""
    log = simulate_world(HULL, {"surge_quadratic_damping": -12.0}, duration=300.0, seed=2)
    return log.write(tmp_path_factory.mktemp("log") / "log.csv")


@pytest.fixture(scope="module")
def inputs(path: Path) -> Inputs:
    return read_inputs(path, HULL)


@pytest.fixture(scope="module")
def files(inputs: Inputs, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run folder, and vehicle files: the truth, and one that creates energy."""
    folder = tmp_path_factory.mktemp("files")
    write_run(add(["surge_quadratic_damping"], inputs), folder / "run", report=False)
    TRUE.save(folder / "true.yaml")
    TRUE.with_values({"N_r": 0.5}).save(folder / "unlawful.yaml")
    return folder


@pytest.fixture(scope="module")
def found(inputs: Inputs, files: Path) -> dict[str, Any]:
    return compare(inputs, [files / "true.yaml", files / "unlawful.yaml"]).to_dict()


@pytest.fixture(scope="module")
def calibrated(inputs: Inputs) -> tuple[list[Model], list[str]]:
    return calibrated_model(inputs)


def by_name(comparison: dict[str, Any]) -> dict[str, Any]:
    return {model["name"]: model for model in comparison["models"]}


def verdict(comparison: dict[str, Any], model: str, quantity: str, horizon: str | None, axis: str) -> str:
    wanted = (model, "nominal", quantity, horizon, axis)
    keys = ("model", "against", "quantity", "horizon", "axis")
    (entry,) = [d for d in comparison["differences"] if tuple(d[k] for k in keys) == wanted]
    return entry["verdict"]


@pytest.mark.parametrize("model", baselines(HULL), ids=lambda model: model.name)
def test_the_rollouts_of_a_baseline_follow_its_acceleration(model: Model):
    start, steps = np.array([100, 250]), 300
    states = model.rollout(minute(), start, steps).states
    middle = 0.5 * (states[:, 1:] + states[:, :-1])
    rates = np.diff(states, axis=1) / minute().time_step
    flat = middle.reshape(-1, 6)
    said = model.settled(flat[:, 3:], flat[:, 2], np.zeros((len(flat), 2))).reshape(*middle.shape[:2], 3)
    assert rates[..., 3:] == pytest.approx(said, abs=2e-3)
    psi, u, v = (middle[..., k] for k in (2, 3, 4))
    over_ground = np.stack([u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)], axis=-1)
    assert rates[..., :2] == pytest.approx(over_ground, abs=2e-3)
    assert rates[..., 2] == pytest.approx(middle[..., 5], abs=1e-9)
    assert states[:, 0, :2] == pytest.approx(minute().position[start])


def test_a_boat_that_goes_on_as_it_is_is_predicted_without_error():
    states = ZeroAcceleration(HULL).rollout(minute(), np.array([300]), 200).states[0]
    assert states[:, 3:] == pytest.approx(np.repeat(minute().velocity[300:301], 201, axis=0))
    circle = np.hypot(*(states[:, :2] - states[:, :2].mean(axis=0)).T)
    assert np.ptp(circle) < np.ptp(states[:, 0])  # body velocities held: it turns
    straight = HoldVelocity(HULL).rollout(minute(), np.array([300]), 200).states[0]
    assert np.diff(straight[:, :2], n=2, axis=0) == pytest.approx(0.0, abs=1e-9)
    assert np.hypot(*straight[:, 3:5].T) == pytest.approx(np.hypot(*minute().velocity[300, :2]))


def test_zero_acceleration_explains_nothing(found: dict[str, Any]):
    r2 = by_name(found)["zero acceleration"]["acceleration"]["r2"]
    assert all(-0.1 < value <= 0.0 for value in r2.values())


def test_every_comparison_has_the_references_on_the_same_rows(found: dict[str, Any]):
    models = by_name(found)
    assert list(models) == ["nominal", "calibrated", "zero acceleration", "hold velocity", "true", "unlawful"]
    for key in ("2", "10", "30"):
        assert len({model["rollout"][key]["starts"] for model in models.values()}) == 1
    assert {model["domain"]["inside"]["rows"] for model in models.values()} == {
        found["models"][0]["domain"]["inside"]["rows"]
    }
    for name in ("zero acceleration", "hold velocity"):
        assert (models[name]["kind"], models[name]["audit"], models[name]["laws"]) == ("baseline", "not run", [])
    assert models["calibrated"]["parameters"] > 0
    assert models["calibrated"]["seconds_to_fit"] > 0.0
    assert models["true"]["seconds_to_evaluate"] > 0.0
    assert [law["law"] for law in models["true"]["laws"]][:2] == ["positive mass", "dissipation"]


def test_scores_are_the_papers(inputs: Inputs):
    """RMSE, MAE and R squared by axis, from the definitions."""
    data = inputs.parts.judged
    errors = evaluate(VehicleModel(HULL, "nominal"), data)
    measured, wrong = np.concatenate(errors.measured), np.concatenate(errors.acceleration)
    score = errors.acceleration_score
    for axis in range(3):
        e, y = wrong[:, axis], measured[:, axis]
        assert score.rmse[axis] == pytest.approx(np.sqrt(sum(e**2) / e.size))
        assert score.mae[axis] == pytest.approx(sum(abs(e)) / e.size)
        assert score.r2[axis] == pytest.approx(1.0 - sum(e**2) / sum((y - y.mean()) ** 2))


def test_domain_errors_add_up_to_those_of_all_rows(found: dict[str, Any]):
    for model in found["models"]:
        inside, outside = model["domain"]["inside"], model["domain"]["outside"]
        rows = inside["rows"] + outside["rows"]
        for axis in ("surge", "sway", "yaw"):
            beyond = outside["rmse"][axis] if outside["rows"] else 0.0
            squares = inside["rows"] * inside["rmse"][axis] ** 2 + outside["rows"] * beyond**2
            assert np.sqrt(squares / rows) == pytest.approx(model["acceleration"]["rmse"][axis])


def test_the_domain_is_what_the_training_part_spans(inputs: Inputs):
    train = inputs.parts.split.train.motions
    assert in_box(HULL, train, train).all()
    fast = replace(minute(), velocity=minute().velocity + np.array([5.0, 0.0, 0.0]))
    assert not in_box(HULL, train, [fast]).any()


def test_a_true_model_is_marked_better_where_it_is_and_nowhere_else(found: dict[str, Any]):
    for quantity, horizon in (("acceleration", None), ("rollout", "2"), ("rollout", "10")):
        assert verdict(found, "true", quantity, horizon, "surge") == "better"
    assert verdict(found, "true", "acceleration", None, "yaw") == "no difference"
    assert verdict(found, "true", "rollout", "30", "surge") == "too short to tell"
    assert verdict(found, "zero acceleration", "acceleration", None, "yaw") == "worse"


def test_differences_are_those_of_the_table(found: dict[str, Any]):
    models = by_name(found)
    for entry in found["differences"]:
        if entry["quantity"] == "acceleration":
            ours, theirs = (models[entry[k]]["acceleration"]["rmse"] for k in ("model", "against"))
        else:
            ours, theirs = (models[entry[k]]["rollout"][entry["horizon"]] for k in ("model", "against"))
        assert entry["difference"] == pytest.approx(ours[entry["axis"]] - theirs[entry["axis"]], abs=1e-9)
        if entry["ci95"] is not None:
            assert entry["ci95"][0] <= entry["difference"] <= entry["ci95"][1]
    against = {(d["model"], d["against"]) for d in found["differences"]}
    assert ("true", "calibrated") in against
    assert ("hold velocity", "calibrated") not in against


def test_a_step_that_errs_more_says_where_and_how_much(inputs: Inputs):
    good, bad = (evaluate(VehicleModel(hull, "model"), inputs.parts.judged) for hull in (TRUE, HULL))
    worse, better = score_step(bad, "munk_moment", before=good), score_step(good, "munk_moment", before=bad)
    assert better.rises == ()
    assert "rises" not in better.to_dict()
    rise = next(one for one in worse.rises if (one.horizon, one.axis) == ("10", "surge"))
    assert (rise.before, rise.after) == (better.rollout("10").surge, worse.rollout("10").surge)
    assert rise.in_words == f"the surge error of 10 s predictions rises from {rise.before:.2g} to {rise.after:.2g} m/s"
    (told,) = risen([better, worse], "10")
    assert told.startswith("With Munk moment, the surge acceleration error rises from ")
    assert "2 s predictions" not in told
    effect = EffectFinding(effect="munk_moment", verdict="missing", confidence=1.0, error_drop=0.5)
    assert risen([worse], "10", effect)[0].startswith("With it, the surge acceleration error")
    assert risen([worse], "10", effect.but(effect="sway_lift")) == []


def test_a_lawful_model_is_trusted_and_the_unlawful_one_named(found: dict[str, Any]):
    assert by_name(found)["unlawful"]["audit"] == "fail"
    assert found["best"]["model"] == "true"
    assert "keeps the laws" in found["best"]["sentence"]
    assert found["best"]["sentence"].count(". ") <= 1


def test_the_recommended_model_is_told_of_and_the_others_are_named(found: dict[str, Any]):
    """Also where it is not the last one given."""
    assert found["best"]["model"] == "true"
    assert [one["model"] for one in found["structure"]] == ["nominal", "true"]
    assert {place["model"] for place in found["failures"]} <= {"nominal", "true"}
    told = Comparison.read(found, "comparison.json", "")
    printed = io.StringIO()
    Console(file=printed, width=200).print(failures_table(told.failures, models_sentence(told.models, told.structure)))
    assert "Failures of nominal and true; not looked at: calibrated and unlawful." in printed.getvalue()


def test_failures_are_told_of_the_recommended_model_or_else_of_the_last():
    named = {name: VehicleModel(HULL, name, "physics") for name in ("nominal", "calibrated", "a", "b")}
    models = [*named.values(), *baselines(HULL)]
    assert ends(models, "a") == (named["nominal"], named["a"])
    for other in ("nominal", "hold velocity", ""):
        assert ends(models, other) == (named["nominal"], named["b"])
    corrected = VehicleModel(HULL, "corrected", "symbolic")
    assert ends([named["nominal"], corrected, named["a"]], "a") == (named["nominal"], corrected)


def test_an_unlawful_model_is_only_trusted_where_all_are_and_that_is_said(inputs: Inputs):
    wild = VehicleModel(HULL.with_values({"N_r": 0.5}), "wild", "physics")
    told = best([(j.model, j.errors, j.audit) for j in (judge(wild, inputs.parts),)])
    assert told.model == "wild"
    assert "breaks" in told.sentence
    assert "no model here keeps all laws" in told.sentence


def with_noise(errors: Errors, seed: int, share: float) -> Errors:
    """The same errors with others of the same size mixed in, which are no better and no worse."""
    rng = np.random.default_rng(seed)
    rolled = {}
    for name, found in errors.rollouts.items():
        squares = tuple(x * np.exp(share * rng.normal(size=x.shape)) for x in found.squares)
        rolled[name] = type(found)(squares, found.spacing, found.diverged)
    return replace(errors, rollouts=rolled)


def test_noise_is_never_recommended_over_a_simpler_model(inputs: Inputs):
    nominal = judge(VehicleModel(HULL, "nominal"), inputs.parts)
    wins = 0
    for seed in range(40):
        dear = VehicleModel(HULL, "dear", "hybrid", 5000)
        field = [(nominal.model, nominal.errors, nominal.audit)]
        field.append((dear, with_noise(nominal.errors, seed, 0.3), nominal.audit))
        wins += best(field).model == "dear"
    assert wins <= 4


def test_ties_are_named_beside_a_lawless_temptation_and_a_twin_is_not(inputs: Inputs):
    """The calibrated model is as good as the nominal one, the corrected one is the same, and the wild one errs less."""
    nominal = judge(VehicleModel(HULL, "nominal"), inputs.parts)
    wild = judge(VehicleModel(TRUE.with_values({"N_r": 0.5}), "wild"), inputs.parts)
    small = with_noise(judge(VehicleModel(TRUE, "true"), inputs.parts).errors, 0, 0.0)
    field = [(nominal.model, nominal.errors, nominal.audit)]
    field.append((VehicleModel(HULL, "calibrated", parameters=5), with_noise(nominal.errors, 1, 0.3), nominal.audit))
    field.append((VehicleModel(HULL, "corrected"), nominal.errors, nominal.audit))
    chance = r" calibrated errs \S+\s% (?:less|more) than nominal, which may be chance \([^)]*\)\.$"
    assert re.search(chance, best(field).sentence)
    field.append((wild.model, small, wild.audit))
    told = best(field)
    assert told.model == "nominal"
    kept = r"wild errs .* less than nominal .*, but breaks .*: trust nominal, which keeps the laws of a hull\."
    assert re.fullmatch(f"{kept}{chance}", told.sentence)
    assert told.sentence.count(". ") == 1


def test_what_decides_is_named_with_its_horizon_and_the_reason_for_a_short_one(inputs: Inputs):
    nominal, true = (
        judge(VehicleModel(hull, name), inputs.parts) for hull, name in ((HULL, "nominal"), (TRUE, "true"))
    )
    field = [(j.model, j.errors, j.audit) for j in (nominal, true)]
    assert "in the speeds predicted over 10 s it errs" in best(field).sentence
    data = DataSet((inputs.parts.judged.motions[0].slice(0, 250),), (), inputs.parts.judged.recipe)
    field = [(j.model, evaluate(j.model, data), j.audit) for j in (nominal, true)]
    assert "in the speeds predicted over 2 s (the rows are too few for 10 s) it errs" in best(field).sentence


def test_where_no_model_beats_a_baseline_none_is_trusted(inputs: Inputs):
    wild = judge(VehicleModel(HULL.with_values({"thrust_scale": 9.0}), "nominal"), inputs.parts)
    field = [wild, *(judge(model, inputs.parts) for model in baselines(HULL))]
    told = best([(j.model, j.errors, j.audit) for j in field])
    assert (told.model, told.horizon) == ("", "10")  # a guess that knows nothing is nobody's model
    assert re.fullmatch(
        r"Trust none of the models on these rows: (?:zero acceleration|hold velocity), a guess that knows nothing of "
        r"the boat, errs \d+\s% less than nominal \(\d+ to \d+\s%\) in the speeds predicted over 10 s\.",
        told.sentence,
    )


def test_a_model_that_gains_on_the_nominal_one_is_trusted_with_the_doubt_that_a_guess_leaves(inputs: Inputs):
    bad = VehicleModel(HULL.with_values({"X_u": -400.0, "Y_v": -900.0, "N_r": -200.0}), "nominal")
    better = VehicleModel(bad.vehicle.with_values({"X_u": -100.0, "N_r": -60.0, "Y_v": -300.0}), "better")
    field = [judge(model, inputs.parts) for model in (bad, better, *baselines(HULL))]
    told = best([(j.model, j.errors, j.audit) for j in field])
    assert told.model == "better"
    assert re.match(r"Trust better: .* it errs \d+\s% less than nominal \(\d+ to \d+\s%\)", told.sentence)
    assert re.search(r"guess that knows nothing of the boat, which may be chance \(\d+\s% less to \d+", told.sentence)


def test_rows_that_are_too_few_for_anything_are_said_to_be(inputs: Inputs):
    data = DataSet((inputs.parts.judged.motions[0].slice(0, 20),), (), WEAK)
    models = (VehicleModel(HULL, "nominal"), VehicleModel(TRUE, "true"))
    told = best([(model, evaluate(model, data), None) for model in models])
    assert told.model == ""
    assert "too few to tell models apart: true has the smallest errors" in told.sentence
    assert "may be chance" in told.sentence


def test_calibration_leaves_the_judged_part_alone(inputs: Inputs, calibrated: tuple[list[Model], list[str]]):
    spoilt = tuple(replace(m, velocity=3.0 * m.velocity) for m in inputs.weak.test.motions)
    weak = replace(inputs.weak, test=replace(inputs.weak.test, motions=spoilt))
    (model,), notes = calibrated
    (again,), _ = calibrated_model(replace(inputs, weak=weak))
    assert again.vehicle == model.vehicle
    assert model.vehicle.value("X_uu") == pytest.approx(-20.0, abs=0.5)
    assert notes == []


def test_calibration_on_judged_rows_is_told(inputs: Inputs):
    _, notes = calibrated_model(inputs.whole(ALL))
    assert notes == ["calibrated was fitted to rows that are judged here: its errors are too small, and do not count"]


def test_a_calibration_on_judged_rows_is_not_recommended(inputs: Inputs, calibrated: tuple[list[Model], list[str]]):
    whole = inputs.whole(ALL)
    nominal = VehicleModel(inputs.vehicle, "nominal")
    held, seen = (
        comparison(judge_all([nominal, *calibrated[0]], given.parts), given, notes=calibrated[1]).best
        for given in (inputs, whole)
    )
    assert held.model == "calibrated"
    assert "calibrated" not in seen.sentence


def test_validation_rows_are_not_fitted_where_they_judge(inputs: Inputs, calibrated: tuple[list[Model], list[str]]):
    (model,), _ = calibrated_model(replace(inputs, parts=Parts(inputs.parts.split, "validation")))
    (other,), _ = calibrated
    assert model.vehicle != other.vehicle


def test_the_basis_of_a_discovery_serves_its_comparison(
    inputs: Inputs, calibrated: tuple[list[Model], list[str]], monkeypatch: pytest.MonkeyPatch
):
    basis = choose_balance(inputs.fitting, inputs.vehicle, DiscoverySettings())
    (anew,), _ = calibrated
    monkeypatch.delattr("undertow.discovery.calibration.before_calibration.choose_balance")
    (model,), _ = calibrated_model(inputs, basis)
    assert model.vehicle == anew.vehicle


def test_why_nothing_is_calibrated_is_told(inputs: Inputs):
    empty = HULL.with_values(dict.fromkeys(("X_u", "X_uu", "Y_v", "Y_vv", "N_r", "N_rr"), 0.0))
    empty = empty.with_values(dict.fromkeys(("X_udot", "Y_vdot", "N_rdot"), 0.0))
    models, notes = calibrated_model(replace(inputs, vehicle=empty))
    assert not models
    assert notes[0].startswith("there is no calibrated model: ")


def test_a_run_is_compared_again_with_more_models(found: dict[str, Any], files: Path):
    again = compare_run(files / "run", [files / "true.yaml"]).to_dict()
    written = json.loads((files / "run" / "comparison.json").read_text())
    names = ["nominal", "calibrated", "corrected", "zero acceleration", "hold velocity"]
    assert [model["name"] for model in written["models"]] == names
    assert [model["name"] for model in again["models"]] == [*names, "true"]
    for name in names:
        ours, theirs = by_name(again)[name], by_name(written)[name]
        assert ours["acceleration"]["rmse"]["surge"] == pytest.approx(theirs["acceleration"]["rmse"]["surge"])
        assert (ours["parameters"], ours["audit"]) == (theirs["parameters"], theirs["audit"])
        assert theirs["seconds_to_evaluate"] is None  # equal inputs give equal files
        assert theirs["seconds_to_fit"] is None
    assert ("true", "corrected") in {(d["model"], d["against"]) for d in again["differences"]}
    assert written["best"]["model"] == "corrected"
    assert by_name(written)["nominal"] != by_name(found)["nominal"]
    # Where it fails is told of what the run is about, whatever else is compared.
    assert [one["model"] for one in again["structure"]] == ["nominal", "corrected"]
    assert again["failures"] == written["failures"]
    assert any(place["removed_by"] for place in again["failures"])


def test_the_band_of_a_run_is_counted_on_another_log(files: Path, tmp_path: Path):
    written = Comparison.read(json.loads((files / "run" / "comparison.json").read_text()), "comparison.json", "")
    (drawn,) = [model for model in written.models if model.band is not None]
    assert drawn.name == "corrected"
    assert drawn.held is None
    other = simulate_world(HULL, {"surge_quadratic_damping": -12.0}, duration=120.0, seed=7).write(tmp_path / "b.csv")
    found = compare(read_inputs(other, HULL), [files / "run"], page=tmp_path / "page")
    run = found.models[-1]
    assert run.band == drawn.band
    assert run.held is not None
    assert run.held.predictions > 100
    assert 0.85 <= run.held.position <= 1.0
    assert "end within the band of run" in (tmp_path / "page" / "report.html").read_text()
    assert "position_band" in (tmp_path / "page" / "series.csv").read_text().splitlines()[0]
    assert "held" not in found.models[0].to_dict()  # files of models without a band stay as they were


def test_compare_prints_whom_to_trust_and_writes_a_file(
    path: Path, files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    target = tmp_path / "comparison.json"
    words = ("compare", path, "-v", "blueboat", "--model", files / "true.yaml")
    screen = " ".join(done(*words, "--out", target).split())
    content = strict(target.read_text())
    assert screen.startswith("Trust true: in the speeds predicted over 10 s it errs")
    assert "Marks beside numbers: < a smaller error than nominal's by more than chance" in screen
    assert f"Comparison:{target}" in screen.replace(" ", "")
    assert content["best"]["model"] == "true"
    refused(*words, "--out", tmp_path, match="it is a folder; give the name of a file")


@final
class Narrow(Model):
    """Foreign code that was trained near rest."""

    vehicle, name, kind, parameters, seconds_to_fit = HULL, "narrow", "network", 7, 0.0
    seen = (np.full(5, -0.01), np.full(5, 0.01))
    same = VehicleModel(HULL, "same")

    def acceleration(self, motion: Motion) -> Array:
        return self.same.acceleration(motion)

    def rollout(self, motion: Motion, starts: np.ndarray, steps: int) -> Rollouts:
        return self.same.rollout(motion, starts, steps)

    def settled(self, velocity: Array, heading: Array, commands: Array) -> Array:
        return self.same.settled(velocity, heading, commands)


def test_a_model_far_from_its_training_is_said_to_be(inputs: Inputs):
    slow = replace(minute(), velocity=np.full_like(minute().velocity, 0.02), commands=np.zeros_like(minute().commands))
    assert Narrow().beyond(slow) == pytest.approx(2.0 * np.sqrt(3.0))
    assert not VehicleModel(HULL, "hull").beyond(slow).any()
    models, _ = reference_models(inputs)
    judged = [judge(model, inputs.parts) for model in (*models, Narrow())]
    table = series(judged[0].model, judged[-1].model, inputs.parts, inputs.channels)
    told = comparison(judged, inputs, table).to_dict()
    (note,) = told["notes"]
    assert note.startswith("narrow is judged far from what it was trained on at")
    assert by_name(told)["narrow"]["seconds_to_fit"] is None


def test_judged_rows_with_nothing_commanded_are_told(inputs: Inputs):
    (moving,) = inputs.parts.judged.motions
    assert not at_rest([moving], HULL), "a boat that is driven throughout"
    commands = moving.commands.copy()
    commands[moving.time > moving.time[0] + 0.4 * moving.duration] = 0.0
    (told,) = at_rest([replace(moving, commands=commands, run_up=None)], HULL)
    share = 0.6 - 8.0 / moving.duration
    found = re.match(r"(\d+)\s% of the (\d+) s that are judged pass with nothing commanded", told)
    assert found is not None
    assert [float(group) for group in found.groups()] == pytest.approx([100.0 * share, moving.duration], abs=1.0)


def test_a_model_given_twice_is_refused(inputs: Inputs, files: Path):
    with pytest.raises(RequestError, match=r"true.yaml is given twice; give it once"):
        compare(inputs, [files / "true.yaml", files / "true.yaml"])


def test_where_noise_makes_much_of_the_errors_both_shares_are_told(inputs: Inputs):
    """As much noise as half of the better model's errors: it saves more without it."""
    louder = [judge(model, inputs.parts) for model in (VehicleModel(HULL, "nominal"), VehicleModel(TRUE, "true"))]
    own, noise = louder[1].errors.rollout_scores["10"].velocity ** 2, louder[1].errors.noise
    bare = [
        replace(one.errors, rollouts={h: replace(r, started=np.zeros(4)) for h, r in one.errors.rollouts.items()})
        for one in louder
    ]
    quiet, loud = (
        comparison([replace(one, errors=replace(e, noise=n)) for one, e in zip(louder, bare, strict=True)], inputs)
        for n in (0.0 * noise, 0.5 * own)
    )
    assert quiet.best.saved is not None
    assert loud.best.saved is not None
    assert loud.best.saved > quiet.best.saved + 0.01
    assert loud.noise is not None
    assert loud.noise.surge == pytest.approx(np.sqrt(0.5 * own[0]))
    assert not [note for note in quiet.notes if "noise of the sensors" in note]
    (told,) = [note for note in loud.notes if "noise of the sensors" in note]
    assert told.endswith(f"with it true errs {percent(quiet.best.saved)} less")


@pytest.mark.filterwarnings("error")
def test_an_axis_on_which_nothing_moves_is_one_on_which_models_are_alike() -> None:
    """As in a log of straight runs without noise: both models are alike there, and no nan is told."""

    def judged(name: str, *velocity: float) -> Any:
        scores = {"10": SimpleNamespace(velocity=np.array(velocity))}
        return SimpleNamespace(name=name, errors=SimpleNamespace(rollout_scores=scores, noise=np.zeros(3)))

    best_of: Any = SimpleNamespace(saved=0.9, horizon="10", model="corrected")
    (told,) = share_with_noise(best_of, [judged("nominal", 0.4, 0.0, 0.2), judged("corrected", 0.2, 0.0, 0.1)])
    assert f"corrected errs {percent(1.0 - 0.5 ** (2.0 / 3.0))} less" in told
