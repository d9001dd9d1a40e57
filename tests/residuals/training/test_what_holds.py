"""What of a correction is kept: trees as plain arrays, jumps by their size."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from training_parts import HULL, parts_of

from undertow.comparison.comparison import coverage
from undertow.measurements.preparation.split import Split
from undertow.physics.errors import RequestError
from undertow.physics.motion import AXES, Motion
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.model_files import load_network, save_network
from undertow.residuals.networks.registry import build
from undertow.residuals.scores import acceleration_score, evaluate
from undertow.residuals.training.epochs import train
from undertow.residuals.training.losses import robust
from undertow.residuals.training.training_settings import Choice, TrainingSettings


@pytest.fixture(scope="module")
def dragged() -> Split:
    """A world with quadratic drag and lift that the nominal model lacks."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0})


def test_trees_learn_what_the_nominal_model_lacks_and_are_plain_arrays(dragged: Split, tmp_path: Path) -> None:
    choice = Choice("trees", {"units": 30})
    found = train(dragged, HULL, choice, settings=TrainingSettings(trust=False))
    before, after = (
        acceleration_score(model, dragged.test).rmse for model in (VehicleModel(HULL, "nominal"), found.model)
    )
    assert (after[:2] < 0.7 * before[:2]).all()
    assert (len(found.epochs), found.stopped) == (1, "all trees are grown")
    again = load_network(save_network(found.model, tmp_path / "trees", {}))
    motion = dragged.test.motions[0]
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


def rolled(vehicle: Vehicle, motion: Motion) -> Motion:
    """The motion that a vehicle would have made under the same commands."""
    states = VehicleModel(vehicle, "true").rollout(motion, np.array([0]), motion.time.size - 1).states[0]
    return replace(motion, position=states[:, :2], heading=states[:, 2], velocity=states[:, 3:])


def test_rare_jumps_count_by_their_size_where_it_is_asked_for() -> None:
    error = torch.tensor([0.5, -2.0, 3.0])
    assert robust(error, 0.0).tolist() == [0.25, 4.0, 9.0]
    assert robust(error, 2.0).tolist() == [0.25, 4.0, 8.0]
