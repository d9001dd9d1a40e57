"""A discovery with a network beside the corrected model: its row, what it says, and its place in the run's folder."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from undertow.discovery.basis import DiscoverySettings
from undertow.measurements.prepared_logs import Inputs
from undertow.physics.errors import RequestError
from undertow.physics.forces import at_beginning
from undertow.physics.motion import Motion
from undertow.physics.sampled_series import shift
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import apply_effects
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.models.model_files import load_network
from undertow.residuals.scores import rollout_scores
from undertow.residuals.training import best_kind
from undertow.residuals.training.best_kind import Candidate
from undertow.residuals.training.probes import Probed
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows import whole_answer
from undertow.workflows.compare import compare_run
from undertow.workflows.discover_and_add import add
from undertow.workflows.inputs import read_inputs
from undertow.workflows.run_folder.write import Run, write_run
from undertow.workflows.train import NothingToLearnError, TrainRun, train, write_network
from undertow.workflows.whole_answer import NETWORK, check_kind, names_leave, network_of, remove_network, with_network

HULL = load_vehicle("blueboat")
LACKING = {"surge_quadratic_damping": -10.0, "sway_lift": 20.0}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run that has named one of two effects: the other is left for a network."""
    log = tmp_path_factory.mktemp("whole") / "log.csv"
    simulate_world(HULL, LACKING, duration=150.0, seed=3, noise="clean").write(log)
    return add(["surge_quadratic_damping"], read_inputs(log, HULL, progress=None), DiscoverySettings(), progress=None)


def test_what_names_leave_a_network_learns_and_both_are_one_answer(run: Run, tmp_path: Path) -> None:
    few = TrainingSettings(epochs=20, device="cpu", minutes=0.2)
    whole, done = with_network(run, "ridge", settings=few, progress=None)
    assert done is not None
    assert {kind.name for kind in done.kinds} | set(done.left_behind) >= {"ridge"}
    assert done.model.vehicle == at_beginning(run.discovery.corrected), "without what is this log's alone"
    *before, last = whole.comparison.models
    assert before == list(run.comparison.models)
    assert (last.name, last.kind, last.fitted_here) == ("corrected + ridge", "hybrid", True)
    named = next(model for model in before if model.name == "corrected")
    assert last.rollout["10"].sway < named.rollout["10"].sway
    note = whole.comparison.notes[-1]
    assert note.startswith("Of the nominal model's error of position over ")
    assert "; a network (ridge) of what has no name takes " in note
    folder = write_run(whole, tmp_path / "run", report=False, progress=None)
    assert network_of(folder) is None
    write_network(done, folder / NETWORK)
    assert load_network(folder / NETWORK).vehicle == at_beginning(load_vehicle(folder / "model.yaml"))
    again = compare_run(folder, progress=None)
    row = next(model for model in again.models if model.name == "corrected + ridge")
    assert row.fitted_here
    assert row.rollout["10"].position == pytest.approx(last.rollout["10"].position, rel=1e-3)
    (folder / NETWORK / "mine.txt").write_text("kept")
    remove_network(folder)
    assert [path.name for path in (folder / NETWORK).iterdir()] == ["mine.txt"]
    write_network(done, folder / NETWORK, force=True)
    HULL.save(folder / "model.yaml")
    assert network_of(folder) is None, "beside another model it is no part of the answer"


def test_a_model_that_leaves_nothing_ends_with_a_line(run: Run) -> None:
    inputs = run.inputs
    exact = add([*LACKING], read_inputs(list(inputs.paths), HULL, progress=None), DiscoverySettings(), progress=None)
    whole, done = with_network(exact, "mlp", settings=TrainingSettings(epochs=2), progress=None)
    assert done is None
    assert whole.comparison.models == exact.comparison.models
    assert whole.comparison.notes[-1].startswith("Nothing is left for a network to learn beside a vehicle")


def test_of_a_trifle_that_names_leave_the_best_network_is_none(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    first, *_, last = run.findings.steps
    assert 0.03 < names_leave(run.findings) < 1.0
    error = first.rollout("10")
    nearly = last.but(rollout_rmse={"10": error.but(position=0.02 * error.position)})
    little = replace(run, findings=run.findings.but(steps=(first, nearly)))
    whole, done = with_network(little, "best", progress=None)
    assert (done, whole.comparison.models) == (None, run.comparison.models)
    assert whole.comparison.notes[-1].startswith("Names leave 2\N{NO-BREAK SPACE}% of the nominal model's error")
    asked = []
    monkeypatch.setattr(whole_answer, "train", lambda inputs, choice, **_: asked.append(choice) or tell_nothing())
    with_network(little, "gp", progress=None)
    assert [choice.network for choice in asked] == ["gp"], "who names a kind gets it"


def tell_nothing() -> TrainRun:
    raise NothingToLearnError("nothing")


def test_where_no_kind_holds_elsewhere_the_names_are_the_answer(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def tried(*given: object, **options: object) -> list[Candidate]:
        del given, options
        return [Candidate(Choice("gp"), ratio, 0.1, Probed()) for ratio in (1.0, 1.2)]

    monkeypatch.setattr(best_kind, "candidates", tried)
    whole, done = with_network(run, "best", progress=None)
    assert done is None
    assert whole.comparison.models == run.comparison.models
    assert "errs less than the vehicle alone. In predictions of 2 and 10 s" in whole.comparison.notes[-1]
    assert "gp 100\N{NO-BREAK SPACE}% (standard error 10\N{NO-BREAK SPACE}%) and gp 120" in whole.comparison.notes[-1]


def test_a_network_does_not_learn_when_the_commands_of_its_log_act(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    (known,) = (sensor for sensor in run.findings.sensors if sensor.what == "command_offset")
    late = known.but(terms=(known.terms[0].but(value=0.03),))
    seen = []

    def asked(inputs: Inputs, *given: object, **options: object) -> TrainRun:
        del given, options
        seen.append(inputs.vehicle.value("command_offset"))
        raise NothingToLearnError("nothing")

    monkeypatch.setattr(whole_answer, "train", asked)
    with_network(replace(run, findings=run.findings.but(sensors=(late,))), "mlp", progress=None)
    with_network(replace(run, findings=run.findings.but(sensors=())), "mlp", progress=None)
    assert seen == [0.03, 0.0]


def test_what_its_log_says_too_early_is_not_learnt_as_the_boats(run: Run) -> None:
    late = 0.05

    def early(motion: Motion) -> Motion:
        columns = [shift(column, -late, motion.time_step) for column in motion.commands.T]
        return replace(motion, commands=np.column_stack(columns))

    exact = read_inputs(list(run.inputs.paths), apply_effects(HULL, LACKING), progress=None)
    how = TrainingSettings(decline=False, device="cpu")
    told, untold = (
        train(replace(exact.mapped(early), vehicle=vehicle), Choice("ridge"), settings=how, progress=None).model
        for vehicle in (exact.vehicle.with_values({"command_offset": late}), exact.vehicle)
    )
    assert told.vehicle == untold.vehicle == at_beginning(exact.vehicle)
    errors = [rollout_scores(model, exact.parts.judged)["2"].velocity[2] for model in (told, untold)]
    assert errors[0] < 0.7 * errors[1], "judged with the commands as they are"


def test_an_unknown_kind_is_refused_before_the_work() -> None:
    check_kind("best")
    with pytest.raises(RequestError, match="did you mean 'lstm'"):
        check_kind("lstn")
