"""What of a correction is kept: trees as plain arrays, shares that hold in rollouts, jumps by their size."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from training_parts import HULL, fresh, parts_of

from undertow.comparison.coverage import coverage
from undertow.measurements.preparation.split import Split
from undertow.physics.errors import RequestError
from undertow.physics.frames import AXES
from undertow.physics.matrices import mass_matrix
from undertow.physics.motion import Motion
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.model_files import load_network, save_network
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.networks.registry import build
from undertow.residuals.scores import acceleration_score, evaluate
from undertow.residuals.training.epochs import train
from undertow.residuals.training.holding import least_share, share_that_holds
from undertow.residuals.training.losses import robust
from undertow.residuals.training.training_settings import Choice, TrainingSettings


@pytest.fixture(scope="module")
def dragged() -> Split:
    """A world with quadratic drag and lift that the nominal model lacks."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0})


def test_trees_learn_what_the_nominal_model_lacks_and_are_plain_arrays(dragged: Split, tmp_path: Path) -> None:
    choice = Choice("trees", {"units": 30}, axes=(True, True, False))
    found = train(dragged, HULL, choice, settings=TrainingSettings(fade=0.0))
    before, after = (
        acceleration_score(model, dragged.test).rmse for model in (VehicleModel(HULL, "nominal"), found.model)
    )
    assert (after[:2] < 0.7 * before[:2]).all()
    assert (len(found.epochs), found.stopped) == (2, "all trees are grown")
    again = load_network(save_network(found.model, tmp_path / "trees", {}))
    motion = dragged.test.motions[0]
    assert (found.model.correction(motion)[:, 2] == 0.0).all(), "where nothing is to be learnt, nothing is said"
    assert np.array_equal(again.correction(motion), found.model.correction(motion))
    told = coverage(again, evaluate(again, dragged.test, ()), dragged.test)
    assert told is not None
    assert told.inside.share is not None
    assert min(told.inside.share.of(axis) for axis in AXES) >= 0.85
    assert told.inside.rows + told.outside.rows == dragged.test.rows
    alone = VehicleModel(HULL, "alone")
    assert coverage(alone, evaluate(alone, dragged.test, ()), dragged.test) is None
    with pytest.raises(RequestError, match="expected at least 2 leaves, got 1"):
        build("trees", found.model.network.scaling, {"leaves": 1})


@pytest.mark.parametrize(("told", "share"), [(0.5, 1.0), (1.0, 1.0), (2.0, 0.5), (4.0, 0.25), (-1.0, 0.0)])
def test_what_does_not_hold_in_rollouts_is_taken_away(dragged: Split, told: float, share: float) -> None:
    """A network that says so many times what is missing, of which the rest that is right is known."""
    lacking = HULL.with_values({"surge_trim": 6.0})
    motions = tuple(rolled(lacking, motion) for motion in dragged.validation.motions)
    network = fresh("mlp", dragged).float()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.zero_()
        network.head.bias[0] = told * 6.0 / mass_matrix(HULL)[0, 0] / 0.1  # type: ignore[union-attr, index]
    model = NetworkModel(HULL, network, 0.1)
    assert share_that_holds(model, replace(dragged.validation, motions=motions)) == share
    assert share_that_holds(NetworkModel(HULL, network, 0.1, pure=True), dragged.validation) == 1.0


def test_one_rollout_that_errs_most_does_not_decide_how_much_holds() -> None:
    alone = np.where(np.arange(50) == 7, 1000.0, 1.0)
    assert least_share({0.0: alone, 0.5: 0.5 * alone, 1.0: 0.25 * alone}, 3.0) == 1.0
    spared = np.where(np.arange(50) == 7, 10.0, 1.3)
    assert least_share({0.0: alone, 1.0: spared}, 3.0) == 0.0, "all others err more"
    assert least_share({0.0: alone, 1.0: np.full(50, np.inf)}, 3.0) == 0.0
    hardly = np.where(np.arange(50) == 7, 990.0, 0.1)
    assert least_share({0.0: alone, 1.0: hardly}, 3.0) == 0.0, "the one that matters is no better"


def rolled(vehicle: Vehicle, motion: Motion) -> Motion:
    """The motion that a vehicle would have made under the same commands."""
    states = VehicleModel(vehicle, "true").rollout(motion, np.array([0]), motion.time.size - 1).states[0]
    return replace(motion, position=states[:, :2], heading=states[:, 2], velocity=states[:, 3:])


def test_rare_jumps_count_by_their_size_where_it_is_asked_for() -> None:
    error = torch.tensor([0.5, -2.0, 3.0])
    assert robust(error, 0.0).tolist() == [0.25, 4.0, 9.0]
    assert robust(error, 2.0).tolist() == [0.25, 4.0, 8.0]
