"""The study of causes without a name: none of these worlds gets a false name."""

import importlib
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest
from places import ROOT

from undertow.physics.vehicle import load_vehicle


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("study.foreign_logs")


@pytest.mark.parametrize(
    ("cause", "seed"),
    [
        ("strips of cross-flow", 9000),  # four effects about another origin, and an antenna there
        ("strips of cross-flow", 9002),  # an antenna with a centre of gravity that moves farther
        ("a wall near by", 9003),  # more damping is asked for than physics allows, and a trim beside it
        ("thrust that ends early", 9005),  # a scale and a power, where rollouts prefer a free curve
        ("drag with a kink", 12001),  # linear and quadratic drag, and a kink between two knots
        ("a propeller that is hit", 12002),  # a weak thruster, and a rest of the colour of its thrust
        ("a propeller that is hit", 12011),
    ],
)
def test_a_stand_in_is_no_name(study: ModuleType, cause: str, seed: int):
    record = importlib.import_module("study.verb").answer(study.nameless(cause, seed))
    assert (record["kind"], record["nameless"]) == (cause, True)
    assert importlib.import_module("study.scoring").false_names(record) == []


def test_each_cause_says_what_its_force_follows(study: ModuleType):
    forces = importlib.import_module("study.foreign_forces")
    hull = load_vehicle("blueboat")
    assert set(forces.causes(hull, np.random.default_rng(0))) == set(forces.FOLLOWS)
    signals = {"u", "v", "r", "thrust", "time", "heading", "place"}
    for text in (*forces.FOLLOWS.values(), *study.FORCES.values()):
        axes, follows = zip(*(word.split(":") for word in text.split()), strict=True)
        assert set(axes) <= {"surge", "sway", "yaw"}
        assert set(follows) <= signals
