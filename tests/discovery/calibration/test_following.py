"""A boat is followed row by row as it is in one go, under the laws; what changes rings, and nothing else does."""

import gc
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from undertow.discovery.calibration.change_watch import (
    AlarmSettings,
    ChangeWatch,
    Detector,
    calibrate_widening,
    with_scatter,
)
from undertow.discovery.calibration.following import (
    AdaptationPrior,
    Follower,
    Update,
    adapt,
    candidates_to_follow,
    followed_by_default,
    learn_prior,
    rehearsed_watch,
)
from undertow.discovery.calibration.forgetting_fit import AdaptSettings
from undertow.discovery.lawful.laws_over import certify
from undertow.physics.errors import RequestError
from undertow.physics.laws.damping_power import Envelope
from undertow.physics.motion import Array, Motion
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import NOISE, World

HULL = load_vehicle("blueboat")
LAGGED = HULL.with_values({"lag": 0.3, "delay": 0.1})
RUN_IN, SETTINGS = 1200, AdaptSettings()


WEAKER = HULL.with_values({"port_scale": 0.7})


@cache
def world(kind: str = "as it is") -> Motion:
    vehicle, becomes = LAGGED if kind == "lagged" else HULL, WEAKER if kind == "weaker" else None
    world = World(vehicle, "rich", 90.0, 3, becomes=becomes, changes_at=70.0 if becomes else 0.0)
    return world.run(NOISE["field"]).motion()


def in_pieces(follower: Follower, motion: Motion, sizes: tuple[int, ...]) -> list[Update]:
    found, at = [], 0
    while at < motion.time.size - 1:
        size = sizes[at % len(sizes)]
        end = motion.time.size if motion.time.size - at - size < 2 else at + size
        found += follower.take(motion.slice(at, end))
        at = end
    return found


def test_pieces_of_any_size_give_what_the_whole_gives():
    motion, names = world("lagged"), ("surge_quadratic_damping", "sway_yaw_coupling", "thruster_asymmetry[port]")
    pool = candidates_to_follow(LAGGED, names)
    known = learn_prior([motion], LAGGED, pool, SETTINGS)
    found = in_pieces(Follower(known), motion, (2, 3, 7, 40))
    whole = adapt(motion, LAGGED, names)
    assert [u.time for u in found] == pytest.approx(whole.time)
    assert np.array([u.values for u in found]) == pytest.approx(whole.values, rel=1e-6, abs=1e-9)
    assert np.array([u.deviation for u in found]) == pytest.approx(whole.deviation, rel=1e-6)


def test_an_update_leaves_nothing_that_python_must_look_for():
    # Forms and their columns that knew each other were taken away by the hundred, in 50 to 150 ms of one update.
    motion, pool = world(), candidates_to_follow(HULL, followed_by_default(HULL))
    follower = Follower(learn_prior([motion], HULL, pool, SETTINGS))
    follower.take(motion.slice(0, 100))
    gc.collect()
    gc.disable()
    try:
        in_pieces(follower, motion.slice(100, 200), (20,))
        assert gc.collect() == 0
    finally:
        gc.enable()


@pytest.mark.parametrize("held", [0.06, 0.0])
def test_intervals_hold_where_numbers_that_are_not_followed_are_off(held: float):
    motion, settings = world(), AdaptSettings(held=held)
    off = {"X_udot": 1.1 * HULL.value("X_udot"), "N_rdot": 0.9 * HULL.value("N_rdot")}
    nominal = HULL.with_values(off)
    pool = candidates_to_follow(nominal, followed_by_default(nominal))
    found = Follower(learn_prior([motion], nominal, pool, settings))
    updates = [u for u in found.take(motion) if u.excited and u.time > 30.0]
    truth = np.array([HULL.value(symbol) for symbol in found.symbols])
    inside = np.mean([np.abs(u.values - truth) <= 1.96 * u.deviation for u in updates], axis=0)
    assert inside.mean() > 0.95 if held else inside.min() < 0.5


def test_after_a_gap_it_begins_a_new_stretch():
    motion, pool = world(), candidates_to_follow(HULL, followed_by_default(HULL))
    known = learn_prior([motion], HULL, pool, SETTINGS)
    follower = Follower(known)
    before, after = follower.take(motion.slice(0, 400)), follower.take(motion.slice(500, 900))
    assert before[-1].time <= motion.time[399] + 1e-9
    assert after[0].time == pytest.approx(motion.time[500] + 1.6)


def test_values_are_lawful_whatever_the_rows_say_and_beyond_the_run_in():
    twisted = HULL.with_values({"N_rr": 0.0, "Y_vv": 0.0})
    pool = candidates_to_follow(twisted, ("sway_yaw_coupling", "sway_linear_damping", "yaw_linear_damping"))
    known = learn_prior([world()], twisted, pool, SETTINGS)
    narrow = replace(known, envelope=Envelope((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)), seconds=60.0)
    follower = Follower(narrow)
    rng = np.random.default_rng(0)
    motion = world()
    shaken = Motion(
        motion.time,
        motion.position,
        motion.heading,
        motion.velocity + [0.0, 0.3, 0.3] * rng.standard_normal(motion.velocity.shape),
        motion.commands,
        motion.thrusters,
    )
    updates = in_pieces(follower, shaken, (100,))
    assert follower._envelope.upper[0] > 0.5, "the envelope of the laws grows with the boat's speed"
    for update in updates[::20]:
        now = twisted.with_values(dict(zip(follower.symbols, update.values.tolist(), strict=True)))
        assert certify(now, narrow.envelope).holds


def test_by_default_damping_and_each_thruster_are_followed():
    assert followed_by_default(HULL)[-2:] == ("thruster_asymmetry[port]", "thruster_asymmetry[stbd]")
    linear = HULL.with_values({"X_uu": 0.0, "Y_vv": 0.0, "N_rr": 0.0})
    assert followed_by_default(linear)[:3] == ("surge_linear_damping", "sway_linear_damping", "yaw_linear_damping")


# The watch


def watched(motion: Motion, hours: float = 24.0) -> list[Update]:
    pool = candidates_to_follow(HULL, followed_by_default(HULL))
    first = motion.slice(0, RUN_IN)
    known = learn_prior([first], HULL, pool, SETTINGS)
    watch = rehearsed_watch([first], known, AlarmSettings(hours))
    return Follower(known, watch).take(motion)


def test_a_weaker_thruster_rings_within_seconds_and_nothing_else_does():
    alarms = [u.alarm for u in watched(world("weaker")) if u.alarm]
    assert len(alarms) == 1
    (alarm,) = alarms
    assert (alarm.symbol, alarm.alike) == ("port_scale", ())
    assert 70.0 < alarm.time < 80.0
    assert alarm.earliest <= alarm.since <= alarm.latest
    assert alarm.since == pytest.approx(70.0, abs=4.0)
    assert alarm.before == pytest.approx(1.0, abs=0.05)
    assert alarm.after == pytest.approx(0.7, abs=0.1)


def blocks(rng: np.random.Generator, count: int, boats: int) -> tuple[list[Array], list[Array]]:
    """Information of blocks, and scores of boats of which nothing happens to, with noise as it is expected."""
    columns = [rng.standard_normal((20, 3)) * [1.0, 3.0, 0.3] for _ in range(count)]
    score = [c.T @ rng.standard_normal((20, boats)) for c in columns]
    return [c.T @ c for c in columns], score


def test_each_ratio_is_that_of_normal_likelihoods():
    rng = np.random.default_rng(2)
    information, score = blocks(rng, 4, 1)
    detector = Detector(np.ones(3))
    for a, b in zip(information, score, strict=True):
        detector.take(a, b)
    for n, first in enumerate(detector.starts):
        for j in range(3):
            # The same with a fourth column, that of the change, and the evidence of both models.
            whole, pull = np.zeros((4, 4)), np.zeros(4)
            for k, (a, b) in enumerate(zip(information, score, strict=True)):
                lift = np.column_stack([np.eye(3), np.eye(3)[:, j] * (k >= first)])
                whole += lift.T @ a @ lift
                pull += lift.T @ b[:, 0]
            prior = np.diag([0.01, 0.01, 0.01, 1.0])

            def evidence(a: Array, b: Array, p: Array) -> float:
                solved = b @ np.linalg.solve(a + p, b)
                return 0.5 * float(solved - np.linalg.slogdet(a + p)[1] + np.linalg.slogdet(p)[1])

            ratio = evidence(whole, pull, prior) - evidence(whole[:3, :3], pull[:3], prior[:3, :3])
            assert detector.logs[n, j, 0] == pytest.approx(ratio, abs=1e-9)


def test_the_budget_is_kept_where_noise_is_as_it_is_taken():
    boats, count, threshold = 4000, 40, 200.0
    information, score = blocks(np.random.default_rng(5), count, boats)
    detector, rung = Detector(np.ones(3), boats=boats), np.zeros(boats, dtype=bool)
    for a, b in zip(information, score, strict=True):
        rung |= detector.take(a, b) >= np.log(threshold)
    assert rung.sum() <= boats * count / threshold
    assert rung.any(), "and is not kept by ringing never"


def followed(count: int) -> AdaptationPrior:
    """Scales of some thrusters, of which a plausible change is one, with rows that count a quarter, 0.2 s apart."""
    pool = candidates_to_follow(HULL, ("thruster_asymmetry[port]", "thruster_asymmetry[stbd]")[:count])
    box = Envelope((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
    known = AdaptationPrior(HULL, pool, SETTINGS, np.ones(3), np.ones(count), box, 60.0)
    assert (SETTINGS.share, SETTINGS.weak.stride, len(known.symbols)) == (0.25, 0.2, count)
    return known


def test_coloured_noise_is_taken_wider_and_white_is_not():
    rng, n = np.random.default_rng(0), 400
    columns = np.zeros((n, 3, 2))
    columns[:, 0] = rng.standard_normal((n, 2))
    known, settings = followed(2), AlarmSettings(hours=1.0)
    noise = rng.standard_normal((n, 3))
    slow = np.repeat(columns[:, 0, :1] * np.repeat(rng.standard_normal(n // 20), 20)[:, None], 3, axis=1)
    assert calibrate_widening(columns, 0.5 * noise, known, settings) == 1.0
    wider = calibrate_widening(columns, 0.5 * noise + 3.0 * slow, known, settings)
    assert wider is not None
    assert wider > 3.0
    assert calibrate_widening(columns[:50], noise[:50], known, settings) is None


def test_scatter_takes_information_off_what_is_known_well():
    information = np.diag([1e4, 1e-2])
    left = with_scatter(information, 0.1) @ information
    assert np.diag(left) == pytest.approx([1.0 / (1e-4 + 1e-2), 1.0 / (1e2 + 1e-2)])


def test_the_watch_forgets_what_it_does_not_need():
    watch = ChangeWatch(followed(1), AlarmSettings(), 1.0)
    rng = np.random.default_rng(1)
    for k in range(20 * 400):
        watch.take(0.2 * k, rng.standard_normal((3, 1)), rng.standard_normal(3))
    assert watch._detector.starts.size < 50
    assert len(watch._begins) < 50


@pytest.mark.parametrize("settings", [{"hours": 0.0}, {"block": -1.0}, {"scatter": float("inf")}])
def test_a_budget_out_of_range_is_refused(settings: dict[str, Any]):
    with pytest.raises(RequestError, match=f"adapt: expected {next(iter(settings))} of the alarm above 0"):
        AlarmSettings(**settings)
