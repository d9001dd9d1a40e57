"""The model that is written is the one whose error is reported, and no other errs less on rows that it did not see."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from undertow.comparison.comparison import Judged, judge
from undertow.comparison.facts import CALIBRATED, CORRECTED, NOMINAL, Best, Grounds, Margin
from undertow.comparison.recommendation import shares_of_error
from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.discover import Discovery, find_missing
from undertow.discovery.effect_findings import FittedTerm
from undertow.discovery.findings import Findings
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.scores import rollout_scores
from undertow.workflows import discover_and_add
from undertow.workflows.discover_and_add import MATERIAL, References, assess, references
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.read import read_record
from undertow.workflows.run_folder.write import Run, write_run

HULL = load_vehicle("blueboat")
SETTINGS = DiscoverySettings()
NAME = "surge_quadratic_damping"
FILE, TRUE = HULL.value("X_uu"), HULL.value("X_uu") - 6.0
SPEEDS = ("surge", "sway", "yaw")


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    """A log of 120 s with hidden quadratic surge drag."""
    log = simulate_world(HULL, {NAME: -6.0}, duration=120.0, seed=31)
    return read_inputs(log.write(tmp_path_factory.mktemp("log") / "log.csv"), HULL).whole()


@pytest.fixture(scope="module")
def aside(inputs: Inputs) -> Inputs:
    """The same log, of which the last part is kept aside to judge on."""
    return read_inputs(inputs.paths, HULL, judge="test").whole()


@pytest.fixture(scope="module")
def found(inputs: Inputs) -> Discovery:
    return find_missing(inputs.fitting, inputs.vehicle, SETTINGS, None, choose_balance(inputs.fitting, HULL, SETTINGS))


@pytest.fixture(scope="module")
def folded(inputs: Inputs, found: Discovery) -> Inputs:
    """The same, cut where folds begin and end."""
    return inputs.in_folds(found.unseen.folds)


@pytest.fixture(scope="module")
def known(folded: Inputs, found: Discovery) -> References:
    """The nominal and the calibrated model and the baselines, judged."""
    return references(folded, found.basis, found.unseen.folds)


def with_drag(found: Discovery, drag: float) -> Discovery:
    """The same discovery, whose models without a fold have another drag [N s^2/m^2] than the log shows."""
    wrong = tuple(HULL.with_values({"X_uu": drag}) for _ in found.unseen.folds)
    return replace(found, unseen=replace(found.unseen, steps=(*found.unseen.steps[:-1], wrong)))


def calibrated_to(folded: Inputs, found: Discovery, drag: float, known: References) -> References:
    """The nominal model and one with its own numbers fitted, whose models without a fold have a drag."""
    folds, vehicle = found.unseen.folds, HULL.with_values({"X_uu": drag})
    fitted = VehicleModel(vehicle, CALIBRATED, "physics", 1, 0.0, tuple((fold, vehicle) for fold in folds))
    return [known[0][0], judge(fitted, folded.parts)], []


def assessed(folded: Inputs, found: Discovery, known: References) -> Run:
    return assess(folded, found, SETTINGS, lambda: known, earned=True)


def same_names(run: Run, found: Discovery) -> bool:
    """Whether the names of a run, and how sure each is, are those of the discovery."""
    said, before = (
        [(c.key, c.verdict, c.confidence, c.reason) for c in findings.candidates]
        for findings in (run.findings, found.findings)
    )
    return said == before and run.findings.missing == found.findings.missing


def in_model(findings: Findings) -> list[float]:
    """The numbers of effects that the written model has."""
    return [term.in_model for c in findings.candidates for term in c.terms if term.in_model is not None]


def shares(folded: Inputs, *judged: Judged) -> list[float]:
    """Squared errors as shares of the nominal model's, the first."""
    velocity = np.concatenate([motion.velocity for motion in folded.parts.judged.motions])
    return shares_of_error([one.errors for one in judged], (velocity**2).mean(axis=0))


def reported(run: Run) -> dict[str, float]:
    """The error of the model that is written over 10 s, by axis, as the findings tell it."""
    last = run.findings.steps[-1].rollout("10")
    return {axis: last.of(axis) for axis in (*SPEEDS, "position")}


def recomputed(folder: Path, inputs: Inputs) -> dict[str, float]:
    """The same from the files of a run alone: the model that stands there, and those without each fold."""
    model = load_vehicle(folder / "model.yaml")
    findings = read_record((folder / "findings.json").read_bytes(), Findings, folder)
    nominal = load_vehicle(folder / "nominal.yaml")
    records = findings.folds.models if findings.folds else ()
    sources = list(inputs.starts)
    apart = [(record.fold(sources), nominal.with_values(dict(record.values))) for record in records]
    scores = rollout_scores(VehicleModel(model, CORRECTED, unseen=apart), inputs.parts.judged, (10.0,))
    return {axis: scores["10"].record.of(axis) for axis in (*SPEEDS, "position")}


def test_what_holds_on_unseen_parts_is_written(folded: Inputs, found: Discovery, known: References, tmp_path: Path):
    run = assessed(folded, found, known)
    assert same_names(run, found)
    assert in_model(run.findings) == in_model(found.findings) != []
    folder = write_run(run, tmp_path / "run", report=False, progress=None)
    assert load_vehicle(folder / "model.yaml").value("X_uu") == pytest.approx(TRUE, rel=0.02)
    assert recomputed(folder, folded) == pytest.approx(reported(run), rel=1e-6)


def test_what_is_named_stays_where_the_calibrated_model_is_better_by_chance(
    folded: Inputs, found: Discovery, known: References, monkeypatch: pytest.MonkeyPatch
):
    margin = Margin(model=CALIBRATED, against=CORRECTED, relative=-0.3, verdict="no difference")
    chance = Best(grounds=Grounds.CHANCE, sentence="", margins=(margin,))
    monkeypatch.setattr(discover_and_add, "_of", lambda models: chance)
    run = assessed(folded, with_drag(found, FILE + 4.0), calibrated_to(folded, found, TRUE, known))
    assert in_model(run.findings) == in_model(found.findings) != []


def test_what_errs_more_than_the_calibrated_model_is_not_written_and_the_names_stay(
    folded: Inputs, found: Discovery, known: References, tmp_path: Path
):
    run = assessed(folded, with_drag(found, FILE + 4.0), calibrated_to(folded, found, TRUE, known))
    assert same_names(run, found)
    assert in_model(run.findings) == []
    assert [step.added for step in run.findings.steps] == [None, CALIBRATED]
    assert [(c.symbol, c.before, c.after) for c in run.findings.calibrated] == [("X_uu", FILE, TRUE)]
    assert "better than the file's model with its own numbers fitted" in run.findings.reasons[-1]
    folder = write_run(run, tmp_path / "run", report=False, progress=None)
    assert load_vehicle(folder / "model.yaml").value("X_uu") == TRUE
    assert recomputed(folder, folded) == pytest.approx(reported(run), rel=1e-6)
    (told,) = [model for model in run.comparison.models if model.name == CORRECTED]
    assert {axis: told.rollout["10"].of(axis) for axis in reported(run)} == pytest.approx(reported(run), rel=1e-6)


@pytest.mark.parametrize("named", [True, False])
def test_what_has_no_sure_name_is_written_only_where_it_predicts_materially_better(
    folded: Inputs, found: Discovery, known: References, named: bool
):
    """Both models predict unseen rows as well: the one with a sure name is written, or else the one that adds none."""
    alike = calibrated_to(folded, found, found.corrected.value("X_uu"), known)
    unsure = replace(found, findings=found.findings.but(missing=(), likely=()))
    run = assessed(folded, found if named else unsure, alike)
    assert [step.added for step in run.findings.steps] == [None, NAME if named else CALIBRATED]


@pytest.mark.parametrize(("surest", "written"), [(CALIBRATED, [None, CALIBRATED]), (NOMINAL, [None])])
@pytest.mark.parametrize("asked", ["guesses", "nothing"])
def test_the_numbers_of_the_file_stay_where_others_are_better_by_chance(
    folded: Inputs,
    found: Discovery,
    known: References,
    monkeypatch: pytest.MonkeyPatch,
    surest: str,
    written: list[str | None],
    asked: str,
):
    monkeypatch.setattr(discover_and_add, "best", lambda _: Best(model=surest))
    unsure = replace(found, findings=found.findings.but(missing=(), likely=()))
    if asked == "nothing":
        unsure = replace(unsure, corrected=HULL, steps=found.steps[:1], unseen=replace(found.unseen, steps=()))
    run = assessed(
        folded,
        with_drag(unsure, FILE + 4.0) if asked == "guesses" else unsure,
        calibrated_to(folded, found, TRUE, known),
    )
    assert [step.added for step in run.findings.steps] == written


def test_a_term_without_a_name_that_is_not_written_is_told_as_a_force(
    folded: Inputs, found: Discovery, known: References
):
    term = FittedTerm(axis="surge", form="u^3", value=-2.0, unit="N s^3/m^3")
    asking = replace(found, findings=found.findings.but(missing=(), likely=(), unnamed=(term,)))
    run = assessed(folded, asking, calibrated_to(folded, found, TRUE, known))
    (form,) = [form for form in run.findings.other_forms if form.follows == "u^3"]
    surge = np.concatenate([motion.velocity[:, 0] for motion in found.basis.forces.motions])
    assert run.findings.unnamed == ()
    assert form.force == pytest.approx(2.0 * np.sqrt((surge**6).mean()))
    assert form.share == pytest.approx(form.force / found.findings.criterion.force_scale["surge"])
    assert form.in_words in run.findings.reasons[-1]


def test_where_the_file_predicts_best_the_file_is_written(
    folded: Inputs, found: Discovery, known: References, tmp_path: Path
):
    nominal: References = ([known[0][0]], [])
    run = assessed(folded, with_drag(found, FILE + 4.0), nominal)
    assert same_names(run, found)
    assert in_model(run.findings) == []
    assert [step.added for step in run.findings.steps] == [None]
    assert run.findings.calibrated == ()
    assert "predicts speeds materially better than the nominal model" in run.findings.reasons[-1]
    assert run.findings.data.unexplained["surge"].force > 5.0 * found.force_error[0]
    folder = write_run(run, tmp_path / "run", report=False, progress=None)
    assert load_vehicle(folder / "model.yaml").values == HULL.values
    assert recomputed(folder, folded) == pytest.approx(reported(run), rel=1e-6)


def test_where_a_part_of_the_log_is_kept_aside_the_same_is_written(aside: Inputs, found: Discovery, tmp_path: Path):
    """No model was fitted without a fold there, and the fitted numbers are written all the same."""
    wrong, right = (HULL.with_values({"X_uu": drag}) for drag in (FILE + 4.0, TRUE))
    bad = replace(found, corrected=wrong, steps=(*found.steps[:-1], (found.steps[-1][0], wrong)))
    models = (VehicleModel(HULL, NOMINAL), VehicleModel(right, CALIBRATED, "physics", 1))
    run = assessed(aside, bad, ([judge(model, aside.parts) for model in models], []))
    assert same_names(run, found)
    assert [step.added for step in run.findings.steps] == [None, CALIBRATED]
    assert [(c.symbol, c.after) for c in run.findings.calibrated] == [("X_uu", TRUE)]
    folder = write_run(run, tmp_path / "run", report=False, progress=None)
    assert load_vehicle(folder / "model.yaml").value("X_uu") == TRUE
    assert recomputed(folder, aside) == pytest.approx(reported(run), rel=1e-6)


@pytest.mark.parametrize(("beside", "written"), [(0.6, CORRECTED), (2.0, CALIBRATED)], ids=["a little", "materially"])
def test_what_part_of_the_nominal_error_it_is_decides(
    folded: Inputs, found: Discovery, known: References, beside: float, written: str
):
    """A boat goes as fast as the root of its drag lets it: 0.5 % of the error is little, 6 % is not."""
    wrong, references = with_drag(found, TRUE + beside), calibrated_to(folded, found, TRUE, known)
    model = VehicleModel(HULL.with_values({"X_uu": TRUE + beside}), CORRECTED)
    nominal, calibrated, corrected = shares(folded, *references[0], judge(model, folded.parts))
    assert nominal == pytest.approx(1.0)
    assert calibrated < 0.05, "what the noise of the speeds is of them"
    off, without = (np.sqrt(TRUE / drag) - 1.0 for drag in (TRUE + beside, FILE))
    assert corrected - calibrated == pytest.approx((off / without) ** 2, rel=0.3, abs=0.005)
    assert (corrected > calibrated + MATERIAL) == (written == CALIBRATED)
    run = assessed(folded, wrong, references)
    assert same_names(run, found)
    assert bool(in_model(run.findings)) == (written == CORRECTED)


def test_what_was_added_by_hand_is_written_whatever_it_errs(folded: Inputs, found: Discovery, known: References):
    run = assess(folded, with_drag(found, FILE + 4.0), SETTINGS, lambda: known)
    assert in_model(run.findings) == in_model(found.findings)
    assert run.discovery.corrected.value("X_uu") == pytest.approx(TRUE, rel=0.02)


def test_the_model_with_its_own_numbers_fitted_is_kept_beside_the_run(
    folded: Inputs, found: Discovery, known: References
):
    run = assessed(folded, found, known)
    assert run.calibrated is not None
    fitted = next(judged.model for judged in known[0] if judged.name == CALIBRATED)
    assert isinstance(fitted, VehicleModel)
    assert run.calibrated.values == fitted.vehicle.values


def test_the_headline_says_where_no_model_is_better_than_a_guess(
    folded: Inputs, found: Discovery, known: References, monkeypatch: pytest.MonkeyPatch
):
    none = Best(sentence="Trust none of the models on these rows.", horizon="10")
    compared = discover_and_add.comparison
    monkeypatch.setattr(discover_and_add, "comparison", lambda *args, **more: compared(*args, **more).but(best=none))
    named = replace(found, findings=found.findings.but(missing=(NAME,), headline="The model is missing it."))
    assert assessed(folded, named, known).findings.headline == (
        "The model is missing it; yet no model here predicts these rows better than a guess."
    )
