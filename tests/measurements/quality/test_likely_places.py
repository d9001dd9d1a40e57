"""Thrusters that are likely reversed or swapped, in logs that are explained nearly as well otherwise."""

import numpy as np
import pytest

from undertow.measurements.log import read_log
from undertow.measurements.quality.checks import sides
from undertow.measurements.quality.checks.sides import SIDES
from undertow.measurements.quality.record import Finding, Record
from undertow.measurements.quality.response import Answer, Trial, Trials
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

AHEAD, ASTERN = (1.0, 0.01), (-1.0, 0.01)
LEFT = np.exp(np.random.default_rng(3).normal(0.0, 0.3, 20))
MORE = LEFT * np.exp(0.2 + np.random.default_rng(4).normal(0.0, 0.3, 20))
"""What two explanations leave in twenty stretches: the second somewhat more, by 1 chance in 100 to 1000."""


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Record:
    boat = load_vehicle("blueboat")
    path = simulate_world(boat, {}, duration=40.0, seed=2).write(tmp_path_factory.mktemp("log") / "log.csv")
    return Record.of(read_log(path))


def explained(seconds: float, left: np.ndarray, port: tuple[Answer, Answer]) -> Trial:
    return Trial(seconds, dict(zip(("newton_port", "newton_stbd"), port, strict=True)), left)


def judged(record: Record, monkeypatch: pytest.MonkeyPatch, best: Trial, *rivals: Trial) -> dict[str, Finding]:
    monkeypatch.setattr(sides, "trials", lambda records: [Trials(best, rivals)])
    monkeypatch.setattr(sides, "answers", lambda records: {})
    return {finding.check: finding for finding in SIDES.examine([record])}


RIGHT = (Answer(*AHEAD, *AHEAD), Answer(*AHEAD, *ASTERN))
TURNED = (Answer(*AHEAD, *AHEAD), Answer(*ASTERN, *AHEAD))
OTHER = (Answer(*ASTERN, *ASTERN), Answer(*AHEAD, *ASTERN))
CROSSED = (Answer(*AHEAD, *ASTERN), Answer(*AHEAD, *AHEAD))


def test_the_best_explanation_is_likely_where_others_are_surely_worse_but_not_ruled_out(
    record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = judged(record, monkeypatch, explained(0.0, LEFT, TURNED), explained(0.7, MORE, OTHER))
    assert (told["direction"].verdict, told["direction"].channels) == ("warning", ("newton_stbd",))
    assert "newton_stbd is likely reversed (99 % sure" in told["direction"].sentence
    assert "newton_stbd: {from: command:newton_stbd, scale: -1}" in told["direction"].remedy
    assert told["sides"].verdict == "cannot tell"
    crossed = judged(record, monkeypatch, explained(0.0, LEFT, CROSSED), explained(0.7, MORE, OTHER))
    assert crossed["sides"].short == "port and starboard are likely swapped"
    assert "newton_port: command:newton_stbd" in crossed["sides"].remedy


def test_an_explanation_that_is_no_better_is_not_named(record: Record, monkeypatch: pytest.MonkeyPatch) -> None:
    equal = LEFT * np.exp(np.random.default_rng(5).normal(0.0, 0.3, 20))
    for best, rival in ((0.0, explained(0.7, equal, OTHER)), (-1.1, explained(0.7, MORE, OTHER))):
        told = judged(record, monkeypatch, explained(best, LEFT, TURNED), rival)
        assert {finding.verdict for finding in told.values()} == {"cannot tell"}


def test_names_that_explain_a_log_best_are_believed(record: Record, monkeypatch: pytest.MonkeyPatch) -> None:
    told = judged(record, monkeypatch, explained(0.0, LEFT, RIGHT), explained(0.7, MORE, OTHER))
    assert {finding.verdict for finding in told.values()} == {"ok"}
