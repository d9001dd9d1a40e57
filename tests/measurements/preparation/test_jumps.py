"""Positions that jump: found, told, and the log cut there; late fixes, spikes and noise are none."""

from pathlib import Path

import numpy as np
import pytest

from undertow.measurements.canonical import Channel
from undertow.measurements.inspection import inspect_log
from undertow.measurements.log import Log
from undertow.measurements.preparation.prepare import WEAK, prepare, usable_spans
from undertow.measurements.preparation.resampling import Jump, jumps_of, without_jumps

RATE, SECONDS, SPEED = 10.0, 120.0, 1.5


def run(rate: float = RATE, noise: float = 0.02) -> dict[str, Channel]:
    """A boat on a wide circle."""
    time = np.arange(0.0, SECONDS, 1.0 / rate)
    rng, psi = np.random.default_rng(1), 0.05 * time
    x, y = SPEED / 0.05 * np.sin(psi), SPEED / 0.05 * (1.0 - np.cos(psi))
    values = {"x": x + noise * rng.normal(size=time.size), "y": y + noise * rng.normal(size=time.size), "psi": psi}
    return {name: Channel(name, time, value, name) for name, value in values.items()}


def moved(channels: dict[str, Channel], begin: float, end: float, by: float) -> dict[str, Channel]:
    x = channels["x"]
    value = x.value + by * ((x.time >= begin - 1e-9) & (x.time < end - 1e-9))
    return {**channels, "x": Channel("x", x.time, value, "x")}


def log(channels: dict[str, Channel]) -> Log:
    return Log(Path("log.csv"), channels)


@pytest.mark.parametrize("rate", [1.0, 5.0, 20.0])
@pytest.mark.parametrize("by", [6.0, -60.0])
def test_a_jump_that_stays_is_found(rate, by):
    (jump,) = jumps_of(moved(run(rate), 50.0, np.inf, by))
    assert (jump.before, jump.after, jump.returns) == (pytest.approx(50.0 - 1.0 / rate), pytest.approx(50.0), False)
    assert jump.north == pytest.approx(by, abs=2.0 / rate + 0.2)


def test_an_excursion_is_one_jump_that_returns():
    (jump,) = jumps_of(moved(run(), 50.0, 53.0, 30.0))
    assert jump.returns
    assert (jump.before, jump.after) == (pytest.approx(49.9), pytest.approx(53.0))


def test_two_places_are_two_jumps():
    assert len(jumps_of(moved(moved(run(), 30.0, np.inf, 6.0), 80.0, np.inf, 9.0))) == 2


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.5, 2.0])
def test_a_sound_run_has_none(noise):
    assert jumps_of(run(noise=noise)) == ()


def test_a_single_false_value_is_a_spike_and_no_jump():
    assert jumps_of(moved(run(), 50.0, 50.1, 30.0)) == ()


def test_a_gap_is_no_jump():
    channels = run()
    keep = np.abs(channels["x"].time - 60.0) > 8.0
    cut = {name: Channel(name, c.time[keep], c.value[keep], name) for name, c in channels.items()}
    assert jumps_of(cut) == ()


def test_a_boat_that_mostly_drifts_may_go_fast_for_a_while():
    time = np.arange(0.0, 600.0, 0.2)
    x = np.cumsum(0.2 * np.where((time > 300.0) & (time < 330.0), 2.6, 0.01))
    assert jumps_of({name: Channel(name, time, value, name) for name, value in (("x", x), ("y", 0.1 * x))}) == ()


def test_the_log_is_cut_there_and_no_motion_crosses():
    jumping = log(moved(run(), 50.0, np.inf, 60.0))
    spans, notes = usable_spans(jumping, None, WEAK)
    assert [tuple(round(end, 1) for end in span) for span in spans] == [(0.0, 49.9), (50.0, SECONDS - 0.1)]
    assert any("the positions jump" in note and "cut there" in note for note in notes)
    speeds = np.concatenate([motion.velocity[:, 0] for motion in prepare(jumping, None, WEAK).motions])
    assert np.abs(speeds).max() < 2.0 * SPEED


def test_the_check_tells_it_and_the_fix_leaves_a_gap():
    jumping = log(moved(run(), 50.0, 53.0, 30.0))
    told = next(finding for finding in inspect_log(jumping).quality if finding.check == "jumps")
    assert told.verdict == "warning"
    assert "29.9 m at t = 49.90 s" in told.sentence
    assert "back after 3.1 s" in told.sentence
    assert told.fix is not None
    fixed = without_jumps(jumping.channels, jumps_of(jumping.channels))
    assert jumps_of(fixed) == ()
    assert not ((fixed["x"].time > 49.95) & (fixed["x"].time < 52.95)).any()
    assert len(usable_spans(log(fixed), None, WEAK)[0]) == 2


def test_a_jump_says_how_fast_it_is():
    assert "1200 m/s" in Jump(9.95, 10.0, 60.0, 0.0, 0.05).sentence
