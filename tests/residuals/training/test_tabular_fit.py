"""Networks that are grown: Gaussian processes that say what scikit-learn's say, smoothly and as plain arrays."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from training_parts import HULL, parts_of

from undertow.measurements.preparation.resampling import Standardisation
from undertow.measurements.preparation.split import Split
from undertow.physics.errors import RequestError
from undertow.physics.motion import Array
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.model_files import load_network, save_network
from undertow.residuals.models.network_inputs import input_names
from undertow.residuals.models.network_model import scaling_of
from undertow.residuals.networks.base import Network
from undertow.residuals.networks.registry import NETWORKS, build
from undertow.residuals.scores import acceleration_score, rollout_scores
from undertow.residuals.training import tabular_fit as growing_processes
from undertow.residuals.training.epochs import train
from undertow.residuals.training.tabular_fit import GROWING, Table, fit_tabular
from undertow.residuals.training.training_settings import Choice, TrainingSettings

SETTINGS = TrainingSettings(trust=False)
EPOCHS = SETTINGS.epochs
ROWS = 300
"""So few that all of them can be centres."""


@pytest.fixture(scope="module")
def dragged() -> Split:
    """A world with quadratic drag and lift that the nominal model lacks."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0})


def as_table(seen: Array, wanted: Array) -> Table:
    """Rows of one motion."""
    return Table(seen, wanted, (len(seen),), 0.1)


def table(rows: int = ROWS) -> tuple[Array, Array]:
    """Inputs, and a smooth target of them with noise; nothing is to be learnt in yaw."""
    rng = np.random.default_rng(8)
    seen = rng.normal(size=(rows, 5)).astype(np.float32).astype(float)
    smooth = np.column_stack([np.sin(2.0 * seen[:, 0]) + 0.3 * seen[:, 3], np.tanh(seen[:, 1] * seen[:, 2])])
    return seen, np.column_stack([smooth + rng.normal(0.0, 0.1, smooth.shape), np.zeros(rows)])


def fitted(units: int, seed: int = 0, rows: int = ROWS) -> Network:
    names = input_names(HULL, False)
    scaling = scaling_of(HULL, Standardisation(names, np.zeros(5), np.ones(5)), np.ones(3))
    network = build("gp", scaling, {"units": units})
    fit_tabular(network, as_table(*table(rows)), seed, EPOCHS)
    return network


def says(network: Network, seen: Array) -> Array:
    with torch.no_grad():
        return network(torch.as_tensor(seen, dtype=torch.float32)[None])[0][0].double().numpy()


def test_every_network_that_is_grown_is_known_to_grow() -> None:
    assert set(GROWING) == {network for network in NETWORKS.values() if network.grown is not None}


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")
@pytest.mark.parametrize(("nugget", "most"), [(1e-8, 5e-4), (growing_processes._NUGGET, 1e-2)])
def test_where_all_rows_are_centres_it_says_what_scikit_learn_does(
    nugget: float, most: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Up to single precision, and with the nugget by no more than a tenth of the noise."""
    monkeypatch.setattr(growing_processes, "_NUGGET", nugget)
    monkeypatch.setattr(growing_processes, "_LONGER", (1.0,))
    monkeypatch.setattr(growing_processes, "_LOUDER", (1.0,))
    seen, target = table()
    drawn = np.random.default_rng(0).permutation(ROWS)
    asked = np.random.default_rng(9).normal(size=(200, 5)).astype(np.float32).astype(float)
    said = says(fitted(ROWS), asked)
    for axis in range(2):
        lengths: Any = np.full(5, 2.0)  # annotated as a number alone
        kernel = ConstantKernel(1.0, (1e-3, 1e2)) * RBF(lengths, (0.1, 1e2)) + WhiteKernel(0.1, (1e-4, 10.0))
        process = GaussianProcessRegressor(kernel).fit(seen[drawn], target[drawn, axis])
        assert said[:, axis] == pytest.approx(process.predict(asked), abs=most)
    assert not said[:, 2].any(), "where nothing is to be learnt, nothing is said"


def test_few_centres_have_the_weights_of_the_equation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growing_processes, "_ROWS", 64)
    seen, target = table(500)
    size, lengths, noise, few = 2.0, np.linspace(1.0, 3.0, 5), 0.05, 40
    weights = growing_processes._fitted(seen, target[:, 0], seen[:few], (size, lengths, noise))
    bells = growing_processes._bells(seen / lengths, seen[:few] / lengths)
    inner = bells.T @ bells + noise / size * (bells[:few] + growing_processes._NUGGET * np.eye(few))
    assert bells @ weights == pytest.approx(bells @ np.linalg.solve(inner, bells.T @ target[:, 0]), abs=1e-6)


def test_a_block_is_predicted_by_the_weights_of_all_others() -> None:
    seen, target = table(200)
    centres, lengths, shares = seen[::5], np.linspace(1.0, 3.0, 5), (0.1, 1.0)
    wanted = []
    for share in shares:
        left = []
        for own in np.array_split(np.arange(200), growing_processes._FOLDS):
            others = np.setdiff1d(np.arange(200), own)
            weights = growing_processes._fitted(seen[others], target[others, 0], centres, (1.0, lengths, share))
            left.append(target[own, 0] - growing_processes._bells(seen[own] / lengths, centres / lengths) @ weights)
        wanted.append(float((np.concatenate(left) ** 2).sum()))
    assert growing_processes._unseen(seen, target[:, 0], centres, lengths, shares) == pytest.approx(wanted, rel=1e-6)


def test_turns_to_one_side_teach_a_symmetric_process_those_to_the_other() -> None:
    rng = np.random.default_rng(3)
    seen = rng.normal(size=(120, 5))
    seen[:, 2] = np.abs(seen[:, 2])
    wanted = np.column_stack([np.sin(seen[:, 0]), np.zeros(120), -np.tanh(seen[:, 2])])
    names = input_names(HULL, False)
    network = build("symmetric_gp", scaling_of(HULL, Standardisation(names, np.zeros(5), np.ones(5)), np.ones(3)))
    fit_tabular(network, as_table(seen, wanted), 0, 40)
    other = seen[:, [0, 1, 2, 4, 3]] * np.array([1.0, -1.0, -1.0, 1.0, 1.0])
    assert says(network, other)[:, 2] == pytest.approx(np.tanh(seen[:, 2]), abs=0.1)
    assert says(network, other)[:, 0] == pytest.approx(says(network, seen)[:, 0], abs=1e-5)


def test_what_only_time_tells_is_taken_for_noise() -> None:
    """A current that is not among the inputs pushes a slow boat slowly: neighbours in time look like a function."""
    time = np.linspace(0.0, 300.0, 900)
    seen = np.column_stack([np.sin((0.05 + 0.023 * k) * time + k) for k in range(5)])
    target = np.sin(0.031 * time + 0.7)
    kernel = growing_processes._kernel(seen[::3], target[::3])
    assert kernel[2] < 0.01, "for likelihood there is hardly any noise"
    size, _, noise = growing_processes._holding([kernel], seen, target, seen[::9])
    assert noise > 100.0 * kernel[2], "blocks that it does not know say otherwise"
    known, wanted = table()
    size, _, noise = growing_processes._holding([kernel], known, wanted[:, 0], known[:100])
    assert noise < 0.1 * size


@pytest.mark.parametrize("honest", [0, 1, 2])
def test_of_the_kernels_of_three_samples_that_is_kept_which_holds(honest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels of which two know nothing of what the target is like."""
    found, asked = growing_processes._kernel, []

    def kernel(rows: Array, target: Array) -> tuple[float, Array, float]:
        asked.append(rows)
        size, lengths, noise = (
            found(rows, target) if len(asked) % 3 == (honest + 1) % 3 else (1.0, np.full(5, 0.1), 0.1)
        )
        return size, lengths, noise

    monkeypatch.setattr(growing_processes, "_kernel", kernel)
    network = fitted(100, rows=1300)
    assert len(asked) == 2 * 3, "an axis with nothing to learn asks for none"
    assert not np.array_equal(asked[0], asked[1])
    assert all(len(rows) == 400 for rows in asked)
    lengths = 1.0 / np.asarray(network.state_dict()["sharpness"][:2])
    assert (lengths.max(axis=1) > 0.5).all()


def test_more_rows_than_centres_tell_more() -> None:
    rng = np.random.default_rng(10)
    asked = rng.normal(size=(2000, 5))
    truth = np.sin(2.0 * asked[:, 0]) + 0.3 * asked[:, 3]
    few, many = (np.sqrt(((says(fitted(100, rows=rows), asked)[:, 0] - truth) ** 2).mean()) for rows in (100, 4000))
    assert many < 0.5 * few


def test_fewer_rows_than_centres_are_enough_and_far_away_nothing_is_said() -> None:
    network = fitted(400, rows=50)
    assert says(network, table(50)[0])[:, :2].any(axis=1).all()
    far = np.full((1, 5), 1e4)
    assert not says(network, far).any()


def test_another_seed_draws_other_rows_and_the_same_seed_the_same() -> None:
    one, same, other = (fitted(50, seed).state_dict() for seed in (0, 0, 1))
    assert all(torch.equal(one[name], same[name]) for name in one)
    assert not torch.equal(one["centres"], other["centres"])


@pytest.mark.parametrize(
    ("choice", "parts"),
    [(Choice("gp", {"units": 100}), "Gaussian processes"), (Choice("ridge", {"filters": 2}), "coefficients")],
    ids=["gp", "ridge"],
)
def test_it_learns_what_the_nominal_model_lacks_and_is_plain_arrays(
    choice: Choice, parts: str, dragged: Split, tmp_path: Path
) -> None:
    found = train(dragged, HULL, choice, settings=SETTINGS)
    nominal = VehicleModel(HULL, "nominal")
    before, after = (acceleration_score(model, dragged.test).rmse for model in (nominal, found.model))
    assert (after[:2] < 0.5 * before[:2]).all()
    far, near = (rollout_scores(model, dragged.test)["10"].position for model in (nominal, found.model))
    assert near < 0.5 * far
    assert (len(found.epochs), found.stopped) == (1, f"all {parts} are fitted")
    motion = dragged.test.motions[0]
    again = load_network(save_network(found.model, tmp_path / "net", {}))
    assert np.array_equal(again.correction(motion), found.model.correction(motion))


@pytest.fixture
def lacking() -> Iterator[None]:
    """No scikit-learn."""
    with pytest.MonkeyPatch.context() as patch:
        for name in [name for name in sys.modules if name.partition(".")[0] == "sklearn"]:
            patch.setitem(sys.modules, name, None)
        yield


@pytest.mark.usefixtures("lacking")
@pytest.mark.parametrize(("name", "match"), [("gp", "gp needs scikit-learn"), ("trees", "trees need scikit-learn")])
def test_without_scikit_learn_it_is_told(dragged: Split, name: str, match: str) -> None:
    with pytest.raises(RequestError, match=rf"{match} \(.*\): .*pip install .*\[neural\]"):
        train(dragged, HULL, Choice(name), settings=SETTINGS)


def ridge(filters: int = 0) -> Network:
    names = input_names(HULL, False)
    scaling = scaling_of(HULL, Standardisation(names, np.zeros(5), np.full(5, 0.5)), np.ones(3))
    return build("ridge", scaling, {"filters": filters})


def wandering(rows: int = 3000, seed: int = 4) -> Array:
    """Standardised inputs that move slowly, as those of a boat do."""
    rng = np.random.default_rng(seed)
    time = 0.1 * np.arange(rows)[:, None]
    waves = [rng.normal(size=5) * np.sin(rng.uniform(0.05, 1.5, 5) * time + rng.uniform(0.0, 6.0, 5)) for _ in range(6)]
    return np.sum(waves, axis=0)


def test_a_ridge_finds_the_law_of_a_hull_among_its_products() -> None:
    """Quadratic drag, lift, and thrust that turning takes away, each in a noise of its own size."""
    seen = wandering()
    u, v, r, port, _ = 0.5 * seen.T
    law = np.column_stack([-2.0 * u * np.abs(u) + 0.5 * port, 3.0 * u * r - v, 0.4 * port * np.abs(r)])
    network = ridge()
    noise = np.random.default_rng(5).normal(0.0, 0.3, law.shape)
    fit_tabular(network, as_table(seen, law + noise), 0, EPOCHS)
    assert (np.sqrt(((says(network, 0.5 * seen) - law) ** 2).mean(axis=0)) < 0.03).all(), "a tenth of the noise"


def test_a_ridge_says_beyond_its_ranges_what_it_says_at_their_ends() -> None:
    seen = wandering()
    network = ridge()
    fit_tabular(network, as_table(seen, seen[:, :3] ** 3), 0, EPOCHS)
    ends = 0.5 * np.stack([seen.min(axis=0), seen.max(axis=0)])
    assert says(network, 4.0 * ends) == pytest.approx(says(network, ends), rel=1e-5)
    assert abs(says(network, ends)[1, 0]) > 1.0


def test_filters_find_what_the_past_does_in_each_motion_apart() -> None:
    """Sway that follows yaw after a second: of two motions the second begins anew."""
    seen, lengths = wandering(), (1700, 1300)
    late = []
    for some in np.split(0.5 * seen[:, 2], [lengths[0]]):
        state, share = some[0], 1.0 - np.exp(-0.1)
        for now in some:
            state += share * (now - state)
            late.append(now - state)
    wanted = np.column_stack([np.zeros(3000), late, np.zeros(3000)])
    left = {}
    for filters in (0, 4):
        network = ridge(filters)
        left[filters] = fit_tabular(network, Table(seen, wanted, lengths, 0.1), 0, EPOCHS)
        assert not says(network, 0.5 * seen)[:, [0, 2]].any(), "where nothing is to be learnt, nothing is said"
    assert left[4] < 1e-6 < left[0]


def test_blocks_are_predicted_by_the_coefficients_of_all_others() -> None:
    rng = np.random.default_rng(6)
    seen, wanted, penalties = rng.normal(size=(100, 4)), rng.normal(size=(100, 3)), np.array([0.1, 0.1, 1.0, 1.0])
    moments = growing_processes._Moments.of(seen, wanted)
    error = 0.0
    for own in np.array_split(np.arange(100), growing_processes._FOLDS):
        others = np.setdiff1d(np.arange(100), own)
        shrunk = seen[others].T @ seen[others] + 100 * np.diag(penalties)
        weights = np.linalg.solve(shrunk, seen[others].T @ wanted[others, 1])
        error += float(((wanted[own, 1] - seen[own] @ weights) ** 2).sum())
    assert moments.unseen(1, penalties) == pytest.approx(error)
    whole = np.linalg.solve(seen.T @ seen + 100 * np.diag(penalties), seen.T @ wanted[:, 1])
    assert moments.fitted(1, penalties) == pytest.approx(whole)
