"""How far a correction reaches beyond its training is what the calm and the lively part of its log say."""

from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest
import torch
from training_parts import HULL, fresh, parts_of

from undertow.measurements.preparation.dataset import DataSet
from undertow.measurements.preparation.split import Split
from undertow.physics.errors import RequestError
from undertow.physics.matrices import mass_matrix
from undertow.physics.motion import Motion
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.networks.fade import NARROW
from undertow.residuals.training import epochs
from undertow.residuals.training.epochs import train
from undertow.residuals.training.reaching import Reaching, Why, calm_part, probe_settings, reaching
from undertow.residuals.training.training_settings import Choice, TrainingSettings

SHORT = TrainingSettings(epochs=2)
PUSH = 6.0
"""What is missing [N], the same everywhere: what is learnt of a calm part holds wherever the boat goes."""


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


@pytest.mark.parametrize(("times", "why"), [(1.0, Why.HOLDS), (-1.0, Why.HOLDS_NOT), (0.0, Why.HOLDS_NOT)])
def test_a_correction_reaches_as_far_as_a_probe_was_right(pushed: Split, times: float, why: Why) -> None:
    found = reaching(pushed, HULL, 10.0, lambda part: saying(part, times))
    assert found.why is why
    assert (found.calm, found.tried > NARROW) == (0.5, True)
    assert found.fade == pytest.approx(4.0 * found.tried if why is Why.HOLDS else NARROW)
    if why is Why.HOLDS:
        assert found.wide < 0.3 < found.narrow < 1.0
    assert f"{found.tried:.2g} deviations beyond" in found.sentence
    assert found.to_dict()["why"] == why.value


def test_the_farthest_trial_that_holds_decides(pushed: Split) -> None:
    known: list[float] = []

    def probe(part: Split) -> NetworkModel:
        known.append(part.train.seconds / pushed.train.seconds)
        return saying(part, 1.0 if len(known) > 1 else -1.0)

    found = reaching(pushed, HULL, 10.0, probe)
    assert known == pytest.approx([0.5, 0.75], abs=0.07)
    assert (found.why, found.calm) == (Why.HOLDS, 0.75)
    first = reaching(pushed, HULL, 10.0, lambda part: saying(part, 1.0))
    assert found.tried < first.tried


def test_the_calm_part_keeps_away_from_the_ends_of_what_is_shown(pushed: Split) -> None:
    (motion,) = pushed.train.motions
    odd = (np.arange(motion.time.size) // 100 % 2 == 1)[:, None]  # the others stay in the middle of all that is shown
    mixed = replace(
        motion,
        velocity=np.where(odd, motion.velocity, np.ptp(motion.velocity, axis=0) / 2.0 + motion.velocity.min(axis=0)),
        commands=np.where(odd, motion.commands, np.ptp(motion.commands, axis=0) / 2.0 + motion.commands.min(axis=0)),
    )
    calm = calm_part(cut(pushed.train, mixed), HULL, 10.0, 0.5)
    assert calm is not None
    assert [m.time[[0, -1]].tolist() for m in calm.motions] == [
        motion.time[[k, k + 99]].tolist() for k in (0, 200, 400, 600)
    ]
    assert calm.unfiltered is not None
    assert [m.time.tolist() for m in calm.unfiltered] == [m.time.tolist() for m in calm.motions]
    whole = calm_part(pushed.train, HULL, 10.0, 1.0)
    assert whole is not None
    assert [m.time.size for m in whole.motions] == [motion.time.size], "neighbours are one motion"


def test_a_log_that_tries_nothing_leaves_the_narrow_fade(pushed: Split) -> None:
    def never(part: Split) -> NetworkModel:
        raise AssertionError

    (motion,) = pushed.train.motions
    short = replace(pushed, train=cut(pushed.train, motion.slice(0, 790)))
    assert reaching(short, HULL, 10.0, never) == Reaching(NARROW, Why.UNTRIED)
    pieces = tuple(motion.slice(k, k + 50) for k in range(0, 800, 50))
    assert reaching(replace(pushed, train=cut(pushed.train, *pieces)), HULL, 10.0, never).why is Why.UNTRIED
    roomless = reaching(replace(pushed, train=cut(pushed.train, *pieces)), HULL, 2.0, lambda part: saying(pushed, 1.0))
    assert roomless == Reaching(NARROW, Why.UNTRIED), "no rollout of 10 s fits"
    still = replace(motion, velocity=0.0 * motion.velocity, commands=0.0 * motion.commands + 1500.0)
    even = reaching(replace(pushed, train=cut(pushed.train, still)), HULL, 10.0, lambda part: saying(part, 1.0))
    assert even == Reaching(NARROW, Why.UNTRIED)
    assert "too short or too even" in even.sentence
    assert even.to_dict() == {"fade": 0.5, "why": "untried"}


def cut(data: DataSet, *motions: Motion) -> DataSet:
    """The same with other motions."""
    return replace(data, motions=motions, unfiltered=motions)


@pytest.mark.parametrize("name", ["mlp", "lstm", "trees", "gp"])
def test_every_network_asks_its_log_and_says_what_it_heard(pushed: Split, name: str, tmp_path: Path) -> None:
    found = train(pushed, HULL, Choice(name), settings=SHORT, folder=tmp_path)
    assert found.reaching is not None
    assert found.model.far == found.reaching.fade
    assert found.settings.fade is None
    assert found.to_dict()["reaching"] == found.reaching.to_dict()
    other = replace(SHORT, learning_rate=0.1)  # a probe of such steps would say another thing
    again = train(pushed, HULL, Choice(name), settings=other, folder=tmp_path, resume=True)
    assert again.reaching == found.reaching
    (motion,) = pushed.test.motions
    np.testing.assert_array_equal(again.model.correction(motion), found.model.correction(motion))


def test_a_fade_that_is_given_is_not_asked_for(pushed: Split, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> Reaching:
        raise AssertionError

    monkeypatch.setattr(epochs, "reaching", refused)
    given = train(pushed, HULL, Choice("mlp"), settings=replace(SHORT, fade=1.5))
    assert (given.reaching, given.model.far) == (None, 1.5)
    assert "reaching" not in given.to_dict()
    pure = train(pushed, HULL, Choice("mlp", pure=True), settings=SHORT)
    assert (pure.reaching, pure.model.fades) == (None, False)
    begun = train(pushed, HULL, Choice("mlp", start=given.model), settings=SHORT)
    assert begun.reaching == Reaching(NARROW, Why.BEGUN)
    assert begun.model.far == NARROW


def test_where_the_probe_does_not_hold_weights_are_those_of_a_narrow_fade(
    pushed: Split, monkeypatch: pytest.MonkeyPatch
) -> None:
    narrow = train(pushed, HULL, Choice("mlp"), settings=replace(SHORT, fade=NARROW)).model
    monkeypatch.setattr("undertow.residuals.training.reaching.least_share", lambda errors, independent: 0.0)
    asked = train(pushed, HULL, Choice("mlp"), settings=SHORT)
    assert asked.reaching is not None
    assert asked.reaching.why is Why.HOLDS_NOT
    for one, other in zip(asked.model.network.parameters(), narrow.network.parameters(), strict=True):
        assert torch.equal(one, other)


def test_a_probe_is_short_and_says_all_that_it_has_learnt() -> None:
    assert probe_settings(TrainingSettings()) == TrainingSettings(epochs=40, fade=0.0, shrink=False)
    assert probe_settings(SHORT).epochs == 2


@pytest.mark.parametrize("fade", [-0.5, nan])
def test_a_fade_below_nothing_is_refused(fade: float) -> None:
    with pytest.raises(RequestError, match="expected fade of 0 or more"):
        TrainingSettings(fade=fade)


def test_the_push_is_what_the_vehicle_lacks(pushed: Split) -> None:
    """The worlds above are what they are said to be: what is measured is pushed, the vehicle is not."""
    (motion,) = pushed.train.motions
    apart = saying(pushed, 1.0).acceleration(motion) - VehicleModel(HULL, "alone").acceleration(motion)
    assert apart[:, 0] == pytest.approx(PUSH / mass_matrix(HULL)[0, 0], rel=1e-5)


def test_where_no_probe_can_be_trained_the_fade_is_narrow(pushed: Split) -> None:
    def fails(part: Split) -> NetworkModel:
        raise RequestError("the loss is nan")

    found = reaching(pushed, HULL, 10.0, fails)
    assert found == Reaching(NARROW, Why.FAILED)
    assert "no probe could be trained" in found.sentence


@pytest.mark.parametrize("said", [{"why": "holds"}, {"fade": 1.0, "why": "nothing"}, {"fade": 1.0, "other": 2.0}])
def test_a_file_that_does_not_say_where_it_fades_is_refused(said: dict[str, object]) -> None:
    with pytest.raises(RequestError, match="does not say where its correction fades"):
        Reaching.of(said)
