"""The study of causes without a name: none of these worlds gets a false name, and the page counts what was said."""

import importlib
from collections.abc import Iterator
from types import ModuleType

import pytest
from places import ROOT


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("foreign_causes")


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
    record = study.judge(seed, study.CAUSES.index(cause))
    assert record["cause"] == cause
    assert record["false"] == []
    assert study.outcome(record) == "undecided"


def test_a_page_counts_what_was_said(study: ModuleType):
    setting = {"seed": 1, "programme": "rich", "noise": "field"}
    answer = {"unnamed": [], "rests": [], "back": False, "doubted": False, "changes": [], "terms": []}
    kink = {**setting, **answer, "cause": "drag with a kink", "true": []}
    told = [
        {**kink, "verdict": "undecided", "missing": [], "false": []},
        {**kink, "verdict": "missing", "missing": ["sway_lift"], "false": ["sway_lift"]},
        {**kink, "verdict": "nothing missing", "missing": [], "false": []},
        {**kink, "verdict": "missing", "missing": [], "false": [], "unnamed": ["surge:u^2"]},
        {**setting, "cause": "a hull that rolls", "true": [], "verdict": "refused", "told": "no heading"},
    ]
    covered = [{"told": True, "covered": True}, {"told": True, "covered": False}, {"told": False, "covered": False}]
    pair = {**setting, **answer, "cause": study.PAIR, "true": ["munk_moment", "sway_lift"], "verdict": "missing"}
    pair |= {"missing": ["sway_lift", "munk_moment"], "false": [], "terms": covered}
    page = study.page([*told, pair], "this")
    assert "**1 of 5 logs got a false name** (20.0%" in page
    assert "40.0% were told of the cause" in page
    assert "| drag with a kink | 4 | 1 | 0 | 1 | 1 | 1 | 0 | 0 |" in page
    assert "| a hull that rolls | 1 | 0 | 0 | 0 | 0 | 0 | 1 | 0 |" in page
    assert "- drag with a kink, seed 1 (rich, field): sway_lift" in page
    assert "hidden in 1 logs: in 1 exactly these" in page
    assert "Of the 2 intervals of those that were rightly named 1 hold the truth (50.0%" in page
