"""What a fold judges was selected and fitted without it, and a name that needs one part of a log is less sure."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from undertow.discovery.add_effects import add_effects
from undertow.discovery.balance.base import WeakSettings
from undertow.discovery.balance.weak_form import WeakForm
from undertow.discovery.basis import DiscoverySettings, choose_balance
from undertow.discovery.candidates.candidate import candidates, measurable
from undertow.discovery.candidates.linearisation import Linearisation
from undertow.discovery.discover import find_missing
from undertow.discovery.findings import Folds
from undertow.discovery.search.floating import Search, WithoutFold
from undertow.discovery.search.gram import GramScores
from undertow.measurements.preparation.split import folds_of
from undertow.physics.motion import Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.discover_and_add import add, discover
from undertow.workflows.inputs import read_inputs

HULL = load_vehicle("blueboat")


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate_world(HULL, {"surge_quadratic_damping": -8.0}, duration=120.0, noise="field", seed=4).motion()


def test_scores_without_a_fold_are_those_of_the_other_rows_alone(motion: Motion):
    form, pool = WeakForm([motion], WeakSettings()), candidates(HULL, measurable([motion]))[:6]
    linear = Linearisation(form, HULL, HULL, pool, ())
    weight, fold = np.ones(3), folds_of([motion])[1]
    seen = form.outside(fold)
    inside = (form.time > fold.stretches[0][1]) & (form.time < fold.stretches[0][2])
    assert not seen[inside].any()
    found = GramScores(linear.columns, linear.noise, form.block, weight).seeing(
        seen, linear.columns, linear.noise, form.block
    )
    alone = GramScores(linear.columns[seen], linear.noise[:, seen], form.block[seen], weight)
    chosen = [options[1] for options in linear.options.values()]
    assert found.tests == seen.sum()
    assert found.fit(chosen).change == pytest.approx(alone.fit(chosen).change, rel=1e-6)
    assert found.fit(chosen).in_sample == pytest.approx(alone.fit(chosen).in_sample, rel=1e-6)


def test_each_fold_finds_the_effect_again_with_a_number_of_its_own(motion: Motion):
    found = find_missing([motion], HULL)
    assert found.findings.folds is not None
    assert found.findings.folds.to_dict() == {
        "count": 4,
        "same_names": 4,
        "named": {"surge_quadratic_damping": 4},
    }
    values = [vehicle.value("X_uu") for vehicle in found.unseen.steps[-1]]
    assert len({*values, found.corrected.value("X_uu")}) == 5
    assert values == pytest.approx([found.corrected.value("X_uu")] * 4, rel=0.1)


@pytest.mark.parametrize(
    ("hidden", "symbol"),
    [({"thruster_lag": 0.5}, "lag"), ({"thrust_dead_zone": 0.15}, "dead_zone"), ({"input_delay": 0.4}, "delay")],
)
def test_what_has_a_shape_comes_out_of_every_fold(hidden: dict[str, float], symbol: str):
    """A lag cannot be seen beside what takes it out of the columns."""
    world = simulate_world(HULL, hidden, duration=240.0, noise="field", seed=3)
    found = find_missing([world.motion()], HULL)
    (name,), (value,) = hidden, hidden.values()
    assert found.findings.missing == (name,)
    assert found.findings.folds is not None
    assert found.findings.folds.named[name] == 4
    assert [v.value(symbol) for v in found.unseen.steps[-1]] == pytest.approx([value] * 4, abs=0.05)


def test_a_number_of_which_a_fold_shows_nothing_keeps_its_null_there():
    """Astern commands stand in the last quarter alone."""
    hidden = {"reverse_thrust_loss": 0.5}
    first = simulate_world(HULL, hidden, duration=120.0, noise="field", seed=5).motion()
    rich = simulate_world(HULL, hidden, duration=40.0, noise="field", seed=6).motion()
    only_ahead = replace(first, commands=np.maximum(first.commands, 0.0), run_up=None)
    added = add_effects([only_ahead, rich], HULL, ["reverse_thrust_loss"], DiscoverySettings())
    assert added.unseen.steps[-1][-1].value("reverse_scale") == 1.0


def test_folds_are_those_of_the_whole_log_where_rollouts_judge(motion: Motion):
    """What is too short for a rollout is in no search, but its rows are judged."""
    ends = [*range(0, 21, 3), 120]
    rows = [round(end / motion.time_step) for end in ends]
    pieces = [motion.slice(first + 2, last) for first, last in pairwise(rows)]
    basis = choose_balance(pieces, HULL, DiscoverySettings()).with_rollouts("rollouts judge")
    assert len(basis.balance().motions) == 1
    added = add_effects(pieces, HULL, ["surge_quadratic_damping"], DiscoverySettings(), basis)
    assert added.unseen.folds == folds_of(pieces)


def test_without_the_only_fold_with_commands_a_model_stays_as_it_was():
    """Rollouts without a command are not laid, so that none is left to fit to."""
    driven = simulate_world(HULL, {"surge_quadratic_damping": -8.0}, duration=240.0, noise="field", seed=4).motion()
    later = driven.time > driven.time[0] + 48.0
    idle = replace(driven, commands=np.where(later[:, None], 0.0, driven.commands))
    basis = choose_balance([idle], HULL, DiscoverySettings()).with_rollouts("rollouts judge")
    added = add_effects([idle], HULL, ["surge_quadratic_damping"], DiscoverySettings(), basis)
    first, *others = (vehicle.value("X_uu") for vehicle in added.unseen.steps[-1])
    assert first == HULL.value("X_uu")
    assert others == pytest.approx([added.corrected.value("X_uu")] * 3, rel=1e-3)
    name = "surge_quadratic_damping"
    pool = [candidate for candidate in basis.pool if candidate.key in (name, "surge_linear_damping")]
    search = Search(basis.balance(), HULL, pool, DiscoverySettings().search)
    state = search.evaluate(added.corrected, [name])
    linear, scores = search.linearise(state.vehicle, state.active)
    blind = WithoutFold(search, added.unseen.folds[0])
    chosen, found = blind.choose(linear, blind.seen(linear, scores), state)
    assert not any(option.present for option in chosen.values())
    assert found == [name], "the rest of the log shows too little to speak against it"


def test_a_delay_is_fitted_without_a_fold_as_it_is_with_all():
    """The offset of the record, which is the same in the forces, is in no model with a delay."""
    delays = (0.5, 0.2, 0.2, 0.2)
    logs = [
        replace(simulate_world(HULL, {"input_delay": d}, duration=60.0, seed=k).motion(), source=f"{k}.csv")
        for k, d in enumerate(delays)
    ]
    added = add_effects(logs, HULL, ["input_delay"], DiscoverySettings())
    without_the_first = added.unseen.steps[-1][0]
    assert without_the_first.value("delay") == pytest.approx(0.2, abs=0.01)


def test_folds_tell_how_many_of_them_find_an_effect():
    told = Folds(count=4, same_names=1, named={"surge_trim": 4, "cg_offset": 1})
    begun = "The search was repeated 4 times, each time with a different part of the log left out: "
    means = " A name that hangs on one part of the log is less sure."
    found = f"{begun}it found surge trim each time and cg offset once"
    assert told.in_words(True) == f"{found}, and just the names that stand here once.{means}"
    assert told.but(same_names=0).in_words(True) == f"{found}.{means}"
    lost = told.but(same_names=0, named={"surge_trim": 4, "cg_offset": 0})
    assert lost.in_words(True) == f"{begun}it found surge trim each time, but never cg offset.{means}"
    never = told.but(same_names=0, named={"cg_offset": 0})
    assert never.in_words(True) == f"{begun}it found none of these names.{means}"
    same = "Repeated 4 times without a part of the log, the search found the same names."
    assert told.but(same_names=4).in_words(True) == same
    assert told.in_words(False) == f"{begun}it found surge trim 4 times and cg offset once."
    assert told.but(named={}).in_words(False) == f"{begun}it found no name that stands."


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> str:
    world = simulate_world(HULL, {"surge_quadratic_damping": -8.0}, duration=60.0, noise="field", seed=9)
    return str(world.write(tmp_path_factory.mktemp("folds") / "log.csv"))


def test_all_rows_are_judged_and_all_are_fitted_where_folds_judge(log: str):
    run = discover(read_inputs(log, HULL))
    assert run.comparison.split == "folds"
    assert run.inputs.parts.judged.seconds == pytest.approx(60.0, abs=2.0)
    assert sum(m.duration for m in run.inputs.fitting) == pytest.approx(60.0, abs=2.0)
    assert run.findings.data.split.startswith("4 folds")
    assert "10" in run.findings.steps[-1].rollout_rmse
    aside = discover(read_inputs(log, HULL, judge="test"))
    assert aside.comparison.split == "test"
    assert aside.inputs.parts.judged.seconds < 10.0
    assert aside.findings.folds is not None
    assert not aside.findings.folds.models


def test_the_held_out_error_of_an_added_effect_is_that_of_fits_without_each_fold(log: str):
    run = add(["surge_quadratic_damping"], read_inputs(log, HULL))
    assert run.findings.folds is not None
    assert (run.findings.folds.same_names, run.findings.folds.in_words(True)) == (None, "")
    values = [v.value("X_uu") for v in run.discovery.unseen.steps[-1]]
    assert len(set(values)) == 4
    before, after = (step.acceleration_rmse.surge for step in run.findings.steps)
    assert after < 0.8 * before


def test_a_wake_that_remembers_is_fitted_in_every_fold():
    """A guess at another shape of what stands is no option of a fold: it does not take out what stands."""
    world = simulate_world(HULL, {"wake_memory": (20.0, 4.0, 1.2)}, duration=150.0, noise="field", seed=3)
    found = find_missing([world.motion()], HULL)
    assert found.findings.missing == ("wake_memory",)
    for vehicle in found.unseen.steps[-1]:
        told = [vehicle.value(symbol) for symbol in ("memory_sway", "memory_yaw", "memory_time")]
        assert told == pytest.approx([20.0, 4.0, 1.2], rel=0.1)
