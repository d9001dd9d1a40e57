"""Training on a GPU: the same network as on a processor. It is skipped, and says so, where there is no GPU."""

import numpy as np
import pytest
import torch
from training_parts import HULL, parts_of

from undertow.measurements.preparation.split import Split
from undertow.residuals.networks.registry import NETWORKS
from undertow.residuals.training.epochs import train
from undertow.residuals.training.training_settings import Choice, TrainingSettings

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU that torch can use")


@pytest.fixture(scope="module")
def dragged() -> Split:
    """A world with quadratic drag and lift that the nominal model lacks."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0})


@pytest.mark.parametrize("name", [n for n, network in NETWORKS.items() if network.grown is None])
def test_a_gpu_trains_the_network_that_a_processor_trains(name: str, dragged: Split):
    found = []
    for device in ("cpu", "cuda"):
        settings = TrainingSettings(epochs=3, trust=False, device=device)
        model = train(dragged, HULL, Choice(name), settings=settings).model
        found.append(np.concatenate([model.correction(motion) for motion in dragged.test.motions]))
    size = np.abs(found[0]).max(axis=0)
    assert (size > 1e-3).all()
    assert (np.abs(found[1] - found[0]).max(axis=0) < 1e-4 * size).all()
