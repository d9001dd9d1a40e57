"""Inspection: what is in a log, whether its channels are in step, and what would be done with it."""

import json
from pathlib import Path

import numpy as np
import pytest
from places import shared

from undertow.measurements.canonical import Channel
from undertow.measurements.inspection import align, inspect_log
from undertow.measurements.log import Log, read_log
from undertow.measurements.statistics.signals import noise_level
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

TIME = 0.05 * np.arange(2401, dtype=float)
TWIN = load_vehicle("blueboat")


def wandering(time):
    return np.sin(0.5 * time) + 0.6 * np.sin(1.3 * time + 1) + 0.3 * np.sin(2.9 * time)


def log(late=0.0, noise=0.0, **changes):
    generator = np.random.default_rng(3)
    rate = 0.3 * wandering(TIME - late)
    fine = np.linspace(0, TIME[-1], 40 * TIME.size)
    psi = np.interp(TIME, fine, np.cumsum(0.3 * wandering(fine)) * (fine[1] - fine[0]))
    values = {
        "psi": psi,
        "u": 1.0 + 0.2 * np.sin(TIME),
        "v": 0.1 * np.cos(TIME),
        "r": rate,
        "newton_port": 10.0 + 0 * TIME,
        "newton_stbd": 10.0 + 0 * TIME,
    } | changes
    channels = {
        name: Channel(name, TIME, value + noise * generator.normal(size=TIME.size), name)
        for name, value in values.items()
        if value is not None
    }
    return Log(Path("made.csv"), channels, ("a note",), ("spare",))


def test_the_machine_view_is_strict_json():
    content = inspect_log(log(), TWIN).to_dict()
    assert content["schema"] == "undertow.inspection/1"
    again = json.loads(json.dumps(content, allow_nan=False))
    assert again["notes"] == ["a note"]
    assert again["unused"] == ["spare"]
    assert again["plan"]["missing"] == []
    assert again["plan"]["segments"] == [{"start": 0.0, "end": pytest.approx(120.0), "rows": 1201}]
    first = again["channels"][0]
    assert (first["name"], first["unit"], first["count"]) == ("psi", "rad", 2401)
    assert first["rate"] == pytest.approx(20.0)


@pytest.mark.parametrize("late", [-0.22, 0.0, 0.13])
@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_a_late_gyro_is_found_to_a_fraction_of_a_sample(late, noise):
    (turning,) = inspect_log(log(late, noise)).alignment
    assert turning.offset == pytest.approx(late, abs=0.02)
    assert ("in step" in turning.sentence) == (late == 0.0)


def test_a_wrong_sign_and_a_dead_sensor_are_told():
    (turning,) = inspect_log(log(r=-0.3 * wandering(TIME))).alignment
    assert turning.offset is None
    assert "has the opposite sign" in turning.sentence
    (turning,) = inspect_log(log(r=0 * TIME)).alignment
    assert "never changes" in turning.sentence
    generator = np.random.default_rng(0)
    other = align("a", "b", (generator.normal(size=800), generator.normal(size=800)), 0.05)
    assert other.offset is None
    assert "do not follow each other" in other.sentence


def test_noise_is_measured_and_motion_is_not_noise():
    generator = np.random.default_rng(5)
    assert noise_level(wandering(TIME) + 0.015 * generator.normal(size=TIME.size)) == pytest.approx(0.015, rel=0.1)
    assert (noise_level(wandering(TIME)) or 0.0) < 1e-3
    assert noise_level(TIME[:5]) is None


def test_excitation_says_what_the_log_cannot_tell():
    excitation = inspect_log(log(r=0.3 + 0 * TIME, psi=0.3 * TIME)).excitation
    assert excitation is not None
    assert excitation.astern == 0.0
    assert excitation.turning_to_starboard == 1.0
    assert excitation.u == pytest.approx((0.8, 1.2), abs=1e-3)
    assert len(excitation.sentences) == 2
    assert "to starboard only" in excitation.sentences[1]
    still = inspect_log(log(r=0 * TIME, psi=0 * TIME)).excitation
    assert still is not None
    assert "hardly turned" in still.sentences[-1]


def test_what_is_missing_is_reported_and_not_raised():
    nothing = inspect_log(log(psi=None), TWIN)
    assert nothing.excitation is None
    assert nothing.alignment == ()
    assert "expected a heading" in nothing.plan.missing[0]
    command = inspect_log(log(newton_port=None), TWIN)
    assert "missing command channel newton_port" in command.plan.missing[0]
    assert command.excitation is not None
    short = log()
    cut = {name: Channel(name, TIME[:200], c.value[:200], name) for name, c in short.channels.items()}
    assert "at least 20 s" in inspect_log(Log(short.path, cut), TWIN).plan.missing[0]
    only = Log(Path("one.csv"), {"newton_port": short.channels["newton_port"]})
    assert json.dumps(inspect_log(only, TWIN).to_dict(), allow_nan=False)


def test_gaps_are_counted():
    whole = log()
    u = whole.channels["u"]
    keep = (TIME < 30) | (TIME > 32)
    whole.channels["u"] = Channel("u", u.time[keep], u.value[keep], "u")
    summary = {channel.name: channel for channel in inspect_log(whole).channels}["u"]
    assert summary.gaps == 1
    assert summary.longest_gap == pytest.approx(2.05, abs=0.06)
    assert len(inspect_log(whole).plan.segments) == 2


def test_the_field_logs_are_out_of_step_as_their_notes_say():
    turning = inspect_log(read_log(shared("blueboat") / "log_231.csv")).alignment[0]
    assert turning.offset is not None
    assert 0.04 < turning.offset < 0.15


def test_an_inspection_shows_itself_as_a_card(tmp_path: Path):
    path = simulate_world(TWIN, {}, duration=60.0, seed=3).write(tmp_path / "log.csv")
    shown = repr(inspect_log(read_log(path)))
    assert shown.splitlines()[0] == "Inspection"
    assert len(shown) < 2000
    assert "verdict" in shown
