"""What was found is taken back where it errs more on the parts of a log that it never saw."""

from dataclasses import replace
from functools import partial

import pytest

from undertow.comparison.comparison import judge
from undertow.comparison.facts import CALIBRATED, NOMINAL, Best
from undertow.discovery.basis import choose
from undertow.discovery.discover import Discovery, find_missing
from undertow.discovery.reason import Reason
from undertow.discovery.settings import DiscoverySettings
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.base import VehicleModel
from undertow.workflows import discover_and_add
from undertow.workflows.discover_and_add import References, assess, references
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.run import Run

HULL = load_vehicle("blueboat")
SETTINGS = DiscoverySettings()


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    """A log of 120 s with hidden quadratic surge drag."""
    log = simulate_world(HULL, {"surge_quadratic_damping": -6.0}, duration=120.0, seed=31)
    return read_inputs(log.write(tmp_path_factory.mktemp("log") / "log.csv"), HULL).whole()


@pytest.fixture(scope="module")
def found(inputs: Inputs) -> Discovery:
    return find_missing(inputs.fitting, inputs.vehicle, SETTINGS, None, choose(inputs.fitting, HULL, SETTINGS))


def assessed(inputs: Inputs, found: Discovery, said: list[str]) -> Run:
    folds = found.unseen.folds
    folded = inputs.in_folds(folds)
    known = partial(references, folded, found.basis, folds)
    return assess(folded, found, SETTINGS, known, said.append, earned=True)


def failing(found: Discovery, drag: float) -> Discovery:
    """The same discovery, whose models without a fold have another drag than the log shows, -14 N s^2/m^2."""
    wrong = tuple(HULL.with_values({"X_uu": drag}) for _ in found.unseen.folds)
    return replace(found, unseen=replace(found.unseen, steps=(*found.unseen.steps[:-1], wrong)))


def test_what_holds_on_unseen_parts_stays(inputs: Inputs, found: Discovery):
    said: list[str] = []
    run = assessed(inputs, found, said)
    assert run.findings.missing == ("surge_quadratic_damping",)
    assert not any(text.startswith("taken back") for text in said)


def test_the_headline_says_where_no_model_is_better_than_a_guess(
    inputs: Inputs, found: Discovery, monkeypatch: pytest.MonkeyPatch
):
    none = Best(sentence="Trust none of the models on these rows.", horizon="10")
    compared = discover_and_add.comparison
    monkeypatch.setattr(discover_and_add, "comparison", lambda *args, **more: compared(*args, **more).but(best=none))
    assert assessed(inputs, found, []).findings.headline == (
        "The model is missing surge quadratic damping; yet no model here predicts these rows better than a guess."
    )


def test_what_errs_more_on_unseen_parts_is_taken_back(inputs: Inputs, found: Discovery):
    said: list[str] = []
    run = assessed(inputs, failing(found, -4.0), said)
    assert any(text.startswith("taken back: on parts of the log that it did not see, the model errs") for text in said)
    findings = run.findings
    assert (findings.verdict, findings.missing) == ("undecided", ())
    assert findings.headline == "Undecided: what was found does not hold where it saw nothing of this log."
    assert findings.reasons[0].startswith("It was surge quadratic damping. There, the model with it errs ")
    effect = next(c for c in findings.candidates if c.effect == "surge_quadratic_damping")
    assert (effect.verdict, effect.reason) == ("possible", Reason.WORSE_UNSEEN)
    assert all(term.in_model is None for term in effect.terms)
    assert run.discovery.corrected.values == HULL.values
    assert [step.added for step in findings.steps] == [None]
    assert findings.data.unexplained["surge"].force > 5.0 * found.force_error[0]


def test_where_fitted_numbers_do_better_nothing_new_is_named(inputs: Inputs, found: Discovery):
    """Drag of a false size is better than none, and worse than a linear drag that stands in for it."""
    said: list[str] = []
    linear = HULL.with_values({"X_uu": -14.0, "X_u": 0.9 * HULL.value("X_u")})
    folds = found.unseen.folds
    folded = inputs.in_folds(folds)
    fitted = VehicleModel(HULL, CALIBRATED, "physics", 1, 0.0, tuple((fold, linear) for fold in folds))
    nominal = VehicleModel(HULL, NOMINAL, "physics")
    known: References = ([judge(model, folded.parts) for model in (nominal, fitted)], [])
    run = assess(folded, failing(found, -11.0), SETTINGS, lambda: known, said.append, earned=True)
    assert run.findings.missing == ()
    assert "than with nothing added and its own numbers fitted" in run.findings.reasons[0]


def test_a_size_that_is_nearly_right_stays(inputs: Inputs, found: Discovery):
    assert assessed(inputs, failing(found, -14.1), []).findings.missing == ("surge_quadratic_damping",)
