"""What is looked at of a long log: bounded, spread over it, fair to idle time, and cheap."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from undertow.measurements.canonical import Channel
from undertow.measurements.inspection import inspect_log
from undertow.measurements.log import Log
from undertow.measurements.quality import record as portion
from undertow.measurements.quality.record import PART, WHOLE, longest, looked_at

HOUR = 3600.0


def log_of(hours: float, rate: float, idle_until: float = 0.0) -> Log:
    """A boat that weaves to and fro, and lies idle up to a time [h]."""
    time = np.arange(round(hours * HOUR * rate)) / rate
    lively = np.where(time < idle_until * HOUR, 0.0, 1.0)
    noise = 0.002 * np.random.default_rng(0).normal(size=(6, time.size))
    u, r = lively * (0.8 + 0.7 * np.sin(0.11 * time)), lively * 0.4 * np.sin(0.37 * time)
    psi = np.cumsum(r) / rate
    x, y = np.cumsum(u * np.cos(psi)) / rate, np.cumsum(u * np.sin(psi)) / rate
    port, starboard = lively * np.sign(np.sin(0.11 * time)), lively * np.sign(np.sin(0.37 * time))
    values = {"x": x, "y": y, "psi": psi, "u": u, "v": 0.0 * u, "r": r}
    values = {name: value + each for (name, value), each in zip(values.items(), noise, strict=True)}
    values |= {"newton_port": 20.0 * port, "newton_stbd": 20.0 * starboard}
    return Log(Path("long.csv"), {name: Channel(name, time, value, name) for name, value in values.items()})


def test_a_log_of_up_to_three_hours_is_looked_at_whole():
    spans = [(0.0, 0.6 * WHOLE), (0.7 * WHOLE, 1.0 * WHOLE)]
    assert [one.span for one in looked_at(log_of(3.3, 1.0), spans)] == spans
    assert longest(spans) == spans


def test_a_long_log_is_looked_at_in_parts_spread_over_it():
    spans = [(0.0, 2.0 * HOUR), (2.5 * HOUR, 20.0 * HOUR)]
    found = looked_at(log_of(20.0, 1.0), spans)
    length = np.array([high - low for low, high in (one.span for one in found)])
    weight = np.array([one.weight for one in found])
    begins = np.array([one.span[0] for one in found])
    assert PART * 0.9 < length.sum() < PART * 1.2
    assert np.diff(begins).max() < HOUR
    assert all(any(low <= one.span[0] and one.span[1] <= high for low, high in spans) for one in found)
    assert weight @ length == pytest.approx(19.5 * HOUR)
    assert found[-1].span[1] == 20.0 * HOUR
    assert not found[-1].cut
    assert all(one.cut for one in found[1:-1] if one.span[1] != 2.0 * HOUR)


def test_idle_time_is_looked_at_little_and_counts_in_full():
    found = looked_at(log_of(10.0, 1.0, idle_until=8.0), [(0.0, 10.0 * HOUR)])
    idle = [one for one in found if one.span[1] <= 8.0 * HOUR]
    seconds = sum(one.span[1] - one.span[0] for one in idle)
    assert 0.0 < seconds < 0.5 * PART
    assert sum(one.weight * (one.span[1] - one.span[0]) for one in idle) == pytest.approx(8.0 * HOUR, rel=0.01)


def test_an_inspection_tells_shares_of_the_whole_time_and_that_it_saw_a_part(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(portion, "WHOLE", 0.5 * HOUR)
    monkeypatch.setattr(portion, "PART", 0.4 * HOUR)
    inspection = inspect_log(log_of(5.0, 2.0, idle_until=4.0))
    excitation = inspection.excitation
    assert excitation is not None
    assert excitation.seconds == pytest.approx(5.0 * HOUR, rel=1e-3)
    assert excitation.turning_to_port == pytest.approx(0.2 * 0.46, rel=0.1)
    assert inspection.notes[-1].startswith("of 5.0 h of motion, ")


def test_inspecting_a_longer_log_takes_at_most_twice_what_its_table_has_more(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(portion, "WHOLE", 1200.0)
    monkeypatch.setattr(portion, "PART", 600.0)
    table, peak = [], []
    for hours in (2.0, 4.0):
        log = log_of(hours, 20.0)
        rows = log.channels["u"].time.size
        table.append(sum(channel.value.nbytes for channel in log.channels.values()) + 8 * rows)
        tracemalloc.start()
        inspect_log(log)
        peak.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peak[1] - peak[0] < 2.0 * (table[1] - table[0])
    assert peak[0] < 150e6, "what is looked at is bounded"
