"""A training that goes on from a trained network: its weights and units, the mass and the reach of the new boat."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from training_parts import HULL, parts_of

from undertow.measurements.preparation.split import Split
from undertow.physics.errors import RequestError
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.vehicle import load_vehicle
from undertow.residuals.networks.registry import NETWORKS
from undertow.residuals.scores import acceleration_score
from undertow.residuals.training.epochs import Trained, train
from undertow.residuals.training.history import Epoch
from undertow.residuals.training.preparation import going_on_from, scaling_from
from undertow.residuals.training.training_settings import Choice, TrainingSettings
from undertow.workflows.train import choice_of

SISTER = HULL.with_values({"mass": 1.2 * HULL.mass}, "sister")
QUICK = TrainingSettings(epochs=6, trust=False)
LEARNS = [name for name in NETWORKS if NETWORKS[name].grown is None]


@pytest.fixture(scope="module")
def dragged() -> Split:
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0})


@pytest.fixture(scope="module")
def trained(dragged: Split) -> Trained:
    return train(dragged, HULL, Choice("mlp"), settings=TrainingSettings(epochs=40, trust=False))


@pytest.mark.parametrize("name", LEARNS)
def test_a_training_of_no_steps_is_its_start_on_the_vehicle_of_the_log(dragged: Split, name: str) -> None:
    start = train(dragged, HULL, Choice(name), settings=replace(QUICK, epochs=1)).model
    start.name = "before"
    still = TrainingSettings(epochs=1, learning_rate=1e-12, trust=False)
    found = train(dragged, SISTER, going_on_from(start), settings=still)
    assert found.start == "before"
    assert found.to_dict()["start"] == "before"
    for key, value in start.network.named_parameters():
        torch.testing.assert_close(found.model.network.get_parameter(key), value, rtol=1e-6, atol=1e-9)
    scaling = found.model.network.scaling
    np.testing.assert_array_equal(scaling.inputs.mean, start.network.scaling.inputs.mean)
    np.testing.assert_array_equal(scaling.output, start.network.scaling.output)
    np.testing.assert_array_equal(scaling.mass, mass_matrix(SISTER))


def test_few_epochs_after_a_start_are_better_than_the_same_from_fresh_weights(dragged: Split, trained: Trained) -> None:
    fresh = train(dragged, HULL, Choice("mlp"), settings=QUICK)
    again = train(dragged, HULL, going_on_from(trained.model), settings=QUICK)
    errors = [acceleration_score(found.model, dragged.test).rmse[:2] for found in (fresh, again)]
    assert (errors[1] < errors[0]).all()
    assert again.epochs[0].number == 0
    assert again.epochs[0].rmse < fresh.epochs[0].rmse


def test_a_network_that_stands_for_the_physics_is_judged_as_it_starts(dragged: Split) -> None:
    pure = train(dragged, HULL, Choice("mlp", pure=True, heading=True), settings=QUICK).model
    choice = going_on_from(pure)
    assert (choice.pure, choice.heading) == (True, True)
    assert train(dragged, HULL, choice, settings=QUICK).epochs[0].number == 0


def test_another_start_is_another_training(dragged: Split, trained: Trained, tmp_path: Path) -> None:
    def stop(epoch: Epoch) -> None:
        if epoch.number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(dragged, HULL, going_on_from(trained.model), settings=QUICK, folder=tmp_path, progress=stop)
    with pytest.raises(RequestError, match="start"):
        train(dragged, HULL, Choice("mlp"), settings=QUICK, folder=tmp_path, resume=True)


def test_what_cannot_be_a_start_is_told(dragged: Split, trained: Trained) -> None:
    trees = train(dragged, HULL, Choice("trees"), settings=QUICK).model
    with pytest.raises(RequestError, match="trees of hybrid trees, which are grown anew"):
        going_on_from(trees)
    process = train(dragged, HULL, Choice("gp", {"units": 20}), settings=QUICK).model
    with pytest.raises(RequestError, match="Gaussian processes of hybrid gp, which are fitted anew"):
        going_on_from(process)
    with pytest.raises(RequestError, match="a boat with the same thrusters"):
        scaling_from(trained.model, load_vehicle("cybership2"), heading=False)


def test_the_words_of_a_choice() -> None:
    assert choice_of(None) == Choice("lstm")
    assert choice_of(None, "mlp", {"units": 8.0}, pure=True) == Choice("mlp", {"units": 8.0}, True)
    with pytest.raises(RequestError, match="says which network it is"):
        choice_of("lstm", "mlp")
