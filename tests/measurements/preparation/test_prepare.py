"""Preparation: the even time base, commands by area, gaps, what is derived, and every refusal."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ROOT, shared

from undertow.measurements.canonical import Channel
from undertow.measurements.log import Log, read_log
from undertow.measurements.preparation.prepare import PAPER, WEAK, Recipe, prepare
from undertow.measurements.preparation.resampling import even_grid, is_logged_on_change, segments
from undertow.physics.vehicle import load_vehicle

TWIN = load_vehicle("blueboat")


def make(time, path="made.csv", **channels):
    """A log of channels that are functions of time, or (time, value) pairs."""
    made = {}
    for name, content in channels.items():
        stamps, value = (time, content(time)) if callable(content) else content
        made[name] = Channel(name, np.asarray(stamps, float), np.asarray(value, float), name)
    return Log(Path(path), made)


def circle(time, path="made.csv", **changes):
    """A steady turn to starboard, 1.5 m/s ahead and 0.2 m/s to port, closed form."""
    rate, u, v = 0.2, 1.5, -0.2
    channels = {
        "x": lambda t: (u * np.sin(rate * t) + v * np.cos(rate * t)) / rate,
        "y": lambda t: (-u * np.cos(rate * t) + v * np.sin(rate * t)) / rate,
        "psi": lambda t: (rate * t + np.pi) % (2 * np.pi) - np.pi,
        "u": lambda t: u + 0 * t,
        "v": lambda t: v + 0 * t,
        "r": lambda t: rate + 0 * t,
        "newton_port": lambda t: 10.0 + 0 * t,
        "newton_stbd": lambda t: 5.0 + 0 * t,
    }
    channels |= changes
    return make(time, path, **{name: content for name, content in channels.items() if content is not None})


TIME = 0.05 * np.arange(1201, dtype=float)


def test_native_rate_gives_back_the_samples_and_paper_rate_ten_hertz():
    log = circle(TIME)
    data = prepare(log, TWIN, WEAK)
    (motion,) = data.motions
    np.testing.assert_allclose(motion.time, TIME)
    np.testing.assert_allclose(motion.position[:, 0], log.channels["x"].value)
    np.testing.assert_allclose(motion.heading, 0.2 * TIME, atol=1e-12)
    np.testing.assert_allclose(motion.commands, np.tile([10.0, 5.0], (TIME.size, 1)))
    assert motion.thrusters == ("port", "stbd")
    assert (data.rows, data.seconds, data.raw) == (1201, pytest.approx(60.0), data.motions)
    paper = prepare(log, TWIN)
    assert paper.recipe is PAPER
    assert paper.motions[0].time_step == pytest.approx(0.1)
    assert paper.raw is not paper.motions


def test_native_rate_is_capped_and_the_slowest_log_sets_it():
    fast, slow = circle(0.01 * np.arange(3001), "fast.csv"), circle(0.1 * np.arange(301), "slow.csv")
    assert prepare(fast, TWIN, WEAK).motions[0].time_step == pytest.approx(0.05)
    data = prepare([fast, slow], TWIN, WEAK)
    assert [motion.time_step for motion in data.motions] == pytest.approx([0.1, 0.1])
    assert [Path(motion.source).name for motion in data.motions] == ["fast.csv", "slow.csv"]
    assert any("differ in rate" in note for note in data.notes)


def test_what_is_missing_is_derived_with_a_note():
    whole = prepare(circle(TIME), TWIN, WEAK).motions[0]
    data = prepare(circle(TIME, u=None, v=None, r=None), TWIN, WEAK)
    inner = slice(1, -1)
    np.testing.assert_allclose(data.motions[0].velocity[inner], whole.velocity[inner], atol=1e-4)
    assert any("u: not in the log, derived from x, y and psi" in note for note in data.notes)
    data = prepare(circle(TIME, x=None, y=None), TWIN, WEAK)
    moved = whole.position - whole.position[0]
    np.testing.assert_allclose(data.motions[0].position, moved, atol=1e-3)
    assert any("position: not in the log, derived from u, v and psi" in note for note in data.notes)


def test_a_gap_cuts_and_nothing_is_interpolated_across_it():
    there = (TIME < 25.0) | (TIME > 28.0)
    late = TIME[there]
    log = circle(TIME, u=(late, np.where(late < 26, 1.0, 9.0)))
    data = prepare(log, TWIN, WEAK)
    first, second = data.motions
    assert first.time[-1] <= 25.0
    assert second.time[0] >= 28.0
    assert set(np.concatenate([motion.velocity[:, 0] for motion in data.motions])) == {1.0, 9.0}
    assert any("u: 1 gaps, the longest 3.10 s at t = 24.95 s" in note for note in data.notes)
    derived = prepare(replace(log, channels={k: c for k, c in log.channels.items() if k not in "vr"}), TWIN, WEAK)
    assert len(derived.motions) == 2
    assert len(prepare(log, TWIN, Recipe(rate=None, cutoff=None, max_gap=4.0)).motions) == 1


def test_derivatives_do_not_look_across_a_gap():
    there = (TIME < 25.0) | (TIME > 28.0)
    late = TIME[there]
    jump = np.where(late < 26, late, late + 100.0)
    log = circle(TIME, u=None, v=None, psi=lambda t: 0 * t, r=None, x=(late, jump), y=(late, 0 * late))
    for motion in prepare(log, TWIN, WEAK).motions:
        np.testing.assert_allclose(motion.velocity, np.tile([1.0, 0.0, 0.0], (motion.time.size, 1)), atol=1e-9)


def test_single_dropouts_are_bridged_and_short_stretches_dropped():
    keep = np.ones(TIME.size, bool)
    keep[100::7] = False
    data = prepare(circle(TIME[keep]), TWIN, WEAK)
    assert len(data.motions) == 1
    there = (TIME < 2.0) | (TIME > 3.0)
    data = prepare(circle(TIME[there]), TWIN, WEAK)
    assert len(data.motions) == 1
    assert any("1 stretches under 5 s dropped" in note for note in data.notes)


def test_commands_logged_on_change_are_held_and_their_silence_is_no_gap():
    stamps = [0.0, 3.1, 4.0, 15.2, 17.0, 40.0]
    log = circle(TIME, newton_port=(stamps, [0.0, 5.0, 9.0, 3.0, 8.0, 1.0]))
    assert is_logged_on_change(log.channels["newton_port"])
    assert not is_logged_on_change(circle(TIME).channels["newton_port"])
    data = prepare(log, TWIN, WEAK)
    (motion,) = data.motions
    assert motion.commands[-1, 0] == 1.0
    assert motion.commands[np.searchsorted(motion.time, 10.0), 0] == 9.0
    assert any("newton_port: logged on change (6 samples), held" in note for note in data.notes)


def test_the_period_averages_jitter_and_ignores_gaps():
    time = TIME + np.random.default_rng(0).uniform(-0.02, 0.02, TIME.size)
    assert circle(time[(time < 20) | (time > 24)]).channels["u"].period == pytest.approx(0.05, rel=5e-3)
    assert make(np.array([0.0, 1.0, 101.0]), u=lambda t: t).channels["u"].period == 50.5
    assert make(np.array([3.0]), u=lambda t: t).channels["u"].period == 0.0


def test_segments_and_grids():
    assert segments(0.0, 5.0, [(-2.0, -1.0), (0.0, 1.0), (4.5, 9.0)]) == [(1.0, 4.5)]
    assert segments(0.0, 5.0, [(-1.0, 6.0)]) == []
    np.testing.assert_allclose(even_grid(np.array([0.3, 0.4]), (0.25, 0.6), 0.1), [0.3, 0.4, 0.5, 0.6])


def deg(t):
    return np.rad2deg((0.2 * t + np.pi) % (2 * np.pi) - np.pi)


REFUSED = {
    "no heading": ({"psi": None}, r"expected a heading \(psi or a quaternion\), got only x y u v r"),
    "no velocity": ({"u": None, "x": None}, "but u and a position are missing"),
    "heading in degrees": ({"psi": deg}, "psi .* must be in radians, but it jumps by 360"),
    "slow heading in degrees": (
        {"psi": lambda t: 57.3 * np.sin(0.1 * t), "r": lambda t: 0.1 * np.cos(0.1 * t)},
        "psi is in degrees",
    ),
    "yaw rate in degrees": (
        {"psi": lambda t: np.sin(0.1 * t), "r": lambda t: 5.73 * np.cos(0.1 * t)},
        "r is in degrees per second",
    ),
    "no command": (
        {"newton_stbd": None},
        "missing command channel newton_stbd of thruster 'stbd'; commands in the log",
    ),
    "another kind of command": (
        {"newton_port": None, "pwm_port": lambda t: 1500 + 0 * t},
        r"wrong command kind: the vehicle wants newton_port \[N\] for thruster 'port', the log has pwm_port \[us\]",
    ),
    "a command that ends early": (
        {"newton_port": (TIME[:200], 0 * TIME[:200])},
        r"expected at least 20 s of usable log, got 10.0 s",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_unusable_logs_are_refused_in_words(case):
    changes, message = REFUSED[case]
    with pytest.raises(ValueError, match=message) as caught:
        prepare(circle(TIME, **changes), TWIN)
    assert str(caught.value).startswith("made.csv: ")


def test_short_and_slow_logs_are_refused():
    assert prepare(circle(TIME[:400]), TWIN).rows == 200
    with pytest.raises(ValueError, match=r"expected at least 20 s of usable log, got 17.0 s"):
        prepare(circle(TIME[:341]), TWIN)
    with pytest.raises(ValueError, match="one sample in 100 s"):
        prepare(circle(100.0 * np.arange(300)), TWIN)
    with pytest.raises(ValueError, match=r"got 0.0 s .*x: 1200 gaps, the longest 0.05 s"):
        prepare(circle(TIME), TWIN, Recipe(max_gap=0.04))


def test_no_log_and_the_same_log_twice_are_refused():
    with pytest.raises(ValueError, match="expected at least one log"):
        prepare([], TWIN)
    with pytest.raises(ValueError, match="is given twice; held-out rows would also be training rows"):
        prepare([circle(TIME), circle(TIME)], TWIN)
    same = circle(TIME)
    with pytest.raises(ValueError, match="is given twice"):
        prepare([same, same], TWIN)
    copied = replace(circle(TIME), path=Path("copy.csv"))
    with pytest.raises(ValueError, match="copy.csv holds the same data as .*; held-out rows would also be training"):
        prepare([circle(TIME), copied], TWIN)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"rate": 0.0}, "positive rate"),
        ({"order": 0}, "filter order"),
        ({"shares": (0.5, 0.2, 0.2)}, "add up to 1"),
        ({"guard": -1.0}, "guard"),
        ({"rate": 2.0}, "needs a rate above 2.4 Hz"),
        ({"commands": "guess"}, "'hold' or 'interpolate'"),
    ],
)
def test_recipes_are_checked(wrong, message):
    with pytest.raises(ValueError, match=message):
        Recipe(**wrong)


def test_a_real_gazebo_log():
    data = prepare(read_log(ROOT / "data" / "gazebo_blueboat.csv.gz"), TWIN, WEAK)
    (motion,) = data.motions
    assert motion.time_step == pytest.approx(0.05)
    assert 230.0 < data.seconds < 250.0
    assert np.abs(motion.commands).max() <= 35.0
    # The boat starts with its bow along world x, which is east.
    assert motion.heading[0] == pytest.approx(np.pi / 2, abs=0.05)
    turning = np.gradient(motion.heading, motion.time_step)
    assert np.std(turning - motion.velocity[:, 2]) < 0.005
    north = np.gradient(motion.position[:, 0], motion.time_step)
    u, v = motion.velocity[:, 0], motion.velocity[:, 1]
    made_good = u * np.cos(motion.heading) - v * np.sin(motion.heading)
    assert np.std(north - made_good) < 0.01


def test_real_field_logs_of_a_blueboat():
    logs = sorted(shared("blueboat").glob("log_2*.csv"))
    data = prepare([read_log(path) for path in logs], load_vehicle("blueboat_paper"))
    assert len(data.motions) == len(logs)
    assert data.motions[0].time_step == pytest.approx(0.1)
    assert min(motion.commands.min() for motion in data.motions) > 1000
