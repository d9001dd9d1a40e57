"""Training on a GPU: the same network as on a processor. It is skipped, and says so, where there is no GPU.

Training takes rounding far: where one processor starts from weights that differ by one rounding, three epochs in single
precision part what an LSTM says by 0.1 %, and a `tcn` by 3 % (`benchmarks/training_on_a_gpu.py`, its last piece).
Trainings are therefore compared in double precision, and single precision is asked for the slopes of one batch.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from training_parts import HULL, parts_of

from undertow.measurements.preparation.split import Split
from undertow.residuals.networks.base import Network, Scaling
from undertow.residuals.networks.registry import NETWORKS, build
from undertow.residuals.training import preparation
from undertow.residuals.training.epochs import _reproducible, train
from undertow.residuals.training.history import Epoch
from undertow.residuals.training.training_settings import Choice, TrainingSettings

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU that torch can use")
TRAINED = [name for name, network in NETWORKS.items() if network.grown is None]
BRIEF = TrainingSettings(epochs=3, trust=False)


@pytest.fixture(scope="module")
def dragged() -> Split:
    """A world with quadratic drag and lift that the nominal model lacks."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0})


@pytest.mark.parametrize("name", TRAINED)
def test_a_gpu_trains_the_network_that_a_processor_trains(
    name: str, dragged: Split, monkeypatch: pytest.MonkeyPatch
) -> None:
    def double(name: str, scaling: Scaling, options: Mapping[str, int | float] | None = None) -> Network:
        return build(name, scaling, options).double()

    monkeypatch.setattr(preparation, "build", double)
    said, errors = [], []
    for device in ("cpu", "cuda"):
        found = train(dragged, HULL, Choice(name), settings=replace(BRIEF, device=device))
        said.append(np.concatenate([found.model.correction(motion) for motion in dragged.test.motions]))
        errors.append([(epoch.loss, epoch.rmse) for epoch in found.epochs[1:]])
    size = np.abs(said[0]).max(axis=0)
    assert (size > 1e-3).all()
    assert (np.abs(said[1] - said[0]).max(axis=0) < 1e-6 * size).all()
    np.testing.assert_allclose(errors[1], errors[0], rtol=1e-6)


@pytest.mark.parametrize("rollout_rows", [0, 5])
@pytest.mark.parametrize("name", TRAINED)
def test_slopes_of_a_batch_are_those_of_a_processor_in_single_precision(
    name: str, rollout_rows: int, dragged: Split
) -> None:
    found = []
    for device in ("cpu", "cuda"):
        with _reproducible(0):
            settings = replace(BRIEF, device=device, rollout_rows=rollout_rows)
            made = preparation.prepare_training(dragged, HULL, Choice(name), settings)
            draw, moved = torch.Generator().manual_seed(0), torch.Generator().manual_seed(1)
            with torch.no_grad():
                for weights in made.network.parameters():  # a head of zeros would keep the rest from being asked
                    weights.add_(0.01 * torch.randn(weights.shape, generator=moved).to(weights))
            made.objective(made.network, torch.arange(8, device=device), draw).backward()
        slopes = [weights.grad for weights in made.network.parameters() if weights.grad is not None]
        found.append(torch.cat([slope.flatten().cpu().double() for slope in slopes]))
    assert 0.0 < float(found[0].norm()) < np.inf
    # An H100 parts them by at most 1.2e-6; where its kernels round products to ten bits, by 1.3e-5 to 1.8e-3.
    assert float((found[1] - found[0]).norm()) < 1e-5 * float(found[0].norm())


def test_a_training_on_a_gpu_is_resumed_and_repeated(dragged: Split, tmp_path: Path) -> None:
    settings = replace(BRIEF, device="cuda")

    def stop(epoch: Epoch) -> None:
        if epoch.number == 2:
            raise KeyboardInterrupt

    whole = train(dragged, HULL, Choice("lstm"), settings=settings)
    with pytest.raises(KeyboardInterrupt):
        train(dragged, HULL, Choice("lstm"), settings=settings, folder=tmp_path, progress=stop)
    resumed = train(dragged, HULL, Choice("lstm"), settings=settings, folder=tmp_path, resume=True)
    assert resumed.epochs == whole.epochs
    for now, then in zip(resumed.model.network.parameters(), whole.model.network.parameters(), strict=True):
        assert torch.equal(now, then)
