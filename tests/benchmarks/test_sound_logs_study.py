"""The study of sound logs: it draws sound runs, records them at several rates, and counts refusals by check."""

import importlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from places import ROOT

from undertow.measurements.canonical import command_kind
from undertow.measurements.inspection import examine
from undertow.measurements.log import Log
from undertow.measurements.quality.faults import Fault, Kind, Share, Size
from undertow.physics.vehicle import Vehicle


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        patch.delitem(sys.modules, "boats", raising=False)  # a page of the docs has a package of that name
        yield importlib.import_module("sound_logs")


@pytest.fixture(scope="module")
def worlds(study: ModuleType) -> ModuleType:
    return importlib.import_module("study.sound_worlds")


@pytest.mark.parametrize("number", [3, 5])
def test_logs_that_were_refused_once_are_not(study: ModuleType, number: int):
    """Full throttle, whose speeds turn quickly for 1 Hz, and a slow ship with noise of 1 cm/s and derived speeds."""
    record = study.judge(study.FIRST["tuning"], number)
    assert [log["rate"] for log in record["logs"]] == [50.0, 20.0, 10.0, 5.0, 2.0, 1.0]
    assert [log["refused"] for log in record["logs"]] == [{}] * 6
    assert all(log["sizes"] for log in record["logs"])


def changed(log: Log, **values: np.ndarray) -> Log:
    return replace(log, channels=log.channels | {n: replace(log.channels[n], value=v) for n, v in values.items()})


def deviating(log: Log) -> Log:
    """By twelve degrees on east, and by none on north; speeds are made of positions and of this heading."""
    psi = log.channels["psi"].value
    return changed(log, psi=psi - np.radians(12.0) * np.sin(psi))


def asleep(log: Log) -> Log:
    """The gyro for half a minute, from its fastest turn on."""
    rate = log.channels["r"]
    first = int(np.argmax(np.abs(rate.value)))
    sleeps = (rate.time >= rate.time[first]) & (rate.time < rate.time[first] + 30.0)
    return changed(log, r=np.where(sleeps, rate.value[first], rate.value))


def late(log: Log) -> Log:
    """The commands by 0.4 s."""
    moved = {n: replace(c, time=c.time + 0.4) for n, c in log.channels.items() if command_kind(n)}
    return replace(log, channels=log.channels | moved)


def of_another(log: Log) -> Log:
    """The heading of a boat that goes to and fro."""
    return changed(log, psi=2.0 * np.sin(0.05 * log.channels["psi"].time))


def frozen(log: Log) -> Log:
    """The thruster at starboard, from the middle of the log on."""
    command = log.channels["newton_stbd"].value
    middle = command.size // 2
    return changed(log, newton_stbd=np.where(np.arange(command.size) < middle, command, command[middle]))


def early(log: Log) -> Log:
    """The commands by 3.5 s."""
    moved = {n: replace(c, time=c.time - 3.5) for n, c in log.channels.items() if command_kind(n)}
    return replace(log, channels=log.channels | moved)


def standing(log: Log) -> Log:
    """All commands, from the middle of the log on."""
    values = {n: c.value for n, c in log.channels.items() if command_kind(n)}
    return changed(log, **{n: np.where(np.arange(v.size) < v.size // 2, v, v[v.size // 2]) for n, v in values.items()})


def logged(worlds: ModuleType, seed: int, turn: int, rate: float) -> tuple[Log, Vehicle]:
    run = worlds.drawn(seed - seed % 10_000, seed % 10_000)
    return worlds.recorded(run.log, turn)[rate], run.vehicle


def accusing(log: Log, vehicle: Vehicle) -> set[str]:
    return {f.check for f in examine(log, vehicle).findings if f.verdict in ("defect", "warning")}


Spoilt = tuple[int, int, float, str, Callable[[Log], Log]]
"""Seed, turn and rate of a log, the check that accused it, and what spoils a log so that this check should."""


@pytest.mark.parametrize(
    "spoilt",
    [
        (360_374, 413, 10.0, "compass", deviating),  # a slow ship, which drifts on after her turns
        (360_260, 299, 20.0, "stuck", asleep),  # a rudder that turns back at one rate: the yaw rate ends at once
        (360_384, 423, 20.0, "clocks", late),  # commands in step with the rows, and a vehicle without damping
        (360_409, 448, 1.0, "units", of_another),  # a boat that turns all round between two rows of its track
        (400_332, 332, 10.0, "drive", frozen),  # waves that push and turn a ship as one thruster would
    ],
)
def test_logs_that_were_accused_once_are_not_and_the_fault_is_told_where_it_is(
    study: ModuleType, worlds: ModuleType, spoilt: Spoilt
):
    seed, turn, rate, check, spoil = spoilt
    log, vehicle = logged(worlds, seed, turn, rate)
    assert check not in accusing(log, vehicle)
    assert check in accusing(spoil(log), vehicle)


@pytest.mark.parametrize(
    "spoilt",
    [
        (390_278, 317, 2.0, "drive", standing),  # noise that gains speed and loses it in a steady turn
        (390_372, 411, 10.0, "clocks", early),  # steps so smooth that four seconds of delay explain their answer
    ],
)
def test_logs_that_show_little_are_not_accused_and_a_lively_one_that_is_spoilt_is(
    study: ModuleType, worlds: ModuleType, spoilt: Spoilt
):
    seed, turn, rate, check, spoil = spoilt
    assert check not in accusing(*logged(worlds, seed, turn, rate))
    log, vehicle = logged(worlds, 240_000, 0, 10.0)
    assert check not in accusing(log, vehicle)
    assert check in accusing(spoil(log), vehicle)


def test_one_side_is_saturated_while_the_other_steers(worlds: ModuleType):
    boat, log, _ = worlds.full_throttle(0, 7, np.random.default_rng(7))
    ends = np.array([max(thruster.curve.command) for thruster in boat.thrusters])
    saturated = np.isclose(log.commands, ends).mean(axis=0)
    assert saturated.max() > 0.5
    assert saturated.min() < 0.5


def test_a_run_is_recorded_as_its_number_says(worlds: ModuleType):
    boat, log, _ = worlds.calm(0, 7, np.random.default_rng(7))
    whole = worlds.in_memory(log)
    for number, names, together in ((0, "xyuvr", False), (3, "uvr", True), (4, "xyr", False)):
        logs = worlds.recorded(whole, number)
        for rate, one in logs.items():
            assert set("xyuvr") & set(one.channels) == set(names)
            assert one.channels["r"].period == pytest.approx(1.0 / rate, rel=0.02)
            command = one.channels[boat.thrusters[0].channel]
            assert (command.time is one.channels["r"].time or np.array_equal(command.time, one.channels["r"].time)) is (
                together
            )


def test_sizes_of_faults_are_noted_told_or_not():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "benchmarks"))
        study = importlib.import_module("study.noted_faults")
    before = Fault.ruled
    with study.noted() as faults:
        silent = Fault(Kind.EXCHANGED, ("u", "v"), Size(Share(0.1, 0.05), Share(0.9, 0.0)))
        assert silent.ruled() is None
    assert faults == [silent]
    assert study.sure_sizes(faults) == {"EXCHANGED": pytest.approx(0.05)}
    assert Fault.ruled is before


def test_a_refusal_is_counted_and_told(study: ModuleType):
    log = {
        "rate": 10.0,
        "format": "ULog",
        "refused": {"drive": "it is wrong"},
        "accused": {"drive": "it is wrong"},
        "sizes": {"CUT": 0.3},
        "likely": {"CUT": 0.6},
    }
    record = {"number": 4, "kind": "calm", "what": "rich", "logs": [log]}
    text = study.page([record], "python benchmarks/sound_logs.py")
    assert "**1 of 1 sound logs of 1 runs were refused**" in text
    assert "| drive | 1 | 100.00% (< 100.00%) | 0 |" in text
    assert "| cut | limited | 1 | 0.30 | 0.60 |" in text
    assert "**1 of 1 logs that were drawn were accused.**" in text
    assert "- number 4 at 10 Hz (calm, rich), drive REFUSED: it is wrong" in text
    assert study.most_refused([record]) == 1.0
    slow, outside = {**log, "refused": {}, "accused": {"rates": "1 Hz"}}, {**record, "kind": "BlueBoat on a lake"}
    assert [study.accused_drawn([one]) for one in (record, {**record, "logs": [slow]}, outside)] == [[log], [], []]
