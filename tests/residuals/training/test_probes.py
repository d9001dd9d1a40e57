"""Parts of a log that probes do not know, in time and in the space of states, and what they say of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from training_parts import HULL, fresh, parts_of

from undertow.measurements.preparation.split import Split
from undertow.physics.errors import RequestError
from undertow.physics.momentum_balance import mass_matrix
from undertow.physics.vehicle import Vehicle
from undertow.residuals.models.network_inputs import network_inputs
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.networks.registry import build
from undertow.residuals.training import best_kind
from undertow.residuals.training.best_kind import KINDS, Candidate, best_of, candidates, name_of
from undertow.residuals.training.epochs import probe_settings, train
from undertow.residuals.training.probes import (
    HeldOutPart,
    Probe,
    Probed,
    held_out_parts,
    predict_held_out,
    rollout_ratio_of,
    train_probes,
    trust_of,
)
from undertow.residuals.training.training_settings import Choice, TrainingSettings

SHORT = TrainingSettings(epochs=2)
PUSH = 6.0
"""What is missing [N], the same everywhere: what is learnt of a part holds wherever the boat goes."""


@pytest.fixture(scope="module")
def pushed() -> Split:
    """A world with a push ahead that the nominal model lacks."""
    return parts_of({"surge_trim": PUSH})


def saying(split: Split, times: float) -> NetworkModel:
    """A perceptron that says so many times the push, wherever it is."""
    network = fresh("mlp", split).float()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.zero_()
        network.head.bias[0] = times * PUSH / mass_matrix(HULL)[0, 0] / 0.1  # type: ignore[union-attr, index]
    return NetworkModel(HULL, network, 0.1)


def test_logs_whose_clocks_start_alike_tell_of_different_stretches(pushed: Split) -> None:
    (motion,) = pushed.train.motions
    logs = replace(pushed.train, motions=tuple(replace(motion, source=name) for name in ("one.csv", "two.csv")))
    tried = predict_held_out(saying(pushed, 1.0), pushed.train, logs)
    assert len({one.stretch for one in tried}) == len(tried) == 2 * len(np.unique(motion.time // 10.0))


def test_every_row_is_held_out_once_in_time_and_the_ends_of_states_once_more(pushed: Split) -> None:
    (motion,) = pushed.train.motions
    found = held_out_parts(pushed.train, HULL, 10.0)
    blocks, regions = found[:3], found[3:]
    assert ([part.block for part in blocks], [part.block for part in regions]) == ([True] * 3, [False] * 3)
    asked = np.concatenate([m.time for part in blocks for m in part.held_out.motions])
    assert sorted(asked.tolist()) == motion.time.tolist()
    for part in found:
        both = np.concatenate([m.time for some in (part.known, part.held_out) for m in some.motions])
        assert sorted(both.tolist()) == motion.time.tolist(), "what is not asked is known, and nothing is both"
        assert part.known.unfiltered is not None
        assert [m.time.tolist() for m in part.known.unfiltered] == [m.time.tolist() for m in part.known.motions]

    def reach(some: object) -> float:
        rows = np.concatenate([network_inputs(HULL, m, False) for m in some.motions])  # type: ignore[attr-defined]
        every = network_inputs(HULL, motion, False)
        return float(np.abs((rows - every.mean(axis=0)) / every.std(axis=0)).max())

    calm = regions[0]
    assert reach(calm.known) < reach(calm.held_out)


def test_a_log_that_is_too_short_is_not_parted(pushed: Split) -> None:
    (motion,) = pushed.train.motions
    short = replace(pushed.train, motions=(motion.slice(0, 790),), unfiltered=None)
    assert held_out_parts(short, HULL, 10.0) == []
    pieces = tuple(motion.slice(k, k + 50) for k in range(0, 800, 50))
    assert held_out_parts(replace(pushed.train, motions=pieces, unfiltered=None), HULL, 10.0) == []


@pytest.mark.parametrize(
    ("times", "gain", "ratio"), [(1.0, 1.0, (0.0, 0.25)), (2.0, 0.5, (0.0, 0.25)), (-1.0, 0.0, (1.0, 1.0))]
)
def test_a_correction_counts_by_what_probes_were_right_in(
    pushed: Split, times: float, gain: float, ratio: tuple[float, float]
) -> None:
    found = train_probes(pushed, held_out_parts(pushed.train, HULL, 10.0), lambda part: saying(part, times))
    trust = trust_of(saying(pushed, times), pushed, found)
    near, tried, ended = trust.gain(np.array([0.0, 0.5 * trust.reaches[-2], trust.reaches[-1]]))[:, 0]
    assert (near, tried) == pytest.approx((gain, gain), abs=0.1), "a push is the same everywhere"
    assert ended == 0.0
    assert trust.error[0].max() < 0.1
    least, most = ratio
    assert least <= rollout_ratio_of(found)[0] <= most + 1e-9


def test_a_vehicle_that_knows_what_probes_learn_is_held_against_them(pushed: Split) -> None:
    found = train_probes(pushed, held_out_parts(pushed.train, HULL, 10.0), lambda part: saying(part, 0.5))
    knows = HULL.with_values({"surge_trim": PUSH})
    assert rollout_ratio_of(found)[0] < 0.9
    assert rollout_ratio_of(found, knows)[0] > 1.0, "such as one that changes by the minute"


def test_probes_that_cannot_be_trained_tell_nothing(pushed: Split) -> None:
    def fails(part: Split) -> NetworkModel:
        raise RequestError("training: the loss is nan")

    found = train_probes(pushed, held_out_parts(pushed.train, HULL, 10.0), fails)
    assert found.parts == ()
    assert rollout_ratio_of(found) == (1.0, np.inf)
    own = trust_of(saying(pushed, 1.0), pushed, found)
    assert own.gain(np.zeros(()))[0] == pytest.approx(1.0, abs=0.05), "the validation part tells of the network itself"


def test_a_probe_has_few_epochs_and_is_said_whole() -> None:
    assert probe_settings(TrainingSettings(), "mlp") == TrainingSettings(epochs=20, trust=False)
    assert probe_settings(SHORT, "mlp") == replace(SHORT, trust=False)
    assert probe_settings(SHORT, "gp") == replace(SHORT, epochs=1, trust=False)


def test_the_same_log_gives_the_same_gain(pushed: Split) -> None:
    one, other = (train(pushed, HULL, Choice("mlp", {"units": 8}), settings=SHORT).model for _ in range(2))
    assert one.network.gain is not None
    assert other.network.gain is not None
    assert np.array_equal(one.network.gain.trust.weights, other.network.gain.trust.weights)


def test_the_kind_is_that_whose_probes_err_least(pushed: Split) -> None:
    few, told = replace(SHORT, epochs=20), []
    kinds = (Choice("mlp", {"units": 8}), Choice("gp", {"units": 60}))
    found = candidates(pushed, HULL, few, kinds, told.append)
    assert told == ["mlp --option units=8", "gp --option units=60"]
    assert [len(one.probes.parts) for one in found] == [6, 6], "blocks of time and regions of states, each three"
    first, second = (one.ratio * np.exp(one.error) for one in found)
    assert first <= second
    assert found[0].ratio < 0.5, "a push that lasts is learnt by either"
    whole = train(pushed, HULL, replace(found[0].choice, probes=found[0].probes), settings=few).model
    anew = train(pushed, HULL, found[0].choice, settings=few).model
    assert np.allclose(whole.network.gain.trust.weights, anew.network.gain.trust.weights)  # type: ignore[union-attr]
    (motion,) = pushed.train.motions
    short = replace(pushed, train=replace(pushed.train, motions=(motion.slice(0, 400),), unfiltered=None))
    with pytest.raises(RequestError, match="no kind of network could be tried"):
        candidates(short, HULL, few, kinds)


@pytest.mark.parametrize(
    ("ratio", "error", "learnable", "holds"),
    [(0.98, 0.1, True, True), (0.98, 0.1, False, False), (0.8, 0.1, False, True), (1.0, 0.0, True, False)],
)
def test_where_no_more_than_noise_is_left_parts_have_to_be_sure(
    ratio: float, error: float, learnable: bool, holds: bool
) -> None:
    assert Candidate(Choice("gp"), ratio, error, Probed()).holds(learnable=learnable) is holds


def test_the_page_names_the_kinds_that_are_tried() -> None:
    page = (Path(__file__).parents[3] / "docs" / "neural.md").read_text(encoding="utf-8")
    told = page.partition("**The best kind.**")[2].partition("\n\n")[0].replace("\n", " ")
    assert [name_of(kind) for kind in KINDS] == ["symmetric_gp", "gp", "gp --heading", "ridge --option filters=4"]
    assert "`symmetric_gp`, `gp`, with and without heading, and `ridge --option filters=4`" in told


def test_a_kind_that_holds_is_taken_before_a_better_one_that_does_not() -> None:
    loud, calm = (Candidate(Choice("gp"), *numbers, Probed()) for numbers in ((0.8, 0.15), (0.905, 0.04)))
    assert best_of([loud, calm], learnable=True) is loud
    assert best_of([loud, calm], learnable=False) is calm
    assert best_of([loud], learnable=False) is None


def test_in_the_time_that_is_given_others_are_raced_against_the_best(
    pushed: Split, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ratios are made up: what a kind errs depends on its units alone, the less the better."""

    def ratio(found: Probed, alone: Vehicle | None = None) -> tuple[float, float]:
        units = float(found.parts[0].model.network.options.get("units", 99))
        return (abs(units - 2.0) + 1.0) / 10.0, 0.0

    def probes(split: Split, vehicle: Vehicle, choice: Choice, settings: object, parts: list[HeldOutPart]) -> Probed:
        asked.append(name_of(choice))
        network = build(choice.network, fresh("mlp", split).scaling, choice.options)
        return Probed((Probe(NetworkModel(HULL, network, 0.1), parts[0], ()),))

    asked: list[str] = []
    monkeypatch.setattr(best_kind, "rollout_ratio_of", ratio)
    monkeypatch.setattr(best_kind, "probes_of", probes)
    begun = Choice("gp", {"units": 8})
    found = candidates(pushed, HULL, replace(SHORT, minutes=1.0), [begun])
    assert [one.choice.options for one in found] == [{"units": 2}, {"units": 4}, {"units": 8}]
    parts = {name: asked.count(name) for name in asked}
    assert parts["gp --option units=16"] == 2, "it errs more than the best on the first two parts"
    assert parts["gp --option units=4"] == parts["gp --option units=2"] == len(found[0].probes.parts) == 6
    assert [part.block for _, part, _ in found[0].probes.parts] == [True] * 3 + [False] * 3
    asked.clear()
    assert [one.choice for one in candidates(pushed, HULL, replace(SHORT, minutes=1e-9), [begun])] == [begun]
    assert set(asked) == {"gp --option units=8"}, "no time is left for another"
    asked.clear()
    candidates(pushed, HULL, replace(SHORT, minutes=1.0), [begun, Choice("mlp", {"units": 9})])
    assert {"trees", "lstm", "tcn", "symmetric"} <= set(asked), "of several kinds, other networks are tried, too"


def test_moves_change_the_size_or_one_setting_of_the_recipe() -> None:
    network = Candidate(Choice("mlp"), 0.5, 0.1, Probed(), {"rollout_rows": 20})
    names = [name_of(*move) for move in best_kind._moves(network, TrainingSettings())]
    assert names[:2] == [f"mlp --option units={units} --set rollout_rows=20" for units in (256, 64)]
    assert "mlp --set rollout_rows=20 --set learning_rate=0.03" in names
    assert "mlp --set rollout_rows=0" in names
    ridge = Candidate(Choice("ridge", {"filters": 4}), 0.5, 0.1, Probed())
    moves = best_kind._moves(ridge, TrainingSettings())
    assert [name_of(*move) for move in moves] == ["ridge --option filters=6", "ridge --option filters=2"]
