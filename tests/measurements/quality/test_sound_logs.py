"""Sound logs that were refused once: nothing is wrong with them, and the verbs go on."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import shared

from undertow.measurements.inspection import inspect_log
from undertow.measurements.log import Log, read_log
from undertow.measurements.preparation.resampling import jumps_of
from undertow.measurements.quality.checks import sensors
from undertow.measurements.quality.checks.compass_deviation import DEVIATION
from undertow.measurements.quality.checks.limited import _beyond
from undertow.measurements.quality.checks.spikes import SPIKES
from undertow.measurements.quality.checks.stuck import STUCK
from undertow.measurements.quality.faults import (
    OVERWHELMING,
    Fault,
    Kind,
    Share,
    Size,
    blocks_of,
    size_of,
    squared_held_out,
)
from undertow.measurements.quality.lags import unexplained_turning
from undertow.measurements.quality.quick_motion import neutral_of, parts_of, push_range, rates_in_band
from undertow.measurements.quality.record import STEP, Finding, Record
from undertow.physics.motion import body_to_earth
from undertow.physics.vehicle import Vehicle, load_vehicle
from undertow.physics.worlds.manoeuvres import COMMAND_STEP, programme
from undertow.physics.worlds.world import NOISE, Orders, Sensors, World
from undertow.workflows.inputs import read_inputs

DRIVES = ("drive", "limited", "direction", "sides", "clocks")
"""The checks that tell of thrusters and their records."""


def test_an_antenna_ahead_of_the_pivot_is_no_reversed_sway(tmp_path: Path):
    """In turns it goes to the other side, as the stern does."""
    path = World(load_vehicle("blueboat"), "rich", 120.0, 6).run(NOISE["field"]).write(tmp_path / "log.csv")
    log = read_log(path)
    psi, v = log.channels["psi"], log.channels["v"]
    arm = {}
    for name, ahead in (("x", np.cos), ("y", np.sin)):
        place = log.channels[name]
        bow = 1.2 * ahead(np.interp(place.time, psi.time, np.unwrap(psi.value)))
        arm[name] = replace(place, value=place.value + bow)
    assert defects(replace(log, channels={**log.channels, **arm})) == []
    turned = replace(log, channels={**log.channels, "v": replace(v, value=-v.value)})
    assert any("v has the opposite sign" in text for text in defects(turned))


def defects(log: Log) -> list[str]:
    """What refuses a log."""
    return [f.sentence for f in inspect_log(log, load_vehicle("blueboat")).quality if f.verdict == "defect"]


def read(path: Path, vehicle: Vehicle) -> list[Finding]:
    """What accuses a thruster or its record in a log that is not refused."""
    read_inputs(path, vehicle, progress=None)
    quality = inspect_log(read_log(path), vehicle).quality
    return [f for f in quality if f.check in DRIVES and f.verdict in ("defect", "warning")]


@pytest.mark.parametrize(
    "fault",
    [
        "19_sound_log_in_waves_refused",  # waves push surge and yaw together, and one thruster rests for long
        "20_slow_hull_said_not_to_answer",  # its quick motion is noise
        "21_full_throttle_said_frozen",  # one side is saturated, and the other steers
    ],
)
def test_a_sound_log_from_outside_is_not_refused(fault: str):
    folder = shared("faults") / fault
    assert read(folder / "log.csv.gz", load_vehicle(folder / "vehicle.yaml")) == []


@pytest.mark.parametrize("related", [True, False])
def test_the_noise_of_a_gyro_does_not_part_a_slow_ship_from_its_heading(related: bool):
    time, rng = 0.5 * np.arange(2400, dtype=float), np.random.default_rng(4)
    heading = 0.1 * np.sin(0.03 * time) + 0.03 * np.sin(0.11 * time)
    turning = np.gradient(heading, time) if related else 0.006 * np.sin(0.05 * time + 1.0)
    noisy = {"psi": heading + 0.015 * rng.standard_normal(2400), "r": turning + 0.015 * rng.standard_normal(2400)}
    left = unexplained_turning([Log.from_arrays(time, noisy)])
    assert left is not None
    assert left.refuses == (not related)


@pytest.mark.parametrize("noise", ["clean", "field"])
def test_a_log_that_begins_at_the_step_from_rest_accuses_nobody(noise: str, tmp_path: Path):
    hull = load_vehicle("blueboat")
    held = programme(hull, "rich", 121.0, 7)[round(1.0 / COMMAND_STEP) :]
    held[: round(8.0 / COMMAND_STEP)] = 35.0  # full ahead from the first row on
    log = World(hull, duration=120.0, seed=7, orders=Orders(held, 1.0)).run(NOISE[noise])
    assert read(log.write(tmp_path / "log.csv"), hull) == []


@pytest.mark.parametrize(("rate", "verdict"), [(10.0, "warning"), (1.0, "note")])
def test_a_quick_turn_between_the_rows_of_a_slow_record_is_no_spike(rate: float, verdict: str):
    time = np.arange(0.0, 300.0, 1.0 / rate)
    turning = 0.05 * np.sin(0.2 * time)
    turning[time.size // 2] = 0.6
    log = Log.from_arrays(time, {"psi": np.cumsum(turning) / rate, "r": turning, "u": np.ones(time.size)})
    (found,) = SPIKES.examine([Record(log, (), ())])
    assert found.verdict == verdict
    assert (found.fix is None) is (verdict == "note")


def test_noise_of_a_slow_record_is_told_at_its_own_rate(tmp_path: Path):
    """At 10 Hz, on a time base of 20 Hz, differences of neighbours show a fifth of it."""
    hull, level = load_vehicle("otter"), 0.01
    idle = np.zeros((1201, 2))
    sensors = Sensors(speed=level, yaw_rate=level, odometry_rate=10.0)
    log = World(hull, duration=120.0, seed=3, orders=Orders(idle, 0.0)).run(sensors)
    (part,) = parts_of([Record.of(read_log(log.write(tmp_path / "log.csv")), hull)])[2]
    told = part.noise / np.sqrt((part.rates**2).mean(axis=0))
    assert np.all((told > 1.0) & (told < 1.5)), "an upper limit: the filter's band has soft ends"


def test_the_noise_of_the_last_row_does_not_ring_on():
    rng = np.random.default_rng(2)
    velocity = 0.02 * rng.standard_normal((4000, 1))
    modelled = np.full((4000, 1), 0.3) * np.sin(STEP * np.arange(4000))[:, None]
    velocity += np.cumsum(modelled, axis=0) * STEP
    left = rates_in_band(velocity, modelled, (0.05, 1.0))[:, 0]
    ends, middle = (np.sqrt((part**2).mean()) for part in (np.r_[left[:100], left[-100:]], left[500:-500]))
    assert ends < 2.0 * middle


def test_a_share_is_one_for_the_cause_and_none_for_anything_else():
    rng = np.random.default_rng(5)
    cause, other, noise = rng.standard_normal((3, 4000))
    target, block = cause + 0.5 * noise, blocks_of([2000, 2000])
    sizes = [
        size_of(target**2, squared_held_out(target, column[:, None], block), target**2, block)
        for column in (cause, other)
    ]
    assert sizes[0].share.value == pytest.approx(0.8, abs=0.03)  # 1 / (1 + 0.5^2)
    assert sizes[0].share.low > 0.75
    assert sizes[1].share.high < 0.02
    assert [one.refuses for one in sizes] == [True, False]


def test_a_share_of_too_few_blocks_is_never_sure():
    ones, block = np.ones(600), blocks_of([600])
    size = size_of(ones, 0.0 * ones, ones, block)
    assert size.share.value == 1.0
    assert (size.likely, size.refuses) == (True, False)


@pytest.mark.parametrize("which", ["share", "weight"])
def test_the_limit_of_a_size_is_a_knife_edge(which: str):
    ones, block = np.ones(4000), blocks_of([4000])
    for beyond, refused in ((1e-6, True), (-1e-6, False)):
        gain = OVERWHELMING + beyond
        size = size_of(ones, (1.0 - gain) * ones, 0.5 * ones, block)
        if which == "weight":
            size = size_of(gain * ones, 0.0 * ones, ones, block)
        assert size.refuses is refused


@pytest.mark.parametrize(
    ("value", "error", "verdict"),
    [
        (0.9, 0.1, "defect"),
        (0.9, 0.7, "warning"),
        (0.9, 1.0, "note"),
        (0.4, 0.2, "warning"),
        (0.4, 0.5, "note"),
        (0.2, 0.01, None),
        (0.9, np.inf, "warning"),
    ],
)
def test_a_fault_refuses_where_it_is_overwhelming_warns_where_it_is_likely_and_is_else_a_note_or_silent(
    value: float, error: float, verdict: str | None
):
    for size in (Size(Share(value, error), Share(1.0, 0.0)), Size(Share(1.0, 0.0), Share(value, error))):
        told = Fault(Kind.FROZEN, ("pwm_port",), size, {"seconds": 40.0, "push": 7.0}).ruled()
        assert (told and told.verdict) == verdict
        assert told is None or told.refused is (verdict == "defect")


@pytest.mark.parametrize("beyond", [1e-6, -1e-6])
def test_a_fault_without_another_witness_warns_from_half_on_the_mean_on(beyond: float):
    size = Size(Share(0.8, 0.6), Share(0.25 / 0.8 + beyond, 0.1))
    assert (size.likely, size.warns, size.refuses) == (True, beyond > 0.0, False)


def test_what_a_delay_or_a_sign_shows_warns_where_it_likely_explains_a_quarter():
    shares = [Share(0.4, 0.3), Share(0.4, 0.5), Share(0.2, 0.1), Share(0.9, np.inf)]
    assert [one.warns for one in shares] == [True, False, False, False]


FACTS = {
    **dict.fromkeys(
        ("told", "cure", "cause", "late", "order", "reference", "wrong", "moved", "size", "times", "by", "how"), "words"
    ),
    **dict.fromkeys(("change", "unit", "does", "first"), "words"),
    **dict.fromkeys(("seconds", "push", "reach", "fast", "slow", "follows", "shift", "value", "part", "jump"), 1.0),
    "count": 3,
}
"""A value for each place in the words of any kind."""


@pytest.mark.parametrize("kind", list(Kind))
def test_every_kind_has_words_of_its_own_that_take_its_facts(kind: Kind):
    told = Fault(kind, ("u", "v"), Size(Share(0.9, 0.0), Share(0.8, 0.1)), FACTS).in_words("defect")
    assert told.refused
    assert all((told.sentence, told.consequence, told.remedy))
    assert "{" not in f"{told.sentence}{told.short}{told.consequence}{told.remedy}"
    assert Kind(kind.value) is kind, "no two kinds have the same words"


# What accused sound logs once


def moving(time: np.ndarray, psi: np.ndarray, u: np.ndarray, v: np.ndarray, **more: np.ndarray) -> Log:
    north, east = body_to_earth(psi, u, v)
    x, y = (np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (w[1:] + w[:-1]))]) for w in (north, east))
    return Log.from_arrays(time, {"x": x, "y": y, "psi": psi, "u": u, "v": v, "r": np.gradient(psi, time), **more})


@pytest.mark.parametrize(("turned", "verdict"), [(0.0, "cannot tell"), (8.0, "defect")])
def test_a_hull_that_drifts_alike_on_every_heading_is_no_compass_that_deviates(turned: float, verdict: str):
    """Of a deviation, only what changes with the heading is told from a hull that a trim pushes aside."""
    time = np.arange(0.0, 240.0, 0.1)
    psi = np.radians(30.0) * (time // 20.0 + 0.5 * (1.0 + np.tanh(20.0 * ((time % 20.0) / 20.0 - 0.8))))
    u = 1.5 + 0.5 * np.sin(0.2 * time)
    aside = u * np.tan(np.radians(8.0 + turned * np.cos(psi)))
    noise = 0.01 * np.random.default_rng(1).standard_normal(time.size)
    (found,) = DEVIATION.examine([Record.of(moving(time, psi, u, aside + noise))])
    assert found.verdict == verdict
    assert ("may as well be the drift of the hull" in found.sentence) is (verdict == "cannot tell")


@pytest.mark.parametrize(("rests", "verdict"), [(True, "ok"), (False, "warning")])
def test_a_boat_at_rest_whose_receiver_says_0_is_not_stuck(rests: bool, verdict: str):
    time, rng = np.arange(0.0, 120.0, 0.1), np.random.default_rng(2)
    goes = np.where((time < 60.0) | (time > 70.0), 1.0, 0.0) if rests else np.ones(time.size)
    u = goes * (1.0 + 0.4 * np.sin(0.5 * time)) + 0.01 * rng.standard_normal(time.size)
    turning = 0.3 * goes * np.sin(0.9 * time) + 0.003 * rng.standard_normal(time.size)
    u[640:655] = 0.0
    log = Log.from_arrays(time, {"psi": 0.1 * np.cumsum(turning), "r": turning, "u": u, "v": 0.1 * turning})
    assert [f.verdict for f in STUCK.examine([Record.of(log)])] == [verdict]


def test_a_boat_that_spins_is_as_quick_as_one_that_goes_somewhere():
    time = np.arange(0.0, 120.0)
    spins = np.where(time > 70.0, 0.8 * np.exp(0.5j * np.pi * time), 0.8 + 0.3 * (70.0 - time))
    for step, count in ((2.5, 0), (20.0, 1)):
        x, y = np.real(spins) + np.where(time > 30.0, step, 0.0), np.imag(spins)
        log = Log.from_arrays(time, {"x": x, "y": y})
        assert len(jumps_of(log.channels)) == count


@pytest.mark.parametrize(("scale", "large"), [(0.968, False), (0.8, True)])
def test_an_error_that_is_corrected_warns_where_it_is_large(scale: float, large: bool):
    """A gyro on a boat that heels shows 3 % less of the turning, and nothing is wrong with it."""
    time = np.arange(0.0, 300.0, 0.1)
    turning = 0.3 * np.sin(0.4 * time) + 0.1
    psi = np.cumsum(turning) * 0.1
    log = moving(time, psi, np.ones(time.size), 0.0 * time)
    log = replace(log, channels={**log.channels, "r": replace(log.channels["r"], value=scale * np.gradient(psi, time))})
    found = [f for f in sensors.SENSORS.examine([Record.of(log)]) if "the gyro shows" in f.sentence]
    assert [f.verdict for f in found] == ["warning" if large else "note"]


def test_rests_at_one_value_that_is_not_most_of_them_show_no_neutral():
    time = np.arange(0.0, 60.0, 0.1)
    for first, known in ((7.0, True), (5.8, False)):  # of 10 s at rest, and 2 s until each is steady
        pwm = np.where(time < 40.0, 1600.0 + 100.0 * np.sin(time), np.where(time < 40.0 + first, 1500.0, 1540.0))
        u = np.where(time < 40.0, 1.0, 0.0)
        pwm[time >= 50.0], u[time >= 50.0] = 1700.0, 1.0
        log = Log.from_arrays(time, {"psi": 0.0 * time, "r": 0.0 * time, "u": u, "v": 0.0 * time, "pwm_port": pwm})
        assert (neutral_of([Record.of(log)], "pwm_port") is not None) is known


def test_a_thruster_strays_from_its_mean_by_half_of_its_range_at_most(tmp_path: Path):
    hull = load_vehicle("blueboat")
    log = World(hull, duration=30.0, seed=3, orders=Orders(np.zeros((601, 2)), 0.0)).run(NOISE["clean"])
    newtons, made = push_range([Record.of(read_log(log.write(tmp_path / "log.csv")), hull)], hull.thrusters[0].channel)
    assert newtons == pytest.approx(35.0), "from -35 to 35 N"
    assert made[0] == pytest.approx(1.0 / (hull.value("mass") - hull.value("X_udot")), rel=1e-6)


@pytest.mark.parametrize(("there", "told"), [(0.9, True), (1.2, False)])
def test_a_vehicle_that_leaves_more_than_there_is_tells_of_no_limit(there: float, told: bool):
    extreme = np.arange(60) < 30
    left, block = np.where(extreme, there, 0.1), np.arange(60) // 5
    found = _beyond(left, np.ones(60), extreme, ~extreme, 0.0, block)
    assert (found is not None) is told


@pytest.mark.parametrize(("share", "weight", "left"), [(0.42, 4.0, 5.52), (0.9, 0.9, 0.1), (0.0, 0.0, np.inf)])
def test_what_a_fault_leaves_tells_whether_anything_is_explained(share: float, weight: float, left: float):
    """A vehicle that leaves ten times what there is leaves less with weaker commands, mixed or not."""
    assert Size(Share(share, 0.05), Share(weight, 0.1)).leaves == pytest.approx(left, abs=0.01)
