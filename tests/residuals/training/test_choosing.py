"""Which weights are kept: the first of the best that keep the laws, or what learnt to at states against them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from judging import BOX
from training_parts import HULL, fresh, parts_of

from undertow.comparison.audit import audit, witness_of
from undertow.measurements.preparation.split import Split
from undertow.physics.errors import RequestError
from undertow.physics.laws.audit.dissipation import Dissipation, Gains
from undertow.physics.laws.audit.thrust import PowerUnderThrust, driven_power
from undertow.physics.laws.damping_power import envelope_of
from undertow.physics.laws.energy import INSIDE, coasting_power, full_force, let_pass
from undertow.physics.motion import Array
from undertow.residuals.models.base import VehicleModel
from undertow.residuals.models.network_model import NetworkModel
from undertow.residuals.models.unforced_states import UnforcedStates
from undertow.residuals.scores import acceleration_score
from undertow.residuals.training.checkpoint import Verdict
from undertow.residuals.training.epochs import train
from undertow.residuals.training.history import Epoch, best_epochs
from undertow.residuals.training.trained import Trained
from undertow.residuals.training.training_settings import Choice, TrainingSettings

PURE = Choice("mlp", {"units": 16}, pure=True)
SHORT = TrainingSettings(epochs=6, learning_rate=1e-2)
SOME = np.array([[1.0, 0.1, 0.2, 0.0, 10.0, 10.0], [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]])
NONE = np.empty((0, 4))


@pytest.fixture(scope="module")
def dragged() -> Split:
    """A world with quadratic drag and lift that the nominal model lacks."""
    return parts_of({"surge_quadratic_damping": -10.0, "sway_lift": 20.0}, 60.0)


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two epochs between audits, not ten."""
    monkeypatch.setattr("undertow.residuals.training.epochs._MORE", 2)


def numbers(model: NetworkModel) -> bytes:
    return b"".join(value.numpy().tobytes() for value in model.network.state_dict().values())


class Auditor:
    """One who passes the model that he is asked as the `passes`th, and keeps what he was asked."""

    def __init__(self, passes: int, against: Array) -> None:
        self.passes, self.against = passes, against
        self.asked: list[bytes] = []

    def __call__(self, model: NetworkModel) -> Verdict:
        self.asked.append(numbers(model))
        return Verdict(len(self.asked) == self.passes, self.against)


def test_lawful_is_what_the_auditor_says(dragged: Split) -> None:
    second, nobody = Auditor(2, SOME), Auditor(0, NONE)
    found = train(dragged, HULL, PURE, settings=SHORT, auditor=second)
    order = best_epochs(list(found.epochs))
    assert (found.lawful, found.best_epoch, numbers(found.model)) == (True, order[1], second.asked[1])
    assert found.more == 0
    none = train(dragged, HULL, PURE, settings=SHORT, auditor=nobody)
    assert (none.lawful, none.best_epoch, numbers(none.model)) == (False, order[0], nobody.asked[0])
    assert (none.more, len(nobody.asked)) == (0, 5), "no state tells what is broken, so nothing is learnt"


def test_it_costs_nothing_where_the_first_audit_passes(dragged: Split) -> None:
    asked = Auditor(1, SOME)
    free = train(dragged, HULL, PURE, settings=SHORT)
    found = train(dragged, HULL, PURE, settings=SHORT, auditor=asked)
    assert (numbers(found.model), found.epochs) == (numbers(free.model), free.epochs)
    assert len(asked.asked) == 1


@pytest.mark.usefixtures("hasty")
def test_states_against_the_laws_are_learnt_until_the_auditor_passes(dragged: Split) -> None:
    seventh = Auditor(7, SOME)
    found = train(dragged, HULL, PURE, settings=SHORT, auditor=seventh)
    assert (found.lawful, found.more, found.best_epoch) == (True, 4, SHORT.epochs + 4)
    assert numbers(found.model) == seventh.asked[-1]
    assert [epoch.number for epoch in found.epochs] == list(range(1, SHORT.epochs + 5))
    assert found.price == found.epochs[-1].rmse / min(epoch.rmse for epoch in found.epochs) - 1.0


@pytest.mark.usefixtures("hasty")
def test_what_does_not_learn_them_is_left_as_it_was(dragged: Split) -> None:
    nobody = Auditor(0, SOME)
    found = train(dragged, HULL, PURE, settings=SHORT, auditor=nobody)
    assert (found.lawful, found.more, len(nobody.asked)) == (False, 10, 10)
    assert (found.best_epoch, numbers(found.model)) == (best_epochs(list(found.epochs[:6]))[0], nobody.asked[0])
    said = found.to_dict()
    assert (said["more"], said["price"]) == (10, found.price)
    blind = train(dragged, HULL, PURE, settings=replace(SHORT, lambda_phys=0.0), auditor=Auditor(0, SOME))
    assert blind.more == 0, "a loss that does not ask for the laws learns none"


def test_what_never_learnt_the_laws_is_told_of_them_and_kept_by_its_error(dragged: Split) -> None:
    nobody = Auditor(0, SOME)
    found = train(dragged, HULL, Choice("trees"), settings=replace(SHORT, trust=False), auditor=nobody)
    assert [epoch.number for epoch in found.epochs] == [1], "how far it counts is not for one part of the log to say"
    alone, own = (
        acceleration_score(model, dragged.validation).rmse for model in (VehicleModel(HULL, "alone"), found.model)
    )
    assert np.mean((own / alone) ** 2) < 1.0
    assert (found.best_epoch, found.lawful, len(nobody.asked)) == (1, False, 1)


class Fickle(Auditor):
    """One who meets states against the first model only, and nothing that he could tell of the others."""

    def __call__(self, model: NetworkModel) -> Verdict:
        verdict = super().__call__(model)
        return verdict if len(self.asked) == 1 else replace(verdict, against=NONE)


@pytest.mark.usefixtures("hasty")
def test_states_that_were_met_are_learnt_whoever_was_asked_last(dragged: Split) -> None:
    found = train(dragged, HULL, PURE, settings=SHORT, auditor=Fickle(6, SOME))
    assert (found.lawful, found.more) == (True, 2)


@pytest.mark.usefixtures("hasty")
def test_a_loss_that_is_not_finite_while_it_learns_them_leaves_all_as_it_was(
    dragged: Split, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*given: object) -> None:
        raise RequestError("training: the loss is nan")

    monkeypatch.setattr("undertow.residuals.training.epochs._Run.again", broken)
    nobody = Auditor(0, SOME)
    found = train(dragged, HULL, PURE, settings=SHORT, auditor=nobody)
    assert (found.lawful, numbers(found.model)) == (False, nobody.asked[0])


def searching(dragged: Split, seed: int) -> Callable[[NetworkModel], Verdict]:
    motions = (*dragged.train.motions, *dragged.validation.motions)
    box, laws = envelope_of(motions, HULL), (Dissipation(), PowerUnderThrust())

    def judged(model: NetworkModel) -> Verdict:
        found = audit(model, box, motions=motions, laws=laws, seed=seed)
        return Verdict(found.verdict == "pass", found.against)

    return judged


def test_a_network_learns_the_laws_where_the_search_found_it_against_them(dragged: Split) -> None:
    found = train(dragged, HULL, PURE, settings=SHORT, auditor=searching(dragged, 0))
    assert found.lawful
    assert found.more > 0
    assert searching(dragged, 1)(found.model).lawful, "another search finds nothing, either"


@pytest.mark.usefixtures("hasty")
def test_a_training_that_is_resumed_learns_the_same_states(dragged: Split, tmp_path: Path) -> None:
    def stop(epoch: Epoch) -> None:
        if epoch.number == SHORT.epochs + 3:
            raise InterruptedError

    def again(**more: object) -> Trained:
        return train(dragged, HULL, PURE, settings=SHORT, auditor=Auditor(7, SOME), **more)  # type: ignore[arg-type]

    whole = again()
    with pytest.raises(InterruptedError):
        again(folder=tmp_path, progress=stop)
    resumed = again(folder=tmp_path, resume=True)
    assert (numbers(resumed.model), resumed.epochs, resumed.more) == (numbers(whole.model), whole.epochs, 4)


def test_states_that_were_met_aim_inside_of_the_limit_with_thrust_too(dragged: Split) -> None:
    network = fresh("mlp", dragged, heading=True)
    states = np.random.default_rng(2).uniform([*BOX.lower, -3.0, -30.0, -30.0], [*BOX.upper, 3.0, 30.0, 30.0], (50, 6))
    how = {"pure": False, "heading": True, "time_step": 0.1, "settles": False, "like": next(network.parameters())}
    met = UnforcedStates(HULL, states[:, :4], states[:, 4:], **how)  # type: ignore[arg-type]
    witness = witness_of(NetworkModel(HULL, network, 0.1), BOX)
    power = coasting_power(witness.mass, states[:, :3], witness.relative(states[:, :4], states[:, 4:]))
    np.testing.assert_allclose(met.power(network).detach().numpy(), power, rtol=1e-6, atol=1e-6)
    allowed = np.maximum(driven_power(witness, states), witness.allowed(states))
    np.testing.assert_allclose(met.allowed.numpy(), allowed, rtol=1e-6)
    below = (1.0 - INSIDE) * let_pass(full_force(HULL), states[:, :3])
    np.testing.assert_allclose(met.aimed.numpy(), allowed - below, rtol=1e-6, atol=1e-9)
    assert met.penalty(network, torch.arange(50)) >= 0.0


def test_what_an_audit_met_against_the_laws_breaks_them_when_it_is_asked_again(dragged: Split) -> None:
    model = NetworkModel(HULL, fresh("mlp", dragged), 0.1, pure=True)
    found = audit(model, BOX, laws=(Dissipation(), PowerUnderThrust()))
    assert found.verdict == "fail"
    assert found.against.shape[1] == 6
    assert 20 < len(found.against) <= 2 * 128
    witness, states = witness_of(model, BOX), found.against
    power = coasting_power(witness.mass, states[:, :3], witness.relative(states[:, :4], states[:, 4:]))
    assert (power > np.maximum(driven_power(witness, states), witness.allowed(states))).all()
    quiet = [law for law in found.rulings if law.verdict == "pass"]
    assert all(law.against is None or not len(law.against) for law in quiet)


def test_of_many_states_the_worst_and_others_of_each_size_are_told() -> None:
    gained = np.arange(-500.0, 1000.0)
    found = Gains(gained[:, None], gained, np.zeros(1500)).against[:, 0]
    assert found[0] == 999.0
    assert (np.diff(found) == -8.0).all()
    assert len(found) <= 128
    assert found[-1] <= 8.0
