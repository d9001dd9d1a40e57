"""A term that a person adds is weighed: one that is there betters unseen rows, one that is not cannot be told."""

import pytest

from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.workflows.inputs import read_inputs
from undertow.workflows.log_view import LogView
from undertow.workflows.workbench import Workbench
from undertow.workflows.workbench_facts import ModelChoice

HULL = load_vehicle("blueboat")
THERE, NOT_THERE = "surge:u|u|", "sway:u|v|"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Workbench:
    path = tmp_path_factory.mktemp("log") / "log.csv"
    simulate_world(HULL, {"surge_quadratic_damping": -8.0}, duration=200.0, noise="field", seed=3).write(path)
    return Workbench(LogView(read_inputs(path, HULL, progress=None)))


def test_a_term_that_is_there_betters_unseen_rows(bench: Workbench):
    card = bench.weigh(ModelChoice((THERE,)), THERE)
    assert card.verdict == "betters unseen rows"
    assert "less in the speeds predicted over 10 s" in card.sentence
    (number,) = card.numbers
    (value,) = bench.fit(ModelChoice((THERE,))).values
    assert value.ci95 is not None
    assert value.ci95[0] <= -8.0 <= value.ci95[1]
    assert number.startswith(f"{THERE} = ")
    assert "95 %" in number


def test_a_term_that_is_not_there_is_not_told_to_be(bench: Workbench):
    card = bench.weigh(ModelChoice((THERE, NOT_THERE)), NOT_THERE)
    assert card.verdict == "cannot tell"
    assert card.name == NOT_THERE


def test_numbers_that_were_moved_do_not_count(bench: Workbench):
    moved = ModelChoice((THERE,), moved=((THERE, -40.0),))
    assert bench.weigh(moved, THERE) == bench.weigh(ModelChoice((THERE,)), THERE)
