"""Throttle and steering in a channel map: mixed into two sides, with ArduPilot's limits, and written back."""

from pathlib import Path

import numpy as np
import pytest

from undertow.measurements.channels.channel_map import Entry, entries_of, map_text, mixed, read_channel_map
from undertow.measurements.log import Log
from undertow.physics.errors import LogError

TIME = np.arange(0.0, 5.0, 0.1)
LINES = {
    "normalized_port": {"from": "thr", "scale": 0.01, "mix": "skid", "steering": {"from": "str", "scale": 1 / 4500}},
    "normalized_stbd": {"from": "thr", "scale": 0.01, "mix": "skid", "steering": {"from": "str", "scale": 1 / 4500}},
}


def log(throttle: float, steering: float) -> Log:
    table = {"psi": 0.1 * TIME, "thr": np.full(TIME.size, throttle), "str": np.full(TIME.size, steering)}
    return Log.from_arrays(TIME, table, channel_map=LINES)


@pytest.mark.parametrize(
    ("throttle", "steering", "port", "stbd"),
    [
        (50.0, 0.0, 0.5, 0.5),
        (0.0, 2250.0, 0.5, -0.5),
        (30.0, -900.0, 0.1, 0.5),
        (100.0, 4500.0, 1.0, 0.0),
        (-100.0, 2250.0, -1 / 3, -1.0),
    ],
)
def test_both_give_way_alike_where_they_do_not_fit(throttle, steering, port, stbd):
    channels = log(throttle, steering).channels
    assert channels["normalized_port"].value == pytest.approx(np.full(TIME.size, port))
    assert channels["normalized_stbd"].value == pytest.approx(np.full(TIME.size, stbd))


def test_newtons_have_no_limit_and_pulses_their_own_neutral():
    one = np.ones(1)
    assert mixed("newton_stbd", (one, 40.0 * one), (one, 30.0 * one)) == pytest.approx([10.0])
    assert mixed("pwm_port", (one, 1700.0 * one), (one, 1400.0 * one)) == pytest.approx([1600.0])


def test_a_steering_holds_until_its_next_value():
    steering = (np.array([0.0, 1.0]), np.array([0.0, 0.4]))
    found = mixed("normalized_port", (np.array([-0.5, 0.5, 0.99, 1.0]), np.full(4, 0.2)), steering)
    assert found == pytest.approx([np.nan, 0.2, 0.2, 0.6], nan_ok=True)


def test_the_map_is_read_back_as_it_was_written(tmp_path: Path):
    entries = entries_of(Path("map"), LINES)
    (tmp_path / "map.yaml").write_text(map_text(entries))
    assert read_channel_map(tmp_path / "map.yaml") == entries
    assert map_text(log(1.0, 1.0).entries).count("mix: skid") == 2
    assert "str" not in log(1.0, 1.0).unused


@pytest.mark.parametrize(
    ("name", "line", "told"),
    [
        ("pwm_port", {"from": "thr", "mix": "skid"}, "needs both 'mix: skid' and 'steering: STREAM'"),
        ("pwm_port", {"from": "thr", "steering": "str"}, "needs both 'mix: skid' and 'steering: STREAM'"),
        ("pwm_port", {"from": "thr", "mix": "vee", "steering": "str"}, "got mix 'vee'"),
        ("pwm_1", {"from": "thr", "mix": "skid", "steering": "str"}, "its name tells no side"),
        ("u", {"from": "thr", "mix": "skid", "steering": "str"}, "its name tells no side"),
    ],
)
def test_half_a_mix_is_refused(name, line, told):
    with pytest.raises(LogError, match=told):
        entries_of(Path("map"), {name: line})


def test_an_entry_names_all_that_it_takes():
    assert Entry("thr", steering=Entry("str")).sources == ("thr", "str")
