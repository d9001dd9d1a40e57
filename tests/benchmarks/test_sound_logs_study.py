"""The study of sound logs: it draws logs that are sound, judges what every verb would read, and counts honestly."""

import importlib
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest
from places import ROOT

from undertow.physics.errors import LogError


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("sound_logs")


@pytest.mark.parametrize("number", [3, 5, 11])
def test_logs_that_were_refused_once_are_not(study: ModuleType, number: int):
    """Full throttle, a slow ship at 10 Hz with noise of 1 cm/s, and a ship without noise."""
    record = study.judge(study.FIRST["tuning"], number)
    assert (record["refused"], record["accused"], record["corrected"]) == ("", [], [])


def test_one_side_is_saturated_while_the_other_steers(study: ModuleType):
    boat, log, _ = study.full_throttle(0, 7, np.random.default_rng(7))
    ends = np.array([max(thruster.curve.command) for thruster in boat.thrusters])
    saturated = np.isclose(log.commands, ends).mean(axis=0)
    assert saturated.max() > 0.5
    assert saturated.min() < 0.5


def test_a_refusal_is_counted_and_told(study: ModuleType, monkeypatch: pytest.MonkeyPatch):
    def refuse(path, vehicle, *, progress):
        raise LogError(f"{path}: it is wrong. Nothing found in such logs is about the boat.")

    monkeypatch.setattr(study, "read_inputs", refuse)
    record = study.judge(study.FIRST["tuning"], 0)
    assert record["refused"] == "it is wrong. "
    text = study.page([record], "python benchmarks/sound_logs.py")
    assert "**1 of 1 sound logs were refused**" in text
    assert "| calm | 1 | 1 | 0 | 0 |" in text
